"""What MuJoCo hides in recordings is there, as strong as asked, and nothing else is."""

import ast
import hashlib
import json
import pathlib

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax.errors import InputError
from irb140_jax.recordings import conceal as conceal_module
from irb140_jax.recordings.conceal import Concealment, Noise, conceal, demo_case, random_robot, seal, sealed
from irb140_jax.recordings.concealed.catalogue import FIRST_NINE, HIDDEN
from irb140_jax.recordings.concealed.closed_loop import _rings
from irb140_jax.recordings.concealed.plant import arm_model, arm_spec, perturb_inertials, rigid_torque
from irb140_jax.recordings.excite import fourier_motion, point_to_point_motion, slow_motion, three_motions
from irb140_jax.robot import irb140, irb140_path, robot_from_model

DT = 1e-3  # [s] step of the engine in these tests
STUCK = 5e-3  # [rad/s] below this speed dry friction may be anything up to its level


def short_motions(seed=0):
    return three_motions(irb140(), 4.0, 1.0 / DT, seed=seed)


def case_with(*concealments, seed=0, **kwargs):
    return conceal(irb140_path(), concealments, short_motions(seed), seed=seed, **kwargs)


def hiding(effect, share=0.12):
    """The effect on joint 2, or on the joints that it takes."""
    joints = {0: (), 1: ("joint2",), 2: ("joint2", "joint3")}[HIDDEN[effect].joints_acted_on]
    return Concealment(effect, joints, share)


def beyond_rigid(case, k):
    """What the noise-free log of recording k holds beyond the true rigid arm, by MuJoCo's inverse dynamics."""
    log = case.secret.logs[k]
    return log.tau - rigid_torque(case.secret.rigid, log.q, log.qd, log.qdd)


def told(case):
    return {name: p["value"] for name, p in case.truth["effects"][0]["parameters"].items()}


# The contract's equations, written down once more: p parameters, q, v position and speed of the joint, load the rigid
# arm's torque, t time.
LAWS = {
    "coulomb_friction": lambda p, t, q, v, a, load: p["coulomb"] * np.sign(v),
    "viscous_friction": lambda p, t, q, v, a, load: p["viscous"] * v,
    "asymmetric_friction": lambda p, t, q, v, a, load: np.where(v > 0, p["coulomb_pos"], -p["coulomb_neg"]),
    "stribeck_friction": lambda p, t, q, v, a, load: np.sign(v) * (
        p["coulomb"] + (p["static"] - p["coulomb"]) * np.exp(-((v / p["stribeck_velocity"]) ** 2))),
    "load_dependent_friction": lambda p, t, q, v, a, load: np.sign(v) * (
        p["coulomb"] + p["load_coefficient"] * np.abs(load)),
    "rotor_inertia": lambda p, t, q, v, a, load: p["inertia"] * a,
    "torque_offset": lambda p, t, q, v, a, load: np.full_like(q, p["offset"]),
    "torque_gain": lambda p, t, q, v, a, load: (1.0 / p["gain"] - 1.0) * load,
    "nonlinear_viscous_friction": lambda p, t, q, v, a, load: np.sign(v) * (
        p["coefficient"] * np.abs(v) ** p["exponent"]),
    "thermal_friction_drift": lambda p, t, q, v, a, load: v * p["viscous_cold"] * (
        1.0 - p["relative_drop"] * (1.0 - np.exp(-t / p["time_constant"]))),
    "position_dependent_friction": lambda p, t, q, v, a, load: np.sign(v) * p["coulomb"] * (
        1.0 + p["depth"] * np.exp(-(((q - p["centre"]) / p["width"]) ** 2))),
    "torque_ripple": lambda p, t, q, v, a, load: p["amplitude"] * np.sin(
        2.0 * np.pi * p["cycles_per_rad"] * q + p["phase"]),
    "gravity_spring": lambda p, t, q, v, a, load: p["stiffness"] * (q - p["rest"]),
}


