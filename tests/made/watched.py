"""A watch on a file, which tells whether anybody opens it: inotify; Linux only."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

_IN_OPEN = 0x20


class Watched:
    """A file; `was_opened` tells whether it has been opened since it was asked last."""

    def __init__(self, path: Path):
        library = ctypes.CDLL(None, use_errno=True)
        self._events = library.inotify_init1(os.O_NONBLOCK)
        if self._events < 0 or library.inotify_add_watch(self._events, bytes(path), _IN_OPEN) < 0:
            raise OSError(ctypes.get_errno(), "inotify", str(path))

    def was_opened(self) -> bool:
        """Return True if it was."""
        try:
            return bool(os.read(self._events, 1 << 16))
        except BlockingIOError:
            return False

    def close(self) -> None:
        """Watch it no more."""
        os.close(self._events)
