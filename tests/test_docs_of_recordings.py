"""What the pages on recordings have one write is what the program reads."""

import pathlib
import re
import sys

import numpy as np
import pytest

import irb140_jax as irb
from irb140_jax.cli import main
from irb140_jax.recordings import read_recording
from irb140_jax.recordings.column_file import read_column_map

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "docs"), str(ROOT / "experiments")]

import first_hour  # noqa: E402
import make_controller_log  # noqa: E402  # pyright: ignore[reportMissingImports]

EXAMPLES = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "columns.md").read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_of_the_map_is_one(tmp_path, example):
    (tmp_path / "map.toml").write_text(example, encoding="utf-8")
    read_column_map(tmp_path / "map.toml", ("shoulder", "elbow", "wrist"))


def test_the_page_shows_every_section_and_setting():
    from irb140_jax.recordings.column_file import SECTIONS, SETTINGS

    text = "".join(EXAMPLES)
    assert len(EXAMPLES) > 10
    for name in (*SECTIONS, "columns", "coupling"):
        assert f"[{name}]" in text
    for name in SETTINGS:
        assert re.search(rf"^{name} = ", text, re.M)


@pytest.fixture(scope="module")
def controller_log(tmp_path_factory):
    """A short log as the page's controller writes it, and the recording that it was made from."""
    from helpers_recordings import motion

    from irb140_jax.recordings import Recording
    from irb140_jax.recordings.torques import nominal_torques

    folder, robot = tmp_path_factory.mktemp("logs"), irb.robot.irb140()
    t, q, qd, qdd = motion(6, duration=4.0)
    q = q + 0.5 * (np.asarray(robot.lower) + np.asarray(robot.upper))
    tau = nominal_torques(robot, q, qd, qdd).total + 0.5 * np.sign(qd)
    recording = Recording(t=t, q=q, tau=tau, joint_names=robot.joint_names)
    return make_controller_log.write_controller_log(recording, folder / "run2.csv"), recording


def test_the_pages_map_reads_the_controllers_log(controller_log, tmp_path):
    path, recording = controller_log
    (tmp_path / "map.toml").write_text(first_hour.column_map(), encoding="utf-8")
    again = read_recording(path, irb.robot.irb140(), tmp_path / "map.toml")
    np.testing.assert_allclose(again.t, recording.t, atol=1e-9)
    np.testing.assert_allclose(again.q, recording.q, atol=1e-8)  # seven digits behind the comma of degrees
    np.testing.assert_allclose(again.tau, recording.tau, atol=1e-4)


def test_inspect_drafts_a_map_for_the_controllers_log(controller_log, tmp_path):
    path, _ = controller_log
    out, robot = tmp_path / "draft.toml", ROOT / "assets" / "irb140.xml"
    assert main(["inspect", str(path), "--robot", str(robot), "--write-columns", str(out)]) == 0
    draft = out.read_text(encoding="utf-8")
    assert '"q.*" = "Achse {n} Ist-Position [°]"' in draft and '"tau.*" = "Achse {n} Motorstrom [A]"' in draft
    assert "[torque_constant]" in draft and "put the data sheet's value here" in draft


def test_the_page_has_the_commands_that_its_script_runs():
    words = [command.split()[:2] for command in first_hour.commands()]
    assert [w[1] if w[0] == "irb140" else w[0] for w in words] == ["python", "inspect", "inspect", "diagnose"]
