"""The robot of a command: its joints are those that the recordings hold."""

import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.robot import Robot


def held_positions(words: Sequence[str]) -> dict[str, float]:
    """Positions of joints to hold by name [rad or m], from words such as "finger=0.02".

    Raises:
        InputError: A word that is not a name and a number, or a name twice.
    """
    hold: dict[str, float] = {}
    for word in words:
        name, _, value = word.rpartition("=")
        try:
            if not name or name in hold:
                raise ValueError
            hold[name] = float(value)
        except ValueError:
            raise InputError(
                f"--hold {word}: allowed is the name of a joint and its position [rad or m], once each, as in --hold "
                "finger=0.02"
            ) from None
    return hold


def recorded_robot(
    model: pathlib.Path | None,
    recordings: Sequence[pathlib.Path],
    columns: pathlib.Path | None,
    hold: dict[str, float],
    fix_base: bool,
) -> "Robot":
    """The robot of the joints that the recordings hold; all others of the model stand still.

    Args:
        model: MJCF or URDF file; None is the IRB 140.
        recordings: The recordings.
        columns: The map of their columns.
        hold: Positions of joints to hold by name [rad or m].
        fix_base: Whether a floating base stands still.

    Raises:
        InputError: The model can't be read, or the recordings don't hold the same joints.
    """
    from irb140_jax.recordings import common_joints
    from irb140_jax.robot import irb140_path, load_robot, movable_joints

    path = model or irb140_path()
    known = tuple(name for name in movable_joints(path) if name not in hold)
    joints = common_joints(recordings, columns, known)
    # Of a recording without any of the joints, reading says what is missing.
    return load_robot(path, joints or None, hold, fix_base)
