"""Files that state more than they hold: every count, size, offset and dimension, one at a time.

Each kind of file has one small sound file, and a generator that makes the number at one place too
large. `wgmb info` and `wgmb blur` are then run on each, and the blur of some as by default too,
with searched motion: they end within 10 s of the processor and 1 GB, with one line that names the
file, or with the right picture.

A picture is right if it equals the sound file's, or the result of the same command on a copy that
another library makes of the changed file (`copies`), or if a line on standard error, without `-q`,
names the file and tells the loss. Anything else is wrong, also where the other library reads
nothing.

A command is run in a process forked from this one, which has imported wgmb already; so this
process must have neither threads nor a GPU device (see `apart`).
"""

from __future__ import annotations

import contextlib
import importlib
import operator
import os
import pkgutil
import re
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ..processes import apart
from ..table import Line, Tally, Trial, row

MOST_SECONDS, MOST_MB = 10.0, 1024.0  # of the processor; MiB that the process holds
DEAF_SECONDS = 2.0  # of the processor, after an interruption
_LOOK = 0.01  # s between two looks at a process
_IDLE = 30.0  # s without a tick of the processor: it waits for something that never comes
_TICK = os.sysconf("SC_CLK_TCK")
_EVERY = 8  # files of which one is blurred as by default too, with its motion searched
_PLAINER = "--flow none", "--method tap"  # that the other blurs say, to be quicker
_LOSS = re.compile(
    "could not be decoded|damaged|cut off|left out|lost|another size|not kept|not read"
)
_SKIPPED = ("wgmb.viewer", "wgmb.hosts", "wgmb.lab", "wgmb.__main__")

Mutations = Callable[[bytes], Iterator[tuple[str, bytes]]]
Commands = Callable[[Path, Path], list[list[Any]]]


@dataclass(frozen=True)
class StatedKind:
    """A kind of file whose stated numbers are made too large.

    `write`: makes the sound file at a path. `mutations`: of its bytes, the name and the bytes of
    each changed file. `commands`: the words of every command, for the file and for its output.
    `digest`: of the output's content. `copy`: writes what another library reads in a file, with
    all that the commands need beside it, to another path. `same`: whether two digests are of one
    picture.
    """

    suffix: str
    write: Callable[[Path], object]
    mutations: Mutations
    commands: Commands
    digest: Callable[[Path], str]
    copy: Callable[[Path, Path], object]
    copied: str
    """The suffix of a copy."""
    made: str
    """The suffix of the output."""
    same: Callable[[str, str], bool] = operator.eq


_MODULES = ("stills", "frames", "tables", "videos")  # of this package; each has KINDS


def all_kinds() -> dict[str, StatedKind]:
    """Every kind of file by its name, of all modules."""
    modules = [importlib.import_module(f"{__name__}.{name}") for name in _MODULES]
    return {name: kind for module in modules for name, kind in module.KINDS.items()}


class Measured(NamedTuple):
    """The end of a command, and what it took."""

    exit: int  # -9: by signal 9, which is also what ends a command that is stopped here
    cpu_s: float
    peak_mb: float  # MiB
    line: str  # all that it said on stderr
    digest: str = ""  # of the output, where the exit is 0 and there is one
    ended: str = ""  # why it was stopped here, "" if it ended by itself


def too_large(
    data: bytes, at: int, form: str, *, less: tuple[int, ...] = ()
) -> Iterator[tuple[str, bytes]]:
    """`data` with the number of struct format `form` at offset `at` made too large, in four ways.

    The ways: one more, 1000 times as many, half of the largest and the largest that fits; and
    the numbers of `less`.
    """
    size = struct.calcsize(form)
    (now,) = struct.unpack_from(form, data, at)
    bits = 8 * size - (form[-1].islower())
    for value in dict.fromkeys(
        (now + 1, 1000 * (now + 1), 2 ** (bits - 1) - 1, 2**bits - 1, *less)
    ):
        with contextlib.suppress(struct.error):  # it does not fit
            yield f"{value}", data[:at] + struct.pack(form, value) + data[at + size :]


# ---- one command ------------------------------------------------------------------------------


def measure(
    words: list[Any],
    output: Path | None = None,
    digest: Callable[[Path], str] | None = None,
    *,
    interrupt: float | None = None,
) -> Measured:
    """Run the command line in a forked process; it is stopped at the limits of this module.

    `digest` is called with `output` in that process, after a command that ended with 0.
    `interrupt`: it gets Ctrl-C after so many seconds of the processor.
    """

    def main() -> int:
        from wgmb.cli import app

        return app.main([str(word) for word in words])

    return _measured(main, output, digest, interrupt)


