"""How a process of its own, such as the command line's, gets and keeps memory.

A diagnosis makes and drops arrays of megabytes all the time.  glibc asks the system for each anew and gives it back
when it is dropped, and the system clears every page on its first use: a quarter of the processor time of a diagnosis.
Kept in one heap, the memory is used again; its peak falls too, as nothing lies idle in the heaps of other threads.
But a heap that is never given back grows around what lies in it: arrays of one stage don't fit between those of the
last.  So free memory is given back between stages, where clearing it again costs little.
"""

import ctypes
import platform

# Of glibc's <malloc.h>, with what each is set to: free memory stays; no array has a mapping of its own; one heap.
_M_TRIM_THRESHOLD, _M_MMAP_MAX, _M_ARENA_MAX = -1, -4, -8
_SETTINGS = {_M_TRIM_THRESHOLD: 2**31 - 1, _M_MMAP_MAX: 0, _M_ARENA_MAX: 1}


def keep_memory() -> bool:
    """Let this process keep the memory it frees; to be called before it starts threads.

    Returns:
        Whether it does: other C libraries than glibc are left as they are.
    """
    if platform.libc_ver()[0] != "glibc":
        return False
    mallopt = ctypes.CDLL(None).mallopt
    return all(mallopt(option, value) == 1 for option, value in _SETTINGS.items())


def give_back() -> None:
    """Give the system the free memory of the heap, holes between what is in use included; glibc's only."""
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)
