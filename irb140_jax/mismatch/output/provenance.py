"""Where a diagnosis comes from: version, command, robot, recordings, options and day."""

import datetime
import hashlib
import os
import shlex
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

import jax
import numpy as np

from irb140_jax.mismatch.result import DiagnosedRecording, DiagnosedRobot, Provenance
from irb140_jax.recordings.recording import Recording, content_hash
from irb140_jax.robot import Robot

EPOCH = "SOURCE_DATE_EPOCH"  # seconds since 1970; https://reproducible-builds.org/specs/source-date-epoch/


def provenance(
    robot: Robot, recordings: Sequence[Recording], options: Mapping[str, Any], words: Sequence[str] = ()
) -> Provenance:
    """Where a diagnosis comes from.

    The same input gives the same `diagnosis.json` on the same day: `date` holds no time of day, and `SOURCE_DATE_EPOCH`
    sets it.  Compare diagnoses of different days without `date`.

    Args:
        robot: The nominal model.
        recordings: As they were read.
        options: Options by name.
        words: What the command line said beside the recordings and the uncertainty.
    """
    share = f"{options['inertial_uncertainty']:g}"
    command = ["irb140", "diagnose", *(r.path or r.source for r in recordings), *words, "--inertial-uncertainty", share]
    return Provenance(
        version=_version(),
        command=shlex.join(command),
        robot=DiagnosedRobot(robot.name, robot.joint_names, _hash_of_robot(robot)),
        recordings=tuple(_of_recording(r) for r in recordings),
        options=dict(options),
        date=_today(),
    )


def _of_recording(r: Recording) -> DiagnosedRecording:
    duration = float(r.t[-1] - r.t[0])
    rate = (len(r.t) - 1) / duration
    return DiagnosedRecording(r.source, r.sha256 or content_hash(r), len(r.t), rate, duration)


def _hash_of_robot(robot: Robot) -> str:
    """SHA-256 of the model's numbers to nine digits, so that the last bit of another processor doesn't change it."""
    digest = hashlib.sha256()
    for leaf in jax.tree.leaves(robot):
        digest.update(" ".join(f"{x:.9g}" for x in np.ravel(np.asarray(leaf)) + 0.0).encode())
    return digest.hexdigest()


def _version() -> str:
    """Of the installed package."""
    try:
        return metadata.version("irb140_jax")
    except metadata.PackageNotFoundError:
        return "unknown: run from a source tree that is not installed"


def _today() -> str:
    """The day, in UTC."""
    epoch = os.environ.get(EPOCH, "")
    now = datetime.datetime.now(datetime.UTC)
    if epoch.isdecimal():
        try:
            now = datetime.datetime.fromtimestamp(int(epoch), datetime.UTC)
        except (ValueError, OverflowError, OSError):
            pass  # no date that a calendar has
    return now.date().isoformat()
