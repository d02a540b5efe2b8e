"""Work that takes no time, for tests of the processes around it, and an example of diagnoses to compare."""

import dataclasses
import json
import os
import pathlib
import signal
import time

import helpers_report

from irb140_jax.errors import InputError
from irb140_jax.mismatch.result import DiagnosedRecording, Diagnosis, Estimate
from irb140_jax.report.made import write_manifest


def made_at_once(task) -> None:
    """A made-up diagnosis whose numbers come from the recording, or what the recording's first word asks for."""
    said = task.unit.recordings[0].read_text().split()
    if said[0] == "refuse":
        raise InputError(f"{task.unit.recordings[0]}: no good; record again")
    if said[0] == "raise":
        raise RuntimeError("a bug")
    if said[0] == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    diagnosis = helpers_report.example_document()
    diagnosis["findings"][0]["parameters"]["coulomb"]["value"] = float(said[1])
    diagnosis["provenance"]["recordings"] = [
        {"file": path.name, "sha256": path.name, "rows": 10, "rate": 100.0, "duration": 1.0}
        for path in task.unit.recordings
    ]
    task.folder.mkdir()
    (task.folder / "model.json").write_text("{}")
    time.sleep(0.05)
    (task.folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    write_manifest(task.folder, "test")


def made_slowly(task) -> None:
    """The same, so slowly that it can be killed meanwhile."""
    time.sleep(0.15)
    made_at_once(task)


def units_folder(folder: pathlib.Path, words: list[str]) -> pathlib.Path:
    """A folder of recordings that say what `made_at_once` shall do with them."""
    folder.mkdir()
    for k, word in enumerate(words):
        (folder / f"unit{k:02}.csv").write_text(f"{word} {k}\n")
    return folder


def diagnosis_with(value: float, std: float, recording: str) -> Diagnosis:
    """A diagnosis of one effect with one parameter."""
    whole = helpers_report.example_diagnosis()
    coupling = dataclasses.replace(whole.findings[1], parameters={"viscous": Estimate(value, std, "N m s/rad")})
    of = (DiagnosedRecording(recording, recording, 10, 100.0, 1.0),)
    origin = dataclasses.replace(whole.provenance, recordings=of)
    return dataclasses.replace(whole, findings=(coupling,), unexplained=(), not_testable=(), provenance=origin)
