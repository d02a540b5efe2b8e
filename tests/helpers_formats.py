"""One recording in every format, written by the libraries made for them."""

import json
import pathlib

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from irb140_jax.recordings import Recording, recording_columns


def joint_state_messages(recording: Recording, typestore):
    """Time [ns] and a sensor_msgs/JointState for every row."""
    types = typestore.types
    ros1 = "seq" in types["std_msgs/msg/Header"].__dataclass_fields__
    names = list(recording.joint_names)
    speeds = recording.qd if recording.qd is not None else np.zeros((len(recording.t), 0))
    for i, t in enumerate(recording.t):
        now = 1_764_000_000 * 10**9 + round(t * 1e9)
        stamp = types["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9)
        header = types["std_msgs/msg/Header"](*([i] if ros1 else []), stamp=stamp, frame_id="")
        yield now, types["sensor_msgs/msg/JointState"](
            header=header, name=names, position=recording.q[i], velocity=speeds[i], effort=recording.tau[i]
        )


def write_ros1(recording: Recording, path: pathlib.Path, topic: str = "/joint_states") -> pathlib.Path:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        connection = writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
        for now, message in joint_state_messages(recording, store):
            writer.write(connection, now, store.serialize_ros1(message, "sensor_msgs/msg/JointState"))
    return path


def write_ros2(
    recordings: Recording | dict[str, Recording], folder: pathlib.Path, storage: str = "sqlite3"
) -> pathlib.Path:
    """A ROS 2 bag: a folder with metadata.yaml and one file of the storage, "sqlite3" or "mcap"."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    if isinstance(recordings, Recording):
        recordings = {"/joint_states": recordings}
    with Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        for topic, recording in recordings.items():
            connection = writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
            for now, message in joint_state_messages(recording, store):
                writer.write(connection, now, store.serialize_cdr(message, "sensor_msgs/msg/JointState"))
    return folder


def write_lerobot(recording: Recording, root: pathlib.Path, episodes: int = 1) -> pathlib.Path:
    """A LeRobot dataset with positions, speeds and torques in observation.state; returns its data file."""
    joints = recording.joint_names
    names = [f"{joint}.{kind}" for kind in ("pos", "torque") for joint in joints]
    state = np.concatenate([recording.q, recording.tau], axis=1)
    rows = len(recording.t)
    states = pa.array(np.tile(state, (episodes, 1)).ravel())
    table = pa.table({
        "observation.state": pa.FixedSizeListArray.from_arrays(states, len(names)),
        "action": pa.array([list(q) for q in np.tile(recording.q, (episodes, 1))], pa.list_(pa.float64())),
        "timestamp": np.tile(recording.t, episodes), "frame_index": np.tile(np.arange(rows), episodes),
        "episode_index": np.repeat(np.arange(episodes), rows),
    })  # fmt: skip
    (root / "meta").mkdir(parents=True)
    (root / "data" / "chunk-000").mkdir(parents=True)
    action = {"motors": [f"{joint}.pos" for joint in joints]}
    features = {"observation.state": {"dtype": "float64", "shape": [len(names)], "names": names},
                "action": {"dtype": "float64", "shape": [len(joints)], "names": action}}
    (root / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v2.1", "features": features}))
    path = root / "data" / "chunk-000" / "episode_000000.parquet"
    pq.write_table(table, path)
    return path


def write_mat(recording: Recording, path: pathlib.Path) -> pathlib.Path:
    from scipy import io

    io.savemat(path, {"log": {"t": recording.t, "q": recording.q.T, "tau": recording.tau}, "comment": "made"})
    return path


def write_mat73(recording: Recording, path: pathlib.Path) -> pathlib.Path:
    """As MATLAB does since 7.3: HDF5 behind 512 bytes, matrices transposed."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name in ("t", "q", "tau"):
            file[f"log/{name}"] = np.atleast_2d(getattr(recording, name).T)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def write_plotjuggler(recording: Recording, path: pathlib.Path) -> pathlib.Path:
    """What PlotJuggler exports: __time since 1970 and a column a curve."""
    table = {"__time": 1_764_000_000 + recording.t}
    for j, joint in enumerate(recording.joint_names):
        table[f"/joint_states/{joint}/position"] = recording.q[:, j]
        table[f"/joint_states/{joint}/effort"] = recording.tau[:, j]
    pd.DataFrame(table).to_csv(path, index=False)
    return path


def write_rtde(recording: Recording, path: pathlib.Path) -> pathlib.Path:
    """What record.py of Universal Robots' RTDE client writes: blanks, joints from 0, currents in A.  Here 0.1 N m/A."""
    table = {"timestamp": 1000.0 + recording.t}
    for j in range(len(recording.joint_names)):
        table |= {f"actual_q_{j}": recording.q[:, j], f"actual_current_{j}": recording.tau[:, j] / 10.0}
    pd.DataFrame(table).to_csv(path, index=False, sep=" ")
    return path


def columns_of(recording: Recording) -> pd.DataFrame:
    return pd.DataFrame(recording_columns(recording))
