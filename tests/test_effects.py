"""What every effect of the catalogue must keep: its formula, its units, its bounds, and the laws of physics."""

import dataclasses
import re
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers_effects import KINDS, RESTING, SCALES, a_shape, every_effect, motion, rigid_body, robot, some_values
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import dynamics, effects
from irb140_jax.effects import At, Motion, Place, Prior, Scales
from irb140_jax.effects.catalogue import CATALOGUE, _found
from irb140_jax.errors import InputError
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel, predict
from irb140_jax.recordings.concealed.catalogue import HIDDEN
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import robot_from_model

# The contract's vocabulary, with the parameters that a finding must give.
VOCABULARY = {
    "coulomb_friction": {"coulomb"},
    "viscous_friction": {"viscous"},
    "asymmetric_friction": {"coulomb_pos", "coulomb_neg"},
    "stribeck_friction": {"coulomb", "static", "stribeck_velocity"},
    "nonlinear_viscous_friction": {"coefficient", "exponent"},
    "load_dependent_friction": {"load_coefficient", "coulomb"},
    "thermal_friction_drift": {"viscous_cold", "relative_drop", "time_constant"},
    "presliding_hysteresis": {"coulomb", "stiffness"},
    "position_dependent_friction": {"coulomb", "depth", "centre", "width"},
    "rotor_inertia": {"inertia"},
    "torque_gain": {"gain"},
    "torque_offset": {"offset"},
    "torque_ripple": {"amplitude", "cycles_per_rad"},
    "actuator_lag": {"time_constant"},
    "time_delay": {"delay"},
    "joint_elasticity": {"stiffness"},
    "backlash": {"gap"},
    "transmission_coupling": {"viscous"},
    "gravity_spring": {"stiffness", "rest"},
    "gravity_tilt": {"tilt"},
    "payload": {"mass"},
    "encoder_offset": {"offset"},
    "contact": {"stiffness"},
    "external_wrench": {"t0", "t1"},
    "channel_skew": {"delay"},
    "torque_saturation": {"limit"},
    "servo_deadband": {"width"},
    "back_emf": {"stall_torque", "no_load_speed"},
}

every_dissipative_effect = pytest.mark.parametrize(
    "effect", [e for e in CATALOGUE.values() if e.prior.dissipative], ids=lambda e: e.slug
)


def admissible(effect):
    """Physical parameters within their bounds; those bounded by zero stay above 0.001, as a law of none is none."""
    return st.fixed_dictionaries({
        p.name: st.floats(max(p.low, -100.0), min(p.high, 100.0)).filter(lambda x: abs(x) > 1e-3)
        for p in effect.law.parameters
    })  # fmt: skip


def test_the_catalogue_holds_the_effects_of_the_vocabulary_and_no_other():
    assert set(CATALOGUE) == set(VOCABULARY)


@every_effect
def test_words_that_a_report_needs_are_there(effect):
    assert all(len(text) > 2 for text in (effect.title, effect.law.equation, effect.law.source, effect.needs))
    assert re.search(r"1[789]\d\d|20\d\d", effect.law.source), "a source has a year"
    assert not effect.needs.endswith(".")  # sentences are made around it


@every_effect
def test_parameters_are_those_of_the_contract(effect):
    assert VOCABULARY[effect.slug] <= {p.name for p in effect.law.parameters}


@every_effect
def test_units_are_rendered_for_hinges_and_for_slides(effect):
    for p in effect.law.parameters:
        hinge, slide = p.unit_of(False), p.unit_of(True)
        assert not re.search(r"[{}]", hinge + slide)
        if p.unit != "rad" and not p.name.startswith("moment"):  # an angle of the base, a moment about the tool
            assert "rad" not in slide and "N m" not in slide
        if effect.slug not in ("contact", "external_wrench"):  # forces on the tool are forces, whatever the joints
            assert not re.search(r"\bN\b(?! m)|/m\b", hinge)


@every_effect
def test_units_are_those_of_the_physics_that_mujoco_hides(effect):
    for p in effect.law.parameters:
        if effect.slug in HIDDEN and p.name in HIDDEN[effect.slug].units:
            assert p.unit == HIDDEN[effect.slug].units[p.name]


