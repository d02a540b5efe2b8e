"""The study's unknowns, objective, objectives with data, baselines and judges."""

import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy import stats

from irb140_jax import dynamics, identify, swarm
from irb140_jax.errors import InputError
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import irb140
from irb140_jax.robot.shipped import irb140_path
from irb140_jax.trajectory import Trajectory

LINKS = (0, 1, 2)
ROBOT = irb140()
REFERENCE = identify.link_parameters(ROBOT, LINKS)
MASS = ROBOT.mass[:3]
RNG = np.random.default_rng(5)


def away(share: float, seed: int = 0) -> jnp.ndarray:
    """Parameters off the reference by up to this share of each, never by less than 60 % of it."""
    rng = np.random.default_rng(seed)
    return REFERENCE * (1.0 + share * rng.choice([-1.0, 1.0], 27) * rng.uniform(0.6, 1.0, 27))


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    """A motion whose torques MuJoCo's C engine gives, without friction."""
    model = mujoco.MjModel.from_xml_path(str(irb140_path()))
    model.dof_frictionloss[:] = 0.0
    model.dof_damping[:] = 0.0
    played = fourier_motion(ROBOT, duration=4.0, rate=100.0, seed=2)
    data, tau = mujoco.MjData(model), []
    for q, qd, qdd in zip(played.q, played.qd, played.qdd, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse.copy())
    return Trajectory(*(jnp.asarray(x) for x in (played.t, played.q, played.qd, played.qdd, np.array(tau))))


@pytest.fixture(scope="module")
def frictionless():
    zero = jnp.zeros(ROBOT.n)
    return eqx.tree_at(lambda r: (r.damping, r.frictionloss), ROBOT, (zero, zero))


@pytest.fixture(scope="module")
def torque_fit(frictionless, motion):
    return identify.linear_fit(frictionless, LINKS, motion)


def rmse_by_newton_euler(robot, x, motion) -> float:
    """The fitness without any factor: all torques, one by one."""
    changed = identify.with_link_parameters(robot, LINKS, x)
    tau = dynamics.inverse_dynamics_batch(changed, motion.q, motion.qd, motion.qdd)
    return float(np.sqrt(np.mean((np.asarray(tau) - np.asarray(motion.tau))[:-1] ** 2)))


def test_three_links_have_the_study_s_27_unknowns():
    assert REFERENCE.shape == (27,)
    np.testing.assert_allclose(REFERENCE[:3], [0.028105, 0.043815, -0.088596], rtol=1e-12)  # link 1 of set M98
    np.testing.assert_allclose(REFERENCE[9:12], [0.5080491, -0.0014806, -0.0523577], atol=1e-9)  # MuJoCo's own digits


def test_parameters_put_back_give_the_same_robot():
    x = away(0.3)
    robot = identify.with_link_parameters(ROBOT, (2, 0), x[:18])
    np.testing.assert_allclose(identify.link_parameters(robot, (2, 0)), x[:18], rtol=1e-15)
    np.testing.assert_array_equal(robot.mass, ROBOT.mass)


def test_inertials_about_the_frame_are_those_of_the_robot():
    x = away(0.3)
    robot = identify.with_link_parameters(ROBOT, LINKS, x)
    np.testing.assert_allclose(identify.phi_of(x, MASS), robot.phi[:3], rtol=1e-13)


@pytest.mark.parametrize("links", [(), (0, 0), (6,), (-1,)])
def test_links_that_are_not_there_are_refused(links):
    with pytest.raises(InputError, match="0 to 5, none twice"):
        identify.link_parameters(ROBOT, links)


@pytest.mark.parametrize(
    ("units", "expected"), [("normalised", 27 * 0.04), ("si", None), ("mm", None), ("mm_all", None)]
)
def test_equation_20_is_the_weighted_square_distance(units, expected):
    lower, upper = identify.box(REFERENCE, 0.5)
    objective = identify.parameter_distance(REFERENCE, lower, upper, units=units)
    com, inertia = {"normalised": (0, 0), "si": (1, 1), "mm": (1e3, 1), "mm_all": (1e3, 1e6)}[units]
    square = np.asarray((0.2 * REFERENCE) ** 2)
    expected = expected or com**2 * square[:9].sum() + inertia**2 * square[9:].sum()
    np.testing.assert_allclose(objective(1.2 * REFERENCE, jnp.asarray(0.3)), expected, rtol=1e-12)


