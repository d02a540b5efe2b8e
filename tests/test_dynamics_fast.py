"""The fast path of dynamics against MuJoCo's C engine, which shares no code with it, and against its own laws."""

import pathlib

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from irb140_jax import dynamics
from irb140_jax.robot import Robot, robot_from_model

ARM = pathlib.Path(__file__).parents[1] / "assets" / "irb140.xml"
# Two independent recursions of some thousand operations agree to a few thousand ulp of the largest term.
ROUND_OFF = 1e-11


def random_chain(seed: int, n: int) -> mujoco.MjModel:
    """A chain with tilted base, random axes, some slides, reference offsets, springs, dampers and armature."""
    rng = np.random.default_rng(seed)
    numbers = lambda x: " ".join(repr(float(v)) for v in np.atleast_1d(x))  # noqa: E731
    opening, closing = "", ""
    for i in range(n):
        slide = i % 3 == 1
        A = rng.normal(size=(3, 3))
        inertia = A @ A.T * 0.05 + np.eye(3) * 0.1
        full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        opening += (
            f'<body pos="{numbers(rng.normal(size=3) * 0.3)}" quat="{numbers(rng.normal(size=4))}">'
            f'<inertial pos="{numbers(rng.normal(size=3) * 0.2)}" mass="{rng.uniform(1, 5)}" '
            f'fullinertia="{numbers(full)}"/>'
            f'<joint name="j{i}" type="{"slide" if slide else "hinge"}" axis="{numbers(rng.normal(size=3))}" '
            f'pos="{numbers(rng.normal(size=3) * 0.1)}" ref="{numbers(rng.normal())}" '
            f'springref="{numbers(rng.normal())}" stiffness="{rng.uniform(0, 20)}" damping="{rng.uniform(0, 2)}" '
            f'armature="{rng.uniform(0, 1)}"/>'
        )
        closing += "</body>"
    return mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian" balanceinertia="true"/><worldbody>'
        f'<body pos="0.1 0.2 0.3" quat="{numbers(rng.normal(size=4))}">{opening}{closing}</body></worldbody></mujoco>'
    )


CASES = {"irb140": mujoco.MjModel.from_xml_path(str(ARM)), **{f"random{n}": random_chain(n, n) for n in (1, 4, 7)}}


@pytest.fixture(params=list(CASES), scope="module")
def case(request) -> tuple[mujoco.MjModel, Robot]:
    model = CASES[request.param]
    return model, robot_from_model(model)


def motion(n: int, size: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q, qd, qdd = rng.uniform(-2.5, 2.5, (3, size, n))
    return q, qd, qdd * 4.0


def mujoco_torque(model: mujoco.MjModel, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    torques = []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, qd, qdd, strict=True):
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return np.array(torques)


def assert_close(ours, theirs, tolerance: float = ROUND_OFF) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=tolerance * max(1.0, float(np.abs(theirs).max())))


def test_inverse_dynamics_agrees_with_mujoco(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 20)
    ours = jax.vmap(dynamics.inverse_dynamics, in_axes=(None, 0, 0, 0))(robot, q, qd, qdd)
    assert_close(ours, mujoco_torque(model, q, qd, qdd))


def test_batched_inverse_dynamics_agrees_with_mujoco(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 333)
    assert_close(dynamics.inverse_dynamics_batch(robot, q, qd, qdd), mujoco_torque(model, q, qd, qdd))


def test_regressor_times_inertials_is_the_rigid_torque(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 20)
    Y = dynamics.regressor_batch(robot, q, qd, qdd)
    rest = jax.vmap(dynamics.passive_torque, in_axes=(None, 0, 0))(robot, q, qd) + robot.armature[None] * qdd
    assert_close(Y @ robot.phi.ravel() + rest, mujoco_torque(model, q, qd, qdd))


def test_a_joint_does_not_feel_links_before_it(case):
    _, robot = case
    Y = dynamics.regressor_batch(robot, *motion(robot.n, 3)).reshape(3, robot.n, robot.n, 10)
    rows, links = np.tril_indices(robot.n, -1)
    assert not np.any(Y[:, rows, links])


def test_forward_dynamics_undoes_inverse_dynamics(case):
    _, robot = case
    q, qd, qdd = (x[0] for x in motion(robot.n, 1))
    tau = dynamics.inverse_dynamics(robot, q, qd, qdd)
    # The solve multiplies round-off by the condition number of M, here up to 1e4.
    assert_close(dynamics.forward_dynamics(robot, q, qd, tau), qdd, 1e4 * ROUND_OFF)


def test_one_sample_equals_a_batch_of_it(case):
    _, robot = case
    q, qd, qdd = motion(robot.n, 2)
    single = jnp.stack([dynamics.regressor(robot, *x) for x in zip(q, qd, qdd, strict=True)])
    assert_close(dynamics.regressor_batch(robot, q, qd, qdd), single)
