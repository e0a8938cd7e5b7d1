"""Motion of a clip's frames from their pictures, where the files hold none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import InputError
from ..pipeline import panorama
from ..shots.cuts import pictures_differ
from ..shots.motion import Found, MotionSource, ShotMotion
from .frame_cache import FrameCache
from .frame_file import FrameFile

FAR = 10  # frames around one that its motion may depend on, in pictures of up to 16,384 px


def standing(source: FrameFile) -> Found:
    """No motion (height, width, 4) [px], and one depth: at another rate, pictures are averaged."""
    shape = source.rgba.shape[:2]
    return np.zeros((*shape, 4), np.float32), np.ones(shape, np.float32)


class PictureMotion:
    """Motion (height, width, 4) [px] and depth order of frames by a source of motion.

    A frame's motion depends on pictures of its own shot alone, and of its own data window. Motion
    of a picture that `goes_around` is found across its left and right edge, too: the search sees
    it a second time, turned by half, where this edge is in the middle.
    """

    def __init__(
        self, stored: FrameCache, motion: MotionSource, goes_around: Callable[[FrameFile], bool]
    ):
        self._stored, self._motion, self._goes_around = stored, motion, goes_around
        self._cuts: dict[tuple[int, str | None], bool] = {}
        self._searches: dict[tuple[str | None, bool], ShotMotion] = {}

    def __call__(self, source: FrameFile) -> Found | None:
        """None where a frame is alone in its shot."""
        number, view = source.number, source.view
        height, width = source.rgba.shape[:2]
        self._stored.margin = max(self._stored.margin, self._motion.reach((width, height)))
        found = self._search(view, is_turned=False)(number)
        if found is None or not self._goes_around(source):
            return found
        turned = self._search(view, is_turned=True)(number)
        return found if turned is None else _joined(found, turned)

    def _search(self, view: str | None, is_turned: bool) -> ShotMotion:
        """The search in the pictures of a view, or in the same, turned by half."""
        if (key := (view, is_turned)) not in self._searches:
            self._searches[key] = ShotMotion(
                self._motion,
                lambda number: self._picture(number, *key),
                lambda a, b: self._same_shot(a, b, view),
            )
        return self._searches[key]

    def _picture(self, number: int, view: str | None, is_turned: bool) -> np.ndarray | None:
        source = self._source(number, view)
        if source is None:
            return None
        return panorama.turned(source.rgba) if is_turned else source.rgba

    def _same_shot(self, a: int, b: int, view: str | None) -> bool:
        """True if no cut lies between two frames; frames far apart count as different shots."""
        if abs(a - b) > 2 * self._stored.margin:
            return False
        return not any(self._is_cut(n, view) for n in range(min(a, b) + 1, max(a, b) + 1))

    def _is_cut(self, number: int, view: str | None) -> bool:
        """True if a cut, a gap, or another data window lies before a frame."""
        key = number, view
        if key not in self._cuts:
            while len(self._cuts) > 8 * self._stored.margin:
                self._cuts.pop(next(iter(self._cuts)))
            before, after = (self._source(n, view) for n in (number - 1, number))
            self._cuts[key] = (
                before is None
                or after is None
                or self._stored.is_known_cut(number, -1)
                or before.data_window != after.data_window
                or pictures_differ(before.rgba, after.rgba)
            )
        return self._cuts[key]

    def _source(self, number: int, view: str | None) -> FrameFile | None:
        if not self._stored.files.is_there(number):
            return None
        try:
            found = self._stored.source(number, view)
            return found if found.reference_channel is not None else None
        except (InputError, OSError):  # its turn to fail comes
            return None


def _joined(flat: Found, turned: Found) -> Found:
    """Motion and depth of a panorama, and of the same one turned by half, each from its middle."""
    (motion, depth), (other, its_depth) = flat, turned
    if depth is not None and its_depth is not None:
        depth = panorama.joined(depth, its_depth)
    return panorama.joined(motion, other), depth
