"""Random robots and states that the tests share."""

import os
import pathlib
from functools import cache

import mujoco
import numpy as np
import pytest

from irb140_jax.oracle.mujoco import oracle_model
from irb140_jax.robot import Robot, robot_from_model

ROOT = pathlib.Path(__file__).resolve().parents[1]
IRB140_XML = ROOT / "assets" / "irb140.xml"

# Chains of hinges (H) and slides (S).  Few of them, so that what is compiled for one robot serves all of its kind.
KINDS = ("H", "SHS", "HHSHHH")
LONGEST = "HSHHSHHHSH"


def random_robot_xml(seed: int, n: int, slides: bool = True, *, kinds: str | None = None) -> str:
    """MJCF of a random serial robot: any axes, inertials in any orientation, welded bodies, base in any pose, ref.

    Some joints share a body with the one before them.  Armature, damping, frictionloss, springs, limits and geared
    motors are random, too.

    Args:
        seed: Same seed, same robot.
        n: Number of joints.
        slides: Whether some of the joints may be slides.
        kinds: One letter a joint, H or S, instead of random ones.
    """
    rng = np.random.default_rng(seed)
    kinds = kinds or "".join("S" if slides and rng.random() < 0.3 else "H" for _ in range(n))
    body = _body(rng, f'<site name="tool" {_pose(rng)}/>')
    joints = ""
    for i in reversed(range(n)):
        joints = _joint(rng, i, kinds[i]) + joints
        if i and rng.random() < 0.2:
            continue  # the next joint goes onto the same body
        welded = _body(rng, "") if rng.random() < 0.4 else ""
        body = _body(rng, joints + welded + body)
        joints = ""
        if i and rng.random() < 0.2:  # a mount between two links
            body = _body(rng, body)
    gears = rng.uniform(1, 50, n)
    motors = "".join(f'<motor joint="joint{i + 1}" gear="{gears[i]:.9g}" ctrlrange="-1 1"/>' for i in range(n))
    return f"""<mujoco model="random"><compiler autolimits="true" angle="radian"/>
    <option gravity="{_vector(rng, scale=9.81)}"/>
    <worldbody>{_body(rng, body)}</worldbody>
    <actuator>{motors}</actuator></mujoco>"""


@cache
def random_robot(kinds: str, seed: int) -> tuple[Robot, mujoco.MjModel]:
    """A random robot of these joints, and the oracle's model of it."""
    model = mujoco.MjModel.from_xml_string(random_robot_xml(seed, len(kinds), kinds=kinds))
    return robot_from_model(model, "random"), oracle_model(model)


@cache
def shipped_robot() -> tuple[Robot, mujoco.MjModel]:
    """The IRB 140, and the oracle's model of it."""
    model = mujoco.MjModel.from_xml_path(str(IRB140_XML))
    return robot_from_model(model, "irb140"), oracle_model(model)


def random_state(n: int, seed: int, count: int = 3) -> list[np.ndarray]:
    """Vectors of n numbers: q over a full turn, then qd, qdd, ... up to 3 in size."""
    rng = np.random.default_rng(seed)
    return [rng.uniform(-np.pi, np.pi, n), *(rng.uniform(-3, 3, n) for _ in range(count - 1))]


def recordings_folder() -> pathlib.Path:
    """The public recordings of real machines; the test is skipped, with the reason, where they are not at hand."""
    folder = pathlib.Path(os.environ.get("IRB140_RECORDINGS", ROOT.parent / "shared" / "recordings"))
    if not folder.is_dir():
        pytest.skip(f"no recordings of real machines at {folder}; set IRB140_RECORDINGS to their folder")
    return folder


def _vector(rng: np.random.Generator, size: int = 3, scale: float = 0.3) -> str:
    return " ".join(f"{x:.9g}" for x in scale * rng.normal(size=size))


def _pose(rng: np.random.Generator) -> str:
    return f'pos="{_vector(rng)}" quat="{_vector(rng, 4)}"'


def _body(rng: np.random.Generator, content: str) -> str:
    return f"<body {_pose(rng)}>{_inertial(rng)}{content}</body>"


def _inertial(rng: np.random.Generator) -> str:
    moments = rng.uniform(0.01, 0.2, 3) @ (1 - np.eye(3))  # sums of two second moments: always possible for a body
    diagonal = " ".join(f"{x:.9g}" for x in moments)
    mass = f"{rng.uniform(0.2, 5):.9g}"
    return f'<inertial {_pose(rng)} mass="{mass}" diaginertia="{diagonal}"/>'


def _joint(rng: np.random.Generator, i: int, kind: str) -> str:
    kind = "slide" if kind == "S" else "hinge"
    low, high, ref, rest = rng.uniform(-3, -1), rng.uniform(1, 3), rng.normal(), rng.normal()
    armature, damping, dry, stiffness = rng.uniform(0, 1, 4) * (0.5, 2.0, 1.0, 5.0)
    return (
        f'<joint name="joint{i + 1}" type="{kind}" axis="{_vector(rng)}" pos="{_vector(rng)}" '
        f'range="{low:.9g} {high:.9g}" ref="{ref:.9g}" springref="{rest:.9g}" armature="{armature:.9g}" '
        f'damping="{damping:.9g}" frictionloss="{dry:.9g}" stiffness="{stiffness:.9g}"/>'
    )
