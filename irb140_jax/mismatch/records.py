"""Frozen dataclasses as JSON and back, and numbers to six significant digits."""

import dataclasses
import math
import types
import typing
from typing import Any, Literal

import numpy as np


def rounded(x: Any, to: int = 6) -> Any:
    """Numbers to `to` significant digits, so that the same input gives the same file; None for what is no number.

    Args:
        x: A record, or dictionaries, lists and tuples, of numbers and whatever else.
        to: How many.
    """
    if isinstance(x, float | np.floating):  # most of what there is
        value = float(x)
        return float(f"{value:.{to}g}") if math.isfinite(value) else None
    if isinstance(x, list | tuple):
        return type(x)([rounded(v, to) for v in x])
    if dataclasses.is_dataclass(x) and not isinstance(x, type):
        return dataclasses.replace(x, **{f.name: rounded(getattr(x, f.name), to) for f in dataclasses.fields(x)})
    if isinstance(x, dict):
        return {k: rounded(v, to) for k, v in x.items()}
    return x.item() if isinstance(x, np.generic) else x


def digits(x: float, count: int = 2) -> str:
    """A number to so many significant digits for a sentence: "430", where the format .2g writes 4.3e+02."""
    return f"{float(f'{x:.{count}g}'):g}"


def plain(x: Any) -> Any:
    """A record as JSON has it: an object with an entry for each field, in their order."""
    if dataclasses.is_dataclass(x) and not isinstance(x, type):
        return {f.name: plain(getattr(x, f.name)) for f in dataclasses.fields(x)}
    if isinstance(x, dict):
        return {k: plain(v) for k, v in x.items()}
    return [plain(v) for v in x] if isinstance(x, list | tuple) else x


def read(kind: Any, data: Any, name: str = "the file") -> Any:
    """The inverse of `plain`; entries that are no field are left out.

    Args:
        kind: The type wanted: a record, or what its fields may be.
        data: Of JSON.
        name: What `data` is called in messages.

    Raises:
        KeyError: A field is missing.
        ValueError: A field is of another type.
    """
    outer, inner = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind) and isinstance(data, dict):
        return kind(**{key: read(of, data[key], key) for key, of in typing.get_type_hints(kind).items()})  # pyright: ignore[reportCallIssue]
    if outer is tuple and isinstance(data, list):
        return tuple(read(inner[0], x, name) for x in data)
    if outer is dict and isinstance(data, dict):
        return {key: read(inner[1], x, key) for key, x in data.items()}
    if kind is Any or (outer is Literal and data in inner):
        return data
    allowed: Any = inner if outer is types.UnionType else (kind,) if outer is None else ()
    if isinstance(data, (*allowed, *((int,) if float in allowed else ()))) and not isinstance(data, bool):
        return data
    raise ValueError(f"{name} can't be {str(data)[:40]!r}")


def check_schema(data: Any, expected: int) -> None:
    """Raise a `ValueError` unless `data` is an object of this schema."""
    if not isinstance(data, dict) or "schema" not in data:
        raise ValueError("it states no schema")
    if data["schema"] != expected:
        raise ValueError(f"it has schema {data['schema']!r}, this version reads and writes schema {expected}")
