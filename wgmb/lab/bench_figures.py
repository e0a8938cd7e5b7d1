"""Figures of a bench, and the file in which they are kept."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..gpu.timing import TimestampClock
from ..io.atomic import write_file


@dataclass(frozen=True)
class BenchFigure:
    """One method at one size with one number of samples; milliseconds."""

    method: str
    width: int
    height: int
    samples: int
    wall: float
    """A frame, from its recording to the end of the work."""
    record: float | None
    """Of the calling thread: to record the frame's passes. None for a scene, which waits between
    its portions."""
    gpu: float
    """Of the GPU: from the begin of the first pass to the end of the last one.

    With the wall clock: from the submission of all passes to their end. The sum of the passes of a
    scene, which submits them by itself."""
    call: float | None = None
    """Arrays in, array out: `upload`, `wall` and `readback` of the same call, whose time is the
    median."""
    upload: float | None = None
    readback: float | None = None
    passes: dict[str, float] = field(default_factory=dict)
    """Every pass, by name; those of one name together."""
    counts: dict[str, int] = field(default_factory=dict)
    """Number of passes by name."""
    bytes: int = 0
    """Of all inputs and the output, each once: the least that must be moved."""
    numba: float | None = None
    """The tap blur on the CPU with as many samples, in the same rounds."""
    memory: int = 0
    """Of all textures and buffers that the method holds, inputs and output too [bytes]."""
    peak: int = 0
    """The process's largest memory so far [bytes]."""

    @property
    def key(self) -> tuple[Any, ...]:
        """Key by which figures of two runs are matched."""
        return self.method, self.width, self.height, self.samples

    @property
    def size(self) -> tuple[int, int]:
        """Width, height [px]."""
        return self.width, self.height

    @property
    def summed(self) -> float:
        """All passes, each timed by itself."""
        return sum(self.passes.values())

    @property
    def bandwidth(self) -> float | None:
        """`bytes` over `gpu` [GB/s]; None if either is 0."""
        return self.bytes / self.gpu / 1e6 if self.bytes and self.gpu else None


@dataclass(frozen=True)
class VideoFigure:
    """A source of motion, and pictures of one size that were blurred by it, in steady state."""

    flow: str
    """NAME[:QUALITY], as the settings `flow` and `flow_quality`."""
    width: int
    height: int
    how: str
    """The source in words."""
    pictures: int
    """Number of those that were timed."""
    rate: float
    """Pictures a second, arrays in and out."""
    thread: float
    """Milliseconds of the calling thread a picture, without waits."""
    counts: dict[str, float]
    """Calls of wgpu a picture (see calls.py), and objects made."""

    @property
    def key(self) -> tuple[Any, ...]:
        """Key by which figures of two runs are matched."""
        return self.flow, self.width, self.height


@dataclass(frozen=True)
class Bench:
    """A run's figures, and the copy bandwidth [GB/s] that went with them."""

    machine: dict[str, str]
    copy: float
    figures: list[BenchFigure]
    clock: str = TimestampClock.name
    """Clock of the passes: "timestamps" of the GPU, or "wall clock" around each one."""
    empty: float = 0.0
    """Milliseconds of an empty submission, taken from every pass that wall clock timed."""
    notes: list[str] = field(default_factory=list)
    """Skipped runs, with the reasons."""
    videos: list[VideoFigure] = field(default_factory=list)

    def save(self, path: Path) -> None:
        """As JSON, for `load`."""
        write_file(path, (json.dumps(asdict(self), indent=1) + "\n").encode())

    @classmethod
    def load(cls, path: Path) -> Bench:
        """Load a file written by `save`; errors name the file."""
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            figures = [BenchFigure(**f) for f in data["figures"]]
            videos = [VideoFigure(**v) for v in data["videos"]]
            read = {"copy": float(data["copy"]), "figures": figures, "videos": videos}
            return cls(**data | read)
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise InputError(f"{path}: not a saved bench: {error}") from None
