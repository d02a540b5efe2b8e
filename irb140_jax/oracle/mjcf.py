"""A robot as MJCF, for MuJoCo to simulate: what robots made in memory, without a file, are judged by."""

import numpy as np

from irb140_jax.robot import Robot


def mjcf(robot: Robot, timestep: float = 0.001) -> str:
    """MJCF of the chain with its inertials, rotors, springs, damping and tool; no limits, dry friction or actuators.

    Args:
        robot: Arm with n joints and concrete numbers; every link with a possible inertia.
        timestep: Step of MuJoCo's Euler integration [s]; damping is explicit, as in plain semi-implicit Euler.

    Returns:
        The XML.
    """
    inner = f'<site name="tool" {_placed(robot.tool_rotation, robot.tool_position)}/>'
    for i in reversed(range(robot.n)):
        inner = (
            f'<body name="link{i + 1}" {_placed(robot.rotation[i], robot.position[i])}>'
            f"{_inertial(robot, i)}{_joint(robot, i)}{inner}</body>"
        )
    base = f'<body name="base" {_placed(robot.base_rotation, robot.base_position)}>{inner}</body>'
    gravity = _text(np.asarray(robot.base_rotation) @ np.asarray(robot.gravity))
    return (
        '<mujoco><compiler angle="radian" autolimits="true" boundmass="1e-12" boundinertia="1e-15"/>'
        f'<option timestep="{timestep!r}" integrator="Euler" gravity="{gravity}">'
        '<flag eulerdamp="disable" constraint="disable"/></option>'
        f"<worldbody>{base}</worldbody></mujoco>"
    )


def _joint(robot: Robot, i: int) -> str:
    kind = "slide" if robot.is_slide[i] else "hinge"
    return (
        f'<joint name="{robot.joint_names[i]}" type="{kind}" axis="{_text(robot.axis[i])}" '
        f'ref="{_text(robot.reference[i])}" armature="{_text(robot.armature[i])}" damping="{_text(robot.damping[i])}" '
        f'stiffness="{_text(robot.stiffness[i])}" springref="{_text(robot.springref[i])}"/>'
    )


def _inertial(robot: Robot, i: int) -> str:
    inertia = np.asarray(robot.inertia[i])
    full = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return f'<inertial mass="{_text(robot.mass[i])}" pos="{_text(robot.com[i])}" fullinertia="{_text(full)}"/>'


def _placed(rotation, position) -> str:
    """Attributes of a pose; axes rather than a quaternion, since those are what the robot holds."""
    R = np.asarray(rotation)
    return f'pos="{_text(position)}" xyaxes="{_text(np.concatenate([R[:, 0], R[:, 1]]))}"'


def _text(x) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(np.asarray(x)))
