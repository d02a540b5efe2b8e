"""A diagnosis on disk: what the contract fixes, what `predict` needs, what the report draws."""

import dataclasses
import json
import pathlib
from collections.abc import Sequence

import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.mismatch.corrected.model import SCHEMA, CorrectedModel, from_json, to_json
from irb140_jax.mismatch.corrected.native import save_native
from irb140_jax.mismatch.corrected.robot import CorrectedRobot, corrected_robot
from irb140_jax.mismatch.experiment_design import undecided
from irb140_jax.mismatch.experiment_design.undecided import Undecided, save_undecided
from irb140_jax.mismatch.output.intact import check_model, check_undecided, refuse
from irb140_jax.mismatch.output.views import Views
from irb140_jax.mismatch.records import check_schema
from irb140_jax.mismatch.result import Diagnosis

DIAGNOSIS, MODEL, VIEWS, MOTION = "diagnosis.json", "model.json", "views.json", "motion.json"


@dataclasses.dataclass(frozen=True)
class Result:
    """A diagnosis with all that is stored beside it.

    Attributes:
        diagnosis: What it says.
        model: The corrected model, for predictions.
        views: Data for the report's figures.
        undecided: What is open, for the design of a motion that decides it.
    """

    diagnosis: Diagnosis
    model: CorrectedModel
    views: Views
    undecided: Undecided


def save(result: Result, folder: pathlib.Path) -> None:
    """Write diagnosis, model, views, the corrected model as MJCF and what is undecided into an existing folder."""
    save_undecided(result.undecided, folder)
    save_native(result.model, folder)
    files = {DIAGNOSIS: result.diagnosis.to_json(), MODEL: to_json(result.model), VIEWS: result.views.to_json()}
    files |= {MOTION: result.views.motion} if result.views.motion else {}
    for name, content in files.items():
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
        (folder / name).write_text(text, encoding="utf-8")


def load_diagnosis(folder: str | pathlib.Path) -> Diagnosis:
    """Read what a diagnosis says.

    Raises:
        InputError: The folder holds no whole diagnosis of this version.
    """
    path = pathlib.Path(folder) / DIAGNOSIS
    try:
        return Diagnosis.from_json(json.loads(path.read_text(encoding="utf-8")))
    except Exception as error:
        refuse(path, error)


def load_model(folder: str | pathlib.Path, effects: Sequence[Effect] = ()) -> CorrectedModel:
    """Read the corrected model of a diagnosis.

    Args:
        folder: Where the diagnosis was saved.
        effects: What `DiagnoseConfig.effects` had beyond the catalogue.

    Raises:
        InputError: The folder holds no whole diagnosis of this version, or an effect that is not known.
    """
    path = pathlib.Path(folder) / MODEL
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        check_schema(data, SCHEMA)
        check_model(model := from_json(data, effects))
        return model
    except Exception as error:
        refuse(path, error)


def load_undecided(folder: str | pathlib.Path, effects: Sequence[Effect] = ()) -> Undecided:
    """Read what a diagnosis left open.

    Args:
        folder: Where the diagnosis was saved.
        effects: What `DiagnoseConfig.effects` had beyond the catalogue.

    Raises:
        InputError: The folder holds no whole diagnosis of this version, or an effect that is not known.
    """
    path = pathlib.Path(folder) / undecided.FILE
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        meta = json.loads(str(arrays.pop("meta")))
        check_schema(meta, undecided.SCHEMA)
        check_undecided(open_ := undecided.from_arrays(meta, arrays, effects))
        return open_
    except Exception as error:
        refuse(path, error)


def load_corrected(folder: str | pathlib.Path, effects: Sequence[Effect] = ()) -> CorrectedRobot:
    """Read the corrected model of a diagnosis as dynamics in JAX: refitted inertials and the named effects.

    Args:
        folder: Where the diagnosis was saved.
        effects: What `DiagnoseConfig.effects` had beyond the catalogue.

    Raises:
        InputError: The folder holds no readable diagnosis.
    """
    return corrected_robot(load_model(folder, effects))
