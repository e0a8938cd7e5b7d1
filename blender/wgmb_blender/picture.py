"""Position of the pixels: the picture, its rendered part, and overscan around it."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .changed import Change
from .exposure import cameras_of
from .wgmb_worker.problem import ProblemError
from .wgmb_worker.recipe import Picture

_LENS = ("sensor_width", "sensor_height", "sensor_fit", "ortho_scale", "shift_x", "shift_y")


def picture_of(scene: bpy.types.Scene, margin: int = 0) -> Picture:
    """The picture that the scene's settings ask for."""
    render = scene.render
    share = render.resolution_percentage
    width, height = (
        max(1, side * share // 100) for side in (render.resolution_x, render.resolution_y)
    )
    if not render.use_border:
        return Picture((width, height), (0, 0, width, height), margin)
    left, right = (int(x * width) for x in (render.border_min_x, render.border_max_x))
    bottom, top = (int(y * height) for y in (render.border_min_y, render.border_max_y))
    if right <= left or top <= bottom:
        raise ProblemError("The render region is empty: draw another one, or switch it off")
    part = left, height - top, right, height - bottom
    return Picture((width, height), part, margin, render.use_crop_to_border)


def changes(scene: bpy.types.Scene, picture: Picture) -> Iterator[Change]:
    """Settings with which Blender renders the part with its margin, and no more."""
    render, margin = scene.render, picture.margin
    width, height = (side + 2 * margin for side in picture.size)
    if margin:
        yield render, "resolution_x", width
        yield render, "resolution_y", height
        yield render, "resolution_percentage", 100
        for camera in cameras_of(scene):
            yield from _wider(scene, camera.data, picture)
    if render.use_border:
        left, top, right, bottom = picture.part
        bottom, top = height - bottom - 2 * margin, height - top
        yield render, "use_crop_to_border", True
        yield render, "border_min_x", _share(left, width)
        yield render, "border_max_x", _share(right + 2 * margin, width)
        yield render, "border_min_y", _share(bottom, height)
        yield render, "border_max_y", _share(top, height)


def _share(pixel: int, of: int) -> float:
    """A place that Blender, which cuts off what is behind the point, takes for this pixel."""
    return min((pixel + 0.5) / of, 1.0)


def _wider(scene: bpy.types.Scene, lens: bpy.types.Camera, picture: Picture) -> Iterator[Change]:
    """Settings with which a camera also sees the margin; everything else stays in place."""
    if lens.type == "PANO":
        raise ProblemError(f"Overscan: {lens.name} is a panoramic camera, which has no edges")
    moved = {curve.data_path for curve in _curves(lens)} & set(_LENS)
    if moved:
        raise ProblemError(
            f"Overscan: {', '.join(sorted(moved))} of {lens.name} is animated, which overscan "
            "would have to change; set it to 0 pixels"
        )
    (width, height), render = picture.size, scene.render
    across = width * render.pixel_aspect_x >= height * render.pixel_aspect_y
    if lens.sensor_fit != "AUTO":
        across = lens.sensor_fit == "HORIZONTAL"
    side = width if across else height
    more = (side + 2 * picture.margin) / side
    sensor = lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width
    yield lens, "sensor_fit", "HORIZONTAL" if across else "VERTICAL"
    yield lens, "sensor_width" if across else "sensor_height", sensor * more
    yield lens, "ortho_scale", lens.ortho_scale * more
    yield lens, "shift_x", lens.shift_x / more
    yield lens, "shift_y", lens.shift_y / more


def _curves(lens: bpy.types.Camera) -> Iterator[bpy.types.FCurve]:
    """Everything that moves a camera's properties."""
    data = lens.animation_data
    if data is None:
        return
    yield from data.drivers
    if data.action is not None:
        if hasattr(data.action, "layers"):
            for layer in data.action.layers:
                for strip in layer.strips:
                    for bag in strip.channelbags:
                        yield from bag.fcurves
        else:
            yield from data.action.fcurves
