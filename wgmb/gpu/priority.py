"""Priority of threads, a software driver's too: work beside a window yields to it."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_TASKS = Path("/proc/self/task")
_RASTERIZER = "llvmpipe-"  # how Mesa calls the threads that draw triangles, such as a window's
_LOWER, _LOWEST = 10, 19


def lower_priority(by: int = _LOWER) -> None:
    """Lower the priority of the calling thread, and of those that it starts. On Linux only."""
    if sys.platform == "linux":
        _lower(threading.get_native_id(), by)


@contextmanager
def yielding() -> Iterator[None]:
    """Lower the priority of the threads that a driver starts meanwhile to compute with.

    A software driver starts them with the first device of the process; those that rasterize, and
    those of devices that are opened later, keep theirs. On Linux only.
    """
    before = _threads()
    yield
    of_python = {thread.native_id for thread in threading.enumerate()}
    for thread, name in _threads().items():
        if thread in before or thread in of_python or name.startswith(_RASTERIZER):
            continue
        with suppress(OSError):  # it has ended
            _lower(thread, _LOWER)


def _lower(thread: int, by: int) -> None:
    priority = min(os.getpriority(os.PRIO_PROCESS, thread) + by, _LOWEST)
    os.setpriority(os.PRIO_PROCESS, thread, priority)


def _threads() -> dict[int, str]:
    """Names of the process's threads by their ids."""
    if sys.platform != "linux":
        return {}
    found = {}
    for folder in _TASKS.iterdir():
        with suppress(OSError):
            found[int(folder.name)] = (folder / "comm").read_text().strip()
    return found
