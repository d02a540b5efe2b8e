"""An effect is one file: put the skeleton of the docs into the folder, and a diagnosis names it."""

import dataclasses
import functools
import importlib.util
import shutil
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import ROOT

from irb140_jax import effects
from irb140_jax.effects import Effect, Export, Law, Motion, Place, Prior, RigidBody, Shapes
from irb140_jax.effects.catalogue import CATALOGUE, _found
from irb140_jax.errors import InputError
from irb140_jax.mismatch import (
    DiagnoseConfig,
    Result,
    Undecided,
    diagnose,
    load_corrected,
    load_model,
    load_undecided,
    predict,
    propose,
    save,
)
from irb140_jax.mismatch.experiment_design.undecided import Pair, save_undecided
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.recordings.recording import Recording
from irb140_jax.report import html_report, proposal_sentences
from irb140_jax.robot import Robot, robot_from_model

DOCS = ROOT / "docs"
SKELETON = DOCS / "skeletons" / "effect.py"
RECORDS = (Effect, Law, Place, Prior, Shapes, Export)


@pytest.fixture
def extended(tmp_path, monkeypatch):
    """The catalogue as it is once the skeleton lies in the folder of the effects."""
    shutil.copy(SKELETON, tmp_path / "quadratic_drag.py")
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    yield _found()
    # Importing made it known to Python and to the package; the next test file finds neither.
    del sys.modules["irb140_jax.effects.quadratic_drag"]
    delattr(effects, "quadratic_drag")


def test_the_skeleton_enters_the_catalogue_by_lying_in_its_folder(extended):
    assert set(extended) - set(CATALOGUE) == {"quadratic_drag"}
    assert extended["quadratic_drag"].title == "quadratic drag"


def test_the_columns_of_the_skeleton_are_its_formula(extended):
    qd = np.random.default_rng(0).normal(size=(50, 3))
    q, none = jnp.zeros((50, 3)), jnp.zeros(0)
    rigid = RigidBody(*(none,) * 10)
    rest = jnp.full(3, 1e-3)
    direction = jnp.tanh(jnp.asarray(qd) / rest)
    torques = (q, q, q, q)
    near_rest = (rest, direction)
    motion = Motion(jnp.arange(50.0), q, jnp.asarray(qd), q, *torques, rigid, *near_rest, jnp.array(0.0))
    law = extended["quadratic_drag"].law
    w, shape = law.amplitudes({"drag": 1.7})
    torque = law.columns(motion, jnp.array([1]), jnp.asarray(shape)) @ w
    np.testing.assert_allclose(torque[:, 0], 1.7 * qd[:, 1] * np.abs(qd[:, 1]), rtol=1e-12)


@functools.cache
def drag() -> Effect:
    """The effect of the skeleton, as an object that no catalogue holds."""
    spec = importlib.util.spec_from_file_location("quadratic_drag_object", SKELETON)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.EFFECT


@functools.cache
def hidden() -> tuple[Robot, Recording, Result]:
    """Drag that MuJoCo hid, diagnosed by a library that holds the object."""
    xml = random_robot(6, 2, slides=0.0)
    robot = robot_from_model(arm_spec(xml).compile(), "random")
    law = {"coefficient": 0.6, "exponent": 2.0}
    hidden = Concealment("nonlinear_viscous_friction", ("joint1",), parameters=law)
    case = conceal(xml, [hidden], three_motions(robot, 10.0, 500.0, seed=6), seed=6)
    config = DiagnoseConfig(effects=(*CATALOGUE.values(), drag()))
    return robot, case.recordings[0], diagnose(robot, case.recordings, config)


