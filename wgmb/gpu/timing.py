"""Timing of GPU work: wall clock around a submission, and every pass by one of two clocks."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import wgpu
from wgpu.backends.wgpu_native import _api

from . import SOFTWARE, submit

_PERIOD = "wgpuQueueGetTimestampPeriod"  # [ns] a tick


class _Clock:
    """Seconds of every compute pass of one frame, by the pass's name.

    `counts`: how many passes of each name there were, when they were last read.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self.device, self.labels, self.counts = device, [], {}

    def check(self) -> None:
        """Raise an exception if nobody wants the work any more; a clock alone never does."""

    def _seconds(self) -> list[float]:
        raise NotImplementedError

    def span(self, record: Callable[[wgpu.GPUCommandEncoder], None]) -> float:
        """Seconds that the GPU takes for all that `record` records, from its begin to its end."""
        raise NotImplementedError

    def read(self) -> dict[str, float]:
        """Seconds per pass, after the work was submitted; passes of one name are added up.

        It begins anew with the next pass.
        """
        seconds: dict[str, float] = {}
        for label, took in zip(self.labels, self._seconds(), strict=True):
            seconds[label] = seconds.get(label, 0.0) + took
        self.counts = dict(Counter(self.labels))
        self.labels.clear()
        return seconds


class TimestampClock(_Clock):
    """GPU time of every pass of one frame, by timestamp queries.

    Software adapters report times that are wrong after some commands; there, wall clock
    around a submit is the only honest clock, and `TimestampClock.usable` says so.
    """

    name, empty = "timestamps", 0.0
    MOST = 2048  # passes a frame: a query set holds 4096; later ones are not timed

    def __init__(self, device: wgpu.GPUDevice):
        super().__init__(device)
        self._queries = device.create_query_set(type="timestamp", count=2 * self.MOST)
        # wgpu-py has no public name for it, and resolves queries to raw ticks.
        self._tick = 1e-9 * getattr(_api.lib, _PERIOD)(device.queue._internal)  # [s]

    @staticmethod
    def usable(device: wgpu.GPUDevice) -> bool:
        """Return True if timestamps of this device are reliable."""
        hardware = device.adapter_info["adapter_type"] != SOFTWARE
        return hardware and "timestamp-query" in device.features

    def watch(self, encoder: wgpu.GPUCommandEncoder) -> Any:
        """`encoder`, whose compute passes will write their times."""
        return _Stamped(self, encoder)

    def of(self, label: str) -> dict[str, Any]:
        """Return arguments of begin_compute_pass that make the pass `label` write its times."""
        first = 2 * len(self.labels)
        if len(self.labels) >= self.MOST:
            return {}
        self.labels.append(label)
        return {
            "timestamp_writes": {
                "query_set": self._queries,
                "beginning_of_pass_write_index": first,
                "end_of_pass_write_index": first + 1,
            }
        }

    def span(self, record: Callable[[wgpu.GPUCommandEncoder], None]) -> float:
        """Seconds between the timestamps of two empty passes, before the first and after the last.

        What `record` records is not changed by it.
        """
        encoder = self.device.create_command_encoder(label="span")
        encoder.begin_compute_pass(label="begin", **self.of("begin")).end()
        record(encoder)
        encoder.begin_compute_pass(label="end", **self.of("end")).end()
        submit(self.device, encoder)
        stamps = self._stamps()
        self.labels.clear()
        return max(0, int(stamps[-1, 0]) - int(stamps[0, 1])) * self._tick

    def _seconds(self) -> list[float]:
        return [(int(end) - int(begin)) * self._tick for begin, end in self._stamps()]

    def _stamps(self) -> np.ndarray:
        """(passes, 2) ticks at the begin and at the end of each pass."""
        if not self.labels:
            return np.zeros((0, 2), np.uint64)
        usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
        buffer = self.device.create_buffer(size=16 * len(self.labels), usage=usage)
        encoder = self.device.create_command_encoder()
        encoder.resolve_query_set(self._queries, 0, 2 * len(self.labels), buffer, 0)
        submit(self.device, encoder)
        return np.asarray(self.device.queue.read_buffer(buffer)).view("<u8").reshape(-1, 2)


class _Stamped:
    """An encoder whose compute passes write their times."""

    def __init__(self, clock: TimestampClock, encoder: wgpu.GPUCommandEncoder):
        self._clock, self._encoder = clock, encoder

    def __getattr__(self, name: str):
        return getattr(self._encoder, name)

    def begin_compute_pass(self, *, label: str):
        return self._encoder.begin_compute_pass(label=label, **self._clock.of(label))


