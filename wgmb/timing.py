"""How long GPU work takes: wall clock around a submit, and every pass by timestamp queries."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import wgpu

from .gpu import SOFTWARE, submit


class Timing:
    """GPU time of every pass of one frame, by timestamp queries.

    Software adapters report times that are wrong after some commands; there, wall clock
    around a submit is the only honest clock, and `Timing.usable` says so.
    """

    MOST = 2048  # passes a frame: a query set holds 4096; later ones are not timed

    def __init__(self, device: wgpu.GPUDevice):
        self.device, self.labels = device, []
        self.queries = device.create_query_set(type="timestamp", count=2 * self.MOST)

    @staticmethod
    def usable(device: wgpu.GPUDevice) -> bool:
        """Whether timestamps of this device can be believed."""
        hardware = device.adapter_info["adapter_type"] != SOFTWARE
        return hardware and "timestamp-query" in device.features

    def of(self, label: str) -> dict:
        """What makes the pass called `label` write its times: arguments of begin_compute_pass."""
        first = 2 * len(self.labels)
        if len(self.labels) >= self.MOST:
            return {}
        self.labels.append(label)
        return {
            "timestamp_writes": {
                "query_set": self.queries,
                "beginning_of_pass_write_index": first,
                "end_of_pass_write_index": first + 1,
            }
        }

    def read(self) -> dict[str, float]:
        """Seconds per pass, after the work was submitted; passes of one name are added up.

        It begins anew with the next pass.
        """
        if not self.labels:
            return {}
        usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
        buffer = self.device.create_buffer(size=16 * len(self.labels), usage=usage)
        encoder = self.device.create_command_encoder()
        encoder.resolve_query_set(self.queries, 0, 2 * len(self.labels), buffer, 0)
        submit(self.device, encoder)
        stamps = np.asarray(self.device.queue.read_buffer(buffer)).view("<u8").reshape(-1, 2)
        seconds: dict[str, float] = {}
        for label, (begin, end) in zip(self.labels, stamps, strict=True):
            seconds[label] = seconds.get(label, 0.0) + (int(end) - int(begin)) * 1e-9
        self.labels.clear()
        return seconds


def work(device: wgpu.GPUDevice, record: Callable[[wgpu.GPUCommandEncoder], None]) -> float:
    """Seconds from recording to the end of the work on the GPU."""
    token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
    started = time.perf_counter()
    encoder = device.create_command_encoder(label="timed")
    record(encoder)
    submit(device, encoder)
    device.queue.read_buffer(token)  # waits
    return time.perf_counter() - started
