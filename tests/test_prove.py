"""What counts as proof on unseen data, where some of the data are the only ones to tell of something."""

import dataclasses
import re

import numpy as np
import pytest
from helpers_recordings import motion, recording, robot

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.effects.left_over import LeftOver
from irb140_jax.mismatch.columns.along import all_prepared
from irb140_jax.mismatch.output.findings import findings
from irb140_jax.mismatch.output.open_effects import open_effects, open_notes
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.gram import JointGram
from irb140_jax.mismatch.regression.rows import with_candidates
from irb140_jax.mismatch.regression.sensor_noise import scatter_by_sensor
from irb140_jax.mismatch.result import Alternative
from irb140_jax.mismatch.selection.explain import _by_block, explain
from irb140_jax.mismatch.selection.explanation import Explanation, usual_in_its_place
from irb140_jax.mismatch.selection.selected import noise_left
from irb140_jax.mismatch.validation import held_out as proof_module
from irb140_jax.mismatch.validation.competitors import Axis
from irb140_jax.mismatch.validation.held_out import (
    folds,
    held_out,
    held_out_gains,
    recordings_of_blocks,
    refitted,
    unproved,
)
from irb140_jax.mismatch.validation.unexplained import Structure
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import Conditioned, condition
from irb140_jax.recordings.low_pass import Band

FRICTION = tuple(CATALOGUE[slug] for slug in ("coulomb_friction", "viscous_friction"))


def recorded(*sizes: float) -> tuple[list[Conditioned], Band, np.ndarray]:
    """Recordings in which the joints move by so much, their band, and what the sensors scatter by in it, shape (n,)."""
    logs, arm = [recording(seed=4 + k, size=size, noise=0.2) for k, size in enumerate(sizes)], robot()
    band = choose_band(logs, arm)
    smooth = [condition(log, band) for log in logs]
    return smooth, band, np.hypot(*scatter_by_sensor(arm, logs, smooth, band))


def explained(*sizes: float) -> Explanation:
    smooth, band, scatter = recorded(*sizes)
    return explain(robot(), smooth, band, FRICTION, 0.05, scatter)


@pytest.fixture(scope="module")
def alike() -> Explanation:
    return explained(0.9, 0.9, 0.9)


@pytest.fixture(scope="module")
def one_alone() -> Explanation:
    """The second and third hardly move, and so hardly tell of viscous friction."""
    return explained(0.9, 0.02, 0.02)


def test_recordings_that_tell_alike_are_left_out_whole(alike):
    assert [fold.sum() for fold in folds(alike)] == [5, 5, 5]


def test_a_recording_that_alone_holds_a_finding_is_left_out_block_by_block(one_alone):
    assert [fold.sum() for fold in folds(one_alone)] == [1, 1, 1, 1, 1, 5, 5]


def test_what_one_recording_alone_holds_is_proved_within_it(one_alone):
    viscous = [c.joints[0] for c in one_alone.members if c.slug == "viscous_friction"]
    assert viscous
    proof = held_out(one_alone, refitted(one_alone))
    # As good as on data that the fit saw; with that recording left out whole, the friction is a guess: 1.4 times it.
    assert np.all(proof.rmse(proof.named)[viscous] < 1.1 * one_alone.level[viscous])


def test_what_is_corrected_errs_by_the_sensors_where_the_laws_are_exact(alike):
    proof = held_out(alike, refitted(alike))
    # Noise of 0.2 N m behind the low-pass, and what five blocks leave open of the amplitudes.
    assert np.all(proof.rmse(proof.corrected) < 1.1 * alike.level)
    assert np.all(proof.rmse(proof.refit) > 1.5 * alike.level)


def test_a_finding_is_worth_on_unseen_data_what_is_lost_without_it(alike):
    gains = held_out_gains(alike)
    assert set(gains) == set(alike.chosen)
    assert all(0.0 < gain < 1.0 for gain in gains.values())


def test_a_findings_sentence_says_what_it_is_compared_with_on_unseen_data(alike):
    # The table of errors compares with inertials near those stated, so the same share of its errors would be wrong.
    for finding in findings(robot(), alike, {}):
        share, said = re.findall(r"adding it removes ([\d.]+) % of the squared error that (.*)", finding.certain)[0]
        assert float(share) == pytest.approx(100.0 * (finding.evidence.heldout_gain or 0.0), abs=0.5)
        assert said.startswith("inertial parameters of any size and the other findings leave on unseen data without it")


def test_an_interval_holds_as_much_of_what_no_effect_explains_as_is_left_of_it(alike):
    structure = Structure(1, 0.5, 0.01, "its own past", 0.3, 0.1, Axis("q", 1))
    before, after = (findings(robot(), alike, {}, rest) for rest in ((), (structure,)))
    torque = {m.joints: alike.data.stretches[0].of(alike.data.nuisances + m.columns, m.joints[0])
              for m in alike.members if m.slug == "coulomb_friction"}  # fmt: skip
    assert (1,) in torque
    for one, other in zip(before, after, strict=True):
        std, wider = (f.parameters[f.effect.split("_")[0]].std or 0.0 for f in (one, other))
        if one.effect == "coulomb_friction" and one.joints == (robot().joint_names[1],):
            unit = np.sqrt(np.mean(torque[(1,)] ** 2))  # a little below one: the low-pass rounds reversals off
            assert wider == pytest.approx(np.hypot(std, 0.3 / unit), rel=0.02)
        assert wider > std if one.joints == (robot().joint_names[1],) else wider == std