def test_the_penalty_grows_and_counts_outside_the_box_only():
    lower, upper = identify.box(REFERENCE, 0.1)
    penalty = identify.Penalty(weight=3.0, offset=1.0, power=2.0, ratio=10.0)
    objective = identify.parameter_distance(REFERENCE, lower, upper, penalty=penalty)
    at = lambda x, t: float(objective(x, jnp.asarray(t)))  # noqa: E731
    inside = 1.05 * REFERENCE
    assert at(inside, 0.0) == at(inside, 1.0)
    outside = REFERENCE.at[4].multiply(1.2)  # by half of the box's width
    np.testing.assert_allclose(at(outside, 0.0), 0.2**2 + 3.0 * 0.5**2, rtol=1e-9)
    np.testing.assert_allclose(at(outside, 1.0), 0.2**2 + 3.0 * 4.0 * 10.0 * 0.5**2, rtol=1e-9)


def test_the_reference_lies_where_the_box_was_told():
    place = jnp.linspace(0.0, 1.0, 27)
    lower, upper = identify.box(REFERENCE, 0.25, place=place)
    np.testing.assert_allclose((REFERENCE - lower) / (upper - lower), place, atol=1e-12)
    np.testing.assert_allclose(upper - lower, 0.5 * jnp.abs(REFERENCE), rtol=1e-12)


def test_one_newton_step_minimises_the_study_s_objective():
    lower, upper = identify.box(REFERENCE, 0.5)
    for units in ("normalised", "si", "mm"):
        objective = identify.parameter_distance(REFERENCE, lower, upper, units=units)
        found = identify.newton_step(lambda x, f=objective: f(x, jnp.asarray(1.0)), away(0.45))
        assert max(float(e) for e in identify.mape(np.asarray(found), np.asarray(REFERENCE))) < 1e-10  # [%]


def test_the_factored_fitness_equals_newton_euler_on_every_sample(frictionless, motion, torque_fit):
    for seed in range(3):
        x = away(0.5, seed)
        np.testing.assert_allclose(
            torque_fit(x, jnp.asarray(0.0)), rmse_by_newton_euler(frictionless, x, motion), rtol=1e-11
        )


def test_the_true_parameters_explain_mujoco_s_torques(torque_fit):
    assert float(torque_fit(REFERENCE, jnp.asarray(0.0))) < 1e-10  # of some 50 N m
    assert float(torque_fit(away(0.3), jnp.asarray(0.0))) > 1.0


def test_power_rate_and_acceleration_fits_are_those_of_plain_formulas(frictionless, motion):
    x = away(0.4)
    changed = identify.with_link_parameters(frictionless, LINKS, x)
    error = np.asarray(dynamics.inverse_dynamics_batch(changed, motion.q, motion.qd, motion.qdd) - motion.tau)
    M = np.array([dynamics.mass_matrix(frictionless, q) for q in motion.q[:-1:40]])
    rate = np.diff(error, axis=0) / np.diff(motion.t)[:, None]
    power = np.sum(error * np.asarray(motion.qd), axis=1)[:-1]
    rms = lambda e: np.sqrt(np.mean(e**2))  # noqa: E731
    fit = lambda quantity, m=motion: float(identify.linear_fit(frictionless, LINKS, m, quantity)(x, jnp.asarray(0.0)))  # noqa: E731
    np.testing.assert_allclose(fit("torque_rate"), rms(rate), rtol=1e-9)
    np.testing.assert_allclose(fit("power"), rms(power), rtol=1e-9)
    few = jax.tree.map(lambda a: a[::40], motion)
    few_error = error[::40][:-1]
    np.testing.assert_allclose(
        fit("acceleration", few), rms(np.linalg.solve(M[: len(few_error)], few_error[:, :, None])), rtol=1e-8
    )


def test_a_recording_in_several_pieces_gives_the_same_fit(frictionless, motion, monkeypatch):
    x = away(0.4)
    whole = identify.linear_fit(frictionless, LINKS, motion, "torque_rate")
    monkeypatch.setattr(sys.modules[identify.LinearFit.__module__], "_SAMPLES_AT_A_TIME", 57)
    pieces = identify.linear_fit(frictionless, LINKS, motion, "torque_rate")
    assert float(pieces.rows) == float(whole.rows)
    np.testing.assert_allclose(pieces(x, jnp.asarray(0.0)), whole(x, jnp.asarray(0.0)), rtol=1e-12)


def test_a_motion_too_short_to_fit_is_refused(frictionless, motion):
    with pytest.raises(InputError, match="longer recording"):
        identify.linear_fit(frictionless, LINKS, jax.tree.map(lambda a: a[:5], motion))
    with pytest.raises(InputError, match="give one of torque"):
        identify.linear_fit(frictionless, LINKS, motion, "heat")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("method", ["levenberg_marquardt", "bfgs"])
