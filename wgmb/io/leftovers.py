"""Temporary files, folders and processes that a program leaves which ends in the middle.

Who begins one adds the way to remove it, and forgets it once it is gone. A program that cannot
wait for its own threads removes all of them, the newest first, before it ends.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Hashable, Iterator

from ..threads import begin

_ONE = 0.5  # seconds that one of them may take: its disk may not answer

_removals: dict[Hashable, Callable[[], object]] = {}
_last: dict[Hashable, Callable[[], object]] = {}
_is_over: list[bool] = []  # not empty once all are removed


def add(key: Hashable, remove: Callable[[], object]) -> None:
    """Have `remove` called where the program ends in the middle.

    KeyboardInterrupt where it is ending already: nothing more is to begin.
    """
    _removals[key] = remove
    if _is_over:
        raise KeyboardInterrupt


def add_last(key: Hashable, remove: Callable[[], object]) -> None:
    """The same for what Python removes by itself, unless the process ends without that."""
    _last[key] = remove


def forget(key: Hashable) -> None:
    """It is gone, or complete."""
    _removals.pop(key, None)


@contextlib.contextmanager
def removed_by(remove: Callable[[], object]) -> Iterator[None]:
    """The same for the time of a `with`, which removes it itself."""
    key = object()
    add(key, remove)
    try:
        yield
    finally:
        forget(key)


def remove_all(seconds: float, *, is_last: bool = False) -> None:
    """Remove them, in so many seconds at most; nothing can be begun from now on.

    `is_last`: the process ends now, without what Python does at its end.
    """
    _is_over.append(True)
    until = time.monotonic() + seconds
    removals = [*(_last.values() if is_last else ()), *_removals.values()]
    for remove in reversed(removals):
        rest = until - time.monotonic()
        if rest <= 0:
            return
        begin(_quietly(remove), "leftovers").join(min(rest, _ONE))


def _quietly(remove: Callable[[], object]) -> Callable[[], None]:
    def removed() -> None:
        with contextlib.suppress(Exception):
            remove()

    return removed