def test_what_is_neither_named_nor_improbable_is_told_with_the_motion_that_would_decide(alike):
    left = next(i for i, m in zip(alike.chosen, alike.members, strict=True) if m.slug == "viscous_friction")
    joint = robot().joint_names[alike.data.candidates[left].joints[0]]
    kept = alike.others(left)
    odds = lambda x: dataclasses.replace(  # noqa: E731
        alike, chosen=kept, averaged={frozenset(kept): 0.0, frozenset(alike.chosen): np.log(x)})  # fmt: skip
    named = [f for f in findings(robot(), alike, {}) if (f.effect, f.joints) != ("viscous_friction", (joint,))]
    assert not open_effects(odds(0.2), named) and not open_effects(odds(20.0), named)
    (one,) = open_effects(odds(1.0), named)
    assert (one.effect.slug, one.joints) == ("viscous_friction", (joint,)) and one.probability == pytest.approx(0.5)
    (note,) = open_notes([one])
    assert f"viscous friction on {joint} (probability 0.50)" in note and one.effect.needs in note
    rival = Alternative("viscous_friction", 0.5, "motion")
    assert not open_effects(odds(1.0), [dataclasses.replace(f, alternatives=(rival,)) for f in named])


def contradicted(ex: Explanation, index: int, recording: int) -> Explanation:
    """As if one recording's torque had gone the other way with a member, many times as much."""
    joints = []
    for g, place in zip(ex.by_block.joints, ex.by_block.places, strict=True):
        at, blocks = place[ex.by_block.columns[index]], g.blocks.copy()
        for k in at[at >= 0] + len(g.groups):
            blocks[recordings_of_blocks(ex) == recording, k, -1] *= -100.0
            blocks[recordings_of_blocks(ex) == recording, -1, k] *= -100.0
        joints.append(JointGram(g.index, blocks, g.groups, g.rows, g.repeats, g.misfit))
    return dataclasses.replace(ex, by_block=dataclasses.replace(ex.by_block, joints=tuple(joints)))


def with_rotors(*joints: int) -> Explanation:
    """What explains three motions of an arm of which some joints have rotors that its model lacks."""
    arm, logs = robot(), []
    for seed in (4, 5, 6):
        *_, qdd = motion(3, seed=seed)
        made = recording(seed=seed)
        logs.append(dataclasses.replace(made, tau=made.tau + 0.2 * qdd * np.isin(np.arange(3), joints)))
    band = choose_band(logs, arm)
    smooth = [condition(log, band) for log in logs]
    effects = (*FRICTION, CATALOGUE["rotor_inertia"])
    return explain(arm, smooth, band, effects, 0.05, np.hypot(*scatter_by_sensor(arm, logs, smooth, band)))


def test_a_rare_effect_that_other_motions_contradict_is_not_proved():
    ex = with_rotors(1)
    (rotor,) = [i for i, m in zip(ex.chosen, ex.members, strict=True) if m.slug == "rotor_inertia"]
    usual = next(i for i, m in zip(ex.chosen, ex.members, strict=True) if m.effect.prior.ordinary)
    assert unproved(ex) == []
    assert unproved(contradicted(ex, rotor, 0)) == [("rotor_inertia", (1,))]
    assert {slug for slug, _ in unproved(contradicted(ex, usual, 0))} <= {"rotor_inertia"}
    assert unproved(dataclasses.replace(contradicted(ex, rotor, 0), data=of_one_recording(ex))) == []


def test_all_that_motions_contradict_each_without_the_others_is_not_proved():
    ex = with_rotors(1, 2)
    one, other = [i for i, m in zip(ex.chosen, ex.members, strict=True) if m.slug == "rotor_inertia"]
    assert unproved(ex) == []
    both = contradicted(contradicted(ex, one, 1), other, 2)
    assert sorted(unproved(both)) == [("rotor_inertia", (1,)), ("rotor_inertia", (2,))]
    # As far off as they have to be with both rotors, inertials err less beside the first one than without it.
    assert unproved(contradicted(contradicted(ex, one, 0), other, 0)) == [("rotor_inertia", (2,))]
    # What they say nothing against stays.
    assert unproved(contradicted(ex, one, 1)) == [("rotor_inertia", (1,))]


