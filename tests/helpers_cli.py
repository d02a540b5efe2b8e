"""A recording and a diagnosis that takes no time, for tests of the command line around it."""

import json
import pathlib
import types

import helpers_report
import mujoco
import numpy as np
import pandas as pd
import pytest

import irb140_jax.mismatch
from irb140_jax import cli

MODEL = pathlib.Path(__file__).parents[1] / "assets" / "irb140.xml"


def table_of_a_motion(seconds: float = 12.0, rate: float = 100.0) -> pd.DataFrame:
    """A recording of the IRB 140 along sums of sines; torque by MuJoCo, with some noise."""
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    t = np.arange(0.0, seconds, 1.0 / rate)
    w = 2 * np.pi * np.array([0.2, 0.35, 0.55])
    a, phase = rng.uniform(0.1, 0.3, (3, model.nv)), rng.uniform(0, 6, (3, model.nv))
    angle = w[:, None, None] * t[None, :, None] + phase[:, None]
    q = (a[:, None] * np.sin(angle)).sum(0)
    qd = (a[:, None] * w[:, None, None] * np.cos(angle)).sum(0)
    qdd = (-a[:, None] * w[:, None, None] ** 2 * np.sin(angle)).sum(0)
    tau = np.empty_like(q)
    for i in range(len(t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], qd[i], qdd[i]
        mujoco.mj_inverse(model, data)
        tau[i] = data.qfrc_inverse
    tau += 0.01 * tau.std(0) * rng.standard_normal(tau.shape)
    names = [model.joint(i).name for i in range(model.njnt)]
    columns = {"t": t} | {f"q.{j}": q[:, i] for i, j in enumerate(names)}
    return pd.DataFrame(columns | {f"tau.{j}": tau[:, i] for i, j in enumerate(names)})


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return table_of_a_motion()


@pytest.fixture
def recording(table, tmp_path) -> pathlib.Path:
    """A recording that can be used, in a folder of its own."""
    path = tmp_path / "in" / "wave.csv"
    path.parent.mkdir()
    table.to_csv(path, index=False)
    return path


@pytest.fixture
def stub(monkeypatch):
    """A diagnosis that takes no time; the command line around it is the real one."""
    result = types.SimpleNamespace(diagnosis=helpers_report.example_diagnosis(), views=helpers_report.example_views())
    seen = {}

    def diagnose(robot, recordings, config, progress):
        progress("looking")
        seen.update(robot=robot, recordings=recordings, config=config)
        return result

    def save(result, out_dir):
        (out_dir / "diagnosis.json").write_text(json.dumps(result.diagnosis.to_json()))
        (out_dir / "model.json").write_text("{}")

    def predict(model, recording):
        return {name: k * np.asarray(recording.tau) for k, name in enumerate(("nominal", "refit", "corrected"))}

    def load_model(folder):
        from irb140_jax.robot import load_robot

        robot = load_robot(MODEL)
        return types.SimpleNamespace(robot=robot, known_joints=robot.joint_names, drive=None)

    for function in (diagnose, save, predict, load_model):
        monkeypatch.setattr(irb140_jax.mismatch, function.__name__, function, raising=False)
    monkeypatch.setattr(
        irb140_jax.mismatch, "DiagnoseConfig", lambda **kwargs: types.SimpleNamespace(**kwargs), raising=False
    )
    return seen


def refused(capsys, *words) -> str:
    """The one line that a command says when it refuses its input."""
    assert cli.main([str(word) for word in words]) == 2
    said = capsys.readouterr().err
    assert said.endswith("\n") and said.count("\n") == 1, said
    return said
