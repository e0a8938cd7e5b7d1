"""Stages of a run: a frame is read, then blurred, then taken by whoever writes or shows it.

`blurred` is the whole of it for other programs; run/sequence.py puts files behind it.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..color.highlights import compressed
from ..errors import Error, GpuMemoryError, InputError
from ..frame import Frame
from ..methods.contract import reach_of
from ..output.result import Result
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..sequence.data_windows import Placement
from ..sequence.frame_file import FrameFile

IN_FLIGHT = 3  # frames, with all their views: one being read, one on the GPU, one being taken


@dataclass
class ReadFrame:
    """One frame, read and to be blurred: every view of it, or why it cannot be read."""

    number: int
    views: list[tuple[FrameFile, Frame, Placement | None]] = field(default_factory=list)
    made_of: dict[str, Any] = field(default_factory=dict)
    failed: str = ""


@dataclass
class BlurredFrame:
    """One frame of `blurred`."""

    number: int
    views: list[Result] = field(default_factory=list)
    """A Result for every view, the default one first."""
    made_of: dict[str, Any] = field(default_factory=dict)
    """Files and facts on which it depends (see Clip.made_of), for Output.write_views."""
    failed: str = ""
    """The reason why it could not be read or blurred; then it has no views."""
    bad: dict[str, int] = field(default_factory=dict)
    """Pixels that are not finite, by input."""


class StopError(Exception):
    """The other end of a queue is gone."""


class Handover:
    """A queue whose end notices a stop."""

    def __init__(self, stop: threading.Event):
        self._queue: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._stop = stop
        self.put = self._queue.put

    def get(self) -> Any:
        """The next item; StopError once the run has stopped."""
        while not self._stop.is_set():
            try:
                return self._queue.get(timeout=0.05)
            except queue.Empty:
                continue
        raise StopError


class Stages:
    """Stages of a frame: `read` and `blur`, each in one thread at a time."""

    def __init__(self, clip: Clip, blur: Blur, confidence: bool = False, all_views: bool = True):
        self.clip, self._blur = clip, blur
        self._confidence, self._all_views = confidence, all_views
        self.reach = reach_of(blur.method)
        self.numbers = clip.numbers

    def made_of(self, number: int) -> dict[str, Any]:
        """Files and facts on which a frame depends."""
        return self.clip.made_of(number, self.reach)

    def read(self, number: int, made_of: dict[str, Any]) -> ReadFrame:
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

    def forget(self, number: int) -> None:
        """Drop the files that the frames after this one do not need."""
        self.clip.forget(number - self.reach)

    def blur(self, read: ReadFrame) -> BlurredFrame:
        """Blur every view; InputError or GpuMemoryError where one of them cannot be."""
        done = BlurredFrame(read.number, made_of=read.made_of)
        for source, frame, placement in read.views:
            try:
                done.views.append(self._blurred(source, frame, placement))
            except (InputError, GpuMemoryError) as error:
                raise _of_view(error, source, read.views, self._blur.method.needs) from None
            for name, count in frame.bad.items():
                done.bad[name] = done.bad.get(name, 0) + count
        return done

    def _prepared(self, source: FrameFile) -> tuple[Frame, Placement | None]:
        uses = self._blur.method.uses
        normal, light = "normal" in uses, "diffuse_light" in uses
        return self.clip.placed(source, self._blur.extent, self.reach, normal, light)

    def _blurred(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        confidence: dict[str, np.ndarray] = {}
        if self._confidence:
            picture, confidence = self._blur.with_confidence(frame)
        else:
            picture = self._blur(frame)
        return Result(source, self._finished(picture), confidence, placement)

    def _finished(self, light: np.ndarray) -> np.ndarray:
        """The light of a frame as it is written: highlights that were expanded are compressed."""
        highlights = self.clip.highlights
        return light if highlights == 1 else compressed(light, highlights)


class MotionStages(Stages):
    """Motion instead of blurred pictures."""

    def _prepared(self, source: FrameFile) -> tuple[Frame, None]:
        frame = self.clip.frame(source, picture=False, normal=False, light=False)
        if "motion" not in frame.has:
            raise InputError("no motion: neither vectors nor a camera")
        return frame, None

    def _blurred(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        return Result(source, self._blur.motion(frame))


def blurred(
    clip: Clip,
    blur: Blur,
    *,
    confidence: bool = False,
    stop: threading.Event | None = None,
) -> Iterator[BlurredFrame]:
    """Yield every frame of `clip` in its order, blurred, for programs that write or show it.

    One thread reads and another blurs while the caller works, with at most three frames in memory;
    so a generator that is not read to its end should be closed. A frame that cannot be read or
    blurred has the reason in `failed`, and the others follow. `confidence` adds confidence layers.
    Once `stop` is set, no other frame is begun, and the generator ends.

    InputError, before any frame is read, where a mask names an object that no Cryptomatte has.
    """
    clip.check_names()
    return _Ahead(Stages(clip, blur, confidence), stop or threading.Event()).frames()


class _Ahead:
    """Frames read and blurred in two threads, ahead of whoever takes them."""

    def __init__(self, stages: Stages, asked: threading.Event):
        self._stages, self._asked = stages, asked
        self._stop, self._crash = threading.Event(), list[BaseException]()
        self._places = Handover(self._stop)
        self._to_blur, self._to_take = Handover(self._stop), Handover(self._stop)

    def frames(self) -> Iterator[BlurredFrame]:
        """Every frame; what a thread raises is raised here."""
        for _ in range(IN_FLIGHT):
            self._places.put(None)
        threads = [
            threading.Thread(target=self._guarded, args=(work,), name=name, daemon=True)
            for name, work in (("read", self._read), ("blur", self._blur))
        ]
        for thread in threads:
            thread.start()
        try:
            while (frame := self._to_take.get()) is not None:
                yield frame
                del frame
                self._places.put(None)
        except StopError:
            pass
        finally:
            self._stop.set()
            for thread in threads:
                while thread.is_alive():  # a join without limit would hold back Ctrl-C
                    thread.join(0.1)
        if self._crash:
            raise self._crash[0]

    def _read(self) -> None:
        for number in self._stages.clip.numbers:
            self._places.get()
            if self._asked.is_set():
                break
            try:
                read = self._stages.read(number, self._stages.made_of(number))
            except (Error, OSError, MemoryError) as error:
                read = ReadFrame(number, failed=reason(error))
            finally:
                self._stages.forget(number)
            self._to_blur.put(read)
            del read
        self._to_blur.put(None)

    def _blur(self) -> None:
        while (read := self._to_blur.get()) is not None and not self._asked.is_set():
            try:
                if read.failed:
                    done = BlurredFrame(read.number, failed=read.failed)
                else:
                    done = self._stages.blur(read)
            except (InputError, GpuMemoryError) as error:
                done = BlurredFrame(read.number, failed=reason(error))
            self._to_take.put(done)
            del read, done
        self._to_take.put(None)

    def _guarded(self, work: Callable[[], None]) -> None:
        try:
            work()
        except StopError:
            pass
        except BaseException as error:  # a fault of ours: raised where the frames are taken
            self._crash.append(error)
            self._stop.set()


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


def reason(error: BaseException) -> str:
    """The error in one line that names the file it is about."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror.lower()}"
    return " ".join(str(error).split()) or type(error).__name__