def test_a_single_motion_speaks_against_what_makes_its_own_error_larger():
    arm, log = robot(pendulum=True), recording(seed=4, pendulum=True)
    logs = [dataclasses.replace(log, tau=log.tau + 3.0 * (log.q - 0.2))]
    band = choose_band(logs, arm)
    smooth = [condition(r, band) for r in logs]
    effects = (*FRICTION, CATALOGUE["gravity_spring"])
    ex = explain(arm, smooth, band, effects, 0.05, np.hypot(*scatter_by_sensor(arm, logs, smooth, band)))
    (spring,) = [i for i, m in zip(ex.chosen, ex.members, strict=True) if m.slug == "gravity_spring"]
    assert unproved(ex) == []
    assert unproved(contradicted(ex, spring, 0)) == [("gravity_spring", (0,))]


def test_friction_of_a_special_form_has_to_do_better_than_ordinary_friction_in_its_place():
    """Friction that is the same both ways, given two levels: on unseen motions one level does as well."""
    arm, logs = robot(), [recording(seed=seed) for seed in (4, 5, 6)]
    band = choose_band(logs, arm)
    smooth = [condition(log, band) for log in logs]
    effects = (*FRICTION, CATALOGUE["asymmetric_friction"])
    sensors = np.hypot(*scatter_by_sensor(arm, logs, smooth, band))
    ex = explain(arm, smooth, band, effects, 0.05, sensors)
    dry = next(i for i, m in zip(ex.chosen, ex.members, strict=True) if m.slug == "coulomb_friction")
    joints = ex.data.candidates[dry].joints
    other = next(i for i, c in enumerate(ex.data.candidates) if c.slug == "asymmetric_friction" and c.joints == joints)
    assert usual_in_its_place(ex.data.candidates, (other,), other)[0] == dry
    given = dataclasses.replace(ex, chosen=tuple(sorted(set(ex.chosen) - {dry} | {other})))
    members = [ex.data.candidates[i] for i in (*given.chosen, dry)]
    along = all_prepared(arm, smooth)
    rows = [with_candidates(s, members, r, band, None, None) for s, r in zip(ex.data.stretches, along, strict=True)]
    given = _by_block(dataclasses.replace(given, data=dataclasses.replace(ex.data, stretches=rows)), sensors)
    assert unproved(given) == [("asymmetric_friction", joints)]


def test_a_finding_is_judged_beside_inertials_that_may_be_as_far_off_without_it(alike, monkeypatch):
    asked = []
    real = proof_module._unseen_errors
    monkeypatch.setattr(proof_module, "_unseen_errors", lambda *a: (asked.append((a[1], a[3])), real(*a))[1])
    held_out_gains(alike)
    for i in alike.chosen:
        fewer = alike.others(i)
        width = alike.space.width(fewer, alike.hyper)
        assert {(alike.chosen, width), (fewer, width)} <= set(asked)


def of_one_recording(ex: Explanation) -> Data:
    """The data as if all of them were one recording: then no other motion contradicts anything."""
    return dataclasses.replace(ex.data, stretches=[dataclasses.replace(s, recording=0) for s in ex.data.stretches])


def test_the_discrepancy_is_carried_only_where_unseen_data_are_better_for_it(alike):
    proof = held_out(alike, refitted(alike))
    for named, corrected in zip(proof.named, proof.corrected, strict=True):
        np.testing.assert_array_equal(named[:, ~proof.carried], corrected[:, ~proof.carried])
    better = proof.rmse(proof.corrected) < proof.rmse(proof.named)
    np.testing.assert_array_equal(better, proof.carried)


def test_the_noise_that_a_set_leaves_is_what_the_true_laws_leave(alike):
    left = noise_left(alike.data, alike.extra, alike.space, alike.chosen, alike.hyper)
    smooth, band, _ = recorded(0.9, 0.9, 0.9)
    # Noise of torque and encoders, and the reversals that those hide from a band of 4 Hz.
    both = zip(alike.data.stretches, smooth, strict=True)
    beside = [np.where(s.use, s.y - band.apply(0.3 * (r.direction + 0.3 * r.qd)), np.nan) for s, r in both]
    true = np.nanstd(np.concatenate(beside), axis=0)
    np.testing.assert_allclose(np.sqrt(np.mean(left.total**2, axis=0)), true, rtol=0.25)


def test_sums_over_windows_gain_what_the_windows_themselves_gain():
    rng = np.random.default_rng(0)
    rows, n, known = 200, 3, 20
    left = LeftOver(
        np.repeat([0, 1], rows // 2), np.tile(np.arange(rows // 2) * 0.1, 2), rng.normal(size=(rows, n)),
        rng.normal(size=(rows, 3)), rng.normal(size=(rows, n, 3)), rng.uniform(1.0, 2.0, (rows, n)),
        rng.normal(size=(rows, n)), rng.normal(size=(rows, n, known)),
    )  # fmt: skip
    mine, columns = left.recording == 1, rng.normal(size=(rows // 2, n, 3))
    first, last = np.array([0, 10, 50]), np.array([30, 90, 100])
    inside = (np.arange(rows // 2) >= first[:, None]) & (np.arange(rows // 2) < last[:, None])
    windows = np.where(inside[..., None, None], columns, 0.0)
    np.testing.assert_allclose(
        left.gains_within(columns, first, last, mine), left.gains(windows, mine)[0], rtol=1e-9
    )
