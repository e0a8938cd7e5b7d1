"""The level of detail of images: coarse or quick at first and during motion, then in full."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from ..state.state import State
from .adaptive import MOST_PATIENCE, PATIENCE, Pace
from .frame_status import FrameStatus
from .place import Box, whole

_SETTLE = 0.35  # seconds of stillness before antialiasing


class Detail:
    """The level of detail and the method, by earlier drawings and how long they took.

    `is_slow`: the quickest method comes first, and while something moves. `target`: seconds that
    a frame may take then.
    """

    def __init__(self, is_slow: bool, target: float):
        self.is_slow, self.pace = is_slow, Pace(HALF if is_slow else 0, target)
        self.level = 0
        self.is_preview = False
        """The quickest method is drawn instead of the one that is set."""
        self.has_choice = False
        """Of the quickest method and the one that is set."""
        self.is_complete = False
        """All images of it are."""
        self._stand_in = StandIn(target)
        self._still: tuple[Any, ...] = ()
        self._still_since = 0.0
        self._fewest = 0  # pixels for the method that is set
        self._moved = False

    def begin(
        self,
        state: State,
        place: Box,
        full_size: tuple[int, int],
        now: float,
        *,
        moving: bool,
        full: bool,
        has_preview: bool,
    ) -> None:
        """Choose it for the next images, which have `full_size` [px] in the end, `now` [s].

        `has_preview`: the quickest method can stand for the one that is set.
        """
        self.has_choice = self.is_slow and not full and has_preview
        if self.has_choice:
            smallest = Pace.SCALES[HALF] ** 2 if state.is_scene else 1.0
            self._fewest = round(math.prod(full_size) * smallest)
            self._stand_in.begin((state.source, state.suited_blur, state.mode, full_size))
            self._choose_slow(state, place, moving)
        else:
            self.is_preview = False
            self._choose_quick(state, place, now, moving, full)
        if not state.is_scene:
            self.level = 0

    def size(self, state: State, size: tuple[int, int], place: Box) -> tuple[tuple[int, int], int]:
        """Size to draw [px], for frames of `size`, and rays per pixel side."""
        if not state.is_scene:
            return size, 1
        scale, antialias = self.pace.quality(self.level, state.scene.antialias)
        width, height = whole(place)
        return (max(round(width * scale), 1), max(round(height * scale), 1)), antialias

    def finished(self, report: FrameStatus, seconds: float, antialias: int) -> None:
        """The window's frame took so long; moving frames set the pace."""
        if not report.moving:
            self._moved = False
        elif report.changed and not self._moved:  # the first one may have had shaders to compile
            self._moved = True
        elif report.changed:
            drawing, pixels = report.seconds["draw"], math.prod(report.size)
            if self.is_preview or not self.has_choice:
                self.pace.observe(seconds, drawing, antialias)
            if self.has_choice:
                took = seconds, drawing, antialias, pixels
                self._moved = self._stand_in.is_kept(*took, self._fewest)

    def observe_still(self, seconds: float, pixels: int) -> None:
        """A still image by the method that is set took so long."""
        self._stand_in.observe_still(seconds, pixels)

    def _choose_quick(self, state: State, place: Box, now: float, moving: bool, full: bool) -> None:
        """Coarse while moving, then in full, then antialiased."""
        if full:
            self.level = 0
        elif moving:
            self.level, self._still_since = self.pace.level, now
        elif (key := (state.picture, place)) != self._still:
            self._still, self._still_since = key, now
            self.level = min(self.level, 1) if self.level else min(self.pace.level, 1)
        elif self.level > 1:
            self.level = 1
        elif self.level == 1 and now - self._still_since > _SETTLE:
            self.level = 0

    def _choose_slow(self, state: State, place: Box, moving: bool) -> None:
        """By the quickest method at first, coarse and then in full size, then as it is set.

        While moving by the method that is set, where that is quick enough.
        """
        key = state.picture, place
        if moving or key != self._still:
            self._still, self.is_preview = key, not moving or self._stand_in.is_needed
            self.level = max((self.pace if self.is_preview else self._stand_in.pace).level, 1)
        elif self.is_complete:
            self.is_preview = self.is_preview and self.level > 1
            self.level = 1 if self.is_preview else 0


# ---- the method while something moves: the one that is set where it is quick, else the quickest


HALF = 5
"""The level of detail with half the width."""
_SURE = 0.7  # share of the target that is expected at most of what is tried
_UNKNOWN = 4.0  # times the quickest one's seconds that a method is taken for whose are not known
_HOPELESS = 4.0  # times the target that a single frame may take


class StandIn:
    """Choice between the method that is set and the quickest one, while something moves.

    The one that is set is used as long as its frames take `target` seconds at most, at half the
    width or more. It is tried where that is likely, by the times of its still images, or because
    the quickest one takes much less; where it proves too slow, again ever later.
    """

    def __init__(self, target: float):
        self._target = target
        self._key: tuple[Any, ...] = ()
        self._begin_anew()

    def _begin_anew(self) -> None:
        self._pixel = math.inf  # seconds of the set method for one, at least
        self._patience = PATIENCE
        self._stand_in()

    def _stand_in(self) -> None:
        self.is_needed, self._quick = True, 0
        self.pace = Pace(HALF, self._target)
        self._took: deque[float] = deque(maxlen=3)

    def begin(self, key: tuple[Any, ...]) -> None:
        """Forget all observations, if `key` (the picture and its method) is another one."""
        if key != self._key:
            self._key = key
            self._begin_anew()

    def observe_still(self, seconds: float, pixels: int) -> None:
        """A still image by the method that is set took so long, perhaps with compiling."""
        self._pixel = min(self._pixel, seconds / pixels)

    def is_kept(
        self, seconds: float, drawing: float, antialias: int, pixels: int, fewest: int
    ) -> bool:
        """Take note of a moving frame of `pixels`; False if the next one has the other method.

        It took so long, `drawing` of it for the part that depends on its pixels. `fewest` that the
        method that is set would be drawn with.
        """
        if self.is_needed:
            known = seconds - drawing + self._pixel * fewest
            unknown = _UNKNOWN * seconds if pixels >= fewest else math.inf
            expected = unknown if math.isinf(self._pixel) else known
            self._quick = self._quick + 1 if expected <= _SURE * self._target else 0
            self.is_needed = self._quick < self._patience
            return self.is_needed
        self._took.append(seconds)
        self._pixel = drawing / pixels
        usual = sorted(self._took)[1] if len(self._took) == 3 else 0.0
        is_coarsest = self.pace.level >= HALF
        if (is_coarsest and usual > 1.1 * self._target) or seconds > _HOPELESS * self._target:
            self._patience = min(2 * self._patience, MOST_PATIENCE)
            self._stand_in()
            return False
        self.pace.observe(seconds, drawing, antialias)
        return True
