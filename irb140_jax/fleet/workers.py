"""Processes that work side by side, each for many tasks; one that dies costs its own task only."""

import contextlib
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple

from irb140_jax.errors import InputError

# One thread a process: as many processes as cores are quicker than threads of one that wait for each other.
ONE_THREAD = {name: "1" for name in ("NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
MOST_TASKS = 100  # of a process, then another takes its place, so that memory cannot grow for ever


class Done(NamedTuple):
    """What became of a task.

    Attributes:
        task: The task.
        status: "diagnosed", "refused" by an `InputError`, or "failed".
        message: Why, where it isn't "diagnosed".
    """

    task: Any
    status: str
    message: str


class _Worker:
    """A process, the pipe to it, and what it works at."""

    def __init__(self, work: Callable[[Any], None]):
        spawn = multiprocessing.get_context("spawn")  # a fork of a process that runs threads may hang
        self.pipe, theirs = spawn.Pipe()
        self.process = spawn.Process(target=_serve, args=(work, theirs), daemon=True)
        self.process.start()
        theirs.close()
        self.task: Any = None
        self.left = MOST_TASKS

    def give(self, task: Any) -> None:
        """Let it begin a task."""
        self.task, self.left = task, self.left - 1
        with contextlib.suppress(OSError):  # it died; `taken` says so
            self.pipe.send(task)

    def taken(self) -> Done:
        """What became of the task that it was given."""
        try:
            status, message = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            code, self.left = self.process.exitcode, 0
            why = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
            return Done(self.task, "failed", f"its process ended by {why}; was there enough memory?")
        return Done(self.task, status, message)

    def end(self) -> None:
        """Stop it, at once."""
        self.pipe.close()
        self.process.terminate()
        self.process.join()


def run_tasks(tasks: Iterable[Any], work: Callable[[Any], None], jobs: int) -> Iterator[Done]:
    """Do tasks in processes of their own, and tell of each when it is done, in whichever order.

    Args:
        tasks: What to do; each can be pickled.
        work: Does one; a function of a module, so that another process finds it.
        jobs: Processes.
    """
    waiting = list(tasks)[::-1]
    busy: list[_Worker] = []
    try:
        with _environment(ONE_THREAD):
            while len(busy) < jobs and waiting:
                busy.append(_Worker(work))
                busy[-1].give(waiting.pop())
            while busy:
                ready = wait([worker.pipe for worker in busy])
                for worker in [worker for worker in busy if worker.pipe in ready]:
                    done = worker.taken()
                    if waiting and worker.left:
                        worker.give(waiting.pop())
                    else:
                        busy.remove(worker)
                        worker.end()
                        if waiting:
                            busy.append(_Worker(work))
                            busy[-1].give(waiting.pop())
                    yield done
    finally:
        for worker in busy:
            worker.end()


def _serve(work: Callable[[Any], None], pipe: Connection) -> None:
    """What a process does: one task after the other, in silence, until nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that gave the tasks
    threading.Thread(target=_end_with_parent, daemon=True).start()
    silence = open(os.devnull, "w")  # noqa: SIM115 - for as long as the process lives
    for stream in (1, 2):
        os.dup2(silence.fileno(), stream)
    with contextlib.redirect_stdout(silence), contextlib.redirect_stderr(silence):
        while True:
            try:
                task = pipe.recv()
            except EOFError:
                return
            pipe.send(_tried(work, task))


def _tried(work: Callable[[Any], None], task: Any) -> tuple[str, str]:
    try:
        work(task)
    except InputError as error:
        return "refused", str(error)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{os.path.basename(last.filename)}, line {last.lineno}"
        return "failed", f"an unexpected error ({type(error).__name__}: {error}) in {where}"
    return "diagnosed", ""


def _end_with_parent() -> None:
    """End this process when the one that started it has gone, killed perhaps."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
    os._exit(1)


@contextlib.contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Variables for processes started meanwhile."""
    former = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in former.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value
