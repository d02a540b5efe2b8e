"""What every controller is: a torque out of the state and what is wanted of it."""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from irb140_jax.dynamics.chain import Plan, plan
from irb140_jax.dynamics.scalar_arm import ScalarArm, Scalars, scalar_arm
from irb140_jax.robot import Robot
from irb140_jax.types import Joints


class Desired(NamedTuple):
    """Motion wanted at this moment: positions, velocities, accelerations; n scalars each, or shape (n,) each."""

    q: Scalars
    qd: Scalars
    qdd: Scalars


class AbstractController(eqx.Module):
    """A control law and the robot model it believes in.

    Attributes:
        model: The model; it may differ from the arm that is controlled.
    """

    model: eqx.AbstractVar[Robot]

    @abstractmethod
    def law(self, arm: ScalarArm, q: Scalars, qd: Scalars, desired: Desired) -> Scalars:
        """Joint torques [N m or N] in scalars, n each; `arm` is the model, made ready once outside the loop."""

    def prepared(self, ahead: Plan) -> ScalarArm:
        """The model in scalars."""
        return scalar_arm(self.model, ahead)

    def torque(self, q: Joints, qd: Joints, desired: tuple[Joints, Joints, Joints]) -> Joints:
        """Joint torques for one state.

        Args:
            q: Joint positions [rad or m], shape (n,).
            qd: Joint velocities [rad/s or m/s], shape (n,).
            desired: Wanted positions, velocities, accelerations, shape (n,) each.

        Returns:
            tau [N m or N], shape (n,).
        """
        wanted = Desired(*(list(jnp.unstack(jnp.asarray(x))) for x in desired))
        arm = self.prepared(plan(self.model))
        return jnp.stack([jnp.asarray(x) for x in self.law(arm, jnp.unstack(q), jnp.unstack(qd), wanted)])


class Unactuated(AbstractController):
    """No torque at all: the arm moves under gravity and what disturbs it.

    Attributes:
        model: The robot; nothing is asked of it but its number of joints.
    """

    model: Robot

    def law(self, arm: ScalarArm, q: Scalars, qd: Scalars, desired: Desired) -> Scalars:
        """Zeros."""
        return [jnp.zeros_like(x) for x in q]
