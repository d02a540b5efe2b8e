"""Legs of a Unitree Go2 held in the air: commands and positions of twelve joints, no torque.

The robot's drives close the loop with the gains that travel with each message, desired velocity zero:

    tau = 20 (qdes - q) - 1.5 qd        N m/rad, N m s/rad, on all joints

Source: github.com/iit-DLSLab/sim2real-robot-identification (BSD-3-Clause), datasets/go2/traj_0.pt and config.py; see
`sources`.
"""

import pathlib

import numpy as np
import pandas as pd

from irb140_jax.recordings.check import MIN_SAMPLES
from irb140_jax.recordings.drive import stated_drive
from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.recording import Recording, rows_of

MACHINE = "unitree_go2"
LEGS, PARTS = ("FL", "FR", "RL", "RR"), ("hip", "thigh", "calf")
JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in PARTS)
KP, KD = 20.0, 1.5  # N m/rad and N m s/rad, as published
# Rows at which each of the 13 sweeps begins, and the end: each is faster than the one before.
SWEEPS = (0, 601, 1163, 1684, 2165, 2606, 3008, 3370, 3692, 3973, 4215, 4415, 4576, 4698)
HELD_OUT = {"A": (3, 6, 9, 12), "B": (8, 9, 10, 11, 12, 13)}  # sweeps, counted from 1: within, and beyond, the speeds


def go2_joints(leg: str) -> tuple[str, ...]:
    """Joints of one leg: with the base held still, the legs don't feel each other."""
    return tuple(f"{leg}_{part}_joint" for part in PARTS)


def go2_recording(leg: str | None = None, folder: pathlib.Path | None = None) -> Recording:
    """The one published run, 23.5 s at 200 Hz, nothing filtered.

    Args:
        leg: One of `LEGS`, or None for all of them.
        folder: Where the files are; by default `recordings_folder`.
    """
    table = pd.read_csv(published_file(MACHINE, "log.csv", folder))
    joints = JOINTS if leg is None else go2_joints(leg)
    read = lambda kind: np.stack([table[f"{kind}.{joint}"].to_numpy(float) for joint in joints], axis=1)  # noqa: E731
    q = read("q")
    return Recording(
        t=table["t"].to_numpy(float), q=q, tau=np.full_like(q, np.nan), qdes=read("qdes"), joint_names=joints,
        source=MACHINE, drive=stated_drive(np.full(len(joints), KP), np.full(len(joints), KD)),
    )  # fmt: skip


def go2_sweeps(recording: Recording, sweeps: tuple[int, ...]) -> list[Recording]:
    """Some sweeps of the run, counted from 1; neighbours are one recording; what is too short is left out."""
    out, rest = [], sorted(sweeps)
    while rest:
        first = last = rest.pop(0)
        while rest and rest[0] == last + 1:
            last = rest.pop(0)
        rows = slice(SWEEPS[first - 1], SWEEPS[last])
        if rows.stop - rows.start < MIN_SAMPLES:
            continue
        out.append(rows_of(recording, rows, f"sweep_{first}" if first == last else f"sweeps_{first}_to_{last}"))
    return out


def go2_split(recording: Recording, split: str) -> tuple[list[Recording], list[Recording]]:
    """Recordings to fit and recordings to judge of split "A" or "B"."""
    held = HELD_OUT[split]
    fitted = tuple(k for k in range(1, len(SWEEPS)) if k not in held)
    return go2_sweeps(recording, fitted), go2_sweeps(recording, held)


def go2_model(folder: pathlib.Path | None = None) -> pathlib.Path:
    """MJCF with the base welded and level, without friction or rotors: the rigid body alone."""
    return published_file(MACHINE, "go2_fixed_base_nominal.xml", folder)
