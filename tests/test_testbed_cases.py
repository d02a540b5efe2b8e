"""Cases of the testbed: the same for the same seed, of every kind, and true to what they state."""

import functools

import numpy as np
import pytest

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from testbed import cases, leaving_out, outside, probes, rubbing, runner, seeds
from testbed.arms import built, irb140, random_arm
from testbed.loggers import Logger, random_logger
from testbed.motions import programme
from testbed.plants import Plant, sizes_of


def test_a_case_is_a_function_of_its_draw_and_index():
    a, b = cases.make("work", 1), cases.make("work", 1)
    assert a.truth == b.truth and a.xml == b.xml
    for one, other in zip(a.recordings + a.held_out, b.recordings + b.held_out, strict=True):
        for name in one:
            np.testing.assert_array_equal(one[name], other[name])


def test_other_draws_and_other_commits_hide_other_things():
    seeds_of = (("work", ""), ("check", ""), ("final", "a1"), ("final", "b2"))
    drawn = [[cases.kinds_of(draw, i, commit) for i in range(50)] for draw, commit in seeds_of]
    assert all(a != b for k, a in enumerate(drawn) for b in drawn[:k])


def test_each_pass_of_the_mixture_holds_every_kind():
    first = [cases.kinds_of("check", i)[0] for i in range(len(cases.PASS))]
    assert sorted(first) == sorted(cases.PASS) and {*cases.NAMED, *cases.OTHER} <= set(first)


def test_what_lies_outside_is_drawn_alone_and_nowhere_else():
    drawn = [cases.kinds_of("work", i, mixture=cases.OUTSIDE) for i in range(len(cases.OUTSIDE))]
    assert sorted(drawn) == sorted((kind,) for kind in cases.OUTSIDE) and not {*cases.OUTSIDE} & {*cases.PASS}
    case = cases.make("work", 0, mixture=cases.OUTSIDE)
    assert case.hidden == drawn[0] and len([h for h in case.truth["hidden"] if h["role"] == "special"]) == 1


@pytest.mark.parametrize(("draw", "commit"), [("final", ""), ("work", "abc"), ("other", "")])
def test_a_draw_that_nobody_could_repeat_is_refused(draw, commit):
    with pytest.raises(ValueError, match="final|allowed"):
        seeds.generator(draw, 0, commit=commit)


def small_case(kind, seed=0, ordinary=True):
    """A kind hidden in an arm of three joints, two short recordings."""
    rng = np.random.default_rng(seed)
    nominal = random_arm(rng, 3)
    motions = programme(nominal, rng, "fourier", 5.0)
    plant, sizes = Plant(nominal, built(nominal, rng, 0.05)), sizes_of(nominal, motions)
    if kind:
        cases.put_in(kind, plant, sizes, rng)
    if ordinary:
        rubbing.rubbed(plant, sizes, rng)
    logger = random_logger(rng, nominal.slide, sizes.tau, rate=250.0)
    return cases.assembled("work", 0, (kind or "nothing",), plant, sizes, motions, motions[:1], logger, rng, {})


@functools.cache
def bare_case():
    """The same arm with nothing but ordinary friction."""
    return small_case(None)


@pytest.mark.parametrize("kind", list(cases.KINDS))
def test_every_kind_changes_the_log_and_states_its_truth_in_the_contracts_words(kind):
    case, bare = small_case(kind), bare_case()
    special = [h for h in case.truth["hidden"] if h["role"] != "ordinary"]
    assert special and all(np.all(np.isfinite(r[k])) for r in case.recordings for k in r)
    changed = any(
        not np.allclose(a[k][: len(b[k])], b[k][: len(a[k])]) for a, b in
        zip(case.recordings, bare.recordings, strict=True) for k in ("q", "tau_true")
    )  # fmt: skip
    assert changed
    for h in case.truth["hidden"]:
        assert {*h["accept"], *h["tolerate"]} <= set(CATALOGUE) and (h["slug"] in h["accept"] or h["slug"] is None)
        if h["slug"] and h["slug"] != "external_wrench":
            assert set(h["parameters"]) <= {p.name for p in CATALOGUE[h["slug"]].law.parameters}