def test_descents_explain_the_torques_from_afar(torque_fit, method):
    starts = jnp.stack([away(0.5, seed) for seed in range(3)])
    result = identify.descents(torque_fit.residual, starts, method, scale=jnp.abs(REFERENCE))
    before = min(float(jnp.sum(torque_fit.residual(x) ** 2)) for x in starts)
    assert float(result.fitness.min()) < 1e-6 * before


def test_least_squares_on_what_the_motion_shows_leaves_the_rest_alone(torque_fit):
    start = identify.phi_of(away(0.5), MASS).ravel()
    found = identify.nearest_least_squares(torque_fit, start)
    assert float(torque_fit.of_phi(found)) < 1e-8  # [N m]
    unseen = jnp.asarray(np.linalg.svd(np.asarray(torque_fit.R))[2][-5:])
    shown = jnp.max(jnp.abs(torque_fit.R @ unseen.T))
    assert float(shown) < 1e-8  # this motion shows nothing of these five directions
    # The first link's mass can't be seen, as it turns about a vertical axis.
    np.testing.assert_allclose(found[0], start[0], rtol=1e-12)


def test_the_shipped_links_are_possible_bodies():
    assert all(bool(ok) for ok in identify.consistency(REFERENCE, MASS))


def test_impossible_bodies_are_told_by_what_is_wrong():
    negative = REFERENCE.at[9].multiply(-1.0)
    assert not identify.consistency(negative, MASS).positive
    flat = REFERENCE.at[9].multiply(3.0)  # Ixx more than Iyy + Izz
    verdict = identify.consistency(flat, MASS)
    assert bool(verdict.positive)
    assert not verdict.triangle
    assert not verdict.pseudo_inertia


def test_any_numbers_make_a_possible_body():
    rng = np.random.default_rng(1)
    for _ in range(20):
        x = identify.consistent_parameters(jnp.asarray(rng.normal(0.0, 1.0, 27)), MASS)
        assert all(bool(ok) for ok in identify.consistency(x, MASS))


@pytest.mark.parametrize(("scale", "accepted"), [(1.0, True), (3.0, False)])
def test_mujoco_s_own_compiler_agrees_on_what_is_possible(scale, accepted):
    x = REFERENCE.at[15].multiply(scale)  # Ixx of link 2
    assert bool(identify.consistency(x, MASS).triangle) == accepted
    Ixx, Ixy, Ixz, Iyy, Iyz, Izz = np.asarray(x[15:21])
    full = f"{Ixx} {Iyy} {Izz} {Ixy} {Ixz} {Iyz}"
    inertial = f'<inertial pos="0 0 0" mass="1" fullinertia="{full}"/>'
    xml = f"<mujoco><worldbody><body><joint/>{inertial}</body></worldbody></mujoco>"
    if accepted:
        assert mujoco.MjModel.from_xml_string(xml).nv == 1
    else:
        with pytest.raises(ValueError, match="inertia must satisfy"):
            mujoco.MjModel.from_xml_string(xml)


def test_the_log_cholesky_numbers_come_back():
    theta = jnp.asarray(np.random.default_rng(2).normal(0.0, 0.5, 27))
    again = identify.log_cholesky(identify.consistent_parameters(theta, MASS), MASS)
    np.testing.assert_allclose(again, theta, rtol=1e-9, atol=1e-12)


def test_mape_is_equation_30_by_groups():
    x = np.asarray(REFERENCE) * np.concatenate([np.full(9, 1.02), np.full(18, 0.95)])
    com, inertia = identify.mape(x, np.asarray(REFERENCE))
    np.testing.assert_allclose([com, inertia], [2.0, 5.0], rtol=1e-9)


def test_what_is_zero_has_no_percentage_and_leaves_that_of_the_rest_as_it_is():
    x = np.asarray(REFERENCE).copy()
    x[[1, 10]] = 0.0  # cy1, Ixy1
    x[14] = 1e-12 * x[9]  # Izz1 beside Ixx1: round-off of a file reader
    estimate = np.where(np.arange(27) < 9, 1.02, 0.95) * x + 1e-3 * np.isin(np.arange(27), (1, 10, 14))
    np.testing.assert_allclose(identify.mape(estimate, x), [2.0, 5.0], rtol=1e-9)


def test_an_error_that_is_not_defined_is_nan_and_the_other_a_number():
    x = np.asarray(REFERENCE).copy()
    x[:9] = 0.0
    com, inertia = identify.mape(np.stack([1.1 * x, x]), x)
    assert com.shape == (2,) and np.isnan(com).all()
    np.testing.assert_allclose(inertia, [10.0, 0.0], atol=1e-9)


