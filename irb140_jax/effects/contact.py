"""Contact: the tool presses on something elastic in its surroundings."""

import itertools

import jax.numpy as jnp
import numpy as np
from scipy import optimize

from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import top_of_parabola
from irb140_jax.effects.records import Export, Law, Parameter, Place, Prior, Shapes, all_joints

NORMALS = 128  # directions of the first scan, some 16 degrees apart
SHARES = (0.02, 0.05, 0.1, 0.2, 0.35)  # of the samples behind the wall, in the first scan
SCANNED = NORMALS * len(SHARES)
DEEPEST = 0.5  # share of the samples behind the wall; beyond it this is no contact but a spring
THIN = 3  # every third row: depths change slowly
STARTS = 3  # walls from which the first scan is refined
TILT, SHIFT = 0.02, 0.005  # first steps of the grid around the best wall: [rad] and share of the tool's travel
FLAT = 1e-3  # of the tool's travel: directions in which it moves less than that are not felt
TURNED = np.pi / 4  # [rad] by which a wall may be turned towards directions that are not felt


def _columns(motion, joints, shape):
    """tau = -J^T n k depth on the motors, depth = max(0, position - n . x_tool): a smooth wall that only pushes."""
    return _wall(motion.rigid.tool, motion.rigid.tool_jacobian, shape, jnp)[..., None]


def _from_physical(values):
    shape = [values[k] for k in ("normal_x", "normal_y", "normal_z", "position")]
    return np.array([values["stiffness"]]), np.array(shape)


def _grid(scales, joints):
    return _around(np.array([0.0, 0.0, 1.0, 0.0]), np.eye(4)[:2], TILT, SHIFT)


def _peak(grid, best, odds):
    # Turns and shift about the place of contact hardly mix: the top of a parabola through each three points.
    if not np.all(np.isfinite(odds)) or np.any(grid[0] != best):
        return best
    moved = sum(top_of_parabola(odds[i], odds[0], odds[i + 1]) * 0.5 * (grid[i + 1] - grid[i]) for i in (1, 3))
    top = best + moved + top_of_parabola(odds[6], odds[0], odds[5]) * (grid[5] - best)
    return np.append(top[:3] / np.linalg.norm(top[:3]), top[3])


def _finer(grid, best):
    turns, shift = 0.5 * (grid[2:5:2] - grid[1:4:2]), 0.5 * (grid[5, 3] - grid[6, 3])
    tilts = np.linalg.norm(turns[:, :3], axis=1)
    turns = turns / np.maximum(tilts, 1e-12)[:, None]
    # As wide as before in the direction in which it moved.
    at = int(np.argmin(np.abs(grid - best).sum(axis=1)))
    tilt = float(tilts.max()) * (1.0 if 1 <= at <= 4 else 0.5)
    return _around(best, turns, max(tilt, 1e-5), max(float(shift) * (1.0 if at > 4 else 0.5), 1e-7))


def _proposal(left, scales, joints):
    left = left.every(THIN)
    felt, _ = _felt(left.tool)
    travel = float(np.ptp(left.tool, axis=0).max())
    if travel < 1e-6:
        return None
    # Of all walls that feel alike, those across the tool's own directions.
    normals = _sphere(NORMALS) @ felt.T @ felt
    size = np.linalg.norm(normals, axis=1)
    normals = normals[size > 0.1] / size[size > 0.1, None]
    walls = np.array([np.append(n, np.quantile(left.tool @ n, share)) for n in normals for share in SHARES])
    gains = np.concatenate([_gain(left, part) for part in np.array_split(walls, NORMALS)])
    if gains.max() < np.log(SCANNED):
        return None  # no better than the best of so many is by chance
    found = [_climbed(left, walls[i], felt, travel) for i in _apart(walls[:, :3], gains)]
    best = found[int(np.argmax([_gain(left, wall[None])[0] for wall in found]))]
    # About the place of contact: turned about any other, a wall must be moved as well to stand where it did.
    across = _across(best[:3], felt)
    touched = left.tool[left.tool @ best[:3] < best[3]].mean(axis=0)
    return _around(best, np.column_stack([across, across @ touched]), TILT, SHIFT * travel)


def _alike(left, w, shape):
    felt, middle = _felt(left.tool)
    unfelt = np.linalg.svd(felt)[2][len(felt) :]
    out = []
    for a, turn in itertools.product(unfelt, (-TURNED, TURNED)):
        normal = np.cos(turn) * shape[:3] + np.sin(turn) * a
        position = np.cos(turn) * shape[3] + np.sin(turn) * a @ middle
        out.append([float(w[0]) / np.cos(turn) ** 2, *normal, position])
    return np.array(out).reshape(-1, 5)


