"""The library's front door: what a person meets who writes `import irb140_jax as irb`."""

import pathlib
import shlex
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import irb140_jax as irb
from irb140_jax.errors import InputError
from irb140_jax.recordings import write_recording
from irb140_jax.recordings.conceal import Concealment, conceal

TWO_JOINTS = """<mujoco model="pendulum"><compiler angle="radian"/><worldbody>
<body pos="0 0 1"><joint name="shoulder" axis="0 1 0"/><inertial pos="0 0 -.3" mass="2" diaginertia=".03 .03 .01"/>
<body pos="0 0 -.5"><joint name="elbow" axis="0 1 0"/><inertial pos="0 0 -.2" mass="1" diaginertia=".01 .01 .004"/>
</body></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> pathlib.Path:
    path = tmp_path_factory.mktemp("robot") / "arm.xml"
    path.write_text(TWO_JOINTS)
    return path


@pytest.fixture(scope="module")
def recording(model) -> irb.Recording:
    """Dry friction is hidden in the elbow."""
    motion = irb.fourier_motion(irb.load_robot(model), duration=10.0, seed=2)
    return conceal(model, [Concealment("coulomb_friction", ("elbow",), share=0.3)], [motion], seed=1).recordings[0]


@pytest.fixture(scope="module")
def diagnosis(model, recording, tmp_path_factory) -> irb.Diagnosis:
    """From a file and a path, as most will begin."""
    path = write_recording(recording, tmp_path_factory.mktemp("log") / "run.csv")
    return irb.diagnose(path, model)


def test_what_is_hidden_is_found_from_a_path(diagnosis):
    assert diagnosis.findings[0].joints == ("elbow",)
    assert diagnosis.document["provenance"]["recordings"][0]["file"] == "run.csv"


def test_paths_and_objects_reach_the_diagnosis_alike(diagnosis, model, recording, tmp_path, monkeypatch):
    # What they are turned into is seen here; the diagnosis itself has been run above.
    came = []
    monkeypatch.setattr("irb140_jax.mismatch.diagnose", lambda *words: came.append(words) or diagnosis.result)
    irb.diagnose([str(write_recording(recording, tmp_path / "run.csv")), recording], str(model))
    irb.diagnose(recording, irb.load_robot(model))
    (robot, (read, given), *_), (same, (alone,), *_) = came
    assert robot.joint_names == same.joint_names and given is alone is recording
    np.testing.assert_array_equal(read.q, recording.q)


def test_a_diagnosis_shows_itself_saves_itself_and_predicts(diagnosis, recording, tmp_path):
    assert diagnosis.verdict in repr(diagnosis) and "elbow" in diagnosis._repr_html_()
    folder = diagnosis.save(tmp_path / "out")
    assert (folder / "diagnosis.json").is_file()
    page, (file,) = (folder / "report.html").read_text(), shlex.split(diagnosis.document["provenance"]["command"])[2:3]
    assert f"irb140 predict {folder}" in page and pathlib.Path(file).is_file()
    assert f"irb140 diagnose {file} recorded.csv --robot " in page and f"--out {folder}-2" in page
    errors = {k: np.std(v[:, 1] - recording.tau[:, 1]) for k, v in diagnosis.predict(recording).items()}
    assert errors["corrected"] < 0.7 * errors["nominal"]
    q = jnp.zeros(2)
    loaded = irb.load_corrected(folder)
    np.testing.assert_allclose(
        loaded.forward_dynamics(q, q, q), diagnosis.corrected.forward_dynamics(q, q, q), rtol=1e-9, atol=1e-12
    )


def test_recordings_of_another_robot_and_no_recordings_are_refused(recording):
    with pytest.raises(InputError, match="holds joints shoulder, elbow; the robot"):
        irb.diagnose(recording)
    with pytest.raises(InputError, match="no recording was given"):
        irb.diagnose([])
    with pytest.raises(InputError, match="inertial_uncertainty is 0"):
        irb.diagnose(recording, inertial_uncertainty=0.0)


def test_robots_and_recordings_are_tables_in_a_notebook(model, recording):
    shown = irb.load_robot(model)._repr_html_()
    assert "<td style='text-align:left'>elbow</td>" in shown and "hinge" in shown
    assert f"{recording.source}: {len(recording.t)} rows" in recording._repr_html_()


def test_tab_finds_every_public_name_before_it_is_imported():
    code = "import irb140_jax as irb; print(*dir(irb))"
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    wanted = {"diagnose", "read_recording", "Trajectory", "fourier_motion", "oracle", "dynamics", "__version__"}
    assert wanted <= set(names)


def test_the_version_is_that_of_the_project():
    project = (pathlib.Path(__file__).parents[1] / "pyproject.toml").read_text()
    assert f'version = "{irb.__version__}"' in project


def _wrong_rows(robot):
    return irb.dynamics.inverse_dynamics_batch(robot, *[jnp.zeros((rows, 2)) for rows in (4, 5, 4)])


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda r: irb.dynamics.mass_matrix(r, jnp.zeros(5)), r"mass_matrix: q has shape \(5,\); give \(2,\) for"),
        (lambda r: irb.dynamics.mass_matrix(r, jnp.zeros((9, 2))), r"q has shape \(9, 2\); give \(2,\).*jax.vmap"),
        (lambda r: irb.dynamics.passive_torque(r, jnp.zeros(2), qd=jnp.zeros(3)), r"qd has shape \(3,\)"),
        (_wrong_rows, r"qd has shape \(5, 2\); give \(4, 2\)"),
        (lambda r: irb.kinematics.forward_kinematics(r, jnp.array(0.0)), r"q has shape \(\); give \(2,\)"),
    ],
)
def test_a_wrong_shape_gets_a_sentence_that_names_argument_and_shapes(model, call, sentence):
    with pytest.raises(InputError, match=sentence):
        call(irb.load_robot(model))


def test_right_shapes_pass_under_jit_vmap_and_derivatives(model):
    robot = irb.load_robot(model)
    q = jnp.ones((3, 2))
    M = jax.jit(jax.vmap(lambda x: irb.dynamics.mass_matrix(robot, x)))(q)
    assert M.shape == (3, 2, 2)
    assert jax.jacfwd(lambda x: irb.dynamics.gravity_torque(robot, x))(q[0]).shape == (2, 2)
    assert irb.dynamics.mass_matrix(robot, [0.1, 0.2]).shape == (2, 2)  # pyright: ignore[reportArgumentType]
