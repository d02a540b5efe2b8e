"""Staubli TX40, a six-axis industrial arm: published motor positions and torques to joint-side recordings and a model.

The motors turn 32 to 48 times as fast as the joints, motor 4 backwards, and motor 6 is carried along by joint 5:

    q_motor = R q,  tau = Rt tau_motor,     R = diag(N) + 32 e6 e5',  Rt = diag(N) + 32 e5 e6'

Source: github.com/thanhndv212/figaroh-plus (Apache-2.0), see `sources`.
"""

import pathlib
import re

import numpy as np
import pandas as pd

from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.recording import Recording, rows_of, write_recording

MACHINE = "staubli_tx40"
JOINTS = tuple(f"joint_{i}" for i in range(1, 7))
GEAR = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
WRIST_COUPLING = 32.0  # turns of motor 6 per turn of joint 5
ZERO = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])  # rad, the encoders' zero in the URDF's joint angles
RATE = 5000.0  # Hz; the files have no time column


def tx40_recording(folder: pathlib.Path | None = None) -> Recording:
    """The one published run: 9 s at 5 kHz, joint positions [rad] and motor torque on the joint side [N m].

    Args:
        folder: Where the published files are; by default `recordings_folder`.
    """
    read = lambda name: pd.read_csv(published_file(MACHINE, name, folder)).to_numpy(float)  # noqa: E731
    q_motor, tau_motor = read("pos_read_data.csv"), read("curr_data.csv")
    return Recording(
        t=np.arange(len(q_motor)) / RATE, joint_names=JOINTS, source="tx40",
        q=np.linalg.solve(motor_per_joint(), q_motor.T).T + ZERO, tau=tau_motor @ motor_per_joint(),
    )


def motor_per_joint() -> np.ndarray:
    """R of q_motor = R q, shape (6, 6); power is the same on both sides, so tau = R' tau_motor."""
    R = np.diag(GEAR)
    R[5, 4] = WRIST_COUPLING
    return R


def tx40_model(folder: pathlib.Path | None = None) -> str:
    """The published rigid-body URDF, made readable for MuJoCo: no meshes, and link 6 has the least inertia it takes."""
    text = published_file(MACHINE, "tx40_mdh_modified.urdf", folder).read_text(encoding="utf-8")
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.DOTALL)
    # Link 6 is published with a mass and no inertia, which MuJoCo refuses; 1e-9 kg m^2 is nothing beside its rotor.
    compiler = '<mujoco><compiler boundinertia="1e-9"/></mujoco>'
    return re.sub(r'(<robot name="staubli_tx40"\s*>)', rf"\1\n  {compiler}", text, count=1)


def split_in_time(recording: Recording, share: float) -> tuple[Recording, Recording]:
    """The first `share` of a run and the rest, named <source>_train and <source>_test."""
    cut = round(share * len(recording.t))
    return (rows_of(recording, slice(0, cut), f"{recording.source}_train"),
            rows_of(recording, slice(cut, None), f"{recording.source}_test"))


def write_tx40(
    out: pathlib.Path, folder: pathlib.Path | None = None, *, split: float | None = 0.7, suffix: str = ".csv"
) -> tuple[pathlib.Path, list[pathlib.Path]]:
    """Write the model and the run, by default split in time at 70 %, as contract files.

    Args:
        out: Folder to write to.
        folder: Where the published files are; by default `recordings_folder`.
        split: Share of the run that goes to the first file (train), the rest to the second (test); None for one file.
        suffix: .csv, .parquet or .npz.

    Returns:
        Path of the model, paths of the recordings.
    """
    run = tx40_recording(folder)
    parts = [run] if split is None else split_in_time(run, split)
    model = out / "tx40.urdf"
    out.mkdir(parents=True, exist_ok=True)
    model.write_text(tx40_model(folder), encoding="utf-8")
    return model, [write_recording(part, out / f"{part.source}{suffix}") for part in parts]
