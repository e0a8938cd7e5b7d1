"""Pipes: the standard streams, which a command line calls `-`, and named pipes."""

from __future__ import annotations

import errno
import os
import stat
from typing import BinaryIO

from ..errors import counted

STDIN, STDOUT = "/dev/stdin", "/dev/stdout"


def is_pipe(name: str) -> bool:
    """Return True for the standard streams and for a named pipe."""
    try:
        return name in (STDIN, STDOUT) or stat.S_ISFIFO(os.stat(name).st_mode)
    except (OSError, ValueError):
        return False


class PipeWriter:
    """An unbuffered stream whose `write` takes all bytes.

    OSError that says how many pictures were written, if the stream's reader is gone.
    """

    def __init__(self, stream: BinaryIO):
        self._stream, self.pictures = stream, 0

    def write(self, data: bytes) -> int:
        """Write all of it."""
        rest = memoryview(data)
        try:
            while rest:  # a pipe may take a part
                rest = rest[self._stream.write(rest) :]
        except BrokenPipeError:
            text = f"the reader closed the pipe after {counted(self.pictures, 'picture')}"
            raise OSError(errno.EPIPE, text) from None
        return len(data)
