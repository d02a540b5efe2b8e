"""The corrected model to take away: a pytree that gives torque from motion and motion from torque, in JAX."""

from typing import cast

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.arrays import on_device
from irb140_jax.dynamics.chain import Plan, chain, plan
from irb140_jax.dynamics.newton_euler import rigid_torque
from irb140_jax.effects import Effect, Motion, RigidBody
from irb140_jax.errors import InputError
from irb140_jax.mismatch.columns.sensitivities import Sensitivities
from irb140_jax.mismatch.columns.torques import added_up, better_known
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.robot import Robot, with_phi
from irb140_jax.simulate import AbstractPlant
from irb140_jax.types import Joints, JointSamples, Samples, Scalar

# Newton steps from torque to acceleration: all effects but |load| are linear in qdd, and that one is so by pieces.
NEWTON_STEPS = 3

Memory = tuple[Float[Array, " s"], ...]


class Acting(eqx.Module):
    """A named effect with its numbers.

    Attributes:
        effect: The effect.
        joints: Indices of its joints.
        amplitudes: One for every column of the effect, zero for those not used, shape (k,).
        shape: Shape parameters, shape (s,).
    """

    effect: Effect = eqx.field(static=True)
    joints: tuple[int, ...] = eqx.field(static=True)
    amplitudes: Float[Array, " k"]
    shape: Float[Array, " s"]


class CorrectedRobot(AbstractPlant):
    """Rigid bodies with refitted inertials, and the named effects.

    Everything is pure and may be jitted, mapped and differentiated, by the parameters of the effects too.

    Attributes:
        robot: The model with refitted inertials and the springs found, whose slopes the effects see.
        nominal: The model as given; the load that effects start from is its own, as in the fit.
        rest_speed: Speed over which the sign of qd is rounded off [rad/s or m/s], shape (n,).
        effects: What acts beside the rigid bodies.
        ahead: What the robot's geometry says before any sample is seen.
    """

    robot: Robot
    nominal: Robot
    rest_speed: Joints
    effects: tuple[Acting, ...]
    ahead: Plan

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.robot.n

    def inverse_dynamics(self, q: Joints, qd: Joints, qdd: Joints, t: float | Scalar = 0.0) -> Joints:
        """Torque that the controller would log at one instant.

        Args:
            q: Joint positions [rad or m], shape (n,).
            qd: Joint velocities [rad/s or m/s], shape (n,).
            qdd: Joint accelerations [rad/s^2 or m/s^2], shape (n,).
            t: Time since the motion began [s]; for effects that drift.

        Returns:
            tau [N m or N], shape (n,).

        Raises:
            InputError: An effect depends on what was before; use `inverse_dynamics_along`.
        """
        for a in self.effects:
            if a.effect.export.history:
                raise InputError(
                    f"inverse_dynamics: {a.effect.slug} {a.effect.export.history}, so its torque at a single instant "
                    "is unknown: give the whole motion to inverse_dynamics_along"
                )
        return _torque(self, jnp.atleast_1d(jnp.asarray(t, float)), q[None], qd[None], qdd[None])[0]

    def inverse_dynamics_along(self, t: Samples, q: JointSamples, qd: JointSamples, qdd: JointSamples) -> JointSamples:
        """Torque that the controller would log along a motion, effects with a memory included.

        Args:
            t: Time since the motion began [s], evenly spaced, shape (T,), T at least 2.
            q: Joint positions [rad or m], shape (T, n).
            qd: Joint velocities [rad/s or m/s], shape (T, n).
            qdd: Joint accelerations [rad/s^2 or m/s^2], shape (T, n).

        Returns:
            tau [N m or N], shape (T, n); on the grid of `predict`, what that gives.
        """
        t, q, qd, qdd = (jnp.asarray(x, float) for x in (t, q, qd, qdd))
        return _torque(self, t, q, qd, qdd)

    def forward_dynamics(self, q: Joints, qd: Joints, tau: Joints, t: float | Scalar = 0.0) -> Joints:
        """Acceleration under the torque that the controller asks for; the inverse of `inverse_dynamics`.

        Args:
            q: Joint positions [rad or m], shape (n,).
            qd: Joint velocities [rad/s or m/s], shape (n,).
            tau: Torque as it would be logged [N m or N], shape (n,).
            t: Time since the motion began [s].

        Returns:
            qdd [rad/s^2 or m/s^2], shape (n,).

        Raises:
            InputError: An effect has a memory; simulate with `simulate.play`, which keeps it.
        """
        return self._acceleration(q, tau, lambda qdd: self.inverse_dynamics(q, qd, qdd, t))

    def at_rest(self, q: Joints) -> Memory:
        """What the effects remember after standing still at q.

        Raises:
            InputError: An effect can't be simulated forward in time; the message says which and why.
        """
        for a in self.effects:
            if a.effect.export.history and not a.effect.export.step:
                raise InputError(
                    f"simulation: {a.effect.slug} {a.effect.export.history} and can't be simulated forward in time; "
                    f"leave it out with without('{a.effect.slug}')"
                )
        still = jnp.zeros(self.n)
        present = self.without(*(a.effect.slug for a in self.effects if a.effect.export.history))
        load = present.inverse_dynamics(q, still, still)
        none = lambda q, tau: jnp.zeros(0)  # noqa: E731
        at = [jnp.array(a.joints) for a in self.effects]
        return tuple((a.effect.export.memory or none)(q[j], load[j]) for a, j in zip(self.effects, at, strict=True))

    def respond(
        self, memory: Memory, t: Scalar, q: Joints, qd: Joints, tau: Joints, dt: Scalar
    ) -> tuple[Joints, Memory]:
        """Acceleration at the start of a step, and what the effects remember after it (see `AbstractPlant`)."""
        columns: list[Float[Array, "m k"] | None] = []
        after: list[Float[Array, " s"]] = []
        for a, held in zip(self.effects, memory, strict=True):
            joints = jnp.array(a.joints)
            if not a.effect.export.step:
                columns.append(None)
                after.append(held)
                continue
            c, through, held = a.effect.export.step(held, q[joints], tau[joints], a.amplitudes, a.shape, dt)
            tau = tau.at[joints].set(through)
            columns.append(c)
            after.append(held)
        time = jnp.atleast_1d(t)
        inverse = lambda qdd: _torque(self, time, q[None], qd[None], qdd[None], tuple(columns))[0]  # noqa: E731
        return self._acceleration(q, tau, inverse), tuple(after)

    def without(self, *slugs: str) -> "CorrectedRobot":
        """The same model without some of its effects."""
        return eqx.tree_at(lambda r: r.effects, self, tuple(a for a in self.effects if a.effect.slug not in slugs))

    def _acceleration(self, q: Joints, tau: Joints, inverse) -> Joints:
        """Newton's method on inverse dynamics, from rest."""

        def step(_, qdd):
            return qdd - jnp.linalg.solve(jax.jacfwd(inverse)(qdd), inverse(qdd) - tau)

        return jax.lax.fori_loop(0, NEWTON_STEPS, step, jnp.zeros_like(q))

    def summed(self, motion: Motion, base: JointSamples, stepped) -> tuple[JointSamples, ...]:
        """Load, total, carried and scaled torque (see `Loads`), and what is logged."""
        parts = []
        for k, a in enumerate(self.effects):
            rows = jnp.arange(self.n) if a.effect.place.everywhere else jnp.array(a.joints)
            given = None if stepped is None else stepped[k]
            columns = a.effect.law.columns(motion, jnp.array(a.joints), a.shape) if given is None else given[None]
            parts.append((a.effect.place.at, jnp.zeros_like(base).at[:, rows].add(columns @ a.amplitudes)))
        loads, logged = added_up(base, self.motor_side(motion.qd, motion.qdd), parts)
        return *loads, logged  # pyright: ignore[reportReturnType]: arrays of JAX here

    def own_torque(self, q: JointSamples, qd: JointSamples, qdd: JointSamples) -> JointSamples:
        """Rotors, friction and springs of the model as given."""
        return self.motor_side(qd, qdd) + self.nominal.stiffness * (q - self.nominal.springref)

    def motor_side(self, qd: JointSamples, qdd: JointSamples) -> JointSamples:
        """Rotors and friction of the model as given, which the links don't feel."""
        r = self.nominal
        return r.armature * qdd + r.damping * qd + r.frictionloss * jnp.tanh(qd / self.rest_speed)


