"""Lights that were cut off at white: expanded before a blur, compressed by the inverse after it.

8- and 10-bit pictures end at white, so that a lamp that moves is blurred as if it were no brighter
than paper, and its streak fades. The curve is the identity up to a knee, adds a square from there
to white, and goes on straight: smooth, ascending, with a closed inverse. It is taken of the
darkest colour of a pixel, since white paper and lamps reach white in all three and yellow paint
in two only; the others keep their ratio to it, so that hues stay.
`wgsl/common/highlights.wgsl` is the same for videos.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..gpu import wgsl
from .coding import HLG, PQ, Coding

MOST = 32.0  # times white
_WHITE = 1.001  # the most that counts as white


@dataclass(frozen=True)
class Expansion:
    """A change of light before a blur, and its inverse after it; false if there is none.

    `white`: times white that white counts as. InputError unless it is 1 (off) to MOST.
    """

    white: float = 1.0

    def __post_init__(self) -> None:
        if not 1 <= self.white <= MOST:
            raise InputError(
                f"`highlights` must be 1 to {MOST:.0f} times white, got {self.white:g}"
            )

    def __bool__(self) -> bool:
        return self.white != 1

    @property
    def record(self) -> dict[str, float]:
        """Its part of the record of a frame."""
        return {"highlights": self.white} if self else {}

    def check_video(self, path: Path, coding: Coding) -> None:
        """InputError for a video that holds light above white."""
        if self and coding.transfer in (PQ, HLG):
            raise InputError(f"{path}: `highlights` is for videos clipped at white, not for HDR")

    def check_pictures(self, is_clipped: bool) -> None:
        """InputError for pictures that hold light above white."""
        if self and not is_clipped:
            raise InputError("`highlights` is for pictures clipped at white, not for HDR")

    def check_frames(self, pattern: str, is_clipped: bool, is_converted: bool) -> None:
        """InputError for files that hold light above white, or whose colours are converted."""
        if self and not is_clipped:
            raise InputError(
                f"{pattern}: `highlights` is for pictures clipped at white, such as PNG; "
                "EXR holds light above it"
            )
        if self and is_converted:
            raise InputError("`highlights`, for sRGB pictures, cannot be combined with `from_`")

    def expanded(self, rgba: np.ndarray) -> np.ndarray:
        """(height, width, 3 or 4) linear, premultiplied: white becomes `white` times white.

        InputError for pictures that hold light above white. Not finite values stay as they are.
        """
        if not self:
            return rgba
        most = float(_straight(rgba, np.max).max(initial=0))
        if most > _WHITE:
            raise InputError(
                f"holds light up to {most:.3g} times white, so `highlights` does not apply"
            )
        knee, bend = self._curve
        darkest = _straight(rgba, np.min)
        over = np.maximum(darkest - knee, 0)
        bent = np.minimum(over, 1 - knee)
        return _scaled(rgba, 1 + bend * bent * (2 * over - bent) / np.maximum(darkest, knee))

    def compressed(self, rgba: np.ndarray) -> np.ndarray:
        """The inverse of `expanded`, for any light."""
        if not self:
            return rgba
        knee, bend = self._curve
        darkest = _straight(rgba, np.min)
        over = np.maximum(darkest - knee, 0)
        bent = np.minimum(over, self.white - knee)
        root = 2 * bent / (1 + np.sqrt(1 + 4 * bend * bent))
        x = root + (over - bent) / (1 + 2 * bend * (1 - knee))
        return _scaled(rgba, np.where(over > 0, (knee + x) / np.maximum(darkest, knee), 1))

    @property
    def _curve(self) -> tuple[float, float]:
        """The knee, and the factor of the square above it."""
        knee = wgsl.load("common/highlights.wgsl").constant("HIGHLIGHT_KNEE")
        return knee, (self.white - 1) / (1 - knee) ** 2


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
