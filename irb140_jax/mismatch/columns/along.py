"""What a robot and every candidate do along a recording: sensitivities and columns."""

import dataclasses
import itertools
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax import dynamics, kinematics
from irb140_jax.arrays import on_device
from irb140_jax.compiler import QUICK
from irb140_jax.dynamics.chunks import in_chunks
from irb140_jax.effects import Asked, Effect, Motion, RigidBody, Scales
from irb140_jax.effects.gravity_tilt import across
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.payload import carrying
from irb140_jax.recordings.turning_points import turned_before, turning_points
from irb140_jax.robot import Robot, about_origin
from irb140_jax.types import JointSamples

RUN_IN = 512  # samples in which effects with memory forget how their chunk began: the softest spring rings for 2 s
TURNS = 32  # turning points before a chunk, by which effects with memory of the path know how it began
RUN_OUT = 32  # samples ahead that errors of a clock look at
NEW = 2048  # samples of a compiled call whose columns are exact
CHUNK = RUN_IN + NEW + RUN_OUT  # samples per compiled call: recordings of any length reuse one program
BEGUN = os.cpu_count() or 1  # computations beside the one that is waited for
KEPT = 50_000  # samples of all recordings, some minutes, up to which both are kept instead of evaluated anew: 250 MB
# Three directions of gravity without a zero or a one, which would each be a program of its own.
PULLS = np.array([[2.0, 3.0, 5.0], [5.0, 2.0, 3.0], [3.0, 5.0, 2.0]])  # m/s^2


def scales_of(along: Sequence["Prepared"]) -> Scales:
    """Sizes over a set of recordings of a robot."""
    recordings, samples = [a.recording for a in along], [len(a.recording.t) for a in along]
    inertia = np.average([a.inertia for a in along], axis=0, weights=samples)
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


@dataclasses.dataclass(frozen=True)
class Prepared:
    """A conditioned recording with what the rigid body does along it.

    Attributes:
        robot: The nominal model with the recording's known payload.
        seen: The robot whose slopes shape the effects; see `seen_by`.
        recording: T samples.
        nominal: Torque of the nominal model [N m or N], shape (T, n).
        motor_side: What of it the links don't feel: rotors and the model's own friction, shape (T, n).
        inertia: Mean of the mass matrix's diagonal [kg m^2 or kg], shape (n,).
        turns: Where each joint turns round; see `turning_points`.
        Y, rigid: Regressor, shape (T, n, 10 n), and sensitivities; None along long recordings, where they are evaluated
            again whenever they are needed.
    """

    robot: Robot
    seen: Robot
    recording: Conditioned
    nominal: np.ndarray
    motor_side: np.ndarray
    inertia: np.ndarray
    turns: list[np.ndarray]
    Y: np.ndarray | None
    rigid: RigidBody | None

    def regressor_at(self, at: slice) -> np.ndarray:
        """Rigid-body regressor of some samples, shape (t, n, 10 n)."""
        return _regressor(self.robot, self.recording, at) if self.Y is None else self.Y[at]

    def rigid_at(self, at: slice) -> RigidBody:
        """What effects see of the rigid body at some samples."""
        if self.rigid is None:
            return _sensitivities(self.seen, self.recording, at, self.regressor_at(at)[..., -10:])
        return _each_sample(lambda x: x[at], self.rigid)

    def torque_of(self, dphi: np.ndarray) -> np.ndarray:
        """Torque of shifts of the inertial parameters, (10 n, k), shape (T, n, k)."""
        return np.concatenate([self.regressor_at(at) @ dphi for at in pieces(len(self.recording.t))])


def pieces(samples: int) -> list[slice]:
    """So many samples, `CHUNK` at a time."""
    return [slice(k, min(k + CHUNK, samples)) for k in range(0, samples, CHUNK)]


