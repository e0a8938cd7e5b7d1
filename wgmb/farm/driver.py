"""One run over a cluster: workers are given parts of the frames until all are done.

A worker that dies loses its current frames, which others repeat; a frame that kills its worker
twice is named, and all others are done.
"""

from __future__ import annotations

import contextlib
import queue
import socket
import time
import uuid
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import DeviceError, Error, InputError
from ..io.frame_numbers import frame_list
from ..run.engine import ON_REQUEST
from ..run.job import Job
from ..run.report import BatchReport, Failure, Progress, describe_input
from ..sequence.findings import ranges
from ..threads import within
from . import local, merge
from .workers import LATE, TIMES_LATE, Chunk, Worker, WorkerPool, size_of_part

_LOOK = 0.5  # seconds after which the driver looks who is there
_ANSWER = 10.0  # seconds in which a worker that runs answers a question
_END = 1.5  # seconds in which workers end the frames that they are at, after an interruption
_TWICE = "its worker died twice"
_GONE = "the scheduler is gone; start it and its workers again, and go on with `resume=True`"


class Driver:
    """One run on a cluster."""

    def __init__(self, farm: WorkerPool, client: Any, job: Job, text: str, progress: Progress):
        from .plugin import BlurPlugin, plugin_name

        self._farm, self._client, self._job, self._progress = farm, client, job, progress
        self._id = uuid.uuid4().hex[:8]
        self._topic = plugin_name(self._id)
        embedded = farm.cluster is None
        adapters = farm.adapters() if embedded else [farm.adapter] if farm.adapter else []
        make = farm.plugin or BlurPlugin
        self._plugin = make(self._id, text, adapters, embedded)
        self._silent: dict[str, float] = {}  # workers that are lost, with their last sign of life
        self._slowest = 0.0  # seconds of a part
        self._events: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._workers: dict[str, Worker] = {}
        self._named: set[tuple[str, str]] = set()
        self._refusals: list[tuple[bool, str]] = []
        self._parts: deque[Chunk] = deque()
        self._divided = False
        self._order = np.sort(np.asarray(job.numbers, np.int64))
        self._ticked = np.zeros(len(job.numbers), bool)
        self._looked, self._idle_since = 0.0, time.monotonic()
        self._deaths, self._tasks = 0, 0
        self.report = BatchReport(total=len(job.clip.numbers))
        describe_input(self.report, job.clip)

    def run(self) -> BatchReport:
        """Do all parts."""
        client = self._client
        try:
            client.subscribe_topic(self._topic, lambda event: self._events.put(("told", event[1])))
            with contextlib.suppress(Exception):  # each worker is asked how it went
                within(
                    self._farm.patience,
                    lambda: client.register_plugin(self._plugin, name=self._topic),
                )
            self._go_on()
        except (KeyboardInterrupt, SystemExit):
            self._end()
            raise
        except _LostError:
            self.report.stopped = _GONE
            merge.sort(self.report)
            return self.report
        self._tidy()
        merge.sort(self.report)
        return self.report

    def _go_on(self) -> None:
        while True:
            self._farm.check()
            self._look()
            self._give()
            busy = any(worker.part for worker in self._workers.values())
            if busy or self._is_anybody_ready():
                self._idle_since = time.monotonic()
            if self._divided and not self._parts and not busy:
                break
            if not busy and self._is_hopeless():
                break
            with contextlib.suppress(queue.Empty):
                kind, event = self._events.get(timeout=0.1)
                while True:
                    self._heard(kind, event)
                    kind, event = self._events.get_nowait()
        self._drain()

    # ---- who is there ----------------------------------------------------------------------

    def _look(self) -> None:
        """Ask who is there; parts of those who are gone are given to others."""
        from . import plugin

        if self._client.status != "running":
            raise _LostError
        if time.monotonic() < self._looked + _LOOK:
            return
        self._looked = time.monotonic()
        there = self._answer(
            self._farm.patience, lambda: self._client.run_on_scheduler(plugin.signs_of_life)
        )
        if there is None:
            raise _LostError
        for address in [a for a in self._workers if a not in there]:
            self._gone(self._workers.pop(address), "died")
        for address, sign in there.items():
            self._hear(address, sign)
        unknown = [w for w in self._workers.values() if w.why_not is None and self._speaks(w)]
        if unknown:
            states = self._answer(
                _ANSWER,
                lambda: self._client.run(
                    plugin.state_of,
                    self._id,
                    workers=[w.address for w in unknown],
                    on_error="return",
                ),
            )
            for worker in unknown:
                self._learn(worker, (states or {}).get(worker.address))

    def _hear(self, address: str, sign: float) -> None:
        """Take note of a worker that is listed; one that is silent for too long is lost."""
        if self._silent.get(address) == sign:
            return
        self._silent.pop(address, None)
        worker = self._workers.setdefault(address, Worker(address))
        now = time.monotonic()
        if worker.sign != sign:
            worker.sign, worker.heard = sign, now
        elif now > worker.heard + self._farm.patience:
            self._silent[address] = sign
            self._kill(self._workers.pop(address))
            self._gone(worker, f"has not been heard of for {self._farm.patience:g} s")

    def _speaks(self, worker: Worker) -> bool:
        """Return True if a worker has given a sign of life just now."""
        return time.monotonic() < worker.heard + _ANSWER

    def _kill(self, worker: Worker) -> None:
        """End a process of this run that does nothing any more; another one takes its place."""
        if self._farm.cluster is None:
            with contextlib.suppress(Exception):
                local.kill(self._client.cluster, worker.address)

    def _answer(self, seconds: float, ask: Callable[[], Any]) -> Any:
        """An answer of the scheduler or of workers, None where they are silent for so long.

        _LostError where the scheduler is gone.
        """
        for attempt in (1, 2):
            if self._client.status != "running":
                raise _LostError from None
            try:
                return within(seconds, ask)
            except TimeoutError:
                return None
            except (OSError, RuntimeError, ValueError):
                if attempt == 2:
                    raise
                time.sleep(_LOOK)
        return None

    def _learn(self, worker: Worker, state: Any) -> None:
        if state is None or isinstance(state, (OSError, TimeoutError)):
            return  # not ready yet, or gone
        if isinstance(state, BaseException):
            worker.name, worker.why_not = worker.address, f"{type(state).__name__}: {state}"
            self._refuse(worker, False)
            return
        worker.name, worker.host, worker.why_not = state.name, state.host, state.why_not
        if state.why_not:
            self._refuse(worker, state.lacks_gpu)

    def _refuse(self, worker: Worker, lacks_gpu: bool) -> None:
        """Name a worker that is given nothing, once."""
        why = worker.why_not or ""
        self._refusals.append((lacks_gpu, why))
        if (key := (worker.name, why)) not in self._named:
            self._named.add(key)
            where = f" on {worker.host}" if worker.host else ""
            self._farm.note(f"worker {worker.name}{where} does nothing: {why}")

    def _gone(self, worker: Worker, how: str) -> None:
        """A worker died, or is lost: its part is given to others."""
        part, worker.part = worker.part, None
        if worker.future is not None:
            worker.future.release()
        if part is None:
            return
        self._deaths += 1
        part.deaths += 1
        self._farm.details(f"worker {worker.name} {how} at {frame_list(part.numbers)}")
        if self._holders(part):
            return
        if part.deaths < 2:
            self._parts.appendleft(part)
        elif len(part.numbers) > 1:
            self._parts.extendleft(Chunk([n]) for n in reversed(part.numbers))
        else:
            self._fail(part, _TWICE)

    def _is_anybody_ready(self) -> bool:
        return any(worker.why_not == "" for worker in self._workers.values())

    def _is_hopeless(self) -> bool:
        """Return True if no worker has been able to work for too long; the report says so then."""
        now = time.monotonic()
        if self._is_anybody_ready():
            return False
        waits = not self._workers or any(w.why_not is None for w in self._workers.values())
        patience = self._farm.patience
        if (waits or self._farm.cluster is not None) and now < self._idle_since + patience:
            return False
        why = self._refusals[-1][1] if self._refusals else f"no worker in {patience:.0f} s"
        lacks_gpu = bool(self._refusals) and all(lacks for lacks, _ in self._refusals)
        if not self._tasks:
            raise (DeviceError if lacks_gpu else InputError)(f"no worker can do this: {why}")
        if lacks_gpu:
            raise DeviceError(f"no worker is left: {why}")
        self.report.stopped = f"no worker is left: {why}"
        return True

    # ---- parts -----------------------------------------------------------------------------

    def _give(self) -> None:
        ready = [w for w in self._workers.values() if w.why_not == ""]
        if not self._divided and ready:
            self._divide(len(self._workers))
        others = {worker.address for worker in ready}
        for worker in ready:
            if worker.part is not None:
                continue
            for i, part in enumerate(self._parts):
                if worker.address not in part.refused_by or others <= part.refused_by:
                    del self._parts[i]
                    self._hand_over(worker, part)
                    break
            else:
                self._help(worker)

    def _help(self, worker: Worker) -> None:
        """Give a worker that has nothing to do the part that another one does not end.

        Whoever ends it first is the one that counts.
        """
        late = time.monotonic() - max(LATE, TIMES_LATE * self._slowest)
        for other in self._workers.values():
            if (part := other.part) is None or other.since > late or not self._slowest:
                continue
            if len(self._holders(part)) == 1 and worker.address not in part.refused_by:
                self._farm.details(
                    f"worker {other.name} does not finish {frame_list(part.numbers)}"
                )
                self._hand_over(worker, part)
                return

    def _holders(self, part: Chunk) -> list[Worker]:
        """The workers that have a part."""
        return [worker for worker in self._workers.values() if worker.part is part]

    def _release(self, part: Chunk, since: float) -> None:
        """A part is done: other workers that have it, too, need not end it.

        One that was given it earlier hangs, and is given nothing more.
        """
        for worker in self._holders(part):
            worker.part = None
            worker.future.release()
            if worker.since < since:
                worker.why_not = f"it does not finish frames {frame_list(part.numbers)}"
                self._refuse(worker, False)
                self._kill(worker)

    def _divide(self, workers: int) -> None:
        numbers = self._job.numbers
        size = size_of_part(len(numbers), workers)
        self._parts.extend(Chunk(numbers[i : i + size]) for i in range(0, len(numbers), size))
        self._divided = True

    def _hand_over(self, worker: Worker, part: Chunk) -> None:
        from .plugin import blur_part

        self._tasks += 1
        worker.part, worker.since = part, time.monotonic()
        worker.future = future = self._client.submit(
            blur_part,
            self._id,
            ranges(part.numbers),
            key=f"{self._topic}-{self._tasks}",
            workers=[worker.address],
            pure=False,
        )
        address = worker.address
        future.add_done_callback(lambda done: self._events.put(("done", (address, done))))

    def _heard(self, kind: str, event: Any) -> None:
        if kind == "told":
            for number, state in event["told"]:
                if state != "failed":  # its reason comes with the report of the part
                    self._tick(number, state)
            return
        address, future = event
        worker = self._workers.get(address)
        if worker is None or worker.future is not future or worker.part is None:
            return  # it was given up
        part, worker.part, worker.future = worker.part, None, None
        if future.status == "finished":
            self._slowest = max(self._slowest, time.monotonic() - worker.since)
            self._release(part, worker.since)
            try:
                self._took(worker, part, future.result(timeout=30))
            except (OSError, TimeoutError):  # it died with its result
                self._vanished(worker, part)
        elif future.status == "error":
            self._fault(worker, part, future.exception(timeout=30))
        else:  # cancelled: the worker, or the scheduler, is gone
            self._vanished(worker, part)
        future.release()

    def _vanished(self, worker: Worker, part: Chunk) -> None:
        """A worker died before the scheduler noticed; given another part, it would die twice."""
        del self._workers[worker.address]
        worker.part = part
        self._gone(worker, "died")

    def _took(self, worker: Worker, part: Chunk, report: BatchReport) -> None:
        worker.faults = 0
        done = [*report.done, *report.skipped]
        self._farm.details(f"worker {worker.name}: frames {frame_list(part.numbers)}")
        if report.stopped and report.stopped != ON_REQUEST:
            # It cannot write here; others may.
            worker.why_not = report.stopped
            self._refuse(worker, False)
            kept = set(done)
            unfinished = [n for n in part.numbers if n not in kept]
            report.failed = {}
            if part.refused_by:
                report.failed = dict.fromkeys(unfinished, report.stopped)
            else:
                self._parts.append(Chunk(unfinished, refused_by={worker.address}))
        merge.share(report, part.numbers)
        merge.add(self.report, report)
        for number in (*done, *report.failed):
            failed = report.failed.get(number)
            self._tick(number, "done" if failed is None else Failure(failed))

    def _fault(self, worker: Worker, part: Chunk, error: BaseException | None) -> None:
        """The part could not even be begun."""
        if self._holders(part):
            return
        why = str(error) if isinstance(error, Error) else f"{type(error).__name__}: {error}"
        why = " ".join(why.split())
        if isinstance(error, DeviceError):  # its GPU is lost, which says nothing of the part
            worker.why_not = why
            self._refuse(worker, True)
            self._parts.appendleft(part)
            return
        is_second = bool(part.refused_by)
        part.refused_by.add(worker.address)
        worker.faults += 1
        if worker.faults > 1:
            worker.why_not = why
            self._refuse(worker, False)
        if is_second:
            self._fail(part, why)
        else:
            self._parts.append(part)

    def _fail(self, part: Chunk, why: str) -> None:
        for number in part.numbers:
            self.report.failed[number] = why
            self._tick(number, Failure(why))

    def _tick(self, number: int, state: str) -> None:
        at = int(np.searchsorted(self._order, number))
        if not self._ticked[at]:
            self._ticked[at] = True
            self._progress(number, state)

    # ---- the end ---------------------------------------------------------------------------

    def _drain(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                self._heard(*self._events.get_nowait())

    def _end(self) -> None:
        """After an interruption: every worker ends the frame that it is at, if it does so soon."""
        from . import plugin

        with contextlib.suppress(Exception):
            for worker in self._workers.values():
                if worker.future is not None:
                    worker.future.cancel()
            try:
                within(_END, lambda: self._client.run(plugin.end, self._id, on_error="ignore"))
            except TimeoutError:
                if self._farm.cluster is None:
                    local.kill(self._client.cluster)
            self._deaths += 1  # the same signal may have ended workers
            self._tidy(_END)

    def _tidy(self, seconds: float = _ANSWER) -> None:
        """Remove leftover files of killed workers, by a worker of each host; and the plugin."""
        from . import plugin

        if self._deaths:
            with contextlib.suppress(OSError):
                self._job.sweep()
        here = socket.gethostname()
        hosts = {w.host: w.address for w in self._workers.values() if w.why_not == ""}
        hosts.pop(here, None)
        with contextlib.suppress(Exception):
            if self._deaths and hosts:
                within(
                    seconds,
                    lambda: self._client.run(
                        plugin.sweep, self._id, workers=list(hosts.values()), on_error="ignore"
                    ),
                )
        with contextlib.suppress(Exception):
            if self._farm.cluster is not None:
                within(seconds, lambda: self._client.unregister_worker_plugin(self._topic))


class _LostError(Exception):
    """The scheduler does not answer."""
