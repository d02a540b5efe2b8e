"""What a robot and every candidate do along a recording: sensitivities, columns, and both through the low-pass."""

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
from irb140_jax.effects import Motion, RigidBody, Scales
from irb140_jax.effects.gravity_tilt import across
from irb140_jax.mismatch.candidates import Library
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot
from irb140_jax.types import JointSamples

CHUNK = 2048  # samples per compiled call: recordings of any length reuse one program
POSTURES = 50  # of each recording, for mean inertias
RUN_IN = 128  # samples in which effects with memory forget how their chunk began


def scales_of(recordings: Sequence[Conditioned], robot: Robot) -> Scales:
    """Sizes over a set of conditioned recordings of a robot."""
    q = np.concatenate([r.q[:: max(1, len(r.q) // POSTURES)] for r in recordings])
    inertia = np.diagonal(_mass(robot, jnp.asarray(q)), axis1=1, axis2=2).mean(axis=0)
    return Scales(
        speed=np.max([np.abs(r.qd).max(axis=0) for r in recordings], axis=0),
        rest_speed=np.max([r.rest_speed for r in recordings], axis=0),
        torque=np.sqrt(np.mean(np.concatenate([r.tau for r in recordings]) ** 2, axis=0)) + 1e-12,
        low=np.min([r.q.min(axis=0) for r in recordings], axis=0),
        high=np.max([r.q.max(axis=0) for r in recordings], axis=0),
        duration=max(float(r.t[-1] - r.t[0]) for r in recordings),
        inertia=np.maximum(inertia, 1e-12),
    )


class Loads(NamedTuple):
    """Torques along a recording, each (T, n) [N m or N]; see `Motion`."""

    load: np.ndarray
    total: np.ndarray
    carried: np.ndarray


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
    q, qd, qdd = (jnp.asarray(x) for x in (recording.q, recording.qd, recording.qdd))
    Y = np.asarray(dynamics.regressor_batch(robot, q, qd, qdd))
    # Springs of the model pull at the link; rotors and friction are the motor's.
    parts = lambda r: (r.armature, r.damping, r.frictionloss)  # noqa: E731
    bare = eqx.tree_at(parts, robot, (jnp.zeros(robot.n),) * 3)
    torque = lambda r, *x: np.asarray(dynamics.inverse_dynamics_batch(r, *x))  # noqa: E731
    rest = torque(bare, q, qd, qdd)
    weightless = _weightless(robot)
    still = (q, 0.0 * qd, 0.0 * qdd)
    by_gravity = np.stack(
        [torque(eqx.tree_at(lambda r: r.gravity, weightless, jnp.eye(3)[k]), *still) for k in range(3)], axis=-1
    )
    unit = jnp.eye(robot.n)
    by_q = np.stack([(torque(bare, q + STEP * e, qd, qdd) - rest) / STEP for e in unit], axis=-1)
    by_qd = np.stack([(torque(bare, q, qd + STEP * e, qdd) - rest) / STEP for e in unit], axis=-1)
    mass = _mass(robot, q)
    size = np.linalg.norm(np.asarray(robot.gravity))
    tool, tool_jacobian = (np.asarray(x) for x in _tool(robot, q))
    sides = np.asarray(across(robot.gravity))
    springs = np.asarray(robot.stiffness)
    arrays = (by_gravity, size, sides, Y[..., -10:], by_q, by_qd, springs, mass, tool, tool_jacobian)
    rigid = RigidBody(*arrays)  # pyright: ignore[reportArgumentType]: NumPy until it is compiled
    motor_side = np.asarray(robot.armature) * recording.qdd + _friction(robot, recording)
    spring = np.asarray(robot.stiffness) * (recording.q - np.asarray(robot.springref))
    nominal = Y @ np.asarray(robot.phi).ravel() + motor_side + spring
    return Prepared(recording, Y, nominal, motor_side, rigid)


def seen_by(robot: Robot, along: Prepared) -> Prepared:
    """The same with the sensitivities of a robot that is known better."""
    return along._replace(rigid=prepared(robot, along.recording).rigid)


def _weightless(robot: Robot) -> Robot:
    """Links only, without gravity."""
    none = jnp.zeros(robot.n)
    parts = lambda r: (r.gravity, r.stiffness, r.armature, r.damping, r.frictionloss)  # noqa: E731
    return eqx.tree_at(parts, robot, (jnp.zeros(3), *(none,) * 4))


def _mass(robot: Robot, q: JointSamples) -> np.ndarray:
    """Mass matrices of the links, shape (T, n, n)."""
    links, still = _weightless(robot), jnp.zeros_like(q)
    unit = jnp.eye(robot.n)
    return np.stack(
        [np.asarray(dynamics.inverse_dynamics_batch(links, q, still, still + e)) for e in unit], axis=-1
    )


@eqx.filter_jit
def _tool(robot: Robot, q: JointSamples) -> tuple[Float[Array, "T 3"], Float[Array, "T n 3"]]:
    """Position of the tool in the world and its velocity per joint speed."""
    place = lambda x: kinematics.forward_kinematics(robot, x)[:3, 3]  # noqa: E731
    velocity = lambda x: kinematics.jacobian(robot, x)[:3].T  # noqa: E731
    return jax.vmap(place)(q), jax.vmap(velocity)(q)


def columns_along(lib: Library, along: Prepared, loads: Loads | None = None, recording: int = -1) -> Columns:
    """Rigid-body regressor, nominal torque and all candidate columns along a recording.

    Args:
        lib: The library.
        along: The recording.
        loads: Loads along the recording [N m or N]; the nominal model's where None.
        recording: Its number; below 0 where the diagnosis did not see it.
    """
    r = along.recording
    load, total, carried = loads or (along.nominal, along.nominal, along.nominal - along.motor_side)
    dt = float(np.mean(np.diff(r.t)))
    rate = np.gradient(total, dt, axis=0)
    moving = (r.t - r.began, r.q, r.qd, r.qdd, load, total, carried, rate)
    which = np.array(float(recording))
    whole = Motion(*moving, along.rigid, r.rest_speed, which)  # pyright: ignore[reportArgumentType]: NumPy till compiled
    per_sample = jax.tree.map(lambda x: np.ndim(x) > 0 and len(x) == len(r.t), whole)
    parts = []
    for start in range(0, len(r.t), CHUNK - RUN_IN):
        pad = max(start + CHUNK - len(r.t), 0)

        def piece(x, of_time, start=start, pad=pad):
            if not of_time:
                return x
            return np.pad(x[start : start + CHUNK], ((0, pad),) + ((0, 0),) * (x.ndim - 1), mode="edge")

        motion = jax.tree.map(piece, whole, per_sample)
        sites, shapes = [b[1] for b in lib.blocks], [b[2] for b in lib.blocks]
        effects = _columns(tuple(b[0] for b in lib.blocks), motion, sites, shapes)
        parts.append(np.asarray(effects)[RUN_IN if start else 0 : CHUNK - pad])
        if pad:
            break
    return Columns(along.Y, along.nominal, along.motor_side, np.concatenate(parts))


# The rigid body is compiled apart: fused into this program, XLA would unroll it once for every use.
@eqx.filter_jit
def _columns(effects, motion, sites, shapes):
    T = len(motion.t)
    rows = [jnp.zeros((T, 0))]
    for effect, joints, shape in zip(effects, sites, shapes, strict=True):
        joints, shape = jnp.asarray(joints), jnp.asarray(shape)
        per_shape = jax.vmap(partial(effect.columns, motion), in_axes=(None, 0))
        c = jax.vmap(per_shape)(joints, shape)  # (S, G, T, m, k)
        rows.append(jnp.moveaxis(c, 2, 0).reshape(T, -1))
    return jnp.concatenate(rows, axis=-1)


def _friction(robot: Robot, r: Conditioned) -> np.ndarray:
    """The model's own friction, with the sign of qd rounded off as in the candidates."""
    return np.asarray(robot.damping) * r.qd + np.asarray(robot.frictionloss) * np.tanh(r.qd / r.rest_speed)


@dataclasses.dataclass(frozen=True)
class Stretch:
    """A stretch of one recording, low-passed: for each joint its rows of all columns and of the torque residual.

    Attributes:
        recording: Index of the recording it belongs to.
        t: Time of the rows [s], shape (R,).
        begin: Time at which the recording begins [s].
        X: Columns [regressor | candidates] per joint, each (R, 10 n + size).
        y: Logged minus nominal torque per joint, (R, n).
        tau: Logged torque, low-passed, (R, n).
        nominal: Nominal torque, low-passed, (R, n).
        use: Rows in which the joint moves and nothing is lost, (R, n).
        q, qd, qdd: Motion at the rows, (R, n), for maps and the flexible competitor.
        tool, tool_jacobian: Where the tool is and how joints move it, (R, 3) and (R, n, 3); see `RigidBody`.
    """

    recording: int
    t: np.ndarray
    begin: float
    X: np.ndarray
    y: np.ndarray
    tau: np.ndarray
    nominal: np.ndarray
    use: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tool: np.ndarray
    tool_jacobian: np.ndarray


def stretch(lib: Library, along: Prepared, index: int, band: Band, loads: Loads | None = None) -> Stretch:
    """All columns of a recording through the common low-pass, at the kept samples."""
    Y, nominal, _, columns = columns_along(lib, along, loads, index)
    recording = along.recording
    kept = band.kept(len(recording.t))
    nominal, tau = band.apply(nominal), band.apply(recording.tau)
    X = np.concatenate([band.apply(Y), lib.spread(band.apply(columns))], axis=-1)
    return Stretch(
        index, recording.t[kept], recording.began, X, tau - nominal, tau, nominal, recording.usable[kept],
        recording.q[kept], recording.qd[kept], recording.qdd[kept],
        np.asarray(along.rigid.tool)[kept], np.asarray(along.rigid.tool_jacobian)[kept],
    )  # fmt: skip
