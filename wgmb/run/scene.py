"""Frames of a scene into files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..frame import Frame
from ..io import exr
from ..output.output import Output
from ..output.result import Result
from ..render import Render
from ..sequence.frame_file import FrameFile
from .batch_report import BatchReport, Progress
from .engine import IsDone, run
from .file_sink import BlurredFrame, FileSink


class RenderedFrames:
    """Frames of a scene, as the input of a run.

    `times` [s] by frame number. `sharp`: without blur. `passes`: with all that `wgmb blur` can
    use. `confidence`: with how sure the method is.
    """

    ahead = 1

    def __init__(
        self,
        render: Render,
        times: dict[int, float],
        *,
        sharp: bool = False,
        passes: bool = False,
        confidence: bool = False,
    ):
        self._render, self._times, self.total = render, times, len(times)
        self._sharp, self._passes, self._confidence = sharp, passes, confidence

    def read(self, is_done: IsDone) -> Iterator[int]:
        """The numbers of the frames that are not done."""
        return (number for number in self._times if not is_done(number, {}))

    def blur(self, read: Iterator[int]) -> Iterator[BlurredFrame]:
        """Render them."""
        return map(self._rendered, read)

    def _rendered(self, number: int) -> BlurredFrame:
        render, time = self._render, self._times[number]
        source = FrameFile(number, Path(), None, {}, {})
        if self._passes:
            source = _with_passes(render, render.frame(time, number, light=True), number)
        planes = {}
        if self._confidence:
            picture, planes = render.with_confidence(time, number)
        else:
            picture = render.sharp(time) if self._sharp else render(time, number)
        return BlurredFrame(number, [Result(source, picture, planes)])


def render_frames(
    frames: RenderedFrames, output: Output, resume: bool, progress: Progress | None
) -> BatchReport:
    """Render every frame into `output`; the first error ends it."""
    return run(frames, FileSink(output), resume=resume, progress=progress)


def _with_passes(render: Render, frame: Frame, number: int) -> FrameFile:
    """A frame's passes as layers that sequence/clip.py finds by their names."""
    motion = render.blur.motion(frame)
    assert frame.depth is not None and frame.normal is not None and frame.object_id is not None
    channels = {name: frame.color[..., i] for i, name in enumerate("RGBA")}
    channels |= {"Z": frame.depth, "object_id.X": frame.object_id}
    channels |= {f"normal.{c}": frame.normal[..., i] for i, c in enumerate("XYZ")}
    names = ("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")
    channels |= {name: motion[..., i] for i, name in enumerate(names)}
    for layer, light in (("DiffDir", frame.diffuse_light), ("DiffCol", frame.diffuse_color)):
        if light is not None:
            channels |= {f"{layer}.{c}": light[..., i] for i, c in enumerate("RGB")}
    width, height = frame.size
    window = (0, 0, width - 1, height - 1)
    part = exr.Part("", channels, {}, window, window)
    file, origin = exr.Exr(Path(), [part]), {name: (part, name) for name in channels}
    return FrameFile(number, Path(), file, channels, {}, part=part, origin=origin)
