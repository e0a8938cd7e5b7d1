"""Speed of the methods: GPU work without transfers, compared with the tap blur in numba.

Only ratios within one run are meaningful, not times from different days or machines.
Candidates take turns, and medians are reported.
"""

from __future__ import annotations

import gc
import itertools
import math
import os
import statistics
import sys
import time
from collections.abc import Iterable

import numpy as np
import wgpu

from .. import gpu
from ..errors import GpuMemoryError, InputError
from ..frame import Frame
from ..gpu import timing
from ..shutter import Shutter
from .baselines import numba_tap
from .bench_figures import Bench, BenchFigure, VideoFigure
from .cases import Candidate, Tell
from .results import machine
from .timed import TimedFrame, TimedScene
from .video_bench import time_video

MEAN_SPEED = 14.5  # [px per frame interval], of the synthetic frame
_COPY = 64 << 20  # bytes, of the copy that tells the machine's bandwidth
_HEAVY = 3  # parts of a figure that draw a whole frame at most: passes, call, span
_MEMORY = 0.75  # share of the machine's memory that textures and buffers may take


def synthetic_frame(width: int, height: int) -> Frame:
    """Noise under a camera that turns and comes closer; every pixel moves."""
    rng = np.random.default_rng(0)
    color = rng.random((height, width, 4), np.float32)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    x, y = (x - width / 2) / width, (y - height / 2) / width
    motion = np.stack([x - 0.5 * y + 0.2, y + 0.5 * x + 0.05], axis=2)
    motion *= MEAN_SPEED / np.hypot(motion[..., 0], motion[..., 1]).mean()
    depth = 5 + 4 * np.sin(9 * x) * np.cos(9 * y)
    return Frame(color, motion=np.concatenate([-motion, motion], axis=2), depth=depth)


def bench(
    device: wgpu.GPUDevice,
    candidates: Iterable[Candidate],
    sizes: Iterable[tuple[int, int]] = ((1920, 1080),),
    samples: Iterable[int] = (16,),
    rounds: int = 9,
    limit: float = math.inf,
    tell: Tell = lambda text: None,
    flows: Iterable[str] = (),
) -> Bench:
    """Time every candidate at every size with every number of samples.

    Then pictures of a video at every size by all `flows`, each NAME[:QUALITY]; see `time_video`.

    `limit`: seconds for one of them at one size and number. It gets fewer rounds where they
    would take longer, and is left out, which `notes` say, where three frames would, going by
    smaller figures; so are sizes that the memory does not hold. An interrupted bench (Ctrl-C) has
    the figures up to then.
    """
    if rounds < 1:
        raise InputError(f"`rounds` must be 1 or more, got {rounds}")
    if not limit > 0:
        raise InputError(f"`seconds` must be over 0, got {limit}")
    matrix = _Matrix(device, list(candidates), rounds, limit, tell)
    sizes, flows = sorted(sizes, key=math.prod), list(flows)
    groups = list(itertools.product(sizes, sorted(samples))) if matrix.candidates else []
    pace = 1.0  # what a group took in proportion to what was told
    try:
        for i, (size, count) in enumerate(groups):
            left = [pace * matrix.seconds(*group) for group in groups[i:]]
            about = f": about {_about(left[0])}, to the end {_about(sum(left))}" if i else ""
            tell(f"{_described(size, count)} ({i + 1} of {len(groups)}){about}")
            started = time.perf_counter()
            matrix.measure(size, count)
            if left[0]:
                pace *= (time.perf_counter() - started) / left[0]
        for size, flow in itertools.product(sizes, flows):
            matrix.measure_video(size, flow)
    except KeyboardInterrupt:
        if not matrix.figures and not matrix.videos:
            raise
        matrix.notes.append("interrupted: the rest is skipped")
    if not matrix.figures and not matrix.videos:
        raise InputError(matrix.notes[-1] if matrix.notes else "no methods to time")
    name, empty = matrix.clock.name, 1e3 * matrix.clock.empty
    copy = copy_bandwidth(device)
    return Bench(machine(device), copy, matrix.figures, name, empty, matrix.notes, matrix.videos)


def _described(size: tuple[int, int], samples: int) -> str:
    return f"{size[0]} x {size[1]}, {samples} samples"


def _about(seconds: float) -> str:
    """A time to come, for people."""
    return f"{seconds:.2g} s" if seconds < 99 else f"{seconds / 60:.0f} min"


