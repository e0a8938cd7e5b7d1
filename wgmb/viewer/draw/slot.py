"""The content of a slot, and the report of one update of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import wgpu

from .composer import Image
from .place import Box
from .quality import Measured


@dataclass
class Slot:
    """One image and how far it has come."""

    label: str = ""
    key: tuple = ()  # what is drawn
    fine: tuple = ()  # how finely: width and height, rays, level while moving
    name: str = ""  # of its texture
    kind: str = "COLOR"
    texture: wgpu.GPUTexture | None = None
    done: int = 0
    total: int = 1
    is_preview: bool = False  # drawn by the quickest method, which stands for another one

    @property
    def ready(self) -> bool:
        """True if the image is complete."""
        return self.texture is not None and self.done >= self.total

    @property
    def image(self) -> Image:
        """For the screen."""
        return Image(self.texture, self.kind, (self.key, self.fine, self.done))


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
    made_of: tuple[int, ...] = ()  # pictures that share the exposure of a video's output frame
    busy: bool = False
    changed: bool = False
