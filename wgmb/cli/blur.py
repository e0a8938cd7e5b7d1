"""`wgmb blur`: rendered frames."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .. import gpu
from .._version import __version__
from ..batch import BatchReport, blur_sequence
from ..color_settings import ColorSettings, color_record
from ..display import Display
from ..errors import InputError
from ..extras import needed_by
from ..io.clip import Clip
from ..io.frame_file import about, is_video, odd_sizes
from ..io.frame_numbers import frame_list
from ..io.input_space import space_of
from ..io.masks import is_file, with_amount
from ..pipeline import Blur
from ..settings import BlurSettings, InputSettings, OutputSettings, ShutterSettings, plain
from ..video_settings import VideoSettings
from .exit_codes import DONE, SOME_FAILED
from .options import (
    BlurOptions,
    Colors,
    Given,
    InputOptions,
    Look,
    ShutterOptions,
    Target,
    Videos,
    When,
)
from .spelling import as_options
from .terminal import complain, note, progress
from .video_names import is_batch


def blur(
    patterns: Annotated[tuple[str, ...], Parameter(name="pattern")],
    output: Target,
    look: Look = BlurOptions(),
    when: When = ShutterOptions(),
    given: Given = InputOptions(),
    color: Colors = ColorSettings(),
    video: Videos = VideoSettings(),
    *,
    confidence: bool = False,
    config: Path | None = None,
    adapter: str | None = None,
    verbose: Annotated[bool, Parameter(alias="-v")] = False,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Blur rendered frames, or videos.

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180 --frames 1-100

    Example: wgmb blur in.mp4 -o out.mp4 --shutter 180 --fps 60

    Example: wgmb blur a.mp4 b.mkv -o out/ --fps 60

    Parameters
    ----------
    patterns
        Frames to blur: shot.####.exr, shot.%04d.exr, or one file. Or videos: files, folders, or
        patterns such as 'clips/*.mp4'; for several, the output is a folder, or a name with {name}.
    confidence
        Add confidence layers, confidence.* (EXR output, method gather); doubles the time.
    config
        TOML file with options in its table [blur], as saved by `wgmb view`.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Print the GPU, layers and settings in use.
    quiet
        Print errors only.
    """
    when, pattern = when.resolved(), patterns[0]
    if is_batch(patterns, output.output) or is_video(pattern):
        with needed_by(pattern, "video"):
            from .blur_video import blur_video
            from .blur_videos import blur_videos
        if confidence:
            raise InputError("--confidence is for rendered frames")
        settings = look, when, given, video, adapter, quiet, verbose
        if is_batch(patterns, output.output):
            return blur_videos(patterns, output, *settings)
        return blur_video(pattern, output, *settings)
    shown = color.open(needed=not output.is_exr)
    space = color.space(shown)
    clip = given.open(pattern, look.holdout, look.scale, space)
    for scale in look.scale:
        if "=" in scale and with_amount(scale)[1] is None and not (quiet or is_file(scale)):
            note(f"--scale {scale}: no amount such as {scale}:0.5, so all else stands still")
    unknown = _check_space(clip, shown) if space is None else ""
    if unknown and not quiet:
        note(unknown)
    how = _move_by_pictures(clip, video, adapter)
    look = look.resolved(clip=clip)
    look = look.for_pictures() if how else look
    made = look.make(when.make(), adapter)
    settings = _settings(look, when, given) | {"samples": samples_of(made)} | output.looks
    settings["curve"] = when.curve_read()
    settings |= color_record(shown, output.output, space, pattern)
    if confidence:
        check_confidence(made, output)
        settings["confidence"] = True
    files = output.make(settings, clip.numbers, clip.inputs, clip.chosen, shown)
    if color.remark and not (quiet or output.is_exr):
        note(color.remark)
    if how:
        settings["flow"] = how
        if not quiet:
            note(f"motion: {how}, as the frames hold none")
    if verbose:
        note(f"adapter: {made.device.adapter.summary}")
        note(f"settings: {files.settings}")
    started = time.perf_counter()
    with progress(len(clip.numbers), quiet) as tick:
        report = blur_sequence(
            clip, made, files, resume=output.resume, confidence=confidence, progress=tick
        )
    took = f"{time.perf_counter() - started:.1f} s with {made.method.name}"
    return conclude(clip, files, report, took, quiet, verbose)