class _Matrix:
    """Figures of candidates at growing sizes, each telling what the next will take."""

    def __init__(
        self,
        device: wgpu.GPUDevice,
        candidates: list[Candidate],
        rounds: int,
        limit: float,
        tell: Tell,
    ):
        self.device, self.candidates, self.rounds, self.limit = device, candidates, rounds, limit
        self.tell, self.clock = tell, timing.clock(device)
        self.figures: list[BenchFigure] = []
        self.videos: list[VideoFigure] = []
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)
        self.tell(text)

    def seconds(self, size: tuple[int, int], samples: int) -> float:
        """Return the expected seconds of all candidates, from the figures so far."""
        runs = _HEAVY * (self.rounds + 1)
        each = (self._frame(c.label, size, samples) for c in self.candidates)
        return sum(min(runs * s, self.limit) for s in each if _HEAVY * s <= self.limit)

    def measure(self, size: tuple[int, int], samples: int) -> None:
        """All candidates that fit, in turns, and the numba peer with them."""
        gc.collect()  # what the last figures held
        try:
            gpu.check_size(self.device, *size)
        except InputError as error:
            self.note(f"{_described(size, samples)} skipped: {error}")
            return
        frame, jobs, timed = synthetic_frame(*size), {}, {}
        for c in self.candidates:
            blur, name = c.blur(samples, Shutter(180), self.device), c.label
            try:
                self._check(name, size, samples, sum(t.memory for t in timed.values()))
                with gpu.reported(size):
                    timed[name] = one = (
                        TimedScene(blur, self.clock, size)
                        if c.needs_scene
                        else TimedFrame(blur, self.clock, frame)
                    )
            except (InputError, GpuMemoryError) as error:
                self.note(f"{_described(size, samples)}: {name} skipped: {error}")
                continue
            for part in one.parts:
                jobs[f"{name} {part}"] = getattr(one, part)
        if peer := numba_tap(frame, samples):
            jobs["numba"] = peer
        every = timing.alternate(jobs, self.rounds, self.limit / _HEAVY)
        median = {k: 1e3 * statistics.median(v) for k, v in every.items()}
        for name, one in timed.items():
            parts: dict[str, float] = {}
            if isinstance(one, TimedFrame):
                upload, drawn, readback = (1e3 * seconds for seconds in one.typical)
                parts = {"upload": upload, "readback": readback, "call": upload + drawn + readback}
            else:
                drawn = median[f"{name} work"]
            self.figures.append(
                BenchFigure(
                    name,
                    *size,
                    samples,
                    wall=drawn,
                    record=one.record and 1e3 * one.record,
                    gpu=1e3 * one.gpu(),
                    **parts,
                    passes={
                        k: 1e3 * s for k, s in timing.medians(one.runs[1:] or one.runs).items()
                    },
                    counts=one.counts,
                    bytes=one.bytes,
                    numba=median.get("numba"),
                    memory=one.memory,
                    peak=_peak(),
                )
            )

    def measure_video(self, size: tuple[int, int], flow: str) -> None:
        """Pictures of a video whose motion comes from `flow`."""
        gc.collect()
        name = f"{size[0]} x {size[1]}, video by {flow}"
        self.tell(name)
        try:
            with gpu.reported(size):
                one = time_video(self.device, flow, size, self.rounds, self.limit)
        except (InputError, GpuMemoryError) as error:
            self.note(f"{name} skipped: {error}")
            return
        self.videos.append(one)

    def _check(self, name: str, size: tuple[int, int], samples: int, held: int) -> None:
        """Refuse runs that take too long, or more memory than there is."""
        if (seconds := _HEAVY * self._frame(name, size, samples)) > self.limit:
            raise InputError(f"{_HEAVY} frames would take about {_about(seconds)}, more than "
                             f"{self.limit:g} s")  # fmt: skip
        known = [f for f in self.figures if f.method == name]
        wanted = min((f.memory * math.prod(size) / math.prod(f.size) for f in known), default=0)
        if wanted + held > (most := _MEMORY * _memory()):
            raise InputError(f"it would hold {wanted / 2**30:.1f} GB, the others hold "
                             f"{held / 2**30:.1f} GB of {most / 2**30:.1f} GB")  # fmt: skip

    def _frame(self, name: str, size: tuple[int, int], samples: int) -> float:
        """Seconds of a frame, in proportion to pixels and samples; 0 where nothing is known."""
        known = [f for f in self.figures if f.method == name]
        return min(
            (f.wall / 1e3 * math.prod(size) / math.prod(f.size) * max(1, samples / f.samples)
             for f in known), default=0.0,
        )  # fmt: skip


def _memory() -> int:
    """The machine's memory [bytes]; infinite where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return sys.maxsize


def _peak() -> int:
    """The process's largest memory so far [bytes]; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def copy_bandwidth(device: wgpu.GPUDevice, rounds: int = 7) -> float:
    """GB/s that a copy from buffer to buffer reads and writes."""
    usage = wgpu.BufferUsage.COPY_SRC | wgpu.BufferUsage.COPY_DST
    a, b = (device.create_buffer(size=_COPY, usage=usage) for _ in range(2))

    def copy(encoder: wgpu.GPUCommandEncoder) -> None:
        encoder.copy_buffer_to_buffer(a, 0, b, 0, _COPY)

    seconds = [timing.work(device, copy) for _ in range(rounds + 1)][1:]
    return 2 * _COPY / statistics.median(seconds) / 1e9
