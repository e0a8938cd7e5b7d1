"""`wgmb perceive` of a video: its pictures are held for their own times."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from ... import gpu
from ..._version import __version__
from ...cone import Cone
from ...errors import InputError, counted
from ...observer import Observer
from ...run.perceive import PerceivedVideo, densest_rate
from ...run.video import check_fits
from ...run.video_output import PictureSink, write
from ...settings import BlurSettings, InputSettings, OutputSettings
from ...settings.video import VideoSettings
from ...threads import Behind
from ...video.linear_frames import VideoPictures
from ...video.output_times import OutputFrame, OutputFrames
from ...video.planes import Planes
from ...video.read.reader import VideoReader
from ..exit_codes import DONE, SOME_FAILED
from ..terminal import note, progress


def perceive_video(
    path: str,
    output: OutputSettings,
    input: InputSettings,
    cone: Cone,
    settings: dict[str, Any],
    adapter: str | None,
    quiet: bool,
) -> int:
    """Write what is seen of each picture, at its time; returns the exit code."""
    check_fits(input, BlurSettings())
    if output.fps is not None:
        raise InputError("`fps` is for frames, the pictures of a video have their own times")
    reader = VideoReader(path, max_mb=input.max_mb)
    clock = VideoSettings().clock(reader, input.frames)
    wanted = OutputFrames(reader, clock, None)
    device = gpu.open_device(adapter)
    observer = Observer(densest_rate(reader, cone), cone, device=device)
    seen = PerceivedVideo(reader, clock, VideoPictures(reader, Planes(device)), observer)
    first = next(n for n, t in enumerate(reader.times) if clock.out(t) == wanted[0].time)
    if not quiet:
        for text in reader.notes:
            note(f"{path}: {text}")
    started = time.perf_counter()
    with progress(len(wanted), quiet, "perceiving") as tell:

        def make_part(moments: Sequence[OutputFrame], sink: PictureSink) -> None:
            shown = seen.perceived(first, first + len(moments) - 1)
            with Behind(sink.put) as put:
                for number, color, held in shown:
                    observer.present(color, held)
                    put(sink.take(moments[number - first], seen))
                    tell(number, "done")

        made_of = {"wgmb": __version__} | settings
        left_out = write(seen, output, VideoSettings(), wanted, made_of, make_part)
    if not quiet:
        for text in left_out:
            note(f"{output.output}: {text}")
        seconds = time.perf_counter() - started
        note(f"{counted(len(wanted), 'frame')} in {seconds:.1f} s -> {output.output}")
    if loss := reader.loss():
        note(f"wgmb: {loss}")
        return SOME_FAILED
    return DONE