def _check_space(clip: Clip, shown: Display | None) -> str:
    """InputError where frames say that they are not linear; a remark on a space of no config."""
    if shown is None:
        return ""
    source = clip.source(clip.numbers[0])
    if source.part is None:
        return ""
    said = shown.config.unknown(source.part.attributes)
    found = space_of(source, shown.config)
    with about(source.name):
        found.check_linear()
    if not said:
        return ""
    return f"{source.path}: {said} is not in {shown.config.name}, so it is taken as {found.text}"


def _move_by_pictures(clip: Clip, video: VideoSettings, adapter: str | None) -> str:
    """Take motion from the pictures of frames that hold none; returns how, in words."""
    if video.flow == "none" or len(clip.on_disk) < 2:
        return ""
    has = clip.has
    if "motion" in has or not has:  # nothing can be read: its turn to fail comes
        return ""
    motion, how = video.source(gpu.open_device(adapter))
    if motion is not None:
        clip.move_by(motion)
    return how


def _settings(look: BlurSettings, when: ShutterSettings, given: InputSettings) -> dict:
    """Everything that changes a result, as it is written into the files."""
    every = {"wgmb": __version__} | plain(look) | plain(when) | plain(given)
    for not_a_look in ("frames", "skip_missing", "max_mb"):
        del every[not_a_look]
    return every


def conclude(clip, files, report: BatchReport, took: str, quiet: bool, verbose: bool) -> int:
    """Print a summary of the run; return the exit code."""
    for number, why in sorted(report.failed.items()):
        complain(f"frame {number} failed: {why}")
    if report.stopped:
        rest = len(clip.numbers) - len(report.done) - len(report.skipped) - len(report.failed)
        complain(f"stopped: {report.stopped}; {rest} other frames were not written")
    for mask in report.absent:
        complain(f"{mask} is in no frame, so it changed nothing")
    if not quiet:
        for number, bad in sorted(report.bad.items()):
            what = ", ".join(f"{n} in {name}" for name, n in bad.items())
            note(f"frame {number}: ignored pixels that are not finite: {what}")
        if verbose or clip.is_finding_notable:
            note(f"vectors: {clip.finding}")
        for text, numbers in clip.notes.items():
            text = as_options(text)
            if told := sorted(set(numbers) & set(report.done)):
                note(
                    text if len(told) == len(report.done) else f"frames {frame_list(told)}: {text}"
                )
        for mask in clip.unseen:
            note(f"{mask} is in no pixel of these frames, so it changed nothing")
        if stray := clip.stray_cuts:
            there = f"{clip.on_disk[0]} to {clip.on_disk[-1]}"
            note(f"cuts outside the frames {there} change nothing: {frame_list(stray)}")
        if clip.cuts:
            note(f"camera cut before frame {', '.join(map(str, sorted(clip.cuts)))}")
        if odd := odd_sizes({n: clip.sizes[n] for n in report.done}):
            note(odd)
        done = f"{len(report.done)} frames in {took} -> {files.pattern}"
        note(done + (f", {len(report.skipped)} already done" if report.skipped else ""))
    if report.failed:
        complain(f"{len(report.failed)} of {len(clip.numbers)} frames failed")
    return SOME_FAILED if report.failed or report.stopped or report.absent else DONE


def check_confidence(made: Blur, output: OutputSettings) -> None:
    """Raise InputError unless the method reports confidence and the output can store it."""
    layers = ", ".join(made.confidence)
    if not output.is_exr:
        raise InputError(f"--confidence ({layers}) needs an .exr output, got {output.output}")


def samples_of(blur: Blur) -> int | str:
    """The samples for a file's record: a number, or "auto"."""
    return "auto" if blur.auto else blur.samples
