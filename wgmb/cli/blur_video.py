"""`wgmb blur` of a video: into a video, or into frames."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from .._version import __version__
from ..coding import Coding
from ..color import srgb
from ..errors import InputError
from ..io import atomic, stills
from ..io.clock import Clock, tick
from ..io.coded_video import CodedVideo
from ..io.cut_list import CutList
from ..io.encoders import SUFFIXES, Facts, chosen
from ..io.footage import Footage
from ..io.frame_file import size_text
from ..io.frame_numbers import frame_numbers
from ..io.other_streams import OtherStreams
from ..io.output import refuse_inputs
from ..io.overlay import overlay_of
from ..io.segments import Segment, Segments, remove_left
from ..motion_source import MotionSource
from ..pipeline import Blur
from ..settings import BlurSettings, InputSettings, OutputSettings, ShutterSettings, plain
from ..video_batch import FootageBlur, FramesSink, Moment, Sink, VideoSink, blur_footage, moments
from ..video_settings import VideoSettings
from .exit_codes import DONE, SOME_FAILED
from .terminal import note, progress

FIRST = 1  # number of the first frame, where they are image files
_RECORD = "comment", "description", "synopsis"  # texts of a video; the first that is free
STATIC = "static"  # as a holdout: what never changes while all around it does


Tell = Callable[..., None]
"""What `terminal.progress` gives."""


@dataclass(frozen=True)
class Wish:
    """What all videos of a run have in common."""

    look: BlurSettings
    when: ShutterSettings
    given: InputSettings
    video: VideoSettings
    blur: Blur
    motion: MotionSource | None
    how: str

    @property
    def settings(self) -> dict[str, Any]:
        """What a result depends on, as it is written into a video."""
        found = {"wgmb": __version__} | plain(self.look) | plain(self.when) | plain(self.video)
        return found | {"curve": self.when.curve_read()}


@dataclass(frozen=True)
class Plan:
    """One video and the output frames that are wanted of it."""

    footage: Footage
    output: OutputSettings
    clock: Clock
    wanted: list[Moment]

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
        for text in plan.footage.notes:
            note(f"{path}: {text}")
    started = time.perf_counter()
    with progress(len(plan.wanted), quiet) as tell:
        run, left_out = blurred(plan, wish, tell)
    if not quiet:
        for text in left_out:
            note(f"{plan.name}: {text}")
    if not quiet and (reel := run.reel) is not None:
        took = f"{time.perf_counter() - started:.1f} s with {wish.blur.method.name}"
        if reel.cuts:
            note(f"camera cut before picture {', '.join(map(str, sorted(reel.cuts)))}")
        if reel.doubles:
            note(f"{len(reel.doubles)} repeated pictures left out")
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
    _check_fits(given, look)
    method = look.method or ("gather" if video.flow in ("auto", "search") else "tap")
    look = replace(look, method=method).for_pictures()
    blur = look.make(when.make(), adapter)
    return Wish(look, when, given, video, blur, *video.source(blur.device))


def tell_how(wish: Wish, quiet: bool, verbose: bool) -> None:
    """Say where motion comes from, and, if asked, the settings."""
    if verbose:
        note(f"adapter: {wish.blur.device.adapter.summary}")
        note(f"settings: {json.dumps(wish.settings, sort_keys=True)}")
    if not quiet:
        note(f"motion: {wish.how}")


def planned(path: str | Path, output: OutputSettings, wish: Wish) -> Plan:
    """Open a video; InputError if it cannot be read or has no pictures in the range."""
    footage = Footage(path, max_mb=wish.given.max_mb)
    clock = _clock(footage, wish.given, wish.video)
    fps = None if output.fps == "source" else output.rate_or(footage.rate)
    return Plan(footage, output, clock, moments(footage, clock, fps))


def blurred(plan: Plan, wish: Wish, tell: Tell) -> tuple[FootageBlur, list[str]]:
    """Blur a video into its output; returns the run and what the output cannot hold, in lines."""
    footage, video, shutter = plan.footage, wish.video, wish.when.make()
    cuts = CutList(wish.given.cuts or "")
    run = FootageBlur(
        footage,
        wish.blur,
        wish.motion,
        clock=plan.clock,
        holdout=_holdout(wish.look.holdout, footage),
        fill=video.duplicates == "fill",
        cuts=cuts.is_search,
        known_cuts=cuts.frames(0),
    )

    def blur_part(moments: Sequence[Moment], sink: Sink) -> None:
        blur_footage(run, shutter, moments, sink, tell)

    write = _write_video if Path(plan.name).suffix.lower() in SUFFIXES else _write_frames
    return run, write(run, plan.output, video, plan.wanted, wish.settings, blur_part)


def _check_fits(given: InputSettings, look: BlurSettings) -> None:
    """InputError for options that only rendered frames have."""
    taken = ("frames", "cuts", "max_mb")
    for field in fields(InputSettings):
        if field.name not in taken and getattr(given, field.name) != field.default:
            option = field.name.replace("_", "-")
            raise InputError(f"--{option} is for rendered frames, a video has no layers")
    if look.scale:
        raise InputError("--scale is for rendered frames, a video has no layers")


def _clock(footage: Footage, given: InputSettings, video: VideoSettings) -> Clock:
    start, (first, end) = footage.times[0], video.range
    first, end = (None if t is None else start + t for t in (first, end))
    if given.frames is not None:
        if video.begin or video.end:
            raise InputError("choose either --frames or --begin and --end")
        numbers = frame_numbers(given.frames)
        there = f"{footage.path} has pictures 0 to {len(footage) - 1}"
        if not 0 <= numbers[0] <= numbers[-1] < len(footage):
            raise InputError(f"frames {given.frames}: {there}")
        if numbers != list(range(numbers[0], numbers[-1] + 1)):
            raise InputError(f"frames of a video must be one range, got {given.frames}")
        first = footage.times[numbers[0]]
        end = None if numbers[-1] + 1 == len(footage) else footage.times[numbers[-1] + 1]
    origin = start if first is None else Fraction(0)
    return Clock(first or start, video.pace, origin, first, end)


def _holdout(masks: tuple[str, ...], footage: Footage) -> np.ndarray | None:
    """(height, width) of all masks together; None without any."""
    whole: np.ndarray | None = None
    for mask in masks:
        if mask == STATIC:
            plane = overlay_of(footage)
        elif Path(mask).suffix.lower() in stills.SUFFIXES:
            plane = srgb(stills.read(mask)[..., 0])
        else:
            known = f"{STATIC}, or an image file {' '.join(stills.SUFFIXES)}"
            raise InputError(f"holdout of a video must be {known}; got {mask!r}")
        if plane.shape[::-1] != footage.size:
            expected = "{} x {}".format(*footage.size)
            raise InputError(f"{mask} must be {expected} like the video, got {size_text(plane)}")
        whole = plane if whole is None else np.maximum(whole, plane)
    return whole


BlurPart = Callable[[Sequence[Moment], Sink], None]
"""Blurs some of the moments into a sink."""


def _write_video(
    run: FootageBlur,
    output: OutputSettings,
    video: VideoSettings,
    wanted: list[Moment],
    settings: dict[str, Any],
    blur_part: BlurPart,
) -> list[str]:
    """Write a video, with `resume` in segments; returns what it cannot hold, in lines."""
    path, footage = Path(output.output), run.footage
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, lost = encoding.coding(footage.coding)
    facts = Facts(
        pixel_aspect=footage.pixel_aspect,
        mastering=footage.mastering,
        light_level=footage.light_level,
    )
    found = os.stat(footage.path)
    made_of = settings | {"input": [footage.path.name, found.st_size, found.st_mtime_ns]}
    texts = _texts(footage, made_of)
    there = [path] if path.exists() else []
    refuse_inputs(path.parent, [path.name], there, [footage.path])
    if there and output.resume and texts.items() <= Footage(path).metadata.items():
        remove_left(path)
        return ["is already done"]
    if there and not output.overwrite:
        more = " and was made otherwise" if output.resume else ""
        raise InputError(f"{path} exists{more}; --overwrite replaces it")
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.sweep(path.parent, [path.name])
    times, rate = [moment.time for moment in wanted], 1 / wanted[0].interval
    base = tick(*times, wanted[0].interval)
    shape = encoding, coding, footage.size, rate, base
    others = None
    if video.streams == "all":
        keeps_pitch = video.pitch == "keep"
        others = OtherStreams(footage.path, footage.index, run.clock, keeps_pitch)
    if output.resume:
        segments = Segments(path, *shape, times, made_of, facts)
        try:
            for numbers in segments.to_do():
                part = wanted[numbers.start : numbers.stop]
                _fill(segments.begin(numbers), run, coding, part, blur_part)
            return [*lost, *segments.join(texts, others)]
        finally:
            segments.release()
    writer = CodedVideo(path, atomic.temporary_name(path), *shape, facts, texts, others)
    _fill(writer, run, coding, wanted, blur_part)
    remove_left(path)
    return [*lost, *writer.left_out]


def _fill(
    writer: CodedVideo | Segment,
    run: FootageBlur,
    coding: Coding,
    moments: Sequence[Moment],
    blur_part: BlurPart,
) -> None:
    """Write pictures and close the file, or leave nothing of it."""
    try:
        blur_part(moments, VideoSink(writer, coding))
        writer.close()
    except BaseException:
        writer.abandon()
        raise


def _texts(footage: Footage, made_of: dict[str, Any]) -> dict[str, str]:
    """The record of a video, under the first text that its input leaves free."""
    free = next((name for name in _RECORD if name not in footage.metadata), _RECORD[0])
    return {free: f"wgmb {json.dumps(made_of, sort_keys=True)}"}


def _write_frames(
    run: FootageBlur,
    output: OutputSettings,
    video: VideoSettings,
    wanted: list[Moment],
    settings: dict[str, Any],
    blur_part: BlurPart,
) -> list[str]:
    """Write image files."""
    numbers = [FIRST + moment.number for moment in wanted]
    files = output.make(settings, numbers, [run.footage.path])
    channels = 4 if run.footage.coding.alpha else 3
    try:
        blur_part(wanted, FramesSink(files, run.device, channels, FIRST))
        files.close()
    except BaseException:
        files.abandon()
        raise
    return []
