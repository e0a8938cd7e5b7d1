"""One frame blurred in one call."""

from __future__ import annotations

from typing import Any, Literal, Unpack

import numpy as np
import wgpu
from numpy.typing import NDArray

from ..camera import Reprojections, Window
from ..frame import PASSES, Floats, Frame, Integers
from ..methods import default_method
from ..methods.contract import Method
from ..methods.keywords import Curve, MethodKeywords, MethodName
from ..shutter import Shutter, Weight
from .blur import Blur


class FrameKeywords(MethodKeywords, total=False):
    """Keywords of `blur`: the passes of a Frame, and the options of a Blur."""

    jitter: float
    max_blur: float | None
    device: wgpu.GPUDevice | str | None
    output: Literal["rgba32float", "rgba16float"]
    to_prev: Floats | None
    motion: Floats | None
    depth: Floats | None
    window: Window | None
    camera: Reprojections | None
    object_id: Integers | None
    normal: Floats | None
    holdout: Floats | None
    scale: Floats | None
    object_motion: bool
    prev: Frame | None
    next: Frame | None
    number: int
    wrap: Literal["off", "on"]
    diffuse_light: Floats | None
    diffuse_color: Floats | None
    glossy_light: Floats | None
    glossy_color: Floats | None


def blur(
    color: Floats,
    to_next: Floats | None = None,
    *,
    method: MethodName | type[Method] | None = None,
    shutter: Shutter | float = 180,
    curve: Curve | Weight | None = None,
    samples: int | Literal["auto"] | None = None,
    **more: Unpack[FrameKeywords],
) -> NDArray[np.float32]:
    """Blur one frame: linear colour in, linear colour out, motion in pixels per frame.

    `method`: as for Blur; by default gather if depth is available, else tap. `more`: the
    passes of Frame (to_prev, depth, camera, holdout, ...) and the options of Blur (jitter,
    max_blur, device, and those of the method).
    """
    options: dict[str, Any] = dict(more)
    passes = {name: options.pop(name) for name in PASSES if name in options}
    frame = Frame(color, to_next, **passes)
    name = method or default_method(frame.has)
    return Blur(name, shutter=shutter, curve=curve, samples=samples, **options)(frame)
