"""Motion of two sources: a search, where it is better than dense inverse search."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import Flow
from .consistency import SPACING, changing, lost
from .inverse_search import Dis, Found

LONGEST = 480  # px along the longer side at which matches are compared
PATCH = 5  # px of these a side of a match, and over which changes of motion are averaged
AROUND = 25  # px of these a side over which what is compared is averaged
ROUGH = 2.5  # levels of 255 that the motion's change from a pixel to the next costs, per px,
MOST_ROUGH = 4.0  # px, beyond which a change costs no more
MOST_OTHER = 8.0  # levels of 255 that the difference to the neighbour that fits worse may cost
LOST_AROUND = 9  # px of these a side around what is lost, which count as lost
MUCH = 0.03  # of a picture: where the one loses more, all of it counts as lost;
CLEARLY = 0.4  # where the other loses less than so much of that, it is right throughout,
AT_ENDS = 0.75  # or than this at the ends of a shot, as both lose what the only neighbour hides


class Both(NamedTuple):
    """A picture as both sources take it: (height, width) uint8, and what gives its light,
    as Flow takes it."""

    grey: np.ndarray
    light: Callable[[], Any]


Load = Callable[[int], Both | np.ndarray | None]


class Hypothesis(NamedTuple):
    """A motion that a picture may have, and the share of the picture that follows it, of 1."""

    share: float
    motion: Found


class BetterMatch:
    """Motion and depth order from dense inverse search and from a search, the better per place.

    Better is what matches better and changes less from pixel to pixel. Matches are those with the
    neighbour that fits better, as the other may hide a pixel; but what both show should match in
    both, so the difference to the other counts, up to `MOST_OTHER`. `margin`: how many times
    the difference of dense inverse search to the former counts where that loses something, by the
    ways there and back (consistency.py): it makes differences small also where it follows something
    else. Where it loses much of a picture, that and its change count so many times, throughout.

    `by_ways`: the search is taken throughout where much of a picture is lost, and clearly less of
    it by the search. For that, those beside a picture are searched, too. `judge`: a picture is not
    searched where this loses little, in it and in those beside it. `others`: further
    hypotheses, each the share of a picture that follows it, and how many times the cost of dense
    inverse search the search may have there.
    """

    def __init__(
        self,
        quick: Dis,
        search: Flow,
        margin: float = 1.0,
        by_ways: bool = False,
        judge: Dis | None = None,
        others: Sequence[tuple[float, float]] = (),
    ):
        self.quick, self.search, self.margin = quick, search, margin
        self.by_ways, self.judge, self.others = by_ways, judge, tuple(others)

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion may depend on."""
        return max(self.quick.reach(size), self.by_ways + self.search.reach(size))

    def shot(self, load: Load, depth: bool = True) -> MixedShot:
        """Motion (height, width, 4) [px] and depth of a shot's pictures.

        `load` gives them as Both, or (height, width, 3 or 4), linear.
        """
        return _BetterOfShot(self, load, depth)


class MixedShot(ABC):
    """Motion of the pictures of a shot, of which there may be several hypotheses."""

    @abstractmethod
    def __call__(self, number: int) -> Found | None:
        """The likeliest motion (height, width, 4) [px] of a picture, and depth; None if alone."""

    @abstractmethod
    def hypotheses(self, number: int) -> Sequence[Hypothesis]:
        """All of them, the likeliest first; none if the picture is alone.

        Where nobody knows the motion, the mean of blurs errs less on average: Girod, "Efficiency
        Analysis of Multihypothesis Motion-Compensated Prediction for Video Coding" (2000).
        """


class _BetterOfShot(MixedShot):
    def __init__(self, source: BetterMatch, load: Load, depth: bool):
        self._source = source

        def grey(number: int) -> np.ndarray | None:
            picture = load(number)
            if picture is None:
                return None
            return picture.grey if isinstance(picture, Both) else source.quick.grey(picture)

        def light(number: int) -> Any:
            picture = load(number)
            return picture.light() if isinstance(picture, Both) else picture

        self._grey, self._quick = grey, _Source(source.quick.shot(grey, depth))
        self._search = _Source(source.search.shot(light))
        judge = source.judge
        self._judge = None if judge is None else judge.shot(grey, depth=False)

    def __call__(self, number: int) -> Found | None:
        found = self._of(number, ())
        return found[0].motion if found else None

    def hypotheses(self, number: int) -> Sequence[Hypothesis]:
        return self._of(number, self._source.others)

    def _of(self, number: int, others: Sequence[tuple[float, float]]) -> Sequence[Hypothesis]:
        source, one = self._source, self._quick(number)
        if one is None:
            return []
        if self._judge is not None and not self._judge.loses(number):
            return [Hypothesis(1.0, one)]
        other = self._search(number)
        if other is None:
            return []
        prev, here, next = (self._grey(n) for n in (number - 1, number, number + 1))
        assert here is not None
        changes = changing(source.quick.change(prev, here, next))
        loss = self._quick.lost(number, changes)
        is_much = loss.mean() > MUCH
        if source.by_ways and is_much:
            lost = self._search.lost(number, changes)
            clearly = AT_ENDS if prev is None or next is None else CLEARLY
            if lost.mean() < clearly * loss.mean():
                searched = other[0], None if one[1] is None else other[1]
                return [Hypothesis(1.0, searched)]
        loss = None if is_much else loss
        ours, its = costs([prev, here, next], one[0], other[0], source.margin, loss)
        takes = its < ours
        also = [(share, its < np.float32(times) * ours) for share, times in others]
        if all((takes == there).all() for _, there in also):
            return [Hypothesis(1.0, chosen(one, other, takes))]
        every = [(1 - sum(share for share, _ in also), takes), *also]
        return [Hypothesis(share, chosen(one, other, there)) for share, there in every]


