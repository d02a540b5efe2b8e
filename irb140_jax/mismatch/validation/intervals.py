"""Physical parameters of a finding, and how well the data know them."""

from collections.abc import Callable

import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.effects.grids import nearest_in_each_direction
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.proposals import left_over
from irb140_jax.mismatch.result import Estimate
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.robot import Robot

NEIGHBOURS = 12  # shapes around the named one that tell how finely its grid resolves each parameter
SMALL = 1e-6  # of an amplitude's prior: step of a slope
FAR = 1e5  # steps of the grid: prior standard deviation of a shape where nothing is known of it


def parameters_of(
    robot: Robot, ex: Explanation, index: int, w: np.ndarray, cov: np.ndarray, unexplained: np.ndarray
) -> dict[str, Estimate]:
    """Physical parameters and their standard deviations: amplitudes at the named shape, and the shape's own doubt.

    Args:
        robot: The nominal model.
        ex: The explanation.
        index: The finding among its candidates.
        w: Amplitudes of the finding, shape (k,).
        cov: Their covariance, shape (k, k).
        unexplained: RMS of the structure on each joint that no effect explains, shape (n,) [N m or N].

    Returns:
        By the parameter's name, in SI units.
    """
    c = ex.data.candidates[index]
    value = physical_of(c, w)
    over_shapes = np.maximum(_variance_over_shapes(ex, index, value), _variance_about_shape(ex, index, w))
    cov = cov + _of_form(ex, c, w, unexplained)
    w, cov = _of_all_columns(ex, index, w, cov)
    if index in ex.falls:
        # What makes it what it is counts as the speed nears zero, where the discrepancy counts, too.
        own = np.array(c.effect.law.own)
        cov[own, own] += ex.falls[index].at_rest ** 2
    physical = lambda w: np.asarray(c.effect.law.physical(on_device(w), on_device(c.shape)))  # noqa: E731
    variance = _variance_of(physical, w, cov, value) + over_shapes
    variance = variance + _variance_over_variants(ex, index, value)
    if c.effect.prior.of_rigid_body:
        variance = variance + (value * _inertial_doubt(ex, c)) ** 2
    if c.effect.shapes.alike:
        alike = c.effect.shapes.alike(left_over(ex.data, np.zeros(0, dtype=int), ex.noise.total), w, c.shape)
        variance = variance + np.sum((alike - value) ** 2, axis=0) / 2.0
    slide = robot.is_slide[c.joints[0]]
    return {
        parameter.name: Estimate(float(x), float(np.sqrt(max(v, 0.0))), parameter.unit_of(slide))
        for parameter, x, v in zip(c.effect.law.parameters, value, variance, strict=True)
    }


def _of_form(ex: Explanation, c: Candidate, w: np.ndarray, unexplained: np.ndarray) -> np.ndarray:
    """Covariance of amplitudes (k,) where the law is of another form, or took what no effect explains for its own.

    A misfit that looks like the law itself is in no discrepancy: `USUAL_MISFIT` of an empirical law's own torque.  And
    friction, like any empirical law, may hold as much of a structure that no effect explains as is left of it.  Any
    torque that the columns have is equally probable.
    """
    columns, law = ex.data.nuisances + c.columns, c.effect.law
    X = np.concatenate([s.of(columns, j)[s.use[:, j]] for s in ex.data.stretches for j in c.joints])
    G = X.T @ X
    energy = settings.USUAL_MISFIT**2 * float(w @ G @ w) if law.empirical else 0.0
    if len(c.joints) == 1 and (law.empirical or c.effect.place.is_friction):  # of several joints others tell, too
        energy += float(unexplained[c.joints[0]]) ** 2 * len(X)
    return energy / len(w) * np.linalg.pinv(G, rcond=1e-9, hermitian=True)


