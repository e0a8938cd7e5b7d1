"""One picture in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass
class Picture(Generic[T]):
    """One picture in time."""

    time: float
    """Time at which it is first shown [s]."""
    content: T
    """The picture itself: whatever the reader's tests for cuts and repeats take."""
    number: int = 0
    """Of the frame in its file."""
    begins_shot: bool = False
    breaks_motion: bool = False
    """No motion leads to it from the one before: it begins a shot, or a flash, or ends one."""
