"""Long recordings are taken window by window: nothing depends on where the windows are."""

import dataclasses
from functools import partial

import jax
import numpy as np
import pytest
from test_tangent import BAND, FOUND, LOG, ROBOT, SMOOTH, N, found_model, settled

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns import along as columns
from irb140_jax.mismatch.columns.along import columns_along, columns_by_effect, prepared, scales_of
from irb140_jax.mismatch.columns.candidates import library
from irb140_jax.mismatch.diagnose import diagnose
from irb140_jax.mismatch.regression import rows
from irb140_jax.mismatch.regression.assemble import Data, assembled, judged, prior_scale, with_loose_inertials
from irb140_jax.mismatch.regression.joint_grams import grams_by_block, joint_grams
from irb140_jax.mismatch.regression.noise import ORDER, Noise
from irb140_jax.mismatch.regression.nuisances import nuisances
from irb140_jax.mismatch.regression.rows import bare_stretch, candidate_rows, stretch
from irb140_jax.mismatch.regression.sums import summed
from irb140_jax.mismatch.regression.tangent import point
from irb140_jax.mismatch.selection.space import space_of
from irb140_jax.recordings.condition import condition

ALONG = prepared(ROBOT, SMOOTH)
SCALES = scales_of([ALONG])
RINGING = ("joint_elasticity", "backlash")  # on after a window begins
LIB = library(ROBOT, [e for e in CATALOGUE.values() if e.slug not in RINGING], SCALES)
FACTOR = np.eye(10 * N)
SENSORS = np.full(N, 1e-3)


def in_short_windows(monkeypatch) -> None:
    """From now on windows are as short as they may be."""
    for name in ("NEW", "RUN_IN"):
        monkeypatch.setattr(rows, name, 0)


def test_columns_of_some_samples_are_those_of_all():
    whole = columns_along(LIB, ALONG)
    first = columns.RUN_IN + 200  # so that what comes before is not all that there is
    part = columns_along(LIB, ALONG, at=slice(first, first + 200))
    size = np.maximum(np.abs(whole).max(axis=0), 1e-12)
    np.testing.assert_allclose(part / size, whole[first:][:200] / size, atol=1e-6)


def test_samples_of_several_calls_are_those_of_one(monkeypatch):
    few = library(ROBOT, [CATALOGUE[slug] for slug in ("coulomb_friction", "time_delay")], SCALES)
    whole = columns_along(few, ALONG)
    monkeypatch.setattr(columns, "NEW", 300)
    monkeypatch.setattr(columns, "CHUNK", columns.RUN_IN + 300 + columns.RUN_OUT)
    entries, parts = zip(*columns_by_effect(few, ALONG, None, -1, slice(0, len(SMOOTH.t))), strict=True)
    assert [e.start for e in entries] == [0, entries[0].stop] and entries[1].stop == len(few.entries[0])
    np.testing.assert_allclose(np.concatenate(parts, axis=1), whole, atol=1e-9)


def test_a_recording_of_another_length_needs_no_new_program():
    few = library(ROBOT, [CATALOGUE[slug] for slug in ("coulomb_friction", "time_delay")], SCALES)
    built = list[str]()

    def noted(event: str, duration_secs: float, **kwargs: str | int) -> None:
        built.append(event)

    jax.monitoring.register_event_duration_secs_listener(noted)
    jax.jit(lambda x: x + 1.0)(np.zeros(7))
    assert "/compile/" in "".join(built)  # a program that is new is seen
    columns_along(few, prepared(ROBOT, SMOOTH))
    shorter = condition(dataclasses.replace(LOG, t=LOG.t[:-100], q=LOG.q[:-100], tau=LOG.tau[:-100]), BAND)
    assert len(shorter.t) < len(SMOOTH.t)
    built.clear()
    columns_along(few, prepared(ROBOT, shorter))
    assert not [event for event in built if "/compile/" in event]


def test_what_a_soft_spring_still_rings_by_is_small():
    springs = library(ROBOT, [CATALOGUE[slug] for slug in RINGING], SCALES)
    whole, first = columns_along(springs, ALONG), columns.RUN_IN + 200
    part = columns_along(springs, ALONG, at=slice(first, first + 200))
    size = np.maximum(np.abs(whole).max(axis=0), 1e-12)
    # exp(-2 pi 6 Hz 0.05 2.56 s) of what it began with: a hundredth.
    np.testing.assert_allclose(part / size, whole[first:][:200] / size, atol=0.02)


def test_what_is_not_kept_is_evaluated_again():
    anew = prepared(ROBOT, SMOOTH, kept=False)
    assert anew.Y is None and anew.rigid is None
    np.testing.assert_allclose(columns_along(LIB, anew), columns_along(LIB, ALONG), atol=1e-9)
    shift = np.random.default_rng(0).normal(size=(10 * N, 2))
    np.testing.assert_allclose(anew.torque_of(shift), ALONG.torque_of(shift), atol=1e-9)


