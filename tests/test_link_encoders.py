"""Second encoders behind the transmissions: what they show of stiffness and play that MuJoCo hides there."""

import dataclasses
import re

import numpy as np
import pytest

from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.output.link_encoders import link_encoder_notes
from irb140_jax.mismatch.regression.sufficient_data import Comparison, comparison
from irb140_jax.recordings.conceal import ConcealedCase, Concealment, conceal
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import irb140, irb140_path


def recorded(*hidden: Concealment) -> ConcealedCase:
    return conceal(irb140_path(), hidden, three_motions(irb140(), 6.0, 1000.0, seed=1), seed=1, with_link_encoders=True)


def shown(case: ConcealedCase, **columns: np.ndarray) -> list[str]:
    """The notes where the torque carried is that of the nominal model, 5 % wrong."""
    changed = [dataclasses.replace(r, extras={k: columns.get(k.split(".")[1], 1.0) * x for k, x in r.extras.items()})
               for r in case.recordings]  # fmt: skip
    data: Comparison = comparison(irb140(), changed, 0.05, lambda _: None)
    phi, rest = np.asarray(irb140().phi), np.max([r.rest_speed for r in data.smooth], axis=0)
    return link_encoder_notes(data, CorrectedModel(irb140(), phi, phi, (), data.band, rest), [])


def numbers(note: str) -> list[float]:
    return [float(x) for x in re.findall(r"[\d.]+(?:e-\d+)?(?= \+-)", note)]


def test_the_stiffness_of_a_transmission_is_seen():
    case = recorded(Concealment("joint_elasticity", ("joint2",), 0.1))
    notes = shown(case)
    assert len(notes) == 6 and all("shows no bending, no play above" in n for n in (*notes[:1], *notes[2:]))
    true = case.truth["effects"][0]["parameters"]["stiffness"]["value"]
    assert "a stiffness of" in notes[1] and "play" not in notes[1]
    # Links that are 5 % too light carry less torque than bends the transmission.
    assert numbers(notes[1]) == [pytest.approx(true, rel=0.12)]


def test_play_is_seen_and_a_column_in_degrees_is_not_used():
    case = recorded(Concealment("backlash", ("joint2",), 0.3))
    notes = shown(case, joint3=np.degrees(1.0))
    assert "shows play of" in notes[1] and notes[1].endswith("torque alone names none of these.")
    assert numbers(notes[1]) == [pytest.approx(case.truth["effects"][0]["parameters"]["gap"]["value"], rel=0.06)]
    assert notes[2].startswith("q_link.joint3 is up to") and "check its unit" in notes[2]
