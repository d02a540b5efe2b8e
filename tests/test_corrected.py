"""The corrected model taken away: in JAX what `predict` gives, and in MuJoCo as much of it as MJCF can hold."""

import dataclasses
import functools
import json
import re

import equinox as eqx
import helpers_recordings
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

import irb140_jax as irb
from irb140_jax.control import Reference, SlidingMode
from irb140_jax.effects import Scales
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from irb140_jax.mismatch import corrected_robot, predict, prediction_times
from irb140_jax.mismatch.columns.torques import Named, scaled
from irb140_jax.mismatch.corrected.model import CorrectedModel, from_json, to_json, torques_along
from irb140_jax.mismatch.corrected.native import NOTES, XML, beyond_file, native_gap, native_robot, save_native
from irb140_jax.mismatch.inertials.consistent import consistent, pseudo_inertia
from irb140_jax.mismatch.output.notes import gap_notes
from irb140_jax.mismatch.regression.discrepancy import FEATURES, Discrepancy
from irb140_jax.recordings import Recording, read_recording
from irb140_jax.recordings.conceal import random_robot
from irb140_jax.recordings.concealed.plant import arm_spec, rigid_torque
from irb140_jax.recordings.condition import Conditioned, condition
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.recordings.low_pass import Band, filtered, kernels
from irb140_jax.robot import load_robot, robot_from_model, robot_mjcf
from irb140_jax.simulate import play

REST = 1e-3  # [rad/s or m/s] over which sign(qd) is rounded off
VALUES = {
    "coulomb": 0.4, "coulomb_pos": 0.3, "coulomb_neg": 0.5, "viscous": 0.5, "static": 0.7, "stribeck_velocity": 0.1,
    "coefficient": 0.3, "exponent": 0.7, "load_coefficient": 0.05, "viscous_cold": 0.4, "relative_drop": 0.3,
    "depth": 0.5, "centre": 0.1, "width": 0.2, "inertia": 0.2, "gain": 1.05, "offset": 0.02, "amplitude": 0.3,
    "cycles_per_rad": 2.0, "delay": 0.003, "rest": 0.2, "tilt": 0.02, "mass": 0.4, "gap": 0.001,
    "flank_stiffness": 5000.0, "flank_damping": 0.3, "normal_x": 0.6, "normal_y": 0.0, "normal_z": 0.8, "position": 0.2,
}  # fmt: skip
OWN = {
    "thermal_friction_drift": {"time_constant": 3.0}, "actuator_lag": {"time_constant": 0.01},
    "presliding_hysteresis": {"stiffness": 40.0}, "gravity_spring": {"stiffness": 2.0},
    "joint_elasticity": {"stiffness": 5000.0}, "contact": {"stiffness": 500.0},
}  # fmt: skip
AT_ONCE = [slug for slug in CATALOGUE if slug in OWN or {p.name for p in CATALOGUE[slug].law.parameters} <= set(VALUES)]


@functools.cache
def arm():
    return robot_from_model(arm_spec(random_robot(4, 2, slides=0.0)).compile(), "two hinges")


@functools.cache
def motion():
    """5 s at 200 Hz, with no joint slower than the rounding of sign(qd) reaches."""
    return fourier_motion(arm(), 5.0, 200.0, seed=1)


def named(slug):
    effect = CATALOGUE[slug]
    w, shape = effect.law.amplitudes(VALUES | OWN.get(slug, {}))
    return Named(effect, tuple(map(int, effect.place.sites(arm())[0])), tuple(range(len(w))), w, shape)


def model(*slugs, rest=REST, phi=1.03):
    nominal = np.asarray(arm().phi)
    effects = tuple(named(slug) for slug in slugs)
    band = Band(torque=10.0, position=16.0, rate=200.0, step=4)
    return CorrectedModel(arm(), 1.01 * nominal, phi * nominal, effects, band, np.full(arm().n, rest))


def torque_along(robot, m):
    return np.asarray(robot.inverse_dynamics_along(*(jnp.asarray(x) for x in (m.t, m.q, m.qd, m.qdd))))


def as_conditioned(m, rest=REST):
    usable = np.ones_like(m.q, dtype=bool)
    speeds = np.full(m.q.shape[1], rest)
    tau, direction, exact = 0.0 * m.q, np.tanh(m.qd / speeds), 0.0 * speeds
    return Conditioned("made", m.t, m.q, m.qd, m.qdd, tau, usable, usable, speeds, exact, direction, 0.0 * m.q, ())


