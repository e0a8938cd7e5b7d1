"""Atomic file writes: a file is complete under its name, or does not exist.

A file is written beside its name under a temporary one, which tells the host and the process
that write it, and is then renamed. Several processes, on several hosts, may therefore write
into one folder: whoever opens a finished name reads a whole file. A file that is made of others
is readable by nobody who may not read them.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import socket
import stat
import sys
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

from . import leftovers

Buffer = bytes | memoryview

try:
    import fcntl
except ImportError:  # Windows, where a file that is open cannot be removed
    fcntl = None

PUBLIC = 0o666  # permissions of a file that is made of no other; the umask takes some away
_MOST_OF_A_NAME = 190  # bytes of it in the temporary one: file systems take 255 in all
_HOST = re.sub(r"[^A-Za-z0-9_]", "_", socket.gethostname())[:32] or "host"
_TEMPORARY = re.compile(r"\.(?P<name>.+)\.(?P<host>\w+)-(?P<process>\d+)-[0-9a-f]{8}\.part", re.S)


def mode_of(folder: Path, inputs: Iterable[Path]) -> int:
    """Permissions, before the umask, of a file in `folder` that is made of the files `inputs`.

    Everybody else may read it who may read each of them; its owner may always. Others than files,
    such as pipes, count for nothing. Where the new file is of another group than an input, that
    group may read it if all others may read the input.
    """
    if os.name == "nt":  # permissions are the folder's there
        return PUBLIC
    group, readers = _group_in(folder), 0o044
    for path in inputs:
        try:
            status = os.stat(path)
        except OSError:  # it is not there yet, or is no file
            continue
        if stat.S_ISREG(status.st_mode):
            all_others = status.st_mode >> 3 & status.st_mode & 0o004
            readers &= status.st_mode if status.st_gid == group else all_others << 3 | all_others
    return 0o600 | readers | readers >> 1


def _group_in(folder: Path) -> int:
    """The group of new files in a folder."""
    try:
        found = os.stat(folder)
    except OSError:  # it is going to be made
        return os.getegid()
    inherits = sys.platform != "linux" or found.st_mode & stat.S_ISGID
    return found.st_gid if inherits else os.getegid()


def write_file(
    path: Path, *pieces: Buffer, temporary: Path | None = None, mode: int = PUBLIC
) -> None:
    """Put the pieces, one after the other, at `path`: under a temporary name, then renamed.

    `mode`: the permissions; `mode_of` has those of a file that is made of others. Raises OSError,
    whose text names `path`, and then nothing has changed.
    """
    temporary = temporary or temporary_name(path)
    try:
        with os.fdopen(create(temporary, mode), "wb") as file:
            for piece in pieces:
                file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        rename(temporary, path)
    except OSError as error:
        remove(temporary)
        raise about(path, error) from None
    except BaseException:
        remove(temporary)
        raise


def temporary_name(path: Path) -> Path:
    """A name beside `path` that no other process, and no other call, uses."""
    end = f".{_HOST}-{os.getpid()}-{secrets.token_hex(4)}.part"
    return path.with_name(f".{_begin(path.name)}{end}")


def _begin(name: str) -> str:
    """As much of a name as a temporary one can hold."""
    encoded = os.fsencode(name)
    if len(encoded) <= _MOST_OF_A_NAME:
        return name
    return encoded[:_MOST_OF_A_NAME].decode(errors="ignore")


def create(temporary: Path, mode: int = PUBLIC) -> int:
    """Create the file and open it for writing; returns its descriptor.

    `mode`: see `write_file`. Raises FileExistsError where there is anything under that name, a link
    too. While the descriptor is open the file is locked, so that other processes see that it is in
    use.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    leftovers.add(temporary, lambda: temporary.unlink(missing_ok=True))
    try:
        descriptor = os.open(temporary, flags, mode)
    except BaseException:  # what is there is not ours
        leftovers.forget(temporary)
        raise
    if fcntl is not None:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return descriptor


def remove(temporary: Path) -> None:
    """Remove a file that `create` made, if it is still there."""
    temporary.unlink(missing_ok=True)
    leftovers.forget(temporary)


def rename(temporary: Path, path: Path, *, is_new: bool = False) -> None:
    """Give a finished file its name, and wait until the folder is on disk.

    Raises FileExistsError where something else than a file has it, such as a pipe or a device; if
    it `is_new`, where there is anything under that name.
    """
    if is_new and os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, "was written by another process during this run")
    if path.exists() and not path.is_file():
        raise FileExistsError(errno.EEXIST, "exists and is not a file")
    os.replace(temporary, path)
    leftovers.forget(temporary)
    if os.name == "nt":  # folders cannot be opened there
        return
    with contextlib.suppress(OSError):  # a folder that may be written but not read
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def about(path: Path, error: Exception) -> OSError:
    """The error with a text that names the file it is about; its number stays."""
    named = OSError(f"{path}: {getattr(error, 'strerror', None) or error}")
    named.errno = getattr(error, "errno", None)
    return named


def is_temporary(name: str) -> bool:
    """Return True for a name that `temporary_name` may have made, on any host."""
    return _TEMPORARY.fullmatch(name) is not None


def sweep(folder: Path, names: Collection[str] | Callable[[str], bool]) -> None:
    """Remove unfinished files with these names of dead processes of this host.

    `names`: all of them, or a function that tells whether a name is one of them.
    """
    left = [m for m in map(_TEMPORARY.fullmatch, os.listdir(folder)) if m and m["host"] == _HOST]
    if not left:
        return
    if not callable(names):
        names = {_begin(name) for name in names}.__contains__
    for m in left:
        path = folder / m[0]
        if names(m["name"]) and _is_left(path, int(m["process"])):
            with contextlib.suppress(OSError):  # of somebody else
                path.unlink()


def _is_left(path: Path, process: int) -> bool:
    """Return True if the process that wrote `path` has ended."""
    if process == os.getpid() or fcntl is None:
        return process != os.getpid()
    if not _has_ended(process):
        return False
    # A process of another container may have that number: it holds a lock.
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return True


def _has_ended(process: int) -> bool:
    """Return True if there is no such process, or if only its exit status is left (Linux)."""
    with contextlib.suppress(ProcessLookupError):
        with contextlib.suppress(PermissionError):  # somebody else's process
            os.kill(process, 0)
        with contextlib.suppress(OSError):  # another system has no such file
            stat = Path(f"/proc/{process}/stat").read_bytes()
            return stat.rpartition(b")")[2].split()[:1] == [b"Z"]
        return False
    return True
