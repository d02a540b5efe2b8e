"""Logs of commands: the torque of a servo, its unknown gains, and physics named from it."""

import dataclasses
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pandas as pd
import pytest
from helpers_servo import JOINTS, KD, KP, closed_loop, to_and_fro, two_links
from scipy import signal

import irb140_jax as irb
from irb140_jax import dynamics
from irb140_jax.cli import main
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import DiagnoseConfig, diagnose, save
from irb140_jax.mismatch.corrected.native import native_robot
from irb140_jax.mismatch.regression.servo import servo_columns
from irb140_jax.mismatch.regression.sufficient_data import comparison
from irb140_jax.recordings import Drive, Payload, drive_of_model, read_recording, stated_drive, write_recording
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.drive import Times
from irb140_jax.recordings.servo import with_servo_torques, with_torque
from irb140_jax.report import html_report
from irb140_jax.robot import with_phi
from testbed.runner import read_case
from testbed.servos import make_servo

STATED = stated_drive(np.array(KP), np.array(KD))
# Compiling the whole library takes most of a minute; these are what a servo's errors might be taken for.
LIBRARY = ("coulomb_friction", "viscous_friction", "asymmetric_friction", "rotor_inertia", "torque_gain",
           "torque_offset", "actuator_lag", "time_delay")  # fmt: skip


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "arm.xml"
    path.write_text(two_links(actuators=""))
    return irb.load_robot(path)


def diagnosed(robot, drive, **plant):
    loops = [closed_loop(two_links(**plant), seed)[0] for seed in (1, 2)]
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    return diagnose(robot, [dataclasses.replace(r, drive=drive) for r in loops], config)


def drive_of(recording):
    assert recording.drive is not None
    return recording.drive


def names(result):
    return {(f.effect, *f.joints) for f in result.diagnosis.findings}


# --- the torque of a servo -------------------------------------------------------------------------------------------


def test_the_torque_made_of_commands_is_that_of_mujocos_actuators():
    recording, torque = closed_loop(two_links(), noise=0.0)
    made = with_torque(recording, STATED).tau
    # Speeds are differentiated at 200 Hz from motion below 2 Hz, and a step of the plant is 0.25 ms.
    assert np.abs(made - torque)[5:-5].max() < 0.01 * np.abs(torque).max()


@pytest.mark.parametrize("gear", [1.0, 3.0])
def test_gains_are_read_from_the_models_actuators(tmp_path, gear):
    (tmp_path / "arm.xml").write_text(two_links(gear=gear, limit=4.0))
    drive = drive_of_model(tmp_path / "arm.xml", JOINTS)
    np.testing.assert_allclose(drive.kp, gear**2 * np.array(KP))  # torque = gear force, length = gear q
    np.testing.assert_allclose(drive.kd, gear**2 * np.array(KD))
    np.testing.assert_allclose(drive.limit, 4.0 * gear)


def test_motors_are_no_servos(tmp_path):
    (tmp_path / "arm.xml").write_text(two_links(actuators='<motor joint="elbow"/>'))
    assert np.isnan(drive_of_model(tmp_path / "arm.xml", JOINTS).kp).all()


def test_rows_at_the_torque_limit_are_left_out_and_counted(robot):
    recording, torque = closed_loop(two_links(limit=4.0), noise=0.0, delay=0.005)
    stated = dataclasses.replace(stated_drive(np.array(KP), np.array(KD), 4.0), delay=np.full(2, 0.005))
    limited = dataclasses.replace(recording, drive=stated)
    (made,), notes = with_servo_torques([limited], robot, 0.05)
    at_limit = np.abs(torque) > 3.999
    assert made.torque_lost is not None and at_limit[:, 0].any()
    assert made.torque_lost[at_limit].mean() > 0.99
    kept = ~made.torque_lost
    kept[0] = False  # what was commanded before the log began is not in it
    assert np.abs(made.tau - torque)[kept].max() < 0.1
    assert any(f"{made.torque_lost[:, 0].sum()} of {len(made.t)} rows of shoulder are left out" in n for n in notes)


def test_an_unknown_kp_is_estimated_from_the_nominal_inertials_and_said_with_its_unit(robot):
    recording, _ = closed_loop(two_links(elbow='frictionloss="0.2"'))
    (made,), notes = with_servo_torques([recording], robot, 0.05)
    np.testing.assert_allclose(drive_of(made).kp, KP, rtol=0.1)
    assert np.all(drive_of(made).kp_width >= 0.05)
    assert any("in units of that Kp only" in note and "would fix the scale" in note for note in notes)


