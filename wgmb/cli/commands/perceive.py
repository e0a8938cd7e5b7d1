"""`wgmb perceive`: simulate a viewer's perception."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from ... import charts
from ..._version import __version__
from ...cone import VIDEOS, Cone
from ...errors import InputError, counted, size_text
from ...extras import needed_by
from ...io.atomic import write_file
from ...io.frame_numbers import frame_numbers
from ...lab.shutter_study import best_shutter, compare, perception_charts
from ...observer import Observer
from ...output.result import Result
from ...pipeline.blur import Blur
from ...render import Render
from ...scene import builtin
from ...sequence.clip import Clip
from ...sequence.data_windows import Placement, laid, union
from ...sequence.frame_file import FrameFile, is_video
from ...settings import (
    InputSettings,
    OutputSettings,
    parameters_of,
    plain,
    size_of,
)
from ..help import MAIN
from ..options import Adapter, InputOptions, Inputs, PerceivedOutputs, Quiet
from ..terminal import note, out, progress


@dataclass(frozen=True, kw_only=True)
class PerceptionSettings:
    """Cone cell and scene."""

    cone_rate: float = 50.0
    "Decay rate of the cone cell's impulse response, 1/s."
    cone_peak: float = 0.05
    "Peak of the cone cell's impulse response, seconds after a flash."
    nature: float = 480.0
    "Scenes: images per second that approximate continuous time."
    size: str = "640x360"
    "Scenes: width x height in pixels."
    set: tuple[str, ...] = ()
    "Scenes: parameter as NAME=VALUE; may be repeated."

    @property
    def cone(self) -> Cone:
        """The cone cell."""
        return Cone(self.cone_rate, self.cone_peak)


Who = Annotated[PerceptionSettings, Parameter(name="*", group=MAIN)]


def perceive(
    pattern: str | None = None,
    /,
    *,
    output: PerceivedOutputs,
    input: Inputs = InputOptions(),
    perception: Who = PerceptionSettings(),
    report: bool = False,
    speed: float | None = None,
    adapter: Adapter = None,
    quiet: Quiet = False,
) -> int:
    """Simulate a viewer's perception: each frame is held, and earlier ones fade.

    A scene name instead of files simulates continuous time, at --nature images per second. The
    pictures of a video are held for their own times.

    Example: wgmb perceive 'blurred.####.exr' -o 'seen.####.exr' --fps 60

    Example: wgmb perceive clip.mp4 -o seen.mp4

    Example: wgmb perceive --report -o report.svg --fps 60 --speed 40

    Parameters
    ----------
    pattern
        Frames: shot.####.exr, shot.%04d.exr, or one file; a video; or a scene of `wgmb render`.
    report
        Plot the difference between perceived videos and perceived nature over speed, per shutter.
    speed
        With --report: recommend a shutter for the report's disk at this speed, rad/s.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    quiet
        Print errors only.
    """
    if report:
        if pattern is not None:
            raise InputError(f"--report takes no input, got {pattern!r}")
        return _report(output, perception, speed, quiet)
    if pattern is None:
        raise InputError("perceive needs frames, a video, a scene, or --report")
    if speed is not None:
        raise InputError("--speed needs --report")
    if output.resume:
        raise InputError(
            "--resume is not available for perceive: each frame depends on the previous ones"
        )
    if pattern not in builtin.SCENES and is_video(pattern):
        with needed_by(pattern, "video"):
            from .perceive_video import perceive_video
        return perceive_video(
            pattern, output, input, perception.cone, plain(perception), adapter, quiet
        )
    if pattern in builtin.SCENES:
        numbers, pictures, rate = _nature(pattern, input, perception, float(output.rate), adapter)
        inputs = ()
    else:
        clip = input.open(pattern)
        numbers, rate = clip.numbers, float(output.rate)
        pictures = _on_display_window(clip)
        inputs = clip.inputs
    observer = Observer(rate, perception.cone, device=adapter)
    settings = (
        {"wgmb": __version__} | plain(perception) | {"input": pattern, "fps": str(output.rate)}
    )
    files = output.make(settings, numbers, inputs)
    started = time.perf_counter()
    with progress(len(numbers), quiet, "perceiving") as tick:
        try:
            for number, source, shown, placement in pictures:
                for picture in shown:
                    observer.present(picture)
                seen = observer.perceived()[..., : picture.shape[2]]
                files.write_views([Result(source, seen, placement=placement)])
                tick(number, "done")
            files.close()
        except BaseException:
            files.abandon()
            raise
    if not quiet:
        seconds = time.perf_counter() - started
        done = f"{counted(len(numbers), 'frame')} in {seconds:.1f} s -> {files.pattern}"
        note(done)
    return 0


def _on_display_window(clip: Clip):
    """Every frame on one canvas: the display window, and the overscan of the first one."""
    first = clip.source(clip.numbers[0])
    canvas = union([first.display_window, first.data_window])
    for number in clip.numbers:
        source = clip.source(number)
        if source.display_window != first.display_window:
            raise InputError(
                f"{source.path} is {size_text(source.whole)}, {first.path.name} "
                f"{size_text(first.whole)}"
            )
        picture = laid(source.rgba, source.data_window, canvas)
        yield number, source, [picture], Placement(canvas, canvas)


def _nature(name: str, input: InputSettings, perception: PerceptionSettings, fps: float, adapter):
    """Return frame numbers, the images between successive frames, and the rate of the images."""
    numbers = frame_numbers(input.frames or "0")
    steps = max(1, round(perception.nature / fps))
    rate = fps * steps
    renderer = Render(
        builtin.make(name, **parameters_of(perception.set)),
        Blur("tap", device=adapter),
        size=size_of(perception.size),
        fps=fps,
    )
    before = math.ceil(perception.cone.memory * rate)

    def pictures():
        done = numbers[0] * steps - before - 1
        for number in numbers:
            end = number * steps
            done = max(done, end - before - 1)
            shown = (renderer.sharp(k / rate) for k in range(done + 1, end + 1))
            yield number, FrameFile(number, Path(), None, {}, {}), shown, None
            done = end

    return numbers, pictures(), rate


def _report(
    output: OutputSettings, perception: PerceptionSettings, speed: float | None, quiet: bool
) -> int:
    fps, path = float(output.rate), Path(output.output)
    if path.suffix.lower() != ".svg":
        raise InputError(f"output {path}: the name of a report must end in .svg")
    if path.exists() and not output.overwrite:
        raise InputError(f"{path} exists; --overwrite replaces it")
    best = best_shutter(speed, fps, perception.cone) if speed is not None else None
    speeds = np.linspace(fps / 12, fps * 5 / 3, 20)
    found = compare(fps, speeds, perception.cone)
    write_file(path, charts.svg(*perception_charts(found, speeds, fps)).encode())
    if not quiet:
        out("rad/s    " + "".join(f"{name:>11}" for name in found))
        for i in range(3, len(speeds), 4):
            row = "".join(f"{values[i]:11.4f}" for values in found.values())
            out(f"{speeds[i]:<9.1f}{row}")
    if best is not None and speed is not None:
        name, off = best
        degrees = VIDEOS[name].degrees
        out(
            f"at {speed:g} rad/s and {fps:g} frames per second the disk moves {speed / fps:.2f} of "
            f"its width per frame; the closest is --curve {name} --shutter {degrees:g} "
            f"(difference {off:.4f})"
        )
    return 0
