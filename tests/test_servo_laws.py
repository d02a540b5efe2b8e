"""Laws of servos in a simulation that MuJoCo runs: named with their parameters, and held by the corrected model."""

import dataclasses
from functools import cache

import mujoco
import numpy as np
import pytest
from helpers_servo import JOINTS, KD, KP, closed_loop, given, two_links

import irb140_jax as irb
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import DiagnoseConfig, diagnose, predict, save
from irb140_jax.recordings import stated_drive

STATED = stated_drive(np.array(KP), np.array(KD))
SHOULDER, ELBOW = 'frictionloss=".4" damping=".13"', 'frictionloss=".2" damping=".02"'
ORDINARY = {(f"{kind}_friction", joint) for kind in ("coulomb", "viscous") for joint in JOINTS}
LAWS = tuple(slug for slug, effect in CATALOGUE.items() if effect.place.of_servos)
# Compiling the whole library takes most of a minute; these are what such a law might be taken for.
LIBRARY = ("coulomb_friction", "viscous_friction", "asymmetric_friction", "rotor_inertia", "torque_gain",
           "torque_offset", "load_dependent_friction", "actuator_lag", *LAWS)  # fmt: skip


def saturated(error, qd):
    return np.clip(given(error, qd), [-4.5, -np.inf], [4.5, np.inf])


def with_dead_band(error, qd):
    width = np.array([0.0, 0.02])
    return given(error - np.clip(error, -width, width), qd)


def by_voltage(error, qd):
    stall, fastest = np.array([7.0, np.inf]), np.array([10.0, np.inf])
    return np.clip(given(error, qd), -stall * (1.0 + qd / fastest), stall * (1.0 - qd / fastest))


HIDDEN = {
    "torque_saturation": (saturated, "shoulder", {"limit": 4.5}),
    "servo_deadband": (with_dead_band, "elbow", {"width": 0.02}),
    "back_emf": (by_voltage, "shoulder", {"stall_torque": 7.0, "no_load_speed": 10.0}),
}
every_law = pytest.mark.parametrize("slug", HIDDEN)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "arm.xml"
    path.write_text(two_links(actuators=""))
    return irb.load_robot(path)


@cache
def loops(slug, seed=1):
    law = HIDDEN[slug][0] if slug else given
    plant = two_links(actuators="", shoulder=SHOULDER, elbow=ELBOW)
    both = (closed_loop(plant, s, law=law)[0] for s in (seed, seed + 1))
    return tuple(dataclasses.replace(r, drive=STATED) for r in both)


@pytest.fixture(scope="module")
def diagnosed(robot):
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    return cache(lambda slug: diagnose(robot, loops(slug), config))


def names(result):
    return {(f.effect, *f.joints) for f in result.diagnosis.findings}


def test_every_law_of_servos_is_hidden_once():
    assert set(HIDDEN) == set(LAWS)


@every_law
def test_a_law_of_a_servo_is_named_with_its_parameters_and_nothing_else_is(diagnosed, slug):
    _, joint, truth = HIDDEN[slug]
    assert (slug, joint) in names(diagnosed(slug)) and names(diagnosed(slug)) <= {(slug, joint)} | ORDINARY
    (finding,) = (f for f in diagnosed(slug).diagnosis.findings if f.effect == slug)
    for name, value in truth.items():
        found = finding.parameters[name]
        assert abs(found.value - value) < min(4.0 * found.std, 0.15 * value), name


@every_law
def test_the_correction_takes_off_most_of_what_refitting_leaves(diagnosed, slug):
    fit = diagnosed(slug).diagnosis.fit[HIDDEN[slug][1]]
    assert fit.rmse_corrected < 0.2 * fit.rmse_refit


def test_a_servo_that_gives_what_it_is_asked_for_has_no_such_law(diagnosed):
    assert names(diagnosed("")) <= ORDINARY
    assert not set(LAWS) & {entry.effect for entry in diagnosed("").diagnosis.not_testable}


def test_logs_of_torque_are_not_searched_for_laws_of_servos(robot):
    _, torque = closed_loop(two_links(shoulder=SHOULDER, elbow=ELBOW))
    recording = dataclasses.replace(loops("")[0], tau=torque, qdes=None, drive=None)
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in ("coulomb_friction", *LAWS)))
    diagnosis = diagnose(robot, [recording], config).diagnosis
    said = {f.effect for f in diagnosis.findings} | {entry.effect for entry in diagnosis.not_testable}
    assert not set(LAWS) & said


def test_what_a_servo_lacks_of_a_law_that_is_not_known_is_not_looked_for(robot):
    kp, kd = np.array(KP), np.array([np.nan, KD[1]])
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in ("coulomb_friction", *LAWS)))
    recordings = [dataclasses.replace(r, drive=stated_drive(kp, kd)) for r in loops("")]
    diagnosis = diagnose(robot, recordings, config).diagnosis
    assert not set(LAWS) & ({f.effect for f in diagnosis.findings} | {entry.effect for entry in diagnosis.not_testable})


def test_the_limit_found_is_the_force_range_of_the_servo_in_the_file(diagnosed, tmp_path):
    result = diagnosed("torque_saturation")
    save(result, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "corrected.xml"))
    assert model.actuator_forcelimited.tolist() == [1, 0]
    (found,) = (n.shape[0] for n in result.model.named if n.effect.slug == "torque_saturation")
    # It is found in torque of the stated gains; the file has what the motor gives, gains and limit alike.
    strength = model.actuator_gainprm[0, 0] / KP[0]
    assert strength == pytest.approx(1.0, abs=0.02)
    assert model.actuator_forcerange[0, 1] == pytest.approx(found * strength)


def test_without_commands_a_prediction_is_the_torque_that_is_given(diagnosed):
    model, recording = diagnosed("torque_saturation").model, loops("torque_saturation")[0]
    planned = dataclasses.replace(recording, qdes=None, drive=None)
    # The real torque is at its limit, but for what a low-pass makes of that; the command asked for seven times as much.
    # What damps within the doubt of Kd is left to the drive.
    damped = 0.13 * np.abs(np.gradient(recording.q[:, 0], recording.t)).max()
    assert np.abs(predict(model, planned)["corrected"][:, 0]).max() < 1.2 * 4.5 + damped