def test_a_delay_of_all_commands_is_estimated_before_the_search(robot):
    recording, _ = closed_loop(two_links(), delay=0.010)
    (made,), _ = with_servo_torques([dataclasses.replace(recording, drive=STATED)], robot, 0.05)
    np.testing.assert_allclose(drive_of(made).delay, 0.010, atol=5e-4)


@pytest.mark.parametrize(("late", "unsure"), [((0.0, 0.0), 0.0), ((0.01, 0.01), 0.0), ((0.0, 0.02), 0.01)])
def test_joints_that_disagree_on_the_delay_leave_it_open(robot, late, unsure):
    """Two joints whose commands act 0 and 20 ms late say that the delay of all is 10 ms, give or take 10."""
    recording, _ = closed_loop(two_links())
    assert recording.qdes is not None
    told = [np.interp(recording.t + x, recording.t, wanted) for x, wanted in zip(late, recording.qdes.T, strict=True)]
    (made,), _ = with_servo_torques(
        [dataclasses.replace(recording, qdes=np.stack(told, axis=1), drive=STATED)], robot, 0.05)  # fmt: skip
    drive = drive_of(made)
    np.testing.assert_allclose(drive.delay, np.mean(late), atol=5e-4)
    assert drive.common_delay_width == pytest.approx(np.hypot(1e-3, unsure), rel=0.02)
    assert drive.phase_width == pytest.approx(1e-3 / np.sqrt(12.0))


def test_effects_of_a_channels_clock_or_scale_are_not_looked_for_in_logs_of_commands():
    """No simulation holds a drive of a single joint that lags; by how much all lag is found beside the effects."""
    absent = {slug for slug, effect in CATALOGUE.items() if not effect.place.is_in(servo=True)}
    assert absent == {"actuator_lag", "channel_skew", "time_delay", "torque_gain"}


@pytest.mark.parametrize(("delay", "lag", "stated"), [(0.004, 0.0, False), (0.0, 0.006, False), (0.004, 0.006, True)])
def test_a_late_command_and_a_torque_that_lags_are_told_apart_and_no_physics(robot, delay, lag, stated):
    friction = 'frictionloss=".4" damping=".13"', 'frictionloss=".2" damping=".02"'
    plant = two_links(shoulder=friction[0], elbow=friction[1], actuators="" if lag else None)
    loops = [closed_loop(plant, seed, delay=delay, lag=lag)[0] for seed in (1, 2)]
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    told = dataclasses.replace(STATED, delay=np.full(2, delay * stated))
    result = diagnose(robot, [dataclasses.replace(r, drive=told) for r in loops], config)
    drive = result.model.drive
    assert drive is not None
    # Simulations, which hold no lag, may lose a part of that time by commands.
    np.testing.assert_allclose(drive.delay + drive.lag, delay + lag, atol=1e-3)
    if stated:  # each joint's commands may still have a time of their own
        np.testing.assert_allclose(drive.delay, delay, atol=3e-4)
    else:
        (said,) = (n for n in result.diagnosis.notes if n.startswith("Commands of all joints"))
        told = [float(x) for x in re.findall(r"act (\S+) .* to lag (\S+) ms", said)[0]]
        np.testing.assert_allclose(told, [1e3 * delay, 1e3 * lag], atol=1.0)
    found = names(result)
    assert found >= {("coulomb_friction", joint) for joint in JOINTS}
    assert {name for name, *_ in found} <= {"coulomb_friction", "viscous_friction"}
    assert stated or any("can't be told from the fit" in note for note in result.diagnosis.notes)


