"""Frames as they are perceived: each is held until the next, and earlier ones fade."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import wgpu

from ..errors import InputError, size_text
from ..io.frame_numbers import frame_numbers
from ..observer import Observer
from ..output.output import Output
from ..output.result import Result
from ..pipeline.blur import Blur
from ..render import Render
from ..run.engine import IsDone, RunOptions, run
from ..run.file_sink import BlurredFrame, FileSink
from ..run.report import BatchReport, Progress
from ..scene import builtin
from ..sequence.clip import Clip
from ..sequence.data_windows import Placement, laid, union
from ..sequence.frame_file import FrameFile
from ..settings import InputSettings, OutputSettings, parameters_of, size_of
from ..settings.groups import changed
from ..settings.record import record
from .settings import PerceptionSettings


@dataclass(frozen=True)
class PresentedFrame:
    """A frame as it is shown: images, the last of which stands for it."""

    source: FrameFile
    images: Iterable[np.ndarray]
    """(height, width, 3 or 4), linear light, at the observer's rate."""
    placement: Placement | None = None


class PerceivedFrames:
    """After each frame, the image that an observer perceives."""

    ahead = 1

    def __init__(self, observer: Observer, numbers: Sequence[int]):
        self.observer, self.numbers, self.total = observer, numbers, len(numbers)

    def read(self, is_done: IsDone) -> Iterator[PresentedFrame]:
        """All frames, as each depends on those before it."""
        raise NotImplementedError

    def blur(self, read: Iterator[PresentedFrame]) -> Iterator[BlurredFrame]:
        """Show them."""
        return map(self._perceived, read)

    def _perceived(self, frame: PresentedFrame) -> BlurredFrame:
        channels = 0
        for image in frame.images:
            self.observer.present(image)
            channels = image.shape[2]
        seen = self.observer.perceived()[..., :channels]
        result = Result(frame.source, seen, placement=frame.placement)
        return BlurredFrame(frame.source.number, [result])


class PerceivedSequence(PerceivedFrames):
    """Frames of files on one canvas: the display window, and the overscan of the first one."""

    def __init__(self, clip: Clip, observer: Observer):
        super().__init__(observer, clip.numbers)
        self._clip = clip

    def read(self, is_done: IsDone) -> Iterator[PresentedFrame]:
        """Read them; InputError for one of another size."""
        first = self._clip.source(self._clip.numbers[0])
        canvas = union([first.display_window, first.data_window])
        for number in self._clip.numbers:
            source = self._clip.source(number)
            if source.display_window != first.display_window:
                raise InputError(
                    f"{source.path} is {size_text(source.whole)}, {first.path.name} "
                    f"{size_text(first.whole)}"
                )
            image = laid(source.rgba, source.data_window, canvas)
            yield PresentedFrame(source, [image], Placement(canvas, canvas))


class PerceivedNature(PerceivedFrames):
    """Frames of a scene in nearly continuous time: `steps` images for each."""

    def __init__(self, render: Render, observer: Observer, numbers: Sequence[int], steps: int):
        super().__init__(observer, numbers)
        self._render, self._steps = render, steps
        self._before = math.ceil(observer.cone.memory * observer.rate)

    def read(self, is_done: IsDone) -> Iterator[PresentedFrame]:
        """The images from one frame to the next, rendered when they are shown."""
        done = -math.inf
        for number in self.numbers:
            end = number * self._steps
            first = int(max(done + 1, end - self._before))
            images = (self._render.sharp(k / self.observer.rate) for k in range(first, end + 1))
            yield PresentedFrame(FrameFile(number, Path(), None, {}, {}), images)
            done = end


@dataclass(frozen=True)
class PerceptionRun:
    """Perceived frames and their output; call it."""

    frames: PerceivedFrames
    output: Output
    made_of: Sequence[Path] = ()
    """The files that are read."""

    def __call__(self, progress: Progress | None = None) -> BatchReport:
        """Write the perceived image of each frame; the first error ends it."""
        return run(self.frames, FileSink(self.output), RunOptions(progress=progress))


def perceive(
    pattern: str,
    output: OutputSettings,
    input: InputSettings,
    perception: PerceptionSettings,
    device: wgpu.GPUDevice | str | None = None,
) -> PerceptionRun:
    """Frames of files, or of a scene of that name, as they are perceived."""
    fps, inputs = float(output.rate), ()
    perception.check(of_scene=pattern in builtin.SCENES)
    if pattern in builtin.SCENES:
        for name in changed(input):
            if name != "frames":
                raise InputError(f"`{name}` is for files, {pattern} is a scene")
        numbers = frame_numbers(input.frames or "0")
        steps = max(1, round(perception.nature / fps))
        scene = builtin.make(pattern, **parameters_of(perception.set))
        blur, size = Blur("tap", device=device), size_of(perception.size)
        render = Render(scene, blur, size=size, fps=fps)
        observer = Observer(fps * steps, perception.cone, device=device)
        frames = PerceivedNature(render, observer, numbers, steps)
    else:
        clip = input.open(pattern)
        inputs = list(clip.dependencies.every())
        frames = PerceivedSequence(clip, Observer(fps, perception.cone, device=device))
    settings = record(perception, input=pattern, fps=str(output.rate))
    files = output.make(settings, list(frames.numbers), inputs)
    return PerceptionRun(frames, files, inputs)
