"""Source of motion for frames without vectors."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

Found = tuple[np.ndarray, np.ndarray | None]


class MotionSource(Protocol):
    """Motion from pictures: Flow (wgmb/flow) and Dis are two."""

    def shot(self, load: Callable[[int], Any], depth: bool = True) -> Callable[[int], Found | None]:
        """Motion (height, width, 4) [px] and depth of a shot's frames, by their number.

        `load` gives the picture of a number, or None outside the shot. Without `depth` a source
        may leave the depth out, as None.
        """
        ...
