"""Results of a run: scored images, tables, curves; report.py writes them."""

from __future__ import annotations

import platform
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import wgpu

from .._version import __version__
from .cases import Case


@dataclass(frozen=True)
class Entry:
    """One picture of a case, judged and timed."""

    case: str
    label: str
    kind: str
    """"sharp", "peer", "floor" (of the truth's noise), "samples" (one step of the ladder) or
    "time" (all that fits a budget)."""
    measures: dict[str, float]
    samples: int | None = None
    seconds: float | None = None
    """From rendered frames, or from the scene, to the picture on the GPU."""
    frame_seconds: float = 0.0
    """Of them, rendering one sharp frame of the scene."""
    budget: float | None = None
    """Seconds it was to fit, of kind "time"."""
    traced: bool = False
    """True if the method renders a scene instead of blurring rendered frames."""
    on_page: bool = False
    """True if `picture` is shown on the page."""
    picture: np.ndarray | None = None


@dataclass(frozen=True)
class Table:
    """Further findings: numbers or texts."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    note: str = ""


@dataclass(frozen=True)
class Plot:
    """Curves by name, each a list of (x, y)."""

    title: str
    x: str
    y: str
    curves: dict[str, list[tuple[float, float]]]
    log: bool = True
    """True for a logarithmic x axis."""
    floor: float | None = None
    """The y value of a perfect image, if the truth has noise."""


@dataclass(frozen=True)
class Bars:
    """A bar for each row, of parts that add up."""

    title: str
    unit: str
    rows: dict[str, dict[str, float]]


@dataclass
class Report:
    """All that a run found out; report.py writes it down."""

    title: str
    command: str
    machine: dict[str, str]
    samples: int
    cases: list[Case] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plots: list[Plot] = field(default_factory=list)
    bars: list[Bars] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def of(self, case: str, **wanted: object) -> list[Entry]:
        """The entries of a case whose fields are as `wanted`."""
        return [
            e
            for e in self.entries
            if e.case == case and all(getattr(e, k) == v for k, v in wanted.items())
        ]


def machine(device: wgpu.GPUDevice) -> dict[str, str]:
    """Return the machine and software versions behind the figures, by name."""
    return {
        "adapter": device.adapter.summary,
        "wgmb": __version__,
        "wgpu": wgpu.__version__,
        "numpy": np.__version__,
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "made": time.strftime("%Y-%m-%d"),
    }
