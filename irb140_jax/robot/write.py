"""A robot as MJCF: what `load_robot` reads, and MuJoCo simulates."""

import numpy as np

from irb140_jax.robot.drive import ServoGains
from irb140_jax.robot.robot import Robot
from irb140_jax.robot.tree import children

# By default MuJoCo's dry friction lets a joint that should stick creep (`tests/test_motion.py`: half a radian in ten
# seconds).  As stiff as can be written, and as quick as the time step allows (no less than two steps), it holds.
STICKS = 'solreffriction="0.0001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'


def robot_mjcf(robot: Robot, option: str = "", flag: str = "", servos: ServoGains | None = None) -> str:
    """MJCF of the chain or tree: inertials, rotors, friction, springs, limits, motors with their gears, and the tool.

    Shapes to draw or to touch are no part of a `Robot`, so there are none.

    Args:
        robot: Arm with n joints and concrete numbers; every link with a possible inertia.
        option: Attributes of <option> beside gravity, as XML.
        flag: Attributes of <option><flag>, as XML.
        servos: Position servos that stand in the place of motors, but where their kp is NaN.

    Returns:
        The XML.  Loaded again, every number is the same to rounding.
    """
    base = f'<body name="base" {_placed(robot.base_rotation, robot.base_position)}>{_carried_by(robot, -1)}\n</body>'
    gravity = _text(np.asarray(robot.base_rotation) @ np.asarray(robot.gravity))
    motors = "\n".join(_motor(robot, i) if servos is None or np.isnan(servos.kp[i]) else _servo(robot, i, servos)
                       for i in range(robot.n))  # fmt: skip
    return (
        f'<mujoco model="{_escaped(robot.name)}">\n'
        '<compiler angle="radian" autolimits="true" boundmass="1e-12" boundinertia="1e-15"/>\n'
        f'<option gravity="{gravity}" {option}><flag {flag}/></option>\n{_speeds(robot)}'
        f"<worldbody>\n{base}\n</worldbody>\n<actuator>\n{motors}\n</actuator>\n</mujoco>\n"
    )


def _carried_by(robot: Robot, link: int) -> str:
    """The bodies that sit on a link, -1 for the base, with all beyond them; on the last link the tool."""
    bodies = "".join(
        f'\n<body name="link{i + 1}" {_placed(robot.rotation[i], robot.position[i])}>\n'
        f"{_inertial(robot, i)}\n{_joint(robot, i)}{_carried_by(robot, i)}</body>"
        for i in children(robot.parent, link)
    )
    tool = f'<site name="tool" {_placed(robot.tool_rotation, robot.tool_position)}/>'
    return bodies + tool if link == robot.n - 1 else bodies


def _joint(robot: Robot, i: int) -> str:
    numbers = {
        "ref": robot.reference, "armature": robot.armature, "damping": robot.damping,
        "frictionloss": robot.frictionloss, "stiffness": robot.stiffness, "springref": robot.springref,
    }  # fmt: skip
    lower, upper = float(robot.lower[i]), float(robot.upper[i])
    limits = f' range="{_text([lower, upper])}"' if np.isfinite(lower) and np.isfinite(upper) else ""
    written = " ".join(f'{name}="{_text(values[i])}"' for name, values in numbers.items())
    kind = "slide" if robot.is_slide[i] else "hinge"
    name = _escaped(robot.joint_names[i])
    return f'<joint name="{name}" type="{kind}" axis="{_text(robot.axis[i])}" {written} {STICKS}{limits}/>'


def _inertial(robot: Robot, i: int) -> str:
    inertia = np.asarray(robot.inertia[i])
    full = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return f'<inertial mass="{_text(robot.mass[i])}" pos="{_text(robot.com[i])}" fullinertia="{_text(full)}"/>'


def _motor(robot: Robot, i: int) -> str:
    """A torque source; its force is limited on its own side of the gear."""
    gear, effort = float(robot.gear[i]), float(robot.effort_limit[i])
    limit = f' forcerange="{_text([-effort / abs(gear), effort / abs(gear)])}"' if np.isfinite(effort) else ""
    name = _escaped(robot.joint_names[i])
    return f'<motor name="{name}" joint="{name}" gear="{_text(gear)}"{limit}/>'


def _servo(robot: Robot, i: int, servos: ServoGains) -> str:
    """A position servo; its control is the commanded position."""
    numbers = {"kp": servos.kp[i], "kv": np.nan_to_num(servos.kd[i])}
    if np.isfinite(servos.limit[i]):
        numbers["forcerange"] = [-servos.limit[i], servos.limit[i]]
    if np.isfinite(servos.low[i]) and np.isfinite(servos.high[i]):
        numbers["ctrlrange"] = [servos.low[i], servos.high[i]]
    name, written = _escaped(robot.joint_names[i]), " ".join(f'{k}="{_text(x)}"' for k, x in numbers.items())
    return f'<position name="{name}" joint="{name}" {written}/>'


def _speeds(robot: Robot) -> str:
    """Speed limits where there are any; MJCF has no attribute for them, `load_robot` reads this."""
    limit = np.minimum(np.asarray(robot.velocity_limit), 1e9)  # MJCF has no infinity
    if np.all(limit >= 1e9):
        return ""
    return f'<custom><numeric name="velocity_limit" size="{robot.n}" data="{_text(limit)}"/></custom>\n'


def _placed(rotation, position) -> str:
    """Attributes of a pose; axes rather than a quaternion, since those are what the robot holds."""
    R = np.asarray(rotation)
    return f'pos="{_text(position)}" xyaxes="{_text(np.concatenate([R[:, 0], R[:, 1]]))}"'


def _text(x) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(np.asarray(x)))


def _escaped(name: str) -> str:
    return name.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