def test_the_jax_model_gives_the_torque_that_predict_gives_with_every_effect_at_once():
    everything, m = model(*AT_ONCE), motion()
    assert len(AT_ONCE) > 15
    fitted = torques_along(everything, as_conditioned(m)).corrected
    tau = torque_along(corrected_robot(everything), m)
    # The fit differentiates the rigid body by differences of 1e-5, JAX exactly; play has no slope at the end,
    # and a delay looks a row ahead.
    np.testing.assert_allclose(tau[:-3], fitted[:-3], rtol=0, atol=1e-6 * np.abs(fitted).max())


@pytest.mark.parametrize("shift", ["actuator_lag", "time_delay"])
def test_a_log_is_scaled_and_then_late_or_out_of_step(shift):
    some, m = model("torque_gain", shift, phi=1.0), motion()
    tau = torques_along(model(phi=1.0), as_conditioned(m)).corrected
    for j in some.named[0].joints:
        tau[:, j] = tau[:, j] / VALUES["gain"]
    if shift == "actuator_lag":
        for j in some.named[1].joints:
            tau[:, j] += OWN[shift]["time_constant"] * np.gradient(tau[:, j], m.t)
    else:
        tau = np.stack([np.interp(m.t + VALUES["delay"], m.t, x) for x in tau.T], axis=1)
    # A delay is the slope half way, right to third order.
    np.testing.assert_allclose(torques_along(some, as_conditioned(m)).corrected[3:-3], tau[3:-3], rtol=0,
                               atol=1e-3 * np.abs(tau).max())  # fmt: skip


INSTANT = ("viscous_friction", "load_dependent_friction", "thermal_friction_drift", "torque_gain")


@functools.cache
def instants():
    """A model whose effects have a torque at one instant, of time, load and acceleration too; rows of the motion."""
    robot, m = corrected_robot(model(*INSTANT)), motion()
    return robot, [jnp.asarray(x[::40]) for x in (m.q, m.qd, m.qdd, m.t)], torque_along(robot, m)[::40]


def test_the_torque_at_an_instant_is_that_of_the_motion_there():
    robot, rows, along = instants()
    tau = jax.jit(jax.vmap(robot.inverse_dynamics))(*rows)
    np.testing.assert_allclose(tau, along, rtol=1e-10, atol=1e-10)


def test_forward_dynamics_is_the_inverse_of_inverse_dynamics():
    robot, (q, qd, qdd, t), along = instants()
    again = jax.jit(jax.vmap(robot.forward_dynamics))(q, qd, along, t)
    np.testing.assert_allclose(again, qdd, rtol=1e-9, atol=1e-9)  # Newton's steps end at rounding


def test_the_torque_can_be_differentiated_by_an_effects_parameter():
    robot, (q, qd, qdd, _), _ = instants()
    only = robot.without(*INSTANT[1:])
    slope = eqx.filter_grad(lambda r: r.inverse_dynamics(q[3], qd[3], qdd[3])[0])(only)
    np.testing.assert_allclose(slope.effects[0].amplitudes, qd[3, :1], rtol=1e-12)


@pytest.mark.parametrize("slug", [slug for slug in AT_ONCE if CATALOGUE[slug].export.history])
def test_a_torque_that_depends_on_what_was_before_is_refused_at_an_instant(slug):
    robot, state = corrected_robot(model(slug)), jnp.zeros(arm().n)
    with pytest.raises(InputError, match=slug):
        robot.inverse_dynamics(state, state, state)


@pytest.mark.parametrize("slug", [s for s in AT_ONCE if CATALOGUE[s].export.history and not CATALOGUE[s].export.step])
def test_what_cannot_be_simulated_forward_is_refused_by_its_name(slug):
    with pytest.raises(InputError, match=slug):
        corrected_robot(model(slug)).at_rest(jnp.zeros(arm().n))


def simulated(robot, seconds=1.0, dt=5e-4):
    """The corrected arm under sliding mode control of the nominal one, along a slow motion."""
    m = fourier_motion(arm(), seconds, 1.0 / dt, seed=3, speed=0.3)
    reference = Reference(*(jnp.asarray(x) for x in (m.t, m.q, m.qd, m.qdd)))
    slope, gain, layer, damping = (jnp.full(arm().n, x) for x in (10.0, 1.0, 0.5, 10.0))
    return play(robot, SlidingMode(arm(), slope, gain, layer, damping), reference)


