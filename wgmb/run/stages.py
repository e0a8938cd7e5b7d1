"""Rendered frames as the input of a run: each is read, and blurred by itself.

`blurred` gives them to other programs; run/sequence.py puts them into files.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import Error, GpuMemoryError, InputError, reason
from ..frame import Frame
from ..methods.contract import reach_of
from ..output.result import Result
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..sequence.data_windows import Placement
from ..sequence.frame_file import FrameFile
from ..threads import Stop
from .engine import IsDone, frames
from .file_sink import BlurredFrame


@dataclass
class ReadFrame:
    """One frame, read and to be blurred: every view of it, or why it cannot be read."""

    number: int
    views: list[tuple[FrameFile, Frame, Placement | None]] = field(default_factory=list)
    made_of: dict[str, Any] = field(default_factory=dict)
    failed: str = ""


class Stages:
    """The frames of a clip, each with the reason if it fails."""

    ahead = 1

    def __init__(self, clip: Clip, blur: Blur, confidence: bool = False, all_views: bool = True):
        self.clip, self._blur = clip, blur
        self._confidence, self._all_views = confidence, all_views
        self.reach = reach_of(blur.method)
        self.numbers: Sequence[int] = clip.numbers

    @property
    def messages(self) -> list[str]:
        """Lines that a user should know, once the frames are blurred."""
        return []

    @property
    def total(self) -> int:
        """Number of frames."""
        return len(self.numbers)

    def read(self, is_done: IsDone) -> Iterator[ReadFrame]:
        """Read the frames that are not done."""
        return filter(None, (self._read_one(number, is_done) for number in self.numbers))

    def blur(self, read: Iterator[ReadFrame]) -> Iterator[BlurredFrame]:
        """Blur the frames that were read."""
        return map(self._result, read)

    def _read_one(self, number: int, is_done: IsDone) -> ReadFrame | None:
        """A frame; None if it is done."""
        try:
            made_of = self.made_of(number)
            return None if is_done(number, made_of) else self._read(number, made_of)
        except (Error, OSError, MemoryError) as error:
            return ReadFrame(number, failed=reason(error))
        finally:
            self._forget(number)

    def _result(self, read: ReadFrame) -> BlurredFrame:
        if read.failed:
            return BlurredFrame(read.number, failed=read.failed)
        try:
            return self._blurred(read)
        except (InputError, GpuMemoryError) as error:
            return BlurredFrame(read.number, failed=reason(error))

    def made_of(self, number: int) -> dict[str, Any]:
        """Files and facts on which a frame depends."""
        return self.clip.made_of(number, self.reach)

    def _read(self, number: int, made_of: dict[str, Any]) -> ReadFrame:
        """Read every view of a frame; InputError or OSError where one of them cannot be."""
        sources = self.clip.sources(number)
        if not self._all_views:
            del sources[1:]
        views: list[tuple[FrameFile, Frame, Placement | None]] = []
        errors: list[tuple[InputError, FrameFile]] = []
        for source in sources:
            try:
                views.append((source, *self._prepared(source)))
            except InputError as error:
                errors.append((error, source))
        if errors:
            error, source = errors[0]
            raise _of_view(error, source, views, self._blur.method.needs)
        if unread := sorted(n for n in self.clip.unread if abs(n - number) <= self.reach):
            made_of["unread"] = unread  # so that --resume asks for them again
        return ReadFrame(number, views, made_of)

    def _forget(self, number: int) -> None:
        """Drop the files that the frames after this one do not need."""
        self.clip.forget(number - self.reach)

    def _blurred(self, read: ReadFrame) -> BlurredFrame:
        """Blur every view; InputError or GpuMemoryError where one of them cannot be."""
        done = BlurredFrame(read.number, made_of=read.made_of)
        for source, frame, placement in read.views:
            try:
                done.views.append(self._view(source, frame, placement))
            except (InputError, GpuMemoryError) as error:
                raise _of_view(error, source, read.views, self._blur.method.needs) from None
            for name, count in frame.bad.items():
                done.bad[name] = done.bad.get(name, 0) + count
        return done

    def _prepared(self, source: FrameFile) -> tuple[Frame, Placement | None]:
        return self.clip.placed(source, self._blur.extent, self.reach, self._blur.method.uses)

    def _view(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        confidence: dict[str, np.ndarray] = {}
        if self._confidence:
            picture, confidence = self._blur.with_confidence(frame)
        else:
            picture = self._blur(frame)
        return Result(source, self._finished(picture), confidence, placement)

    def _finished(self, light: np.ndarray) -> np.ndarray:
        """The light of a frame as it is written: expanded light is compressed again."""
        return self.clip.expansion.compressed(light)


class MotionStages(Stages):
    """Motion instead of blurred pictures."""

    def _prepared(self, source: FrameFile) -> tuple[Frame, None]:
        frame = self.clip.frame(source, picture=False, normal=False, light=False)
        if "motion" not in frame.has:
            raise InputError("no motion: neither vectors nor a camera")
        return frame, None

    def _view(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        return Result(source, self._blur.motion(frame))


def blurred(
    clip: Clip,
    blur: Blur,
    *,
    confidence: bool = False,
    stop: Stop | None = None,
) -> Iterator[BlurredFrame]:
    """Yield every frame of `clip` in its order, blurred, for programs that write or show it.

    One thread reads and another blurs while the caller works, with at most three frames in memory;
    so a generator that is not read to its end should be closed. A frame that cannot be read or
    blurred has the reason in `failed`, and the others follow. `confidence` adds confidence layers.
    Once `stop` is set, no other frame is begun, and the generator ends.

    InputError, before any frame is read, where a mask names an object that no Cryptomatte has.
    """
    clip.masks.check()
    return frames(Stages(clip, blur, confidence), stop)


def _of_view(
    error: Error,
    source: FrameFile,
    views: list[tuple[FrameFile, Frame, Placement | None]],
    needs: frozenset[str],
) -> InputError:
    """The error with the name of the file, and of those of its `views` that can be blurred."""
    text = str(error) if source.name in str(error) else f"{source.name}: {error}"
    others = [str(o.view) for o, frame, _ in views if o is not source and frame.has >= needs]
    return InputError(text + (f"; choose a view: {', '.join(others)}" if others else ""))
