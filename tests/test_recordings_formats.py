"""The same motion in every format gives the same recording."""

import sys

import helpers_formats as formats
import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.errors import RecordingError
from irb140_jax.recordings import Recording, read_recording, write_recording

ROS = pytest.importorskip("rosbags", reason="the extra [logs] is not installed")
pytest.importorskip("h5py", reason="the extra [logs] is not installed")

LEROBOT = '[columns]\nt = "timestamp"\n"q.*" = "observation.state.*.pos"\n"tau.*" = "observation.state.*.torque"\n'
MAT = '[columns]\nt = "log.t"\n"q.*" = "log.q.*"\n"tau.*" = "log.tau.*"\n'
PLOTJUGGLER = ('[columns]\nt = "__time"\n"q.*" = "/joint_states/*/position"\n"tau.*" = "/joint_states/*/effort"\n')
RTDE = ('first_number = 0\n[columns]\nt = "timestamp"\n"q.*" = "actual_q_{n}"\n"tau.*" = "actual_current_{n}"\n'
        '[scale]\n"tau.*" = "A"\n[torque_constant]\n"*" = 0.1\n[gear_ratio]\n"tau.*" = 100\n')  # fmt: skip


@pytest.fixture(scope="module")
def robot():
    return made.robot()


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording(speeds=False, duration=3.0)


WRITERS = {
    "csv": (lambda r, folder: write_recording(r, folder / "log.csv"), None),
    "parquet": (lambda r, folder: write_recording(r, folder / "log.parquet"), None),
    "npz": (lambda r, folder: write_recording(r, folder / "log.npz"), None),
    "ros1": (lambda r, folder: formats.write_ros1(r, folder / "log.bag"), None),
    "ros2": (lambda r, folder: formats.write_ros2(r, folder / "bag"), None),
    "ros2 mcap": (lambda r, folder: formats.write_ros2(r, folder / "bag", "mcap"), None),
    "mcap": (lambda r, folder: next(formats.write_ros2(r, folder / "bag", "mcap").glob("*.mcap")), None),
    "lerobot": (lambda r, folder: formats.write_lerobot(r, folder / "set"), LEROBOT),
    "mat": (lambda r, folder: formats.write_mat(r, folder / "log.mat"), MAT),
    "mat 7.3": (lambda r, folder: formats.write_mat73(r, folder / "log.mat"), MAT),
    "plotjuggler": (lambda r, folder: formats.write_plotjuggler(r, folder / "log.csv"), PLOTJUGGLER),
    "rtde": (lambda r, folder: formats.write_rtde(r, folder / "log.csv"), RTDE),
}
COARSE = {"plotjuggler": 1e-6, "rtde": 1e-12}  # seconds since 1970 leave half a microsecond in a float


def read(path, robot, lines, folder):
    if lines is None:
        return read_recording(path, robot)
    (folder / "map.toml").write_text(lines)
    return read_recording(path, robot, folder / "map.toml")


@pytest.mark.parametrize("kind", WRITERS)
def test_every_format_gives_the_same_recording(sound, robot, tmp_path, kind):
    write, lines = WRITERS[kind]
    again = read(write(sound, tmp_path), robot, lines, tmp_path)
    t = again.t - (1000.0 if kind == "rtde" else 0.0)
    np.testing.assert_allclose(t, sound.t, rtol=4e-16, atol=COARSE.get(kind, 0.0))
    for name in ("q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(sound, name), rtol=1e-15, atol=0)


def test_speeds_of_joint_states_are_read(robot, tmp_path):
    recording = made.recording(duration=3.0)
    again = read_recording(formats.write_ros1(recording, tmp_path / "log.bag"), robot)
    np.testing.assert_array_equal(again.qd, recording.qd)


def test_the_topic_with_the_robots_joints_is_taken(sound, robot, tmp_path):
    other = Recording(t=sound.t, q=sound.q[:, :1], tau=sound.tau[:, :1], joint_names=("finger",))
    bag = formats.write_ros2({"/gripper": other, "/arm": sound}, tmp_path / "bag")
    again = read_recording(bag, robot)
    np.testing.assert_array_equal(again.q, sound.q)
    assert "/arm is read" in " ".join(again.notes)


def test_two_topics_that_fit_are_refused_until_the_map_names_one(sound, robot, tmp_path):
    bag = formats.write_ros2({"/left": sound, "/right": sound}, tmp_path / "bag")
    with pytest.raises(RecordingError, match='choose one with topic'):
        read_recording(bag, robot)
    np.testing.assert_array_equal(read(bag, robot, 'topic = "/right"', tmp_path).q, sound.q)


def test_of_several_episodes_the_map_chooses_one(sound, robot, tmp_path):
    path = formats.write_lerobot(sound, tmp_path / "set", episodes=3)
    with pytest.raises(RecordingError, match="holds episodes 0 to 2; a recording is one of them"):
        read(path, robot, LEROBOT, tmp_path)
    assert len(read(path, robot, "episode = 1\n" + LEROBOT, tmp_path).t) == len(sound.t)


@pytest.mark.parametrize(("kind", "module"), [("ros1", "rosbags.highlevel"), ("mat 7.3", "h5py")])
def test_a_missing_library_is_named_with_how_to_install_it(sound, robot, tmp_path, monkeypatch, kind, module):
    path = WRITERS[kind][0](sound, tmp_path)
    monkeypatch.setitem(sys.modules, module, None)  # what makes an import fail
    with pytest.raises(RecordingError, match=r"pip install 'irb140_jax\[logs\]'"):
        read_recording(path, robot)