def test_a_simulation_with_bristles_has_the_torque_of_its_own_motion():
    robot = corrected_robot(model("presliding_hysteresis", "viscous_friction", "load_dependent_friction"))
    run = simulated(robot)
    again = torque_along(robot, run)
    assert np.abs(run.qd).max() > 0.05
    np.testing.assert_allclose(again, run.tau, rtol=0, atol=1e-8 * np.abs(run.tau).max())


def test_a_drive_that_lags_gives_what_was_asked_for_one_time_constant_ago():
    robot = corrected_robot(model("actuator_lag"))
    run = simulated(robot)
    real = torque_along(robot.without("actuator_lag"), run)
    tau = np.asarray(run.tau)
    settled = slice(200, None)
    asked = np.asarray(np.interp(run.t - 0.01, run.t, tau[:, 0]))
    off = np.sqrt(np.mean((real[settled, 0] - asked[settled]) ** 2))
    unlagged = np.sqrt(np.mean((real[settled, 0] - tau[settled, 0]) ** 2))
    assert 0.0 < off < 0.4 * unlagged  # a lag is a delay but for the curvature of the torque


WHOLE = [slug for slug in AT_ONCE if CATALOGUE[slug].export.not_in_mjcf == ""]
SECOND_ORDER = ("encoder_offset", "gravity_tilt")  # the fit has them to first order at the nominal inertials


def mujoco_torque(native, m):
    """What the motors of the reloaded file would be asked for, by MuJoCo's inverse dynamics."""
    compiled = mujoco.MjModel.from_xml_string(robot_mjcf(native))
    tau = rigid_torque(compiled, m.q, m.qd, m.qdd) + compiled.dof_frictionloss * np.sign(m.qd)
    return tau / compiled.actuator_gear[:, 0] * np.asarray(arm().gear)


def test_mujoco_reproduces_the_prediction_where_everything_can_be_expressed():
    exact, m = [slug for slug in WHOLE if slug not in SECOND_ORDER], motion()
    assert {"coulomb_friction", "payload", "torque_gain", "gravity_spring", "torque_offset"} <= set(exact)
    whole = model(*exact, rest=1e-9)
    fitted = torques_along(whole, as_conditioned(m, 1e-9)).corrected
    # A constant torque is a spring soft to 1e-7; rounding of sign(qd) is off.
    np.testing.assert_allclose(mujoco_torque(native_robot(whole), m), fitted, atol=1e-6 * np.abs(fitted).max())


def test_a_payload_whose_moments_are_those_of_no_body_leaves_a_file_that_mujoco_takes():
    law, n = CATALOGUE["payload"], arm().n
    w = np.array([3.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.02, 0.0, 0.02])  # its first moment of inertia is negative
    named = Named(law, tuple(range(n)), tuple(range(10)), w, np.zeros(0))
    phi, band = np.asarray(arm().phi), Band(20.0, 32.0, 200.0, 4)
    native = native_robot(CorrectedModel(arm(), phi, phi, (named,), band, np.ones(n)))
    compiled = mujoco.MjModel.from_xml_string(robot_mjcf(native))
    assert compiled.body_mass[-1] == pytest.approx(float(arm().phi[-1, 0]) + 3.0, rel=0.5)


@pytest.mark.parametrize("slug", SECOND_ORDER)
def test_mujoco_reproduces_wrong_zeros_and_leaning_bases_to_second_order(slug):
    one, m = model(slug, phi=1.0), motion()
    fitted, plain = (torques_along(x, as_conditioned(m)).corrected for x in (one, model(phi=1.0)))
    off = mujoco_torque(native_robot(one), m) - fitted
    assert np.abs(off).max() < 0.03 * np.abs(fitted - plain).max()  # offset 0.02 rad, tilt 0.02 rad


@pytest.mark.parametrize("slug", [s for s in AT_ONCE if CATALOGUE[s].export.mjcf and CATALOGUE[s].export.not_in_mjcf])
def test_the_part_that_mjcf_can_hold_brings_it_nearer(slug):
    one, m = model(slug, phi=1.0), motion()
    fitted = torques_along(one, as_conditioned(m)).corrected
    rms = lambda x: float(np.sqrt(np.mean(x**2)))  # noqa: E731
    with_part, without = (rms(mujoco_torque(native_robot(x), m) - fitted) for x in (one, model(phi=1.0)))
    assert with_part < 0.9 * without


