"""SO-101, a hobby arm of six Feetech STS3215 bus servos: commands, positions, an unsigned current; no torque.

Rad of five joints, the URDF's zeros of which are unconfirmed.  The jaw is logged as a share of its range and left out.
Within a row joints are read one after the other, up to 20 ms after `t`.

Source: github.com/isaac-sim2real/sage (Apache-2.0), output/real/so101/custom; model: github.com/TheRobotStudio/
SO-ARM100 (Apache-2.0), Simulation/SO101; see `sources`.
"""

import dataclasses
import pathlib

import numpy as np
import pandas as pd

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.drive import Drive, stated_drive
from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.recording import Recording

MACHINE = "so101"
KP, KP_WIDTH = 17.8, 0.4  # N m/rad, and its relative standard deviation: gravity says 8 to 20
JOINTS = {
    "shoulder_pan": "Rotation", "shoulder_lift": "Pitch", "elbow_flex": "Elbow", "wrist_flex": "Wrist_Pitch",
    "wrist_roll": "Wrist_Roll",
}  # fmt: skip
HELD_OUT = (
    "prbs_excitation", "backlash_detection", "static_holding", "single_joint_wrist_roll", "large_amplitude",
    "pick_place",
)  # fmt: skip
FITTED = (
    "chirp_sweep", "multisine", "step_response", "friction_gravity", "velocity_ramp", "single_joint_elbow",
    "single_joint_rotation", "hold_under_gravity",
)  # fmt: skip


def so101_recording(motion: str, folder: pathlib.Path | None = None) -> Recording:
    """One motion; the present current keeps its sign-less counts as `current.<joint>`.

    Args:
        motion: One of `FITTED` or `HELD_OUT`.
        folder: Where the files are; by default `recordings_folder`.

    Raises:
        RecordingError: There is no such motion.
    """
    if motion not in (*FITTED, *HELD_OUT):
        raise RecordingError(f"{MACHINE} has no motion '{motion}'; allowed is {', '.join((*FITTED, *HELD_OUT))}")
    table = pd.read_csv(published_file(MACHINE, f"{motion}.csv", folder))
    read = lambda kind: np.stack(  # noqa: E731
        [table[f"{kind}.{name}"].to_numpy(float) for name in JOINTS.values()], axis=1)  # fmt: skip
    q = read("q")
    counts = read("current_as_torque") / 0.022814
    return Recording(
        t=table["t"].to_numpy(float), q=q, tau=np.full_like(q, np.nan), qdes=read("qdes"), joint_names=tuple(JOINTS),
        source=motion, drive=so101_drive(), extras={f"current.{joint}": counts[:, i] for i, joint in enumerate(JOINTS)},
    )  # fmt: skip


def so101_drive() -> Drive:
    """What is published of the servos: a Kp that was not measured on this arm, so with a wide interval, and no Kd."""
    n = len(JOINTS)
    return dataclasses.replace(stated_drive(np.full(n, KP), np.full(n, np.nan)), kp_width=np.full(n, KP_WIDTH))


def so101_model(folder: pathlib.Path | None = None) -> pathlib.Path:
    """The published URDF without meshes."""
    return published_file(MACHINE, "so101_new_calib.urdf", folder)
