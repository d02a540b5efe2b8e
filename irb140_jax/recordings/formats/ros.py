"""ROS 1 bags, ROS 2 bags and MCAP files: the joint states in them.

`sensor_msgs/JointState` has a meaning of its own: names, positions [rad or m], velocities, efforts [N m or N].  So its
columns are t, q.<name>, qd.<name>, tau.<name>, by the names in the messages.
"""

import collections
import pathlib
from typing import Any

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.extra import library
from irb140_jax.recordings.formats.options import MAX_VALUES, FileOptions, Table

JOINT_STATE = "sensor_msgs/msg/JointState"
QUANTITIES = {"q": "position", "qd": "velocity", "tau": "effort"}
SUFFIXES = (".bag", ".mcap", ".db3")


def is_bag_folder(path: pathlib.Path) -> bool:
    """Whether this folder is a ROS 2 bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def ros_table(path: pathlib.Path, joint_names: tuple[str, ...], options: FileOptions) -> Table:
    """Read the joint states of a bag: those of the topic asked for, or of the only one with the robot's joints.

    Raises:
        RecordingError: rosbags is not installed, or no topic, or several, hold joint states.
    """
    rosbags = library("rosbags.highlevel", f"{path}: ROS bags and MCAP files need rosbags")
    stores = library("rosbags.typesys", f"{path}: ROS bags and MCAP files need rosbags")
    # Bags of ROS 2 before Iron do not say what their messages look like.
    default = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
    with rosbags.AnyReader([path], default_typestore=default) as reader:
        topics = collections.defaultdict(list)
        for connection in reader.connections:
            if connection.msgtype == JOINT_STATE:
                topics[connection.topic].append(connection)
        if not topics:
            others = sorted({connection.topic for connection in reader.connections})
            raise RecordingError(f"{path}: holds no sensor_msgs/JointState; its topics are {', '.join(others[:8])}"
                                 f"{' ...' if len(others) > 8 else ''}: record /joint_states too")
        topic = _topic(reader, topics, joint_names, options, path)
        columns, notes = _columns(reader, topics[topic], path)
    if len(topics) > 1:
        notes.append(f"Of the topics {', '.join(sorted(topics))}, {topic} is read")
    kind = "MCAP" if path.suffix == ".mcap" else "ROS 1 bag" if path.suffix == ".bag" else "ROS 2 bag"
    return Table(columns, notes, format=kind)


def _topic(reader: Any, topics: dict[str, list], joints: tuple[str, ...], options: FileOptions, path: Any) -> str:
    if options.topic is not None:
        if options.topic not in topics:
            raise RecordingError(f"{path}: topic {options.topic} holds no sensor_msgs/JointState; these do: "
                                 f"{', '.join(sorted(topics))}")
        return options.topic
    if len(topics) == 1:
        return next(iter(topics))
    fitting = [topic for topic, connections in topics.items() if set(joints) & _first_names(reader, connections)]
    if len(fitting) != 1:
        raise RecordingError(f"{path}: several topics hold joint states: {', '.join(sorted(topics))}; choose one with "
                             "topic = \"...\" in the column map")
    return fitting[0]


def _first_names(reader: Any, connections: list) -> set[str]:
    for connection, _, raw in reader.messages(connections=connections):
        return set(reader.deserialize(raw, connection.msgtype).name)
    return set()


def _columns(reader: Any, connections: list, path: pathlib.Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns of the messages that carry the most common list of names; others, as of a gripper's driver, are left."""
    messages = [(time, reader.deserialize(raw, connection.msgtype))
                for connection, time, raw in reader.messages(connections=connections)]  # fmt: skip
    if not messages:
        raise RecordingError(f"{path}: its topic of joint states holds no message; record again")
    lists = collections.Counter(tuple(message.name) for _, message in messages)
    names, count = lists.most_common(1)[0]
    kept = [(time, message) for time, message in messages if tuple(message.name) == names]
    if 3 * len(names) * len(kept) > MAX_VALUES:
        raise RecordingError(f"{path}: holds more than {MAX_VALUES:.0g} values; cut it into shorter recordings")
    notes = []
    if len(lists) > 1:
        notes.append(f"{len(messages) - count} messages name other joints than {', '.join(names[:6])} and are left out")
    columns = {"t": _times(kept, notes)}
    for quantity, field in QUANTITIES.items():
        values = [getattr(message, field) for _, message in kept]
        if all(len(value) == len(names) for value in values):
            stacked = np.asarray(values, dtype=float)
            columns |= {f"{quantity}.{name}": stacked[:, j] for j, name in enumerate(names)}
        elif any(len(value) for value in values):
            notes.append(f"Some messages have no {field} for every joint; {field} is left out")
    return columns, notes


def _times(messages: list[tuple[int, Any]], notes: list[str]) -> np.ndarray:
    """Seconds since the first message, by the sender's clock where it gave its time, else by the recorder's."""
    stamps = np.array([message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for _, message in messages])
    if np.any(stamps == 0) or np.any(np.diff(stamps) < 0):
        stamps = np.array([time for time, _ in messages])
        notes.append("The messages carry no rising time of their own; the recorder's is used, which jitters more")
    return (stamps - stamps[0]) / 1e9
