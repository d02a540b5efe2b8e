"""What a robot and every candidate do along a recording: sensitivities and columns."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax import dynamics, kinematics
from irb140_jax.compiler import QUICK
from irb140_jax.dynamics.chunks import in_chunks
from irb140_jax.effects import Motion, RigidBody, Scales
from irb140_jax.effects.gravity_tilt import across
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.turning_points import turned_before, turning_points
from irb140_jax.robot import Robot, about_origin
from irb140_jax.types import JointSamples

RUN_IN = 128  # samples in which effects with memory of time forget how their chunk began
TURNS = 32  # turning points before a chunk, by which effects with memory of the path know how it began
CHUNK = 1024 + RUN_IN  # samples per compiled call: recordings of any length reuse one program
# Three directions of gravity without a zero or a one, which would each be a program of its own.
PULLS = np.array([[2.0, 3.0, 5.0], [5.0, 2.0, 3.0], [3.0, 5.0, 2.0]])  # m/s^2


def scales_of(along: Sequence["Prepared"]) -> Scales:
    """Sizes over a set of recordings of a robot."""
    recordings = [a.recording for a in along]
    inertia = np.concatenate([np.diagonal(a.rigid.mass, axis1=1, axis2=2) for a in along]).mean(axis=0)
    return Scales(
        speed=np.max([np.abs(r.qd).max(axis=0) for r in recordings], axis=0),
        rest_speed=np.max([r.rest_speed for r in recordings], axis=0),
        torque=np.sqrt(np.mean(np.concatenate([r.tau for r in recordings]) ** 2, axis=0)) + 1e-12,
        low=np.min([r.q.min(axis=0) for r in recordings], axis=0),
        high=np.max([r.q.max(axis=0) for r in recordings], axis=0),
        duration=max(float(r.t[-1] - r.t[0]) for r in recordings),
        inertia=np.maximum(inertia, 1e-12),
        q_noise=np.max([r.q_noise for r in recordings], axis=0),
    )


class Loads(NamedTuple):
    """Torques along a recording, each (T, n) [N m or N].

    Attributes:
        load, total, carried: See `Motion`.
        scaled: That whose rate is in `Motion`.
    """

    load: np.ndarray
    total: np.ndarray
    carried: np.ndarray
    scaled: np.ndarray


LARGEST = 1e12  # [N m or N] per unit of an amplitude: growth without bound, whose squares would overflow
STEP = 1e-5  # of the differences behind sensitivities [rad, rad/s, m ...]: errors of 1e-9 beside 1e-10 of rounding


class Columns(NamedTuple):
    """What stands beside the logged torque along a recording of T samples.

    Attributes:
        Y: Rigid-body regressor, shape (T, n, 10 n).
        nominal: Torque of the nominal model [N m or N], shape (T, n).
        motor_side: What of it the links don't feel: rotors and the model's own friction, shape (T, n).
        effects: Columns of all candidates where they aren't zero throughout, shape (T, entries): see `Library.entries`.
    """

    Y: np.ndarray
    nominal: np.ndarray
    motor_side: np.ndarray
    effects: np.ndarray


class Prepared(NamedTuple):
    """A conditioned recording with what the nominal rigid body does along it; the same in every round.

    Attributes:
        recording: T samples.
        Y: Regressor, shape (T, n, 10 n).
        nominal: Torque of the nominal model, shape (T, n).
        motor_side: What of it the links don't feel, shape (T, n).
        rigid: Sensitivities, arrays of T samples.
    """

    recording: Conditioned
    Y: np.ndarray
    nominal: np.ndarray
    motor_side: np.ndarray
    rigid: RigidBody


def prepared(robot: Robot, recording: Conditioned) -> Prepared:
    """Evaluate the rigid body along a recording."""
    moving = (jnp.asarray(x) for x in (recording.q, recording.qd, recording.qdd))
    Y = np.asarray(dynamics.regressor_batch(robot, *moving))
    motor_side = np.asarray(robot.armature) * recording.qdd + _friction(robot, recording)
    spring = np.asarray(robot.stiffness) * (recording.q - np.asarray(robot.springref))
    nominal = Y @ np.asarray(robot.phi).ravel() + motor_side + spring
    return Prepared(recording, Y, nominal, motor_side, _sensitivities(robot, recording, Y[..., -10:]))


def seen_by(robot: Robot, along: Prepared) -> Prepared:
    """The same with the sensitivities of a robot that is known better."""
    return along._replace(rigid=_sensitivities(robot, along.recording, along.Y[..., -10:]))


def _sensitivities(robot: Robot, recording: Conditioned, last_link: np.ndarray) -> RigidBody:
    """See `RigidBody`.  Springs of the model pull at the link; rotors and friction are the motor's."""
    q, qd, qdd = recording.q, recording.qd, recording.qdd
    parts = lambda r: (r.armature, r.damping, r.frictionloss)  # noqa: E731
    bare = eqx.tree_at(parts, robot, (jnp.zeros(robot.n),) * 3)
    torque = partial(_torque, bare)
    rest, still, unit = torque(q, qd, qdd), np.zeros_like(q), np.eye(robot.n)
    by_q = np.stack([(torque(q + STEP * e, qd, qdd) - rest) / STEP for e in unit], axis=-1)
    by_qd = np.stack([(torque(q, qd + STEP * e, qdd) - rest) / STEP for e in unit], axis=-1)
    held = torque(q, still, still)
    mass = np.stack([torque(q, still, still + e) - held for e in unit], axis=-1)
    size = np.linalg.norm(np.asarray(robot.gravity))
    tool, tool_jacobian = _tool(robot, q)
    sides, springs = np.asarray(across(robot.gravity)), np.asarray(robot.stiffness)
    held = last_link @ np.asarray(about_origin(robot.tool_position))
    arrays = (_by_gravity(bare, q), size, sides, held, by_q, by_qd, springs, mass, tool, tool_jacobian)
    return RigidBody(*arrays)  # pyright: ignore[reportArgumentType]: NumPy until it is compiled