def test_nothing_hidden_leaves_the_rigid_body():
    case = small_case(None, ordinary=False)
    assert case.truth["hidden"] == []


def test_ordinary_friction_stands_at_every_joint_but_where_another_law_does():
    hidden = small_case("stribeck_friction").truth["hidden"]
    at = [h["joints"][0] for h in hidden if h["slug"] in ("coulomb_friction", "stribeck_friction")]
    assert sorted(at) == ["j1", "j2", "j3"]


def test_friction_on_a_joint_whose_torque_is_scaled_states_no_level():
    hidden = small_case("two_constants").truth["hidden"]
    scaled = {h["joints"][0] for h in hidden if h["slug"] == "torque_gain"}
    for h in hidden:
        if h["role"] == "ordinary":
            assert bool(h["parameters"]) == (h["joints"][0] not in scaled)


def test_a_case_reaches_the_diagnosis_as_a_users_files_do_and_what_goes_wrong_is_a_result():
    case, seen = small_case(None), []

    def refuse(robot, recordings):
        seen.append((robot, recordings))
        raise InputError("too short")

    assert runner.judged(case, refuse)["refused"] == "too short"
    assert runner.judged(case, lambda robot, recordings: [][0])["failed"].startswith("IndexError")
    robot, recordings = seen[0]
    assert robot.joint_names == case.joint_names
    for read, made in zip(recordings, case.recordings, strict=True):
        np.testing.assert_allclose(read.tau, made["tau"])


def test_a_body_with_negative_mass_or_a_flat_inertia_is_impossible():
    assert runner.possible(np.array([2.0, 0.2, 0, 0, 0.1, 0, 0, 0.12, 0, 0.12]))
    assert not runner.possible(np.array([-0.1, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0.1]))
    assert not runner.possible(np.array([2.0, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0.5]))


@pytest.mark.parametrize("hide", [leaving_out.push, rubbing.warming, leaving_out.zero, leaving_out.skew,
                                  outside.eccentric_encoder])
def test_the_true_plant_leaves_the_torque_sensors_noise_where_positions_are_exact(hide, tmp_path):
    rng = np.random.default_rng(2)
    plant = Plant(irb140(), irb140())
    moves = programme(plant.arm, rng, "fourier", 6.0)
    sizes = sizes_of(plant.arm, moves)
    hide(plant, sizes, rng, 2, 0.1 * sizes.tau[2])
    rubbing.rubbed(plant, sizes, rng)
    exact = Logger(500.0, 0.0, True, np.full(6, 1e-12), 0.01 * sizes.tau, 1e-9 * sizes.tau)
    case = cases.assembled("work", 0, ("one",), plant, sizes, moves, moves[:1], exact, rng, {})
    robot, recordings, _ = runner.read_case(case, tmp_path)
    left = runner.left_by_the_truth(case, robot, recordings, 10.0)
    expected = 0.01 * np.sqrt(10.0 / 250.0)  # of each joint's torque: white noise below 10 Hz of 250 Hz
    # Dry friction turns within a hundredth of the usual speed, which smoothing blurs a little.
    np.testing.assert_allclose([left[name] for name in case.joint_names], expected * sizes.tau, rtol=0.3)


def test_noise_below_a_band_is_that_share_of_white_noise():
    t = np.arange(0.0, 60.0, 0.002)
    x = np.random.default_rng(0).normal(size=(len(t), 1))
    assert runner.low_passed(x, t, 25.0).std() == pytest.approx(np.sqrt(0.1), rel=0.1)  # no filter is a brick wall


def test_the_files_of_a_probe_can_be_given_more_than_once():
    assert len(probes.PROBES) >= 11
    five = probes.PROBES["five_times"][1]()
    assert len(five.recordings) == 15
    np.testing.assert_array_equal(five.recordings[12]["tau"], five.recordings[0]["tau"])
