"""The cost of a motion: by its match with the neighbours, and its change from pixel to pixel."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from .blocks import constants
from .inverse_search import Pictures

LONGEST = 480  # px along the longer side at which matches are compared
PATCH = 5  # px of these a side of a match, and over which changes of motion are averaged
AROUND = 25  # px of these a side over which what is compared is averaged
ROUGH = 2.5  # levels of 255 that the motion's change from a pixel to the next costs, per px
MOST_ROUGH, MOST_OTHER = constants("choice/compare", "MOST_ROUGH", "MOST_OTHER")


def _cv() -> Any:
    """OpenCV, which is optional."""
    return importlib.import_module("cv2")


def is_better(pictures: Pictures, one: np.ndarray, other: np.ndarray, margin: float) -> np.ndarray:
    """(height, width) bool: where `other` costs less than `one`, averaged over some pixels.

    Both (height, width, 4) [px]. `pictures`: a picture between its neighbours, (height, width)
    uint8. `margin`: how many times the match and the change of `one` count. They are compared for
    every so many pixels that the longer side has at most `LONGEST`.
    """
    here = pictures[1]
    assert here is not None
    step = -(-max(here.shape) // LONGEST)
    small = [None if p is None else _small(p, step).astype(np.float32) for p in pictures]
    ours, its = (
        _parts(small, motion[step // 2 :: step, step // 2 :: step] / np.float32(step))
        for motion in (one, other)
    )
    better, change, worse = ours
    apart = np.float32(margin) * (better + change) + worse - sum(its)
    takes = _cv().blur(apart, (AROUND, AROUND)) > 0
    takes = np.repeat(np.repeat(takes, step, axis=0), step, axis=1)
    rows, columns = (max(n - m, 0) for n, m in zip(here.shape, takes.shape, strict=True))
    return np.pad(takes, ((0, rows), (0, columns)), mode="edge")[: here.shape[0], : here.shape[1]]


def _small(grey: np.ndarray, step: int) -> np.ndarray:
    """The means around the pixels [step // 2 :: step] of a picture."""
    return _cv().blur(grey, (step, step))[step // 2 :: step, step // 2 :: step]


def _parts(pictures: Pictures, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Costs of a motion: of its difference to the neighbour that fits better, of its change from
    pixel to pixel, and of its difference to the other neighbour.

    Differences are means of patches. That to the other is at most `MOST_OTHER`, and 0 where there
    is none.
    """
    prev, here, next = pictures
    assert here is not None
    y, x = np.mgrid[: here.shape[0], : here.shape[1]].astype(np.float32)
    found = []
    for other, way in ((prev, motion[..., :2]), (next, motion[..., 2:])):
        if other is not None:
            at, edge = (x + way[..., 0], y + way[..., 1]), _cv().BORDER_REPLICATE
            moved = _cv().remap(other, *at, _cv().INTER_LINEAR, borderMode=edge)
            found.append(_cv().blur(np.abs(moved - here), (PATCH, PATCH)))
    worse = np.maximum.reduce(found) if len(found) > 1 else np.zeros_like(found[0])
    worse = np.minimum(worse, np.float32(MOST_OTHER))
    return np.minimum.reduce(found), ROUGH * _roughness(motion), worse


def _roughness(motion: np.ndarray) -> np.ndarray:
    """By how much the motion changes from a pixel to those right of it and below, in patches."""
    change = np.zeros(motion.shape[:2], np.float32)
    change[:, :-1] += np.abs(np.diff(motion, axis=1)).sum(axis=2)
    change[:-1] += np.abs(np.diff(motion, axis=0)).sum(axis=2)
    return _cv().blur(np.minimum(change, MOST_ROUGH), (PATCH, PATCH))
