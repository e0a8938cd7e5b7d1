"""Work beside the caller's thread: items made ahead of it, results worked on behind it.

Threads start here and nowhere else.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Generic, TypeVar, cast

_Item = TypeVar("_Item")
_POLL = 0.05  # seconds after which a thread looks whether it should stop

Stop = threading.Event
"""Request to end, which any thread may make: once it is set, nothing else is begun."""


def begin(work: Callable[[], None], name: str) -> threading.Thread:
    """Run `work` in a thread of its own, which does not keep the program alive."""
    thread = threading.Thread(target=work, name=name, daemon=True)
    thread.start()
    return thread


def crew(count: int, name: str) -> ThreadPoolExecutor:
    """As many threads, for calls whose results are waited for."""
    return ThreadPoolExecutor(count, name)


def within(seconds: float, call: Callable[[], _Item], name: str = "within") -> _Item:
    """The result of a call, or its error, made in a thread of its own.

    TimeoutError if it takes longer: it goes on alone then.
    """
    answers: queue.SimpleQueue[tuple[_Item | None, BaseException | None]] = queue.SimpleQueue()

    def make() -> None:
        try:
            answers.put((call(), None))
        except BaseException as error:  # raised in the caller's thread
            answers.put((None, error))

    begin(make, name)
    try:
        value, error = answers.get(timeout=seconds)
    except queue.Empty:
        raise TimeoutError(f"no answer in {seconds:g} s") from None
    if error is not None:
        raise error
    return cast(_Item, value)


def is_main() -> bool:
    """Return True on the thread on which the program began, which alone may handle signals."""
    return threading.current_thread() is threading.main_thread()


class ThreadClock:
    """Seconds of the processor that one thread takes; those of all where only that is known."""

    def __init__(self) -> None:
        self._of: int | None = None
        self._begun = time.process_time()

    def begin(self) -> None:
        """Take those of the thread that calls this."""
        if hasattr(time, "pthread_getcpuclockid"):
            self._of = time.pthread_getcpuclockid(threading.get_ident())

    def seconds(self) -> float:
        """Seconds since it was made; 0 for a thread that has ended."""
        if self._of is None:
            return time.process_time() - self._begun
        try:
            return time.clock_gettime(self._of)
        except OSError:
            return 0.0


def apart(work: Callable[[], _Item], check: Callable[[], None] = lambda: None) -> _Item:
    """The result of `work`, made in a thread of its own, so that Ctrl-C does not wait for it.

    All else as for `started`.
    """
    return started(work, "apart", check)()


def started(
    work: Callable[[], _Item], name: str = "started", check: Callable[[], None] = lambda: None
) -> Callable[[], _Item]:
    """Begin `work` in a thread of its own; the function returned waits for its result, once.

    Exceptions of `work` are raised there. `check` is called every 0.05 s, and may raise: that ends
    the wait, as an interruption does. The thread then goes on until `work` ends, or the program
    does.
    """
    done: queue.SimpleQueue[list[_Item] | BaseException] = queue.SimpleQueue()

    def make() -> None:
        try:
            done.put([work()])
        except BaseException as error:  # raised where it is waited for
            done.put(error)

    def result() -> _Item:
        entry = _taken(done, check)
        if isinstance(entry, BaseException):
            raise entry
        return entry.pop()

    begin(make, name)
    return result


def ahead(
    items: Iterator[_Item],
    count: int = 1,
    name: str = "ahead",
    patience: float = 1.0,
    check: Callable[[], None] = lambda: None,
) -> Generator[_Item, None, None]:
    """The items, up to `count` of them made beforehand in a thread of their own.

    Exceptions of the thread are raised here. When nobody reads on, it ends after the item that it
    is making, for which one waits at most `patience` [s], and closes a generator. An item that was
    given is not held here. `check` is called every 0.05 s while an item is waited for, and may
    raise. With a count of 0 there is no thread, and each item is made when it is asked for.
    """
    if not count:
        yield from items
        return
    # Each item stands in a list of its own; None stands after the last one.
    entries: queue.SimpleQueue[list[_Item] | BaseException | None] = queue.SimpleQueue()
    room, stop = threading.Semaphore(count), Stop()

    def make_one() -> bool:
        for item in items:
            entries.put([item])
            return True
        entries.put(None)
        return False

    def make() -> None:
        try:
            while _has_room(room, stop.is_set) and make_one():
                pass
            if isinstance(items, Generator):
                items.close()
        except BaseException as error:  # raised where the items are read
            entries.put(error)

    thread = begin(make, name)
    try:
        while (entry := _taken(entries, check)) is not None:
            room.release()
            if isinstance(entry, BaseException):
                raise entry
            yield entry.pop()
    finally:
        stop.set()
        _join(thread, patience)


def _taken(entries: queue.SimpleQueue[Any], check: Callable[[], None]) -> Any:
    """The next entry; a wait without limit would hold back Ctrl-C."""
    while True:
        check()
        try:
            return entries.get(timeout=_POLL)
        except queue.Empty:
            continue


def _join(thread: threading.Thread, patience: float = math.inf) -> None:
    """Wait for the end of a thread; a join without limit would hold back Ctrl-C."""
    if thread is threading.current_thread():
        return  # it collects the garbage that it is part of
    until = time.monotonic() + patience
    while thread.is_alive() and time.monotonic() < until:
        thread.join(_POLL)


def _has_room(room: threading.Semaphore, is_over: Callable[[], bool]) -> bool:
    """Wait for room; False if there is none any more."""
    while not is_over():
        if room.acquire(timeout=_POLL):
            return True
    return False


class Behind(Generic[_Item]):
    """Calls `work` with items in a thread of its own, in their order.

    `with Behind(work) as put:`; its exceptions are raised by the next `put`, or at the end. Items
    already put are worked on if the caller fails, but not after an interruption. `put` returns when
    fewer than `count` items wait, so that `count` wait or are being made by the caller, beside the
    one that is worked on.
    """

    def __init__(self, work: Callable[[_Item], None], count: int = 1, name: str = "behind"):
        self._work = work
        self._items: queue.SimpleQueue[list[_Item] | None] = queue.SimpleQueue()
        self._room = threading.Semaphore(count - 1)
        self._error: BaseException | None = None
        self._stop, self._name = Stop(), name

    def __enter__(self) -> Callable[[_Item], None]:
        self._thread = begin(self._run, self._name)
        return self._put

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None or issubclass(kind, Exception):
                self._items.put(None)
                _join(self._thread)
        finally:  # an interruption comes in the middle of it
            self._stop.set()
            _join(self._thread)  # before the caller closes what is written to
        if kind is None and self._error is not None:
            raise self._error

    def _put(self, item: _Item) -> None:
        self._items.put([item])
        del item
        _has_room(self._room, lambda: self._error is not None)
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                entry = self._items.get(timeout=_POLL)
            except queue.Empty:
                continue
            if entry is None:
                return
            self._room.release()
            try:
                self._work(entry.pop())
            except BaseException as error:  # raised in the caller's thread
                self._error = error
                return
