"""A channel that is dead or frozen takes its joint out of the judgement, and changes nothing of the others'."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording
from irb140_jax.recordings.lost_channels import with_lost_torque_marked
from irb140_jax.robot import load_robot

FRICTION = 0.3


def recordings(spoiled=lambda tau: None) -> list[Recording]:
    """Three motions of an arm with Coulomb and viscous friction on every joint, their torque spoiled."""
    out = []
    for seed in range(3):
        sound = made.recording(seed=seed, friction=FRICTION, speeds=False, duration=10.0, rate=200.0)
        tau = sound.tau.copy()
        spoiled(tau)
        out.append(dataclasses.replace(sound, tau=tau, source=f"motion {seed}"))
    return out


def named(diagnosis: dict) -> dict:
    return {(f["effect"], *f["joints"]): f["parameters"] for f in diagnosis["findings"]}


@pytest.fixture(scope="module")
def sound() -> dict:
    return named(diagnose(made.robot(), recordings()).diagnosis.to_json())


def test_findings_of_healthy_joints_are_those_of_living_channels(sound):
    def dead(tau):
        tau[:, 1] = 0.0

    diagnosis = diagnose(made.robot(), recordings(dead)).diagnosis.to_json()
    healthy = {key: value for key, value in sound.items() if "elbow" not in key}
    assert {key[0] for key in healthy} == {"coulomb_friction", "viscous_friction"} and len(healthy) == 4
    found = named(diagnosis)
    assert found.keys() == healthy.keys()
    for key, parameters in found.items():
        for name, p in parameters.items():
            before = healthy[key][name]
            assert abs(p["value"] - before["value"]) < 3.0 * np.hypot(p["std"], before["std"])
    assert set(diagnosis["fit"]["elbow"].values()) == {None}
    assert "elbow is not judged" in " ".join(diagnosis["notes"])
    assert all("elbow" not in u["joints"] for u in diagnosis["unexplained"])


def test_a_channel_that_freezes_halfway_still_names_what_it_held_before(sound):
    def frozen(tau):
        tau[len(tau) // 2 :, 0] = tau[len(tau) // 2, 0]

    diagnosis = diagnose(made.robot(), recordings(frozen)).diagnosis.to_json()
    # Of the shoulder half the rows are left, which are too few to tell viscous friction from other laws.
    assert sound.keys() - named(diagnosis).keys() <= {("viscous_friction", "shoulder")}
    assert named(diagnosis).keys() <= sound.keys()
    assert "tau.shoulder is frozen" in " ".join(diagnosis["notes"])


PENDULUM = """<mujoco><worldbody><body><joint name="hinge" axis="0 1 0"/>
<inertial pos="0 0 -.5" mass="2" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>"""


def swinging(tmp_path, value: float):
    """A pendulum that is driven for 5 s and then swings freely, its torque logged as some value from there on."""
    path = tmp_path / "pendulum.xml"
    path.write_text(PENDULUM)
    m_g_l, inertia, t = 2 * 9.81 * 0.5, 2 * 0.5**2 + 1e-3, np.arange(0.0, 10.0, 0.005)
    driven, w = t < 5.0, 2 * np.pi * 1.3
    q = 0.8 * np.sin(w * t)
    tau = np.where(driven, -inertia * w**2 * q + m_g_l * np.sin(q), value)
    start = (0.8 * np.sin(w * 5.0), 0.8 * w * np.cos(w * 5.0))
    fall = lambda _, x: (x[1], -m_g_l / inertia * np.sin(x[0]))  # noqa: E731
    free = solve_ivp(fall, (5.0, 10.0), start, t_eval=t[~driven], rtol=1e-9).y[0]
    q = np.concatenate([q[driven], free])
    return Recording(t=t, q=q[:, None], tau=tau[:, None], joint_names=("hinge",), source="swing"), load_robot(path)


def test_a_drive_that_is_switched_off_is_no_frozen_channel(tmp_path):
    recording, robot = swinging(tmp_path, 0.0)
    assert with_lost_torque_marked(recording, np.array([0.02]), robot).torque_lost is None


def test_a_channel_that_freezes_far_from_what_the_motion_needs_is_left_out(tmp_path):
    recording, robot = swinging(tmp_path, 15.0)
    lost = with_lost_torque_marked(recording, np.array([0.02]), robot).torque_lost
    assert lost is not None and lost[1100:, 0].all() and not lost[:900].any()


def positions(change, held=None) -> list[Recording]:
    """The three motions with their positions spoiled, or with a joint truly held and the torque that this needs."""
    out = []
    for seed, r in enumerate(recordings()):
        q, tau = r.q.copy(), r.tau
        if held is not None:
            t, q, qd, qdd = made.motion(3, seed=seed, duration=10.0, rate=200.0)
            q[:, held], qd[:, held], qdd[:, held] = 0.5, 0.0, 0.0
            tau = made.rigid_torque(made.model(), q, qd, qdd) + FRICTION * np.sign(qd)
            tau += 0.02 * np.random.default_rng(seed).normal(size=q.shape)
        change(q)
        out.append(dataclasses.replace(r, q=q, tau=tau))
    return out


def marked(r: Recording) -> tuple[np.ndarray, str]:
    found = with_lost_torque_marked(r, np.full(3, 0.02), made.robot())
    return np.zeros(r.q.shape, bool) if found.torque_lost is None else found.torque_lost, " ".join(found.notes)


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_dead_position_is_said_and_joints_that_depend_on_it_are_not_judged(noise):
    def dead(q):
        q[:, 0] = 0.5 + noise * np.random.default_rng(0).normal(size=len(q))

    # In the other motion gravity on the elbow happens to explain too much of the shoulder's torque to be sure.
    spoiled = positions(dead)[::2]
    lost, said = marked(spoiled[0])
    assert lost.all() and "q.shoulder stays at 0.5 in every row while tau.shoulder changes by" in said
    diagnosis = diagnose(made.robot(), spoiled).diagnosis.to_json()
    assert diagnosis["verdict"] == "undecided" and diagnosis["findings"] == []
    assert "Dead or frozen channels" in diagnosis["summary"]
    assert "shoulder is not judged: dead or frozen channels" in " ".join(diagnosis["notes"])
    assert "moves in only" not in " ".join(diagnosis["notes"])


def test_a_position_that_freezes_halfway_takes_its_rows_from_all_joints_that_depend_on_it(sound):
    def frozen(q):
        q[len(q) // 2 :, 0] = q[len(q) // 2, 0]

    spoiled = positions(frozen)
    lost, said = marked(spoiled[0])
    assert lost[1000:].all() and not lost[:900].any() and "q.shoulder is frozen at" in said and "from 5 s" in said
    diagnosis = named(diagnose(made.robot(), spoiled).diagnosis.to_json())
    assert diagnosis and diagnosis.keys() <= sound.keys()


@pytest.mark.parametrize("held", [0, 1, 2])
@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_joint_that_is_held_by_its_drive_or_its_brake_is_no_dead_position(held, noise):
    def encoder(q):
        q += noise * np.random.default_rng(0).normal(size=q.shape)

    (r, *_) = positions(encoder, held)
    braked = r.tau.copy()
    braked[:, held] = 1.5 + 0.02 * np.random.default_rng(1).normal(size=len(braked))
    for tau in (r.tau, braked):
        lost, said = marked(dataclasses.replace(r, tau=tau))
        assert not lost.any() and "may be dead" not in said


def test_a_joint_that_is_braked_halfway_is_no_frozen_position():
    t, q, qd, qdd = made.motion(3, duration=10.0, rate=200.0)
    slowed = np.clip((6.0 - t) / 2.0, 0.0, 1.0)  # from 4 s to 6 s the shoulder's motion fades out
    q[:, 0] *= slowed**3
    step = t[1] - t[0]
    qd[:, 0] = np.gradient(q[:, 0], step)
    qdd[:, 0] = np.gradient(qd[:, 0], step)
    tau = made.rigid_torque(made.model(), q, qd, qdd) + FRICTION * np.sign(qd)
    r = Recording(t=t, q=q, tau=tau, joint_names=("shoulder", "elbow", "wrist"))
    assert not np.ptp(q[1200:, 0]) and not marked(r)[0].any()


def test_friction_differs_between_recordings_of_no_joint_that_is_not_judged():
    def dead(tau):
        tau[:, 1] = 0.0

    notes = " ".join(diagnose(made.robot(), recordings(dead)).diagnosis.to_json()["notes"])
    assert "friction of elbow differs" not in notes and "elbow is not judged: it moves in only" not in notes


def test_a_log_that_is_not_made_of_numbers_is_refused():
    (one, *others) = recordings()
    q = one.q.copy()
    q[7, 2] = np.nan
    with pytest.raises(RecordingError, match=r"motion 0: q.wrist, sample 8"):
        diagnose(made.robot(), [dataclasses.replace(one, q=q), *others])
