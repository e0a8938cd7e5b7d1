"""Difference between the image and the reference: PSNR and FLIP."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np

from ...color.srgb import srgb
from ...threads import crew


@dataclass
class Measured:
    """Between display values; `flip` comes later, where flip-evaluator is installed."""

    samples: int  # of the reference
    psnr: float  # dB
    flip: Future | None = None


class Quality:
    """Measures anew whenever the reference has twice the samples."""

    ENOUGH = 64  # samples of the reference before it is worth measuring against

    def __init__(self):
        self._worker = crew(1, "flip")
        self._last: tuple[tuple, Measured] | None = None

    def latest(self, key: tuple) -> Measured | None:
        """Return the latest measurement of the images identified by `key`."""
        return self._last[1] if self._last and self._last[0] == key else None

    def measure(
        self, key: tuple, done: int, total: int, pictures: Callable[[], list[np.ndarray]]
    ) -> None:
        """Measure if it is time to: the reference has `done` of `total` samples.

        `pictures` gives both, linear, (height, width, 3 or more).
        """
        have = self.latest(key)
        least = min(2 * have.samples, total) if have else self.ENOUGH
        if done < least or (have and have.samples == done):
            return
        got, want = (srgb(picture[..., :3]) for picture in pictures())
        error = float(np.mean((got.astype("f8") - want) ** 2))
        psnr = -10 * np.log10(max(error, 1e-10))
        known = importlib.util.find_spec("flip_evaluator") is not None
        flip = self._worker.submit(_flip, got, want) if known else None
        self._last = key, Measured(done, float(psnr), flip)


def _flip(got: np.ndarray, want: np.ndarray) -> float:
    """Mean LDR-FLIP of display values (Andersson et al. 2020)."""
    import flip_evaluator  # pyright: ignore[reportMissingImports]

    _, mean, _ = flip_evaluator.evaluate(want, got, "LDR", inputsRGB=True)
    return float(mean)
