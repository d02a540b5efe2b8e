"""The testbed's plants against something that is not theirs: MuJoCo's C engine, SciPy's integrators, limits, energy."""

import dataclasses

import mujoco
import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from testbed import arms, drives, flexible, friction, loggers, motions, rigid, surroundings
from testbed.motions import STEP


def arms_of_all_sizes():
    return [arms.irb140(), *(arms.random_arm(np.random.default_rng(n), n) for n in (2, 3, 5, 7))]


@pytest.mark.parametrize("arm", arms_of_all_sizes(), ids=lambda arm: f"{arm.n} joints")
def test_rigid_torque_is_that_of_mujocos_inverse_dynamics(arm):
    model, rng = mujoco.MjModel.from_xml_string(arm.xml), np.random.default_rng(1)
    data, x = mujoco.MjData(model), rng.normal(size=(3, 8, arm.n))
    ours = rigid.torque(arm, *x)
    for k in range(8):
        data.qpos[:], data.qvel[:], data.qacc[:] = x[:, k]
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(ours[k], data.qfrc_inverse, rtol=1e-9, atol=1e-9 * np.abs(ours).max())


def test_slides_are_among_the_random_arms_that_were_compared():
    made = [arms.random_arm(np.random.default_rng(seed), 3) for seed in range(12)]
    arm = next(arm for arm in made if arm.slide.any() and not arm.slide.all())
    test_rigid_torque_is_that_of_mujocos_inverse_dynamics(arm)


def test_the_tool_moves_as_its_jacobian_says():
    arm, q = arms.irb140(), np.random.default_rng(0).normal(size=(1, 6))
    _, J = rigid.tool(arm, q)
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        slope = (rigid.tool(arm, q + step)[0] - rigid.tool(arm, q - step)[0]) / 2e-6
        np.testing.assert_allclose(J[0, :, k], slope[0], atol=1e-9)


@pytest.mark.parametrize("error", [0.02, 0.3])
def test_an_arm_as_built_consists_of_bodies(error):
    arm = arms.irb140()
    off = arms.built(arm, np.random.default_rng(0), error)
    for J in off.inertia:
        a, b, c = np.linalg.eigvalsh(J)
        assert a > 0 and a + b > c * (1 - 1e-9)
    assert 0.3 * error < np.std(np.log(off.mass / arm.mass)) < 2.0 * error


@pytest.mark.parametrize("name", list(motions.PROGRAMMES))
def test_motions_keep_to_their_limits_and_are_their_own_derivatives(name):
    arm = arms.irb140()
    for m in motions.programme(arm, np.random.default_rng(3), name, 12.0):
        assert np.all(m.q >= arm.low - 1e-6) and np.all(m.q <= arm.high + 1e-6)
        assert np.all(np.abs(m.qd) <= arm.speed) and np.ptp(m.q, axis=0).min() > 0.1
        np.testing.assert_allclose(np.gradient(m.q, STEP, axis=0)[1:-1], m.qd[1:-1], atol=2e-3)
        np.testing.assert_allclose(np.gradient(m.qd, STEP, axis=0)[1:-1], m.qdd[1:-1], atol=0.2)
        np.testing.assert_allclose(m.qd[[0, -1]], 0.0, atol=1e-4)  # the last sample is a step before the end


def sliding(seconds=2.0, size=0.01):
    """Position and speed of a joint that goes to and fro by 10 mrad."""
    t = np.arange(0.0, seconds, STEP)
    return t, size * np.sin(2 * np.pi * t), size * 2 * np.pi * np.cos(2 * np.pi * t)


def test_dahls_law_is_what_scipy_integrates():
    t, q, _ = sliding()
    for exponent in (1.0, 1.5):
        ours = friction.dahl(q, 3.0, 1500.0, exponent)

        def rate(now, F, exponent=exponent):
            v = 0.01 * 2 * np.pi * np.cos(2 * np.pi * now)
            left = 1.0 - F / 3.0 * np.sign(v)
            return 1500.0 * np.abs(left) ** exponent * np.sign(left) * v

        theirs = solve_ivp(rate, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.005).y[0]
        np.testing.assert_allclose(ours, theirs, atol=0.02)


def test_lugre_slides_at_its_level_and_begins_as_a_spring():
    v = np.full(4000, 0.1)
    F = friction.lugre(v, STEP, np.full(4000, 2.0), 500.0, 0.0)
    assert F[-1] == pytest.approx(2.0, rel=1e-6)
    assert F[2] == pytest.approx(500.0 * 2 * STEP * 0.1, rel=0.05)  # 0.1 mrad of travel, 4 mrad to slip