def _measured(
    work: Callable[[], int],
    output: Path | None = None,
    digest: Callable[[Path], str] | None = None,
    interrupt: float | None = None,
) -> Measured:
    """The same for a function that returns the exit code."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as told:
        if (pid := os.fork()) == 0:
            _child(work, output, digest, said.fileno(), told.fileno())
        ended = _watch(pid, interrupt)
        _, status, used = os.wait4(pid, 0)
        said.seek(0)
        told.seek(0)
        return Measured(
            os.waitstatus_to_exitcode(status),
            used.ru_utime + used.ru_stime,
            used.ru_maxrss / 1024,
            said.read().decode("utf-8", "backslashreplace").strip(),
            told.read().decode(),
            ended,
        )


def _child(
    work: Callable[[], int],
    output: Path | None,
    digest: Callable[[Path], str] | None,
    said: int,
    told: int,
) -> None:
    """In the child: the work, then the digest of its output; does not return."""
    code = 70
    try:
        nowhere = os.open(os.devnull, os.O_RDWR)
        for descriptor, to in ((nowhere, 0), (nowhere, 1), (said, 2)):
            os.dup2(descriptor, to)
        code = work()
        if code == 0 and digest is not None and output is not None and output.exists():
            os.write(told, digest(output).encode())
        sys.stderr.flush()
    except BaseException:
        os.write(said, traceback.format_exc().encode())
    finally:
        os._exit(code)


def _watch(pid: int, interrupt: float | None) -> str:
    """Wait for the end of a process; at a limit, kill it and return which one."""
    before, moved, interrupted = -1.0, time.monotonic(), 0.0
    while True:
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
            return ""
        seconds, memory = _used(pid)
        if seconds != before:
            before, moved = seconds, time.monotonic()
        if interrupt is not None and not interrupted and seconds > interrupt:
            os.kill(pid, signal.SIGINT)
            interrupted = seconds
        why = ""
        if interrupted and seconds > interrupted + DEAF_SECONDS:
            why = f"deaf: {DEAF_SECONDS:g} s after Ctrl-C"
        elif seconds > MOST_SECONDS:
            why = f"over {MOST_SECONDS:g} s of the processor"
        elif memory > MOST_MB:
            why = f"over {MOST_MB:g} MiB"
        elif time.monotonic() - moved > _IDLE:
            why = f"waits for over {_IDLE:g} s"
        if why:
            os.kill(pid, signal.SIGKILL)
            return why
        time.sleep(_LOOK)


def _used(pid: int) -> tuple[float, float]:
    """Seconds of the processor and MiB that a process has used; 0, 0 once it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
        pages = int(Path(f"/proc/{pid}/statm").read_bytes().split()[1])
    except (OSError, IndexError):
        return 0.0, 0.0
    return (int(fields[11]) + int(fields[12])) / _TICK, pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def fault(measured: Measured, path: Path) -> str:
    """The fault in the end of a command on `path`, apart from its picture; "" if there is none."""
    code, cpu_s, peak_mb, line, _, ended = measured
    if ended:
        return f"{ended} ({cpu_s:.1f} s, {peak_mb:.0f} MiB)"
    if cpu_s > MOST_SECONDS or peak_mb > MOST_MB:
        return f"{cpu_s:.1f} s, {peak_mb:.0f} MiB"
    if "Traceback" in line:
        return f"traceback: {line.splitlines()[-1]}"
    if code == 0:
        return ""
    if code not in (1, 2):
        return f"exit {code}: {line}"
    first, *more = line.splitlines() or [""]
    if [text for text in more if not text.endswith(" failed")]:  # how many frames
        return f"more than a line: {line}"
    return "" if f"/{path.stem}." in first else f"does not name the file: {line}"


# ---- many files -------------------------------------------------------------------------------


def prepare() -> None:
    """Import all that a command needs, so that a forked process need not."""
    import wgmb

    os.environ.setdefault("XDG_RUNTIME_DIR", os.devnull)  # a driver complains where it is missing
    for module in pkgutil.walk_packages(wgmb.__path__, "wgmb."):
        if not module.name.startswith(_SKIPPED):
            with contextlib.suppress(ImportError):
                importlib.import_module(module.name)
    for name in (
        "av",
        "cv2",
        "tifffile",
        "imageio.v3",
        "PIL.Image",
        "PyOpenColorIO",
        "opentimelineio",
    ):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def tried(names: list[str], count: int, folder: str) -> dict[str, dict[str, Any]]:
    """In a process of its own: at most `count` changed files of each kind, evenly spaced.

    By kind: "files", "seconds", "mb" (the worst), "wrong" (a text for each fault).
    """
    prepare()
    kinds = all_kinds()
    return {name: _tried(name, kinds[name], count, Path(folder) / name) for name in names}


