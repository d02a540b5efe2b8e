"""Every candidate explanation, its columns along the recordings, and their Gram matrices.

A *candidate* is an effect at a site with a shape.  Its columns stand beside the rigid-body regressor; one pass over the
data forms the Gram matrix of each stretch of each joint, and from then on no search touches the data again.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax import dynamics
from irb140_jax.effects import AbstractEffect, Motion, Scales
from irb140_jax.recordings.condition import Band, Conditioned
from irb140_jax.robot import Robot

CHUNK = 2048  # samples per compiled call: recordings of any length reuse one program


@dataclasses.dataclass(frozen=True)
class Candidate:
    """An effect at a site with a shape, and where its amplitudes stand among all columns.

    Attributes:
        effect: The effect.
        joints: Indices of the joints of the site.
        shape: Shape parameters, shape (s,).
        columns: Indices of the amplitudes used, among all amplitudes of the library.
        variant: Which of the effect's columns those are.
        lowest, highest: Admissible range of each.
    """

    effect: AbstractEffect
    joints: tuple[int, ...]
    shape: np.ndarray
    columns: np.ndarray
    variant: tuple[int, ...]
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def slug(self) -> str:
        """The effect's name in the vocabulary."""
        return self.effect.slug


@dataclasses.dataclass(frozen=True)
class Library:
    """All candidates for a robot, and the layout of their columns.

    Attributes:
        robot: The nominal robot.
        candidates: What may be left out.
        blocks: (effect, sites (S, m), shapes (S, G, s), first column) of each effect, in the order of the columns.
        size: Number of amplitudes.
    """

    robot: Robot
    candidates: tuple[Candidate, ...]
    blocks: tuple[tuple[AbstractEffect, np.ndarray, np.ndarray, int], ...]
    size: int


def library(robot: Robot, effects: Sequence[AbstractEffect], scales: Scales) -> Library:
    """Lay out the candidates of all effects at all sites."""
    blocks, candidates, first = [], [], 0
    for effect in effects:
        sites = effect.sites(robot)
        if len(sites) == 0:
            continue
        shapes = np.stack([effect.shapes(scales, joints) for joints in sites])
        width = max(max(v) for v in effect.variants) + 1
        blocks.append((effect, sites, shapes, first))
        for s, joints in enumerate(sites):
            low, high = effect.lowest(robot, joints), effect.highest(robot, joints)
            for g in range(shapes.shape[1]):
                base = first + (s * shapes.shape[1] + g) * width
                for variant in effect.variants:
                    v = np.array(variant)
                    candidates.append(
                        Candidate(effect, tuple(map(int, joints)), shapes[s, g], base + v, variant, low[v], high[v])
                    )
        first += len(sites) * shapes.shape[1] * width
    return Library(robot, tuple(candidates), tuple(blocks), first)


def scales_of(recordings: Sequence[Conditioned]) -> Scales:
    """Sizes over a set of conditioned recordings."""
    return Scales(
        speed=np.max([np.abs(r.qd).max(axis=0) for r in recordings], axis=0),
        rest_speed=np.max([r.rest_speed for r in recordings], axis=0),
        torque=np.sqrt(np.mean(np.concatenate([r.tau for r in recordings]) ** 2, axis=0)) + 1e-12,
    )


Loads = tuple[np.ndarray, np.ndarray]  # torque the transmissions carry and torque the motors give, each (T, n)


class Columns(NamedTuple):
    """What stands beside the logged torque along a recording of T samples.

    Attributes:
        Y: Rigid-body regressor, shape (T, n, 10 n).
        nominal: Torque of the nominal model [N m or N], shape (T, n).
        effects: Columns of all candidates, shape (T, n, size), zero in rows a candidate does not touch.
    """

    Y: np.ndarray
    nominal: np.ndarray
    effects: np.ndarray