def prepared(robot: Robot, recording: Conditioned, *, seen: Robot | None = None, kept: bool = True) -> Prepared:
    """Evaluate the rigid body along a recording.

    Args:
        robot: The nominal model.
        recording: T samples.
        seen: The robot whose slopes shape the effects, if it is another; see `seen_by`.
        kept: Whether regressor and sensitivities are held for the next time that they are needed.
    """
    robot, seen = carrying(robot, recording.payload), carrying(seen or robot, recording.payload)
    motor_side = np.asarray(robot.armature) * recording.qdd + _friction(robot, recording)
    spring = np.asarray(robot.stiffness) * (recording.q - np.asarray(robot.springref))
    phi, links, bodies, regressors = np.asarray(robot.phi).ravel(), [], [], []
    inertia = np.zeros(robot.n)
    for at in pieces(len(recording.t)):
        Y = _regressor(robot, recording, at)
        rigid = _sensitivities(seen, recording, at, Y[..., -10:])
        links.append(Y @ phi)
        inertia += np.diagonal(rigid.mass, axis1=1, axis2=2).sum(axis=0)
        if kept:
            regressors.append(Y)
            bodies.append(rigid)
    nominal = np.concatenate(links) + motor_side + spring
    whole = (np.concatenate(regressors), _joined(bodies)) if kept else (None, None)
    turns, inertia = [turning_points(q) for q in recording.q.T], inertia / len(recording.t)
    return Prepared(robot, seen, recording, nominal, motor_side, inertia, turns, *whole)


def all_prepared(robot: Robot, recordings: Sequence[Conditioned], seen: Robot | None = None) -> list[Prepared]:
    """The rigid body along recordings; what it takes to keep it is kept where that is not much."""
    kept = sum(len(r.t) for r in recordings) <= KEPT
    return [prepared(robot, r, seen=seen, kept=kept) for r in recordings]


def seen_by(robot: Robot, along: Prepared) -> Prepared:
    """The same with the sensitivities of a robot that is known better."""
    r = along.recording
    robot = carrying(robot, r.payload)
    if along.rigid is None:
        return dataclasses.replace(along, seen=robot)
    parts = [_sensitivities(robot, r, at, along.regressor_at(at)[..., -10:]) for at in pieces(len(r.t))]
    return dataclasses.replace(along, seen=robot, rigid=_joined(parts))


def _regressor(robot: Robot, r: Conditioned, at: slice) -> np.ndarray:
    return np.asarray(dynamics.regressor_batch(robot, r.q[at], r.qd[at], r.qdd[at]))


PER_SAMPLE = ("by_gravity", "held", "by_q", "by_qd", "mass", "tool", "tool_jacobian")  # of `RigidBody`


def _each_sample(change: Callable[..., np.ndarray], *bodies: RigidBody) -> RigidBody:
    """Sensitivities whose arrays of samples are what a function makes of those of the given ones."""
    changed = {name: change(*(getattr(b, name) for b in bodies)) for name in PER_SAMPLE}
    return dataclasses.replace(bodies[0], **changed)


def _joined(parts: list[RigidBody]) -> RigidBody:
    """Sensitivities of successive samples as one."""
    return _each_sample(lambda *x: np.concatenate(x), *parts)


def _sensitivities(robot: Robot, recording: Conditioned, at: slice, last_link: np.ndarray) -> RigidBody:
    """See `RigidBody`.  Springs of the model pull at the link; rotors and friction are the motor's."""
    q, qd, qdd = recording.q[at], recording.qd[at], recording.qdd[at]
    parts = lambda r: (r.armature, r.damping, r.frictionloss)  # noqa: E731
    bare, n = eqx.tree_at(parts, robot, (on_device(np.zeros(robot.n)),) * 3), robot.n
    still, unit, step = np.zeros_like(q), np.eye(n), STEP * np.eye(n)
    # In one call, for one of few samples costs as much as one of many.
    motions = [(q, qd, qdd), (q, still, still), *((q + e, qd, qdd) for e in step), *((q, qd + e, qdd) for e in step)]
    motions += [(q, still, still + e) for e in unit]
    torques = _torque(bare, *(np.concatenate(x) for x in zip(*motions, strict=True))).reshape(-1, *q.shape)
    rest, held, moved = torques[0], torques[1], np.moveaxis(torques[2:], 0, -1)
    by_q, by_qd = np.split((moved[..., : 2 * n] - rest[..., None]) / STEP, 2, axis=-1)
    mass = moved[..., 2 * n :] - held[..., None]
    size = np.linalg.norm(np.asarray(robot.gravity))
    tool, tool_jacobian = tool_along(robot, q)
    sides, springs = np.asarray(across(robot.gravity)), np.asarray(robot.stiffness)
    held = last_link @ np.asarray(about_origin(robot.tool_position))
    arrays = (_by_gravity(bare, q), size, sides, held, by_q, by_qd, springs, mass, tool, tool_jacobian)
    return RigidBody(*arrays)  # pyright: ignore[reportArgumentType]: NumPy until it is compiled


