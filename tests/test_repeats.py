"""A log given twice is one log, and a programme played again is no new motion."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording
from irb140_jax.recordings.repeats import same_motion, without_copies


def run(seed: int, noise: int, late: float = 0.0) -> Recording:
    """A programme with the sensors' noise of one run, begun a little late."""
    sound = made.recording(seed=seed, pendulum=True, speeds=False, rate=200.0, duration=10.0, noise=0.0)
    rng = np.random.default_rng(noise)
    q, tau = (
        np.stack([np.interp(sound.t - late, sound.t, x) for x in y.T], axis=1) + std * rng.normal(size=y.shape)
        for y, std in ((sound.q, 1e-5), (sound.tau, 0.05))
    )
    return dataclasses.replace(sound, q=q, tau=tau, source=f"motion {seed}, run {noise}")


@pytest.mark.parametrize(("other", "same"), [((0, 1, 0.0), True), ((0, 2, 0.1), True), ((1, 1, 0.0), False)])
def test_a_programme_is_recognised_by_its_motion(other, same):
    assert same_motion(run(0, 0), run(*other)) == same


def test_a_copy_under_another_name_is_left_out_and_said():
    one = run(0, 0)
    kept, notes = without_copies([one, run(1, 0), dataclasses.replace(one, source="copy")])
    assert [r.source for r in kept] == ["motion 0, run 0", "motion 1, run 0"]
    assert notes == ["copy holds the same log as motion 0, run 0 and was left out."]


@pytest.mark.parametrize(
    ("cut", "digits", "part"), [(slice(400, None), 8, True), (slice(300, 1500, 2), 6, True), (slice(None), 2, False)]
)
def test_a_part_of_a_log_that_was_written_again_is_left_out_and_said(cut, digits, part):
    one, other = run(0, 0), run(0, 1)
    rounded = {k: np.array([float(f"{x:.{digits}g}") for x in getattr(one, k)[cut].ravel()]).reshape(-1, 1)
               for k in ("q", "tau")}  # fmt: skip
    again = dataclasses.replace(one, t=one.t[cut] - one.t[cut][0], qd=None, source="again", **rounded)
    kept, notes = without_copies([again, one, other])
    assert [r.source for r in kept] == ["again"] * (not part) + ["motion 0, run 0", "motion 0, run 1"]
    assert notes == ["again holds a part of the log in motion 0, run 0 and was left out."] * part


def test_evidence_does_not_grow_by_repetition():
    robot = made.robot(pendulum=True)
    once = diagnose(robot, [run(0, 0), run(1, 0)]).diagnosis.to_json()
    files = [run(0, 0), run(1, 0), run(0, 0)]
    thrice = diagnose(robot, [run(seed, noise) for seed in (0, 1) for noise in range(3)]).diagnosis.to_json()
    assert "repeat one motion" in " ".join(thrice["notes"])
    assert diagnose(robot, files).diagnosis.to_json()["findings"] == once["findings"]
    assert [f["effect"] for f in thrice["findings"]] == [f["effect"] for f in once["findings"]]
    for a, b in zip(thrice["findings"], once["findings"], strict=True):
        assert a["evidence"]["log_odds"] == pytest.approx(b["evidence"]["log_odds"], rel=0.3)
        for name, p in a["parameters"].items():
            assert p["std"] > 0.5 * b["parameters"][name]["std"]
