"""Work beside the main thread: pictures read ahead, results written behind."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

_Item = TypeVar("_Item")
_POLL = 0.05  # seconds after which a thread looks whether it should stop


def ahead(items: Iterator[_Item], count: int) -> Iterator[_Item]:
    """The items, up to `count` of them made beforehand in a thread of their own.

    What the thread raises is raised here; it ends when nobody reads on.
    """
    made: queue.Queue[tuple[bool, _Item | BaseException | None]] = queue.Queue(count)
    stop = threading.Event()

    def put(entry: tuple[bool, _Item | BaseException | None]) -> None:
        while not stop.is_set():
            try:
                made.put(entry, timeout=_POLL)
                return
            except queue.Full:
                continue

    def make() -> None:
        try:
            for item in items:
                put((True, item))
                if stop.is_set():
                    return
            put((False, None))
        except BaseException as error:  # raised where the items are read
            put((False, error))

    thread = threading.Thread(target=make, name="ahead", daemon=True)
    thread.start()
    try:
        while True:
            is_item, value = _taken(made)
            if is_item:
                yield value  # pyright: ignore[reportReturnType]
            elif isinstance(value, BaseException):
                raise value
            else:
                return
    finally:
        stop.set()
        thread.join(1.0)


def _taken(made: queue.Queue) -> tuple:  # pyright: ignore[reportMissingTypeArgument]
    while True:
        try:
            return made.get(timeout=_POLL)
        except queue.Empty:
            continue


class Behind(Generic[_Item]):
    """Calls `work` with items in a thread of its own, in their order, at most `count` behind.

    `with Behind(work) as put:`; what it raises is raised by the next `put`, or at the end.
    """

    def __init__(self, work: Callable[[_Item], None], count: int = 2):
        self._work, self._items = work, queue.Queue[_Item | None](count)
        self._error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="behind", daemon=True)

    def __enter__(self) -> Callable[[_Item], None]:
        self._thread.start()
        return self._put

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._stop.set()
            self._thread.join(1.0)
            return
        self._enqueue(None)
        while self._thread.is_alive():  # a join without limit would hold back Ctrl-C
            self._thread.join(_POLL)
        if self._error is not None:
            raise self._error

    def _put(self, item: _Item) -> None:
        if self._error is not None:
            raise self._error
        self._enqueue(item)

    def _enqueue(self, item: _Item | None) -> None:
        while self._error is None:
            try:
                self._items.put(item, timeout=_POLL)
                return
            except queue.Full:
                continue

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                item = self._items.get(timeout=_POLL)
            except queue.Empty:
                continue
            if item is None:
                return
            try:
                self._work(item)
            except BaseException as error:  # raised in the main thread
                self._error = error
                return
