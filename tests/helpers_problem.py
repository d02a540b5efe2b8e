"""Small search problems of a few laws whose torques are given row by row."""

import numpy as np
from irb140_jax.mismatch.problem import Problem

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.silent import SILENT

ROWS = 80
FIRST = np.array([1.0, 2.0, 1.0, 0.01])  # shape of a push: from 1 to 2 s of the first recording
RNG = np.random.default_rng(0)
TURNS, WAVE = np.sign(RNG.normal(size=ROWS)), RNG.normal(size=ROWS)
WAVE -= TURNS * (TURNS @ WAVE) / ROWS


def problem(members, y, recordings: int = 1, shapes: tuple[int, ...] = ()) -> Problem:
    """Of candidates (slug, joints, torque per unit at each joint) for the torque y, each of shape (n, ROWS).

    The candidates of these numbers have a shape parameter; what happens once does so in the first recording.
    """
    X = np.stack([np.asarray(torque, dtype=float) for _, _, torque in members] + [y], axis=-1)
    per_joint = np.einsum("jtk,jtl->jkl", X, X)
    limit, none = np.full((len(members), 1), np.inf), np.zeros(len(members))
    known = CATALOGUE | SILENT
    candidates = tuple(
        Candidate(known[slug], joints, FIRST if known[slug].once else np.zeros(int(k in shapes)), np.array([k]), (0,),
                  -limit[k], limit[k])
        for k, (slug, joints, _) in enumerate(members)
    )  # fmt: skip
    energy = np.tile(np.maximum(np.sum(np.square(y), axis=1) / recordings, 1e-300), (recordings, 1))
    return Problem(
        per_joint.sum(axis=0), per_joint, energy, candidates, 0, none, none, -limit, limit,
        np.zeros((len(members), 1)), -limit[:, 0],
    )  # fmt: skip
