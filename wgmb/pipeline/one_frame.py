"""One frame blurred in one call."""

from __future__ import annotations

from typing import Any, Literal, Unpack

import numpy as np
import wgpu
from numpy.typing import NDArray

from ..frame import PASSES, Floats, Frame, PassKeywords
from ..methods import default_method
from ..methods.contract import Method
from ..methods.keywords import BlurKeywords, Curve, MethodName
from ..shutter import Shutter, Weight
from .blur import Blur


class FrameKeywords(PassKeywords, BlurKeywords, total=False):
    """Keywords of `blur`: the passes of a Frame, and the options of a Blur."""

    device: wgpu.GPUDevice | str | None
    output: Literal["rgba32float", "rgba16float"]


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

    `method`: as for Blur; by default gather if depth is available, else tiles. `more`: the
    passes of Frame (to_prev, depth, camera, holdout, ...) and the options of Blur (jitter,
    max_blur, device, and those of the method).
    """
    options: dict[str, Any] = dict(more)
    passes = {name: options.pop(name) for name in PASSES if name in options}
    frame = Frame(color, to_next, **passes)
    name = method or default_method(frame.has)
    return Blur(name, shutter=shutter, curve=curve, samples=samples, **options)(frame)
