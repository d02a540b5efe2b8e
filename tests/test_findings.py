"""What stays beside a name: rivals as good as it, within what imperfect laws of the set could feign."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers_problem import ROWS, WAVE, problem

from irb140_jax.mismatch.evidence import eliminated
from irb140_jax.mismatch.findings import _rivals

RNG = np.random.default_rng(5)
GRAVITY = RNG.normal(size=ROWS)  # what the inertials are free to absorb
LIKE = WAVE + 0.2 * RNG.normal(size=ROWS)  # a rival's torque, nearly that of the named law


@pytest.mark.parametrize("own, rival, open_", [(0.0, 0.0, False), (400.0, 0.0, False), (400.0, 400.0, True)])
def test_a_rival_is_as_good_where_the_laws_in_its_place_could_feign_the_difference(own, rival, open_):
    absorbed = ("payload", (0,), [1e4 * GRAVITY])  # as inertials are: always there
    named = ("torque_gain", (0,), [own * GRAVITY + 4.0 * WAVE])
    other = ("gravity_spring", (0,), [rival * GRAVITY + 4.0 * LIKE])
    there = problem([absorbed, named, other], (own * GRAVITY + 4.0 * WAVE)[None])
    H, _ = eliminated(there.H, np.array([0]))
    there = dataclasses.replace(there, H=H)
    ex: Any = SimpleNamespace(data=SimpleNamespace(candidates=there.candidates), problem=there, chosen=(1,))
    odds, stays = _rivals(ex, 1)
    gain, spring = (odds[slug, (0,)] for slug in ("torque_gain", "gravity_spring"))
    assert there.odds((), (1,)) - there.odds((), (2,)) > 5.0
    assert (gain - np.log(20.0) < spring < gain) == open_ and not stays
