"""Work in a thread of its own, so that a stop is heard while a picture is being made."""

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

POLL = 0.1  # seconds between two looks at whether the user wants to stop
_MOST = 2  # items that wait to be taken


class StoppedError(Exception):
    """Ends the work, whose results nobody wants any more."""


class Handle:
    """The state of the work: a place for its items, and the request to stop."""

    def __init__(self):
        self._stop = threading.Event()
        self._items: queue.Queue[Any] = queue.Queue(_MOST)

    def check(self) -> None:
        """Raise StoppedError if the work should end."""
        if self._stop.is_set():
            raise StoppedError

    def put(self, item: Any) -> None:
        """Hand an item over; StoppedError if nobody takes it."""
        while True:
            self.check()
            try:
                return self._items.put(item, timeout=POLL)
            except queue.Full:
                continue


def watched(work: Callable[[Handle], Any], check: Callable[[], None]) -> Iterator[Any]:
    """The items that `work` puts into its handle, until it returns.

    `check` is called ten times a second. What it raises, or the work, is raised here at once; the
    work then ends by itself, with StoppedError, as soon as it puts or checks something.
    """
    handle, ended = Handle(), object()
    raised: list[BaseException] = []

    def run() -> None:
        try:
            work(handle)
        except StoppedError:
            return
        except BaseException as error:
            raised.append(error)
        try:
            handle.put(ended)
        except StoppedError:
            return

    threading.Thread(target=run, name="wgmb", daemon=True).start()
    try:
        while True:
            check()
            try:
                item = handle._items.get(timeout=POLL)
            except queue.Empty:
                continue
            if item is ended:
                break
            yield item
    finally:
        handle._stop.set()
    if raised:
        raise raised[0]