@pytest.mark.parametrize("effect", LAWS)
def test_logged_torque_beyond_the_rigid_arm_is_the_hidden_law(effect):
    case = case_with(hiding(effect))
    for k, log in enumerate(case.secret.logs):
        q, v, a = log.q[:, 1], log.qd[:, 1], log.qdd[:, 1]
        left_out = beyond_rigid(case, k)
        law = LAWS[effect](told(case), log.t, q, v, a, log.tau[:, 1] - left_out[:, 1])
        # The step in which a joint turns round sticks for part of its time, and holds any force within the law's.
        turning = np.convolve(np.abs(np.diff(np.sign(v), append=v[-1])) > 0, np.ones(3), mode="same") > 0
        moving = (np.abs(v) > STUCK) & ~turning
        # Speed changes during a step (half of it for damping, which MuJoCo takes at the step's end): a few per mil.
        error = (left_out[:, 1] - law)[moving]
        assert np.sqrt(np.mean(error**2)) < 0.01 * np.sqrt(np.mean(law[moving] ** 2))
        # Rounding of MuJoCo's inverse against its forward dynamics.
        assert np.abs(np.delete(left_out, 1, axis=1)).max() < 1e-8


def test_coupling_acts_on_the_relative_speed_of_both_joints():
    case = case_with(hiding("transmission_coupling"))
    p = told(case)
    for k, log in enumerate(case.secret.logs):
        drag = p["viscous"] * (log.qd[:, 1] + p["sign"] * log.qd[:, 2])
        law = np.stack([drag, p["sign"] * drag], axis=1)
        # Explicit in the step's first speed: exact but for rounding.
        np.testing.assert_allclose(beyond_rigid(case, k)[:, 1:3], law, atol=1e-8)


@pytest.mark.parametrize("effect", ["gravity_tilt", "payload", "rotor_inertia"])
def test_effects_that_mujoco_has_are_in_its_model_of_the_true_arm(effect):
    case = case_with(hiding(effect))
    assert max(case.truth["left_out"].values()) > 0.02
    for log in case.secret.logs:
        # Rounding only.
        np.testing.assert_allclose(rigid_torque(case.secret.true, log.q, log.qd, log.qdd), log.tau, atol=1e-8)


def test_encoder_offset_shifts_the_logged_position_by_itself():
    case = case_with(hiding("encoder_offset"))
    offset = np.array([0.0, told(case)["offset"], 0.0, 0.0, 0.0, 0.0])
    for log in case.secret.logs:
        np.testing.assert_allclose(rigid_torque(case.secret.rigid, log.q - offset, log.qd, log.qdd), log.tau, atol=1e-8)


def test_delay_shifts_positions_against_torque_by_itself():
    case = case_with(Concealment("time_delay", parameters={"delay": 5 * DT}))
    for log in case.secret.logs:
        in_step = rigid_torque(case.secret.rigid, log.q[5:], log.qd[5:], log.qdd[5:])
        # Whole steps, so no interpolation error: rounding of the times only.
        np.testing.assert_allclose(in_step[5:], log.tau[:-5][5:], atol=1e-6)


def test_lag_is_first_order_from_logged_to_real_torque():
    case = case_with(Concealment("actuator_lag", ("joint2",), parameters={"time_constant": 0.003}))
    for k, log in enumerate(case.secret.logs):
        real = log.tau[:, 1] - beyond_rigid(case, k)[:, 1]
        rate = np.gradient(real, log.t)
        lag = 0.003 * rate
        # The derivative of a staircase is good to a step in three, so compare by correlation and size, not samples.
        error = log.tau[:, 1] - real - lag
        assert np.std(error) < 0.35 * np.std(lag)


def test_presliding_is_a_spring_before_slip_and_coulomb_friction_after():
    bristles = {"coulomb": 6.0, "stiffness": 3000.0}
    case = case_with(Concealment("presliding_hysteresis", ("joint2",), parameters=bristles))
    log, force = case.secret.logs[0], beyond_rigid(case, 0)[:, 1]
    assert np.abs(force).max() <= 6.0 + 1e-6
    assert np.quantile(np.abs(force), 0.9) > 5.9
    early = (np.abs(log.q[:, 1] - log.q[0, 1]) < 1e-4) & (log.t < 0.5)  # [rad], a twentieth of Fc/stiffness
    assert early.sum() > 20
    # Softer by a tenth already, as part of the bristles slip.
    slope = np.polyfit(log.q[early, 1], force[early], 1)[0]
    assert slope == pytest.approx(3000.0, rel=0.15)