def _around(best, turns, tilt, shift):
    """The wall, turned a little both ways in each of two ways, and moved in and out, shape (7, 4).

    Args:
        best: Normal and position.
        turns: Change of both per radian, shape (2, 4).
        tilt: By how much it is turned [rad].
        shift: By how much it is moved [m].
    """
    turned = np.array([best + tilt * s * turn for turn in turns for s in (-1.0, 1.0)])
    turned[:, :3] /= np.linalg.norm(turned[:, :3], axis=1, keepdims=True)
    return np.array([best, *turned, best + [0, 0, 0, shift], best - [0, 0, 0, shift]])


def _wall(tool, tool_jacobian, shape, xp):
    """Torque per unit of stiffness, shape (T, n)."""
    depth = xp.maximum(shape[3] - tool @ shape[:3], 0.0)
    return -depth[:, None] * (tool_jacobian[..., :3] @ shape[:3])


def _gain(left, walls):
    """Log likelihood that each wall would gain, 0 where it would pull or where the tool is mostly behind it."""
    columns = np.stack([_wall(left.tool, left.tool_jacobian, wall, np) for wall in walls])
    gain, stiffness = left.gains(columns[..., None])
    behind = np.mean(np.any(columns != 0.0, axis=2), axis=1)
    return np.where((stiffness[:, 0] > 0.0) & (behind < DEEPEST), gain, 0.0)


def _apart(normals, gains):
    """The best few walls whose normals are at least 30 degrees apart: a robot of few joints feels several alike."""
    chosen: list[int] = []
    for i in np.argsort(-gains):
        if gains[i] > 0.0 and all(normals[i] @ normals[j] < np.cos(np.pi / 6) for j in chosen):
            chosen.append(int(i))
        if len(chosen) == STARTS:
            break
    return chosen or [0]


def _felt(tool):
    """Unit vectors along which the tool moves, shape (1 to 3, 3), and the middle of its path."""
    middle = tool.mean(axis=0)
    _, size, axes = np.linalg.svd(tool - middle, full_matrices=False)
    return axes[size > FLAT * max(size[0], 1e-300)], middle


def _across(normal, felt):
    """Two unit vectors across a normal among the directions that are felt, zero where there are fewer, shape (2, 3)."""
    _, size, axes = np.linalg.svd(felt - np.outer(felt @ normal, normal))
    return np.vstack([axes[: np.sum(size > 0.5)], np.zeros((2, 3))])[:2]


def _climbed(left, wall, felt, travel):
    """A short simplex search from a wall, over turns about the middle of the tool's path and a shift."""
    across, middle = _across(wall[:3], felt), left.tool.mean(axis=0)

    def turned(x):
        n = wall[:3] + x[:2] @ across
        n /= np.linalg.norm(n)
        return np.append(n, wall[3] + (n - wall[:3]) @ middle + travel * x[2])

    start = np.vstack([np.zeros(3), np.diag([0.15, 0.15, 0.03])])
    found = optimize.minimize(lambda x: -_gain(left, turned(x)[None])[0], np.zeros(3), method="Nelder-Mead",
                              options={"maxfev": 80, "initial_simplex": start})  # fmt: skip
    return turned(found.x)


def _sphere(points):
    """Directions spread evenly over the sphere (Fibonacci), shape (points, 3)."""
    k = np.arange(points) + 0.5
    z, turn = 1.0 - 2.0 * k / points, np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


EFFECT = Effect(
    slug="contact",
    title="contact with the surroundings",
    needs="tool paths that touch the surroundings, and others that do not",
    confused_with={
        "external_wrench": "the same path again: a wall acts again, a push does not",
        "gravity_spring": "the same positions of this joint with the tool in other places",
        "position_dependent_friction": "the same path in both directions: friction changes sign, a wall does not",
    },
    where=(
        "where the tool is less than {position} along the direction ({normal_x:.2f}, {normal_y:.2f}, {normal_z:.2f}) "
        "of the world; a wall pushes it back with {stiffness}"
    ),
    law=Law(
        equation="-J_tool(q)^T n k max(0, position - n . x_tool)",
        source="Hogan, Impedance control, ASME JDSMC 107, 1985; Haddadin, De Luca, Albu-Schaeffer, IEEE T-RO 33, 2017",
        parameters=(
            Parameter("stiffness", "N/m", low=0.0),
            Parameter("normal_x", "1"),
            Parameter("normal_y", "1"),
            Parameter("normal_z", "1"),
            Parameter("position", "m"),
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.concatenate([w, shape]),
        from_physical=_from_physical,
    ),
    place=Place(sites=all_joints, everywhere=True),
    prior=Prior(lowest=(0.0,)),
    shapes=Shapes(grid=_grid, finer=_finer, peak=_peak, proposal=_proposal, scanned=SCANNED, alike=_alike),
    export=Export(
        not_in_mjcf="it is left out: MuJoCo needs a geometry for a wall, whose stiffness comes from the solver"
    ),
)
