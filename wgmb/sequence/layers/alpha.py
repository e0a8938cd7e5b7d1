"""Alpha as programs write it -> colour premultiplied by it.

OpenEXR prescribes premultiplied colour. Some programs write straight colour, which is not
multiplied by alpha; others write light (fire, glows) with an alpha of 0.
"""

from __future__ import annotations

import numpy as np

ALPHAS = ("premultiplied", "straight")
_MOST = 0.5  # share of the pixels of alpha 0 that have colour, from which on it seems straight
_STRAIGHT = (
    "over half of the pixels of alpha 0 have colour: if the alpha is straight, not premultiplied, "
    "`alpha='straight'` reads it so"
)
_NONE = "alpha is 0 everywhere, though there is light: other images than EXR are written without it"


def premultiplied(rgba: np.ndarray) -> np.ndarray:
    """Straight colour, (height, width, 4), multiplied by its alpha."""
    made = rgba.astype(np.float32)
    with np.errstate(invalid="ignore"):  # infinite colour where alpha is 0
        made[..., :3] *= np.clip(made[..., 3:], 0, 1)
    made[made[..., 3] <= 0] = 0
    return made


def is_void(rgba: np.ndarray) -> bool:
    """True for light whose alpha is 0 everywhere; rgba: (height, width, 3 or 4)."""
    return rgba.shape[2] == 4 and not rgba[..., 3].any() and bool(rgba[..., :3].any())


def remark(rgba: np.ndarray) -> str:
    """A line for the user where alpha, of (height, width, 4), is not as OpenEXR prescribes."""
    if is_void(rgba):
        return _NONE
    empty = rgba[..., 3] == 0
    count = int(np.count_nonzero(empty))
    if not count or np.count_nonzero(rgba[empty, :3].any(axis=1)) <= _MOST * count:
        return ""
    return _STRAIGHT