def test_elasticity_shows_as_the_load_bending_the_transmission():
    case = case_with(hiding("joint_elasticity"))
    effect, survey = case.secret.hidden[0], case.secret.survey
    for k in range(3):
        # Averaged over the link's own vibration, 8 Hz, which the first-order law doesn't know.
        window = np.ones(25) / 25.0
        predicted = np.convolve(effect.torque(survey)[survey.recording == k, 1], window, "valid")
        left_out = np.convolve(beyond_rigid(case, k)[::10, 1], window, "valid")
        assert np.std(left_out - predicted) < 0.25 * np.std(predicted)


def test_backlash_shifts_the_link_by_half_the_gap():
    case = case_with(Concealment("backlash", ("joint2",), parameters={"gap": 2e-3}))
    effect, survey = case.secret.hidden[0], case.secret.survey
    predicted = effect.torque(survey)[survey.recording == 2, 1]
    left_out = beyond_rigid(case, 2)[::10, 1]
    # In slow motion there are hardly any impacts; the flanks give by a third of the gap.
    assert np.sqrt(np.mean((left_out - predicted) ** 2)) < 0.5 * np.sqrt(np.mean(predicted**2))


def test_contact_leaves_no_trace_while_the_tool_is_off_the_wall():
    case = case_with(hiding("contact"))
    p, model = told(case), case.secret.rigid
    normal, data = np.array([p["normal_x"], p["normal_y"], p["normal_z"]]), mujoco.MjData(model)
    touched = []
    for k, log in enumerate(case.secret.logs):
        depth = np.empty(len(log.t))
        for i, q in enumerate(log.q):
            data.qpos[:] = q
            mujoco.mj_forward(model, data)
            depth[i] = p["position"] - data.site("flange").xpos @ normal
        left_out = np.abs(beyond_rigid(case, k)).max(axis=1)
        # At once: a wall that is felt a step late is a delay that nobody hid.
        assert left_out[depth < 0.0].max(initial=0.0) < 1e-8
        touched.append(left_out[depth > 1e-9])
    assert np.concatenate(touched).min() > 0.0


def test_a_loop_that_rings_at_the_engines_step_is_refused_and_one_at_rest_is_not():
    t = 0.001 * np.arange(4000)
    smooth, first = np.stack([np.sin(t), np.zeros(len(t))], axis=1), np.array([1.0, 0.0])
    burst = np.outer(np.exp(-(((t - 2.0) / 0.05) ** 2)) * (-1.0) ** np.arange(len(t)), [1.0, 1.0])
    assert not _rings(smooth) and not _rings(smooth + 0.1 * first * burst)
    assert _rings(smooth + first * burst) and _rings(smooth + (1.0 - first) * burst)


def test_external_wrench_acts_in_its_window_of_one_recording_only():
    case = case_with(hiding("external_wrench"))
    p, log = told(case), case.secret.logs[0]
    during = (log.t > p["t0"]) & (log.t < p["t1"])
    assert np.abs(beyond_rigid(case, 0)[during]).max() > 0.1
    assert np.abs(beyond_rigid(case, 0)[~during]).max() < 1e-8
    assert np.abs(beyond_rigid(case, 1)).max() < 1e-8


@pytest.mark.parametrize("effect", FIRST_NINE)
def test_share_is_as_asked(effect):
    case = case_with(hiding(effect, share=0.1))
    shares = np.array([case.truth["left_out"][joint] for joint in case.truth["effects"][0]["joints"]])
    # The strength is set on the reference motion, where dry friction is zero at rest; in the loop, a joint at rest
    # takes as much friction as it needs.
    assert np.sqrt(np.mean(shares**2)) == pytest.approx(0.1, rel=0.15)


