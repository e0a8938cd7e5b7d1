"""Rendered frames with motion of their own at another rate: each is blurred over its own cell.

An output frame is the sum of the input frames whose cells its exposure covers (see exposure.py),
in linear light.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Collection
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from ..errors import InputError, reason
from ..exposure import Cell, cells_in_shot
from ..io.frame_numbers import frame_list
from ..output.result import Result
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..sequence.data_windows import Placement, laid, union
from ..sequence.frame_file import FrameFile
from ..shutter import Shutter
from .file_sink import BlurredFrame
from .stages import ReadFrame, Stages

_SPARE = Fraction(1, 20)  # of an output frame: less at the end of the sequence is none


@dataclass(frozen=True)
class RateConversion:
    """From `fps_in` to `fps` frames per second.

    The first output frame has the number and the time of the first input frame.
    """

    fps_in: Fraction
    fps: Fraction

    @property
    def step(self) -> Fraction:
        """Input frames from one output frame to the next."""
        return self.fps_in / self.fps

    def numbers(self, clip: Clip) -> list[int]:
        """The output frames of a clip; InputError where its frames do not follow each other."""
        first, count = clip.numbers[0], len(clip.numbers)
        if clip.numbers != list(range(first, first + count)):
            raise InputError(
                "`fps_in` needs frames that follow each other without gaps, "
                f"got {frame_list(clip.numbers)}"
            )
        return list(range(first, first + max(1, math.ceil(count / self.step - _SPARE))))

    def at(self, number: int, first: int) -> Fraction:
        """The time of an output frame, in numbers of input frames; both begin with `first`."""
        return first + (number - first) * self.step

    def cells(
        self, at: Fraction, shutter: Shutter, existing: Collection[int], cuts: Collection[int]
    ) -> list[Cell]:
        """The cells of the output frame at `at`; their indices are numbers of input frames.

        `existing`: the frames on disk; `cuts`: those that begin a shot. Only frames of the shot
        that is shown at `at` are taken, up to the next gap.
        """

        def neighbour(number: int, side: int) -> int | None:
            near = number + side
            return near if near in existing and max(number, near) not in cuts else None

        interval = float(self.step)
        return cells_in_shot(math.floor(at), neighbour, float, float(at), interval, shutter)


class RateConversionStages(Stages):
    """Output frames at another rate; their `numbers` are not those of the clip.

    The frames of an exposure are read one after the other while it is made, so that no more are in
    memory than for one. Neighbours are always read, as they tell where a cut is.
    """

    def __init__(self, clip: Clip, blur: Blur, conversion: RateConversion, all_views: bool = True):
        super().__init__(clip, blur, all_views=all_views)
        self.numbers = conversion.numbers(clip)
        self.reach = max(self.reach, 1)
        self._conversion, self._shutter = conversion, blur.shutter
        self._existing = frozenset(clip.on_disk)
        self._known = frozenset(n for n in clip.on_disk if clip.cache.is_known_cut(n, -1))
        self._reading = threading.Lock()

    def made_of(self, number: int) -> dict[str, Any]:
        """The files of all frames that may share the exposure, and its time among them."""
        at = self._at(number)
        files: dict[tuple[Any, ...], None] = {}
        meaning: str | None = None
        with self._reading:
            for cell in self._cells(number, self._known):
                made_of = self.clip.made_of(cell.index, self.reach)
                files |= dict.fromkeys(map(tuple, made_of["files"]))
                meaning = made_of["vectors_mean"]
        return {"files": [list(file) for file in files], "vectors_mean": meaning, "at": str(at)}

    def _read(self, number: int, made_of: dict[str, Any]) -> ReadFrame:
        """Nothing yet; see the class."""
        return ReadFrame(number, made_of=made_of)

    def _forget(self, number: int) -> None:
        """Nothing: the clip keeps the last frames only."""

    def _blurred(self, read: ReadFrame) -> BlurredFrame:
        """The exposure, of every view; InputError where one of its frames cannot be."""
        try:
            done, cuts = None, frozenset[int]()
            while done is None or cuts != self._cuts(read.number):  # one was found meanwhile
                cuts = self._cuts(read.number)
                done = self._exposed(read, self._cells(read.number, cuts))
        except (OSError, MemoryError) as error:
            raise InputError(reason(error)) from None
        finally:
            self._blur.shutter = self._shutter
        return done

    def _at(self, number: int) -> Fraction:
        return self._conversion.at(number, self.numbers[0])

    def _cuts(self, number: int) -> frozenset[int]:
        """Those known so far that the exposure of an output frame might meet."""
        found = self._cells(number, self._known)
        first, last = found[0].index, found[-1].index
        at = math.floor(self._at(number))
        near = range(min(first, at), max(last, at) + 2)
        return self._known | (self.clip.cuts & set(near))

    def _cells(self, number: int, cuts: Collection[int]) -> list[Cell]:
        return self._conversion.cells(self._at(number), self._shutter, self._existing, cuts)

    def _exposed(self, read: ReadFrame, parts: list[Cell]) -> BlurredFrame:
        done = BlurredFrame(read.number, made_of=dict(read.made_of))
        sums: dict[str | None, _Sum] = {}
        at = float(self._at(read.number))
        nearest = min(parts, key=lambda cell: abs(cell.index - at)).index
        for cell in parts:
            self._blur.shutter = cell.shutter
            with self._reading:
                one = super()._read(cell.index, {})
            if "unread" in one.made_of:
                done.made_of.setdefault("unread", []).extend(one.made_of["unread"])
            blurred = super()._blurred(one)
            for result in blurred.views:
                of_view = sums.setdefault(result.source.view, _Sum(result.source))
                of_view.add(result, cell.share, cell.index == nearest)
            for name, count in blurred.bad.items():
                done.bad[name] = done.bad.get(name, 0) + count
        for of_view in sums.values():
            made = of_view.result(read.number)
            done.views.append(replace(made, picture=super()._finished(made.picture)))
        return done

    def _finished(self, light: np.ndarray) -> np.ndarray:
        """As it is: the sum is compressed."""
        return light


class _Sum:
    """The pictures of one view, each counted by its share."""

    def __init__(self, source: FrameFile):
        self._source, self._share = source, 0.0
        self._placement: Placement | None = None
        self._picture: np.ndarray | None = None

    def add(self, result: Result, share: float, is_nearest: bool) -> None:
        """Add a picture; the headers are those of the nearest."""
        mine, its = self._source, result.source
        if its.display_window != mine.display_window or len(its.color) != len(mine.color):
            raise InputError(
                f"{its.path}: its size or channels differ from those of {mine.path.name}, "
                "with which it shares an exposure"
            )
        placement = result.placement or Placement(result.canvas, result.canvas)
        light = result.picture * np.float32(share)
        if self._picture is None or self._placement is None:
            self._picture, self._placement = light, placement
        else:
            onto = union([self._placement.canvas, placement.canvas])
            grown = laid(self._picture, self._placement.canvas, onto)
            self._picture = grown + laid(light, placement.canvas, onto)
            bounds = union([self._placement.bounds, placement.bounds])
            self._placement = Placement(onto, bounds)
        self._share += share
        if is_nearest:
            self._source = its

    def result(self, number: int) -> Result:
        """Under the number of the output frame; InputError where frames lack the view."""
        if self._share < 1 - 1e-6 or self._picture is None:
            raise InputError(f"{self._source.name}: frames of the same exposure lack this view")
        source = replace(self._source, number=number)
        return Result(source, self._picture, placement=self._placement, is_converted=True)
