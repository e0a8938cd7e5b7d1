"""Lights that were cut off at white: expanded before a blur, compressed by the inverse after it.

8- and 10-bit pictures end at white, so that a lamp that moves is blurred as if it were no brighter
than paper, and its streak fades. The curve is the identity up to a knee, adds a square from there
to white, and goes on straight: smooth, ascending, with a closed inverse. It is taken of the
darkest colour of a pixel, since white paper and lamps reach white in all three and yellow paint
in two only; the others keep their ratio to it, so that hues stay.
`wgsl/common/highlights.wgsl` is the same for videos.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..gpu import wgsl
from .coding import HLG, PQ, Coding

MOST = 32.0  # times white
_WHITE = 1.001  # the most that counts as white


def check(highlights: float) -> None:
    """InputError unless white can count as so many times white."""
    if not 1 <= highlights <= MOST:
        raise InputError(f"`highlights` must be 1 to {MOST:.0f} times white, got {highlights:g}")


def check_coding(highlights: float, path: Path, coding: Coding) -> None:
    """InputError for a video that holds light above white."""
    if highlights != 1 and coding.transfer in (PQ, HLG):
        raise InputError(f"{path}: `highlights` is for videos clipped at white, not for HDR")


def expanded(rgba: np.ndarray, highlights: float) -> np.ndarray:
    """(height, width, 3 or 4) linear, premultiplied: white becomes `highlights` times white.

    InputError for pictures that hold light above white. Not finite values stay as they are.
    """
    most = float(_straight(rgba, np.max).max(initial=0))
    if most > _WHITE:
        raise InputError(
            f"holds light up to {most:.3g} times white, so `highlights` does not apply"
        )
    knee, bend = _curve(highlights)
    darkest = _straight(rgba, np.min)
    over = np.maximum(darkest - knee, 0)
    bent = np.minimum(over, 1 - knee)
    return _scaled(rgba, 1 + bend * bent * (2 * over - bent) / np.maximum(darkest, knee))


def compressed(rgba: np.ndarray, highlights: float) -> np.ndarray:
    """The inverse of `expanded`, for any light."""
    knee, bend = _curve(highlights)
    darkest = _straight(rgba, np.min)
    over = np.maximum(darkest - knee, 0)
    bent = np.minimum(over, highlights - knee)
    root = 2 * bent / (1 + np.sqrt(1 + 4 * bend * bent))
    x = root + (over - bent) / (1 + 2 * bend * (1 - knee))
    return _scaled(rgba, np.where(over > 0, (knee + x) / np.maximum(darkest, knee), 1))


def _curve(highlights: float) -> tuple[float, float]:
    """The knee, and the factor of the square above it."""
    knee = wgsl.load("common/highlights.wgsl").constant("HIGHLIGHT_KNEE")
    return knee, (highlights - 1) / (1 - knee) ** 2


def _straight(rgba: np.ndarray, pick: Callable[..., np.ndarray]) -> np.ndarray:
    """(height, width) the least or greatest of R, G, B, without alpha; 0 where it is not finite."""
    picked = pick(rgba[..., :3], axis=2).astype(np.float32)
    if rgba.shape[2] == 4:
        alpha = rgba[..., 3].astype(np.float32)
        picked = np.divide(picked, alpha, out=np.zeros_like(picked), where=alpha > 0)
    return np.where(np.isfinite(picked), picked, np.float32(0))


def _scaled(rgba: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """A copy whose colours are multiplied; alpha stays."""
    made = rgba.astype(np.float32)
    made[..., :3] *= gain[..., None]
    return made
