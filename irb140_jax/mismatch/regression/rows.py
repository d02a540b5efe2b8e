"""Rows of a recording to fit: all columns and the torque they should add up to, both through the low-pass."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.columns.along import Loads, Prepared, columns_along
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.regression.tangent import Point, counted_twice, logged, regressor
from irb140_jax.recordings.low_pass import Band


@dataclasses.dataclass(frozen=True)
class Stretch:
    """A stretch of one recording, low-passed: for each joint its rows of all columns and of the torque residual.

    Attributes:
        recording: Index of the recording it belongs to.
        t: Time of the rows [s], shape (R,).
        begin: Time at which the recording begins [s].
        X: Columns [inertials | amplitudes | loose inertials] per joint, (R, n, 10 n + size + 10 n); inertials twice, in
            units of their prior at relative standard deviation 1.
        y: What the columns should add up to, (R, n): logged minus nominal torque, and what the last explanation says of
            products of its unknowns; see `tangent`.
        rigid: Columns of the inertials under the model's own gravity and before the log, (R, n, 10 n).
        tau: Logged torque, low-passed, (R, n).
        nominal: Nominal torque, low-passed, (R, n).
        unsure: Standard deviation that the samples of the log leave open of tau, (R, n); see `Conditioned`.
        use: Rows in which the joint moves and nothing is lost, (R, n).
        q, qd, qdd: Motion at the rows, (R, n), for maps and the flexible competitor.
        motion, repeats: Which motion it is of, and of how many recordings that is; see `Conditioned`.
        tool, tool_jacobian: Where the tool is and how joints move it, (R, 3) and (R, n, 3); see `RigidBody`.
    """

    recording: int
    t: np.ndarray
    begin: float
    X: np.ndarray
    y: np.ndarray
    rigid: np.ndarray
    tau: np.ndarray
    nominal: np.ndarray
    unsure: np.ndarray
    use: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tool: np.ndarray
    tool_jacobian: np.ndarray
    motion: int = -1
    repeats: int = 1

    def of_rigid_body(self, columns: np.ndarray) -> "Stretch":
        """With nothing but these columns, all of inertials, as they are without any explanation."""
        k = self.rigid.shape[-1]
        own = np.where(columns < k, columns, columns - (self.X.shape[-1] - k))
        return dataclasses.replace(self, X=self.rigid[..., own], y=self.tau - self.nominal)


def stretch(
    lib: Library, along: Prepared, index: int, band: Band, factor: np.ndarray, loads: Loads | None = None,
    at: Point | None = None,
) -> Stretch:  # fmt: skip
    """All columns of a recording through the common low-pass, at the kept samples.

    Args:
        lib: The library.
        along: The recording.
        index: Its number.
        band: Of the comparison.
        factor: Square root of the inertial prior, shape (10 n, 10 n).
        loads: See `columns_along`.
        at: Of the last explanation, if there is one.
    """
    upright, nominal, _, columns = columns_along(lib, along, loads, index)
    recording, k = along.recording, len(factor)
    kept = band.kept(len(recording.t))
    Y, base, twice = upright, nominal, np.zeros_like(nominal)
    if at and loads and not at.plain:
        n, dt = lib.robot.n, float(np.mean(np.diff(recording.t)))
        Y = regressor(at, recording, upright)
        base = logged(at, nominal - (Y - upright) @ at.dphi, np.arange(n), dt)
        Y = logged(at, Y.reshape(len(Y), -1), np.repeat(np.arange(n), k), dt).reshape(Y.shape)
        columns = logged(at, columns, np.where(lib.in_log, -1, lib.entries[0]), dt)
        twice = counted_twice(at, loads, dt)
    rigid = band.apply(upright) @ factor
    X = np.zeros((len(kept), lib.robot.n, k + lib.size + k))
    X[..., :k] = X[..., -k:] = rigid if Y is upright else band.apply(Y) @ factor
    lib.spread(band.apply(columns), X[..., k:-k])
    nominal, tau = band.apply(nominal), band.apply(recording.tau)
    y = tau - band.apply(base) + band.apply(twice)
    return Stretch(
        index, recording.t[kept], recording.began, X, y, rigid, tau, nominal, recording.unsure[kept],
        recording.usable[kept], recording.q[kept], recording.qd[kept], recording.qdd[kept],
        np.asarray(along.rigid.tool)[kept], np.asarray(along.rigid.tool_jacobian)[kept], recording.motion,
        recording.repeats,
    )  # fmt: skip
