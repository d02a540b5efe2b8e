"""A diagnosis on disk: what the contract fixes, what `predict` needs, what the report draws."""

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
from irb140_jax.mismatch.output.intact import check_model, check_schema, check_undecided, refuse
from irb140_jax.mismatch.result import Result

DIAGNOSIS, MODEL, VIEWS, MOTION = "diagnosis.json", "model.json", "views.json", "motion.json"


def save(result: Result, folder: pathlib.Path) -> None:
    """Write diagnosis, model, views, the corrected model as MJCF and what is undecided into an existing folder."""
    save_undecided(result.undecided, folder)
    save_native(result.model, folder)
    motion = {MOTION: result.views["motion"]} if result.views.get("motion") else {}
    views = {key: value for key, value in result.views.items() if key != "motion"}
    files = {DIAGNOSIS: result.diagnosis, MODEL: to_json(result.model), VIEWS: views} | motion
    for name, content in files.items():
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
        (folder / name).write_text(text, encoding="utf-8")


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