@every_effect
def test_bounds_are_ordered(effect):
    assert all(p.low < p.high for p in effect.law.parameters)
    for joints in effect.place.sites(robot()):
        lowest, highest = effect.bounds(robot(), joints)
        usual = 1.0 if effect.slug in TWICE else 0.0  # where its shape says how large it is
        assert (lowest < highest).all() and (lowest <= usual).all() and (highest >= usual).all()


@every_effect
def test_columns_bounds_and_variants_are_of_one_length(effect):
    joints, shape = a_shape(effect)
    columns = effect.law.columns(motion(), joints, shape)
    rows = len(KINDS) if effect.place.everywhere else len(joints)
    assert columns.shape == (60, rows, effect.law.width)
    lowest, highest = effect.bounds(robot(), np.asarray(joints))
    assert len(lowest) == len(highest) == columns.shape[-1]
    assert effect.law.physical(jnp.ones(columns.shape[-1]), shape).shape == (len(effect.law.parameters),)


@pytest.mark.parametrize(
    ("slug", "records", "said"),
    [
        ("stribeck_friction", {"prior": Prior(lowest=(0.0,))}, "each of the law's 2 columns"),
        ("payload", {"prior": Prior(proportion=(1.0,))}, "proportion"),
        ("actuator_lag", {"place": Place(At.DRIVE)}, "`to_log`"),
        ("coulomb_friction", {"place": Place(At.LOG_SCALE)}, "`to_log`"),
        ("time_delay", {"prior": Prior()}, "`at_shape`"),
        ("backlash", {"shapes": dataclasses.replace(CATALOGUE["backlash"].shapes, around=None)}, "`around`"),
        ("actuator_lag", {"export": dataclasses.replace(CATALOGUE["actuator_lag"].export, memory=None)}, "`memory`"),
    ],
)
def test_records_that_do_not_go_together_are_refused_by_name(slug, records, said):
    with pytest.raises(InputError, match=slug) as error:
        dataclasses.replace(CATALOGUE[slug], **records)
    assert said in str(error.value)


@every_effect
def test_sites_are_different_groups_of_joints_of_the_robot(effect):
    sites = [tuple(s) for s in effect.place.sites(robot()).tolist()]
    assert sites and len(set(sites)) == len(sites)
    assert all(0 <= j < len(KINDS) for s in sites for j in s)
    if not effect.place.everywhere:
        assert all(len({KINDS[j] for j in s}) == 1 for s in sites)  # one unit serves all joints of a site


@every_effect
def test_shape_grids_are_equally_long_at_every_site_and_without_repetition(effect):
    grids = [effect.shapes.grid(SCALES, joints) for joints in effect.place.sites(robot())]
    assert len({g.shape for g in grids}) == 1
    assert all(np.isfinite(g).all() and len(np.unique(g, axis=0)) == len(g) for g in grids)


@every_effect
def test_shape_grids_stand_for_a_joint_that_never_moves(effect):
    none = np.zeros(len(KINDS))
    still = Scales(none, np.full(len(KINDS), 1e-6), np.full(len(KINDS), 1e-12), none, none, 0.0,
                   np.full(len(KINDS), 1e-12), none)
    for joints in effect.place.sites(robot()):
        columns = jax.vmap(effect.law.columns, (None, None, 0))
        assert np.isfinite(columns(motion(), jnp.asarray(joints), jnp.asarray(effect.shapes.grid(still, joints)))).all()


@every_effect
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_physical_parameters_are_recovered_from_their_amplitudes(effect, data):
    values = data.draw(admissible(effect))
    w, shape = effect.law.amplitudes(values)
    again = effect.law.physical(jnp.asarray(w), jnp.asarray(shape))
    if effect.slug == "torque_ripple" or "stiffness" in values or "depth" in values or "relative_drop" in values:
        # Quotients: relative to their size.
        np.testing.assert_allclose(again, [values[p.name] for p in effect.law.parameters], rtol=1e-9, atol=1e-9)
        return
    # Sums and differences of numbers up to 100, nothing else: rounding.
    np.testing.assert_allclose(again, [values[p.name] for p in effect.law.parameters], rtol=1e-12, atol=1e-12)


