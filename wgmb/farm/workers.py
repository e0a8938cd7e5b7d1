"""The place where a farm runs, its workers, and the parts of the frames they are given."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from .. import gpu

SMALLEST, LARGEST = 4, 64  # frames of a part
_PARTS_EACH = 4  # parts that a worker does, at least, so that all end at about the same time
PATIENCE = 60.0
"""Seconds that a run waits for a worker that can do something, or for a sign of life of one."""
LATE = 300.0
"""Seconds that frames may take in any case, before another worker is given them too."""
TIMES_LATE = 10  # as long as the slowest part that has ended


@dataclass
class WorkerPool:
    """The place of the workers, and the receivers of messages.

    `cluster`: address of a scheduler; without, `workers` processes are started here, by default
    one for each GPU. `note`: called with a line that a user should read, `details` with those
    that tell which worker did what; `check` all the time, and may raise to end the run.
    """

    cluster: str | None = None
    workers: int | None = None
    adapter: str | None = None
    note: Callable[[str], None] = lambda text: None
    details: Callable[[str], None] = lambda text: None
    check: Callable[[], None] = lambda: None
    plugin: Callable[..., Any] | None = None
    patience: float = PATIENCE

    def adapters(self) -> list[str]:
        """The adapters of the workers that are started here."""
        if self.adapter is not None:
            return [self.adapter]
        return hardware_adapters()


@dataclass
class Chunk:
    """Frames that are given to a worker together."""

    numbers: list[int]
    deaths: int = 0
    refused_by: set[str] = field(default_factory=set)
    """Addresses of workers that could not begin or write it."""


@dataclass
class Worker:
    """A worker as the driver sees it."""

    address: str
    sign: float = 0.0  # of life, the last one; see `signs_of_life`
    heard: float = 0.0  # when it changed [s, monotonic]
    name: str = ""
    host: str = ""
    why_not: str | None = None  # "": it can work; None: it is not known yet
    part: Chunk | None = None
    since: float = 0.0  # when it was given its part [s, monotonic]
    future: Any = None
    faults: int = 0


def size_of_part(frames: int, workers: int) -> int:
    """Frames that a worker is given at a time."""
    return min(max(frames // (_PARTS_EACH * max(workers, 1)), SMALLEST), LARGEST)


def hardware_adapters() -> list[str]:
    """Numbers of the adapters that are no software; none where the environment names one."""
    if os.environ.get("WGMB_ADAPTER"):
        return []
    kinds = [(a.info["adapter_type"], a.info["backend_type"]) for a in gpu.adapters()]
    return [
        str(i)
        for i, (kind, backend) in enumerate(kinds)
        if kind != gpu.SOFTWARE and not backend.startswith("OpenGL")
    ]
