"""Whole sequences: rendered frames through a Blur into files.

A failing frame is reported, and the others are made; see engine.py for the threads.
"""

from __future__ import annotations

from ..errors import InputError
from ..io.frame_numbers import has_view
from ..output.names import beyond
from ..output.output import Output
from ..output.vectors import VectorOutput
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..threads import Stop
from .conversion import RateConversionStages
from .engine import RunOptions
from .file_sink import run_into
from .report import BatchReport, Progress, describe_frames, describe_input
from .stages import MotionStages, Stages


def blur_sequence(
    clip: Clip,
    blur: Blur,
    output: Output,
    *,
    resume: bool = False,
    confidence: bool = False,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> BatchReport:
    """Blur every frame of `clip` into `output`; `confidence` adds confidence layers.

    `resume` skips frames that are finished (see Output.done). `progress` is called with each
    frame's number and "done", "skipped" or "failed". All views of a stereo frame are blurred, or
    the one for which the clip was opened; an output of one picture gets the default view.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the reason;
    the others are finished. If several successive frames cannot be written for the same reason (a
    full disk, a removed folder), or a video cannot continue, the run stops, and the report's
    `stopped` gives the reason. Once `stop` is set, no further frame is begun; blurred frames are
    written, and `stopped` is "on request". An interruption leaves no half-written file and is
    raised again. InputError, before any frame is blurred, if a mask names an object that no
    Cryptomatte has. Masks by index or id can be checked at the end only: `absent`.
    """
    options = RunOptions(resume, progress, stop, on_error="go on")
    return blur_into(output, Stages(clip, blur, confidence, output.takes_views), options)


def blur_into(output: Output, stages: Stages, options: RunOptions) -> BatchReport:
    """Blur every frame of `stages` into `output`; everything else is as for `blur_sequence`.

    Numbers are those of the output's frames; conversion.py has the inputs of each at another rate.
    """
    _check_names(stages.clip, output)
    report = run_into(output, stages, stages.numbers, options, stages.made_of)
    _describe(report, stages)
    if isinstance(stages, RateConversionStages):
        report.beyond = beyond(output.pattern, stages.numbers[-1])
    return report


def _check_names(clip: Clip, output: Output) -> None:
    """InputError where views or masks do not fit; the output is then abandoned."""
    try:
        _check_names_of_views(clip, output)
        clip.masks.check()
    except BaseException:
        output.abandon()
        raise


def _check_names_of_views(clip: Clip, output: Output) -> None:
    """InputError where views in a file each would go into one."""
    apart = has_view(clip.pattern) and len(clip.chosen) > 1
    if apart and output.takes_views and not has_view(output.pattern):
        raise InputError(
            f"output {output.pattern}: the frames have a file for each view, so %V must be in its "
            "name too"
        )


def _describe(report: BatchReport, stages: Stages) -> None:
    """Add observations about the frames."""
    describe_input(report, stages.clip)
    is_converted = isinstance(stages, RateConversionStages)
    describe_frames(report, stages.clip, is_converted=is_converted)


def vectors_sequence(
    clip: Clip,
    output: VectorOutput,
    *,
    blur: Blur | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> BatchReport:
    """Write the motion of every frame of `clip` into `output`, in the form of another program.

    It is the motion that `blur_sequence` follows: from vectors in any convention, or from depth and
    cameras. Frames without motion are in the report's `failed`; everything else is as for
    `blur_sequence`. `blur`: its device is used, and its `max_blur` limits the motion.
    """
    stages = MotionStages(clip, blur or Blur("tap"), all_views=output.takes_views)
    options = RunOptions(resume, progress, stop, on_error="go on")
    report = run_into(output, stages, stages.numbers, options, stages.made_of)
    _describe(report, stages)
    return report
