"""How good the answers are, and how they behave near singular poses."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.kinematics import jacobian
from irb140_jax.learned.mlp import KinematicMlp
from irb140_jax.learned.samples import Samples
from irb140_jax.learned.task import Task
from irb140_jax.types import Joints, Scalar


def position_errors(task: Task, network: KinematicMlp, samples: Samples) -> Float[Array, " N"]:
    """Distance of the tool by the answers from where it should be, e = ||p_pred - p_des|| [m], shape (N,).

    Source: equation 31 of the study.
    """
    _, reached = jax.vmap(task.answer, (None, 0))(network, task.inputs(samples))
    return jnp.linalg.norm(reached - samples.position, axis=1)


class Manners(NamedTuple):
    """An inverse network's answers beside the poses that the samples were made with; arrays of shape (N,).

    Attributes:
        error: Distance of the tool from where it should be [m].
        asked: Condition number (2-norm) of the tool's translation at the samples' own joints.
        chosen: The same at the joints that the network chose.
        speed: Largest joint speed per speed of the tool that following the network takes, ||dq/dp|| [rad/m].
        asked_speed: The same by the exact inverse at the samples' own joints, 1 / s_min [rad/m].
    """

    error: Float[Array, " N"]
    asked: Float[Array, " N"]
    chosen: Float[Array, " N"]
    speed: Float[Array, " N"]
    asked_speed: Float[Array, " N"]


@eqx.filter_jit
def manners(task: Task, network: KinematicMlp, samples: Samples) -> Manners:
    """Errors, condition numbers and joint speeds of an inverse network's answers.

    Args:
        task: With direction "inverse".
        network: What answers.
        samples: N of them.
    """

    def spectrum(q: Joints) -> Float[Array, " 3"]:
        return jnp.linalg.svd(jacobian(task.robot, q)[:3], compute_uv=False)

    def one(x: Float[Array, " i"], own: Joints) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        slope = jax.jacfwd(network)(x)[:, :3]
        s, t = spectrum(own), spectrum(network(x).astype(float))
        return s[0] / s[2], t[0] / t[2], jnp.linalg.norm(slope, 2), 1.0 / s[2]

    numbers = jax.vmap(one)(task.inputs(samples), samples.q)
    return Manners(position_errors(task, network, samples), *numbers)
