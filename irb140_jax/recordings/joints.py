"""Which joints of a model recordings hold: those make the robot that is diagnosed."""

import pathlib
from collections.abc import Sequence

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.columns import closest
from irb140_jax.recordings.read import named_columns, recorded_joints, unchecked_recording

Path = str | pathlib.Path


def common_joints(paths: Sequence[Path], columns: Path | None, known_joint_names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the known joints which all files hold, in the order in which they are known; none if none is held.

    Args:
        paths: The recordings.
        columns: The TOML file that maps their columns, or None.
        known_joint_names: Every joint that the model can have.

    Raises:
        RecordingError: The files hold different joints, or one of them half a joint: a position without a torque where
            others have both, a torque without a position, or one under a name that is nearly a joint's.
    """
    first, joints = paths[0], recorded_joints(paths[0], columns, known_joint_names)
    for path in paths:
        others = recorded_joints(path, columns, known_joint_names)
        _refuse_halves(path, columns, known_joint_names, others)
        if others != joints:
            apart = ", ".join(sorted(set(joints) ^ set(others)))
            raise RecordingError(f"{path}: holds other joints than {first} does ({apart} in one of them only); give "
                                 "recordings of the same joints, or leave out with --hold NAME=VALUE those that stood "
                                 "still in all")
    return joints


def _refuse_halves(path: Path, columns: Path | None, known: tuple[str, ...], joints: tuple[str, ...]) -> None:
    table, _ = named_columns(path, columns, known)
    if not joints:
        return
    for name in known:
        if name not in joints and f"tau.{name}" in table:
            raise RecordingError(f"{path}: missing column q.{name}, while there is tau.{name}; add it, rename it, or "
                                 "map it with --columns FILE.toml")
    silent = tuple(name for name in known if name not in joints and f"q.{name}" in table)
    if silent:
        raise RecordingError(f"{path}: missing column tau.{silent[0]}, while there is q.{silent[0]}; add it or, if the "
                             f"joint stood still, hold it there: {_to_hold(path, columns, silent, known)}")
    missing = [name for name in known if name not in joints]
    for column in table:
        other = column.removeprefix("q.")
        if other != column and f"tau.{other}" in table and other not in known and (near := closest(other, missing)):
            raise RecordingError(f"{path}: holds joint '{other}', which the model has not{near}")


def _to_hold(path: Path, columns: Path | None, silent: tuple[str, ...], known: tuple[str, ...]) -> str:
    """The options that hold joints where the recording has them on average."""
    read = unchecked_recording(pathlib.Path(path), silent, columns, torque="optional", known_joints=known)
    q = read.q.mean(axis=0)
    return " ".join(f"--hold {name}={value:.5g}" for name, value in zip(silent, q, strict=True))
