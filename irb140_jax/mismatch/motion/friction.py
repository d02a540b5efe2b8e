"""Friction that MJCF has no numbers for, along motions that MuJoCo simulates: what it is where each of them goes.

Computed along the recording instead, friction that grows with the load is that of another motion, once the two part.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax.compiler import QUICK
from irb140_jax.effects import At, Motion
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.oracle.rollout import Friction

LEAST = 8  # motions that are evaluated at once, doubled until all are in: few sizes are ever compiled


def beyond_numbers(model: CorrectedModel) -> tuple[Named, ...]:
    """Friction laws of a model, without a memory, that MJCF holds in part or not at all."""
    return tuple(
        n for n in model.named
        if n.effect.place.at is At.FRICTION and n.effect.export.not_in_mjcf and not n.effect.export.history
    )  # fmt: skip


def without_those(model: CorrectedModel) -> CorrectedModel:
    """The model without them."""
    apart = beyond_numbers(model)
    return dataclasses.replace(model, named=tuple(n for n in model.named if n not in apart)) if apart else model


def friction_of(models: Sequence[CorrectedModel], began: np.ndarray) -> Friction | None:
    """Friction that is in no number of the files, at any state of motions side by side.

    Args:
        models: Of each motion, all with the same effects.
        began: Time of each recording at its start, shape (B,) [s].

    Returns:
        See `Friction`; None where there is none.
    """
    laws = [beyond_numbers(m) for m in models]
    if not laws[0]:
        return None
    size = LEAST
    while size < len(models):
        size *= 2
    room = size - len(models)
    full = lambda x: np.pad(x, ((0, room),) + ((0, 0),) * (x.ndim - 1), mode="edge")  # noqa: E731
    rest_speed = np.asarray(models[0].rest_speed)
    numbers = [
        (own[0].effect, jnp.array(own[0].joints), full(np.stack([n.shape for n in own])),
         full(np.stack([n.all_amplitudes() for n in own])))
        for own in zip(*laws, strict=True)
    ]  # fmt: skip

    def friction(t: np.ndarray, q: np.ndarray, qd: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        levels, torques = np.zeros(q.shape), np.zeros(q.shape)
        given = [full(x) for x in (t + began, q, qd, load)]
        for effect, joints, shapes, amplitudes in numbers:
            there, back = np.asarray(_both_ways(effect, joints, shapes, amplitudes, rest_speed, *given))[:, : len(q)]
            levels[:, joints] += 0.5 * (there - back)
            torques[:, joints] += 0.5 * (there + back)
        return np.maximum(levels, 0.0), torques

    return friction


@partial(jax.jit, static_argnums=0, compiler_options=QUICK)
def _both_ways(effect, joints, shapes, amplitudes, rest_speed, t, q, qd, load):
    """Torque of a law on its joints in either direction, (2, B, m): dry friction is half their difference."""

    def of_one(direction, shape, amplitudes, t, q, qd, load):
        still, way = jnp.zeros_like(q), direction * jnp.ones_like(q)
        # No friction law asks which torque carries what, for its rate, or what the rigid body does.
        rows = (x[None] for x in (t, q, qd, still, load, load, load, still))
        motion = Motion(*rows, None, rest_speed, way[None], jnp.array(-1.0))  # pyright: ignore[reportCallIssue, reportArgumentType]: likewise
        return (effect.law.columns(motion, joints, shape) @ amplitudes)[0]

    way = lambda direction: jax.vmap(partial(of_one, direction))(shapes, amplitudes, t, q, qd, load)  # noqa: E731
    return jnp.stack([way(1.0), way(-1.0)])
