"""What effects see of the rigid body, differentiated where they ask for it and not otherwise."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax import kinematics
from irb140_jax.dynamics.chain import Plan, chain
from irb140_jax.dynamics.newton_euler import rigid_torque
from irb140_jax.dynamics.regressor import all_rows, regressor_blocks
from irb140_jax.effects.gravity_tilt import across
from irb140_jax.robot import Robot, about_origin
from irb140_jax.robot.tree import path
from irb140_jax.types import Joints, JointSamples, Scalar


class Sensitivities(eqx.Module):
    """The fields of `effects.RigidBody`, as derivatives in JAX instead of differences.

    Attributes:
        robot: The model, with refitted inertials.
        ahead: Its plan.
        q, qd, qdd: The motion, shape (T, n).
    """

    robot: Robot
    ahead: Plan
    q: JointSamples
    qd: JointSamples
    qdd: JointSamples

    @property
    def by_gravity(self) -> Float[Array, "T n 3"]:
        """Torque per unit of each component of gravity in base axes."""
        # The plan's last three numbers are gravity, whose zeros are none here.
        unknown = dataclasses.replace(self.ahead, known=(*self.ahead.known[:-3], None, None, None))
        still = jnp.zeros_like(self.q).T

        def torque(gravity):
            arm = eqx.tree_at(lambda r: r.gravity, self.robot, gravity)
            return rigid_torque(chain(arm, unknown), self.q.T, still, still).T

        return jax.jacfwd(torque)(self.robot.gravity)

    @property
    def gravity(self) -> Scalar:
        """Size of gravity."""
        return jnp.linalg.norm(self.robot.gravity)

    @property
    def across(self) -> Float[Array, "2 3"]:
        """Two unit vectors across gravity in base axes."""
        return across(self.robot.gravity)

    @property
    def held(self) -> Float[Array, "T n 10"]:
        """Torque per inertial parameter of a body held by the last link, about the tool."""
        block = regressor_blocks(chain(self.robot, self.ahead), self.q.T, self.qd.T, self.qdd.T)[-1]
        block = all_rows(block, path(self.robot.parent, self.robot.n - 1), self.robot.n)
        return jnp.moveaxis(block, -1, 0) @ about_origin(self.robot.tool_position)

    @property
    def by_q(self) -> Float[Array, "T n n"]:
        """Derivative of the torque by joint positions, torque first."""
        return self._by(0) + jnp.diag(self.robot.stiffness)  # springs of the model pull at the link

    @property
    def spring(self) -> Joints:
        """Stiffness of the model's own springs."""
        return self.robot.stiffness

    @property
    def by_qd(self) -> Float[Array, "T n n"]:
        """Derivative of the torque by joint velocities."""
        return self._by(1)

    @property
    def tool(self) -> Float[Array, "T 3"]:
        """Position of the tool in the world."""
        return jax.vmap(lambda q: kinematics.forward_kinematics(self.robot, q)[:3, 3])(self.q)

    @property
    def tool_jacobian(self) -> Float[Array, "T n 6"]:
        """Velocity and angular velocity of the tool per joint speed, world axes."""
        return jax.vmap(lambda q: kinematics.jacobian(self.robot, q).T)(self.q)

    @property
    def mass(self) -> Float[Array, "T n n"]:
        """Mass matrix of the links."""
        return self._by(2)

    def _by(self, which: int) -> Float[Array, "T n n"]:
        """Derivative by one of q, qd, qdd; each sample depends on its own row only, so n directions are enough."""
        arm, motion = chain(self.robot, self.ahead), [self.q, self.qd, self.qdd]

        def torque(x):
            return rigid_torque(arm, *(y.T for y in (*motion[:which], x, *motion[which + 1 :]))).T

        directions = jnp.broadcast_to(jnp.eye(self.robot.n)[:, None, :], (self.robot.n, *self.q.shape))
        slopes = jax.vmap(lambda v: jax.jvp(torque, (motion[which],), (v,))[1])(directions)
        return jnp.moveaxis(slopes, 0, -1)
