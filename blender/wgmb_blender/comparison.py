"""Images that show what the blur does: a sharp frame beside its blurred one, and a preview."""

from __future__ import annotations

import bpy
import numpy as np

COMPARISON = "Motion Blur: sharp, blurred"
PREVIEW = "Motion Blur: preview"


def show(rgba: np.ndarray, name: str = COMPARISON) -> bpy.types.Image:
    """Show linear premultiplied light, (height, width, 4), the first row on top."""
    height, width = rgba.shape[:2]
    image = bpy.data.images.get(name)
    if image is not None and tuple(image.size) != (width, height):
        image.scale(width, height)  # another one would not be in the editor that shows this one
    if image is None:
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
        image.alpha_mode = "PREMUL"
        image.use_view_as_render = True
    image.pixels.foreach_set(np.ascontiguousarray(rgba[::-1], np.float32).ravel())
    image.update()
    return image


def open_in_editor(screen: bpy.types.Screen | None, image: bpy.types.Image) -> bool:
    """Show an image in the first Image Editor; False if there is none."""
    for area in getattr(screen, "areas", ()):
        if area.type == "IMAGE_EDITOR":
            area.spaces.active.image = image
            return True
    return False