class _Source:
    """The motion of a shot's pictures, each found once if asked for in order, and what it loses."""

    def __init__(self, shot: Callable[[int], Found | None]):
        self._shot = shot
        self._ahead: dict[int, Found] = {}
        self._ways: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def __call__(self, number: int) -> Found | None:
        """Motion and depth of a picture; None where it is alone."""
        for old in [n for n in self._ahead if n < number]:
            del self._ahead[old]
        return self._ahead.pop(number, None) or self._motion_of(number)

    def lost(self, number: int, changes: np.ndarray) -> np.ndarray:
        """Losses of a picture, see consistency.lost.

        The motion of the next picture is kept until it is asked for.
        """
        for old in [n for n in self._ways if abs(n - number) > 1]:
            del self._ways[old]
        for n in (number - 1, number, number + 1):
            if n not in self._ways and (found := self._motion_of(n)) is not None and n > number:
                self._ahead[n] = found
        return lost(self._ways, number, changes)

    def _motion_of(self, number: int) -> Found | None:
        found = self._shot(number)
        if found is not None:
            thin = found[0][::SPACING, ::SPACING]
            self._ways[number] = thin[..., :2].copy(), thin[..., 2:].copy()
        return found


def costs(
    near: list[np.ndarray | None],
    one: np.ndarray,
    other: np.ndarray,
    margin: float = 1.0,
    loss: np.ndarray | None = None,
) -> list[np.ndarray]:
    """Those of either motion, averaged over some pixels: (rows, columns) [levels of 255] each.

    They are for every so many pixels that the longer side has at most `LONGEST`. `near`: a picture
    between its neighbours, of which one may lack, (height, width) uint8. `loss`: of blocks of
    `SPACING`, bool, where `one` is lost, and its difference to the neighbour that fits better
    counts `margin` times; None: that and its change do, throughout.
    """
    cv2: Any = importlib.import_module("cv2")
    here = near[1]
    assert here is not None
    step = _step(here.shape)
    small = [None if g is None else _small(g, step).astype(np.float32) for g in near]
    ours, its = (
        _measured(small, motion[step // 2 :: step, step // 2 :: step] / np.float32(step))
        for motion in (one, other)
    )
    difference, change, to_worse = ours
    if loss is None:
        difference, change = (np.float32(margin) * part for part in (difference, change))
    else:
        factor = 1 + (np.float32(margin) - 1) * _grown(loss, difference.shape)
        difference = factor * difference
    around = AROUND, AROUND
    return [cv2.blur(sum(parts), around) for parts in ((difference, change, to_worse), its)]


def chosen(one: Found, other: Found, takes: np.ndarray) -> Found:
    """`other` where `takes`, which is for every so many pixels, as costs are."""
    height, width = one[0].shape[:2]
    step = _step((height, width))
    takes = np.repeat(np.repeat(takes, step, axis=0), step, axis=1)
    rows, columns = (n - m for n, m in zip((height, width), takes.shape, strict=True))
    takes = np.pad(takes, ((0, max(rows, 0)), (0, max(columns, 0))), mode="edge")
    takes = takes[:height, :width]
    motion = np.where(takes[..., None], other[0], one[0])
    if one[1] is None or other[1] is None:
        return motion, None
    return motion, np.where(takes, other[1], one[1])


def _step(shape: tuple[int, ...]) -> int:
    """Pixels from one to the next that are compared."""
    return -(-max(shape) // LONGEST)


def _small(grey: np.ndarray, step: int) -> np.ndarray:
    """The means around the pixels [step // 2 :: step] of a picture."""
    cv2: Any = importlib.import_module("cv2")
    return cv2.blur(grey, (step, step))[step // 2 :: step, step // 2 :: step]


def _measured(
    near: list[np.ndarray | None], motion: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Costs of a motion: of its difference to the neighbour that fits better, of its change from
    pixel to pixel, and of its difference to the other neighbour.

    Differences are means of patches. That to the other is at most `MOST_OTHER`, and 0 where there
    is none.
    """
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
    worse = np.maximum.reduce(found) if len(found) > 1 else np.zeros_like(found[0])
    worse = np.minimum(worse, np.float32(MOST_OTHER))
    return np.minimum.reduce(found), ROUGH * _roughness(motion), worse


def _roughness(motion: np.ndarray) -> np.ndarray:
    """By how much the motion changes from a pixel to those right of it and below, in patches."""
    cv2: Any = importlib.import_module("cv2")
    change = np.zeros(motion.shape[:2], np.float32)
    change[:, :-1] += np.abs(np.diff(motion, axis=1)).sum(axis=2)
    change[:-1] += np.abs(np.diff(motion, axis=0)).sum(axis=2)
    return cv2.blur(np.minimum(change, MOST_ROUGH), (PATCH, PATCH))


def _grown(loss: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Losses of blocks and the pixels near by, (height, width) 0 or 1, at another size."""
    cv2: Any = importlib.import_module("cv2")
    lost = cv2.resize(loss.astype(np.float32), shape[::-1], interpolation=cv2.INTER_NEAREST)
    return cv2.dilate(lost, np.ones((LOST_AROUND, LOST_AROUND), np.uint8))