def columns_along(lib: Library, recording: Conditioned, loads: Loads | None = None) -> Columns:
    """Rigid-body regressor, nominal torque and all candidate columns along a recording.

    Args:
        lib: The library.
        recording: T samples.
        loads: Loads along the recording [N m or N]; the nominal model's where None.

    """
    T, n = recording.q.shape
    parts = []
    for start in range(0, T, CHUNK):
        piece = [x[start : start + CHUNK] for x in (recording.t, recording.q, recording.qd, recording.qdd)]
        piece += [piece[1]] * 2 if loads is None else [x[start : start + CHUNK] for x in loads]
        pad = CHUNK - len(piece[0])
        piece = [np.pad(x, ((0, pad),) + ((0, 0),) * (x.ndim - 1), mode="edge") for x in piece]
        t, q, qd, qdd, load, total = piece
        Y = dynamics.regressor_batch(lib.robot, jnp.asarray(q), jnp.asarray(qd), jnp.asarray(qdd))
        out = _columns(
            lib.robot, tuple(b[0] for b in lib.blocks), Y, t, q, qd, qdd, load, total, recording.rest_speed,
            [b[1] for b in lib.blocks], [b[2] for b in lib.blocks], jnp.asarray(loads is None),
        )  # fmt: skip
        parts.append([np.asarray(x)[: CHUNK - pad] for x in (Y, *out)])
    return Columns(*(np.concatenate(x) for x in zip(*parts, strict=True)))


# The regressor is compiled apart: fused into this program, XLA would unroll it once for every use.
@eqx.filter_jit
def _columns(robot, effects, Y, t, q, qd, qdd, load, total, rest_speed, sites, shapes, of_nominal):
    passive = jax.vmap(partial(_passive, robot))(q, qd, rest_speed + 0.0 * qd)
    nominal = Y @ robot.phi.ravel() + robot.armature * qdd + passive
    # Chosen by value, not by a static flag: both uses share one compiled program.
    load, total = (jnp.where(of_nominal, nominal, x) for x in (load, total))
    motion = Motion(t, q, qd, qdd, load, total, rest_speed)
    rows = []
    for effect, joints, shape in zip(effects, sites, shapes, strict=True):
        joints, shape = jnp.asarray(joints), jnp.asarray(shape)
        per_shape = jax.vmap(partial(effect.columns, motion), in_axes=(None, 0))
        c = jax.vmap(per_shape)(joints, shape)  # (S, G, T, m, k)
        S, G, T, m, k = c.shape
        onto = jax.nn.one_hot(joints, robot.n, dtype=c.dtype)  # (S, m, n)
        rows.append(jnp.einsum("sgtmk,smn->tnsgk", c, onto).reshape(T, robot.n, S * G * k))
    return nominal, jnp.concatenate([jnp.zeros((*q.shape, 0)), *rows], axis=-1)


def _passive(robot, q, qd, rest_speed):
    """The model's own friction and springs, with the sign of qd rounded off as in the candidates."""
    dry = robot.frictionloss * jnp.tanh(qd / rest_speed)
    return robot.damping * qd + dry + robot.stiffness * (q - robot.springref)


@dataclasses.dataclass(frozen=True)
class Stretch:
    """A stretch of one recording, low-passed: for each joint its rows of all columns and of the torque residual.

    Attributes:
        recording: Index of the recording it belongs to.
        t: Time of the rows [s], shape (R,).
        X: Columns [regressor | candidates] per joint, each (R, 10 n + size).
        y: Logged minus nominal torque per joint, (R, n).
        tau: Logged torque, low-passed, (R, n).
        nominal: Nominal torque, low-passed, (R, n).
        use: Rows in which the joint moves and nothing is lost, (R, n).
        q, qd, qdd: Motion at the rows, (R, n), for maps and the flexible competitor.
    """

    recording: int
    t: np.ndarray
    X: np.ndarray
    y: np.ndarray
    tau: np.ndarray
    nominal: np.ndarray
    use: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray


def stretch(lib: Library, recording: Conditioned, index: int, band: Band, loads: Loads | None = None) -> Stretch:
    """All columns of a recording through the common low-pass, at the kept samples."""
    Y, nominal, columns = columns_along(lib, recording, loads)
    kept = band.kept(len(recording.t))
    nominal, tau = band.apply(nominal), band.apply(recording.tau)
    X = np.concatenate([band.apply(Y), band.apply(columns)], axis=-1)
    return Stretch(
        index, recording.t[kept], X, tau - nominal, tau, nominal, recording.usable[kept],
        recording.q[kept], recording.qd[kept], recording.qdd[kept],
    )  # fmt: skip
