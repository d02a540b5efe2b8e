"""How everything here is timed: pinned to one core, compile and run apart, rivals alternately, medians.

Import this before JAX and NumPy: it sets the number of threads, which both read once.
"""

import ctypes
import os
import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

for variable in ("NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import jax  # noqa: E402

Case = Callable[[], Any]


def seconds(case: Case) -> float:
    """Processor time of one call, its result waited for.

    On one core that is the wall time of an idle machine; on a busy one it does not count the others' share.
    """
    start = time.process_time()
    jax.block_until_ready(case())
    return time.process_time() - start


def compile_seconds(case: Case) -> float:
    """Time of the first call less that of the second: tracing and compiling."""
    first = seconds(case)
    return first - seconds(case)


def stages(function: Callable[..., Any], *arguments: Any) -> dict[str, float]:
    """Processor time of tracing, lowering and compiling a function [s]; forgets all that is compiled before it."""
    jax.clear_caches()
    start = time.process_time()
    traced = jax.jit(function).trace(*arguments)
    tracing = time.process_time()
    lowered = traced.lower()
    lowering = time.process_time()
    lowered.compile()
    return {"trace": tracing - start, "lower": lowering - tracing, "compile": time.process_time() - lowering}


def medians(cases: Mapping[str, Case], rounds: int, repeats: int = 1) -> dict[str, float]:
    """Median time of a call of each case [s]; every round runs all cases, so that drift hits them alike."""
    times: dict[str, list[float]] = {name: [] for name in cases}
    for case in cases.values():
        seconds(case)
    for _ in range(rounds):
        for name, case in cases.items():
            times[name].append(min(seconds(case) for _ in range(repeats)))
    return {name: statistics.median(x) for name, x in times.items()}


def extra_megabytes(case: Case) -> float:
    """How far one call raises the process's memory above what it holds before [MB].

    Linux only: it gives freed memory back, so that using it again counts, and resets the kernel's high-water mark.
    Elsewhere NaN, which `run.py` reports as a failure.
    """
    try:
        ctypes.CDLL("libc.so.6").malloc_trim(0)
        with open("/proc/self/clear_refs", "w") as reset:
            reset.write("5")
    except OSError:
        return float("nan")
    before = _status("VmRSS")
    jax.block_until_ready(case())
    return (_status("VmHWM") - before) / 1024.0


def _status(field: str) -> float:
    """A field of /proc/self/status [kB]."""
    with open("/proc/self/status") as status:
        return next(float(line.split()[1]) for line in status if line.startswith(field))