@pytest.mark.parametrize("effect", HIDDEN)
def test_every_effect_is_seen_in_the_log(effect):
    case, clean = case_with(hiding(effect), seed=1), case_with(seed=1)
    # Far above rounding; the weakest, backlash, is a few per mil of the torque.
    assert max(case.truth["left_out"].values()) > 1e-3
    assert max(clean.truth["left_out"].values()) < 1e-10


@pytest.mark.parametrize("effect", sorted(set(FIRST_NINE)))
def test_zero_strength_is_the_clean_arm_bit_for_bit(effect):
    case, clean = case_with(hiding(effect, share=0.0)), case_with()
    for with_effect, without in zip(case.recordings, clean.recordings, strict=True):
        np.testing.assert_array_equal(with_effect.tau, without.tau)
        np.testing.assert_array_equal(with_effect.q, without.q)


def test_same_seed_gives_the_same_data():
    one, other = case_with(hiding("stribeck_friction"), seed=5), case_with(hiding("stribeck_friction"), seed=5)
    assert one.seal == other.seal
    np.testing.assert_array_equal(one.recordings[1].tau, other.recordings[1].tau)


def test_another_seed_gives_other_inertials_and_noise():
    motions = short_motions()
    one, other = (conceal(irb140_path(), (), motions, seed=seed) for seed in (1, 2))
    assert one.truth["link_masses"] != other.truth["link_masses"]
    assert not np.array_equal(one.recordings[0].q, other.recordings[0].q)


def test_controller_hides_the_effect_from_whoever_looks_at_tracking_only():
    case = case_with(hiding("coulomb_friction", share=0.2))
    for motion, log in zip(short_motions(), case.secret.logs, strict=True):
        # 0.3 degrees, with a fifth of the joint's torque left out and 5 % wrong inertials.
        assert np.abs(log.q - motion.q).max() < 5e-3


def test_log_has_no_hidden_delay():
    log = case_with(hiding("viscous_friction")).secret.logs[0]
    second_difference = (log.q[2:] - 2.0 * log.q[1:-1] + log.q[:-2]) / DT**2
    # Rounding of positions of order 1 over the square of the step.
    np.testing.assert_allclose(second_difference, log.qdd[1:-1], atol=1e-8)


def test_sensor_noise_is_as_stated():
    case = case_with(noise=Noise(encoder=1e-4, torque=0.02), rate=1.0 / DT)
    for k in range(3):
        log, recording = case.secret.logs[k], case.recordings[k]
        rms = np.array([case.secret.survey.rms(j) for j in range(6)])
        # 30 000 samples: the standard deviation is known to half a per cent.
        assert np.std(recording.q - log.q) == pytest.approx(1e-4, rel=0.03)
        np.testing.assert_allclose(np.std(recording.tau - log.tau, axis=0) / rms, 0.02, rtol=0.05)


def test_quantised_encoders_log_whole_steps_only():
    resolution = 2.0 * np.pi / 2**16
    recording = case_with(noise=Noise(resolution=resolution)).recordings[0]
    steps = recording.q / resolution
    # Rounding of the product.
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_recordings_hold_positions_and_torques_at_500_hz_and_no_more():
    recording = case_with().recordings[0]
    np.testing.assert_allclose(np.diff(recording.t), 0.002, rtol=1e-9)
    assert recording.qd is None and recording.qdd is None
    assert recording.joint_names == irb140().joint_names


def perturbed(x, rng: np.random.Generator):
    """The same truth as another processor would round it."""
    if isinstance(x, dict):
        return {key: perturbed(value, rng) for key, value in x.items()}
    if isinstance(x, list):
        return [perturbed(value, rng) for value in x]
    return x * (1.0 + 1e-9 * rng.normal()) if isinstance(x, float) else x


def test_the_seal_is_the_hash_of_the_effects_and_their_parameters():
    case = case_with(hiding("torque_gain"))
    assert case.seal == hashlib.sha256(sealed(case.truth).encode()).hexdigest()
    (effect,) = json.loads(sealed(case.truth))["effects"]
    assert (effect["effect"], effect["joints"]) == ("torque_gain", case.truth["effects"][0]["joints"])
    assert float(effect["parameters"]["gain"].split()[0]) == pytest.approx(told(case)["gain"], rel=5e-4)


