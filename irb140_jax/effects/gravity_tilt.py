"""Gravity tilt: the base is not level."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.arrays import on_device
from irb140_jax.effects.base import Effect
from irb140_jax.effects.records import Export, Law, Parameter, Place, Prior, all_joints

LARGEST = 0.5  # [rad]; beyond it first order is wrong, and a person sees it


def _columns(motion, joints, shape):
    """Torque of a tilted gravity vector: tau_g(g + g tilt e), e perpendicular to gravity, in two components."""
    return jnp.einsum("tng,kg->tnk", motion.rigid.by_gravity, motion.rigid.gravity * motion.rigid.across)


def _from_physical(values):
    direction = values.get("direction", 0.0)
    return values["tilt"] * np.array([np.cos(direction), np.sin(direction)]), np.zeros(0)


def _in_model(robot, joints, w, shape):
    g = np.asarray(robot.gravity)
    leant = g + np.linalg.norm(g) * np.asarray(w) @ np.asarray(across(robot.gravity))
    return eqx.tree_at(lambda r: r.gravity, robot, on_device(leant))


@jax.jit  # as `robot.robot._phi`
def across(gravity: Float[Array, "3"]) -> Float[Array, "2 3"]:
    """Two unit vectors across gravity, the directions of the two components of the tilt; any two where there is none.

    The first is square to the axis along which gravity has least.
    """
    size = jnp.linalg.norm(gravity)
    down = jnp.where(size > 0, gravity / jnp.where(size > 0, size, 1.0), jnp.array([0.0, 0.0, -1.0]))
    first = jnp.cross(down, jnp.eye(3)[jnp.argmin(jnp.abs(down))])
    first = first / jnp.linalg.norm(first)
    return jnp.stack([first, jnp.cross(down, first)])


EFFECT = Effect(
    slug="gravity_tilt",
    title="a base that is not level",
    needs="a sweep of the first joint, in postures whose gravity torques are not all in proportion",
    confused_with={
        "payload": "the same poses with and without a known mass",
        "encoder_offset": "a sweep of the first joint over its range",
    },
    where="in the gravity torque, at rest too; the base tilts by {tilt:deg}",
    law=Law(
        equation="d g(q)/d gravity . g tilt e",
        source="Siciliano et al., Robotics, 2009, ch. 7, gravity in base axes",
        parameters=(Parameter("tilt", "rad", low=0.0),),
        columns=_columns,
        to_physical=lambda w, shape: jnp.hypot(w[0], w[1])[None],
        from_physical=_from_physical,
        variants=((0, 1),),
    ),
    place=Place(sites=all_joints, everywhere=True),
    prior=Prior(lowest=(-LARGEST, -LARGEST), highest=(LARGEST, LARGEST), vector=True, of_rigid_body=True),
    export=Export(mjcf="the gravity of the option element", in_model=_in_model),
)
