"""A robot as MJCF without constraints: what robots made in memory, without a file, are judged by."""

from irb140_jax.robot import Robot, robot_mjcf


def mjcf(robot: Robot, timestep: float = 0.001) -> str:
    """MJCF of the chain with its inertials, rotors, springs, damping and tool; limits and dry friction are off.

    Args:
        robot: Arm with n joints and concrete numbers; every link with a possible inertia.
        timestep: Step of MuJoCo's Euler integration [s]; damping is explicit, as in plain semi-implicit Euler.

    Returns:
        The XML.
    """
    option = f'timestep="{timestep!r}" integrator="Euler"'
    return robot_mjcf(robot, option, flag='eulerdamp="disable" constraint="disable"')
