"""What all tests share: one folder of compiled programs, made anew for each run.

Many files diagnose arms of the same few sizes; what one worker has compiled the other only reads.
"""

import atexit
import os
import shutil
import tempfile

import pytest

if "PYTEST_XDIST_WORKER" not in os.environ and "JAX_COMPILATION_CACHE_DIR" not in os.environ:
    folder = tempfile.mkdtemp(prefix="irb140-tests-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    # Of the workers and of the commands that the tests run, too.
    os.environ["JAX_COMPILATION_CACHE_DIR"] = folder
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0.05"
    # Two workers keep two cores busy; each with two threads for its small matrices, a quarter of all time is waiting.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Most programs run once here, so that compiling them well takes longer than it saves: a fifth of such files' time.
    # Without the emitters of fused loops a file that compiles hundreds of programs takes a third less.
    quick = "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false"
    os.environ["XLA_FLAGS"] = f"{quick} {os.environ.get('XLA_FLAGS', '')}".strip()


# Files that take longest come first, so that no worker is left with one of them when the other is done.
LONGEST = (
    "real_machines", "reproduce_all", "servo", "whole_diagnosis", "unknown", "recovery", "native_gravity", "notebooks",
    "trees", "demo", "learned", "sharding", "control", "control_study", "corrected", "excite", "diagnose_many",
    "abrupt", "laws",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    """The longest files first; --no-loadscope-reorder keeps that order."""
    place = {f"test_{name}": k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONGEST)))


@pytest.fixture(autouse=True, scope="module")
def few_compiled_programs():
    """Files of tests that compile more than a process may hold don't crash those after them."""
    yield
    from irb140_jax.compilation_cache import make_room_for_programs

    make_room_for_programs()