def test_the_written_file_is_read_again_as_the_same_robot_and_says_what_it_lacks(tmp_path):
    some = model("coulomb_friction", "stribeck_friction", "time_delay")
    save_native(some, tmp_path)
    again, native = load_robot(tmp_path / XML), native_robot(some)
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(native), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)
    page = (tmp_path / NOTES).read_text()
    assert page.index("Coulomb friction") < page.index("In the file in part") < page.index("Stribeck friction")
    assert page.index("## Not in the file") < page.index(CATALOGUE["time_delay"].title)


def test_every_effect_says_how_much_of_it_mjcf_can_express():
    for effect in CATALOGUE.values():
        assert effect.export.mjcf or effect.export.not_in_mjcf, effect.slug
        assert bool(effect.export.in_model or effect.export.in_servo) == bool(effect.export.mjcf), effect.slug
        assert not effect.export.not_in_mjcf.endswith("."), effect.slug


def test_possible_inertials_stay_as_they_are():
    phi = np.asarray(irb.robot.irb140().phi)
    np.testing.assert_array_equal(consistent(1.04 * phi, phi), 1.04 * phi)


@pytest.mark.parametrize("seed", range(5))
def test_impossible_inertials_become_those_of_a_body_that_mujoco_accepts(seed):
    phi = np.asarray(arm().phi)
    wild = phi * (1.0 + 2.0 * np.random.default_rng(seed).normal(size=phi.shape))
    assert min(np.linalg.eigvalsh(pseudo_inertia(p)).min() for p in wild) < 0.0
    mended = consistent(wild, phi)
    assert min(np.linalg.eigvalsh(pseudo_inertia(p)).min() for p in mended) > 0.0
    mujoco.MjModel.from_xml_string(robot_mjcf(irb.robot.with_phi(arm(), jnp.asarray(mended))))


def test_how_far_the_written_file_is_off_is_what_impossible_inertials_lose():
    m, sound = motion(), model("coulomb_friction", "viscous_friction")
    smooth = as_conditioned(m)
    along = lambda x: [torques_along(x, smooth).corrected]  # noqa: E731
    gap_of = lambda x: native_gap(beyond_file(x, [smooth], along(x)) or [], x.band)  # noqa: E731
    gap, size = gap_of(sound), np.sqrt(np.mean(along(sound)[0] ** 2, axis=0))
    assert np.all(gap < 1e-6 * size)
    wild = sound.phi_corrected * np.array([[1.0], [-1.0]])
    lost = dataclasses.replace(sound, phi_corrected=wild)
    mended = consistent(wild, np.asarray(arm().phi)) - wild
    Y = np.asarray(irb.dynamics.regressor_batch(arm(), *(jnp.asarray(x) for x in (m.q, m.qd, m.qdd))))
    expected = np.sqrt(np.mean(lost.band.apply(Y @ mended.ravel()) ** 2, axis=0))
    gap = gap_of(lost)
    np.testing.assert_allclose(gap, expected, rtol=1e-3)
    (note, *_) = gap_notes(arm(), gap, size, [])
    assert "inertial parameters that no body can have" in note and f"{gap[0]:.3g} N m" in note
    assert not gap_notes(arm(), 0.001 * size, size, [])


def test_each_joint_is_told_what_the_file_lacks_of_its_own_and_else_of_others():
    told = lambda *left_out: [re.findall(r"hold all of ([^:.]*)\.", note)[0]  # noqa: E731
                              for note in gap_notes(arm(), np.ones(arm().n), np.ones(arm().n), left_out)]  # fmt: skip
    assert told(("hysteresis", (0,)), ("ripple", (0, 1))) == ["hysteresis, ripple", "ripple"]
    assert told(("hysteresis", (0,))) == ["hysteresis", "hysteresis"]


def test_the_model_survives_its_way_through_json():
    some, m = model("coulomb_friction", "torque_gain"), motion()
    again = from_json(to_json(some))
    np.testing.assert_array_equal(torque_along(corrected_robot(again), m), torque_along(corrected_robot(some), m))


