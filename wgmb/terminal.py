"""What the commands show while they work."""

from __future__ import annotations

import contextlib
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


@contextlib.contextmanager
def progress(say: Console, frames: int, quiet: bool, doing: str = "blurring"):
    """A bar with frames/s and time left where somebody watches; nothing elsewhere."""
    if quiet or not say.is_terminal:
        yield None
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
            made[0] += what == "done"
            speed = made[0] / (time.perf_counter() - started)
            bar.update(
                task, advance=1, description=f"frame {number}", speed=f"{speed:.1f} frames/s"
            )

        yield tick
