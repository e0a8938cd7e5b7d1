"""What the commands show while they work, and how they are interrupted."""

from __future__ import annotations

import contextlib
import sys
import threading
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

interrupted = threading.Event()
"""Set by Ctrl-C: Python drops an exception that a signal raises within a destructor."""


def interrupt(*_) -> None:
    """The signals' handler."""
    interrupted.set()
    raise KeyboardInterrupt


def hush(unraisable) -> None:
    """For sys.unraisablehook: nothing of interruptions that were dropped; they are kept here."""
    if not (interrupted.is_set() and issubclass(unraisable.exc_type, KeyboardInterrupt)):
        sys.__unraisablehook__(unraisable)


def check(*_) -> None:
    """Interrupt now what should have been before."""
    if interrupted.is_set():
        raise KeyboardInterrupt


@contextlib.contextmanager
def progress(say: Console, frames: int, quiet: bool, doing: str = "blurring"):
    """What to call after every frame: a bar with frames/s and time left where somebody watches."""
    if quiet or not say.is_terminal:
        yield check
        return
    columns = (
        "{task.description}",
        BarColumn(),
        "{task.completed}/{task.total}",
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=say, transient=True) as bar:
        task = bar.add_task(doing, total=frames, speed="")
        started, made = time.perf_counter(), [0]

        def tick(number: int, what: str) -> None:
            check()
            made[0] += what == "done"
            speed = made[0] / (time.perf_counter() - started)
            bar.update(
                task, advance=1, description=f"frame {number}", speed=f"{speed:.1f} frames/s"
            )

        yield tick
