"""What an explanation leaves of the recordings, for effects that look for their shape in it."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import linalg


@dataclasses.dataclass(frozen=True)
class LeftOver:
    """Rows of all recordings, and the columns whose amplitudes are still to be fitted beside anything new.

    Attributes:
        recording: Number of each row's recording, shape (R,).
        t: Time since that recording began [s], shape (R,).
        q: Joint positions [rad or m], shape (R, n).
        tool: Position of the tool in the world [m], shape (R, 3).
        tool_jacobian: Velocity and angular velocity of the tool per joint speed, shape (R, n, 6).
        weight: One over the standard deviation of the noise; 0 for rows that don't count, shape (R, n).
        y: Torque that the nominal model leaves, in standard deviations, shape (R, n).
        known: Columns of what explains it so far, in standard deviations per prior unit, shape (R, n, k).
    """

    recording: Int[np.ndarray, " R"]
    t: Float[np.ndarray, " R"]
    q: Float[np.ndarray, "R n"]
    tool: Float[np.ndarray, "R 3"]
    tool_jacobian: Float[np.ndarray, "R n 6"]
    weight: Float[np.ndarray, "R n"]
    y: Float[np.ndarray, "R n"]
    known: Float[np.ndarray, "R n k"]

    def every(self, step: int) -> "LeftOver":
        """Every so many rows: enough for what is large and slow."""
        return dataclasses.replace(self, **{f.name: getattr(self, f.name)[::step] for f in dataclasses.fields(self)})

    @cached_property
    def _half(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangular factor L of the known columns' posterior precision L L', and L^-1 known' y.

        By an orthogonal decomposition: where columns are equal to many digits, their products are no longer positive.
        """
        B = self.known.reshape(-1, self.known.shape[-1])
        half = np.asarray(np.linalg.qr(np.concatenate([B, np.eye(B.shape[1])]), mode="r")).T
        return half, linalg.solve_triangular(half, B.T @ self.y.ravel(), lower=True)

    @cached_property
    def residual(self) -> Float[np.ndarray, "R n"]:
        """What is left once the known columns are fitted, in standard deviations, shape (R, n)."""
        half, b = self._half
        return self.y - self.known @ linalg.solve_triangular(half.T, b, lower=False)

    def gains(
        self, columns: Float[np.ndarray, "C S n k"], rows: Bool[np.ndarray, " R"] | None = None
    ) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, "C k"]]:
        """Log likelihood that each of C candidates would gain beside the known columns, and its amplitudes.

        Args:
            columns: Torque per unit of each amplitude [N m or N], shape (C, rows, n, k).
            rows: Which rows those are, where the columns are zero in all others.
        """
        part = slice(None) if rows is None else rows  # a mask copies, and these are large
        C, _, _, k = columns.shape
        flat = (columns * self.weight[part][..., None]).reshape(C, -1, k)
        B, y = self.known[part].reshape(-1, self.known.shape[-1]), self.y[part].ravel()
        stacked = flat.transpose(1, 0, 2).reshape(len(y), C * k)
        own = np.einsum("cri,crj->cij", flat, flat)
        return self._gained(own, (B.T @ stacked).reshape(-1, C, k), (stacked.T @ y).reshape(C, k))

    def gains_within(
        self, columns: Float[np.ndarray, "S n k"], first: Int[np.ndarray, " C"], last: Int[np.ndarray, " C"],
        rows: Bool[np.ndarray, " R"],
    ) -> Float[np.ndarray, " C"]:  # fmt: skip
        """As `gains`, of candidates that are the same columns from one row up to another and zero elsewhere.

        Args:
            columns: Torque per unit of each amplitude [N m or N], shape (rows, n, k).
            first, last: Each candidate's first row, and the one behind its last.
            rows: Which rows those are.
        """
        white = columns * self.weight[rows][..., None]
        pairs = ("tni,tnj->tij", white), ("tnj,tni->tij", self.known[rows]), ("tn,tni->ti", self.y[rows])
        sums = [np.cumsum(np.einsum(how, other, white, optimize=True), axis=0) for how, other in pairs]
        own, shared, told = (np.concatenate([np.zeros_like(x[:1]), x]) for x in sums)
        between = lambda x: x[last] - x[first]  # noqa: E731
        return self._gained(between(own), between(shared).transpose(2, 0, 1), between(told))[0]

    def _gained(self, own: np.ndarray, shared: np.ndarray, told: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gains and amplitudes from products of columns with themselves, the known ones (m, C, k), and y."""
        (half, b), (m, C, k) = self._half, shared.shape
        parts = linalg.solve_triangular(half, shared.reshape(m, C * k), lower=True).reshape(m, C, k)
        G = own - np.einsum("mci,mcj->cij", parts, parts, optimize=True)
        g = told - np.einsum("mci,m->ci", parts, b)
        ridge = 1e-6 * np.trace(own, axis1=1, axis2=2)[:, None, None] * np.eye(k) + 1e-12 * np.eye(k)
        w = np.linalg.solve(G + ridge, g[..., None])[..., 0]
        return 0.5 * np.einsum("ci,ci->c", g, w), w
