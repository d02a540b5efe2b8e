"""The readers of real machines give the figures their data are known for."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import irb140_jax as irb
from irb140_jax.dynamics import inverse_dynamics_batch
from irb140_jax.errors import RecordingError
from irb140_jax.recordings import machines, read_recording
from irb140_jax.recordings.machines import dfki_double_pendulum as pendulum
from irb140_jax.recordings.machines import (
    recordings_folder,
    so101,
    staubli_tx40,
    unitree_go2,
    write_pendulum,
    write_tx40,
)
from irb140_jax.recordings.machines.sources import SOURCES
from irb140_jax.recordings.servo import with_torque


def needs(machine):
    try:
        recordings_folder(machine)
    except RecordingError as error:
        return pytest.mark.skipif(True, reason=str(error))
    return pytest.mark.skipif(False, reason="")


needs_cycloidal, needs_servo = needs("cycloidal_play"), needs("bam_xl330")
needs_go2, needs_so101 = needs("unitree_go2"), needs("so101")
needs_tx40, needs_pendulum = needs("staubli_tx40"), needs("dfki_double_pendulum")


def low_pass(x, cutoff, step):
    return sosfiltfilt(butter(2, 2 * cutoff * step, output="sos"), x, axis=0)


def rigid_error(robot, t, q, tau, position_cutoff, torque_cutoff, stride=1):
    """Nominal torque less logged torque, both low-passed."""
    step = t[1] - t[0]
    q = low_pass(q, position_cutoff, step)
    qd = np.gradient(q, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    q, qd, qdd = (jnp.asarray(x[::stride]) for x in (q, qd, qdd))
    nominal = inverse_dynamics_batch(robot, q, qd, qdd)
    return np.asarray(nominal) - low_pass(tau, torque_cutoff, step)[::stride]


@needs_tx40
def test_the_tx40_has_the_known_rigid_error_on_the_last_30_percent(tmp_path):
    model, (train, test) = write_tx40(tmp_path)
    robot = irb.load_robot(model)
    parts = [read_recording(path, robot) for path in (train, test)]
    t, q, tau = (np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "q", "tau"))
    error = rigid_error(robot, t, q, tau, 100.0, 20.0, stride=5)
    rmse = np.sqrt(np.mean(error[int(0.7 * len(error)) :] ** 2, axis=0))
    # Known to two or three digits, and the order of the filters behind them is not.
    np.testing.assert_allclose(rmse, [18.0, 13.5, 6.5, 3.8, 1.5, 2.8], rtol=0.02)
    assert parts[0].notes == parts[1].notes == ()


@needs_tx40
def test_the_tx40_is_split_in_time_without_losing_a_sample(tmp_path):
    run = staubli_tx40.tx40_recording()
    train, test = staubli_tx40.split_in_time(run, 0.7)
    assert len(train.t) == 31500 and len(test.t) == 13500 and test.t[0] > train.t[-1]


@needs_tx40
@pytest.mark.parametrize(("wrong", "says"), [
    ({"tau": np.array([1, 1, 1, -1, 1, 1])}, "tau.joint_4 of the wrong sign"),
    ({"q": np.full(6, 180 / np.pi)}, "looks like degrees"),
    ({"q": staubli_tx40.GEAR}, "looks like degrees or the motor side"),
])
def test_a_spoiled_tx40_run_is_refused(tmp_path, wrong, says):
    model, _ = write_tx40(tmp_path)
    run = staubli_tx40.tx40_recording()
    run = dataclasses.replace(run, **{name: getattr(run, name) * factor for name, factor in wrong.items()})
    path = irb.recordings.write_recording(run, tmp_path / "spoiled.parquet")
    with pytest.raises(RecordingError, match=says.replace(".", r"\.")):
        read_recording(path, irb.load_robot(model))


def pendulum_rmse(robot, runs):
    errors = []
    for path in runs:
        run = read_recording(path, robot)
        t = np.arange(run.t[0], run.t[-1], 0.002)
        q, tau = (np.stack([np.interp(t, run.t, x[:, j]) for j in range(2)], axis=1) for x in (run.q, run.tau))
        errors.append(rigid_error(robot, t, q, tau, 10.0, 10.0)[150:-150])
    return np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))


@needs_pendulum
@pytest.mark.parametrize(("design", "known"), [("C.1", (0.314, 0.183)), ("A.0", (0.260, 0.182))])
def test_the_pendulum_has_the_known_rigid_error_on_its_test_runs(tmp_path, design, known):
    models, runs = write_pendulum(tmp_path, design)
    robot = irb.load_robot(models["correct"])
    tested = [runs[name] for name in pendulum.TEST_RUNS[design]]
    # Three digits are known; the resampling that led to them is not.
    np.testing.assert_allclose(pendulum_rmse(robot, tested), known, rtol=0.01)


@needs_pendulum
@pytest.mark.parametrize("design", ["C.1", "A.0"])
def test_every_pendulum_run_is_read_with_either_model(tmp_path, design):
    models, runs = write_pendulum(tmp_path, design)
    for model in models.values():
        robot = irb.load_robot(model)
        assert robot.joint_names == pendulum.JOINTS
        for path in runs.values():
            assert read_recording(path, robot).extras.keys() == {"tau_con.Joint1", "tau_con.Joint2"}


@needs_pendulum
@pytest.mark.parametrize("design", ["C.1", "A.0"])
def test_the_mistaken_model_has_the_pivot_inertia_at_the_centre_of_mass(tmp_path, design):
    models, _ = write_pendulum(tmp_path, design)
    right, wrong = (irb.load_robot(models[key]) for key in ("correct", "mistake"))
    about_pivot = right.inertia[:, 0, 0] + right.mass * np.sum(np.asarray(right.com) ** 2, axis=1)
    np.testing.assert_allclose(wrong.inertia[:, 0, 0], about_pivot, rtol=1e-9)


ARC_MINUTE = np.pi / 180 / 60


def dead_zone(run):
    """Gap [arc-min] of spring, dry friction and dead zone by least squares over what moves, tried in steps of two."""
    recording = machines.cycloidal_recording(run)
    q, tau = recording.q[:, 0] / ARC_MINUTE, recording.tau[:, 0]
    speed = np.gradient(np.convolve(q, np.ones(5) / 5, "same"), recording.t)
    moving = np.abs(speed) > 8.0
    q, tau, sign = q[moving], tau[moving], np.sign(speed[moving])
    best = (np.inf, 0.0)
    for gap in np.arange(0.0, 150.0, 2.0):
        for middle in np.arange(-20.0, 20.0, 2.0):
            bend = np.sign(q - middle) * np.maximum(np.abs(q - middle) - gap / 2, 0.0)
            columns = np.stack([bend, sign], axis=1)
            left = tau - columns @ np.linalg.lstsq(columns, tau, rcond=None)[0]
            best = min(best, (float(left @ left), float(gap)))
    return best[1]


@needs_cycloidal
@pytest.mark.parametrize(
    ("run", "known"), [("base_onyx runin1", 88), ("split_onyx runin1", 67), ("split_onyx 12pre1", 0)]
)
def test_the_cycloidal_gears_have_the_known_dead_zone(run, known):
    # 10 arc-min: what is left out of account (the first ramp, rows that creep) moves it by as much.
    assert abs(dead_zone(run) - known) <= 10.0


@needs_servo
def test_the_servo_rubs_more_under_load_and_a_stribeck_law_does_not_say_so():
    moving = []
    for run in machines.servo_runs():
        r = machines.servo_recording(run)
        grid = np.arange(r.t[0], r.t[-1], 0.005)
        q, tau = (low_pass(np.interp(grid, r.t, x[:, 0]), 10.0, 0.005) for x in (r.q, r.tau))
        qd = np.gradient(q, grid)
        rigid = 0.49 * 0.1 * (9.81 * np.sin(q) + 0.1 * np.gradient(qd, grid))
        columns = np.stack([rigid, np.gradient(qd, grid), qd, np.sign(qd), np.sign(qd) * np.abs(rigid),
                            np.sign(qd) * np.exp(-((qd / 0.3) ** 2)), tau], axis=1)  # fmt: skip
        moving.append(columns[np.abs(qd) > 0.1])
    A = np.concatenate(moving)
    left = lambda c: A[:, -1] - A[:, c] @ np.linalg.lstsq(A[:, c], A[:, -1], rcond=None)[0]  # noqa: E731
    coulomb, stribeck, loaded = (np.std(left(c)) for c in ([0, 1, 2, 3], [0, 1, 2, 3, 5], [0, 1, 2, 3, 4]))
    # The published check has 0.63, 0.63 and 0.39 V.
    assert stribeck > 0.95 * coulomb and loaded < 0.9 * coulomb


def test_a_place_without_the_recordings_says_how_to_get_them(tmp_path, monkeypatch):
    monkeypatch.setenv("IRB140_RECORDINGS", str(tmp_path))
    with pytest.raises(RecordingError, match=r"machines\.fetch FOLDER.*thanhndv212/figaroh-plus.*IRB140_RECORDINGS"):
        recordings_folder("staubli_tx40")


def test_a_published_file_that_was_changed_is_refused(tmp_path):
    (tmp_path / "pos_read_data.csv").write_text("Joint_1\n0\n")
    with pytest.raises(RecordingError, match="SHA-256"):
        staubli_tx40.tx40_recording(tmp_path)


def test_an_unknown_machine_or_design_is_refused_with_the_known_ones():
    with pytest.raises(RecordingError, match="allowed is staubli_tx40, dfki_double_pendulum"):
        recordings_folder("puma")
    with pytest.raises(RecordingError, match=r"allowed is C\.1, A\.0"):
        pendulum.pendulum_runs("B")


def test_every_source_is_pinned_to_a_commit_and_a_hash():
    for source in SOURCES.values():
        assert len(source.commit) == 40
        assert all(len(sha256) == 64 and path for path, sha256 in source.files.values())


@needs_go2
def test_the_go2s_servos_make_the_torque_that_is_known_of_its_legs():
    run = machines.go2_recording()
    assert run.is_servo_log and run.drive is not None and len(run.t) == unitree_go2.SWEEPS[-1]
    step = float(np.median(np.diff(run.t)))
    tau = low_pass(with_torque(run, run.drive).tau, 15.0, step)
    held = np.zeros(len(run.t), dtype=bool)
    for k in unitree_go2.HELD_OUT["A"]:
        held[unitree_go2.SWEEPS[k - 1] : unitree_go2.SWEEPS[k]] = True
    size = np.sqrt(np.mean(tau[held].reshape(-1, 4, 3) ** 2, axis=(0, 1)))  # of the four legs, by part
    np.testing.assert_allclose(size, [1.376, 0.592, 1.260], rtol=0.01)


@needs_go2
def test_the_go2s_sweeps_are_cut_where_they_begin_and_short_ones_left_out():
    fitted, held = machines.go2_split(machines.go2_recording("FL"), "A")
    assert [r.source for r in held] == ["sweep_3", "sweep_6", "sweep_9", "sweep_12"][: len(held)]
    assert sum(len(r.t) for r in fitted) == 601 + 562 + 481 + 441 + 362 + 322 + 242 + 200
    assert fitted[0].joint_names == ("FL_hip_joint", "FL_thigh_joint", "FL_calf_joint")


@needs_so101
def test_the_so101_is_as_far_from_its_commands_as_is_known():
    runs = [machines.so101_recording(motion) for motion in so101.HELD_OUT]
    off = np.concatenate([r.q - r.qdes for r in runs])
    np.testing.assert_allclose(np.sqrt(np.mean(off**2, axis=0)), [0.0310, 0.0500, 0.0513, 0.0306, 0.0457], rtol=0.02)


@needs_so101
def test_a_motion_that_the_so101_has_not_is_refused():
    with pytest.raises(RecordingError, match="has no motion 'dance'"):
        machines.so101_recording("dance")


@needs_servo
def test_the_pendulums_commands_make_the_torque_that_its_duty_cycle_gives():
    run = next(name for name, (kp, trajectory) in machines.servo_runs().items() if (kp, trajectory) == (100, "sin_sin"))
    logged, told = machines.servo_recording(run), machines.servo_commands(run)
    assert told.drive is not None
    made = with_torque(told, told.drive).tau[:, 0]
    apart = made - logged.tau[: len(made), 0]
    # Goals and duty are read one after the other: the loop has moved on by a few ms between them.
    assert np.std(apart) < 0.25 * np.std(logged.tau[: len(made), 0])
