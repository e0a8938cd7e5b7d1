"""Occupancy: the share of an exposure in which a rotating body is at a place.

Inputs of wgsl/scene/density.wgsl: rotations, and tables of the shutter's integral.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..gpu import wgsl
from ..shutter import Shutter

CLOSED = ("box", "cosine")  # curves whose integral and periodic sum the shader has in closed form
SLOWEST = 3e-5  # radians within the exposure; a slower body stands still
MOST_TURNS = 4096  # within the exposure: beyond, a periodic sum is its mean to 1e-3
TURN = 2 * math.pi


@dataclass(frozen=True)
class Rotation:
    """By `angle` [rad] within the exposure, of a body with `symmetry`-fold rotational symmetry."""

    angle: float
    symmetry: int = 1

    @property
    def turns(self) -> float:
        """Number of times a symmetric part of the body passes a point within the exposure."""
        return self.symmetry * self.angle / TURN

    @property
    def many(self) -> bool:
        """True if the closed form for all revolutions applies."""
        return self.turns > wgsl.load("scene/density.wgsl").constant("CLOSED_FROM")

    def fill(self, row: np.ndarray, index: int) -> None:
        """Write it into a `Rotation` of the shader; `index`: which of the `tables` is its own."""
        row["rate"], row["turns"] = 1 / max(self.symmetry * self.angle, SLOWEST), self.turns
        row["half"] = self.turns / 2 % 1
        row["sum"] = (index + 1) * (_shares() + 1)


def overrides(shutter: Shutter, rotations: list[Rotation]) -> dict[str, float]:
    """The shader's constants that depend on the shutter and on speeds."""
    closed = shutter.curve in CLOSED
    curve = CLOSED.index(str(shutter.curve)) if closed else len(CLOSED)
    return {"CURVE": curve, "MANY": any(rotation.many for rotation in rotations)}


def tables(shutter: Shutter, rotations: list[Rotation]) -> np.ndarray:
    """The shutter's integral, and for each fast volume its periodic sum less the mean."""
    if shutter.curve in CLOSED:
        return np.zeros(1, np.float32)
    shares = _shares()
    _, integral = shutter.integral(shares)
    rows = [integral]
    for rotation in rotations:
        rows.append(
            periodic_sum(integral, rotation.turns) if rotation.many else np.zeros(shares + 1)
        )
    return np.concatenate(rows).astype(np.float32)


def periodic_sum(integral: np.ndarray, turns: float) -> np.ndarray:
    """Sum over k of S((edge + 2 pi k) / speed), less its mean and trend, at edges 0 to 2 pi.

    `integral`: S at equal shares of the exposure; `turns`: revolutions within it.
    """
    steps = len(integral) - 1
    if turns > MOST_TURNS:
        return np.zeros(steps + 1)
    edges = np.linspace(0, 1, steps + 1)  # turns
    reach = math.ceil(turns / 2) + 1
    shares = np.linspace(0, 1, steps + 1)
    total = np.zeros(steps + 1)
    for k in range(-reach, reach + 1):
        total += np.interp((edges + k) / turns + 0.5, shares, integral)
    return total - edges - (reach + 0.5)


def _shares() -> int:
    return wgsl.load("scene/density.wgsl").integer("SHARES")
