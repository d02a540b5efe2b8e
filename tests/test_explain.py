"""How often the loop goes round: until the shape of what is found is as fine as it is known."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from helpers_recordings import motion, recording, robot

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import explain as loop
from irb140_jax.mismatch.explain import explain
from irb140_jax.mismatch.explanation import Explanation
from irb140_jax.mismatch.prove import lasting, transferring
from irb140_jax.recordings.condition import choose_band, conditioned
from irb140_jax.recordings.recording import Recording

FRICTION = tuple(CATALOGUE[slug] for slug in ("coulomb_friction", "position_dependent_friction"))
CENTRE, WIDTH = 0.137, 0.291  # rad


def rubbing(seed: int, height: float) -> Recording:
    """The shoulder of a quiet arm rubs by so much more [N m] in a stretch of its range."""
    smooth = recording(seed=seed, friction=0.0, noise=0.002, duration=16.0)
    _, q, qd, _ = motion(3, seed=seed, duration=16.0)
    tau = smooth.tau.copy()
    tau[:, 0] += height * (0.5 + np.exp(-(((q[:, 0] - CENTRE) / WIDTH) ** 2))) * np.sign(qd[:, 0])
    return dataclasses.replace(smooth, tau=tau)


@cache
def explained(height: float) -> tuple[Explanation, int]:
    """The explanation of two recordings, and after how many rounds."""
    logs, arm, told = [rubbing(4, height), rubbing(5, height)], robot(), []
    band = choose_band(logs, arm)
    ex = explain(arm, conditioned(logs, band), band, FRICTION, 0.05, told.append)
    return ex, sum("searching" in message for message in told)


def off(ex: Explanation) -> np.ndarray:
    """How far the stretch that was found is from where it is, as a share of its width, and its width off, too."""
    (found,) = [m.shape for m in ex.members if m.slug == "position_dependent_friction"]
    return np.abs(found - [CENTRE, WIDTH]) / WIDTH


def test_a_shape_that_is_known_well_is_made_finer_and_the_name_outlasts_its_law():
    ex, rounds = explained(6.0)
    assert rounds > loop.PASSES
    assert np.all(off(ex) < 0.001)
    assert [m.slug for m in lasting(transferring(ex)).members] == ["position_dependent_friction"]


def test_without_those_rounds_the_shape_would_be_further_off(monkeypatch):
    better, _ = explained(6.0)
    monkeypatch.setattr(loop, "MOST_PASSES", loop.PASSES)
    coarse, rounds = explained.__wrapped__(6.0)
    assert rounds == loop.PASSES
    assert off(coarse).max() > 5.0 * off(better).max()


@pytest.mark.parametrize("height", [0.0, 0.02])
def test_what_is_hardly_seen_takes_no_more_rounds(height):
    assert explained(height)[1] == loop.PASSES
