"""What a robot's log holds, and how it is written down."""

import dataclasses
import hashlib
import os
import pathlib

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.payload import Payload
from irb140_jax.tables import table_html

WRITABLE = (".csv", ".parquet", ".npz")


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """One recording, in SI units, columns in the order of the robot's joints.

    Attributes:
        t: Time [s], shape (T,), strictly rising; the rate may jitter.
        q: Joint positions [rad or m], shape (T, n).
        tau: Logged joint torques [N m or N], shape (T, n); all NaN where none was logged, as in a planned motion.
        joint_names: Names of the joints, in the order of the columns.
        qd: Logged joint velocities [rad/s or m/s], shape (T, n); None where they were not logged for every joint.
        qdd: Logged joint accelerations [rad/s^2 or m/s^2], shape (T, n); None likewise.
        extras: Every other column by its name, shape (T,); may hold NaN.
        source: File name, for messages.
        notes: Repairs made and oddities seen, one plain sentence each.
        file_t: Time of every row of the file, those that reading left out included [s]; None where it left out none.
        sha256: Of the file it was read from; empty where it comes from none.
        torque_lost: Rows in which a channel that a joint's torque depends on is dead or frozen, shape (T, n); None
            where none is.
        qdes: Commanded positions of a log that has them in place of torque [rad or m], shape (T, n), else None; `tau`
            is then NaN until `recordings.servo` makes it.
        qddes: Commanded velocities of such a log [rad/s or m/s], shape (T, n), or None.
        drive: What is stated of the drives of such a log, or None.
        path: The file it was read from, as it was named; empty where it comes from none.
        payload: A body of known mass that the tool carried and the model does not hold, or None.
    """

    t: Float[np.ndarray, " T"]
    q: Float[np.ndarray, "T n"]
    tau: Float[np.ndarray, "T n"]
    joint_names: tuple[str, ...]
    qd: Float[np.ndarray, "T n"] | None = None
    qdd: Float[np.ndarray, "T n"] | None = None
    extras: dict[str, Float[np.ndarray, " T"]] = dataclasses.field(default_factory=dict)
    source: str = "recording"
    notes: tuple[str, ...] = ()
    file_t: Float[np.ndarray, " rows"] | None = None
    sha256: str = ""
    torque_lost: Bool[np.ndarray, "T n"] | None = None
    qdes: Float[np.ndarray, "T n"] | None = None
    qddes: Float[np.ndarray, "T n"] | None = None
    drive: Drive | None = None
    path: str = ""
    payload: Payload | None = None

    def __post_init__(self) -> None:
        shape = (len(self.t), len(self.joint_names))
        for name in ("q", "tau", "qd", "qdd", "qdes", "qddes"):
            value = getattr(self, name)
            if value is not None and value.shape != shape:
                raise RecordingError(f"{self.source}: {name} has shape {value.shape}; allowed is (T, n) = {shape}, one "
                                     "row a sample and one column a joint")

    def _repr_html_(self) -> str:
        """Ranges of the joints as a table, for notebooks."""
        span = lambda x: f"{np.min(x):.4g} to {np.max(x):.4g}"  # noqa: E731
        rows = [(name, span(self.q[:, j]), span(self.tau[:, j]) if self.has_torque else "none")
                for j, name in enumerate(self.joint_names)]  # fmt: skip
        duration = float(self.t[-1] - self.t[0]) if len(self.t) else 0.0
        said = f"{self.source}: {len(self.t)} rows, {duration:.4g} s. {' '.join(self.notes)}"
        return table_html(("joint", "position [rad or m]", "torque [N m or N]"), rows, said)

    @property
    def has_torque(self) -> bool:
        """Whether torque was logged; a planned motion has none."""
        return not np.isnan(self.tau).all()

    @property
    def is_servo_log(self) -> bool:
        """Whether commanded positions stand in the place of torque."""
        return self.qdes is not None


def rows_of(recording: Recording, rows: slice, source: str | None = None) -> Recording:
    """The samples `rows` of a recording, under the same name unless `source` gives another."""
    cut = lambda x: None if x is None else x[rows]  # noqa: E731
    return dataclasses.replace(
        recording, t=recording.t[rows], q=recording.q[rows], tau=recording.tau[rows], qd=cut(recording.qd),
        qdd=cut(recording.qdd), extras={k: v[rows] for k, v in recording.extras.items()},
        source=recording.source if source is None else source, file_t=None, sha256="", path="",
        torque_lost=cut(recording.torque_lost), qdes=cut(recording.qdes), qddes=cut(recording.qddes),
    )


def content_hash(recording: Recording) -> str:
    """SHA-256 of time, positions and torque: the same for the same log, whatever its file is called or written as."""
    digest = hashlib.sha256(" ".join(recording.joint_names).encode())
    for numbers in (recording.t - recording.t[0], recording.q, recording.tau):
        digest.update(np.ascontiguousarray(numbers, dtype="<f8").tobytes())
    return digest.hexdigest()


def recording_columns(recording: Recording) -> dict[str, Float[np.ndarray, " T"]]:
    """The columns of a recording by their contract names: t, q.<joint>, qd.<joint>, qdd.<joint>, tau.<joint> or
    qdes.<joint>, extras."""
    columns = {"t": recording.t}
    for name in ("q", "qd", "qdd", "qdes", "qddes", "tau"):
        value = getattr(recording, name)
        logged = name != "tau" or (recording.has_torque and not recording.is_servo_log)
        if value is not None and logged:
            columns |= {f"{name}.{joint}": value[:, i] for i, joint in enumerate(recording.joint_names)}
    return columns | recording.extras


def write_recording(recording: Recording, path: str | pathlib.Path) -> pathlib.Path:
    """Write a recording as CSV, Parquet or NPZ, by the suffix of `path`; whole or not at all.

    Raises:
        RecordingError: The suffix is none of these.
    """
    path = pathlib.Path(path)
    if path.suffix not in WRITABLE:
        raise RecordingError(f"{path}: can't write a recording as '{path.suffix}'; allowed is {', '.join(WRITABLE)}")
    columns = recording_columns(recording)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The suffix must survive: numpy appends its own where it is missing.
    unfinished = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        if path.suffix == ".npz":
            np.savez_compressed(unfinished, **columns)  # pyright: ignore[reportArgumentType]
        elif path.suffix == ".parquet":
            pd.DataFrame(columns).to_parquet(unfinished, index=False)
        else:
            pd.DataFrame(columns).to_csv(unfinished, index=False)
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path