def test_lugre_is_what_scipy_integrates():
    t, _, v = sliding()
    ours = friction.lugre(v, STEP, np.full(len(t), 2.0), 800.0, 1.0)

    def rate(now, z):
        speed = 0.01 * 2 * np.pi * np.cos(2 * np.pi * now)
        return speed - 800.0 * abs(speed) * z / 2.0

    z = solve_ivp(rate, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-8, atol=1e-12, max_step=0.005).y[0]
    dz = v - 800.0 * np.abs(v) * z / 2.0
    np.testing.assert_allclose(ours, 800.0 * z + dz, atol=0.02)


def test_a_maxwell_element_loses_in_a_cycle_what_masing_says():
    t, q, _ = sliding(3.0)
    F = friction.maxwell_slip(q, np.full(len(t), 2.0), np.ones(1), np.array([1000.0]))
    last = t >= 2.0
    work = np.trapezoid(F[last], q[last])
    assert work == pytest.approx(4 * 2.0 * (0.01 - 2.0 / 1000.0), rel=0.01)  # a parallelogram


def test_a_falling_level_begins_static_and_ends_coulomb():
    levels = friction.falling(np.array([0.0, 0.1, 100.0]), 2.0, 3.0, 0.1)
    np.testing.assert_allclose(levels, [3.0, 2.5, 2.0], rtol=1e-5)


@pytest.mark.parametrize("form", ["root", "arc"])
def test_dry_friction_never_helps_the_motion_and_reaches_its_level(form):
    v = np.linspace(-5.0, 5.0, 1001)
    F = friction.dry(v, 2.0, 0.01, form)
    assert np.all(F * v >= 0.0) and F[-1] == pytest.approx(2.0, rel=0.002)


def test_heat_thins_until_it_is_as_warm_as_its_power():
    v = np.full(40000, 2.0)
    F = friction.heated(v, STEP, 1.5, 1.0, 1.0)
    thin = F[-1] / 3.0
    assert F[0] == pytest.approx(3.0) and thin == pytest.approx(np.exp(-thin), rel=1e-3)  # h = thin at rest
    np.testing.assert_allclose(friction.heated(v, STEP, 1.5, 0.0, 1.0), 3.0)


def test_a_random_curve_has_unit_size_and_another_seed_another_shape():
    (_, a), (_, b) = (friction.curve(np.random.default_rng(s), -1.0, 1.0, 0.5) for s in (0, 1))
    assert a.std() == pytest.approx(1.0) and abs(np.corrcoef(a, b)[0, 1]) < 0.5


def pendulum():
    """One hinge, level, that carries 2 kg at 0.5 m."""
    return arms.arm_of(
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body><joint name="a" axis="0 1 0" '
        'range="-2 2" armature="0.3"/><inertial pos="0.5 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>'
        '<site pos="1 0 0"/></body></worldbody></mujoco>'
    )


def to_and_fro(size=0.6, seconds=3.0):
    """A motion of one joint that begins at rest."""
    t = np.arange(0.0, seconds, STEP)
    w = 2 * np.pi * 0.8
    q = size * (1 - np.cos(w * t))
    return motions.Motion(t, q[:, None], (size * w * np.sin(w * t))[:, None], (size * w**2 * np.cos(w * t))[:, None])


def test_a_flexible_pendulum_swings_as_scipy_integrates_it():
    arm, m = pendulum(), to_and_fro()
    joint = flexible.Transmission(0, 400.0, 8.0, cubic=5e4)
    ours = flexible.torque(arm, m, joint)[:, 0]
    inertia, weight, w = 0.01 + 2 * 0.25, 2 * 9.81 * 0.5, 2 * np.pi * 0.8

    def rate(now, state):
        u, v = 0.6 * (1 - np.cos(w * now)) - state[0], 0.6 * w * np.sin(w * now) - state[1]
        return [state[1], (400.0 * u + 5e4 * u**3 + 8.0 * v + weight * np.cos(state[0])) / inertia]

    u0 = next(r.real for r in np.roots([5e4, 0.0, 400.0, weight]) if abs(r.imag) < 1e-12)
    link = solve_ivp(rate, (0.0, m.t[-1]), [-u0, 0.0], t_eval=m.t, rtol=1e-9, atol=1e-11, max_step=0.002).y
    u, v = m.q[:, 0] - link[0], m.qd[:, 0] - link[1]
    theirs = 400.0 * u + 5e4 * u**3 + 8.0 * v + 0.3 * m.qdd[:, 0]
    late = m.t > 1.0  # it begins as bent as its first acceleration bends it, which damping forgets
    np.testing.assert_allclose(ours[late], theirs[late], atol=0.02 * np.abs(theirs).max())


def test_a_stiff_joint_is_no_joint():
    arm, m = pendulum(), to_and_fro()
    rigid_torque = rigid.torque(arm, m.q, m.qd, m.qdd)
    stiff = flexible.torque(arm, m, flexible.Transmission(0, 1e6, 500.0))
    np.testing.assert_allclose(stiff, rigid_torque, atol=2e-3 * np.abs(rigid_torque).max())