def _variance_of(
    physical: Callable[[np.ndarray], np.ndarray], w: np.ndarray, cov: np.ndarray, value: np.ndarray
) -> np.ndarray:
    """Mean square of what physical parameters are off by, their amplitudes being normal.

    By points at plus and minus sqrt(n) standard deviations along each axis (spherical cubature), exact to third order:
    a slope would be sure of the size of a tilt of which only one component shows.

    Source: Arasaratnam and Haykin, IEEE Trans. Automatic Control 54(6) (2009), cubature rule of third degree.
    """
    size, axes = np.linalg.eigh(cov)
    steps = (np.sqrt(len(w) * np.maximum(size, 0.0)) * axes).T
    return np.mean([(physical(w + step) - value) ** 2 for step in (*steps, *-steps)], axis=0)


def _of_all_columns(ex: Explanation, index: int, w: np.ndarray, cov: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes and covariance of all columns of an effect: those unused are zero but for what the data leave open.

    Of a vector's components those that move nothing are zero, too, give or take `UNSEEN` times what the others are.
    """
    c = ex.data.candidates[index]
    width = c.effect.law.width
    columns = c.columns[0] - c.variant[0] + np.arange(width)
    H = ex.near(ex.chosen, columns)
    scale = ex.data.scale[ex.data.nuisances + columns]
    full, spread = np.zeros(width), np.diag(scale**2 / (1.0 + np.diag(H)[:-1]))
    used = list(c.variant)
    full[used] = w
    spread[used] = spread[:, used] = 0.0
    spread[np.ix_(used, used)] = cov
    unseen = scale == 0.0
    if c.effect.prior.vector and unseen.any() and not unseen.all():
        spread[unseen, unseen] = settings.UNSEEN**2 * np.mean(full[~unseen] ** 2)
    return full, spread


def physical_of(c: Candidate, w: np.ndarray) -> np.ndarray:
    """Physical parameters from the amplitudes that a candidate uses."""
    full = np.zeros(c.effect.law.width)
    full[list(c.variant)] = w
    return np.asarray(c.effect.law.physical(on_device(full), on_device(c.shape)))


def _variance_over_shapes(ex: Explanation, index: int, value: np.ndarray) -> np.ndarray:
    """Variance of the physical parameters over the refined grid of shapes, amplitudes fitted anew at each.

    Args:
        ex: The explanation.
        index: The finding.
        value: Its physical parameters.
    """
    c = ex.data.candidates[index]
    if not c.effect.shapes.finer:
        return np.zeros(len(value))
    alike = [
        i
        for i, o in enumerate(ex.data.candidates)
        if o.slug == c.slug and o.joints == c.joints and o.variant == c.variant
    ]
    gain = ex.gains(ex.others(index), alike)
    loss = np.where(np.isfinite(gain), gain[alike.index(index)] - gain, np.inf)
    p = np.exp(-np.clip(loss - loss.min(), 0.0, 700.0)) if np.isfinite(loss).any() else np.ones(len(alike))
    p /= p.sum()
    shapes = np.array([ex.data.candidates[i].shape for i in alike])
    off = np.abs(shapes - c.shape) / np.maximum(np.ptp(shapes, axis=0), 1e-300)
    nearest = set(np.argsort(off.sum(axis=1))[1 : 1 + NEIGHBOURS].tolist())
    refitted = {k: _refitted(ex, index, alike[k]) for k in range(len(alike)) if p[k] > 1e-3 or k in nearest}
    between = np.sum([p[k] * (v - value) ** 2 for k, v in refitted.items()], axis=0)
    steps = np.array([np.abs(refitted[k] - value) for k in nearest]).reshape(-1, len(value))
    # A grid narrower than the posterior: the loss to a neighbour, taken for a parabola, says how far it reaches.
    lost = np.array([max(loss[k], 0.5) for k in nearest]).reshape(-1, 1)
    beyond = np.max(steps**2 / (2.0 * lost), axis=0, initial=0.0)
    # A posterior narrower than the grid is known to the grid's spacing.
    spacing = np.min(np.where(steps > 1e-9 * np.abs(value), steps, np.inf), axis=0, initial=np.inf)
    spacing = np.where(np.isfinite(spacing), spacing, 0.0)
    blur = c.effect.shapes.blur(c.shape) if c.effect.shapes.blur else 0.0
    return np.maximum(np.maximum(between, beyond), spacing**2 / 12.0) + blur**2


def _variance_about_shape(ex: Explanation, index: int, w: np.ndarray) -> np.ndarray:
    """Variance of the physical parameters about the named shape, its parameters and the amplitudes all free at once.

    By the law's tangent: a grid that moves one parameter of the shape at a time does not see that a wall which leans
    more and stands further off is felt alike.

    Args:
        ex: The explanation.
        index: The finding.
        w: Its amplitudes.
    """
    c, data = ex.data.candidates[index], ex.data
    alike = [o for o in data.candidates if (o.slug, o.joints, o.variant) == (c.slug, c.joints, c.variant)]
    directions = nearest_in_each_direction(np.array([o.shape for o in alike]), c.shape)
    near = [alike[points[0]] for points in directions]
    if not (c.effect.shapes.finer and near):
        return np.zeros(len(c.effect.law.parameters))
    columns = np.concatenate([c.columns, *(o.columns for o in near)])
    scale, k = data.scale[data.nuisances + columns], len(w)
    per_scale = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)  # zero: it moves nothing
    H = ex.near(ex.others(index), columns)[:-1, :-1]
    # Amplitudes, and for each near shape the difference that its columns make at the amplitudes found.
    along = np.eye(k, len(columns))
    to = np.kron(np.eye(len(near)), w)
    along = np.vstack([along, np.hstack([-np.tile(w, (len(near), 1)), to]) * per_scale])
    prior = np.concatenate([np.ones(k), np.full(len(near), FAR**-2)])
    cov = np.linalg.inv(along @ H @ along.T + np.diag(prior))
    value = physical_of(c, w)
    slope = [(physical_of(c, w + SMALL * step) - value) / SMALL for step in np.diag(scale[:k])]
    slope += [physical_of(o, w) - value for o in near]
    return np.einsum("ip,ij,jp->p", slope, cov, slope)


def _variance_over_variants(ex: Explanation, index: int, value: np.ndarray) -> np.ndarray:
    """Mean square by which the physical parameters of the same law with other columns differ, as probable as it is."""
    c = ex.data.candidates[index]
    forms = [
        i
        for i, o in enumerate(ex.data.candidates)
        if (o.slug, o.joints) == (c.slug, c.joints) and o.variant != c.variant and np.array_equal(o.shape, c.shape)
    ]
    gains = ex.gains(ex.others(index), [*forms, index])
    # What is not admissible has a gain of minus infinity.
    known = np.isfinite(gains[:-1]) & np.isfinite(gains[-1])
    forms = [i for i, k in zip(forms, known, strict=True) if k]
    weight = np.exp(np.clip(gains[:-1][known] - gains[-1], -50.0, 50.0))
    differ = np.array([(_refitted(ex, index, i) - value) ** 2 for i in forms]).reshape(-1, len(value))
    return weight @ differ / (1.0 + weight.sum())


def _refitted(ex: Explanation, index: int, other: int) -> np.ndarray:
    """Physical parameters where another candidate of the same kind stands in a finding's place."""
    post = ex.posterior((*ex.others(index), other))
    c = ex.data.candidates[other]
    k = len(c.columns)
    return physical_of(c, (post.mean * ex.data.scale[post.columns])[-k:])


def _inertial_doubt(ex: Explanation, c: Candidate) -> float:
    """Relative standard deviation left in the inertials of the links that a joint carries, root mean square."""
    post = ex.posterior()
    carried = slice(10 * min(c.joints), ex.data.nuisances)
    return float(ex.data.scale[0] * np.sqrt(np.mean(np.diag(post.cov)[carried])))

