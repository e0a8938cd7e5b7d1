"""Output, progress bars and interruption of the commands."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from ..threads import Stop


class Tick(Protocol):
    """A function to call after every frame."""

    def __call__(self, number: int, state: str, name: str = "frame") -> None:
        """`state`: "done", "skipped" or "failed"; `name`: what stands before the number."""
        ...


interrupted = Stop()
"""Set by Ctrl-C: Python drops an exception that a signal raises within a destructor."""


def interrupt(*_: object) -> None:
    """The signals' handler."""
    interrupted.set()
    raise KeyboardInterrupt


def hush(unraisable: Any) -> None:
    """Replace sys.unraisablehook: after an interruption, exceptions of destructors are not printed.

    It is the interruption itself, or comes from an object that it left half made.
    """
    if not interrupted.is_set():
        sys.__unraisablehook__(unraisable)


def check(number: int = 0, state: str = "", name: str = "frame") -> None:
    """Raise an interruption that was dropped earlier; a Tick."""
    if interrupted.is_set():
        raise KeyboardInterrupt


def printable(text: str) -> str:
    """`text` as one line that cannot steer a terminal.

    Whatever is no visible character, nor a space (control and format characters, line ends, bytes
    that are not UTF-8), becomes an escape such as \\x1b.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def out(text: str) -> None:
    """Print a line of results; OSError if it cannot be written."""
    with _taken():
        sys.stdout.write(f"{printable(text)}\n")


def note(text: str) -> None:
    """Print a message on standard error; failing to write it is ignored."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"{printable(text)}\n")


def complain(text: str) -> None:
    """Print an error in one line, in which the library's arguments are spelled as options."""
    from .spelling import as_options

    note(f"wgmb: {as_options(' '.join(text.split()))}")


def flush() -> None:
    """Flush standard output; OSError if it cannot be written."""
    with _taken():
        sys.stdout.flush()


@contextlib.contextmanager
def _taken() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OSError(f"standard output: {(error.strerror or str(error)).lower()}") from None


def own_streams() -> None:
    """Move Python's output off descriptors 1 and 2, so that output of native code can be muted.

    Descriptors that are closed are filled, as a file that is opened would get their numbers and
    with them the chatter; nothing can be printed there all the same.
    """
    while (spare := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(spare)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        try:
            if stream is None:
                own, encoding = os.open(os.devnull, os.O_RDONLY), "utf-8"
            elif stream.fileno() > 2:
                continue
            else:
                stream.flush()
                own, encoding = os.dup(stream.fileno()), stream.encoding
        except (OSError, ValueError, AttributeError):
            continue
        setattr(sys, name, os.fdopen(own, "w", buffering=1, encoding=encoding, errors="replace"))


@contextlib.contextmanager
def muted() -> Iterator[None]:
    """Keep other processes, which are started meanwhile, from writing between our lines.

    Our own streams are elsewhere; see `own_streams`.
    """
    if any(_number(stream) in (1, 2) for stream in (sys.stdout, sys.stderr)):
        yield
        return
    kept = [os.dup(number) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(nowhere, number)
        yield
    finally:
        for number, was in zip((1, 2), kept, strict=True):
            os.dup2(was, number)
            os.close(was)
        os.close(nowhere)


def _number(stream: Any) -> int | None:
    try:
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        return None


def drop_streams() -> None:
    """Before the process ends: output that cannot be written must not change its exit code."""
    for name in ("stdout", "stderr"):
        try:
            getattr(sys, name).flush()
        except (OSError, ValueError, AttributeError):
            setattr(sys, name, None)


@contextlib.contextmanager
def progress(frames: int, quiet: bool, doing: str = "blurring") -> Iterator[Tick]:
    """Yield a function to call after every frame; on a terminal it drives a progress bar."""
    number = _number(sys.stderr)
    if quiet or number is None or not os.isatty(number):
        yield check
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    say = Console(stderr=True, highlight=False, soft_wrap=True)
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

        def tick(number: int, state: str, name: str = "frame") -> None:
            check()
            made[0] += state == "done"
            speed = made[0] / (time.perf_counter() - started)
            bar.update(
                task, advance=1, description=f"{name} {number}", speed=f"{speed:.1f} frames/s"
            )

        yield tick


@contextlib.contextmanager
def share_of(tick: Tick, frames: int, name: str) -> Iterator[Callable[[int, str], None]]:
    """Yield a function to call after every frame of a share of a bar, under a name of its own.

    `tick`: the function that `progress` yielded. Frames of which it was not told count as skipped
    in the end.
    """
    count = itertools.count()

    def tick_share(number: int, state: str) -> None:
        next(count)
        tick(number, state, name)

    try:
        yield tick_share
    finally:
        for number in range(next(count), frames):
            tick(number, "skipped", name)
