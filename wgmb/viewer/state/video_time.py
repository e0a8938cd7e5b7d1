"""The time shown: the output frames of a video, and how they pass."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Any, TypeVar

from ...color.coding import HLG, PQ
from ...io.frame_numbers import frame_numbers
from ...settings import rate_of
from ...video.output_times import OutputFrame
from .files import (
    VideoOutput,
    frames_of,
    output_of,
    reader_of,
)
from .shown_moment import ShownMoment

_Shown = TypeVar("_Shown", bound=ShownMoment)

SOURCE = "source"
"""As a rate: an output frame for each picture of a video, at its time."""


def check(state: ShownMoment) -> None:
    """InputError for options that make no sense."""
    video = state.video
    if video.expansion:
        reader = reader_of(state.source, state.input.max_mb)
        video.expansion.check_video(reader.path, reader.coding)
    _ = video.pace, video.range


def own_rate(state: ShownMoment) -> Fraction:
    """Pictures a second of the video."""
    return reader_of(state.source, state.input.max_mb).rate


def is_own_rate(state: ShownMoment) -> bool:
    """Return True if the video keeps a steady rate, and the output has it too."""
    has_rate = reader_of(state.source, state.input.max_mb).has_rate
    return has_rate and rate(state) == own_rate(state)


def at_own_rate(state: _Shown) -> _Shown:
    """The same at the rate of the video, or at the times of its pictures if it keeps no rate."""
    reader = reader_of(state.source, state.input.max_mb)
    return replace(state, own_times=not reader.has_rate, fps=float(reader.rate))


def is_hdr(state: ShownMoment) -> bool:
    """Return True if the video holds light above white."""
    return reader_of(state.source, state.input.max_mb).coding.transfer in (PQ, HLG)


def rate(state: ShownMoment) -> Fraction:
    """Output frames a second, exactly; of a scene or frames too."""
    if state.is_video and state.fps == float(own := own_rate(state)):
        return own
    return Fraction(state.fps).limit_denominator(1001)


def completed(state: _Shown, named: Collection[str]) -> _Shown:
    """The same with the video's own rate and all of its pictures, unless others were said."""
    if "fps" not in named:
        state = at_own_rate(state)
    elif state.own_times:
        state = replace(state, fps=float(own_rate(state)))
    if "frames" not in named:
        state = replace(state, frames=frames_of(state.source, state.input.max_mb))
    return state


def output(state: ShownMoment) -> VideoOutput:
    """The output frames; InputError if the part that is chosen holds none."""
    most = state.input.max_mb
    frames = None if state.frames == frames_of(state.source, most) else state.frames
    reader, fps = reader_of(state.source, most), None if state.own_times else rate(state)
    return output_of(reader, frames, state.video, fps)


def span(state: ShownMoment) -> tuple[int, int]:
    """First and last frame of `frames`; of a video, of the output."""
    if state.is_video:
        return 0, len(output(state).frames) - 1
    return _ends(state.frames)


@lru_cache(maxsize=8)
def _ends(frames: str) -> tuple[int, int]:
    """First and last of frame numbers; to read them takes a tenth of a frame of the window."""
    numbers = frame_numbers(frames)
    return min(numbers), max(numbers)


def settled(state: _Shown) -> _Shown:
    """The same, its moment within its frames."""
    first, last = span(state)
    frame = min(max(state.frame, first), last) if math.isfinite(state.frame) else float(first)
    return replace(state, frame=frame)


def output_frame(state: ShownMoment) -> OutputFrame:
    """The output frame that is shown."""
    frames = output(state).frames
    return frames[min(max(math.floor(state.frame), 0), len(frames) - 1)]


def held_for(state: ShownMoment, number: int) -> float:
    """Duration of an output frame [s]: until the next one."""
    frames = output(state).frames
    if number + 1 < len(frames):
        return float(frames[number + 1].time - frames[number].time)
    return float(frames[number].interval)


def retimed(state: _Shown, **changes: Any) -> _Shown:
    """The same with other options, at the same time in the video."""
    at = output(state).clock.back(output_frame(state).time)
    state = replace(state, **changes)
    now = output(state)
    return replace(state, frame=float(now.frames.nearest(now.clock.out(at))))


def in_frames(state: _Shown, text: str) -> _Shown:
    """The same with other frames, or, of a video, other pictures to make the output from."""
    frame_numbers(text)
    if state.is_video:
        return retimed(state, frames=text)
    return settled(replace(state, frames=text))


def at_rate(state: _Shown, text: str) -> _Shown:
    """The same at another rate: a number of frames per second, or, of a video, SOURCE."""
    if state.is_video and text == SOURCE:
        return retimed(state, own_times=True, fps=float(own_rate(state)))
    fps = float(rate_of(text))
    return retimed(state, own_times=False, fps=fps) if state.is_video else replace(state, fps=fps)


def passed(state: ShownMoment, seconds: float) -> float:
    """The frame that is shown `seconds` later, without an end; of a scene or frames too."""
    frames = float(rate(state))
    if not (state.is_video and state.own_times):
        return state.frame + seconds * frames
    of_video, frame = output(state).frames, state.frame
    for number in range(max(math.floor(frame), 0), len(of_video) - 1):
        step = float(of_video[number + 1].time - of_video[number].time)
        left = (number + 1 - frame) * step
        if seconds < left:
            return frame + seconds / step
        frame, seconds = float(number + 1), seconds - left
    return frame + seconds * frames


def described(state: ShownMoment, pictures: Sequence[int]) -> str:
    """The output frame that is shown, and the numbers of the pictures that share its exposure."""
    frame = output_frame(state)
    since = float(frame.time - output(state).frames[0].time)
    numbers = " - ".join(str(n) for n in dict.fromkeys((min(pictures), max(pictures))))
    word = "pictures" if len(pictures) > 1 else "picture"
    return f"output frame {frame.number}, {since:.3f} s: {word} {numbers}"
