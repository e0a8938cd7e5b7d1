"""`wgmb blur` of a video: into a video, or into frames."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from ... import gpu
from ..._version import __version__
from ...color.highlights import check as check_highlights
from ...errors import InputError
from ...extras import install_command, is_installed
from ...pipeline.blur import Blur
from ...run.video import FootageBlur, Sink, blur_footage
from ...run.video_output import write
from ...settings import (
    BlurSettings,
    InputSettings,
    OutputSettings,
    ShutterSettings,
    plain,
)
from ...settings.video import VideoSettings
from ...shots.cut_list import CutList
from ...shots.motion_source import MotionSource
from ...video.clock import Clock
from ...video.holdouts import holdout_of
from ...video.output_times import Moment, moments
from ...video.read.reader import Footage
from ...video.write.encoders import SUFFIXES
from ..exit_codes import DONE, SOME_FAILED
from ..terminal import note, progress

Tell = Callable[..., None]
"""A function that `terminal.progress` yields."""


@dataclass(frozen=True)
class Wish:
    """Settings that all videos of a run share, and the objects made of them."""

    look: BlurSettings
    when: ShutterSettings
    given: InputSettings
    video: VideoSettings
    blur: Blur
    motion: MotionSource | None
    how: str

    @property
    def settings(self) -> dict[str, Any]:
        """Settings on which a result depends, for the record of a video."""
        found = {"wgmb": __version__} | plain(self.look) | plain(self.when) | plain(self.video)
        return found | {"curve": self.when.curve_read()}


@dataclass(frozen=True)
class Plan:
    """One video and the output frames that are wanted of it."""

    footage: Footage
    output: OutputSettings
    clock: Clock
    wanted: list[Moment]
    rate: str
    """A line about the output's rate where it was chosen for the user, or ''."""

    @property
    def notes(self) -> list[str]:
        """Lines that a user should know."""
        return [*self.footage.notes, self.rate] if self.rate else self.footage.notes

    @property
    def name(self) -> str:
        """The output's name."""
        return self.output.output


def blur_video(
    path: str,
    output: OutputSettings,
    look: BlurSettings,
    when: ShutterSettings,
    given: InputSettings,
    video: VideoSettings,
    adapter: str | None,
    quiet: bool,
    verbose: bool,
) -> int:
    """Blur a video; returns the exit code."""
    wish = make_wish(look, when, given, video, adapter)
    plan = planned(path, output, wish)
    tell_how(wish, quiet, verbose)
    if not quiet:
        for text in plan.notes:
            note(f"{path}: {text}")
    started = time.perf_counter()
    with progress(len(plan.wanted), quiet) as tell:
        run, left_out = blurred(plan, wish, tell)
    if not quiet:
        for text in left_out:
            note(f"{plan.name}: {text}")
    if not quiet and (reel := run.reel) is not None:
        took = f"{time.perf_counter() - started:.1f} s"
        if wish.motion is not None:
            took += f" with {wish.blur.method.name}"
        if reel.cuts:
            note(f"camera cut before picture {', '.join(map(str, sorted(reel.cuts)))}")
        if reel.flashes:
            note(f"flash at picture {', '.join(map(str, reel.flashes))}")
        if reel.doubles:
            note(f"{len(reel.doubles)} repeated pictures left out")
        if scaling := plan.footage.scaling():
            note(scaling)
        note(f"{len(plan.wanted)} frames in {took} -> {plan.name}")
    if loss := plan.footage.loss():
        note(f"wgmb: {loss}")
        return SOME_FAILED
    return DONE


def make_wish(
    look: BlurSettings,
    when: ShutterSettings,
    given: InputSettings,
    video: VideoSettings,
    adapter: str | None,
) -> Wish:
    """The settings of a run, with what is opened once for all its videos."""
    check_fits(given, look)
    check_highlights(video.highlights)
    if look.holdout and video.flow == "none":
        raise InputError("--holdout needs motion; --flow none averages whole pictures")
    settled, how = video.settled(gpu.open_device(adapter))
    look = replace(look, method=look.method or settled.method).for_pictures()
    blur = look.make(when.make(), adapter)
    return Wish(look, when, given, video, blur, settled.source(blur.device)[0], how)


def tell_how(wish: Wish, quiet: bool, verbose: bool) -> None:
    """Say where motion comes from, and, if asked, the settings."""
    if verbose:
        note(f"adapter: {wish.blur.device.adapter.summary}")
        note(f"settings: {json.dumps(wish.settings, sort_keys=True)}")
    if not quiet:
        note(f"motion: {wish.how}")
        is_slow = wish.blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE
        if wish.video.flow == "auto" and is_slow and not is_installed("cv2"):
            note(f"without a GPU, OpenCV finds motion much sooner: {install_command('flow')}")


def planned(path: str | Path, output: OutputSettings, wish: Wish) -> Plan:
    """Open a video; InputError if it cannot be read or has no pictures in the range."""
    footage = Footage(path, max_mb=wish.given.max_mb)
    clock = wish.video.clock(footage, wish.given.frames)
    fps, said = _rate(footage, output)
    return Plan(footage, output, clock, moments(footage, clock, fps), said)


def _rate(footage: Footage, output: OutputSettings) -> tuple[Fraction | None, str]:
    """Output frames per second, None for the times of the pictures; and a line if not wished for.

    Image files have no times, so that they need a rate.
    """
    if output.fps == "source":
        return None, ""
    if output.fps is not None or not footage.is_variable or footage.gaps:
        return output.rate_or(footage.rate), ""
    steps = "{:.1f} to {:.1f} ms".format(*(1000 * step for step in footage.steps))
    if not footage.has_rate and Path(output.output).suffix.lower() in SUFFIXES:
        return None, (
            f"variable rate ({steps}): each picture keeps its own time; --fps 60 sets a steady rate"
        )
    return footage.rate, (
        f"variable rate ({steps}): {float(footage.rate):g} frames a second, as on average; "
        "--fps sets another rate"
    )


def blurred(plan: Plan, wish: Wish, tell: Tell) -> tuple[FootageBlur, list[str]]:
    """Blur a video into its output; returns the run and what the output cannot hold, in lines."""
    footage, video, shutter = plan.footage, wish.video, wish.when.make()
    cuts = CutList(wish.given.cuts or "")
    run = FootageBlur(
        footage,
        wish.blur,
        wish.motion,
        clock=plan.clock,
        holdout=holdout_of(wish.look.holdout, footage),
        fill=video.duplicates == "fill",
        cuts=cuts.is_search,
        known_cuts=cuts.frames(0),
        highlights=video.highlights,
    )

    def blur_part(moments: Sequence[Moment], sink: Sink) -> None:
        blur_footage(run, shutter, moments, sink, tell)

    return run, write(run, plan.output, video, plan.wanted, wish.settings, blur_part)


def check_fits(given: InputSettings, look: BlurSettings) -> None:
    """InputError for options that only rendered frames have."""
    taken = ("frames", "cuts", "max_mb")
    for field in fields(InputSettings):
        if field.name not in taken and getattr(given, field.name) != field.default:
            option = field.name.replace("_", "-")
            raise InputError(f"--{option} is for rendered frames, a video has no layers")
    if look.scale:
        raise InputError("--scale is for rendered frames, a video has no layers")
