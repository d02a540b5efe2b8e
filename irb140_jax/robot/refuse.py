"""What a `Robot` can't represent is refused, by name and with what to do about it."""

from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from irb140_jax.errors import RobotError

MOST_JOINTS = 10

MAY_BE_INFINITE = ("lower", "upper", "velocity_limit", "effort_limit")


def refuse_unsupported(model: mujoco.MjModel, source: str) -> None:
    """Raise if the compiled model is anything but a serial chain of 1 to 10 named hinges and slides.

    Args:
        model: Compiled model.
        source: Where it came from, for the message.

    Raises:
        RobotError: Names the first thing that does not fit and what to do about it.
    """
    for check in (_joints, _chain, _couplings, _forces, _actuators):
        for problem in check(model):
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


def parent_joint(model: mujoco.MjModel, body: int) -> int:
    """Index of the last joint on the way from the world to this body, its own included; -1 if there is none."""
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    return int(model.body_jntadr[body] + model.body_jntnum[body] - 1) if body else -1


def _joints(model: mujoco.MjModel) -> Iterator[str]:
    kinds = {int(mujoco.mjtJoint.mjJNT_FREE): "free", int(mujoco.mjtJoint.mjJNT_BALL): "ball"}
    for j in range(model.njnt):
        body = model.body(model.jnt_bodyid[j]).name
        if int(model.jnt_type[j]) in kinds:
            kind = kinds[int(model.jnt_type[j])]
            yield f"body '{body}' has a {kind} joint; known: hinge, slide: weld it to its parent or remove it"
        if not model.joint(j).name:
            yield f"a joint of body '{body}' has no name; recordings are matched by joint name: give it one"
    if not 1 <= model.njnt <= MOST_JOINTS:
        yield f"the model has {model.njnt} joints, 1 to {MOST_JOINTS} are allowed: give a model of one arm"


def _chain(model: mujoco.MjModel) -> Iterator[str]:
    for j in range(1, model.njnt):
        body = int(model.jnt_bodyid[j])
        first_on_body = j == model.body_jntadr[body]
        parent = parent_joint(model, int(model.body_parentid[body])) if first_on_body else j - 1
        if parent != j - 1:
            branch = "the base" if parent < 0 else f"joint '{model.joint(parent).name}'"
            ways = f"'{model.joint(parent + 1).name}' and '{model.joint(j).name}'"
            remedy = "remove one branch or weld it (gripper fingers, for example)"
            yield f"the model branches at {branch}, into {ways}; only a serial chain is known: {remedy}"


def _couplings(model: mujoco.MjModel) -> Iterator[str]:
    active = np.flatnonzero(model.eq_active0)
    if active.size:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, int(active[0]))
        yield f"equality constraint {_shown(name)} closes a loop or couples joints; a serial chain has none: remove it"
    parts = (("ntendon", "tendons"), ("nflex", "deformable bodies (flex)"), ("nplugin", "plugins"))
    for field, what in parts:
        if getattr(model, field, 0):
            yield f"the model has {what}, which a rigid serial chain can't represent: remove them"


def _forces(model: mujoco.MjModel) -> Iterator[str]:
    if np.any(model.body_gravcomp):
        body = model.body(int(np.flatnonzero(model.body_gravcomp)[0])).name
        yield f"body '{body}' has gravcomp, which no joint spring represents: remove it, or model the counterbalance"
    if model.opt.density or model.opt.viscosity or np.any(model.opt.wind):
        yield "<option> has a fluid (density, viscosity or wind), which is not part of this model: set them to 0"
    polynomials = (
        ("dof_dampingpoly", "polynomial damping", "keep the first coefficient of damping only"),
        ("jnt_stiffnesspoly", "polynomial stiffness", "keep the first coefficient of stiffness only"),
        ("jnt_springyield", "a spring that yields (springyield)", "remove it"),
    )
    for field, what, remedy in polynomials:
        for j in _nonzero_rows(model, field):
            yield f"joint '{model.joint(j).name}' has {what}, which is not part of this model: {remedy}"


def _actuators(model: mujoco.MjModel) -> Iterator[str]:
    on_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    driver: dict[int, str] = {}
    for a in range(model.actuator_trntype.shape[0]):
        name = _shown(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, a))
        if int(model.actuator_trntype[a]) not in on_joint:
            yield f"actuator {name} drives no joint (tendon, site, body or slider-crank): drive a joint or remove it"
            continue
        joint = int(model.actuator_trnid[a, 0])
        if joint in driver:
            yield f"joint '{model.joint(joint).name}' has two actuators, {driver[joint]} and {name}: keep one of them"
        driver[joint] = name
        yield from _actuator(model, a, name)


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


