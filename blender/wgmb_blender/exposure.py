"""The scene's own motion blur settings and its cuts."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import bpy
import numpy as np

from .wgmb_worker.recipe import Exposure

_MIDDLE = {"START": 0.5, "CENTER": 0.0, "END": -0.5}
_POINTS = 257  # at which the curve is taken
_FLAT = 1e-4


def exposure_of(scene: bpy.types.Scene) -> Exposure:
    """Shutter, position, curve and rolling shutter of the render settings.

    Cycles' rolling shutter exposes each row for a share of the shutter's time; the rest of the time
    is the delay from the top row to the bottom one. The middle is that of the whole time.
    """
    render = scene.render
    length = render.motion_blur_shutter  # frame intervals
    middle = _MIDDLE[render.motion_blur_position] * length
    rolling: dict[str, Any] = {}
    if render.engine == "CYCLES" and scene.cycles.rolling_shutter_type == "TOP":
        share = scene.cycles.rolling_shutter_duration
        rolling = {"rolling": "down", "rolling_duration": (1 - share) * length}
        length *= share
    return Exposure(360 * length, middle, _curve(render), **rolling)


def _curve(render: bpy.types.RenderSettings) -> tuple[float, ...] | None:
    """The shutter curve, or None where it is flat."""
    mapping = render.motion_blur_shutter_curve
    mapping.initialize()
    curve = mapping.curves[0]
    x = np.linspace(0, 1, _POINTS)
    y = np.clip([mapping.evaluate(curve, float(t)) for t in x], 0, None)
    if np.ptp(y) < _FLAT or not y.any():
        return None
    return tuple(float(value) for value in y)


def cuts_of(scene: bpy.types.Scene) -> list[int]:
    """The frames at which a marker binds another camera than the one before it."""
    bound = sorted(
        ((m.frame, m.camera) for m in scene.timeline_markers if m.camera), key=lambda one: one[0]
    )
    longer = scene.render.frame_map_new / scene.render.frame_map_old
    return [
        math.ceil(frame * longer)  # markers stand at times, not at frames, where these differ
        for (_, before), (frame, camera) in pairwise(bound)
        if camera != before
    ]


def cameras_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Every camera that the scene may be seen through."""
    bound = [m.camera for m in scene.timeline_markers if m.camera]
    found = [scene.camera, *bound]
    if scene.render.use_multiview and scene.render.views_format == "MULTIVIEW":
        found += [o for o in scene.objects if o.type == "CAMERA"]
    return [c for c in dict.fromkeys(found) if c is not None and c.type == "CAMERA"]