# The parameters of the others are sizes: directions and phases are told beside them.
# Evaluated where their amplitude says, their shape is their amplitude once more.
SIZES = {"torque_ripple", "gravity_tilt", "payload"}
TWICE = {"joint_elasticity", "backlash", "time_delay", "channel_skew"}
TWICE |= {"torque_saturation", "servo_deadband", "back_emf"}
INVERTIBLE = [e for s, e in CATALOGUE.items() if s not in SIZES | TWICE]


@pytest.mark.parametrize("effect", INVERTIBLE, ids=lambda e: e.slug)
@given(seed=st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_amplitudes_are_recovered_from_their_physical_parameters(effect, seed):
    rng, (joints, shape) = np.random.default_rng(seed), a_shape(effect)
    low, high = effect.bounds(robot(), np.asarray(joints))
    w = rng.uniform(np.maximum(low, -5.0), np.minimum(high, 5.0))
    values = dict(zip([p.name for p in effect.law.parameters], effect.law.physical(jnp.asarray(w), shape), strict=True))
    if effect.slug == "transmission_coupling":
        values["sign"] = shape[0]  # no parameter of the vocabulary: it must be told beside them
    again, shape_again = effect.law.amplitudes(values)
    np.testing.assert_allclose(again, w, atol=1e-12)
    np.testing.assert_allclose(shape_again, shape, atol=1e-12)


@every_effect
def test_an_effect_that_names_no_history_looks_at_the_present_only(effect):
    joints, shape = a_shape(effect)
    m = motion()
    # Two rows, because a time step is the difference of two times; the first of them counts.
    rows = lambda k: jax.tree.map(lambda x: x[k : k + 2] if x.ndim and len(x) == 60 else x, m)  # noqa: E731
    whole = effect.law.columns(m, joints, shape)
    alone = jnp.concatenate([effect.law.columns(rows(k), joints, shape)[:1] for k in (0, 7, 50)])
    assert np.isfinite(alone).all()
    same = np.allclose(alone, whole[jnp.array([0, 7, 50])], rtol=1e-12, atol=1e-12)
    by_rates = effect.slug in ("actuator_lag", "time_delay", "channel_skew")  # a motion gives those beside the load
    assert same == (effect.export.history is None or by_rates)


@every_effect
def test_zero_strength_is_no_torque(effect):
    joints, shape = a_shape(effect)
    columns = effect.law.columns(motion(), joints, shape)
    assert (columns @ jnp.zeros(columns.shape[-1]) == 0.0).all()


@every_effect
def test_every_parameter_moves_the_torque(effect):
    joints, _ = a_shape(effect)
    torque = lambda v: np.asarray(effect.law.columns(motion(), joints, jnp.asarray(v[1])) @ v[0])  # noqa: E731
    values = some_values(effect)
    before = torque(effect.law.amplitudes(values))
    for name in values:
        after = torque(effect.law.amplitudes(values | {name: 1.1 * values[name]}))
        assert np.linalg.norm(after - before) > 1e-3 * np.linalg.norm(before), name


@every_effect
@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_derivatives_by_motion_and_shape_are_finite_also_at_rest(effect, speed):
    joints, shape = a_shape(effect)
    m = motion(rest_speed=1e-3)
    still = (speed * m.qd, speed * m.qdd, speed * m.load, speed * m.direction)
    m = eqx.tree_at(lambda x: (x.qd, x.qdd, x.load, x.direction), m, still)
    weights = np.random.default_rng(1).normal(size=effect.law.columns(m, joints, shape).shape)
    slopes = jax.grad(lambda x: jnp.sum(weights * effect.law.columns(x[0], joints, x[1])))((m, shape))
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))


def test_friction_and_nothing_else_is_said_to_be_dissipative():
    friction = {slug for slug in CATALOGUE if slug.endswith("friction")}
    friction |= {"transmission_coupling", "thermal_friction_drift"}
    assert {slug for slug, effect in CATALOGUE.items() if effect.prior.dissipative} == friction
    # Bristles give back what they stored.
    rubs = {slug for slug, effect in CATALOGUE.items() if effect.place.is_friction}
    assert rubs == friction | {"presliding_hysteresis"}


