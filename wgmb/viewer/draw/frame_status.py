"""The report of one update of the images."""

from __future__ import annotations

from dataclasses import dataclass, field

from .place import Box
from .quality import Measured


@dataclass
class FrameStatus:
    """Result of one update, for the panel."""

    full: tuple[int, int] = (0, 0)
    shape: tuple[float, float] = (1, 1)  # width and height of the whole picture, in square pixels
    place: Box = (0, 0, 0, 0)
    area: Box = (0, 0, 0, 0)
    moving: bool = False
    size: tuple[int, int] = (0, 0)
    preview: str = ""  # of what, where a quick method stands for the one that is set
    drafts: list[str] = field(default_factory=list)  # in what way motion is no more than a draft
    seconds: dict[str, float] = field(default_factory=dict)  # on the clock
    passes: dict[str, float] = field(default_factory=dict)  # on the GPU, where it tells
    labels: tuple[str, str] = ("", "")
    kind: str = "COLOR"
    reference: tuple[int, int] = (0, 1)  # samples done, of how many
    measured: Measured | None = None
    waiting: str = ""  # what is shown meanwhile, and what for
    frame: str = ""  # of a video: its output frame, and the pictures that share the exposure
    busy: bool = False
    changed: bool = False
