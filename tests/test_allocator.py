"""Memory that a process frees and asks for again is the same memory."""

import platform
import subprocess
import sys

import pytest

# Page faults of arrays of 64 MB made and dropped ten times, after two that may still grow the heap.
PAGES = """
import resource, sys
import numpy as np
from irb140_jax.allocator import keep_memory
if sys.argv[1] == "keep":
    assert keep_memory()
for i in range(12):
    if i == 2:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    np.ones(8_000_000)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="allocators of other C libraries are left alone")
def test_freed_memory_is_used_again():
    kept, returned = (
        int(subprocess.run([sys.executable, "-c", PAGES, word], capture_output=True, text=True, check=True).stdout)
        for word in ("keep", "return")
    )
    assert kept < 100, "every array is a new mapping"
    assert returned > 1000, "the system clears the pages anyway: the settings are no longer needed"
