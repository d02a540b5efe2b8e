"""Sliding mode control of a rigid arm."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp

from irb140_jax.control.base import AbstractController, Desired
from irb140_jax.dynamics.mass import mass_matrix
from irb140_jax.dynamics.scalar_arm import ScalarArm, Scalars, torque
from irb140_jax.dynamics.scalars import Number
from irb140_jax.errors import InputError
from irb140_jax.robot import Robot
from irb140_jax.types import Joints

# Acceleration that the default gain stands for [rad/s^2 or m/s^2].
AUTHORITY = 20.0

Switching = Literal["saturation", "tanh", "sign"]
Form = Literal["computed", "passivity"]


class SlidingMode(AbstractController):
    """Sliding mode on s = ed + L e, e = q_d - q, with the model's torque fed forward.

        tau = M (qdd_d + L ed) + C v + g + Ks s + K f(s / layer)

    v = qd in the form "computed", v = qd_d + L e in the form "passivity"; f is clip to [-1, 1], tanh or sign.

    Attributes:
        model: What the controller believes of the arm; M, C, g and the drives are its own.
        slope: L, rate at which the error dies out on the surface [1/s], shape (n,).
        gain: K, torque against what the model doesn't know [N m or N], shape (n,).
        layer: Half width of the layer around s = 0 in which K is blended [rad/s or m/s], shape (n,); "sign" has none.
        damping: Ks, torque proportional to s [N m s/rad or N s/m], shape (n,).
        switching: f.
        form: Which speeds C acts on.

    Source: Slotine, Li, Applied Nonlinear Control (1991), sections 7.1 and 9.1; for the choices that the study leaves
        open, see docs/study.md.
    """

    model: Robot
    slope: Joints
    gain: Joints
    layer: Joints
    damping: Joints
    switching: Switching = eqx.field(static=True, default="saturation")
    form: Form = eqx.field(static=True, default="computed")

    def __check_init__(self):
        for name in ("slope", "gain", "layer", "damping"):
            shape = jnp.shape(getattr(self, name))
            if shape[-1:] != (len(self.model.joint_names),):
                raise InputError(f"sliding mode: {name} has shape {shape}; give one number for each joint of the model")
        if self.switching not in ("saturation", "tanh", "sign"):
            raise InputError(f"sliding mode: switching '{self.switching}'; known: saturation, tanh, sign")
        if self.form not in ("computed", "passivity"):
            raise InputError(f"sliding mode: form '{self.form}'; known: computed, passivity")

    def law(self, arm: ScalarArm, q: Scalars, qd: Scalars, desired: Desired) -> Scalars:
        """Joint torques [N m or N], n scalars."""
        joints = range(arm.n)
        slope, gain, layer, damping = (jnp.unstack(x) for x in (self.slope, self.gain, self.layer, self.damping))
        e = [desired.q[i] - q[i] for i in joints]
        ed = [desired.qd[i] - qd[i] for i in joints]
        s = [ed[i] + slope[i] * e[i] for i in joints]
        qdd = [desired.qdd[i] + slope[i] * ed[i] for i in joints]
        carried = [desired.qd[i] + slope[i] * e[i] for i in joints] if self.form == "passivity" else None
        model = torque(arm, q, qd, qdd, carried)
        return [model[i] + damping[i] * s[i] + gain[i] * self._switch(s[i], layer[i]) for i in joints]

    def _switch(self, s: Number, layer: Number) -> Number:
        if self.switching == "sign":
            return jnp.sign(s)
        return jnp.tanh(s / layer) if self.switching == "tanh" else jnp.clip(s / layer, -1.0, 1.0)


def sliding_mode(
    model: Robot,
    *,
    slope: float = 10.0,
    gain: float | Joints | None = None,
    layer: float = 0.1,
    damping: float | Joints = 0.0,
    switching: Switching = "saturation",
    form: Form = "computed",
) -> SlidingMode:
    """A sliding mode controller with the same numbers for all joints; a gain or damping by joint may be given.

    The defaults are ours, the study gives none: errors die out within half a second (5 / slope); the gain is what moves
    each joint's own inertia at `AUTHORITY`, so that all joints switch alike and steps of 1 ms stay well within the
    layer (gain / (layer inertia) = 200 / s).

    Args:
        model: What the controller believes of the arm, n joints.
        slope: Rate at which the error dies out on the surface [1/s].
        gain: Torque against what the model doesn't know [N m or N], shape () or (n,); default `AUTHORITY` times the
            diagonal of the model's mass matrix at its reference pose.
        layer: Half width of the boundary layer [rad/s or m/s].
        damping: Torque proportional to s [N m s/rad or N s/m], shape () or (n,).
        switching: "saturation", "tanh" or "sign".
        form: "computed" or "passivity".

    Raises:
        InputError: Unknown switching or form, or a number for each joint of another robot.
    """
    each = lambda x: x * jnp.ones(model.n) if jnp.ndim(x) == 0 else jnp.asarray(x)  # noqa: E731
    if gain is None:
        gain = AUTHORITY * jnp.diag(mass_matrix(model, model.reference))
    return SlidingMode(model, each(slope), each(gain), each(layer), each(damping), switching, form)
