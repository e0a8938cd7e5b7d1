"""Many cases in forked processes: one that crashes or hangs costs that case, not the run."""

from __future__ import annotations

import json
import os
import select
import signal
import time
from collections.abc import Callable, Sequence
from typing import Any

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
        hung = _listen(reads, found, seconds)
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


def _listen(reads: int, found: list[Any], seconds: float) -> bool:
    """Take lines until the pipe is closed; whether none came for `seconds`."""
    text = b""
    ends = time.monotonic() + seconds
    while True:
        ready, _, _ = select.select([reads], [], [], max(0.0, ends - time.monotonic()))
        if not ready:
            return True
        more = os.read(reads, 1 << 16)
        if not more:
            return False
        *lines, text = (text + more).split(b"\n")
        if lines:
            found += map(json.loads, lines)
            ends = time.monotonic() + seconds


def _signal(number: int) -> str:
    return signal.Signals(number).name
