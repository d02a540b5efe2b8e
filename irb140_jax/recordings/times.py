"""Times as logs write them, to seconds: dates, times of day, seconds since 1970 in any unit."""

import pathlib
import re

import numpy as np
import pandas as pd

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.check import RATES, TIME_UNITS

YEARS = (1e9, 4e9)  # s since 1970: 2001 to 2096; no recording lasts as long
UNITS = {"seconds": 1.0, **TIME_UNITS}


def seconds_of_text(values: np.ndarray, time_format: str | None, path: pathlib.Path | str) -> np.ndarray:
    """Times given as text, in seconds after the first.

    Args:
        values: Texts, shape (T,).
        time_format: In the letters of `strptime`; None: ISO 8601, or a time of day as 12:01:02.25.
        path: The file, for messages.

    Raises:
        RecordingError: A row is no time of this form.
    """
    texts = pd.Series([None if value is None or value != value else str(value).strip() for value in values])
    if time_format is None and bool(texts.dropna().str.fullmatch(r"\d+:\d{1,2}:\d{1,2}([.,]\d+)?").all()):
        times = pd.to_timedelta(texts.str.replace(",", "."), errors="coerce").astype("timedelta64[ns]")
    else:
        form = "ISO8601" if time_format is None else time_format
        try:
            times = pd.to_datetime(texts, format=form, utc=True, errors="coerce").astype("datetime64[ns, UTC]")
        except (ValueError, re.error) as error:
            raise RecordingError(f"{path}: time_format = \"{time_format}\" is no format of strptime: "
                                 f"{error}") from error
    bad = np.flatnonzero((times.isna() & texts.notna()).to_numpy())
    if len(bad):
        wanted = f"the form \"{time_format}\"" if time_format else "a number or a time as 2026-11-24T12:01:02.25"
        raise RecordingError(f"{path}: column t, row {bad[0] + 1}: '{texts[bad[0]]}' is not a time; {wanted} is "
                             "wanted: give time_format = \"...\" in the column map, such as \"%d.%m.%Y %H:%M:%S.%f\"")
    ticks = times.astype("int64").to_numpy()
    first = ticks[np.flatnonzero(times.notna().to_numpy())[:1]]
    seconds = (ticks - (first[0] if len(first) else 0)) / 1e9
    return np.where(times.isna().to_numpy(), np.nan, seconds)


def seconds_since_start(t: np.ndarray, notes: list[str]) -> np.ndarray:
    """Times since 1970, in whatever unit, as seconds after the first row; other times as they are."""
    finite = t[np.isfinite(t)]
    if len(finite) < 2:
        return t
    step = float(np.median(np.abs(np.diff(finite))))
    for name, unit in UNITS.items():
        if YEARS[0] < finite[0] * unit < YEARS[1] and 1 / RATES[1] <= step * unit <= 1 / RATES[0]:
            since = pd.Timestamp(finite[0] * unit, unit="s", tz="UTC").isoformat(timespec="seconds")
            notes.append(f"Times are {name} since 1970; counted in seconds from the first row, {since}")
            return (t - finite[0]) * unit
    return t
