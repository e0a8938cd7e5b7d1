"""Frames of a scene into files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import wgpu

from ..errors import InputError
from ..frame import Frame
from ..io import exr
from ..output.output import Output
from ..output.result import Result
from ..render import Render
from ..sequence.frame_file import FrameFile
from ..settings import BlurSettings, OutputSettings, SceneSettings, ShutterSettings, size_of
from ..settings.color import DisplaySettings, color_record
from ..settings.record import record
from .engine import IsDone, RunOptions
from .file_sink import BlurredFrame, run_into
from .job import check_confidence
from .report import BatchReport, Progress


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


@dataclass(frozen=True, kw_only=True)
class SceneRequest:
    """Request to render a scene, as `wgmb render` receives it; the last three: RenderedFrames."""

    scene: str
    output: OutputSettings
    options: SceneSettings = field(default_factory=SceneSettings)
    blur: BlurSettings = field(default_factory=BlurSettings)
    shutter: ShutterSettings = field(default_factory=ShutterSettings)
    color: DisplaySettings = field(default_factory=DisplaySettings)
    sharp: bool = False
    passes: bool = False
    confidence: bool = False

    def open(self, device: wgpu.GPUDevice | str | None = None) -> SceneRun:
        """Open the GPU and the output; InputError for settings that make no sense together."""
        output, options, fps = self.output, self.options, float(self.output.rate)
        scene = options.make(self.scene)
        blur, shutter = self.blur.resolved(scene), self.shutter.resolved(scene, fps)
        self._check()
        times = options.moments(fps)
        made = blur.make(shutter.make(), device)
        size = size_of(options.size)
        render = Render(scene, made, size=size, fps=fps, antialias=options.antialias)
        settings = record(
            output, blur, shutter, options,
            scene=self.scene, fps=fps, samples=blur.settled_samples(),
            sharp=self.sharp, passes=self.passes,
        )  # fmt: skip
        if self.confidence:
            check_confidence(made.method.name, output)
            settings["confidence"] = True
        display = self.color.open(needed=not output.is_exr)
        settings |= color_record(display, output.output)
        files = output.make(settings, list(times), display=display)
        frames = RenderedFrames(
            render, times, sharp=self.sharp, passes=self.passes, confidence=self.confidence
        )
        return SceneRun(render, frames, files, output.resume)

    def _check(self) -> None:
        output = self.output
        if self.blur.holdout or self.blur.scale:
            raise InputError("`holdout` and `scale` need input files; use them with wgmb blur")
        if self.options.time is not None and self.options.frames is not None:
            raise InputError("`time` is for a single image; `frames` have their own times")
        if self.passes and not output.is_exr:
            raise InputError(f"`passes` needs an .exr output, got {output.output}")
        if self.passes and output.layers == "picture":
            raise InputError("`passes` cannot be combined with `layers` picture")
        if self.confidence and self.sharp:
            raise InputError("`confidence` cannot be combined with `sharp`")


@dataclass(frozen=True)
class SceneRun:
    """Frames of a scene and their output; call it."""

    render: Render
    frames: RenderedFrames
    output: Output
    resume: bool

    def __call__(self, progress: Progress | None = None) -> BatchReport:
        """Render every frame; the first error ends it."""
        options = RunOptions(self.resume, progress)
        return run_into(self.output, self.frames, self.output.numbers, options)


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
