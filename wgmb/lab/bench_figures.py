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
    gpu: float
    """All passes, from recording to the end of the work."""
    call: float | None = None
    """Arrays in, array out: `upload`, `gpu` and `readback` of the same call, whose time is the
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
    def bandwidth(self) -> float:
        """`bytes` over `gpu` [GB/s]."""
        return self.bytes / self.gpu / 1e6


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

    def save(self, path: Path) -> None:
        """As JSON, for `load`."""
        write_file(path, (json.dumps(asdict(self), indent=1) + "\n").encode())

    @classmethod
    def load(cls, path: Path) -> Bench:
        """Load a file written by `save`; errors name the file."""
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            figures = [BenchFigure(**f) for f in data["figures"]]
            return cls(**data | {"copy": float(data["copy"]), "figures": figures})
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise InputError(f"{path}: not a saved bench: {error}") from None
