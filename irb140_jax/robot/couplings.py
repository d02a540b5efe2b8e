"""What ties joints of a model to each other or to the world: followers, closed loops, tendons."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np

SITE = int(mujoco.mjtObj.mjOBJ_SITE)
EQ = mujoco.mjtEq
WRAP = mujoco.mjtWrap


class Coupling(NamedTuple):
    """One tie.

    Attributes:
        joints: Indices of the joints whose motion it restricts or drives.
        reason: What it is, as the rest of "joint x can't be diagnosed: ...".
        follower: The joint whose position it sets, if it does so by a formula.
        position: That position [rad or m] from the model's positions.
    """

    joints: tuple[int, ...]
    reason: str
    follower: int | None = None
    position: Callable[[np.ndarray], float] = lambda qpos: 0.0


def couplings(model: mujoco.MjModel, mimics: tuple[tuple[str, str, float, float], ...]) -> list[Coupling]:
    """All ties of a compiled model.

    Args:
        model: Compiled model.
        mimics: Followers that it does not know: follower, leader, factor, offset.
    """
    return [*_mimics(model, mimics), *_equalities(model), *_tendons(model)]


def _mimics(model: mujoco.MjModel, mimics: tuple[tuple[str, str, float, float], ...]) -> Iterator[Coupling]:
    for follower, leader, factor, offset in mimics:
        j, k = model.joint(follower).id, mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, leader)
        if k < 0:
            yield Coupling((j,), f"it mimics '{leader}', a joint that does not move or is not there")
            continue
        at = int(model.jnt_qposadr[k])
        yield Coupling((j, k), f"'{follower}' mimics '{leader}', so that one motor moves both", j,
                       lambda qpos, at=at, a=factor, b=offset: a * qpos[at] + b)  # fmt: skip


def _equalities(model: mujoco.MjModel) -> Iterator[Coupling]:
    for e in map(int, np.flatnonzero(model.eq_active0)):
        kind, first, second = int(model.eq_type[e]), int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        given = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, e)
        name = f"equality constraint '{given}'" if given else "an equality constraint"
        if kind == int(EQ.mjEQ_JOINT):
            follows = lambda qpos, e=e, at=second: _polynomial(model, e, at, qpos)  # noqa: E731
            yield Coupling(tuple(j for j in (first, second) if j >= 0), f"{name} ties it", first, follows)
        elif kind in (int(EQ.mjEQ_CONNECT), int(EQ.mjEQ_WELD)):
            ends = [int(model.site_bodyid[i]) if int(model.eq_objtype[e]) == SITE else i for i in (first, second)]
            if any(model.body_mocapid[i] >= 0 for i in ends):
                continue  # a simulation's handle, which no real arm has
            yield Coupling(_between(model, [max(i, 0) for i in ends]), f"{name} closes a loop with it")
        elif kind == int(EQ.mjEQ_TENDON):
            joints = {j for t in (first, second) if t >= 0 for j in _of_tendon(model, t)}
            yield Coupling(tuple(sorted(joints)), f"{name} ties its tendon")


def _polynomial(model: mujoco.MjModel, e: int, leader: int, qpos: np.ndarray) -> float:
    """Position of the first joint of a joint equality, y = y0 + p(x - x0)."""
    follower = int(model.jnt_qposadr[model.eq_obj1id[e]])
    at = int(model.jnt_qposadr[leader]) if leader >= 0 else -1
    x = qpos[at] - model.qpos0[at] if leader >= 0 else 0.0
    return float(model.qpos0[follower] + np.polynomial.polynomial.polyval(x, model.eq_data[e, :5]))


def _tendons(model: mujoco.MjModel) -> Iterator[Coupling]:
    """Tendons that pull: those with a spring, friction, inertia or an actuator; limits are no more than joints' own."""
    on_tendon = np.asarray(model.actuator_trntype) == int(mujoco.mjtTrn.mjTRN_TENDON)
    driven = {int(i) for i in np.asarray(model.actuator_trnid)[on_tendon, 0]} if model.nu else set()
    for t in range(model.ntendon):
        fields = ("tendon_stiffness", "tendon_damping", "tendon_frictionloss", "tendon_armature")
        if t in driven or any(np.any(np.asarray(getattr(model, f, np.zeros(t + 1)))[t]) for f in fields):
            given = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TENDON, t)
            name = f"tendon '{given}'" if given else "a tendon"
            yield Coupling(tuple(_of_tendon(model, t)), f"{name} pulls at it")


def _of_tendon(model: mujoco.MjModel, tendon: int) -> list[int]:
    start = int(model.tendon_adr[tendon])
    ids, bodies = [], []
    for w in range(start, start + int(model.tendon_num[tendon])):
        kind, i = int(model.wrap_type[w]), int(model.wrap_objid[w])
        if kind == int(WRAP.mjWRAP_JOINT):
            ids.append(i)
        elif kind == int(WRAP.mjWRAP_SITE):
            bodies.append(int(model.site_bodyid[i]))
        elif kind in (int(WRAP.mjWRAP_SPHERE), int(WRAP.mjWRAP_CYLINDER)):
            bodies.append(int(model.geom_bodyid[i]))
    return sorted({*ids, *_between(model, bodies)})


def _between(model: mujoco.MjModel, bodies: list[int]) -> tuple[int, ...]:
    """Joints that move some of these bodies and not all: those that change where they are to each other."""
    ways = [_movers(model, body) for body in bodies]
    return tuple(sorted(set().union(*ways) - set.intersection(*ways))) if ways else ()


def _movers(model: mujoco.MjModel, body: int) -> set[int]:
    joints: set[int] = set()
    while body:
        joints |= {int(model.body_jntadr[body]) + k for k in range(int(model.body_jntnum[body]))}
        body = int(model.body_parentid[body])
    return joints