def _tried(name: str, kind: StatedKind, count: int, folder: Path) -> dict[str, Any]:
    folder.mkdir()
    path, output = folder / f"{name}{kind.suffix}", folder / f"out{kind.made}"
    _written(kind.write, path)
    data = path.read_bytes()
    commands = _commands(kind, path, output)
    found = {"files": 0, "seconds": 0.0, "mb": 0.0, "slowest": "", "largest": "", "wrong": []}
    sound = [_of_sound(words, output, kind) for words in commands]
    cases = list(kind.mutations(data))
    count = min(count, len(cases))
    for n, (what, changed) in enumerate(cases[i * len(cases) // count] for i in range(count)):
        path.write_bytes(changed)
        found["files"] += 1
        chosen = len(commands) if n % _EVERY == 0 else len(commands) - 1
        for which, words in enumerate(commands[:chosen]):
            _clear(output)
            measured = measure(words, output, kind.digest)
            wrong = fault(measured, path)
            if not wrong and measured.cpu_s > DEAF_SECONDS:
                _clear(output)
                again = measure(words, interrupt=measured.cpu_s / 4)
                wrong = again.ended
            wrong = wrong or _wrong_picture(kind, path, output, which, measured, sound[which])
            case = f"{words[0]}{' by default' * (which == len(commands) - 1)}: {what}"
            if wrong:
                found["wrong"].append(f"{case}: {wrong}")
            for key, name_of, value in (
                ("seconds", "slowest", measured.cpu_s),
                ("mb", "largest", measured.peak_mb),
            ):
                if value > found[key]:
                    found[key], found[name_of] = value, case
    return found


def _commands(kind: StatedKind, path: Path, output: Path) -> list[list[Any]]:
    """All commands on a file; the last one is the last of its kind as by default."""
    commands = kind.commands(path, output)
    return [*commands, _by_default(commands[-1])]


def _wrong_picture(
    kind: StatedKind, path: Path, output: Path, which: int, measured: Measured, sound: str
) -> str:
    """The fault in the picture of command number `which`, "" where it is right.

    `sound`: the digest of the sound file's output.
    """
    if measured.exit or measured.digest == sound or kind.same(measured.digest, sound):
        return ""
    copy = path.with_name(f"copy{kind.copied}")
    for old in path.parent.glob("copy*"):
        old.unlink()
    _clear(output)
    made = _measured(lambda: int(kind.copy(path, copy) is not None))
    is_read = made.exit == 0 and copy.exists()
    why = "no other library reads one" if not is_read else "a copy gives another"
    if is_read:
        right = measure(_commands(kind, copy, output)[which], output, kind.digest)
        if right.exit == 0 and kind.same(measured.digest, right.digest):
            return ""
    _clear(output)
    told = measure([word for word in _commands(kind, path, output)[which] if word != "-q"])
    if any(path.name in line and _LOSS.search(line) for line in told.line.splitlines()):
        return ""
    return f"another picture; {why} ({made.line[-100:]}), and no line tells: {told.line[-300:]}"


def _by_default(words: list[str]) -> list[str]:
    """The words of a command without those that make it quicker."""
    plain = [word for pair in _PLAINER for word in pair.split()]
    return [word for word in words if word not in plain]


def _written(write: Callable[[Path], object], path: Path) -> None:
    """Write the sound file in a forked process, as its libraries start threads."""
    if (pid := os.fork()) == 0:
        code = 1
        try:
            write(path)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    if os.waitpid(pid, 0)[1]:
        raise RuntimeError(f"{path.name} could not be written")


def _of_sound(words: list[Any], output: Path, kind: StatedKind) -> str:
    """The digest of what a command makes of the sound file; RuntimeError if it fails."""
    _clear(output)
    measured = measure(words, output, kind.digest)
    if measured.exit or measured.ended:
        raise RuntimeError(f"{' '.join(map(str, words))}: {measured}")
    return measured.digest


def _clear(output: Path) -> None:
    output.unlink(missing_ok=True)


@row(quick=12, full=100_000)
def stated(trial: Trial) -> Iterator[Line]:
    """Files of every kind that state counts, sizes and offsets that are too large."""
    for name in sorted(all_kinds()):
        ended = apart(tried, [name], trial.count, str(trial.folder), seconds=7200)
        if ended.value is None:
            raise RuntimeError(f"{name}: exit {ended.code}: {ended.err[-400:]}")
        found = ended.value[name]
        tally = Tally(f"stated too large: {name}", "files", found["files"], found["wrong"])
        yield tally.line(
            f"{found['seconds']:.1f} s ({found['slowest']}), "
            f"{found['mb']:.0f} MiB ({found['largest']})"
        )
