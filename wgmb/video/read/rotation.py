"""Pictures that a phone or a camera stored lying on their side, upright."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

_MATRIX = struct.Struct("=9i")  # of a display, in 1/65536


@dataclass(frozen=True)
class Orientation:
    """Turn of stored pictures: transposed or not, then mirrored."""

    swaps: bool = False
    flips: tuple[bool, bool] = (False, False)  # vertically, horizontally
    odd: bool = False  # the file wants another angle

    def __call__(self, plane: np.ndarray) -> np.ndarray:
        """The plane, upright."""
        if self == Orientation(odd=self.odd):
            return plane
        plane = plane.T if self.swaps else plane
        down, across = (slice(None, None, -1 if flip else 1) for flip in self.flips)
        return np.ascontiguousarray(plane[down, across])

    @property
    def degrees(self) -> int:
        """Clockwise; of a mirrored picture, after mirroring it horizontally."""
        if self.swaps:
            return 90 if not self.flips[0] else 270
        return 180 if self.flips[0] else 0


def rotation_of(data: bytes | None, degrees: int = 0) -> Orientation:
    """The turn that a display matrix demands: x' = a x + c y, y' = b x + d y.

    Without one, that by `degrees` counter-clockwise.
    """
    if data is None:
        found = {0: Orientation(), 90: Orientation(True, (True, False)),
                 270: Orientation(True, (False, True)),
                 180: Orientation(False, (True, True))}  # fmt: skip
        return found.get(degrees % 360, Orientation(odd=True))
    a, b, _, c, d = (np.sign(v) if abs(v) > 0x8000 else 0 for v in _MATRIX.unpack_from(data)[:5])
    if a and d and not b and not c:
        return Orientation(False, (bool(d < 0), bool(a < 0)))
    if b and c and not a and not d:
        return Orientation(True, (bool(b < 0), bool(c < 0)))
    return Orientation(odd=True)
