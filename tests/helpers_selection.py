"""A small space of sets with planted amplitudes, and what its data say without any Gram matrix."""

import dataclasses

import numpy as np
from scipy import stats

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.gram import LEVELS, ONE, JointGram, own_scale
from irb140_jax.mismatch.selection.evidence import Space
from irb140_jax.mismatch.selection.kinds import Kinds

ROWS, INERTIALS, COMMON, OWN = 60, 3, 1, 5
SLUGS = ("coulomb_friction", "viscous_friction", "torque_offset", "rotor_inertia")
GROUPS = np.array([-1, 0, 0, 1, 2])
SETTING = (3, 4, 2, ONE + 1)


def planted(seed: int, amplitudes: dict[int, float]) -> tuple[Space, list[dict[str, np.ndarray]]]:
    """Two joints with four candidates each, of one column; what is planted is their sum and unit noise.

    Returns:
        The space, and each joint's own columns E, shared columns X and torque y.
    """
    rng = np.random.default_rng(seed)
    size = INERTIALS + COMMON + 2 * len(SLUGS)
    candidates, joints, data = [], [], []
    for j in range(2):
        for k, slug in enumerate(SLUGS):
            columns = np.array([len(SLUGS) * j + k])
            free = np.array([np.inf])
            candidates.append(Candidate(CATALOGUE[slug], (j,), np.zeros(0), columns, (0,), -free, free))
        mine = [*range(INERTIALS + COMMON), *(INERTIALS + COMMON + len(SLUGS) * j + k for k in range(len(SLUGS)))]
        E, X = rng.normal(size=(ROWS, OWN)), rng.normal(size=(ROWS, len(mine)))
        y = rng.normal(size=ROWS)
        for c, w in amplitudes.items():
            if c // len(SLUGS) == j:
                y = y + w * X[:, INERTIALS + COMMON + c % len(SLUGS)]
        A = np.column_stack([E, X, y])
        joints.append(JointGram(np.array([*mine, size]), (A.T @ A)[None], GROUPS, np.array([ROWS])))
        data.append({"E": E, "X": X, "y": y, "mine": np.array(mine)})
    prior = np.full(len(candidates), np.log(0.05))
    free = np.full((len(candidates), 1), np.inf)
    nothing = np.zeros((len(candidates), 1)), -free[:, 0]
    kinds = Kinds(np.full(len(candidates), -1), np.zeros(0), 0.05)
    space = Space(
        tuple(joints), tuple(candidates), INERTIALS, INERTIALS + COMMON, size, prior, kinds, -free, free, *nothing,
        np.zeros((2, len(candidates))), np.zeros(COMMON),
    )  # fmt: skip
    return space, data


def with_payload(space: Space) -> Space:
    """The same space, whose first candidate is a payload that moves both joints."""
    payload = Candidate(CATALOGUE["payload"], (0, 1), np.zeros(0), np.array([0, 4]), (0, 1), np.zeros(2), np.ones(2))
    free = np.full((len(space.candidates), 2), np.inf)
    return dataclasses.replace(
        space, candidates=(payload, *space.candidates[1:]), lowest=-free, highest=free, weights=np.zeros_like(free)
    )


def with_first_common(space: Space, data: list[dict[str, np.ndarray]], size: float) -> Space:
    """The same space with so much of the first of the common nuisances in the torque, of `data` too."""
    joints = []
    for g, d in zip(space.joints, data, strict=True):
        d["y"] = d["y"] + size * d["X"][:, INERTIALS]
        A = np.column_stack([d["E"], d["X"], d["y"]])
        joints.append(JointGram(g.index, (A.T @ A)[None], GROUPS, np.array([ROWS])))
    return dataclasses.replace(space, joints=tuple(joints))


def density(
    space: Space, data: list[dict[str, np.ndarray]], chosen: tuple[int, ...], hyper, width: float, tied: float = 1.0,
    common: float = 1.0,
) -> float:  # fmt: skip
    """Log density of both joints' torque with every unknown integrated out by its covariance: no Gram matrices.

    The inertials' prior is as many times as wide as stated as `width` says, a payload's as `tied` does, that of common
    nuisances as `common` does.
    """
    columns = space.set_columns(chosen)
    shared, blocks = [], []
    for d, of_joint in zip(data, hyper, strict=True):
        wide = np.zeros((ROWS, space.size))
        wide[:, d["mine"]] = d["X"]
        wide[:, :INERTIALS] *= width
        wide[:, INERTIALS : INERTIALS + COMMON] *= common
        for c in (space.candidates[i] for i in chosen if space.candidates[i].slug == "payload"):
            wide[:, c.columns + space.offset] *= tied
        shared.append(wide[:, columns])
        E = d["E"] * own_scale(GROUPS, of_joint)
        blocks.append(E @ E.T + LEVELS[of_joint[-1]] ** 2 * np.eye(ROWS))
    Z = np.concatenate(shared)
    cov = Z @ Z.T
    cov[:ROWS, :ROWS] += blocks[0]
    cov[ROWS:, ROWS:] += blocks[1]
    y = np.concatenate([d["y"] for d in data])
    mean = Z[:, INERTIALS : INERTIALS + COMMON] @ space.centre
    density = stats.multivariate_normal(mean, cov)  # pyright: ignore[reportArgumentType]: stubs want a number
    return float(density.logpdf(y)) + 0.5 * len(y) * np.log(2.0 * np.pi)


def dense_posterior(space: Space, data, chosen: tuple[int, ...], hyper, prior: np.ndarray):
    """Mean and covariance of a set's columns under these prior standard deviations, without Gram matrices."""
    columns, precision, moment = space.set_columns(chosen), np.diag(1.0 / prior**2), 0.0
    for d, of_joint in zip(data, hyper, strict=True):
        wide = np.zeros((ROWS, space.size))
        wide[:, d["mine"]] = d["X"]
        E = d["E"] * own_scale(GROUPS, of_joint)
        inverse = np.linalg.inv(E @ E.T + LEVELS[of_joint[-1]] ** 2 * np.eye(ROWS))
        precision = precision + wide[:, columns].T @ inverse @ wide[:, columns]
        moment = moment + wide[:, columns].T @ inverse @ d["y"]
    return np.linalg.solve(precision, moment), np.linalg.inv(precision)