@eqx.filter_jit
def _torque(
    robot: CorrectedRobot, t: Samples, q: JointSamples, qd: JointSamples, qdd: JointSamples,
    stepped: tuple[Float[Array, "m k"] | None, ...] | None = None,
) -> JointSamples:  # fmt: skip
    """Torque along a motion; `stepped` are the columns of effects with a memory, where a simulation has them."""

    def rigid(phi):
        return rigid_torque(chain(with_phi(robot.nominal, phi), robot.ahead), q.T, qd.T, qdd.T).T

    # Mapped over both sets of inertials, which compiles the recursion once.
    both = jax.vmap(rigid)(jnp.stack([robot.robot.phi, robot.nominal.phi]))
    base, load = both + robot.own_torque(q, qd, qdd)
    if not robot.effects:
        return base
    dt = jnp.mean(jnp.diff(t)) if len(t) > 1 else 1.0
    rate = lambda x: jnp.asarray(jnp.gradient(x, dt, axis=0)) if len(t) > 1 else jnp.zeros_like(x)  # noqa: E731
    since = t - t[0] if len(t) > 1 else t
    direction = jnp.tanh(qd / robot.rest_speed)
    sensed = Sensitivities(robot.robot, robot.ahead, q, qd, qdd)

    def summed(_, torques):
        load, total, carried, scaled, _ = torques
        rigid = cast(RigidBody, sensed)  # it has the same names, and derives what is asked for
        new = jnp.array(-1.0)  # no recording of the diagnosis
        moving = (since, q, qd, qdd, load, total, carried, rate(scaled), rigid)
        motion = Motion(*moving, robot.rest_speed, direction, new)
        return robot.summed(motion, base, stepped)

    # Twice, as in the fit: columns that depend on the load see the corrected one the second time.
    carried = load - robot.motor_side(qd, qdd)
    return jax.lax.fori_loop(0, 2, summed, (load, load, carried, load, load))[-1]


def corrected_robot(model: CorrectedModel) -> CorrectedRobot:
    """A diagnosis's corrected model in JAX.

    Args:
        model: From `load_model`.
    """
    acting = tuple(
        Acting(named.effect, named.joints, on_device(named.all_amplitudes()), on_device(named.shape))
        for named in model.named
    )
    robot = better_known(model.robot, model.phi_corrected, model.named)
    return CorrectedRobot(robot, model.robot, on_device(model.rest_speed), acting, plan(model.robot))