@every_dissipative_effect
@given(data=st.data(), seed=st.integers(0, 10**6))
@settings(max_examples=20, deadline=None)
def test_dissipative_effects_never_give_energy_to_the_arm(effect, data, seed):
    joints, grid_shape = a_shape(effect)
    w, shape = effect.law.amplitudes(data.draw(admissible(effect)))
    shape = grid_shape if effect.slug == "transmission_coupling" else jnp.asarray(shape)
    m = motion(seed, rest_speed=1e-2)
    power = jnp.sum(effect.law.columns(m, joints, shape) @ w * m.qd[:, joints], axis=1)
    # Rounding of a difference of 100s.
    assert (power >= -1e-12).all()


@every_dissipative_effect
def test_the_smallest_admissible_friction_leaves_none_below_zero_in_the_model(effect):
    m, arm = motion(), robot()
    own = arm.damping * m.qd + arm.frictionloss * jnp.sign(m.qd)
    for site, joints in enumerate(effect.place.sites(arm)):
        _, shape = a_shape(effect, site)
        lowest, _ = effect.bounds(arm, joints)
        taken = effect.law.columns(m, jnp.asarray(joints), shape) @ np.where(np.isfinite(lowest), lowest, 0.0)
        # Rounding: what is taken off may be exactly what was there.
        assert (jnp.sum((own[:, joints] + taken) * m.qd[:, joints], axis=1) >= -1e-12).all()


def test_the_smallest_admissible_rotor_takes_off_the_rotor_of_the_model():
    rotor, m, arm = CATALOGUE["rotor_inertia"], motion(), robot()
    for j in range(arm.n):
        taken = rotor.law.columns(m, jnp.array([j]), jnp.zeros(0)) @ rotor.bounds(arm, np.array([j]))[0]
        np.testing.assert_allclose(taken[:, 0], -arm.armature[j] * m.qdd[:, j], rtol=1e-12)


@every_effect
def test_compiled_columns_are_those_of_the_plain_function(effect):
    joints, shape = a_shape(effect)
    columns = effect.law.columns
    plain = columns(motion(), joints, shape)
    # Compilers may fuse and reorder: a few roundings.
    np.testing.assert_allclose(eqx.filter_jit(columns)(motion(), joints, shape), plain, rtol=1e-13, atol=1e-15)


# The others hold their special case at one shape or in a limit only, and may stand beside it.
AT_ANY_SHAPE = [e for e in CATALOGUE.values() if e.law.contains and e.law.absorbs and e.slug not in TWICE]


@pytest.mark.parametrize("effect", AT_ANY_SHAPE, ids=lambda e: e.slug)
def test_a_law_can_be_every_special_case_that_it_contains(effect):
    joints, shape = a_shape(effect)
    columns = np.asarray(effect.law.columns(motion(), joints, shape)).reshape(-1, effect.law.width)
    for slug in effect.law.contains:
        special = CATALOGUE[slug].law.columns(motion(), joints, a_shape(CATALOGUE[slug])[1])
        special = np.asarray(special).reshape(len(columns), -1)
        w = np.linalg.lstsq(columns, special, rcond=None)[0]
        np.testing.assert_allclose(columns @ w, special, atol=1e-12)


@every_effect
def test_look_alikes_have_names_of_the_vocabulary_and_a_motion_that_separates_them(effect):
    assert effect.slug not in effect.confused_with
    assert set(effect.confused_with) <= set(VOCABULARY)
    assert all(len(m) > 10 and not m.endswith(".") for m in effect.confused_with.values())


@every_effect
@pytest.mark.parametrize("is_slide", [False, True])
def test_where_an_effect_acts_is_one_sentence_with_numbers_and_units(effect, is_slide):
    units = {p.name: p.unit_of(is_slide) for p in effect.law.parameters}
    said = effect.sentence("joint7", some_values(effect), units)
    assert "joint7" in said and re.search(r"\d", said) and not re.search(r"[{}\n]", said)


ATTRIBUTES = [e for e in CATALOGUE.values() if e.export.mjcf and len(e.export.mjcf.split()) == 2]


