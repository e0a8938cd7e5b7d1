"""Frames of a video's pictures, with their motion as far as it is known; the last ones are kept."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from ...errors import InputError
from ...exposure import evened
from ...frame import Frame
from ...video.linear_frames import VideoPictures
from ...video.planes import Planes
from ...video.read.reader import VideoReader
from .video_exposure import Knowledge
from .video_motion import PictureFinding

_MEMORY = 1 << 29  # bytes of pictures kept
_FEWEST = 12  # pictures kept at least


class PictureFrames:
    """Pictures of a video as Frames; `known` tells of their motion.

    `planes`: make their light.
    """

    def __init__(self, reader: VideoReader, planes: Planes, known: Knowledge):
        self._reader, self._known = reader, known
        self._pictures = VideoPictures(reader, planes)
        self._times = reader.times.seconds
        self._colors: OrderedDict[int, np.ndarray] = OrderedDict()
        self._frames: OrderedDict[int, tuple[PictureFinding | None, Frame]] = OrderedDict()

    def __call__(self, number: int, neighbours: bool = False) -> Frame:
        """A picture with its motion; with `neighbours` between them, where motion leads there."""
        frame, known = self._frame(number), self._known(number)
        if not neighbours or known is None or "motion" not in frame.has:
            return frame
        before = None if known.begins or known.before is None else self._frame(known.before)
        after = None if known.ends or known.after is None else self._frame(known.after)
        return frame.between(
            *(one if one is not None and "motion" in one.has else None for one in (before, after))
        )

    def surroundings(
        self, number: int
    ) -> tuple[tuple[int | None, int, int | None], tuple[float, float]]:
        """Numbers of a picture, of those its motion leads to, and of those that `evened` it."""
        known = self._known(number)
        if known is None:
            return (None, number, None), (1.0, 1.0)
        before = None if known.begins else known.before
        after = None if known.ends else known.after
        return (before, number, after), self._factors(number, known)

    def _factors(self, number: int, known: PictureFinding) -> tuple[float, float]:
        """See evened(); of the motion to the previous and the next picture."""
        before = None if known.begins_shot else known.before
        after = None if known.ends_shot else known.after
        near = [n for n in (before, number, after) if n is not None]
        known_ways = not known.begins, not known.ends
        tolerance = self._reader.tolerance
        return evened(self._times[near], near.index(number), known_ways, tolerance)

    def _frame(self, number: int) -> Frame:
        known = self._known(number)
        held = self._frames.get(number)
        if held is None or held[0] is not known:
            held = self._frames[number] = known, self._build(number, known)
            most = max(_MEMORY // (3 * held[1].color.nbytes), _FEWEST)
            while len(self._frames) > most:
                self._frames.popitem(last=False)
        self._frames.move_to_end(number)
        return held[1]

    def _build(self, number: int, known: PictureFinding | None) -> Frame:
        color = self._color(number)
        if known is None or known.motion is None:
            return Frame(color, number=number).locked()
        back, ahead = self._factors(number, known)
        motion = known.motion
        if (back, ahead) != (1.0, 1.0):
            motion = motion * np.array([back, back, ahead, ahead], np.float32)
        held_out = known.holdout
        made = Frame(color, motion=motion, depth=known.depth, holdout=held_out, number=number)
        return made.locked()

    def _color(self, number: int) -> np.ndarray:
        """A picture; the nearest one before, or after, if it cannot be decoded."""
        if number not in self._colors:
            color = self._pictures.at(number)
            near = range(number - 1, -1, -1), range(number + 1, len(self._reader))
            for other in (n for some in near for n in some):
                if color is not None:
                    break
                color = self._colors.get(other)
                color = self._pictures.at(other) if color is None else color
            if color is None:
                raise InputError(f"{self._reader.path}: its pictures cannot be decoded any more")
            self._colors[number] = color
            while len(self._colors) > max(_MEMORY // color.nbytes, _FEWEST):
                self._colors.popitem(last=False)
        self._colors.move_to_end(number)
        return self._colors[number]
