"""Difference between the image and the reference: PSNR and FLIP."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import metrics
from ...threads import crew


@dataclass
class Measured:
    """Between display values; `flip` comes later, where flip-evaluator is installed."""

    samples: int  # of the reference
    psnr: float  # dB; infinite if they are the same
    flip: Future[Any] | None = None


class Quality:
    """Measures anew whenever the reference has twice the samples."""

    ENOUGH = 64  # samples of the reference before it is worth measuring against

    def __init__(self):
        self._worker = crew(1, "flip")
        self._last: tuple[tuple[Any, ...], Measured] | None = None

    def latest(self, key: tuple[Any, ...]) -> Measured | None:
        """Return the latest measurement of the images identified by `key`."""
        return self._last[1] if self._last and self._last[0] == key else None

    def measure(
        self, key: tuple[Any, ...], done: int, total: int, pictures: Callable[[], list[np.ndarray]]
    ) -> None:
        """Measure if it is time to: the reference has `done` of `total` samples.

        `pictures` gives both, linear, (height, width, 3 or more).
        """
        have = self.latest(key)
        least = min(2 * have.samples, total) if have else self.ENOUGH
        if done < least or (have and have.samples == done):
            return
        picture, truth = (image[..., :3] for image in pictures())
        psnr = metrics.psnr(picture, truth)
        known = importlib.util.find_spec("flip_evaluator") is not None
        flip = self._worker.submit(metrics.flip, picture, truth) if known else None
        self._last = key, Measured(done, psnr, flip)
