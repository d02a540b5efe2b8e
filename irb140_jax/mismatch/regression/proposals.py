"""Shapes that the recordings themselves suggest, for effects whose grid of shapes would be too large to search."""

from collections.abc import Callable, Sequence

import numpy as np

from irb140_jax.effects import Effect, LeftOver, Scales
from irb140_jax.mismatch.columns.along import Prepared, without
from irb140_jax.mismatch.columns.candidates import Library, library, reshaped
from irb140_jax.mismatch.regression.assemble import Data, assembled
from irb140_jax.mismatch.regression.gaussian import layouts
from irb140_jax.mismatch.regression.noise import spread
from irb140_jax.mismatch.regression.rows import Stretch, candidate_rows, stretch
from irb140_jax.recordings.low_pass import Band

THIN = 2  # every second of them in a scan; the search then sees all rows
AT_ONCE = 64  # candidates of a scan in one product: fast, and not much memory
MOST_ROWS = 2000  # thinned to so many: shapes are found from what is large and slow


def with_proposals(
    lib: Library, along: Sequence[Prepared], band: Band, factor: np.ndarray, uncertainty: float, scales: Scales
) -> Library:
    """The library with shapes from what inertials and ordinary friction leave, before anything rarer is tried.

    Without it, the first search would explain a push or a wall by whatever else is in the library.
    """
    effects = [block[0] for block in lib.blocks]
    ordinary = [e for e in effects if e.prior.ordinary]
    beside = [e for e in effects if any(e.slug in o.shapes.beside for o in effects)]
    plain = library(lib.robot, ordinary + beside, scales)
    data = assembled(plain, [stretch(plain, r, i, band, factor) for i, r in enumerate(along)], uncertainty)
    columns = np.arange(data.nuisances + library(lib.robot, ordinary, scales).size)
    noise = np.array([[_rms(s.y[s.use[:, j], j]) for j in range(lib.robot.n)] for s in data.stretches])
    for _ in range(2):  # the first noise holds what friction explains
        left = left_over(data, columns, noise)
        size = [[_rms(left.residual[(left.recording == r) & (left.weight[:, j] > 0), j])
                 for j in range(lib.robot.n)] for r in range(len(along))]  # fmt: skip
        noise = noise * np.array(size)
    left = left_over(data, columns, noise)
    free = np.arange(data.nuisances + plain.size)
    best = _scanned(lib, along, band, scales, left_over(data, free, noise))
    shapes = [
        np.stack([
            e.shapes.around(best[e.slug, tuple(joints)]) if e.shapes.around and (e.slug, tuple(joints)) in best
            else suggested(e, left, scales, joints, old[s]) for s, joints in enumerate(sites)
        ])
        for e, sites, old, _ in lib.blocks
    ]  # fmt: skip
    return reshaped(lib, shapes)


def _scanned(
    lib: Library, along: Sequence[Prepared], band: Band, scales: Scales, left: LeftOver
) -> dict[tuple[str, tuple[int, ...]], np.ndarray]:
    """The best shape of each effect that has a scan, by effect and site."""
    scanning = [e for e, *_ in lib.blocks if e.shapes.scan]
    many = library(lib.robot, scanning, scales, scan=True)
    X = _thin_columns(many, along, band)
    left = left.every(THIN)
    best: dict[tuple[str, tuple[int, ...]], tuple[float, np.ndarray]] = {}
    for group in layouts(many.candidates, 0):
        for some in np.array_split(np.arange(len(group.which)), -(-len(group.which) // AT_ONCE)):
            gains, w = left.gains(np.moveaxis(X[..., group.columns[some]], 2, 0))
            for i, gain, amplitudes in zip(group.which[some], gains, w, strict=True):
                c = many.candidates[int(i)]
                key, inside = (c.slug, c.joints), np.all((amplitudes >= c.lowest) & (amplitudes <= c.highest))
                if inside and gain > best.get(key, (0.0,))[0]:
                    best[key] = (float(gain), c.shape)
    return {key: shape for key, (_, shape) in best.items()}


def _thin_columns(lib: Library, along: Sequence[Prepared], band: Band) -> np.ndarray:
    """Columns of a library at the rows that a scan looks at, shape (rows, n, size)."""
    every, thin, endless = [], _thin([len(band.kept(len(a.recording.t))) for a in along]), [np.zeros(0, dtype=int)]
    for i, a in enumerate(along):
        for window, columns, bad in candidate_rows(lib, a, i, band):
            every.append(columns[-window.new % thin :: thin].copy())  # a view would keep the whole window
            endless.append(bad)
    columns = without(lib.entries[1], np.concatenate(every)[::THIN], np.concatenate(endless))
    out = np.zeros((len(columns), lib.robot.n, lib.size))
    lib.spread(columns, out)
    return out


def _thinned(stretches: Sequence[Stretch], part: Callable[[Stretch], np.ndarray]) -> np.ndarray:
    """An array of all recordings' rows, thinned to what proposals need."""
    thin = _thin([len(s.t) for s in stretches])
    return np.concatenate([part(s)[::thin] for s in stretches])


def _thin(rows: Sequence[int]) -> int:
    """Every how many rows of recordings of so many proposals look at one."""
    return max(1, sum(rows) // MOST_ROWS)


def suggested(
    effect: Effect, left: LeftOver, scales: Scales, joints: np.ndarray, otherwise: np.ndarray
) -> np.ndarray:
    """The shapes that an effect finds in what is left, or else those it had."""
    shapes = effect.shapes.proposal(left, scales, joints) if effect.shapes.proposal else None
    return otherwise if shapes is None else shapes


def left_over(data: Data, columns: np.ndarray, noise: np.ndarray) -> LeftOver:
    """What some columns leave of the recordings.

    Args:
        data: Rows of all recordings.
        columns: Which columns explain them so far; their amplitudes stay free.
        noise: Standard deviation of each joint's noise, shape (recordings, n) [N m or N].
    """
    join = lambda name: _thinned(data.stretches, lambda s: getattr(s, name))  # noqa: E731
    recording = _thinned(data.stretches, lambda s: np.full(len(s.t), s.recording))
    t = _thinned(data.stretches, lambda s: s.t - s.begin)
    level = np.maximum(noise, 1e-9)[recording]
    weight = np.where(join("use"), 1.0 / (level * spread(join("unsure"), level)), 0.0)
    X = _thinned(data.stretches, lambda s: s.of(columns)) * data.scale[columns]
    return LeftOver(
        recording, t, join("q"), join("tool"), join("tool_jacobian"), weight, join("y") * weight, X * weight[..., None]
    )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else 1.0
