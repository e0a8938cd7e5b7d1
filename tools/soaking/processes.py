"""Other processes: run within limits, watched, and functions in a process of their own.

A function that uses the GPU, or may end its process, is run by `apart`: this process itself
has neither a device nor threads, so that it can be forked.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from . import PATHS

WGMB = [sys.executable, "-P", "-m", "wgmb"]
_LOOK = 0.02  # s
_WAITING = 8  # times its seconds, for a process that takes no processor time
_ENDS = "\nsoaking: "  # what a function returned follows, on stdout


@dataclass(frozen=True)
class Ended:
    """A process that has ended."""

    code: int  # -9: by signal 9
    out: str
    err: str
    seconds: float
    peak: float  # MiB
    late: bool  # it had to be killed
    value: Any = None  # of a function run by `apart`

    def wrong(self, *codes: int, name: str = "") -> str:
        """The fault in the end of a command; "" if there is none.

        Right is one of the codes, and if it is not 0, one line that holds `name`.
        """
        last = (self.err.strip().splitlines() or ["nothing said"])[-1]
        if self.late:
            return f"still running after {self.seconds:.0f} s"
        if "Traceback" in self.err:
            return f"traceback, exit {self.code}: {last}"
        if self.code not in codes:
            return f"exit {self.code}: {last}"
        if any(not (c.isprintable() or c in "\n\t") for c in self.out + self.err):
            return "control characters reach the terminal"
        if self.code == 0:
            return ""
        lines = self.err.strip().splitlines()
        if len(lines) != 1:
            return f"{len(lines)} lines of error, the last: {last}"
        return "" if name in last else f"does not name {name}: {last}"


def run(
    line: list[Any],
    *,
    seconds: float = 120,
    env: dict[str, Any] | None = None,
    prepare: Callable[[], object] | None = None,
    cwd: Path | None = None,
) -> Ended:
    """Run a program to its end, or kill it after `seconds` of the processor; see is_late.

    `env` is added to the environment; `prepare` is called in the process before it begins.
    """
    started = time.perf_counter()
    process = subprocess.Popen(
        [str(word) for word in line],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(env),
        preexec_fn=prepare,
        cwd=cwd,
    )
    watch = _Watch(process.pid, seconds)
    streams = [stream for stream in (process.stdout, process.stderr) if stream]
    with ThreadPoolExecutor(2) as readers:
        said, complained = readers.map(_all_of, streams)
        _, status = os.waitpid(process.pid, 0)
    took = time.perf_counter() - started
    peak = watch.end()
    process.returncode = os.waitstatus_to_exitcode(status)
    late = process.returncode == -signal.SIGKILL and watch.killed
    return Ended(process.returncode, said, complained, took, peak, late)


class _Watch:
    """The largest memory of a process, followed while it lives; it is killed once it is late.

    What the system says at its end (`ru_maxrss`) is never less than the memory of the
    process that started it.
    """

    def __init__(self, pid: int, seconds: float):
        self._pid, self._seconds, self.killed = pid, seconds, False
        self._largest = 0.0  # MiB
        self._begun = time.perf_counter()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def end(self) -> float:
        self._ended.set()
        self._thread.join()
        return self._largest

    def _follow(self) -> None:
        while not self._ended.wait(_LOOK):
            with contextlib.suppress(OSError):
                for line in Path(f"/proc/{self._pid}/status").read_text().splitlines():
                    if line.startswith("VmHWM:"):
                        self._largest = max(self._largest, int(line.split()[1]) / 1024)
                if not self.killed and self._is_late():
                    self.killed = True
                    os.kill(self._pid, signal.SIGKILL)

    def _is_late(self) -> bool:
        took = time.perf_counter() - self._begun
        return is_late(self._pid, self._seconds, took)


def is_late(pid: int, seconds: float, took: float, used: float = 0.0) -> bool:
    """True if a process has taken `seconds` both by the clock and of the processor.

    As it may wait for ever, many times as long by the clock is late, too: a machine that is busy
    with other things makes nothing late before. `took`: by the clock [s]. `used`: processor time
    that does not count [s].
    """
    if took < seconds:
        return False
    return took > _WAITING * seconds or processor_time(pid) - used > seconds


def processor_time(pid: int) -> float:
    """Seconds of a process, and of those that it started and that have ended."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, words[11:15])) / os.sysconf("SC_CLK_TCK")


def _all_of(stream: IO[bytes]) -> str:
    with stream:
        return stream.read().decode("utf-8", "backslashreplace")


def wgmb(*arguments: object, **options: Any) -> Ended:
    """Run the command line, as `run` does."""
    return run([*WGMB, *arguments], **options)


def apart(work: Callable[..., Any], *given: Any, **options: Any) -> Ended:
    """Call a function of a module in a process of its own, as `run` does.

    What it is given and what it returns is JSON; the latter is in `value`, None if it did
    not come to its end.
    """
    name = f"{work.__module__}:{work.__qualname__}"
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:  # arguments have a limit
        json.dump(given, file)
        file.flush()
        folder = Path(inspect.getfile(work)).parent
        line = [sys.executable, "-P", "-m", __name__, name, file.name, folder]
        ended = run(line, **options)
    said, _, value = ended.out.rpartition(_ENDS)
    value = json.loads(value) if value and ended.code == 0 else None
    return Ended(**{**vars(ended), "out": said, "value": value})


def environment(more: dict[str, Any] | None = None) -> dict[str, str]:
    """This process's environment, in which `wgmb`, these modules and tests' helpers are found."""
    paths = [*PATHS, *filter(None, [os.environ.get("PYTHONPATH")])]
    found = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    return found | {name: str(value) for name, value in (more or {}).items()}


def limits(memory: int | None = None, file: int | None = None) -> Callable[[], None]:
    """For `prepare`: at most so many MiB of address space, so many bytes in a file."""

    def prepare() -> None:
        if memory is not None:
            resource.setrlimit(resource.RLIMIT_AS, (memory << 20, memory << 20))
        if file is not None:  # as on a full disk: an error, not a signal
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (file, file))

    return prepare


@dataclass(frozen=True)
class Use:
    """Memory of a process at a time."""

    memory: float  # KiB of it in RAM
    files: int
    threads: int


def use(pid: int | str = "self") -> Use:
    """Memory of a process now."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    listed = (len(os.listdir(f"/proc/{pid}/{what}")) for what in ("fd", "task"))
    return Use(pages * resource.getpagesize() / 1024, *listed)


def growth(step: Callable[[int], object], warm: int = 40, count: int = 120) -> float:
    """KiB that a step leaves behind, on average, once `warm` of them have been made."""
    for i in range(warm):
        step(i)
    start = use().memory
    for i in range(warm, warm + count):
        step(i)
    return (use().memory - start) / count


if __name__ == "__main__":
    sys.path.append(sys.argv[3])
    _module, _, _function = sys.argv[1].partition(":")
    _work = getattr(importlib.import_module(_module), _function)
    _value = _work(*json.loads(Path(sys.argv[2]).read_text()))
    sys.stdout.write(_ENDS + json.dumps(_value))
    sys.stdout.flush()
