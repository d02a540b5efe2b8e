"""What the network is asked: joints to position, or position to joints; and what an answer costs (equation 33)."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from irb140_jax.kinematics import forward_kinematics
from irb140_jax.learned.condition import ConditionPenalty, frobenius_condition_number
from irb140_jax.learned.mlp import ONE_LAYER_50, Activation, Hidden, KinematicMlp, kinematic_mlp
from irb140_jax.learned.samples import Samples
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, Scalar, Vec3

Direction = Literal["forward", "inverse"]
Loss = Literal["mse", "mae"]


class Task(eqx.Module):
    """The question, and the cost of its answers.

    The text leaves the direction open: its inputs are "Cartesian positions and velocities", its error is Cartesian.
    Either way the error is where the tool ends up: the inverse's joints are put through the forward kinematics.

    Attributes:
        robot: Arm with n joints.
        penalty: Cost of poses near singular ones, on the joints that an inverse network chooses; a forward one
            chooses none, so that its weights feel nothing of it.
        direction: "forward", joints to position; or "inverse", position to joints.
        velocities: Whether velocities are given beside the positions, as the text says.
        loss: "mae" as equation 33, or "mse" as the text on training.
    """

    robot: Robot
    penalty: ConditionPenalty | None = None
    direction: Direction = eqx.field(static=True, default="inverse")
    velocities: bool = eqx.field(static=True, default=False)
    loss: Loss = eqx.field(static=True, default="mse")

    def inputs(self, samples: Samples) -> Float[Array, "N i"]:
        """What the network is given, one row a sample."""
        forward = self.direction == "forward"
        x, xd = (samples.q, samples.qd) if forward else (samples.position, samples.velocity)
        return jnp.concatenate([x, xd], axis=1) if self.velocities else x

    def network(
        self, samples: Samples, hidden: Hidden = ONE_LAYER_50, activation: Activation = "sigmoid",
        *, key: Key[Array, ""],
    ) -> KinematicMlp:  # fmt: skip
        """A network for this task before training, scaled to the range of these samples."""
        answers = samples.position if self.direction == "forward" else samples.q
        inputs, outputs = (jnp.stack([x.min(axis=0), x.max(axis=0)]) for x in (self.inputs(samples), answers))
        return kinematic_mlp(inputs, outputs, hidden, activation, key=key)

    def answer(self, network: KinematicMlp, x: Float[Array, " i"]) -> tuple[Joints, Vec3]:
        """Joint positions, given or chosen, and where the tool is by the answer [m], shapes (n,) and (3,)."""
        y = network(x)
        if self.direction == "forward":
            return x[: self.robot.n], y
        return y, forward_kinematics(self.robot, y)[:3, 3]

    def cost(
        self, network: KinematicMlp, x: Float[Array, "N i"], position: Float[Array, "N 3"]
    ) -> tuple[Scalar, Scalar]:
        """Mean cost of the answers, and their mean distance from where the tool should be [m].

        Args:
            network: What answers.
            x: Inputs, shape (N, i).
            position: Where the tool should be [m], shape (N, 3).

        Source: equation 33 of the study.
        """
        q, reached = jax.vmap(self.answer, (None, 0))(network, x)
        error = reached - position
        distance = jnp.mean(jnp.linalg.norm(error, axis=1))
        cost = jnp.mean(jnp.abs(error)) if self.loss == "mae" else jnp.mean(error**2)
        if self.penalty is None:
            return cost, distance
        kappa = jax.vmap(frobenius_condition_number, (None, 0))(self.robot, q)
        return cost + jnp.mean(jax.vmap(self.penalty)(kappa)), distance
