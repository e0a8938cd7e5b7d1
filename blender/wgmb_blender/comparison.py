"""The image that shows a sharp frame beside its blurred one."""

from __future__ import annotations

import bpy
import numpy as np

COMPARISON = "Motion Blur: sharp, blurred"


def show(rgba: np.ndarray) -> bpy.types.Image:
    """Show linear premultiplied light, (height, width, 4), the first row on top."""
    height, width = rgba.shape[:2]
    image = bpy.data.images.get(COMPARISON)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(COMPARISON, width, height, alpha=True, float_buffer=True)
        image.alpha_mode = "PREMUL"
        image.use_view_as_render = True
    image.pixels.foreach_set(np.ascontiguousarray(rgba[::-1], np.float32).ravel())
    image.update()
    return image