@pytest.fixture(scope="module")
def without_products():
    """The robot with centres on the joint axes' x and no product of inertia."""
    com = ROBOT.com * jnp.array([1.0, 0.0, 0.0])
    return eqx.tree_at(lambda r: (r.com, r.inertia), ROBOT, (com, ROBOT.inertia * jnp.eye(3)))


def test_unknowns_leave_out_what_is_zero_and_keep_the_rest_in_its_place(without_products):
    unknowns = identify.unknowns(without_products, LINKS)
    names = [name for name, sought in zip(unknowns.names, unknowns.sought, strict=True) if sought]
    assert names == ["cx1", "cx2", "cx3"] + [f"I{a}{a}{i}" for i in (1, 2, 3) for a in "xyz"]
    moved = unknowns.full(1.3 * unknowns.start)
    np.testing.assert_array_equal(moved, jnp.where(jnp.array(unknowns.sought), 1.3 * unknowns.reference, 0.0))
    np.testing.assert_allclose(unknowns.mape(np.asarray(moved)), [30.0, 30.0], rtol=1e-12)
    assert unknowns.full(jnp.ones((4, 12))).shape == (4, 27)


@pytest.mark.parametrize("units", ["normalised", "si", "mm", "mm_all"])
def test_equation_20_of_the_unknowns_is_that_of_all_parameters_that_are_not_zero(without_products, units):
    unknowns, place = identify.unknowns(without_products, LINKS), jnp.linspace(0.1, 0.9, 27)
    objective = unknowns.distance(0.5, place=place, units=units)
    com, inertia = {"normalised": (0, 0), "si": (1, 1), "mm": (1e3, 1), "mm_all": (1e3, 1e6)}[units]
    square = np.asarray((0.2 * unknowns.reference) ** 2)
    expected = 12 * 0.04 if units == "normalised" else com**2 * square[:9].sum() + inertia**2 * square[9:].sum()
    # At weight zero, as 1.2 may lie beyond the box.
    np.testing.assert_allclose(objective(1.2 * unknowns.start, jnp.asarray(0.0)), expected, rtol=1e-12)
    lower, upper = identify.box(unknowns.reference, 0.5, place=place)
    np.testing.assert_array_equal(objective.lower, lower[unknowns.place])
    np.testing.assert_array_equal(objective.upper, upper[unknowns.place])


def test_all_parameters_with_a_zero_are_refused_with_what_would_do(without_products):
    x = identify.link_parameters(without_products, LINKS)
    with pytest.raises(InputError, match="identify.unknowns"):
        identify.parameter_distance(x, *identify.box(x, 0.5))


def test_a_plateau_is_where_the_curve_has_fallen():
    best = np.concatenate([np.linspace(10.0, 1.0, 28), np.full(100, 1.0)])
    assert identify.plateau(best) == 27
    assert identify.plateau(np.full(5, 2.0)) == 0


def test_comparisons_tell_lower_from_equal():
    rng = np.random.default_rng(0)
    low, high = rng.normal(0.0, 1.0, 30), rng.normal(1.5, 1.0, 30)
    result = identify.compared(low, high)
    assert result.p_value < 1e-3
    assert result.superiority > 0.7
    assert result.cohen_d > 0.8
    assert identify.compared(low, low).superiority == 0.5
    np.testing.assert_allclose(result.welch_p, np.asarray(stats.ttest_ind(low, high, equal_var=False))[1])


def test_a_swarm_in_possible_bodies_only_explains_the_torques(torque_fit):
    """A swarm on torques, in the log-Cholesky numbers, ends at a possible body near the best fit."""

    class Possible(eqx.Module):
        fit: identify.LinearFit

        def __call__(self, theta, progress):
            return self.fit(identify.consistent_parameters(theta, self.fit.mass), progress)

    centre = identify.log_cholesky(REFERENCE, MASS)
    half = 0.5 * jnp.maximum(jnp.abs(centre), 0.05)
    place = jnp.asarray(RNG.uniform(0.15, 0.35, 27))  # the truth lies away from the middle
    lower = centre - 2.0 * half * place
    keys = swarm.seed_keys(2)
    found = swarm.minimise(Possible(torque_fit), swarm.DeltaWellQpso(), lower, lower + 2.0 * half, keys=keys)
    middle = torque_fit(identify.consistent_parameters(lower + half, MASS), jnp.asarray(0.0))
    assert np.all(found.fitness < 0.1 * middle)
    for theta in found.x:
        assert bool(identify.consistency(identify.consistent_parameters(theta, MASS), MASS).pseudo_inertia)
