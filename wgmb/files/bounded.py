"""Files that are read whole: regular ones of a bounded size.

A pipe would be waited for, and a device such as /dev/zero has no end; so both, and links to them,
are refused before they are opened.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ..errors import InputError
from .near import near


def check(path: Path, most: int, kind: str) -> None:
    """Raise InputError unless `path` is a regular file of at most `most` bytes.

    `kind`: of the file, for the message, such as "a camera file". OSError if it is not there.
    """
    _check(path, os.stat(path), most, kind)


def read(path: Path, most: int, kind: str) -> bytes:
    """The bytes of a regular file of at most `most` bytes; InputError for others, as `check`.

    OSError where the system refuses it.
    """
    check(path, most, kind)
    with open(path, "rb", opener=_without_waiting) as file:
        _check(path, os.fstat(file.fileno()), most, kind)
        data = file.read(most + 1)
    if len(data) > most:
        raise _too_large(path, most, kind)
    return data


def missing(path: Path) -> InputError:
    """The error for a path where a regular file was expected: what is there instead."""
    if path.is_dir():
        return InputError(f"{path}: is a folder, not a file")
    if path.exists():
        return InputError(f"{path}: is a pipe or a device")
    if not path.parent.is_dir():
        return InputError(f"{path}: no such file; there is no folder {path.parent}")
    meant = near(path)
    return InputError(
        f"{path}: no such file" + (f"; did you mean '{path.with_name(meant)}'?" if meant else "")
    )


def _without_waiting(path: str, flags: int) -> int:
    """Open a file that may have become a pipe since it was looked at."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _check(path: Path, status: os.stat_result, most: int, kind: str) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder, expected {kind}")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a pipe or a device, expected {kind}")
    if status.st_size > most:
        raise _too_large(path, most, kind)


def _too_large(path: Path, most: int, kind: str) -> InputError:
    return InputError(f"{path}: over {most >> 20} MiB, too large for {kind}")
