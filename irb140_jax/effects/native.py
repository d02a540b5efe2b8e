"""Changes of a model by which effects become numbers that MJCF has: friction, rotors, springs, gears."""

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from irb140_jax.robot import Robot

# A spring so soft, and so far bent, that its torque changes by this share over a rad (or m): a constant torque.
SOFT = 1e-7


def with_joint(robot: Robot, field: str, joint: int, change: float) -> Robot:
    """The robot with a number of one joint changed; friction and rotors never below zero."""
    values = getattr(robot, field)
    changed = values.at[joint].add(change)
    if field in ("frictionloss", "damping", "armature"):
        changed = changed.at[joint].max(0.0)
    return eqx.tree_at(lambda r: getattr(r, field), robot, changed)


def adds_to(field: str) -> Callable[[Robot, tuple[int, ...], np.ndarray, np.ndarray], Robot]:
    """Of an effect whose first amplitude is that much more of a number of its joint: `in_model` of `Export`."""
    return lambda robot, joints, w, shape: with_joint(robot, field, joints[0], w[0])


def with_spring(robot: Robot, joint: int, slope: float, constant: float) -> Robot:
    """The robot with slope q + constant more torque on a joint [N m or N], in its one spring k (q - rest).

    A constant alone becomes a very soft spring, bent far.
    """
    k = float(robot.stiffness[joint]) + slope
    pull = float(robot.stiffness[joint] * robot.springref[joint]) - constant
    if abs(k) <= SOFT * abs(pull):
        k = SOFT * abs(pull)
    rest = pull / k if k else float(robot.springref[joint])
    where = lambda r: (r.stiffness, r.springref)  # noqa: E731
    return eqx.tree_at(where, robot, (robot.stiffness.at[joint].set(k), robot.springref.at[joint].set(rest)))


def with_gear(robot: Robot, joint: int, factor: float) -> Robot:
    """The robot with another joint torque per unit of control."""
    return eqx.tree_at(lambda r: r.gear, robot, jnp.asarray(robot.gear).at[joint].multiply(factor))
