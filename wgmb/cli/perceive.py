"""`wgmb perceive`: what a viewer sees of frames."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Group, Parameter

from .._version import __version__
from ..cone import VIDEOS, Cone
from ..errors import InputError
from ..io.atomic import write_file
from ..io.frame_file import FrameFile
from ..io.frame_numbers import frame_numbers
from ..io.output import Output
from ..lab import charts
from ..lab.shutter_study import best_shutter, compare, perception_charts
from ..observer import Observer
from ..pipeline import Blur
from ..render import Render
from ..scene import builtin
from ..settings import InputSettings, OutputSettings, parameters_of, plain, size_of
from .options import Given, InputOptions, Target
from .terminal import note, out, progress


@dataclass(frozen=True, kw_only=True)
class PerceptionSettings:
    """Who looks, and at what."""

    cone_rate: float = 50.0
    "How fast a cone cell's answer to a flash fades, 1/s."
    cone_peak: float = 0.05
    "When it is strongest, seconds after the flash."
    nature: float = 480.0
    "Scenes: pictures a second that stand for a world without frames."
    size: str = "640x360"
    "Scenes: width x height in pixels."
    set: tuple[str, ...] = ()
    "Scenes: a parameter as NAME=VALUE; may be repeated."

    @property
    def cone(self) -> Cone:
        """The cone cell."""
        return Cone(self.cone_rate, self.cone_peak)


Who = Annotated[PerceptionSettings, Parameter(name="*", group=Group("Perception", sort_key=4))]


def perceive(
    pattern: str | None = None,
    /,
    *,
    output: Target,
    given: Given = InputOptions(),
    who: Who = PerceptionSettings(),
    report: bool = False,
    speed: float | None = None,
    adapter: str | None = None,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Show frames as a viewer perceives them: each held for its time, the past fading.

    A scene's name instead of files shows it without frames, at --nature pictures a second.

    Example: wgmb perceive 'blurred.####.exr' -o 'seen.####.exr' --fps 60

    Example: wgmb perceive --report -o report.svg --fps 60 --speed 40

    Parameters
    ----------
    pattern
        Frames: shot.####.exr, shot.%04d.exr, or one file; or a scene of `wgmb render`.
    report
        Draw how far perceived videos are from perceived nature, by shutter, against speed.
    speed
        With --report: recommend a shutter at this speed of the report's disk, rad/s.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    quiet
        Print errors only.
    """
    if report:
        if pattern is not None:
            raise InputError(f"--report draws its own disk, got {pattern!r} too")
        return _report(output, who, speed, quiet)
    if pattern is None:
        raise InputError("perceive needs frames, a scene, or --report")
    if speed is not None:
        raise InputError("--speed is for --report")
    if output.resume:
        raise InputError("--resume cannot be: every perceived frame depends on those before it")
    if pattern in builtin.SCENES:
        numbers, pictures, rate = _nature(pattern, given, who, float(output.rate), adapter)
        inputs = ()
    else:
        clip = given.open(pattern)
        numbers, rate = clip.numbers, float(output.rate)
        pictures = ((n, clip.source(n), [clip.source(n).rgba]) for n in numbers)
        inputs = clip.inputs
    observer = Observer(rate, who.cone, device=adapter)
    files = Output(
        output.output,
        settings={"wgmb": __version__} | plain(who) | {"input": pattern, "fps": output.fps},
        numbers=numbers,
        bits=output.bits,
        fps=output.rate,
        inputs=inputs,
        overwrite=output.overwrite,
        layers=output.layers,
        compression=output.compression,
    )
    started = time.perf_counter()
    with progress(len(numbers), quiet, "perceiving") as tick:
        try:
            for number, source, shown in pictures:
                for picture in shown:
                    observer.present(picture)
                files.write(observer.perceived()[..., : picture.shape[2]], source)
                tick(number, "done")
            files.close()
        except BaseException:
            files.abandon()
            raise
    if not quiet:
        seconds = time.perf_counter() - started
        done = f"{len(numbers)} frames in {seconds:.1f} s -> {files.pattern}"
        note(done)
    return 0


def _nature(name: str, given: InputSettings, who: PerceptionSettings, fps: float, adapter):
    """A scene without frames: numbers, each frame's pictures since the one before, their rate."""
    numbers = frame_numbers(given.frames or "0")
    steps = max(1, round(who.nature / fps))
    rate = fps * steps
    renderer = Render(
        builtin.make(name, **parameters_of(who.set)),
        Blur("tap", device=adapter),
        size=size_of(who.size),
        fps=fps,
    )
    before = math.ceil(who.cone.memory * rate)

    def pictures():
        done = numbers[0] * steps - before - 1
        for number in numbers:
            end = number * steps
            done = max(done, end - before - 1)
            shown = (renderer.sharp(k / rate) for k in range(done + 1, end + 1))
            yield number, FrameFile(number, Path(), None, {}, {}), shown
            done = end

    return numbers, pictures(), rate


def _report(
    output: OutputSettings, who: PerceptionSettings, speed: float | None, quiet: bool
) -> int:
    fps, path = float(output.rate), Path(output.output)
    if path.suffix.lower() != ".svg":
        raise InputError(f"output {path}: a report ends in .svg")
    if path.exists() and not output.overwrite:
        raise InputError(f"{path} exists; --overwrite replaces it")
    best = best_shutter(speed, fps, who.cone) if speed is not None else None
    speeds = np.linspace(fps / 12, fps * 5 / 3, 20)
    found = compare(fps, speeds, who.cone)
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
            f"at {speed:g} rad/s and {fps:g} frames a second the disk moves {speed / fps:.2f} of "
            f"its width a frame: --curve {name} --shutter {degrees:g} is nearest, {off:.4f}"
        )
    return 0
