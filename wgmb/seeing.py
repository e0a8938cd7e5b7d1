"""The commands about what is seen: `wgmb perceive` and `wgmb shutter`."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from . import __version__, plot, scenes
from .atomic import write_file
from .cone import VIDEOS
from .errors import InputError
from .numbering import frame_numbers
from .options import (
    InputOptions,
    OutputOptions,
    PerceptionOptions,
    ShutterOptions,
    plain,
    settings_of,
    size_of,
)
from .output import Output
from .perceive import Viewer
from .pipeline import Blur
from .render import Render
from .shutter import OVERLAPS
from .shutter_study import best_shutter, compare, perception_charts
from .source import Source
from .terminal import note, out, progress


def perceive(
    pattern: str | None = None,
    /,
    *,
    output: OutputOptions,
    given: InputOptions | None = None,
    who: PerceptionOptions | None = None,
    report: bool = False,
    speed: float | None = None,
    adapter: str | None = None,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """What a viewer's cones make of frames: each held for its duration, the past fading.

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
    given, who = given or InputOptions(), who or PerceptionOptions()
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
    if pattern in scenes.SCENES:
        numbers, pictures, rate = _nature(pattern, given, who, float(output.rate), adapter)
        inputs = ()
    else:
        clip = given.open(pattern)
        numbers, rate = clip.numbers, float(output.rate)
        pictures = ((n, clip.source(n), [clip.source(n).rgba]) for n in numbers)
        inputs = clip.inputs
    viewer = Viewer(rate, who.cone, device=adapter)
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
                    viewer.look(picture)
                files.write(viewer.sees()[..., : picture.shape[2]], source)
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


def _nature(name: str, given: InputOptions, who: PerceptionOptions, fps: float, adapter):
    """A scene without frames: numbers, each frame's pictures since the one before, their rate."""
    numbers = frame_numbers(given.frames or "0")
    steps = max(1, round(who.nature / fps))
    rate = fps * steps
    renderer = Render(
        scenes.make(name, **settings_of(who.set)),
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
            yield number, Source(number, Path(), None, {}, {}), shown
            done = end

    return numbers, pictures(), rate


def _report(output: OutputOptions, who: PerceptionOptions, speed: float | None, quiet: bool) -> int:
    fps, path = float(output.rate), Path(output.output)
    if path.suffix.lower() != ".svg":
        raise InputError(f"output {path}: a report ends in .svg")
    if path.exists() and not output.overwrite:
        raise InputError(f"{path} exists; --overwrite replaces it")
    best = best_shutter(speed, fps, who.cone) if speed is not None else None
    speeds = np.linspace(fps / 12, fps * 5 / 3, 20)
    found = compare(fps, speeds, who.cone)
    write_file(path, plot.svg(*perception_charts(found, speeds, fps)).encode())
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


def shutter(
    when: ShutterOptions | None = None,
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    overwrite: bool = False,
) -> int:
    """Draw a shutter: its curve, its integral, and the sum of neighbouring frames' windows.

    Without --shutter, at the degrees at which its windows add up to 1, or 360.

    Example: wgmb shutter --curve cosine -o shutter.svg

    Parameters
    ----------
    output
        An .svg file.
    overwrite
        Replace it if it exists.
    """
    when = when or ShutterOptions()
    if output.suffix.lower() != ".svg":
        raise InputError(f"output {output}: the name must end in .svg")
    if output.exists() and not overwrite:
        raise InputError(f"{output} exists; --overwrite replaces it")
    if when.shutter is None:
        when = replace(when, shutter=OVERLAPS.get(when.curve or "box", 360.0))
    made, name = when.settled().make(), when.curve or "box"
    write_file(output, plot.svg(*plot.shutter_charts(made, Path(name).name)).encode())
    total = made.overlap(np.linspace(0, 1, 2001))
    low, high = round(float(total.min()), 3), round(float(total.max()), 3)
    even = high - low < 0.01
    text = "add up to 1" if even else f"add up to {low:g} to {high:g}"
    out(f"{name}, {made.degrees:g} degrees: all frames' windows {text}")
    return 0