@pytest.mark.parametrize("effect", FIRST_NINE)
def test_the_seal_does_not_depend_on_last_digits(effect):
    case = case_with(hiding(effect))
    rng = np.random.default_rng(1)
    assert {seal(perturbed(case.truth, rng)) for _ in range(20)} == {case.seal}
    # What a simulation of stick and slip may change by far more than rounding is not in it.
    assert seal({**case.truth, "left_out": {}, "link_masses": {}}) == case.seal


def test_another_truth_has_another_seal():
    truth = case_with(hiding("torque_gain")).truth
    (effect,) = truth["effects"]
    gain = {"gain": {**effect["parameters"]["gain"], "value": effect["parameters"]["gain"]["value"] * 1.002}}
    others = [{**truth, "effects": []}, {**truth, "seed": 99}, {**truth, "effects": [{**effect, "parameters": gain}]},
              {**truth, "effects": [{**effect, "joints": ["joint6"]}]}]  # fmt: skip
    assert len({seal(t) for t in [truth, *others]}) == 5


def test_demo_hides_one_of_the_nine_at_6_to_20_per_cent():
    seen = set()
    for seed in range(8):
        effect = demo_case(seed, duration=1.5).truth["effects"]
        assert len(effect) == 1 and effect[0]["effect"] in FIRST_NINE
        assert 0.06 <= effect[0]["share"] <= 0.2 + 1e-9
        seen.add(effect[0]["effect"])
    assert len(seen) >= 3


@given(seed=st.integers(0, 10**6), error=st.floats(0.01, 0.4))
@settings(max_examples=30, deadline=None)
def test_wrong_inertials_are_those_of_some_mass_distribution(seed, error):
    model = arm_model(arm_spec(random_robot(seed % 50, 1 + seed % 7)), DT)
    before = model.body_mass.copy()
    perturb_inertials(model, error, np.random.default_rng(seed))
    moving = before > 0.0
    moments = 0.5 * model.body_inertia.sum(axis=1, keepdims=True) - model.body_inertia
    # Second moments of a density are not negative; rounding relative to the inertia.
    assert (moments[moving] > -1e-12 * model.body_inertia[moving].max()).all()
    assert (model.body_mass[moving] > 0.0).all()
    assert (model.body_mass[moving] != before[moving]).all()
    np.testing.assert_allclose(np.linalg.norm(model.body_iquat, axis=1), 1.0, atol=1e-12)


def test_inertials_are_wrong_by_the_stated_error():
    spec, masses, inertias = arm_spec(irb140_path()), [], []
    nominal = arm_model(spec, DT)
    for seed in range(300):
        model = arm_model(spec, DT)
        perturb_inertials(model, 0.05, np.random.default_rng(seed))
        masses.append(np.log(model.body_mass[2:] / nominal.body_mass[2:]))
        inertias.append(model.body_inertia[2:].sum(axis=1) / nominal.body_inertia[2:].sum(axis=1) - 1.0)
    # 1800 draws: 2 % standard error of a standard deviation.
    assert np.std(masses) == pytest.approx(0.05, rel=0.1)
    # The trace averages over axes, so it errs less than any one of them.
    assert 0.02 < np.std(inertias) < 0.06


