"""A method in the parts that a bench times: whole frames, passes and transfers."""

from __future__ import annotations

import contextlib
import statistics
import time
from dataclasses import replace
from typing import Any

import wgpu

from ..errors import InputError
from ..frame import Frame
from ..gpu import timing
from ..gpu.textures import TexturePool, numpy_of
from ..gpu_frame.views import FrameViews
from ..pipeline.blur import Blur
from ..scene import builtin
from .cases import SceneFrame


class Timed:
    """One method in the parts that are timed; has drawn one frame when it is made."""

    parts: tuple[str, ...] = ("work", "passes")
    bytes = 0

    def __init__(self, blur: Blur, clock: timing.Clock, size: tuple[int, int]):
        self.blur, self.clock, self._held = blur, clock, _held()
        self.images = TexturePool(blur.device)
        self.output = self.images.view("output", size, blur.output)
        self.memory, self.runs, self.counts = 0, [], {}
        self.records: list[float] = []  # seconds in which the calling thread recorded each frame

    def draw(self, encoder: wgpu.GPUCommandEncoder, clock: timing.Clock | None) -> None:
        """One frame, as the method draws it."""
        raise NotImplementedError

    @property
    def record(self) -> float | None:
        """Seconds of a recording; None if it waits."""
        return None

    def gpu(self) -> float:
        """Seconds of the GPU's work for a frame, without the recording."""
        raise NotImplementedError

    def work(self) -> None:
        """A frame, from its recording to the end of the work."""
        timing.work(self.blur.device, self._recorded)
        self.memory = self.memory or _held() - self._held

    def _recorded(self, encoder: wgpu.GPUCommandEncoder) -> None:
        began = time.perf_counter()  # recording never waits
        self.draw(encoder, None)
        self.records.append(time.perf_counter() - began)

    def passes(self) -> None:
        """All passes, each timed by itself."""
        timing.work(self.blur.device, lambda encoder: self.draw(encoder, self.clock))
        self.runs.append(self.clock.read())
        self.counts = self.clock.counts


class TimedScene(Timed):
    """A method of scenes, on the first of two that it can draw: bodies, or volumes."""

    def __init__(self, blur: Blur, clock: timing.Clock, size: tuple[int, int]):
        super().__init__(blur, clock, size)
        for name in ("crossing", "torusphere"):
            self._render = SceneFrame(builtin.make(name), size=size).render(blur)
            with contextlib.suppress(InputError):
                self.work()
                return
        raise InputError(f"method {blur.method.name!r} cannot draw any of the benchmark scenes")

    def draw(self, encoder: wgpu.GPUCommandEncoder, clock: timing.Clock | None):
        """One frame of the scene."""
        self._render.draw(self.output, 0.0, timing=clock)

    def gpu(self) -> float:
        """The sum of its passes: a scene submits them by itself, in portions."""
        return sum(timing.medians(self.runs[1:] or self.runs).values())


class TimedFrame(Timed):
    """A method of pictures, on one frame."""

    parts = ("passes", "call", "span")

    def __init__(self, blur: Blur, clock: timing.Clock, frame: Frame):
        super().__init__(blur, clock, frame.size)
        self.frame = frame
        if "neighbours" in blur.method.uses:
            near = {"prev": replace(frame, number=-1), "next": replace(frame, number=1)}
            self.frame = replace(frame, **near)
        self.views = blur.upload(self.frame)
        self.bytes = _bytes(self.views, self.output.texture)
        self.calls: list[tuple[float, float, float]] = []
        self.spans: list[float] = []
        self.work()

    def draw(self, encoder: wgpu.GPUCommandEncoder, clock: timing.Clock | None):
        """One frame, from its textures."""
        self.blur.encode(encoder, output=self.output, timing=clock, **self.views)

    def span(self) -> None:
        """All passes as they are drawn, timed together."""
        self.spans.append(self.clock.span(self._recorded))

    @property
    def record(self) -> float:
        """The median of all recordings but the first one, which compiles."""
        return statistics.median(self.records[1:] or self.records)

    def gpu(self) -> float:
        """The median of the spans."""
        return statistics.median(self.spans[1:] or self.spans)

    def call(self) -> None:
        """Arrays in, array out, in three parts: to textures, all passes, back to an array."""
        began = time.perf_counter()
        self.views = self.blur.upload(self.frame)
        timing.work(self.blur.device, lambda encoder: None)  # waits
        uploaded = time.perf_counter()
        timing.work(self.blur.device, self._recorded)
        drawn = time.perf_counter()
        self.images.download(self.blur.device.create_command_encoder(), self.output.texture)
        ends = time.perf_counter()
        self.calls.append((uploaded - began, drawn - uploaded, ends - drawn))

    @property
    def typical(self) -> tuple[float, float, float]:
        """The parts [s] of the call whose time is the median of all but the first one's."""
        calls = sorted(self.calls[1:] or self.calls, key=sum)
        return calls[len(calls) // 2]


def _held() -> int:
    """Return the size of all textures and buffers of the process [bytes]."""
    counts = wgpu.diagnostics.object_counts  # pyright: ignore[reportAttributeAccessIssue]
    return counts.get_dict()["total"]["resource_mem"]


def _bytes(views: dict[str, Any], output: wgpu.GPUTexture) -> int:
    """Return the size of the textures of `encode`'s inputs and the output [bytes]."""
    every = [v for one in views.values() if isinstance(one, FrameViews) for v in vars(one).values()]
    read = [v.texture for v in every if isinstance(v, wgpu.GPUTextureView)]
    total = 0
    for texture in (*read, output):
        kind, channels = numpy_of(texture.format)
        total += texture.size[0] * texture.size[1] * channels * kind.itemsize
    return total
