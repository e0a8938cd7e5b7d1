"""Decisions about a whole sequence, made once, so that parts of it can be blurred apart.

Everything here is plain values that JSON can hold.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from .data_windows import Sides
from .layers.vector_test import ConventionFinding


@dataclass(frozen=True)
class SequenceFindings:
    """A Clip's findings: the same for every part of the sequence, whatever is on disk later."""

    on_disk: tuple[int, ...]
    """Every frame that there is."""
    views: tuple[str, ...]
    """Names of the views, the default one first."""
    has: tuple[str, ...]
    """Inputs of the first readable frame (see Frame.has), sorted; none if no frame is readable."""
    finding: ConventionFinding
    """Meaning of the vectors."""
    depth_kind: str
    """Kind of the depth."""
    cuts: tuple[int, ...]
    """Frames that begin a shot, as the user or an edit says."""
    beyond: Sides
    """Sides of the data window beyond which the picture is unknown: left, top, right, bottom."""
    is_joined: bool = False
    """True if the left and the right edge seem to be one meridian of a panorama."""
    notes: tuple[str, ...] = ()
    """Messages for the user about all frames."""

    def plain(self) -> dict[str, Any]:
        """As JSON can hold it; `on_disk` as ranges."""
        finding = asdict(self.finding)
        return {
            "on_disk": ranges(self.on_disk),
            "views": list(self.views),
            "has": list(self.has),
            "finding": finding,
            "depth_kind": self.depth_kind,
            "cuts": list(self.cuts),
            "beyond": list(self.beyond),
            "is_joined": self.is_joined,
            "notes": list(self.notes),
        }


Range = tuple[int, int, int]
"""First, last and step; the step is negative where numbers go down."""


def ranges(numbers: Sequence[int]) -> list[Range]:
    """Numbers, in their order, as few ranges; two that stand alone are not made one."""
    spans: list[Range] = []
    at = 0
    while at < len(numbers):
        end, step = at, 0
        while end + 1 < len(numbers):
            apart = numbers[end + 1] - numbers[end]
            if not apart or (step and apart != step):
                break
            end, step = end + 1, apart
        if end == at + 1 and abs(step) != 1:  # the second one may begin a longer range
            end = at
        spans.append((numbers[at], numbers[end], step if end > at else 1))
        at = end + 1
    return spans


def numbers(ranges: Iterable[Sequence[int]]) -> list[int]:
    """The numbers of ranges, in their order."""
    return [
        n
        for first, last, step in ranges
        for n in range(first, last + (1 if step > 0 else -1), step)
    ]
