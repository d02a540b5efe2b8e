"""Laws that MJCF has no numbers for, along motions that MuJoCo simulates: what they are where each of them goes.

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
from irb140_jax.effects.motion import Asked
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.oracle.rollout import Law
from irb140_jax.recordings.drive import Drive

LEAST = 8  # motions that are evaluated at once, doubled until all are in: few sizes are ever compiled


def beyond_numbers(model: CorrectedModel) -> tuple[Named, ...]:
    """Laws of friction and of servos that MJCF holds in part or not at all, and that need no memory."""
    return tuple(n for n in model.named if n.effect.place.at in (At.FRICTION, At.ASKED) and n.effect.export.not_in_mjcf
                 and not n.effect.export.history)  # fmt: skip


def without_those(model: CorrectedModel) -> CorrectedModel:
    """The model without them."""
    apart = beyond_numbers(model)
    return dataclasses.replace(model, named=tuple(n for n in model.named if n not in apart)) if apart else model


def law_of(
    models: Sequence[CorrectedModel], drives: Sequence[Drive | None], gears: Sequence[np.ndarray], began: np.ndarray
) -> Law | None:
    """What the laws that are in no number of the files make of any state of motions side by side.

    Args:
        models: Of each motion, all with the same effects.
        drives: Of its servos, None where there are none.
        gears: Torque on its joints per torque that is logged, shape (n,) each.
        began: Time since its recording began at which it starts, shape (B,) [s].

    Returns:
        See `Law`; None where there are no such laws.  All that brakes a joint is dry friction there.
    """
    of_each = [beyond_numbers(m) for m in models]
    if not of_each[0]:
        return None
    size = LEAST
    while size < len(models):
        size *= 2
    those = np.minimum(np.arange(size), len(models) - 1)  # the last one again for what there is room
    full = lambda x: x[those]  # noqa: E731
    rest_speed, gear, n = np.asarray(models[0].rest_speed), np.stack(gears), models[0].robot.n
    gains = [np.nan_to_num([d.kp, d.kd]) if d else np.zeros((2, n)) for d in drives]
    kp, kd = np.stack(gains, axis=1)
    numbers = [
        (own[0].effect, jnp.array(own[0].joints), full(np.stack([x.shape for x in own])),
         full(np.stack([x.all_amplitudes() for x in own])))
        for own in zip(*of_each, strict=True)
    ]  # fmt: skip

    def law(
        t: np.ndarray, q: np.ndarray, qd: np.ndarray, load: np.ndarray, control: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        levels, torques, error = np.zeros(q.shape), np.zeros(q.shape), control - q
        given = [full(x) for x in (t + began, q, qd, load, kp * error - kd * qd, error, kp)]
        for effect, joints, shapes, amplitudes in numbers:
            there, back = np.asarray(_both_ways(effect, joints, shapes, amplitudes, rest_speed, *given))[:, : len(q)]
            level, torque = 0.5 * (there - back), 0.5 * (there + back)
            if effect.place.at is At.ASKED:
                level, torque = level * gear[:, joints], torque * gear[:, joints]
            else:
                # What brakes a joint that moves may stop it and can't turn it round, however long it is held.
                way = np.clip(qd / rest_speed, -1.0, 1.0)[:, joints]
                brakes = np.maximum(level + way * torque, 0.0)
                level, torque = brakes, torque - way * (brakes - level)
            levels[:, joints] += level
            torques[:, joints] += torque
        return levels, torques

    return law


@partial(jax.jit, static_argnums=0, compiler_options=QUICK)
def _both_ways(effect, joints, shapes, amplitudes, rest_speed, t, q, qd, load, *asked):
    """Torque of a law on its joints in either direction, (2, B, m): dry friction is half their difference."""

    def of_one(direction, shape, amplitudes, t, q, qd, load, torque, error, kp):
        still, way = jnp.zeros_like(q), direction * jnp.ones_like(q)
        # None of these laws asks which torque carries what, for its rate, or what the rigid body does.
        rows = (x[None] for x in (t, q, qd, still, load, load, load, still))
        of_servo = Asked(torque[None], error[None], kp)
        motion = Motion(*rows, None, rest_speed, way[None], jnp.array(-1.0), asked=of_servo)  # pyright: ignore[reportCallIssue, reportArgumentType]: likewise
        return (effect.law.columns(motion, joints, shape) @ amplitudes)[0]

    way = lambda direction: jax.vmap(partial(of_one, direction))(shapes, amplitudes, t, q, qd, load, *asked)  # noqa: E731
    return jnp.stack([way(1.0), way(-1.0)])