@pytest.mark.parametrize("laws", [FOUND, ()], ids=["at a law of the log", "at nothing"])
def test_rows_are_the_same_in_windows_of_any_length(laws, monkeypatch):
    model = found_model(np.zeros(10 * N), [np.array(w) if laws else 0.0 * np.array(w) for _, _, w, _ in FOUND])
    lib, along, torques = settled(model)
    at = point(ROBOT, np.zeros(10 * N), model.named if laws else [])
    whole = stretch(lib, along, 0, BAND, FACTOR, torques.loads, at)
    in_short_windows(monkeypatch)
    short = stretch(lib, along, 0, BAND, FACTOR, torques.loads, at)
    for name in ("inertials", "amplitudes", "y", "rigid"):
        one, other = getattr(whole, name), getattr(short, name)
        np.testing.assert_allclose(other, one, atol=1e-6 * np.abs(one).max())


def the_grams(told: bool | np.ndarray = True):
    """Rows of the joints that are told of, and Gram matrices of all candidates."""
    noise = Noise(np.tile([1.0, -0.4, *np.zeros(ORDER - 1)], (N, 1)), np.ones((1, N)), np.ones((1, N)), np.ones(N))
    bare = judged([bare_stretch(LIB, ALONG, 0, BAND, FACTOR)])
    bare = [dataclasses.replace(s, use=s.use & told) for s in bare]
    extra = nuisances(ROBOT, [ALONG], [(ALONG.nominal, ALONG.nominal)], BAND, SCALES)
    sums = summed(LIB, bare, [partial(candidate_rows, LIB, ALONG, 0, BAND, None, None)], extra, noise)
    data = Data(bare, prior_scale(LIB, bare, 0.05, sums.power), with_loose_inertials(LIB), 10 * N)
    return data, extra, noise, joint_grams(sums, LIB, data, extra, noise, SENSORS)


def test_sums_over_windows_are_the_sums_over_all_rows(monkeypatch):
    *_, whole = the_grams()
    in_short_windows(monkeypatch)
    *_, short = the_grams()
    for one, other in zip(whole, short, strict=True):
        np.testing.assert_array_equal(one.index, other.index)
        assert one.rows == pytest.approx(other.rows)
        size = np.maximum(np.sqrt(np.diagonal(one.blocks[0])), 1e-30)  # some columns are nothing
        square = np.outer(size, size)
        np.testing.assert_allclose(other.blocks[0] / square, one.blocks[0] / square, atol=1e-6)


def test_nothing_is_in_a_set_of_which_no_row_tells():
    data, extra, _, joints = the_grams(np.arange(N) > 0)
    space = space_of(joints, data, extra[0].common.shape[-1], LIB, LIB)
    assert any(c.joints == (0,) and c.lowest[0] < 0.0 for c in data.candidates)  # of some, a part may be taken away
    for i, c in enumerate(data.candidates):
        untold = c.joints == (0,) and not (c.effect.place.everywhere or c.is_inertials)
        assert space.outside(np.array([i]), np.zeros((1, len(c.columns))))[0] or not untold
        assert c.joints != (1,) or not c.effect.prior.ordinary or np.isfinite(space.lowest[i, 0])


def test_blocks_of_the_columns_that_are_held_add_up_to_the_same():
    data, extra, noise, whole = the_grams()
    usual = [e for e in CATALOGUE.values() if e.prior.ordinary]
    small = library(ROBOT, usual, SCALES)
    held = assembled(small, [stretch(small, ALONG, 0, BAND, FACTOR)], 0.05)
    by_block = grams_by_block(held, extra, noise, SENSORS, np.arange(10 * N + small.size), 5)
    for one, other in zip(whole, by_block, strict=True):
        own, common = len(one.groups), extra[0].common.shape[-1]
        links = other.index[other.index < 10 * N]
        shared = np.concatenate([links, 10 * N + np.arange(common)])
        theirs = np.concatenate([np.arange(own), own + np.arange(len(shared))])
        places = np.concatenate([np.arange(own), own + np.searchsorted(one.index, shared)])
        sums = other.blocks.sum(axis=0)[np.ix_(theirs, theirs)]
        np.testing.assert_allclose(sums, one.blocks[0][np.ix_(places, places)], atol=1e-9 * np.abs(sums).max())
    assert data.nuisances == held.nuisances


def test_a_diagnosis_does_not_depend_on_what_is_kept(monkeypatch):
    tau = ALONG.nominal + 2.0 * SMOOTH.direction
    noisy = np.stack([np.interp(LOG.t, SMOOTH.t, x) for x in tau.T], axis=1)
    log = dataclasses.replace(LOG, tau=noisy + np.random.default_rng(1).normal(size=noisy.shape) * 0.02)
    whole = diagnose(ROBOT, [log]).diagnosis
    monkeypatch.setattr(columns, "KEPT", 0)
    in_short_windows(monkeypatch)
    long = diagnose(ROBOT, [log]).diagnosis
    names = [[(f.effect, f.joints) for f in found.findings] for found in (whole, long)]
    assert names[0] == names[1] and len(names[0]) == N
    for one, other in zip(whole.findings, long.findings, strict=True):
        for name, parameter in one.parameters.items():
            assert other.parameters[name].value == pytest.approx(parameter.value, rel=1e-3)
