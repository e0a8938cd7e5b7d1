"""Colour coding of a video: planes, bits, range, matrix, transfer, primaries (ITU-T H.273)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

UNSPECIFIED = 2  # as matrix, transfer or primaries
BT709 = 1
BT601 = 6  # matrix and primaries of 525 lines; 5 is that of 625 lines, with the same matrix
BT2020 = 9
FLOAT = 32  # bits
SRGB, LINEAR, PQ, HLG = 13, 8, 16, 18  # transfers


@dataclass(frozen=True)
class Coding:
    """Storage of a video's pixels; the numbers are those of H.273, none UNSPECIFIED."""

    model: Literal["yuv", "rgb", "grey"] = "yuv"
    """Planes: Y, Cb, Cr; or R, G, B; or grey alone. Alpha comes last."""
    bits: int = 8
    """8 to 16; over 8, samples are the low bits of 16. FLOAT: signals, 1 is white."""
    steps: tuple[int, int] = (2, 2)
    """Columns and rows of pixels to one sample of chroma: (2, 2) is 4:2:0, (1, 1) 4:4:4."""
    alpha: bool = False
    """Straight (unassociated) alpha, in full range."""
    full_range: bool = False
    matrix: int = BT709
    transfer: int = BT709
    primaries: int = BT709


@dataclass(frozen=True, eq=False)
class CodedPicture:
    """One decoded picture, as it is stored."""

    planes: tuple[np.ndarray, ...]
    """(height, width) uint8 or uint16 each; chroma smaller by Coding.steps, rounded up.
    Perhaps read-only, with gaps between their rows. Of FLOAT: one, (height, width, 4) float32."""
    coding: Coding

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        height, width = self.planes[0].shape[:2]
        return width, height
