"""Memory of this process: how much it holds, and bounds of glibc's own share.

Each thread has an arena of its own there, whose end may hold 64 MiB that nobody uses once large
arrays have come and gone.
"""

from __future__ import annotations

import ctypes
import os
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # of malloc.h
_MIB = 1 << 20
_STATM = "/proc/self/statm"
_BOUNDS = {
    _ARENA_MAX: 4,
    _TRIM_THRESHOLD: 16 * _MIB,
    _MMAP_THRESHOLD: 2 * _MIB,  # larger arrays go back to the system at once
}


def bound_free_memory() -> bool:
    """Bound it for this process; False with an allocator that knows no such bounds."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # not of glibc
        return False
    taken = [mallopt(name, value) for name, value in _BOUNDS.items()]
    return all(taken)


def held() -> int:
    """Bytes of memory that this process holds now; where only the most so far is known, that."""
    if os.path.exists(_STATM):
        with open(_STATM, "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    if sys.platform == "win32":
        return _held_by_windows()
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def _held_by_windows() -> int:
    """The working set, which follows two DWORDs and a SIZE_T in PROCESS_MEMORY_COUNTERS."""
    library = ctypes.WinDLL("kernel32")  # pyright: ignore
    library.GetCurrentProcess.restype = ctypes.c_void_p
    process, word = ctypes.c_void_p(library.GetCurrentProcess()), ctypes.sizeof(ctypes.c_size_t)
    counters = (ctypes.c_byte * (8 + 8 * word))()
    library.K32GetProcessMemoryInfo(process, ctypes.byref(counters), len(counters))
    return ctypes.c_size_t.from_buffer(counters, 8 + word).value
