"""The content of a slot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import wgpu

from .composer import Image


@dataclass
class Slot:
    """One image and how far it has come."""

    label: str = ""
    key: tuple[Any, ...] = ()  # what is drawn
    fine: tuple[Any, ...] = ()  # how finely: width and height, rays, level while moving
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
