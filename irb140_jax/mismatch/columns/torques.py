"""A model's torque along a motion, summed from the rigid body's and from those of named effects."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.effects import At, Effect
from irb140_jax.effects.torque_gain import EFFECT as TORQUE_GAIN
from irb140_jax.mismatch.columns.along import Loads, Prepared, columns_along, unbounded, without
from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.inertials.consistent import consistent
from irb140_jax.robot import Robot, with_phi


@dataclasses.dataclass(frozen=True)
class Named:
    """A named effect with its numbers.

    Attributes:
        effect: The effect.
        joints: Indices of its joints.
        variant: Columns it uses.
        amplitudes: One per column used.
        shape: Shape parameters.
    """

    effect: Effect
    joints: tuple[int, ...]
    variant: tuple[int, ...]
    amplitudes: np.ndarray
    shape: np.ndarray

    def all_amplitudes(self) -> np.ndarray:
        """Amplitudes of every column of the effect, zero for those it doesn't use."""
        full = np.zeros(self.effect.law.width)
        full[list(self.variant)] = self.amplitudes
        return full


def scaled(n: int, named: Sequence[Named], scale: float) -> tuple[Named, ...]:
    """The effects where one scale of all torques is off: a torque gain on every joint.

    Friction was found in the torque that is logged; the model holds the real one, which the gain turns into it.

    Args:
        n: Number of joints.
        named: The effects.
        scale: Logged over real torque, less one.
    """
    if not scale:
        return tuple(named)
    out = []
    for one in named:
        if one.effect.place.is_friction:
            out.append(dataclasses.replace(one, amplitudes=one.amplitudes / (1.0 + scale)))
        elif one.effect.slug != TORQUE_GAIN.slug:
            out.append(one)
    own = {m.joints[0]: m.amplitudes[0] for m in named if m.effect.slug == TORQUE_GAIN.slug}
    every = (np.array([scale + own.get(j, 0.0)]) for j in range(n))
    return (*out, *(Named(TORQUE_GAIN, (j,), (0,), w, np.zeros(0)) for j, w in enumerate(every)))


def as_named(robot: Robot, named: Sequence[Named]) -> Robot:
    """The robot with as much of the effects in its own numbers as those can hold."""
    for n in named:
        if n.effect.export.in_model:
            robot = n.effect.export.in_model(robot, n.joints, n.all_amplitudes(), n.shape)
    return robot


def better_known(robot: Robot, phi: np.ndarray, named: Sequence[Named]) -> Robot:
    """The robot whose slopes over position and speed shape the effects: refitted inertials, and the springs named.

    The load that effects see holds those springs; without them in the slopes, play would be taken out of a link that
    is softer or stiffer than its load says.  Links are possible bodies: what swings on a spring has a mass.

    Args:
        robot: The nominal model.
        phi: Inertial parameters, shape (n, 10).
        named: The effects.
    """
    sprung = as_named(robot, named)
    springs = lambda r: (r.stiffness, r.springref)  # noqa: E731
    possible = consistent(phi, np.asarray(robot.phi))
    return eqx.tree_at(springs, with_phi(robot, on_device(possible)), springs(sprung))


@dataclasses.dataclass(frozen=True)
class Torques:
    """Torques along a motion, each (T, n) [N m or N].

    Attributes:
        nominal: Of the model as given.
        refit: Of the rigid body with refitted inertials.
        loads: Of the corrected model: transmissions carry the corrected rigid body and all effects, but for friction
            and what only the log shows.
        corrected: What the controller logs: total, by its torque constants, when and as it was asked for.
    """

    nominal: np.ndarray
    refit: np.ndarray
    loads: Loads
    corrected: np.ndarray


def torques_of(
    robot: Robot, named: Sequence[Named], along: Prepared, dphi_refit: np.ndarray, dphi_corrected: np.ndarray,
    recording: int = -1,
) -> Torques:  # fmt: skip
    """A model's torques along a recording; what depends on the load sees that of the corrected model.

    Args:
        robot: The nominal model.
        named: The effects.
        along: The recording.
        dphi_refit, dphi_corrected: Shift of the inertial parameters in either model, shape (10 n,).
        recording: Its number; below 0 where the diagnosis did not see it.
    """
    lib, amplitudes = library_of(robot, named), [n.amplitudes for n in named]
    shifts = dphi_refit, dphi_corrected
    torques = composed(lib, along, columns_along(lib, along, None, recording), amplitudes, *shifts)
    if not named:
        return torques
    return composed(lib, along, columns_along(lib, along, torques.loads, recording), amplitudes, *shifts)


def composed(
    lib: Library,
    along: Prepared,
    columns: np.ndarray,
    amplitudes: Sequence[np.ndarray],
    dphi_refit: np.ndarray,
    dphi_corrected: np.ndarray,
) -> Torques:
    """Add up a model's torques along a recording.

    Args:
        lib: A library of the model's effects and nothing else.
        along: The recording.
        columns: Of the library along it, from `columns_along`.
        amplitudes: Amplitudes of each effect.
        dphi_refit, dphi_corrected: Shift of the inertial parameters in either model, shape (10 n,).
    """
    columns = without(lib.entries[1], columns, unbounded(lib.entries[1], columns))
    refit, corrected = np.moveaxis(along.torque_of(np.stack([dphi_refit, dphi_corrected], axis=1)), -1, 0)
    both = zip(lib.candidates, amplitudes, strict=True)
    parts = [(c.effect.place.at, lib.torque(columns, c.columns, w)) for c, w in both]
    loads, logged = added_up(along.nominal + corrected, along.motor_side, parts)
    return Torques(along.nominal, along.nominal + refit, loads, logged)


def added_up(links: Any, motor_side: Any, parts: Sequence[tuple[At, Any]]) -> tuple[Loads, Any]:
    """Torques on the way from the links to the log, and what is logged, (T, n) each [N m or N]; in NumPy or in JAX.

    Args:
        links: Of the rigid body, all that the model as given has included, (T, n).
        motor_side: What of it the links don't feel, (T, n).
        parts: Where each effect acts, and its torque (T, n).
    """
    of = {at: sum((x for where, x in parts if where is at), start=0.0 * links) for at in At}
    load = links + of[At.LINKS] + of[At.DRIVE]
    total = load + of[At.FRICTION]
    scaled = total + of[At.LOG_SCALE]
    logged = scaled + of[At.LOG_TIMING] + of[At.ASKED]
    return Loads(load, total, load - motor_side - of[At.DRIVE], scaled), logged


def library_of(robot: Robot, effects: Sequence[Named] | Sequence[Candidate]) -> Library:
    """A library of nothing but these effects, in their order."""
    blocks, candidates, first = [], [], 0
    for named in effects:
        width = named.effect.law.width
        blocks.append((named.effect, np.array([named.joints]), named.shape[None, None, :], first))
        candidates.append(
            Candidate(named.effect, named.joints, named.shape, first + np.array(named.variant), named.variant,
                      np.full(len(named.variant), -np.inf), np.full(len(named.variant), np.inf))
        )  # fmt: skip
        first += width
    return Library(robot, tuple(candidates), tuple(blocks), first)
