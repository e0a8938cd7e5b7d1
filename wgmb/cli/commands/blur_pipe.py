"""`wgmb blur - -o -`: pictures through pipes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO

from ...errors import InputError, counted
from ...io.pipes import STDIN, STDOUT
from ...run.pipe import StreamHints
from ...run.pipe import blur_pipe as run
from ...run.video import VideoRequest
from ...settings import OutputSettings
from ...settings.record import record
from ...video.holdouts import files_of
from .. import run_log
from ..console import Console, pictures_told
from ..exit_codes import DONE, SOME_FAILED
from ..terminal import check


def blur_pipe(
    source: str,
    output: OutputSettings,
    request: VideoRequest,
    console: Console,
    hints: StreamHints,
    adapter: str | None = None,
) -> int:
    """Blur from or into a pipe; returns the exit code."""
    if source == STDIN and os.isatty(0):
        raise InputError("standard input is a terminal; pipe pictures into it, such as: "
                         "ffmpeg -i in.mp4 -f yuv4mpegpipe - |")  # fmt: skip

    settings = record(request.blur, request.shutter, request.video)
    made_of = source, *files_of(request.blur.holdout)
    run_log.start([source], output.output, settings, None, made_of)
    with _stdout(output.output) as stdout:
        report = run(
            source, output, request, stdout=stdout, device=adapter, hints=hints,
            tell=console.say, progress=run_log.logged(check, output.output),
        )  # fmt: skip
    console.say(*pictures_told(report, request.video.duplicates == "fill"))
    where = "stdout" if output.output == STDOUT else output.output
    console.say(f"{counted(report.frames, 'frame')} -> {where}")
    if report.loss:
        console.complain(report.loss)
        return SOME_FAILED
    return DONE


@contextmanager
def _stdout(name: str) -> Iterator[BinaryIO | None]:
    """The stream for pictures; whatever else is printed meanwhile goes to standard error."""
    if name != STDOUT:
        yield None
        return
    if os.isatty(1):
        raise InputError("standard output is a terminal; pipe the pictures into another program, "
                         "such as: | ffmpeg -i - out.mp4")  # fmt: skip
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with os.fdopen(os.dup(kept), "wb", 0) as pictures:
            yield pictures
    finally:
        os.dup2(kept, 1)
        os.close(kept)
