"""A channel that is dead or frozen takes its joint out of the judgement, and changes nothing of the others'."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording
from irb140_jax.recordings.channels import with_lost_torque_marked
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


def test_a_log_that_is_not_made_of_numbers_is_refused():
    (one, *others) = recordings()
    q = one.q.copy()
    q[7, 2] = np.nan
    with pytest.raises(RecordingError, match=r"motion 0: q.wrist, sample 8"):
        diagnose(made.robot(), [dataclasses.replace(one, q=q), *others])