def test_recordings_that_begin_at_other_moments_of_a_cycle_have_the_same_friction(robot):
    """A log's rows and a controller's cycles keep no common time: commands of one run act later than another's."""
    friction = 'frictionloss=".4" damping=".13"', 'frictionloss=".2" damping=".02"'
    plant, delays = two_links(shoulder=friction[0], elbow=friction[1]), (0.004, 0.005)
    loops = [closed_loop(plant, seed, delay=delay)[0] for seed, delay in zip((1, 2), delays, strict=True)]
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    result = diagnose(robot, [dataclasses.replace(r, drive=STATED) for r in loops], config)
    assert {name for name, *_ in names(result)} <= {"coulomb_friction", "viscous_friction"}
    np.testing.assert_allclose(drive_of(result.model).delay, np.mean(delays), atol=1e-3)
    notes = result.diagnosis.notes
    (clocks,) = (n for n in notes if n.startswith("The recordings begin at different moments"))
    before, after = map(float, re.findall(r"([0-9.]+) ms", clocks))
    assert before == pytest.approx(0.5, abs=0.05) and after == pytest.approx(0.5, abs=0.05)
    # Taken for friction, half a millisecond would be 0.03 and 0.015 N m s/rad of it, of another sign in each run.
    said = [n for n in notes if "differs between the recordings" in n]
    assert all(abs(float(x)) < 0.002 for n in said for x in re.findall(r"and (\S+) N m s/rad viscous", n))
    for fit in result.diagnosis.fit.values():
        assert fit.rmse_corrected is not None and fit.rmse_refit is not None
        assert fit.rmse_corrected < 0.2 * fit.rmse_refit


def test_a_drive_that_lags_gives_the_same_torque_later():
    recording, _ = closed_loop(two_links(), duration=3.0)
    (now, later) = (with_torque(recording, dataclasses.replace(STATED, lag=lag)).tau for lag in (0.0, 2.0 / 200.0))
    np.testing.assert_allclose(later[2:], now[:-2], atol=1e-9)
    assert Drive.from_json(dataclasses.replace(STATED, lag=0.01).to_json()).lag == 0.01


def test_what_the_torque_of_a_lagging_drive_errs_by_comes_as_late(robot):
    """Derivatives of the torque that is made, by Kd and by the time of a command, are the columns of those."""
    recording = dataclasses.replace(closed_loop(two_links(), duration=4.0)[0], drive=STATED)
    motion = comparison(robot, [recording], 0.05, lambda _: None).later(Times(lag=0.02)).smooth[0]
    assert motion.servo is not None
    drive, late, inside = motion.servo.drive, motion.servo.drive.time_width, slice(40, -40)  # where nothing is cut off
    made = lambda d: np.interp(motion.t, recording.t, with_torque(recording, d).tau[:, 0])  # noqa: E731
    less_kd = dataclasses.replace(drive, kd=drive.kd - drive.kd_width)
    earlier = dataclasses.replace(drive, delay=drive.delay - late)
    for column, other in zip(servo_columns(motion, 0).T, (less_kd, earlier), strict=True):
        change, size = made(other) - made(drive), np.abs(column).max()
        np.testing.assert_allclose(column[inside], change[inside], atol=0.03 * size)


def test_commands_that_are_held_from_row_to_row_act_half_a_row_late(tmp_path):
    case = make_servo("work", 9, "known")  # 100 rows a second, with friction on every joint
    robot, recordings, _ = read_case(case, tmp_path)
    made, _ = with_servo_torques(recordings, robot, 0.05)
    drive = drive_of(made[0])
    np.testing.assert_allclose(drive.delay, 0.005, atol=1e-3)


def test_logs_of_torque_and_of_commands_are_not_mixed(robot):
    recording, torque = closed_loop(two_links(), duration=3.0)
    with pytest.raises(RecordingError, match="give recordings of one kind"):
        with_servo_torques([recording, dataclasses.replace(recording, qdes=None, tau=torque)], robot, 0.05)


# --- what moves a servo ----------------------------------------------------------------------------------------------

SOFT = (20.0, 20.0), (1.5, 1.5)  # gains of a leg: the servo's damping is as large as what its joints weigh


def leg(joints=""):
    xml = two_links(SOFT[0], SOFT[1], shoulder=joints, elbow=joints)
    light = {'mass="1.2"': 'mass=".6"', 'mass=".7"': 'mass=".15"', ".012 .012 .002": ".004 .004 .001",
             ".006 .006 .001": ".001 .001 .0003"}  # fmt: skip
    for old, new in light.items():
        xml = xml.replace(old, new)
    return xml


LEG = leg('armature=".03" frictionloss=".3" damping=".1"')


