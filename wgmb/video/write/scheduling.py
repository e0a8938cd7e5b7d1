"""Threads keep their scheduling while a library opens an encoder.

SVT-AV1 makes the calling thread and its own real-time where the process may, as root in a
container. Every thread that is made afterwards inherits this, and whatever waits by yielding, such
as OpenEXR's pool, then keeps others from running: frames took three times the processor time.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def kept_scheduling() -> Iterator[None]:
    """Within it, no thread of this process becomes real-time; Linux only, nothing elsewhere."""
    before = _policies()
    try:
        yield
    finally:
        for thread, policy in _policies().items():
            if policy in _REAL_TIME and before.get(thread) not in _REAL_TIME:
                with contextlib.suppress(OSError):  # it has ended
                    os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


_REAL_TIME = {getattr(os, name, None) for name in ("SCHED_FIFO", "SCHED_RR")} - {None}


def _policies() -> dict[int, int]:
    """The scheduling policy of each thread, by its number."""
    found = {}
    with contextlib.suppress(OSError):  # there is no /proc
        for name in os.listdir("/proc/self/task"):
            with contextlib.suppress(OSError):
                found[int(name)] = os.sched_getscheduler(int(name))
    return found