class WallClock(_Clock):
    """Wall clock around every pass, which is submitted by itself into an empty queue.

    For adapters whose timestamps are missing or wrong. Passes run as they are recorded; what
    was recorded before `watch` has to be submitted before. `empty`: seconds that a submission
    without a pass takes, the least of one before every pass; they are subtracted.
    """

    name = "wall clock"

    def __init__(self, device: wgpu.GPUDevice):
        super().__init__(device)
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._took: list[float] = []
        self.empty = self._run(device.create_command_encoder())

    def watch(self, encoder: wgpu.GPUCommandEncoder) -> Any:
        """Return a replacement for `encoder` that submits every command separately."""
        return _OneByOne(self)

    def take(self, label: str, encoder: wgpu.GPUCommandEncoder) -> None:
        """Submit the one pass in `encoder`, and time it."""
        empty = self._run(self.device.create_command_encoder())  # waits for all that came before
        self.empty = min(self.empty, empty)
        self._took.append(self._run(encoder))
        self.labels.append(label)

    def span(self, record: Callable[[wgpu.GPUCommandEncoder], None]) -> float:
        """Seconds from the submission of all passes at once to their end."""
        self._run(self.device.create_command_encoder())  # waits for all that came before
        encoder = self.device.create_command_encoder(label="span")
        record(encoder)
        return max(self._run(encoder) - self.empty, 0.0)

    def _run(self, encoder: wgpu.GPUCommandEncoder) -> float:
        started = time.perf_counter()
        submit(self.device, encoder)
        self.device.queue.read_buffer(self._token)  # waits
        return time.perf_counter() - started

    def _seconds(self) -> list[float]:
        took, self._took = self._took, []
        return [max(seconds - self.empty, 0.0) for seconds in took]


class _OneByOne:
    """Stands for a command encoder: all that the methods record into one."""

    def __init__(self, clock: WallClock):
        self._clock = clock

    def begin_compute_pass(self, *, label: str):
        self._clock.check()  # to compile its kernel may have taken long
        return _Alone(self._clock, label)

    def clear_buffer(
        self, buffer: wgpu.GPUBuffer, offset: int = 0, size: int | None = None
    ) -> None:
        encoder = self._clock.device.create_command_encoder()
        encoder.clear_buffer(buffer, offset, size)
        submit(self._clock.device, encoder)

    def copy_texture_to_texture(
        self, source: dict[str, Any], destination: dict[str, Any], size: tuple[int, int, int]
    ) -> None:
        encoder = self._clock.device.create_command_encoder()
        encoder.copy_texture_to_texture(source, destination, size)
        submit(self._clock.device, encoder)


class _Alone:
    """A compute pass that runs as soon as it ends."""

    def __init__(self, clock: WallClock, label: str):
        self._clock, self._label = clock, label
        self._encoder = clock.device.create_command_encoder(label=label)
        self._pass = self._encoder.begin_compute_pass(label=label)

    def __getattr__(self, name: str):
        return getattr(self._pass, name)

    def end(self) -> None:
        self._pass.end()
        self._clock.take(self._label, self._encoder)


Clock = TimestampClock | WallClock


def clock(device: wgpu.GPUDevice) -> Clock:
    """The clock that tells the passes of this device apart."""
    return TimestampClock(device) if TimestampClock.usable(device) else WallClock(device)


def medians(runs: list[dict[str, float]]) -> dict[str, float]:
    """Of the results of `read` of several runs, by name."""
    return {label: float(np.median([run[label] for run in runs])) for label in runs[0]}


def work(device: wgpu.GPUDevice, record: Callable[[wgpu.GPUCommandEncoder], None]) -> float:
    """Seconds from recording to the end of the work on the GPU."""
    token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
    started = time.perf_counter()
    encoder = device.create_command_encoder(label="timed")
    record(encoder)
    submit(device, encoder)
    device.queue.read_buffer(token)  # waits
    return time.perf_counter() - started


def alternate(
    jobs: dict[str, Callable[[], object]], rounds: int, limit: float = math.inf
) -> dict[str, list[float]]:
    """Seconds of every job in every round; all jobs take turns after one round for warmth.

    A job that has taken `limit` seconds is not repeated; at worst the round for warmth counts.
    """
    warm = {name: _seconds(job) for name, job in jobs.items()}
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            if warm[name] + sum(seconds[name]) < limit:
                seconds[name].append(_seconds(job))
    return {name: seconds[name] or [warm[name]] for name in jobs}


def _seconds(job: Callable[[], object]) -> float:
    started = time.perf_counter()
    job()
    return time.perf_counter() - started
