"""An effect is one file: put the skeleton of the docs into the folder, and a diagnosis names it."""

import importlib.util
import pathlib
import shutil
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import ROOT

from irb140_jax import effects
from irb140_jax.effects import Motion, RigidBody
from irb140_jax.effects.catalogue import CATALOGUE, _found
from irb140_jax.mismatch import DiagnoseConfig, diagnose
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import robot_from_model

DOCS = ROOT / "docs"
SKELETON = DOCS / "skeletons" / "effect.py"


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
    law = extended["quadratic_drag"]
    w, shape = law.amplitudes({"drag": 1.7})
    torque = law.columns(motion, jnp.array([1]), jnp.asarray(shape)) @ w
    np.testing.assert_allclose(torque[:, 0], 1.7 * qd[:, 1] * np.abs(qd[:, 1]), rtol=1e-12)


def test_a_diagnosis_names_the_new_effect_where_mujoco_hid_it(extended, monkeypatch):
    # A new process would find it there; this one has its catalogue already.
    monkeypatch.setitem(CATALOGUE, "quadratic_drag", extended["quadratic_drag"])
    xml = random_robot(6, 2, slides=0.0)
    robot = robot_from_model(arm_spec(xml).compile(), "random")
    law = {"coefficient": 0.6, "exponent": 2.0}
    hidden = Concealment("nonlinear_viscous_friction", ("joint1",), parameters=law)
    case = conceal(xml, [hidden], three_motions(robot, 10.0, 500.0, seed=6), seed=6)
    result = diagnose(robot, case.recordings, DiagnoseConfig(effects=tuple(CATALOGUE.values()))).diagnosis.to_json()
    assert [(f["effect"], f["joints"]) for f in result["findings"]] == [("quadratic_drag", ["joint1"])]
    drag = result["findings"][0]["parameters"]["drag"]
    assert drag["value"] == pytest.approx(0.6, abs=max(0.06, 4.0 * drag["std"]))
    assert drag["unit"] == "N m (s/rad)^2"
    assert "square of speed" in result["findings"][0]["where"]


def test_the_walkthrough_names_files_and_names_that_exist():
    text = (DOCS / "adding-an-effect.md").read_text(encoding="utf-8")
    for path in ("skeletons/effect.py", "effects.md"):
        assert f"({path})" in text and (DOCS / path).exists()
    for path in ("tests/test_effects.py", "tests/test_recovery.py", "docs/make_effects_table.py"):
        assert path in text and (ROOT / path).exists()
    base = pathlib.Path(effects.__file__).with_name("base.py").read_text(encoding="utf-8")
    for name in "columns physical amplitudes variants contains dissipative lowest highest where shapes sites".split():
        assert f"`{name}" in text and name in base


def test_the_table_of_effects_is_up_to_date():
    script = DOCS / "make_effects_table.py"
    spec = importlib.util.spec_from_file_location("make_effects_table", script)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    # If this fails: python docs/make_effects_table.py
    assert module.PAGE.read_text(encoding="utf-8") == module.page()