def _by_gravity(bare: Robot, q: np.ndarray) -> np.ndarray:
    """Torque per unit of each component of gravity, shape (T, n, 3)."""
    links, still = eqx.tree_at(lambda r: r.stiffness, bare, on_device(np.zeros(bare.n))), np.zeros_like(q)
    pulled = (eqx.tree_at(lambda r: r.gravity, links, on_device(g)) for g in PULLS)
    return np.stack([_torque(r, q, still, still) for r in pulled], axis=-1) @ np.linalg.inv(PULLS.T)


def _torque(robot: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    return np.asarray(dynamics.inverse_dynamics_batch(robot, q, qd, qdd))


def tool_along(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position of the tool in the world, (T, 3), and its velocity and angular velocity per joint speed, (T, n, 6)."""
    both = np.asarray(in_chunks(_tool_of_chunk, robot, (q,)))
    return both[:, 0, :3], both[:, 1:]


def _tool_of_chunk(robot: Robot, q: JointSamples) -> Float[Array, "T n+1 6"]:
    place = lambda x: jnp.pad(kinematics.forward_kinematics(robot, x)[:3, 3], (0, 3))  # noqa: E731
    velocity = lambda x: kinematics.jacobian(robot, x).T  # noqa: E731
    return jax.vmap(lambda x: jnp.concatenate([place(x)[None], velocity(x)]))(q)


def columns_along(
    lib: Library, along: Prepared, loads: Loads | None = None, recording: int = -1, at: slice | None = None
) -> np.ndarray:
    """Columns of all candidates where they aren't zero throughout, shape (t, entries): see `Library.entries`.

    Args:
        lib: The library.
        along: The recording.
        loads: Loads along the recording [N m or N]; the nominal model's where None.
        recording: Its number; below 0 where the diagnosis did not see it.
        at: The samples, by default all.
    """
    at = at or slice(0, len(along.recording.t))
    out = np.empty((at.stop - at.start, len(lib.entries[0])))
    for piece in _calls(at):
        for entries, part in columns_by_effect(lib, along, loads, recording, piece):
            out[piece.start - at.start : piece.stop - at.start, entries] = part
    return out


def columns_by_effect(
    lib: Library, along: Prepared, loads: Loads | None, recording: int, at: slice
) -> Iterator[tuple[slice, np.ndarray]]:
    """Columns of one effect after another, so that no more than these are in memory at once.

    An effect that acts on all joints has n times as many columns; it comes one site after another.

    Yields which of `Library.entries` they are of, and the columns, shape (t, those entries).

    Args:
        lib, along, loads, recording: See `columns_along`.
        at: The samples: not many, for what the rigid body does along them is held.
    """
    if not lib.blocks:
        return
    calls = [(call, *_motion(along, loads, recording, call)) for call in _calls(at)]
    exact = [slice(call.start - first, call.stop - first) for call, first, _ in calls]
    # One program for each effect: of all in one, XLA would evaluate parts again and again.
    blocks = ((effect, sites, shapes) for effect, sites, shapes, _ in lib.blocks)
    some = [(effect, sites[of], shapes[of]) for effect, sites, shapes in blocks for of in _at_once(effect, sites)]
    every = _ahead(_columns(*which, motion) for which in some for _, _, motion in calls)
    column = 0
    for _ in some:
        parts = [np.asarray(next(every))[use] for use in exact]
        part = parts[0] if len(parts) == 1 else np.concatenate(parts)
        yield slice(column, column + part.shape[1]), part
        column += part.shape[1]


def _at_once(effect: Effect, sites: np.ndarray) -> list[slice]:
    """Sites of an effect whose columns are computed together."""
    every = len(sites)
    return [slice(k, k + 1) for k in range(every)] if effect.place.everywhere else [slice(0, every)]


def _calls(at: slice) -> Iterator[slice]:
    """The samples in parts, each as long as one compiled call has exact columns for."""
    # Nothing has to be run in before the first.
    edges = [at.start, *range(max(at.start, RUN_IN) + NEW, at.stop, NEW), at.stop]
    return (slice(first, last) for first, last in itertools.pairwise(edges))


def _motion(along: Prepared, loads: Loads | None, recording: int, at: slice) -> tuple[int, Motion]:
    """What effects see of some samples with those that they have to be run in by, and the first sample of these."""
    r, nominal = along.recording, along.nominal
    load, total, carried, scaled = loads or (nominal, nominal, nominal - along.motor_side, nominal)
    error, gains = (r.servo.command - r.q, np.nan_to_num(r.servo.drive.kp)) if r.servo else (r.q, r.q[0])
    start = max(at.start - RUN_IN, 0)
    piece, pad = slice(start, min(start + CHUNK, len(r.t))), max(start + CHUNK - len(r.t), 0)
    rigid = _each_sample(lambda x: _padded(x, pad), along.rigid_at(piece))
    t, *moving = (_padded(x[piece], pad) for x in (r.t, r.q, r.qd, r.qdd, load, total, carried))
    rate = _padded(_rate(scaled, piece, float(r.t[-1] - r.t[0]) / (len(r.t) - 1)), pad)
    near_rest = r.rest_speed, _padded(r.direction[piece], pad), np.array(float(recording))
    turned = turned_before(r.q, along.turns, start, TURNS)
    asked = r.servo and Asked(_padded(r.tau[piece], pad), _padded(error[piece], pad), gains)  # pyright: ignore[reportArgumentType]: NumPy
    return start, Motion(t - r.began, *moving, rate, rigid, *near_rest, turned, asked)  # pyright: ignore[reportArgumentType, reportCallIssue]: NumPy


def _ahead(computations: Iterator[Array]) -> Iterator[Array]:
    """Computations, of which the next are begun before one is waited for: few, for their results take memory."""
    begun: deque[Array] = deque()
    for computation in computations:
        begun.append(computation)
        if len(begun) > BEGUN:
            yield begun.popleft()
    yield from begun


def _rate(x: np.ndarray, at: slice, dt: float) -> np.ndarray:
    """Time derivative at some samples, as that of all samples is there."""
    first = max(at.start - 1, 0)
    return np.gradient(x[first : at.stop + 1], dt, axis=0)[at.start - first :][: at.stop - at.start]


def _padded(x: np.ndarray, pad: int) -> np.ndarray:
    """Samples with the last one repeated."""
    return np.pad(x, ((0, pad),) + ((0, 0),) * (x.ndim - 1), mode="edge")


def unbounded(amplitudes: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Amplitudes that have columns, (t, entries), which are not finite or beyond `LARGEST` at some joint.

    A spring too soft for the weight on it buckles: along this motion there is no such law.

    Args:
        amplitudes: The amplitude of each column, shape (entries,).
        columns: Some of those of `columns_along`.
    """
    with np.errstate(invalid="ignore"):
        bad = ~((columns.max(axis=0) < LARGEST) & (columns.min(axis=0) > -LARGEST))
    return np.unique(amplitudes[bad])


def without(amplitudes: np.ndarray, columns: np.ndarray, left_out: np.ndarray) -> np.ndarray:
    """The columns, with those of some amplitudes zero: what moves nothing is never named."""
    return np.where(np.isin(amplitudes, left_out), 0.0, columns) if len(left_out) else columns


# The rigid body is compiled apart: fused into this program, XLA would unroll it once for every use.
@partial(jax.jit, static_argnums=0, compiler_options=QUICK)
def _columns(effect, sites, shapes, motion):
    per_shape = jax.vmap(partial(effect.law.columns, motion), in_axes=(None, 0))
    c = jax.vmap(per_shape)(sites, shapes)  # (S, G, T, m, k)
    return jnp.moveaxis(c, 2, 0).reshape(len(motion.t), -1)


def _friction(robot: Robot, r: Conditioned) -> np.ndarray:
    """The model's own friction, with the sign of qd rounded off as in the candidates."""
    return np.asarray(robot.damping) * r.qd + np.asarray(robot.frictionloss) * r.direction
