"""Worker side of dask.distributed: a plugin that opens the GPU and blurs parts of a job.

A worker that cannot do the job says why and is given nothing.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from distributed import Worker, WorkerPlugin, get_worker

from .. import interpreter
from .._version import __version__
from ..errors import DeviceError, Error
from ..run.job_file import of_text
from ..run.report import BatchReport, Progress
from ..sequence.findings import Range, numbers
from ..threads import Stop, is_main

_PAUSE = 0.25  # seconds between two messages on frames that are done


def plugin_name(run: str) -> str:
    """The name of the plugin of a run, and of the topic of its messages."""
    return f"wgmb-{run}"


@dataclass(frozen=True)
class WorkerState:
    """A worker's report on itself."""

    name: str
    host: str
    process: int
    why_not: str = ""
    """The reason why it cannot work; "" if it can."""
    lacks_gpu: bool = False


class BlurPlugin(WorkerPlugin):
    """One run in one worker process; `setup` opens the device before anything else is done.

    `text`: of the job file. `adapters`: of workers that are named 0, 1, 2 and so on; without,
    each takes its own default. `is_embedded`: the driver started the worker, on its own terminal.
    """

    def __init__(
        self, run: str, text: str, adapters: Sequence[str] = (), is_embedded: bool = False
    ):
        self.run, self.text, self.adapters = run, text, tuple(adapters)
        self.is_embedded, self.version = is_embedded, __version__
        self.name = plugin_name(run)

    async def setup(self, worker: Worker) -> None:
        """Called by the worker; it may open a device as long as it likes."""
        if self.is_embedded and is_main():
            interpreter.handle_signals(signal.SIG_IGN)  # the driver tells when to stop
        self._worker, self._stop, self._idle = worker, Stop(), Stop()
        self._idle.set()
        adapter = None
        if self.adapters:
            number = int(worker.name) if str(worker.name).isdigit() else 0
            adapter = self.adapters[number % len(self.adapters)]
        why, lacks_gpu = "", False
        try:
            await asyncio.to_thread(self.prepare, adapter)
        except DeviceError as error:
            why, lacks_gpu = str(error), True
        except (Error, OSError) as error:
            why = str(error)
        host = socket.gethostname()
        self.state = WorkerState(str(worker.name), host, os.getpid(), why, lacks_gpu)

    async def teardown(self, worker: Worker) -> None:
        """Called by the worker at the end of the run."""
        self._stop.set()

    def prepare(self, adapter: str | None) -> None:
        """Open the GPU, and see whether the frames and the output are here; Error if not."""
        stored = of_text(self.text, "the job")
        self._job = stored.job
        self._blur = self._job.made_blur(adapter)
        stored.check(self._job.numbers[:1])
        self._job.run_with(self._blur, self._job.numbers[:1])  # is the folder there?

    def blur(self, chosen: list[int], tell: Progress, stop: Stop) -> BatchReport:
        """Blur some frames."""
        return self._job.run_with(self._blur, chosen)(tell, stop)

    def work(self, chosen: list[int]) -> BatchReport:
        """Blur some frames, and tell the driver of each."""
        told: list[tuple[int, str]] = []
        last = time.monotonic()

        def tell(number: int, state: str) -> None:
            nonlocal last
            told.append((number, str(state)))  # which a message can hold
            if time.monotonic() > last + _PAUSE:
                send()
                last = time.monotonic()

        def send() -> None:
            self._worker.log_event(self.name, {"told": list(told)})
            told.clear()

        self._idle.clear()
        try:
            return self.blur(chosen, tell, self._stop)
        finally:
            self._idle.set()
            if told:
                send()

    async def end(self) -> None:
        """Begin no other frame, and wait for those that are begun."""
        self._stop.set()
        while not self._idle.is_set():
            await asyncio.sleep(0.02)

    def sweep(self) -> None:
        """Remove the run's unfinished files of dead processes of this host."""
        self._job.sweep()


def _plugin(worker: Worker, run: str) -> Any:
    return worker.plugins[plugin_name(run)]


def blur_part(run: str, ranges: Sequence[Range]) -> BatchReport:
    """The task: blur these frames of a run."""
    return _plugin(get_worker(), run).work(numbers(ranges))


def state_of(run: str, dask_worker: Worker) -> WorkerState | None:
    """A worker's report on itself; None until it is ready."""
    plugin = dask_worker.plugins.get(plugin_name(run))
    return getattr(plugin, "state", None)


async def end(run: str, dask_worker: Worker) -> None:
    """Let a worker finish its current frame."""
    if plugin_name(run) in dask_worker.plugins:
        await _plugin(dask_worker, run).end()


def sweep(run: str, dask_worker: Worker) -> None:
    """Remove leftovers on the worker's host."""
    _plugin(dask_worker, run).sweep()


def signs_of_life(dask_scheduler: Any) -> dict[str, float]:
    """All workers there are, by address, with the scheduler's time of their last message."""
    return {address: one.last_seen for address, one in dask_scheduler.workers.items()}
