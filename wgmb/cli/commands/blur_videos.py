"""`wgmb blur` of several videos: one bar for all, one line for each."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import GpuMemoryError, InputError, counted
from ...io import stills
from ...io.frame_numbers import is_pattern
from ...run.video import VideoPlan, VideoRequest, VideoRun
from ...settings import OutputSettings
from ...settings.video import VideoSettings
from ...video.write.encoders import SUFFIXES, chosen
from ..conclusion import repeats_told
from ..exit_codes import DONE, SOME_FAILED
from ..names import outputs_of, videos_of
from ..spelling import as_options
from ..terminal import complain, note, progress, share_of
from .blur_video import tell_how

Tell = Callable[..., None]
"""A function that `terminal.progress` yields."""
_FAILURES = InputError, GpuMemoryError, OSError, MemoryError
"""Errors of one video, after which others may be done."""


def blur_videos(
    patterns: Sequence[str],
    output: OutputSettings,
    request: VideoRequest,
    adapter: str | None,
    quiet: bool,
    verbose: bool,
) -> int:
    """Blur several videos, one after the other; returns the exit code.

    A video that fails is reported, and the others are done.
    """
    paths = videos_of(patterns)
    outputs = [replace(output, output=name) for name in outputs_of(paths, output.output)]
    for one in outputs:
        _check_output(one, request.video)
    run = request.open(adapter)
    tell_how(run, quiet, verbose)
    plans: list[VideoPlan | str] = []
    for path, one in zip(paths, outputs, strict=True):
        try:
            plans.append(run.plan(path, one))
        except _FAILURES as error:
            plans.append(_reason(error, path))
    total = sum(len(plan.wanted) for plan in plans if isinstance(plan, VideoPlan))
    failed = 0
    with progress(total, quiet) as tell:
        for plan in plans:
            if isinstance(plan, str):
                complain(plan)
                failed += 1
            else:
                failed += not _one_of_many(plan, run, tell, quiet)
    if not quiet:
        note(f"{len(plans) - failed} of {counted(len(plans), 'video')} done")
    return SOME_FAILED if failed else DONE


def _one_of_many(plan: VideoPlan, run: VideoRun, tell: Tell, quiet: bool) -> bool:
    """Blur a video and say so in a line; returns whether all of it is done."""
    path = plan.reader.path
    try:
        with share_of(tell, len(plan.wanted), f"{path.name}, frame") as tick:
            report = run(plan, tick)
    except _FAILURES as error:
        complain(_reason(error, path))
        return False
    if not quiet:
        took = f"{counted(report.frames, 'frame')} in {report.seconds:.1f} s"
        words = [took if report.is_new else "", *report.left_out, *report.notes]
        if report.is_new and run.request.video.duplicates == "fill":
            words.append(repeats_told(report.repeated))
        words += [report.held_out, report.scaling]
        note(as_options(f"{path}: {'; '.join(filter(None, words))} -> {report.output}"))
    if report.loss:
        complain(report.loss)
        return False
    return True


def _reason(error: BaseException, path: Path) -> str:
    """The error in one line that names the video."""
    text = getattr(error, "strerror", None) or str(error) or "not enough memory"
    return text if str(path) in text else f"{path}: {text}"


def _check_output(output: OutputSettings, video: VideoSettings) -> None:
    """InputError for a video that cannot be written, or is there and is not to be replaced."""
    path = Path(output.output)
    suffix = path.suffix.lower()
    if suffix in (".exr", *stills.SUFFIXES) and is_pattern(path):
        return  # how many frames there are depends on the video
    if suffix not in SUFFIXES:
        raise InputError(
            f"output {path}: must be a video {' '.join(SUFFIXES)}, a frame pattern, or a folder, "
            "whose name ends in /"
        )
    chosen(path, video.codec, video.quality, video.encoder)
    if os.path.exists(os.path.realpath(path)) and not (output.overwrite or output.resume):
        raise InputError(f"{path} exists; --overwrite replaces it, --resume keeps finished videos")
