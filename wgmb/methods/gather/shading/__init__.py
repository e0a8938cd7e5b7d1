"""Light that moves over surfaces: what to add to a frame's colours at other times."""

from .changes import SurfaceLight
from .light import (
    FOLLOWED,
    Added,
    Kind,
    LightTimes,
    MovingLight,
)

__all__ = ["FOLLOWED", "Added", "Kind", "LightTimes", "MovingLight", "SurfaceLight"]