def _by_gravity(bare: Robot, q: np.ndarray) -> np.ndarray:
    """Torque per unit of each component of gravity, shape (T, n, 3)."""
    links, still = eqx.tree_at(lambda r: r.stiffness, bare, jnp.zeros(bare.n)), np.zeros_like(q)
    pulled = (eqx.tree_at(lambda r: r.gravity, links, jnp.asarray(g)) for g in PULLS)
    return np.stack([_torque(r, q, still, still) for r in pulled], axis=-1) @ np.linalg.inv(PULLS.T)


def _torque(robot: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    return np.asarray(dynamics.inverse_dynamics_batch(robot, *(jnp.asarray(x) for x in (q, qd, qdd))))


def _tool(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position of the tool in the world, (T, 3), and its velocity per joint speed, (T, n, 3)."""
    both = np.asarray(in_chunks(_tool_of_chunk, robot, (jnp.asarray(q),)))
    return both[:, 0], both[:, 1:]


def _tool_of_chunk(robot: Robot, q: JointSamples) -> Float[Array, "T n+1 3"]:
    place = lambda x: kinematics.forward_kinematics(robot, x)[:3, 3]  # noqa: E731
    velocity = lambda x: kinematics.jacobian(robot, x)[:3].T  # noqa: E731
    return jax.vmap(lambda x: jnp.concatenate([place(x)[None], velocity(x)]))(q)


def columns_along(lib: Library, along: Prepared, loads: Loads | None = None, recording: int = -1) -> Columns:
    """Rigid-body regressor, nominal torque and all candidate columns along a recording.

    Args:
        lib: The library.
        along: The recording.
        loads: Loads along the recording [N m or N]; the nominal model's where None.
        recording: Its number; below 0 where the diagnosis did not see it.
    """
    r = along.recording
    nominal = along.nominal
    load, total, carried, scaled = loads or (nominal, nominal, nominal - along.motor_side, nominal)
    dt = float(np.mean(np.diff(r.t)))
    near_rest = (r.rest_speed, r.direction)
    rate = np.gradient(scaled, dt, axis=0)
    moving = (r.t - r.began, r.q, r.qd, r.qdd, load, total, carried, rate, along.rigid, *near_rest)
    which = np.array(float(recording))
    whole = Motion(*moving, which)  # pyright: ignore[reportArgumentType]: NumPy till compiled
    per_sample = jax.tree.map(lambda x: np.ndim(x) > 0 and len(x) == len(r.t), whole)
    turns = [turning_points(q) for q in r.q.T]
    out = np.empty((len(r.t), len(lib.entries[0])))
    for start in range(0, max(len(r.t) - RUN_IN, 1), CHUNK - RUN_IN):
        pad = max(start + CHUNK - len(r.t), 0)

        def piece(x, of_time, start=start, pad=pad):
            if not of_time:
                return x
            return np.pad(x[start : start + CHUNK], ((0, pad),) + ((0, 0),) * (x.ndim - 1), mode="edge")

        motion, run_in = jax.tree.map(piece, whole, per_sample), RUN_IN if start else 0
        motion = dataclasses.replace(motion, turned=turned_before(r.q, turns, start, TURNS))
        # One program for each effect: of all in one, XLA would evaluate parts again and again.
        effects = [np.zeros((CHUNK, 0)), *(_columns(b[0], b[1], b[2], motion) for b in lib.blocks)]
        out[start + run_in : start + CHUNK] = np.concatenate(effects, axis=1)[run_in : CHUNK - pad]
    return Columns(along.Y, along.nominal, along.motor_side, _bounded(lib, out))


def _bounded(lib: Library, effects: np.ndarray) -> np.ndarray:
    """The columns, (T, entries), with those of amplitudes zero that are not finite or beyond `LARGEST` at some joint.

    A spring too soft for the weight on it buckles: along this motion there is no such law, and what moves nothing is
    never named.
    """
    with np.errstate(invalid="ignore"):
        bad = ~((effects.max(axis=0) < LARGEST) & (effects.min(axis=0) > -LARGEST))
    if bad.any():
        amplitudes = lib.entries[1]
        effects[:, np.isin(amplitudes, amplitudes[bad])] = 0.0
    return effects


# The rigid body is compiled apart: fused into this program, XLA would unroll it once for every use.
@eqx.filter_jit(compiler_options=QUICK)  # pyright: ignore[reportCallIssue]: passed on to jax.jit, says its docstring
def _columns(effect, sites, shapes, motion):
    per_shape = jax.vmap(partial(effect.law.columns, motion), in_axes=(None, 0))
    c = jax.vmap(per_shape)(jnp.asarray(sites), jnp.asarray(shapes))  # (S, G, T, m, k)
    return jnp.moveaxis(c, 2, 0).reshape(len(motion.t), -1)


def _friction(robot: Robot, r: Conditioned) -> np.ndarray:
    """The model's own friction, with the sign of qd rounded off as in the candidates."""
    return np.asarray(robot.damping) * r.qd + np.asarray(robot.frictionloss) * r.direction
