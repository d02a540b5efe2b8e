"""What a `Robot` can't represent is refused where it touches the joints chosen: by name, with what to do about it."""

from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.choose import Choice
from irb140_jax.robot.drive import driven_joint

MAY_BE_INFINITE = ("lower", "upper", "velocity_limit", "effort_limit")


def refuse_unsupported(model: mujoco.MjModel, choice: Choice, source: str) -> None:
    """Raise if something beside rigid bodies, friction and springs acts on the joints chosen or what they carry.

    Args:
        model: Compiled model.
        choice: Its joints that make the robot.
        source: Where it came from, for the message.

    Raises:
        RobotError: Names the first thing that does not fit and what to do about it.
    """
    for check in (_forces, _actuators):
        for problem in check(model, choice):
            raise RobotError(f"{source}: {problem}")


def refuse_impossible_numbers(fields: Mapping[str, np.ndarray], names: tuple[str, ...], source: str) -> None:
    """Raise on NaN, and on friction or rotors of negative size: MuJoCo compiles files that hold them.

    Args:
        fields: Arrays of the robot to be, by the names of `Robot`'s fields.
        names: Joint names.
        source: Where they came from, for the message.

    Raises:
        RobotError: Names the field, and the joint where there is one.
    """
    for field, values in fields.items():
        if np.any(np.isnan(values)) or (np.any(np.isinf(values)) and field not in MAY_BE_INFINITE):
            shown = np.asarray(values).tolist()
            raise RobotError(f"{source}: {field} is {shown}; allowed: numbers: mend the file there")
    for field in ("armature", "damping", "frictionloss"):
        for name, value in zip(names, fields[field], strict=True):
            if value < 0.0:
                raise RobotError(f"{source}: joint '{name}' has {field} {value:g}; allowed: 0 or more: mend it there")


def _forces(model: mujoco.MjModel, choice: Choice) -> Iterator[str]:
    for body in np.flatnonzero(model.body_gravcomp):
        if choice.carrier[body] >= 0:
            name = model.body(body).name
            yield f"body '{name}' has gravcomp, which no joint spring is: remove it, or model the counterbalance"
    if model.opt.density or model.opt.viscosity or np.any(model.opt.wind):
        yield "<option> has a fluid (density, viscosity or wind), which is not part of this model: set them to 0"
    polynomials = (
        ("dof_dampingpoly", model.jnt_dofadr, "polynomial damping", "keep the first coefficient of damping only"),
        ("jnt_stiffnesspoly", None, "polynomial stiffness", "keep the first coefficient of stiffness only"),
        ("jnt_springyield", None, "a spring that yields (springyield)", "remove it"),
    )
    for field, address, what, remedy in polynomials:
        rows = _nonzero_rows(model, field)
        for j in choice.joints:
            if (j if address is None else int(address[j])) in rows:
                yield f"joint '{model.joint(j).name}' has {what}, which is not part of this model: {remedy}"
    for flex in range(getattr(model, "nflex", 0)):
        ends = model.flex_vertbodyid[model.flex_vertadr[flex] : model.flex_vertadr[flex] + model.flex_vertnum[flex]]
        if any(choice.carrier[int(body)] >= 0 for body in ends):
            yield "the arm carries a deformable body (flex), which rigid links can't represent: remove it"
    for body in np.flatnonzero(np.asarray(getattr(model, "body_plugin", np.full(model.nbody, -1))) >= 0):
        if choice.carrier[body] >= 0:
            yield f"body '{model.body(body).name}' has a plugin, which rigid links can't represent: remove it"


def _actuators(model: mujoco.MjModel, choice: Choice) -> Iterator[str]:
    driver: dict[int, str] = {}
    for a in range(model.actuator_trntype.shape[0]):
        name = _shown(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, a))
        joint = driven_joint(model, a)
        if joint is None:
            if _pushes(model, a, choice):
                yield f"actuator {name} drives no joint but the arm: drive a joint or remove it"
            continue
        if joint not in choice.joints:
            continue
        if joint in driver:
            yield f"joint '{model.joint(joint).name}' has two actuators, {driver[joint]} and {name}: keep one of them"
        driver[joint] = name
        yield from _actuator(model, a, name)


def _pushes(model: mujoco.MjModel, a: int, choice: Choice) -> bool:
    """Whether it acts at a site that the chosen joints move; suction at a body does nothing in free air."""
    kind = int(model.actuator_trntype[a])
    if kind not in (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)):
        return False
    return choice.carrier[int(model.site_bodyid[model.actuator_trnid[a, 0]])] >= 0


def _actuator(model: mujoco.MjModel, a: int, name: str) -> Iterator[str]:
    special = (("mjGAIN_DCMOTOR", "DC motor"), ("mjGAIN_MUSCLE", "muscle"), ("mjGAIN_USER", "user-defined actuator"))
    for gain, what in special:
        if int(model.actuator_gaintype[a]) == int(getattr(mujoco.mjtGain, gain, -1)):
            yield f"actuator {name} is a {what}, of which the joint torque can't be told: use <motor>"
    if a in _nonzero_rows(model, "actuator_delay"):
        yield f"actuator {name} has a delay, which is not part of this model: remove it, a diagnosis would find it"
    if a in _nonzero_rows(model, "actuator_dampingpoly"):
        yield f"actuator {name} has polynomial damping, not part of this model: keep the first coefficient only"


def _nonzero_rows(model: mujoco.MjModel, field: str) -> list[int]:
    """Rows of a field that hold anything but zeros; none if this MuJoCo does not know the field."""
    values = np.asarray(getattr(model, field, np.zeros((0, 1))))
    return [int(i) for i in np.flatnonzero(values.reshape(values.shape[0], -1).any(axis=1))] if values.size else []


def _shown(name: str | None) -> str:
    return f"'{name}'" if name else "(unnamed)"
