"""Bounds of what glibc's allocator keeps for itself, of a process with many threads.

Each thread has an arena of its own there, whose end may hold 64 MiB that nobody uses once large
arrays have come and gone.
"""

from __future__ import annotations

import ctypes

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # of malloc.h
_MIB = 1 << 20
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
