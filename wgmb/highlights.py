"""Lights that were cut off at white: expanded before a blur, compressed by the inverse after it.

8- and 10-bit pictures end at white, so that a lamp that moves is blurred as if it were no brighter
than paper, and its streak fades. The curve is the identity up to a knee, adds a square from there
to white, and goes on straight: smooth, ascending, with a closed inverse. It is taken of the
brightest colour of a pixel, and the others keep their ratio to it, so that hues stay.
`wgsl/common/highlights.wgsl` is the same for videos.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from pathlib import Path

import numpy as np

from .coding import HLG, PQ, Coding
from .errors import InputError
from .gpu import wgsl

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
    brightest = _brightest(rgba)
    if np.any(brightest > _WHITE):
        most = float(brightest.max())
        raise InputError(
            f"holds light up to {most:.3g} times white, so `highlights` does not apply"
        )
    knee, bend = _curve(highlights)
    over = np.maximum(brightest - knee, 0)
    bent = np.minimum(over, 1 - knee)
    return _scaled(rgba, 1 + bend * bent * (2 * over - bent) / np.maximum(brightest, knee))


def compressed(rgba: np.ndarray, highlights: float) -> np.ndarray:
    """The inverse of `expanded`, for any light."""
    knee, bend = _curve(highlights)
    brightest = _brightest(rgba)
    over = np.maximum(brightest - knee, 0)
    bent = np.minimum(over, highlights - knee)
    root = 2 * bent / (1 + np.sqrt(1 + 4 * bend * bent))
    x = root + (over - bent) / (1 + 2 * bend * (1 - knee))
    return _scaled(rgba, np.where(over > 0, (knee + x) / np.maximum(brightest, knee), 1))


def _curve(highlights: float) -> tuple[float, float]:
    """The knee, and the factor of the square above it."""
    knee = wgsl.load("common/highlights.wgsl").constant("HIGHLIGHT_KNEE")
    return knee, (highlights - 1) / (1 - knee) ** 2


def _brightest(rgba: np.ndarray) -> np.ndarray:
    """(height, width) the greatest of R, G, B, without alpha; 0 where nothing is finite."""
    most = rgba[..., :3].max(axis=2).astype(np.float32)
    if rgba.shape[2] == 4:
        alpha = rgba[..., 3].astype(np.float32)
        most = np.divide(most, alpha, out=np.zeros_like(most), where=alpha > 0)
    return np.where(np.isfinite(most), most, np.float32(0))


def _scaled(rgba: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """A copy whose colours are multiplied; alpha stays."""
    made = rgba.astype(np.float32)
    made[..., :3] *= gain[..., None]
    return made