@pytest.mark.parametrize("kind", [fourier_motion, point_to_point_motion, slow_motion])
@given(seed=st.integers(0, 10**6), n=st.integers(1, 7))
@settings(max_examples=15, deadline=None)
def test_motions_of_any_robot_keep_its_limits_and_start_and_end_at_rest(kind, seed, n):
    robot = robot_from_model(arm_spec(random_robot(seed, n)).compile())
    motion = kind(robot, 6.0, 500.0, seed=seed)
    # Rounding only: limits are kept with margins.
    assert (motion.q >= np.asarray(robot.lower)).all() and (motion.q <= np.asarray(robot.upper)).all()
    speed = np.where(robot.is_slide, 0.5, 2.0)  # guesses, as the model has no speed limits
    assert (np.abs(motion.qd) <= speed).all()
    np.testing.assert_allclose(motion.qd[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.qdd[[0, -1]], 0.0, atol=1e-9)
    assert (np.ptp(motion.q, axis=0) > 1e-3).all()


@pytest.mark.parametrize("kind", [fourier_motion, point_to_point_motion, slow_motion])
def test_speeds_and_accelerations_are_derivatives_of_positions(kind):
    motion = kind(irb140(), 10.0, 2000.0, seed=4)
    dt = motion.t[1] - motion.t[0]
    # Central differences: error of order dt^2 times two derivatives more, some 1e-5 here.
    np.testing.assert_allclose((motion.q[2:] - motion.q[:-2]) / (2.0 * dt), motion.qd[1:-1], atol=2e-4)
    # Quintics jump in the third derivative where moves begin and end: of order dt there.
    np.testing.assert_allclose((motion.qd[2:] - motion.qd[:-2]) / (2.0 * dt), motion.qdd[1:-1], atol=5e-2)


def test_point_to_point_motion_dwells():
    motion = point_to_point_motion(irb140(), seed=1)
    assert 0.1 < np.mean((motion.qd == 0.0).all(axis=1)) < 0.6


@pytest.mark.parametrize("n", range(1, 8))
def test_random_robots_are_chains_that_can_be_recorded(n):
    robots = [robot_from_model(arm_spec(random_robot(seed, n)).compile()) for seed in range(5)]
    assert all(robot.n == n for robot in robots)
    xml = random_robot(n, n)
    motions = three_motions(robot_from_model(arm_spec(xml).compile()), 2.0, 1000.0, seed=n)
    case = conceal(xml, [Concealment("coulomb_friction", ("joint1",))], motions, seed=n)
    assert np.isfinite(case.recordings[0].tau).all()
    assert case.truth["left_out"]["joint1"] > 0.05


def test_friction_and_springs_of_the_model_itself_are_not_taken_for_hidden():
    own = '<joint name="joint1" type="hinge" damping="0.5" frictionloss="0.8" stiffness="2" springref="0.3" '
    xml = random_robot(3, 1, slides=0.0).replace('<joint name="joint1" type="hinge" ', own)
    motions = three_motions(robot_from_model(arm_spec(xml).compile()), 3.0, 1000.0, seed=3)
    case = conceal(xml, [], motions, seed=3)
    assert case.secret.rigid.dof_frictionloss[0] == 0.8
    moving = np.abs(case.secret.logs[0].qd[:, 0]) > STUCK
    # Damping is taken at the step's end: a few per mil of it.
    own_friction = 0.8 * np.sign(case.secret.logs[0].qd[moving])
    np.testing.assert_allclose(beyond_rigid(case, 0)[moving], own_friction, atol=5e-3)


def test_random_robots_have_slides_now_and_then():
    slides = [robot_from_model(arm_spec(random_robot(seed, 5)).compile()).is_slide for seed in range(20)]
    assert 0.05 < np.mean(slides) < 0.5


@pytest.mark.parametrize(
    ("concealment", "message"),
    [
        (Concealment("gremlins", ("joint1",)), "coulomb_friction"),
        (Concealment("coulomb_friction", ("elbow",)), "joint1, joint2"),
        (Concealment("coulomb_friction", ("joint1", "joint2")), "acts on 1 joint"),
        (Concealment("coulomb_friction", ("joint1",), parameters={"gap": 1.0}), "parameters are coulomb"),
    ],
)
def test_what_cannot_be_concealed_is_refused_with_what_can(concealment, message):
    with pytest.raises(InputError, match=message):
        case_with(concealment)


def test_concealing_shares_no_code_with_the_diagnosis():
    folder = pathlib.Path(conceal_module.__file__).parent
    files = [folder / "conceal.py", folder / "excite.py", *(folder / "concealed").glob("*.py")]
    assert len(files) > 8
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("irb140_jax"):
                assert (node.module or "").split(".")[1] in ("errors", "robot", "recordings"), f"{file}:{node.lineno}"
