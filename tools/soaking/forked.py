"""Many cases in forked processes: one that crashes or hangs costs that case, not the run."""

from __future__ import annotations

import json
import os
import select
import signal
import time
from collections.abc import Callable, Sequence
from typing import Any

from .processes import is_late, processor_time

_LOOK = 0.1  # s
HUNG, DIED = "hung", "died"


def forked(cases: Sequence[Any], case: Callable[[Any], Any], seconds: float = 20) -> list[Any]:
    """Results of `case` (returning JSON) for each; {"what": "died" or "hung", "why"} where it did.

    The process that calls this must have no threads and no GPU device.
    """
    found: list[Any] = []
    while len(found) < len(cases):
        reads, writes = os.pipe()
        if (pid := os.fork()) == 0:
            os.close(reads)
            _go_on(cases[len(found) :], case, writes)
        os.close(writes)
        hung = _listen(reads, found, pid, seconds)
        if hung:
            os.kill(pid, signal.SIGKILL)
        os.close(reads)
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        if len(found) < len(cases):
            why = f"{seconds:g} s" if hung else f"exit {code}" if code >= 0 else _signal(-code)
            found.append({"what": HUNG if hung else DIED, "why": why})
    return found


def _go_on(cases: Sequence[Any], case: Callable[..., Any], writes: int) -> None:
    """In the child: a line for every case, until the last one or the end of the process."""
    code = 1
    try:
        nowhere = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nowhere, descriptor)
        for one in cases:
            os.write(writes, json.dumps(case(one)).encode() + b"\n")
        code = 0
    finally:
        os._exit(code)


def _listen(reads: int, found: list[Any], pid: int, seconds: float) -> bool:
    """Take lines until the pipe is closed; whether the process is late with the next one."""
    text = b""
    begun, used = time.monotonic(), processor_time(pid)
    while True:
        ready, _, _ = select.select([reads], [], [], _LOOK)
        if not ready:
            if is_late(pid, seconds, time.monotonic() - begun, used):
                return True
            continue
        more = os.read(reads, 1 << 16)
        if not more:
            return False
        *lines, text = (text + more).split(b"\n")
        if lines:
            found += map(json.loads, lines)
            begun, used = time.monotonic(), processor_time(pid)


def _signal(number: int) -> str:
    return signal.Signals(number).name