def test_a_link_crosses_its_play_as_a_thrown_body_does():
    joint = flexible.Transmission(0, 1e5, 100.0, gap=0.02)
    load = np.where(np.arange(2000) < 1000, -3.0, 3.0)
    u = flexible.flight(load, np.full(2000, 0.5), joint)[0]
    assert u[990] == pytest.approx(-0.01 - 3.0 / 1e5, rel=1e-3) and u[-1] == pytest.approx(0.01 + 3.0 / 1e5, rel=1e-3)
    across = np.flatnonzero(u[1000:] > 0.01)[0] * STEP
    assert across == pytest.approx(np.sqrt(2 * 0.02 * 0.5 / 3.0), rel=0.03)


def test_a_wall_only_pushes_and_takes_energy():
    t = np.arange(0.0, 1.0, STEP)
    x = np.stack([0.01 * np.cos(2 * np.pi * t), np.zeros_like(t), np.zeros_like(t)], axis=1)
    J = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    tau, depth, force = surroundings.wall(x, J, np.array([1.0, 0, 0]), 0.0, 1e5, 0.5, STEP)
    assert np.all(force >= 0.0) and np.all(force[depth == 0.0] == 0.0) and force.max() > 10.0
    np.testing.assert_allclose(tau[:, 0], -force)
    assert -np.trapezoid(force, x[:, 0]) > 0.0  # the wall is pressed more on the way in than it presses back
    elastic = surroundings.wall(x, J, np.array([1.0, 0, 0]), 0.0, 1e5, 0.0, STEP)[2]
    assert abs(np.trapezoid(elastic, x[:, 0])) < 1e-3 * np.abs(elastic).max() * 0.01


def test_a_push_has_its_force_and_its_length():
    t = np.arange(0.0, 4.0, STEP)
    tau = surroundings.push(t, np.broadcast_to(np.eye(3), (len(t), 3, 3)), np.array([5.0, 0, 0]), 1.0, 3.0, 0.3)
    assert tau[len(t) // 2, 0] == pytest.approx(-5.0)
    assert -np.trapezoid(tau[:, 0], t) == pytest.approx(10.0, rel=1e-3)
    assert np.all(tau[t < 0.84] == 0.0)


def test_a_spring_hardens_by_its_cube():
    np.testing.assert_allclose(surroundings.hardening(np.array([0.5, 1.5]), 0.5, 2.0, 3.0), [0.0, 5.0])


def test_what_is_asked_of_a_lagging_drive_makes_the_torque_that_was_wanted():
    t = np.arange(0.0, 2.0, STEP)
    tau = np.sin(2 * np.pi * t) + 0.3 * np.sin(2 * np.pi * 7 * t)
    asked = drives.asked_of_lag(tau, STEP, 0.02)
    system = signal.TransferFunction([0.002, 1.0], [0.02, 1.0])
    made = signal.lsim(system, asked, t)[1]
    np.testing.assert_allclose(made[400:], tau[400:], atol=2e-3)


def test_a_saturating_motor_makes_the_torque_that_was_wanted():
    tau = np.linspace(-8.0, 8.0, 101)
    asked = drives.asked_of_saturating(tau, 10.0)
    np.testing.assert_allclose(10.0 * np.tanh(asked / 10.0), tau, atol=1e-12)
    assert asked[-1] > 8.5


def test_a_filtered_log_is_late_by_two_time_constants():
    t = np.arange(0.0, 2.0, STEP)
    out = drives.filtered(t[:, None], STEP, 20.0)[:, 0]
    assert t[-1] - out[-1] == pytest.approx(2.0 / (2 * np.pi * 20.0), rel=1e-3)


def test_late_channels_show_what_was():
    t = np.arange(0.0, 2.0, STEP)
    out = drives.late(t, np.stack([t, t], axis=1), np.array([0.0, 0.004]))
    np.testing.assert_allclose(out[100:, 0] - out[100:, 1], 0.004, atol=1e-12)


def test_a_logger_adds_the_noise_that_it_states():
    arm, rng = arms.irb140(), np.random.default_rng(0)
    m = motions.fourier(arm, rng, 10.0)
    tau = rigid.torque(arm, m.q, m.qd, m.qdd)
    logger = loggers.random_logger(rng, arm.slide, np.sqrt(np.mean(tau**2, axis=0)), rate=500.0)
    logger = dataclasses.replace(logger, steps=3.0 * logger.noise, jitter=0.1)
    r = loggers.logged(logger, rng, m.t, m.q, m.qd, tau)
    np.testing.assert_allclose(np.std(r["tau"] - r["tau_true"], axis=0), logger.sensor_noise, rtol=0.08)
    assert np.all(np.diff(r["t"]) > 0.0) and 1.0 / np.median(np.diff(r["t"])) == pytest.approx(500.0, rel=0.02)
