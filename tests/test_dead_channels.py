"""A channel that is dead or frozen takes its joint out of the judgement, and changes nothing of the others'."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording

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
    return named(diagnose(made.robot(), recordings()).diagnosis)


def test_findings_of_healthy_joints_are_those_of_living_channels(sound):
    def dead(tau):
        tau[:, 1] = 0.0

    diagnosis = diagnose(made.robot(), recordings(dead)).diagnosis
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

    diagnosis = diagnose(made.robot(), recordings(frozen)).diagnosis
    assert named(diagnosis).keys() == sound.keys()
    assert "tau.shoulder is frozen" in " ".join(diagnosis["notes"])


def test_a_log_that_is_not_made_of_numbers_is_refused():
    (one, *others) = recordings()
    q = one.q.copy()
    q[7, 2] = np.nan
    with pytest.raises(RecordingError, match=r"motion 0: q.wrist, sample 8"):
        diagnose(made.robot(), [dataclasses.replace(one, q=q), *others])
