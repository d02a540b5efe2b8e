"""All units of a part, side by side: each is diagnosed, stored, and reported."""

import pathlib
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from irb140_jax.fleet.layout import Unit
from irb140_jax.fleet.row import row_of, row_without
from irb140_jax.fleet.store import ResultsStore
from irb140_jax.fleet.workers import Done, run_tasks
from irb140_jax.mismatch import load_diagnosis

# Writes the diagnosis of a unit into an empty folder.
Diagnosing = Callable[["Task"], None]


class Task(NamedTuple):
    """A unit, the empty folder that its diagnosis is written into, its key, and where the folder will lie."""

    unit: Unit
    folder: pathlib.Path
    key: str
    place: pathlib.Path


class Progress(NamedTuple):
    """How far a run is.

    Attributes:
        unit: That has just been done; empty at the beginning.
        status: What became of it.
        done: Units done, those of former runs included.
        every: Units there are.
        left: Time left [s]; None where nothing is known of it.
    """

    unit: str
    status: str
    done: int
    every: int
    left: float | None


def diagnose_units(units: Sequence[Unit], store: ResultsStore, work: Diagnosing, jobs: int) -> Iterator[Progress]:
    """Diagnose the units that have no row yet.

    Args:
        units: The units.
        store: Where the results go.
        work: Diagnoses one; a function of a module.
        jobs: Processes to do so in.

    Yields:
        How far it is, first before anything is done.
    """
    open_ = [unit for unit in units if not store.done(unit)]
    before, start = len(units) - len(open_), time.monotonic()
    yield Progress("", "", before, len(units), None)
    done = before
    for unit in [unit for unit in open_ if unit.problem]:
        store.put(unit, store.key(unit), row_without(unit, "refused", unit.problem))
        done += 1
        yield Progress(unit.name, "refused", done, len(units), None)
    tasks = [
        Task(unit, store.workspace / f"new-{unit.name}", store.key(unit), store.folder(unit.name))
        for unit in open_ if not unit.problem
    ]  # fmt: skip
    tasks.sort(key=_size, reverse=True)  # the longest first, so that none of them is waited for in the end
    for k, one in enumerate(run_tasks(tasks, work, jobs), 1):
        status, done = _put(store, one), done + 1
        left = (time.monotonic() - start) / k * (len(tasks) - k)
        yield Progress(one.task.unit.name, status, done, len(units), left)


def _put(store: ResultsStore, one: Done) -> str:
    """Put what a process made into the store."""
    unit, fresh, key, _ = one.task
    if one.status != "diagnosed":
        shutil.rmtree(fresh, ignore_errors=True)
        store.put(unit, key, row_without(unit, one.status, one.message))
        return one.status
    diagnosis = load_diagnosis(fresh)
    store.put(unit, key, row_of(unit, diagnosis), fresh)
    return diagnosis.verdict


def _size(task: Task) -> int:
    """Bytes of the recordings, by which tasks are long or short."""
    files = [path for path in task.unit.recordings if path.is_file()]
    return sum(path.stat().st_size for path in files)