@pytest.fixture(scope="module")
def nominal_leg(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "leg.xml"
    path.write_text(leg())
    return irb.load_robot(path)


def pushed_leg(pushed, seed):
    recording, _ = to_and_fro(LEG, pushed, seed)
    return dataclasses.replace(recording, drive=stated_drive(np.array(SOFT[0]), np.array(SOFT[1])))


@pytest.mark.parametrize("seed", [1, 2])
def test_the_comparison_ends_where_more_of_the_motion_is_pushed_than_commanded(nominal_leg, seed):
    pushed, alone = pushed_leg(0.15, seed), pushed_leg(0.0, seed)
    rates = (np.diff(x, axis=0) * 200.0 for x in (pushed.q, pushed.q - alone.q))
    (f, whole), (_, of_pushes) = (signal.welch(x, 200.0, nperseg=400, axis=0) for x in rates)
    even = [f[(f > 3.0) & (of_pushes[:, j] > 0.5 * whole[:, j])][0] for j in range(2)]
    bands = [choose_band(with_servo_torques([r], nominal_leg, 0.05)[0], nominal_leg).torque for r in (pushed, alone)]
    np.testing.assert_allclose(bands[0], min(even), atol=3.0)  # of spectra that resolve 1 Hz
    assert bands[1] == 20.0  # as wide as any


@pytest.mark.parametrize("seed", [1, 2])
def test_pushes_that_no_command_knows_of_make_no_command_late(nominal_leg, seed):
    drive = drive_of(with_servo_torques([pushed_leg(0.4, seed)], nominal_leg, 0.05)[0][0])
    assert not drive.delay.any()


def test_what_pushes_a_servo_is_not_taken_for_a_delay_of_its_torque(nominal_leg):
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    result = diagnose(nominal_leg, [pushed_leg(0.4, 2)], config)
    rotors = {f.joints[0]: f.parameters["inertia"] for f in result.diagnosis.findings if f.effect == "rotor_inertia"}
    assert set(rotors) == set(JOINTS) and "time_delay" not in {f.effect for f in result.diagnosis.findings}
    for inertia in rotors.values():
        assert inertia.value is not None and inertia.std is not None
        assert abs(inertia.value - 0.03) < 2.0 * inertia.std


@pytest.mark.parametrize(("command", "seed"), [(closed_loop, 2), (to_and_fro, 1)])
def test_dry_friction_that_turns_before_the_joint_is_neither_a_delay_nor_a_coupling(robot, command, seed):
    """MuJoCo's does, by milliseconds: its constraints are soft."""
    plant = two_links(shoulder='frictionloss=".4" damping=".13"', elbow='frictionloss=".2" damping=".02"')
    recording, torque = to_and_fro(plant, 0.0, seed) if command is to_and_fro else command(plant, seed)
    noise = 0.01 * np.random.default_rng(seed).normal(size=torque.shape)
    result = diagnose(robot, [dataclasses.replace(recording, tau=torque + noise, qdes=None)])
    friction = ("coulomb_friction", "viscous_friction")
    assert names(result) == {(name, joint) for name in friction for joint in JOINTS}


# --- reading ---------------------------------------------------------------------------------------------------------


def test_commands_stand_in_the_place_of_torque_in_a_file(robot, tmp_path):
    recording, _ = closed_loop(two_links(), duration=3.0)
    path = write_recording(recording, tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text('[kp]\nshoulder = 60\nelbow = 30\n[kd]\n"*" = 0.8\n[torque_limit]\nelbow = 5\n')
    again = read_recording(path, robot, tmp_path / "map.toml")
    assert again.is_servo_log and not again.has_torque
    np.testing.assert_allclose(np.asarray(again.qdes), np.asarray(recording.qdes))
    np.testing.assert_allclose(drive_of(again).kp, KP)
    np.testing.assert_allclose(drive_of(again).kd, 0.8)
    np.testing.assert_allclose(drive_of(again).limit, [np.inf, 5.0])


@pytest.mark.parametrize(
    "spoil, said",
    [
        (np.degrees, 'looks like degrees; map it with --columns and [scale] "qdes.shoulder" = "deg"'),
        (lambda qdes: -qdes, "of the wrong sign"),
        (lambda qdes: qdes[:, ::-1], "is followed by q.elbow"),
    ],
)
def test_commands_of_another_unit_sign_or_joint_are_refused(robot, tmp_path, spoil, said):
    recording, _ = closed_loop(two_links(), duration=8.0)
    path = write_recording(dataclasses.replace(recording, qdes=spoil(recording.qdes)), tmp_path / "log.csv")
    with pytest.raises(RecordingError, match="qdes.shoulder") as error:
        read_recording(path, robot)
    assert said in str(error.value) and "\n" not in str(error.value)


def test_a_gain_of_zero_is_refused_with_its_line(robot, tmp_path):
    path = write_recording(closed_loop(two_links(), duration=3.0)[0], tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text("[kp]\nelbow = 0\n")
    with pytest.raises(RecordingError, match=r"\[kp\] elbow = 0"):
        read_recording(path, robot, tmp_path / "map.toml")


# --- diagnoses -------------------------------------------------------------------------------------------------------


def test_a_servo_that_leaves_nothing_out_stays_silent_with_gains_ten_percent_wrong(robot):
    result = diagnosed(robot, stated_drive(1.1 * np.array(KP), 1.1 * np.array(KD)))
    assert names(result) == set()
    assert "No torque was logged" in result.diagnosis.summary


def test_a_known_payload_fixes_kp_and_with_it_the_unit_of_friction(robot):
    """Of servos without any gains, on a model whose masses are all 15 % too small."""
    plant = two_links(elbow='frictionloss="0.25"')
    ball = '<body pos="0.01 -0.005 -.25"><inertial pos="0 0 0" mass="0.6" diaginertia="1e-6 1e-6 1e-6"/></body>'
    loaded = plant.replace("</body></body></worldbody>", f"{ball}</body></body></worldbody>")
    recordings = [closed_loop(xml, seed)[0] for xml, seed in ((plant, 1), (plant, 2), (loaded, 3))]
    # It hangs a centimetre from where it is said to.
    at = tuple(np.array([0.0, -0.005, -0.25]) - np.asarray(robot.tool_position))
    recordings[2] = dataclasses.replace(recordings[2], payload=Payload(0.6, at))
    config = DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY))
    result = diagnose(with_phi(robot, 0.85 * robot.phi), recordings, config)
    assert names(result) == {("coulomb_friction", "elbow")} and not result.diagnosis.unexplained
    drive, found = result.model.drive, result.diagnosis.findings[0].parameters["coulomb"]
    assert drive is not None and found.value and found.std
    np.testing.assert_allclose(drive.kp, KP, rtol=0.01)
    assert abs(found.value - 0.25) < 0.01 and found.std < 0.01
    assert any("By what the known payload adds to the torque, Kp is" in note for note in result.diagnosis.notes)


@pytest.fixture(scope="module")
def rubbing(robot):
    return diagnosed(robot, None, elbow='frictionloss="0.25"')


def test_friction_is_named_from_commands_alone_with_unknown_gains(rubbing):
    assert names(rubbing) == {("coulomb_friction", "elbow")}
    found = rubbing.diagnosis.findings[0].parameters["coulomb"]
    assert abs(found.value - 0.25) < 0.05 * 0.25 + 3.0 * found.std  # the scale is that of the inertials


def test_the_report_says_that_no_torque_was_logged_and_in_which_unit_parameters_are_known(rubbing, tmp_path):
    page = html_report(rubbing.diagnosis, rubbing.views, folder=tmp_path)
    assert "No torque was logged" in page and "in units of that Kp only" in page


def test_predict_compares_with_the_torque_of_the_servo_that_was_diagnosed(rubbing, tmp_path):
    recording, torque = closed_loop(two_links(elbow='frictionloss="0.25"'), seed=5)
    path = write_recording(recording, tmp_path / "new.csv")
    save(rubbing, tmp_path)
    words = ["predict", str(tmp_path), str(path), "--out", str(tmp_path / "torque.csv"), "--measured"]
    assert main(words) == 0
    table = pd.read_csv(tmp_path / "torque.csv")
    inside = slice(200, -200)
    measured, corrected, nominal = (table[f"tau_{x}.elbow"].to_numpy()[inside]
                                    for x in ("measured", "corrected", "nominal"))  # fmt: skip
    rms = lambda x: float(np.sqrt(np.mean(x**2)))  # noqa: E731
    # The estimated Kp is right to 5 %; encoder noise differentiated at 200 Hz is 0.02 N m of the servo's torque.
    assert rms(measured - torque[inside, 1]) < 0.05 * rms(torque[:, 1]) + 0.02
    assert rms(measured - corrected) < 0.5 * rms(measured - nominal)


def test_viscous_friction_of_a_servo_is_said_to_be_known_only_with_kd(robot):
    result = diagnosed(robot, STATED, shoulder='damping="0.8"')
    assert names(result) == {("viscous_friction", "shoulder")}
    said = result.diagnosis.findings[0].certain
    known = float(said.split("the sum of both, ")[1].split(",")[0])
    assert "can't be told from the drive's Kd" in said
    assert abs(known - 2.8) < 0.05  # Kd 2 and 0.8: known better than either


def test_a_kp_that_is_stated_too_large_beside_a_right_kd_makes_no_viscous_friction(robot):
    result = diagnosed(robot, stated_drive(1.5 * np.array(KP), np.array(KD)), elbow='frictionloss="0.25"')
    assert names(result) == {("coulomb_friction", "elbow")}


@pytest.mark.parametrize("more", [0.15, -0.15])
def test_damping_within_the_doubt_of_kd_has_no_name_and_is_in_the_corrected_model(robot, more):
    drive = dataclasses.replace(STATED, kd=STATED.kd - [min(more, 0.0), 0.0])  # a servo damps less than is stated
    result = diagnosed(robot, drive, shoulder=f'damping="{max(more, 0.0)}"')
    assert not names(result)
    damping = {n.joints: n.amplitudes[0] for n in result.model.named if n.effect.slug == "viscous_friction"}
    assert result.model.drive is not None
    found = damping.get((0,), 0.0) + result.model.drive.kd[0]
    assert abs(found - STATED.kd[0] - max(more, 0.0)) < 0.03
    note = next(note for note in result.diagnosis.notes if "Kp is really" in note)
    scale, unsure = (float(x) for x in note.split("shoulder ")[1].split(" %")[0].split(" +- "))
    assert abs(scale - 100.0) < 3.0 * unsure < 15.0


# --- the proof in motion and the file to take away --------------------------------------------------------------------


def test_the_corrected_model_goes_where_commands_sent_the_robot(rubbing):
    motion = rubbing.views.motion
    assert motion is not None and motion["driven_by"] == "commands" and not motion["followed"]
    assert not any("torque alone" in sentence for sentence in motion["sentences"])
    elbow, at = motion["joints"]["elbow"], motion["horizon"].index(0.5)
    assert elbow["corrected"]["median"][at] < 0.5 * elbow["refit"]["median"][at]
    # A servo brings every model back to its command: nothing flies away over a whole run.
    whole = motion["whole_run"]["joints"]["elbow"]
    assert whole["corrected"] < 0.5 * whole["refit"] < 0.1 * whole["moved"]


def test_the_report_says_that_commands_drove_the_models(rubbing):
    page = html_report(rubbing.diagnosis, rubbing.views)
    assert "recorded commands through the law of the servos" in " ".join(page.split())


def test_the_file_has_servos_that_move_it_as_our_own_dynamics_with_their_law(rubbing, tmp_path):
    save(rubbing, tmp_path)
    dt = 1e-4  # MuJoCo's step is of first order
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "corrected.xml"))
    # How strong the servos are by the motion is in the gains of the file.
    stronger = np.asarray(native_robot(rubbing.model).gear / rubbing.model.robot.gear)
    drive = drive_of(rubbing.model)
    kp, kd = stronger * drive.kp, stronger * drive.kd
    np.testing.assert_allclose(drive_of_model(tmp_path / "corrected.xml", JOINTS).kp, kp)
    assert (np.abs(stronger - 1.0) < 0.05).all()
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, dt
    model.dof_frictionloss[:] = 0.0  # a step of its own in either simulation
    arm = irb.load_robot(tmp_path / "corrected.xml")
    arm = eqx.tree_at(lambda r: r.frictionloss, arm, jnp.zeros(2))
    times = jnp.arange(0.0, 1.0, dt)
    wanted = 0.5 * jnp.sin(jnp.stack([4.0 * times, 6.0 * times + 1.0], axis=1))

    def step(state, command):
        def rate(x):
            return jnp.stack([x[1], dynamics.forward_dynamics(arm, x[0], x[1], kp * (command - x[0]) - kd * x[1])])

        half = state + 0.5 * dt * rate(state)
        return state + dt * rate(half), state[0]

    _, ours = jax.lax.scan(step, jnp.zeros((2, 2)), wanted)
    data, theirs = mujoco.MjData(model), np.empty(ours.shape)
    for k, command in enumerate(np.asarray(wanted)):
        theirs[k], data.ctrl[:] = data.qpos, command
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(theirs, ours, atol=1e-3 * np.abs(ours).max())
