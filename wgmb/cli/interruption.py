"""The end of a command by a signal, whatever its threads wait for.

The first signal is an exception on the main thread, and the run ends as after any error. But no
exception is heard within a call of the system or of a library: while a disk does not answer, or a
frame is on the GPU. Signals are therefore written to a pipe as well, by Python's own handler in C,
and a thread reads it: GRACE seconds after the first one, or at once with the second, it removes
unfinished files and ends the process.
"""

from __future__ import annotations

import os
import select
import signal

from ..io import leftovers
from ..threads import begin
from . import terminal
from .exit_codes import INTERRUPTED

GRACE = 3.0  # seconds
_REMOVING = 1.0  # seconds, after these
_said: list[bool] = []  # not empty once the command says that it was interrupted


def watch() -> None:
    """From now on, signals end the process within GRACE and a second, with INTERRUPTED."""
    reads, writes = os.pipe()
    os.set_blocking(writes, False)
    signal.set_wakeup_fd(writes, warn_on_full_buffer=False)

    def follow() -> None:
        os.read(reads, 1)
        terminal.interrupted.set()
        select.select([reads], [], [], GRACE)
        end()

    begin(follow, "signals")


def expect_no_message() -> None:
    """Leave the message to the command, which reports its interruption now."""
    _said.append(True)


def finish() -> None:
    """Remove the leftovers of a command that was interrupted."""
    leftovers.remove_all(_REMOVING)


def end() -> None:
    """Remove unfinished files, say so, and end the process now."""
    try:
        leftovers.remove_all(_REMOVING, is_last=True)
        if not _said:
            begin(lambda: terminal.complain("interrupted"), "last words").join(0.2)
    finally:
        os._exit(INTERRUPTED)
