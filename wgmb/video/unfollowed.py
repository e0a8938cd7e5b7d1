"""Places that hold something in one picture alone: its motion was not found, and it stays sharp.

A body that jumps leaves the same ground before and after it. Places that go on changing, such as
counters, are none.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ..flow.dis.blocks import SMALL, UNFIT, Reduced, scaled
from ..flow.dis.inverse_search import Pictures

LEAST = 16  # pixels beside each other, of a picture reduced to SMALL px along the longer side
STILL = 1.0  # px of that size, below which a place stays sharp
_HELD = 0.5  # share of a pixel that is held out on purpose


def is_unfollowed(pictures: Pictures, motion: np.ndarray, held: np.ndarray | None) -> bool:
    """Return True if a place fits neither neighbour, which are alike there, and hardly moves.

    `pictures`: previous, own, next, (height, width) uint8; without both neighbours it is False, as
    one of them may hide a place. `motion`: (height, width, 4) [px]. `held`: (height, width) 0..1,
    areas that are to stay sharp.
    """
    if any(picture is None for picture in pictures):
        return False
    cv2: Any = importlib.import_module("cv2")
    level = Reduced(pictures, SMALL)
    state = scaled(motion, level)
    places = (level.unfit(state) > 0) & (np.abs(state).max(axis=2) < STILL)
    before, after = level.sides.values()
    places &= cv2.blur(cv2.absdiff(before, after), (3, 3)) < UNFIT
    if held is not None:
        places &= level.reduced(held.astype(np.float32)) < _HELD
    _, _, stats, _ = cv2.connectedComponentsWithStats(places.astype(np.uint8), connectivity=8)
    return bool((stats[1:, cv2.CC_STAT_AREA] >= LEAST).any())
