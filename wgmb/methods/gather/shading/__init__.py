"""Light that moves over surfaces: what to add to a frame's colours at other times."""

from .changes import Seen
from .light import (
    Added,
    Kind,
    MovingLight,
    Times,
)

__all__ = ["Added", "Kind", "MovingLight", "Seen", "Times"]
