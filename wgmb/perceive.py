"""What a viewer's cones make of a frame sequence.

A cone cell's answer to a flash: W(x) = rate exp(shift - rate x) F(x), x seconds later, whose
integral is F(x) = exp(-exp(shift - rate x)) (Cusa 2022, after Howlett et al. 2017).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .errors import InputError


@dataclass(frozen=True)
class Cone:
    """A cone cell: its answer to a flash peaks `peak` [s] later and fades with `rate` [1/s]."""

    rate: float = 50.0
    peak: float = 0.05

    def __post_init__(self):
        if not (math.isfinite(self.rate) and 1 <= self.rate <= 10_000):
            raise InputError(f"rate must be 1 to 10000 per second, got {self.rate}")
        if not (math.isfinite(self.peak) and 0 <= self.peak <= 1):
            raise InputError(f"peak must be 0 to 1 second, got {self.peak}")

    @property
    def shift(self) -> float:
        """Delay times rate."""
        return self.rate * self.peak

    @property
    def memory(self) -> float:
        """Seconds after which less than 1e-4 of a flash is still to come."""
        return (self.shift + math.log(1e4)) / self.rate

    def seen(self, x: np.ndarray | float) -> np.ndarray:
        """Share of the answer to a flash that has come `x` seconds later."""
        return np.exp(-np.exp(np.minimum(self.shift - self.rate * np.asarray(x, float), 80)))

    def weights(self, ages: np.ndarray, held: float) -> np.ndarray:
        """What pictures add that were shown for `held` [s], in the mean `ages` [s] ago."""
        ages = np.asarray(ages, float)
        return self.seen(ages + held / 2) - self.seen(ages - held / 2)
