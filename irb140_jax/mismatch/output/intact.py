"""Whether files of a diagnosis are what some version of this program wrote, whole."""

import dataclasses
import pathlib
from typing import Any, NoReturn

import numpy as np

from irb140_jax.effects.grids import Scales
from irb140_jax.errors import InputError
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.experiment_design.undecided import Undecided
from irb140_jax.mismatch.regression.discrepancy import FEATURES
from irb140_jax.recordings.low_pass import Band


def refuse(path: pathlib.Path, error: Exception) -> NoReturn:
    """Raise the `InputError` that says a file of a diagnosis can't be read.

    Which errors the libraries raise on flipped bytes nobody can list: it takes any.
    """
    if isinstance(error, FileNotFoundError):
        raise InputError(
            f"{path.parent}: holds no {path.name}; name a folder that `irb140 diagnose` has written"
        ) from None
    said = f"{error} is missing" if isinstance(error, KeyError) else " ".join(str(error).split())
    said = (said or type(error).__name__)[:200]
    raise InputError(f"{path}: can't be read as part of a diagnosis ({said}); diagnose again") from error


def check_model(model: CorrectedModel) -> None:
    """Raise a `ValueError` unless the numbers of a model fit together and are numbers."""
    n = model.robot.n
    for field in dataclasses.fields(model.robot):
        value = getattr(model.robot, field.name)
        if hasattr(value, "dtype") and np.isnan(np.asarray(value, float)).any():
            raise ValueError(f"robot.{field.name} holds what is no number")
    for name in ("phi_refit", "phi_corrected"):
        _check(name, getattr(model, name), (n, 10))
    _check("rest_speed", model.rest_speed, (n,), positive=True)
    _check_band(model.band)
    for named in model.named:
        _check_named(named, n)
    if model.discrepancy is not None:
        _check("discrepancy", model.discrepancy.coefficients, (n, FEATURES))
        _check_scales(model.discrepancy.scales, n)


def check_undecided(open_: Undecided) -> None:
    """Raise a `ValueError` unless the numbers of what is open fit together and are numbers."""
    n, columns = len(open_.level), len(open_.columns)
    width = sum(len(c.variant) for c in open_.columns)
    size = 10 * n + 10 * len(open_.loose) + width + 1
    _check("gram", open_.gram, (size, size))
    for name in ("scale", "reference"):
        _check(name, getattr(open_, name), (width,))
    _check("ar", open_.ar, (n, np.shape(open_.ar)[-1]))
    _check("level", open_.level, (n,))
    _check_scales(open_.scales, n)
    _check("uncertainty", open_.uncertainty, (), positive=True)
    _check_band(open_.band)
    sets = [s for p in open_.pairs for s in (p.rest, *p.named_sets, *p.rival_sets)]
    for name, numbers, count in (
        *(("columns", c.joints, n) for c in open_.columns), ("loose", open_.loose, n),
        *(("a set of effects", s, columns) for s in (open_.chosen, open_.hidden, *sets)),
    ):  # fmt: skip
        if not set(numbers) <= set(range(count)):
            raise ValueError(f"{name}: {numbers} are not all numbers from 0 to {count - 1}")


def _check_named(named: Named, n: int) -> None:
    slug = named.effect.slug
    if not named.joints or not set(named.joints) <= set(range(n)):
        raise ValueError(f"{slug}: joints {named.joints} of {n}")
    if named.variant not in named.effect.law.variants:
        raise ValueError(f"{slug}: it has no columns {named.variant}")
    _check(f"{slug}: amplitudes", named.amplitudes, (len(named.variant),))
    _check(f"{slug}: shape", named.shape, (np.size(named.shape),))


def _check_scales(scales: Scales, n: int) -> None:
    for name in Scales._fields:
        _check(name, getattr(scales, name), () if name == "duration" else (n,))


def _check_band(band: Band) -> None:
    numbers = [band.torque, band.position, band.rate, band.step]
    _check("band", np.array(numbers, dtype=float), (4,), positive=True)
    if band.step != int(band.step) or max(band.torque, band.position) > band.rate:
        raise ValueError(f"band: {numbers} is none")


def _check(name: str, value: Any, shape: tuple[int, ...], *, positive: bool = False) -> None:
    value = np.asarray(value)
    if value.shape != shape:
        raise ValueError(f"{name} has shape {value.shape} where {shape} belongs")
    if value.dtype.kind not in "fiu" or not np.isfinite(value).all() or (positive and not (value > 0.0).all()):
        raise ValueError(f"{name} holds what is no number or can't be")
