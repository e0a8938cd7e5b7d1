"""`--log-json`: the events of a run for machines, a line of JSON each.

docs/reference/files.md describes the events. A command opens its log before it does anything
else, and app.py ends it with the exit code; there is one at most in a process. A new log is its
owner's alone until the inputs are known, and then as private as they are.
"""

from __future__ import annotations

import itertools
import json
import os
import stat
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._version import __version__
from ..errors import InputError
from ..io.atomic import PUBLIC, mode_of
from ..io.frame_numbers import frame_path
from ..io.pipes import STDOUT
from ..io.suffixes import VIDEOS
from . import terminal
from .terminal import Tick

if TYPE_CHECKING:
    from ..run.report import Progress

_BEGINNING = b'{"event": '  # of every line
STATES = ("done", "skipped", "failed")


@dataclass
class _Log:
    """An open log; every line is written whole, as frames end on several threads."""

    name: str
    command: str
    file: int | None
    """Descriptor of the file; None: standard output."""
    most: int | None = None
    """Permissions that the umask allows a new file; None: the file was there before."""
    begun: float = field(default_factory=time.perf_counter)
    last: float = field(default_factory=time.perf_counter)
    counts: dict[str, itertools.count[int]] = field(
        default_factory=lambda: {state: itertools.count() for state in STATES}
    )

    def protect(self, made_of: Iterable[Path]) -> None:
        """Let nobody read the file who may not read the inputs."""
        if self.file is None or os.name == "nt":
            return
        found = os.fstat(self.file)
        if not stat.S_ISREG(found.st_mode):
            return
        now = stat.S_IMODE(found.st_mode)
        wanted = mode_of(Path(self.name).parent, made_of) & (
            now if self.most is None else self.most
        )
        if wanted != now:
            os.fchmod(self.file, wanted)

    def write(self, event: str, **content: Any) -> None:
        """Add a line; a log that cannot be written any more is told once, and the run goes on."""
        global _log
        line = json.dumps({"event": event} | content, default=str)
        try:
            if self.file is None:
                terminal.out(line)
                terminal.flush()
            else:
                os.write(self.file, line.encode() + b"\n")
        except OSError as error:
            _log = None
            why = (error.strerror or str(error)).lower()
            terminal.complain(f"the log {self.name} ends here: {why}")


_log: _Log | None = None


def begin(name: str | None, command: str, output: str = "") -> None:
    """Open the log of a command; None: there is none. InputError where it cannot be written.

    A file that is there must be a log, to which the lines are added. `output`: of the command.
    """
    global _log
    _log = None
    if name is None:
        return
    if name == STDOUT == output:
        raise InputError("--log-json and --output are both standard output; name a file for one")
    _log = _Log(name, command, None) if name == STDOUT else _opened(Path(name), command)


def _opened(path: Path, command: str) -> _Log:
    flags = os.O_WRONLY | os.O_APPEND
    umask = os.umask(0o077)
    try:
        file = os.open(path, flags | os.O_CREAT | os.O_EXCL, PUBLIC)
    except FileExistsError:
        pass
    else:
        return _Log(str(path), command, file, PUBLIC & ~umask)
    finally:
        os.umask(umask)
    if path.is_file():
        with open(path, "rb") as file:
            first = file.read(len(_BEGINNING))
        if first and first != _BEGINNING:
            raise InputError(
                f"--log-json {path}: the file exists, but is no log; name another file"
            )
    return _Log(str(path), command, os.open(path, flags | os.O_CREAT, 0o600))


def start(
    inputs: Sequence[str | Path],
    output: str | Path,
    settings: Mapping[str, Any],
    total: int | None,
    made_of: Iterable[str | Path] = (),
) -> None:
    """Log the beginning of an output.

    `total`: number of frames, None if unknown. `made_of`: the files that are read; the log is
    readable by nobody who may not read them.
    """
    if _log is not None:
        _log.protect(map(Path, made_of))
        now = datetime.now(UTC).isoformat(timespec="seconds")
        _log.write(
            "start",
            time=now,
            wgmb=__version__,
            command=_log.command,
            inputs=list(map(str, inputs)),
            output=str(output),
            frames=total,
            settings=dict(settings),
        )


def logged(tick: Tick | Progress, output: str | Path, first: int = 0) -> Callable[[int, str], None]:
    """A progress that also logs each frame, and the file that it is in.

    `first`: the offset from a frame's number to its number in the names of files.
    """

    def tick_and_log(number: int, state: str) -> None:
        tick(number, state)
        if _log is None:
            return
        next(_log.counts[str(state)])
        now = time.perf_counter()
        seconds, _log.last = now - _log.last, now
        _log.write(
            "frame",
            number=number + first,
            output=str(frame_path(output, number + first)),
            status=str(state),
            seconds=round(seconds, 3),
            reason=getattr(state, "reason", ""),
        )

    return tick_and_log


def logged_video(tick: Tick | Progress, output: str | Path) -> Callable[[int, str], None]:
    """The same of a video, into a video or into image files, which have numbers of their own."""
    from ..run.video_output import FIRST

    return logged(tick, output, 0 if Path(output).suffix.lower() in VIDEOS else FIRST)


def video(
    source: str | Path,
    output: str | Path,
    status: str,
    seconds: float,
    reason: str = "",
    unfollowed: Sequence[int] = (),
) -> None:
    """Log the end of a video, or that it failed.

    `unfollowed`: numbers of the pictures in which a place stays sharp.
    """
    if _log is not None:
        _log.write(
            "video",
            input=str(source),
            output=str(output),
            status=status,
            seconds=round(seconds, 3),
            reason=reason,
            unfollowed=list(unfollowed),
        )


def end(code: int, reason: str = "") -> None:
    """Log the end of the command, and close the log; later calls do nothing."""
    global _log
    if (log := _log) is None:
        return
    counts = {state: next(count) for state, count in log.counts.items()}
    seconds = round(time.perf_counter() - log.begun, 3)
    log.write("end", exit_code=code, reason=reason, frames=counts, seconds=seconds)
    _log = None
    if log.file is not None:
        os.close(log.file)
