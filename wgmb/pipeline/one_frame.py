"""One frame blurred in one call."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from typing import Any

import numpy as np

from ..frame import PASSES, Frame
from ..methods import default_method
from ..shutter import Shutter
from .blur import Blur


def blur(
    color: np.ndarray,
    to_next: np.ndarray | None = None,
    *,
    method: str | None = None,
    shutter: Shutter | float = 180,
    samples: int | str | None = None,
    **more: Any,
) -> np.ndarray:
    """Blur one frame: linear colour in, linear colour out, motion in pixels per frame.

    `method`: a name in METHODS; by default gather if depth is available, else tap. `more`: the
    passes of Frame (to_prev, depth, camera, holdout, ...) and the options of Blur (jitter,
    max_blur, device, and those of the method).
    """
    passes = {name: more.pop(name) for name in PASSES if name in more}
    frame = Frame(color, to_next, **passes)
    return Blur(method or default_method(frame.has), shutter=shutter, samples=samples, **more)(
        frame
    )
