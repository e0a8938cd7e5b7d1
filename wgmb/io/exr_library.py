"""The OpenEXR library among threads: its pool, its messages, forks and the end of the process.

Any number of threads may be inside the library at once. A fork and the end of the process wait
until all have left it: a child would wait for threads that it does not have, and a thread that
ends within the library takes the process down.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Iterator
from typing import Any

import OpenEXR

from .limits import MOST_PIXELS_A_SIDE

_MOST_THREADS = 8
_SIEVES = 8  # kept, for as many streams
_CHATTER = "Warning: Exception raised reading pixel data"


class _Gate:
    """Tracks threads inside the library; closed while a thread forks or the process ends."""

    def __init__(self):
        self._changed = threading.Condition()
        self._inside: set[int] = set()
        self._shut_by: int | None = None
        self._ready = False

    @contextlib.contextmanager
    def __call__(self) -> Iterator[None]:
        me = threading.get_ident()
        with self._changed:
            self._changed.wait_for(lambda: self._shut_by in (None, me))
            if not self._ready:
                _prepare()
                self._ready = True
            self._inside.add(me)
        try:
            yield
        finally:
            with self._changed:
                self._inside.discard(me)
                self._changed.notify_all()

    def shut(self) -> None:
        """Let no other thread in, and wait until none is inside."""
        me = threading.get_ident()
        with self._changed:
            self._changed.wait_for(lambda: self._shut_by in (None, me))
            self._shut_by = me
            self._changed.wait_for(lambda: not self._inside - {me})

    def open(self) -> None:
        """Let threads in again."""
        with self._changed:
            self._shut_by = None
            self._changed.notify_all()


def _prepare() -> None:
    OpenEXR.setMaxImageSize(MOST_PIXELS_A_SIDE, MOST_PIXELS_A_SIDE)
    OpenEXR.setMaxTileSize(MOST_PIXELS_A_SIDE, MOST_PIXELS_A_SIDE)
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    threads = OpenEXR.global_thread_count() or min(cores, _MOST_THREADS)
    OpenEXR.set_global_thread_count(0)  # a forked child has lost those that are counted
    with contextlib.suppress(RuntimeError):  # no room for threads: the library does without
        OpenEXR.set_global_thread_count(threads)


inside = _Gate()
"""`with inside():` around every call of the library."""
atexit.register(inside.shut)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=inside.shut, after_in_parent=inside.open, after_in_child=inside.__init__
    )


class _Sieve:
    """A text stream that holds back the library's messages."""

    def __init__(self, stream: Any, heard: dict[int, list[str]]):
        self.stream, self._heard = stream, heard

    def write(self, text: str) -> int:
        heard = self._heard.get(threading.get_ident())
        if heard is None:
            return self.stream.write(text)
        within = heard and not heard[-1].endswith("\n")
        if not within and not text.startswith(_CHATTER):
            return self.stream.write(text)
        heard.append(text)
        return len(text)

    def __getattr__(self, name: str):
        return getattr(self.stream, name)


class _Hush:
    """Holds back the library's output. All threads share one redirection: the first to come
    begins it, the last to leave ends it.
    """

    def __init__(self):
        self._heard: dict[int, list[str]] = {}  # by thread
        self._mutex = threading.Lock()
        self._sieves: list[_Sieve] = []
        self._undo = contextlib.ExitStack()

    @contextlib.contextmanager
    def __call__(self) -> Iterator[list[str]]:
        me, heard = threading.get_ident(), []
        with self._mutex:
            if not self._heard:
                self._begin()
            self._heard[me] = heard
        try:
            yield heard
        finally:
            with self._mutex:
                del self._heard[me]
                if not self._heard:
                    self._undo.close()

    def _begin(self) -> None:
        with contextlib.ExitStack() as undo:
            if _apart():
                nowhere = os.open(os.devnull, os.O_WRONLY)
                undo.callback(os.close, nowhere)
                for fd in (1, 2):
                    kept = os.dup(fd)
                    undo.callback(os.close, kept)
                    undo.callback(os.dup2, kept, fd)
                    os.dup2(nowhere, fd)
            before = sys.stdout
            if isinstance(before, _Sieve):  # an old one, which somebody put back
                before = before.stream
            stream = before if before is not None else undo.enter_context(open(os.devnull, "w"))
            sys.stdout = sieve = self._sieve_of(stream)
            undo.callback(_put_back, before, sieve)
            self._undo = undo.pop_all()

    def _sieve_of(self, stream: Any) -> _Sieve:
        """The sieve before a stream, the same one every time.

        `print` in another thread may be within one that is no longer sys.stdout, and does not hold
        it: so they are kept.
        """
        for sieve in self._sieves:
            if sieve.stream is stream:
                return sieve
        self._sieves = [*self._sieves[-_SIEVES:], _Sieve(stream, self._heard)]
        return self._sieves[-1]


def _put_back(before: Any, sieve: _Sieve) -> None:
    if sys.stdout is sieve:  # else it is somebody else's by now
        sys.stdout = before


def _apart() -> bool:
    """Return True if Python's own streams do not use descriptors 1 and 2."""
    try:
        return sys.stdout.fileno() != 1 and sys.stderr.fileno() != 2
    except (OSError, ValueError, AttributeError):
        return False


hushed = _Hush()
"""`with hushed() as heard:` within `inside()`: `heard` gets the library's messages to this thread.

All output of native code on descriptors 1 and 2 gets lost then; so it is held back only where
Python's own streams live elsewhere, to which the command line moves them.
"""
