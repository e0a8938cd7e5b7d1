"""Repeated pictures: those that show the one before again, but for the noise of a codec.

A codec spends its bits on changes, so that its noise is a small share of them: where a picture
differs from the one before by less than a twentieth of the energy of the motion before and after
it, it repeats that picture while all else moves. A change that is as small before and after too,
such as a small pointer that moves alone, is motion.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from .picture import Picture
from .prediction import BLOCK

SAMPLED = 480  # pixels of width that are compared
_AHEAD = 4  # pictures after one in which motion is looked for
_NOISE = 1 / 20  # of the energy of a change: a codec's noise is less
_DISPLAY = 0.1  # of the picture: a display that counts on, such as a timer, is smaller,
_COUNTS = 0.25  # changes at least so much in other pictures too,
_MOST = 0.75  # and as much of their energy lies elsewhere
_COPY, _COPY_WORST = 0.5 / 255, 2 / 255  # root mean square of display values: all, worst block

T = TypeVar("T")
Change = Callable[[T, T], np.ndarray]
"""The energy of the change from one picture to another in each block, as `change` returns it."""


def change(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(rows, columns) mean square of the difference in each block; one of infinity if sizes differ.

    `a` and `b` are pixels in even distances, display values (height, width, 3).
    """
    if a.shape != b.shape:
        return np.full((1, 1), np.inf)
    off = np.square(a.astype(np.float32) - b).max(axis=2)
    padded = np.pad(off, [(0, -n % BLOCK) for n in off.shape], "edge")
    height, width = (n // BLOCK for n in padded.shape)
    return padded.reshape(height, BLOCK, width, BLOCK).mean(axis=(1, 3))


def without_repeats(
    pictures: Iterator[Picture[T]],
    change: Change[T],
    is_cut: Callable[[T, T], bool] | None,
    doubles: list[int],
) -> Iterator[Picture[T]]:
    """The pictures without repeated ones, whose numbers are added to `doubles`.

    Each is compared with the last one that was not left out, so that slow changes add up.
    """
    steps = _steps(pictures, change, is_cut)
    ahead: deque[tuple[Picture[T], _Step[T] | None]] = deque()
    kept: Picture[T] | None = None
    before: _Step[T] | None = None
    while True:
        while len(ahead) <= _AHEAD and (one := next(steps, None)) is not None:
            ahead.append(one)
        if not ahead:
            return
        picture, _ = ahead.popleft()
        if kept is not None:
            now = _Step(kept.content, picture.content, change, is_cut)
            after = [step for _, step in ahead if step is not None]
            if before is not None and len(after) < _AHEAD and _end(before, after):
                after = []
            if now.is_copy or _stands(now, before, after):
                doubles.append(picture.number)
                continue
            before = now
        kept = picture
        yield picture


class _Step(Generic[T]):
    """The change from one picture to another; a cut is no motion."""

    def __init__(self, a: T, b: T, change: Change[T], is_cut: Callable[[T, T], bool] | None):
        self.energy = change(a, b)
        self.total = float(self.energy.sum())
        self._is_cut = lambda: is_cut is not None and is_cut(a, b)

    @cached_property
    def is_cut(self) -> bool:
        """Return True if a cut lies between the pictures."""
        return self._is_cut()

    @property
    def is_copy(self) -> bool:
        """Return True if nothing is seen of the change."""
        return bool(self.energy.mean() < _COPY**2 and self.energy.max() < _COPY_WORST**2)


def _steps(
    pictures: Iterator[Picture[T]], change: Change[T], is_cut: Callable[[T, T], bool] | None
) -> Iterator[tuple[Picture[T], _Step[T] | None]]:
    """The pictures, each with the change from the one before."""
    before: Picture[T] | None = None
    for picture in pictures:
        step = before and _Step(before.content, picture.content, change, is_cut)
        yield picture, step
        before = picture


def _stands(now: _Step[T], before: _Step[T] | None, after: list[_Step[T]]) -> bool:
    """Return True if a picture stands still between motion before and after it."""
    most = max(after, key=lambda step: step.total, default=None)
    moves = [step for step in (before, most) if step is not None]
    if not all(_is_noise(now.energy, step.energy) for step in moves):
        return False
    return any(not step.is_cut for step in moves)


def _end(before: _Step[T], after: list[_Step[T]]) -> bool:
    """Return True if all stands still up to the end."""
    return all(_is_noise(step.energy, before.energy) for step in after)


def _is_noise(now: np.ndarray, moves: np.ndarray) -> bool:
    """Return True if a change is noise beside another one, apart from a small display."""
    if now.shape != moves.shape:
        return False
    falling = np.sort(now, axis=None)[::-1]
    left = falling.sum() - np.cumsum(falling)
    if falling.sum() <= _NOISE * moves.sum():
        return True
    largest = int(np.argmax(left <= _MOST * _NOISE * moves.sum()))
    is_display = _grown(now >= falling[largest])
    elsewhere = float(moves[~is_display].sum())
    return bool(
        is_display.mean() <= _DISPLAY
        and moves[is_display].sum() >= _COUNTS * now[is_display].sum()
        and elsewhere >= _MOST * moves.sum()
        and now[~is_display].sum() <= _NOISE * elsewhere
    )


def _grown(blocks: np.ndarray) -> np.ndarray:
    """The blocks and those beside them."""
    padded = np.pad(blocks, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]
