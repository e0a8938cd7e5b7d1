"""The article's figures (P. Cusa, "Motion Blur All the Way Down", 2022).

Flat pictures in display values: an orbiting disk, the response of a cone cell, a torus in section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..cone import Cone
from ..errors import InputError
from ..shutter import Shutter

KINDS = ("DISK", "NATURAL", "SCREEN", "SPIRIC")
RADIUS, ORBIT = 0.1, 0.2  # of the disk and its circle [picture heights]
RATE = 60.0  # frames a second of figures 2 and 3
WAYS = 10  # frames that figure 3 adds up
FASTEST = 1e4  # rad/s: beyond, nothing changes and a loop over passes is long


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One of KINDS. `small`, `large`: radii; `rotation`: clockwise at time 0 [rad].

    `shutter`: for kinds with a shutter of their own, at RATE frames per second.
    """

    kind: str
    small: float = RADIUS
    large: float = ORBIT
    slice: float = 0.0
    speed: float
    rotation: float = 0.0
    begin: float = 0.0
    shutter: Shutter | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.speed <= FASTEST:
            raise InputError(f"speed must be 0 to {FASTEST:g} rad/s, got {self.speed}")

    def fill(self, row: np.ndarray, time: float) -> None:
        """Write the picture at `time` [s] into a `Figure` of wgsl/figure.wgsl."""
        cone, time = Cone(), self.begin + time
        row["small"], row["large"], row["slice"] = self.small, self.large, self.slice
        # Standing still is perceived as the slowest motion is.
        row["speed"] = max(self.speed, 1e-3)
        row["sharpness"] = cone.rate, cone.shift
        row["passes"] = math.ceil(cone.memory * self.speed / (2 * math.pi)) + 1
        row["dash"] = 1.0 if self.kind == "NATURAL" else 0.0
        if self.kind == "SCREEN":
            number = math.floor(RATE * time + 1e-9)
            frames = (number - np.arange(WAYS)) / RATE
            # As the article has it: each frame counts from its instant on.
            row["frames"][:WAYS, 1] = cone.weights(time - frames + 0.5 / RATE, 1 / RATE)
            row["frames"][:WAYS, 0] = self._angle(frames)
            row["ways"], time = WAYS, number / RATE
        row["rotation"] = row["circle"] = self._angle(time)

    def _angle(self, time: Any):
        return np.remainder(self.rotation + self.speed * time, 2 * math.pi)