def carried(seed: int) -> Discrepancy:
    """Torque without a name on the first joint alone."""
    coefficients = np.zeros((arm().n, FEATURES))
    coefficients[0] = 0.1 * np.random.default_rng(seed).normal(size=FEATURES)
    one, m = np.ones(arm().n), motion()
    scales = Scales(np.abs(m.qd).max(axis=0), REST * one, 5.0 * one, m.q.min(axis=0), m.q.max(axis=0), 5.0, 0.1 * one,
                    1e-5 * one)  # fmt: skip
    return Discrepancy(scales, coefficients)


def recorded(m) -> Recording:
    return Recording(t=m.t, q=m.q, tau=0.0 * m.q, joint_names=arm().joint_names, source="made")


@pytest.mark.parametrize("shift", [0.0, VALUES["delay"]], ids=["in step", "late"])
def test_a_model_predicts_with_what_it_carries_without_a_name_in_the_log_behind_the_same_low_pass(shift):
    plain = model("coulomb_friction", "torque_gain", *(["time_delay"] if shift else []))
    unnamed, log = carried(1), recorded(motion())
    some, smooth = dataclasses.replace(plain, discrepancy=unnamed), condition(log, plain.band, pad=True)
    rest = unnamed.along(smooth, torques_along(plain, smooth).loads.load)
    assert np.std(rest[:, 0]) > 0.01 and not rest[:, 1].any()
    # Stated as it is logged, and logged at another time.
    rest = np.stack([np.interp(smooth.t + shift, smooth.t, x) for x in rest.T], axis=1)
    rest = filtered(rest, kernels(plain.band.position, plain.band.rate)[0])
    difference = predict(some, log)["corrected"] - predict(plain, log)["corrected"]
    expected = np.stack([np.interp(log.t, smooth.t, x) for x in rest.T], axis=1)
    # A delay is a mean of slopes: where the torque bends sharply, it is rounded.
    np.testing.assert_allclose(difference, expected, rtol=0, atol=2e-2 * np.abs(expected).max() if shift else 1e-9)
    for kind in ("nominal", "refit"):
        np.testing.assert_array_equal(predict(some, log)[kind], predict(plain, log)[kind])


def test_what_a_model_carries_without_a_name_survives_its_way_through_json():
    some, log = dataclasses.replace(model("coulomb_friction"), discrepancy=carried(2)), recorded(motion())
    again = from_json(json.loads(json.dumps(to_json(some))))
    np.testing.assert_array_equal(predict(again, log)["corrected"], predict(some, log)["corrected"])
    assert from_json(to_json(model("coulomb_friction"))).discrepancy is None


@pytest.mark.parametrize("scale", [-0.2, 0.0, 0.15])
def test_a_scale_of_all_torques_leaves_friction_as_it_was_logged_and_scales_the_load(scale):
    plain, smooth = model("coulomb_friction", "viscous_friction", "gravity_spring"), as_conditioned(motion())
    torques = torques_along(plain, smooth)
    friction = torques.corrected - torques.loads.load
    assert np.std(friction[:, 0]) > 0.01
    some = dataclasses.replace(plain, named=scaled(arm().n, plain.named, scale))
    logged = torques_along(some, smooth).corrected
    np.testing.assert_allclose(logged, (1.0 + scale) * torques.loads.load + friction, rtol=1e-9, atol=1e-9)


def test_a_folder_without_a_diagnosis_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"model\.json"):
        irb.load_corrected(tmp_path)


def test_a_prediction_has_a_row_for_every_row_of_the_file_also_for_repeated_ones(tmp_path):
    m, plain = motion(), model()
    torque = torques_along(plain, as_conditioned(m)).nominal
    made = Recording(t=m.t, q=m.q, tau=torque, joint_names=arm().joint_names, source="made")
    frame = helpers_recordings.frame(made)
    repeated = frame.loc[np.sort(np.r_[np.arange(len(frame)), 300, 700])]
    paths = [tmp_path / "once.csv", tmp_path / "twice.csv"]
    for table, path in zip((frame, repeated), paths, strict=True):
        table.to_csv(path, index=False)
    once, twice = (read_recording(path, arm()) for path in paths)
    assert len(prediction_times(twice)) == len(repeated) == len(frame) + 2
    expected = predict(plain, once)["corrected"][np.searchsorted(once.t, prediction_times(twice))]
    np.testing.assert_allclose(predict(plain, twice)["corrected"], expected, rtol=1e-9, atol=1e-9)
