"""Motion of two sources: a search, where it matches better than dense inverse search."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .. import Flow
from .consistency import SHARE, SPACING, changing, lost
from .inverse_search import Dis, Found

LONGEST = 480  # px along the longer side at which matches are compared
PATCH = 5  # px of these a side of a match
AROUND = 25  # px of these a side over which matches are averaged
CLEARLY = 0.8  # of the one's mean difference in a picture, or of what it loses there: below it, the
# other is right throughout


class Both(NamedTuple):
    """A picture as both sources take it: (height, width) uint8, and what gives its light,
    as Flow takes it."""

    grey: np.ndarray
    light: Callable[[], Any]


class BetterMatch:
    """Motion and depth order from dense inverse search and from a search, whichever matches better.

    `margin`: how many times the difference of dense inverse search that of the search may be. A
    thorough dense inverse search makes it small also where it follows something else. A search that
    finds nothing leaves states without order, which are specks in a blurred picture; there, dense
    inverse search is smooth.

    `by_ways`: the search is taken throughout also where it loses clearly less of a picture, by the
    ways there and back (consistency.py). For that, those beside a picture are searched, too.
    """

    def __init__(self, quick: Dis, search: Flow, margin: float = 1.0, by_ways: bool = False):
        self._quick, self._search, self._margin = quick, search, margin
        self._by_ways = by_ways

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion may depend on."""
        return self._by_ways + max(self._quick.reach(size), self._search.reach(size))

    def shot(
        self, load: Callable[[int], Both | np.ndarray | None], depth: bool = True
    ) -> Callable[[int], Found | None]:
        """Motion (height, width, 4) [px] and depth of a shot's pictures.

        `load` gives them as Both, or (height, width, 3 or 4), linear.
        """

        def grey(number: int) -> np.ndarray | None:
            picture = load(number)
            if picture is None:
                return None
            return picture.grey if isinstance(picture, Both) else self._quick.grey(picture)

        def light(number: int) -> Any:
            picture = load(number)
            return picture.light() if isinstance(picture, Both) else picture

        sources = _Sources(self._quick.shot(grey, depth), self._search.shot(light))

        def better_of(number: int) -> Found | None:
            found = sources(number)
            if found is None:
                return None
            one, other = found
            near = [grey(n) for n in (number - 1, number, number + 1)]
            if self._by_ways:
                prev, here, next = near
                assert here is not None
                changes = changing(self._quick.change(prev, here, next))
                loss, others = sources.lost(number, changes)
                if loss > SHARE and others < CLEARLY * loss:
                    return other[0], None if one[1] is None else other[1]
            return better(near, one, other, self._margin)

        return better_of


class _Sources:
    """The motion of a shot's pictures by two sources, each found once, and what they lose."""

    def __init__(self, *shots: Callable[[int], Found | None]):
        self._shots = shots
        self._ahead: dict[int, list[Found]] = {}
        self._ways: list[dict[int, tuple[np.ndarray, np.ndarray]]] = [{} for _ in shots]

    def __call__(self, number: int) -> list[Found] | None:
        """Motion and depth of a picture by each source; None where it is alone."""
        for old in [n for n in self._ahead if n < number]:
            del self._ahead[old]
        return self._ahead.pop(number, None) or self._motion_of(number)

    def lost(self, number: int, changes: np.ndarray) -> list[float]:
        """The share of a picture that each source loses, see consistency.lost.

        The motion of the next picture is kept until it is asked for.
        """
        for ways in self._ways:
            for old in [n for n in ways if abs(n - number) > 1]:
                del ways[old]
        for n in (number - 1, number + 1):
            if n not in self._ways[0] and (found := self._motion_of(n)) is not None and n > number:
                self._ahead[n] = found
        return [float(lost(ways, number, changes).mean()) for ways in self._ways]

    def _motion_of(self, number: int) -> list[Found] | None:
        found = [shot(number) for shot in self._shots]
        sure = [one for one in found if one is not None]
        if len(sure) < len(found):
            return None
        for ways, (motion, _) in zip(self._ways, sure, strict=True):
            thin = motion[::SPACING, ::SPACING]
            ways[number] = thin[..., :2].copy(), thin[..., 2:].copy()
        return sure


def better(near: list[np.ndarray | None], one: Found, other: Found, margin: float = 1.0) -> Found:
    """`other` where its match, averaged over some pixels, is up to `margin` times that of `one`.

    Where it is clearly better in the mean of the picture, `other` is taken throughout. `near`: a
    picture between its neighbours, of which one may lack, (height, width) uint8.
    """
    cv2: Any = importlib.import_module("cv2")
    here = near[1]
    assert here is not None
    height, width = here.shape
    step = -(-max(here.shape) // LONGEST)
    small = [None if g is None else _small(g, step).astype(np.float32) for g in near]
    matches = []
    for motion, _ in (one, other):
        thin = motion[step // 2 :: step, step // 2 :: step] / np.float32(step)
        matches.append(_match(small, np.ascontiguousarray(thin)))
    if matches[1].mean() < CLEARLY * matches[0].mean():
        return other[0], None if one[1] is None else other[1]
    gain = cv2.blur(margin * matches[0] - matches[1], (AROUND, AROUND))
    takes = np.repeat(np.repeat(gain > 0, step, axis=0), step, axis=1)
    rows, columns = (n - m for n, m in zip((height, width), takes.shape, strict=True))
    takes = np.pad(takes, ((0, max(rows, 0)), (0, max(columns, 0))), mode="edge")
    takes = takes[:height, :width]
    motion = np.where(takes[..., None], other[0], one[0])
    if one[1] is None or other[1] is None:
        return motion, None
    return motion, np.where(takes, other[1], one[1])


def _small(grey: np.ndarray, step: int) -> np.ndarray:
    """The means around the pixels [step // 2 :: step] of a picture."""
    cv2: Any = importlib.import_module("cv2")
    return cv2.blur(grey, (step, step))[step // 2 :: step, step // 2 :: step]


def _match(near: list[np.ndarray | None], motion: np.ndarray) -> np.ndarray:
    """Mean difference of patches along a motion, to the neighbour that fits better."""
    cv2: Any = importlib.import_module("cv2")
    prev, here, next = near
    assert here is not None
    y, x = np.mgrid[: here.shape[0], : here.shape[1]].astype(np.float32)
    found = []
    for other, way in ((prev, motion[..., :2]), (next, motion[..., 2:])):
        if other is not None:
            at = x + way[..., 0], y + way[..., 1]
            edge = cv2.BORDER_REPLICATE
            moved = cv2.remap(other, *at, cv2.INTER_LINEAR, borderMode=edge)
            found.append(cv2.blur(np.abs(moved - here), (PATCH, PATCH)))
    return np.minimum.reduce(found)