@pytest.mark.parametrize("effect", ATTRIBUTES, ids=lambda e: e.slug)
def test_what_mjcf_expresses_is_the_same_in_the_model_as_beside_it(effect):
    element, attribute = effect.export.mjcf.split()
    assert element == "joint"
    arms = [
        robot_from_model(mujoco.MjModel.from_xml_string(
            '<mujoco><worldbody><body><inertial pos="0.1 0.2 0.3" mass="2" diaginertia="0.1 0.2 0.25"/>'
            f'<joint name="a" axis="0 1 0" stiffness="0.1" {extra}/></body></worldbody></mujoco>'))
        for extra in ("", f'{attribute}="0.7"')
    ]  # fmt: skip
    rng = np.random.default_rng(2)
    q, qd, qdd = rng.normal(size=(3, 5, 1))
    tau = [np.stack([dynamics.inverse_dynamics(arm, *x) for x in zip(q, qd, qdd, strict=True)]) for arm in arms]
    arrays = [jnp.asarray(x) for x in (q, qd, qdd, q, q, q, q)]
    near_rest = {"rest_speed": jnp.full(1, RESTING), "direction": jnp.sign(arrays[1])}
    m = Motion(jnp.arange(5.0), *arrays, rigid=rigid_body(rng, 5), **near_rest, recording=jnp.array(0.0))
    w, shape = effect.law.amplitudes({effect.law.parameters[0].name: 0.7})
    torque = effect.law.columns(m, jnp.arange(1), jnp.asarray(shape))[:, 0] @ w
    # Torques of some 10 N m: rounding.
    np.testing.assert_allclose((tau[1] - tau[0])[:, 0], torque, atol=1e-12)


def test_a_model_corrected_by_effects_of_zero_strength_predicts_the_nominal_torque_bit_for_bit():
    arm = robot()
    named = []
    for effect in CATALOGUE.values():
        joints, shape = a_shape(effect)
        width = effect.law.width
        named.append(Named(effect, tuple(joints.tolist()), tuple(range(width)), np.zeros(width), np.asarray(shape)))
    phi = np.asarray(arm.phi)
    band = Band(torque=10.0, position=16.0, rate=200.0, step=4)
    model = CorrectedModel(arm, phi, phi, tuple(named), band, np.full(arm.n, 1e-3))
    t = np.arange(0.0, 2.0, 0.005)
    q = np.sin(t[:, None] * np.arange(1.0, 5.0))
    out = predict(model, Recording(t, q, np.zeros_like(q), arm.joint_names))
    assert np.abs(out["nominal"]).max() > 1.0
    assert np.array_equal(out["corrected"], out["nominal"]) and np.array_equal(out["refit"], out["nominal"])


@pytest.mark.parametrize("true", [0.33, 0.36, 3.6])
def test_the_exponent_of_viscous_friction_may_lie_beyond_the_first_grid(true):
    shapes = CATALOGUE["nonlinear_viscous_friction"].shapes
    assert shapes.finer
    grid = shapes.grid(SCALES, np.array([0]))
    assert not grid.min() < true < grid.max()
    for _ in range(2):  # as often as a diagnosis refines
        grid = shapes.finer(grid, grid[np.argmin(np.abs(grid[:, 0] - true))])
    assert np.abs(grid[:, 0] - true).min() < 0.03 * true


@pytest.fixture
def another_file(tmp_path, monkeypatch):
    """Puts a file with this source into the folder of the effects, until the test is over."""
    def put(source: str) -> None:
        (tmp_path / "zz_another.py").write_text(source, encoding="utf-8")
        monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])

    yield put
    # Importing made it known to Python and to the package; the next test finds neither.
    sys.modules.pop("irb140_jax.effects.zz_another", None)
    if hasattr(effects, "zz_another"):
        delattr(effects, "zz_another")


def test_two_effects_of_one_slug_are_refused_by_name(another_file):
    another_file(
        "import dataclasses\n\nfrom irb140_jax.effects import coulomb_friction\n\n"
        "EFFECT = dataclasses.replace(coulomb_friction.EFFECT, title='another')\n"
    )
    with pytest.raises(TypeError, match="coulomb_friction.*zz_another"):
        _found()


def test_the_catalogue_skips_what_a_file_only_imports(another_file):
    another_file("from irb140_jax.effects.coulomb_friction import EFFECT as other\n")
    assert set(_found()) == set(CATALOGUE)