def test_a_diagnosis_names_an_effect_given_as_an_object_where_mujoco_hid_it():
    result = hidden()[-1].diagnosis.to_json()
    assert [(f["effect"], f["joints"]) for f in result["findings"]] == [("quadratic_drag", ["joint1"])]
    found = result["findings"][0]["parameters"]["drag"]
    assert found["value"] == pytest.approx(0.6, abs=max(0.06, 4.0 * found["std"]))
    assert found["unit"] == "N m (s/rad)^2"
    assert "square of speed" in result["findings"][0]["where"]
    assert "Quadratic drag on joint1." in result["summary"]
    assert result["provenance"]["options"]["effects"][-1] == "quadratic_drag"


def test_what_an_object_left_behind_is_loaded_with_it_and_refused_without(tmp_path):
    robot, recording, result = hidden()
    save(result, tmp_path)
    for load in (load_model, load_undecided, load_corrected):
        with pytest.raises(InputError, match=r"no effect 'quadratic_drag'.*effects="):
            load(tmp_path)
    again = load_model(tmp_path, effects=[drag()])
    assert [named.effect for named in again.named] == [drag()]
    one, other = predict(result.model, recording), predict(again, recording)
    # Written with all digits of a double.
    np.testing.assert_allclose(one["corrected"], other["corrected"], rtol=1e-12)
    rest = jnp.zeros(robot.n)
    corrected = load_corrected(tmp_path, effects=[drag()])
    faster = corrected.inverse_dynamics(rest, rest + 2.0, rest) - corrected.without("quadratic_drag").inverse_dynamics(
        rest, rest + 2.0, rest)  # fmt: skip
    # Both torques are some 10 N m: rounding.
    np.testing.assert_allclose(faster, [4.0 * again.named[0].amplitudes[0], 0.0], atol=1e-12)


def test_a_report_shows_an_effect_given_as_an_object():
    result = hidden()[-1]
    page = html_report(result.diagnosis, result.views)
    assert "quadratic drag" in page.lower() and "with the square of speed" in page


def test_a_motion_is_designed_where_an_object_is_in_doubt(tmp_path):
    robot, _, result = hidden()
    save_undecided(in_doubt(result.undecided), tmp_path)
    open_ = load_undecided(tmp_path, effects=[drag()])
    lines = proposal_sentences(robot, open_, propose(robot, open_, seed=0, duration=9.0, rate=100.0))
    assert any("quadratic drag or viscous friction" in line for line in lines)


def in_doubt(open_: Undecided) -> Undecided:
    """The same questions, and the drag called in doubt with viscous friction."""
    mine = next(k for k in open_.chosen if open_.columns[k].effect is drag())
    rival = next(k for k, c in enumerate(open_.columns) if c.slug == "viscous_friction" and c.joints == (0,))
    rest = tuple(k for k in open_.chosen if k != mine)
    pair = Pair((0,), "quadratic_drag", "viscous_friction", 0.5, rest, ((mine,),), ((rival,),))
    return dataclasses.replace(open_, pairs=(pair,))


def test_an_effect_that_is_not_one_or_comes_twice_is_refused():
    with pytest.raises(InputError, match="got 'coulomb_friction'"):
        DiagnoseConfig(effects=("coulomb_friction",))  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="quadratic_drag given twice"):
        DiagnoseConfig(effects=(drag(), drag()))


def test_the_walkthrough_names_files_and_names_that_exist():
    text = (DOCS / "adding-an-effect.md").read_text(encoding="utf-8")
    for path in ("skeletons/effect.py", "effects.md"):
        assert f"({path})" in text and (DOCS / path).exists()
    for path in ("tests/test_effects.py", "tests/test_recovery.py", "docs/make_effects_table.py"):
        assert path in text and (ROOT / path).exists()
    for name in (field.name for record in RECORDS for field in dataclasses.fields(record)):
        assert f"`{name}`" in text, name


def test_the_table_of_effects_is_up_to_date():
    script = DOCS / "make_effects_table.py"
    spec = importlib.util.spec_from_file_location("make_effects_table", script)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    # If this fails: python docs/make_effects_table.py
    assert module.PAGE.read_text(encoding="utf-8") == module.page()
