"""A diagnosis on disk: what the contract fixes, what `predict` needs, what the report draws."""

import json
import pathlib

from irb140_jax.errors import InputError
from irb140_jax.mismatch.corrected import CorrectedRobot, corrected_robot
from irb140_jax.mismatch.diagnose import Result
from irb140_jax.mismatch.model import CorrectedModel, from_json, to_json
from irb140_jax.mismatch.native import save_native
from irb140_jax.mismatch.undecided import save_undecided

DIAGNOSIS, MODEL, VIEWS = "diagnosis.json", "model.json", "views.json"


def save(result: Result, folder: pathlib.Path) -> None:
    """Write diagnosis, model, views, the corrected model as MJCF and what is undecided into an existing folder."""
    save_undecided(result.undecided, folder)
    save_native(result.model, folder)
    for name, content in ((DIAGNOSIS, result.diagnosis), (MODEL, to_json(result.model)), (VIEWS, result.views)):
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
        (folder / name).write_text(text, encoding="utf-8")


def load_model(folder: str | pathlib.Path) -> CorrectedModel:
    """Read the corrected model of a diagnosis.

    Raises:
        InputError: The folder holds no readable diagnosis.
    """
    path = pathlib.Path(folder) / MODEL
    try:
        return from_json(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise InputError(f"{folder}: holds no {MODEL}; name a folder that `irb140 diagnose` has written") from None
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise InputError(f"{path}: can't be read as a diagnosed model ({error}); diagnose again") from error


def load_corrected(folder: str | pathlib.Path) -> CorrectedRobot:
    """Read the corrected model of a diagnosis as dynamics in JAX: refitted inertials and the named effects.

    Raises:
        InputError: The folder holds no readable diagnosis.
    """
    return corrected_robot(load_model(folder))
