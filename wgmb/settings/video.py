"""User settings of videos as plain values; the string under a field is its help."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Literal, Self

import wgpu

from ..color.highlights import Expansion
from ..errors import InputError
from ..io.frame_numbers import frame_numbers
from ..shots.motion import MotionSource
from ..video.clock import Clock
from .recipes import METHODS_BY_FLOW, FlowName, FlowQuality, Recipe, recipe_of

if TYPE_CHECKING:
    from ..video.read.reader import VideoReader


OF_FRAMES = frozenset({"flow", "flow_quality", "highlights"})
"""Options of videos that rendered frames have, too."""


@dataclass(frozen=True, kw_only=True)
class FlowSettings:
    """Source of the motion of pictures."""

    flow: FlowName = "auto"
    "Source of the motion: search (best), dis (quick, OpenCV), none (pictures are averaged)."
    flow_quality: FlowQuality = "best"
    "Quality of the motion: best, fast, or draft, which searches smaller pictures."

    @property
    def method(self) -> str:
        """The blur method that suits the motion of settings that are `chosen`."""
        return METHODS_BY_FLOW[self.flow]

    def source(self, device: wgpu.GPUDevice) -> tuple[MotionSource | None, str]:
        """The source of the motion, and its description in words."""
        recipe = self._recipe(device)
        return recipe.make(recipe.quality or self.flow_quality, device), recipe.words

    def is_by_place(self, device: wgpu.GPUDevice) -> bool:
        """True if "auto" becomes dense inverse search that is made better by place."""
        return self._recipe(device).has_edges_gathered

    def chosen(self, device: wgpu.GPUDevice) -> tuple[Self, str]:
        """A copy in which `flow` is chosen as it suits the device, and the choice in words.

        It stays "auto" for dense inverse search on a GPU, with a search of blocks.
        """
        recipe = self._recipe(device)
        quality = recipe.quality or self.flow_quality
        return replace(self, flow=recipe.flow, flow_quality=quality), recipe.words

    def _recipe(self, device: wgpu.GPUDevice) -> Recipe:
        return recipe_of(self.flow, self.flow_quality, device)


@dataclass(frozen=True, kw_only=True)
class VideoSettings(FlowSettings):
    """Motion, time and encoding of videos."""

    begin: str | None = None
    "Time in the video to begin at: 12.5 (seconds) or 1:02:03."
    end: str | None = None
    "Time in the video to end at."
    longest_pause: float = 600.0
    "Longest time from one picture to the next in seconds; longer ones are refused."
    speed: str = "1"
    "Speed of the output, such as 0.5 for slow motion."
    pitch: Literal["keep", "follow"] = "keep"
    "Pitch of the sound at another speed: keep it, or let it follow, as on a tape."
    streams: Literal["all", "video"] = "all"
    "Streams of the output: all (sound, subtitles, chapters are copied), or the video alone."
    duplicates: Literal["keep", "fill"] = "keep"
    "Repeated pictures: keep, or fill (motion continues over them)."
    highlights: float = 1.0
    "Videos, 8-bit pictures: brightness of white in the blur, in multiples of white, 1 (off) to 32."
    codec: str | None = None
    "Codec of the video: h264, h265, av1, vp9, prores, ffv1; default: by the suffix of the name."
    quality: int | None = None
    "Constant quality on the encoder's scale: a smaller number is a better and larger video."
    encoder: Literal["nvenc", "qsv", "amf", "videotoolbox", "v4l2m2m"] | None = None
    "Hardware encoder; by default the encoding is done in software."

    @property
    def expansion(self) -> Expansion:
        """The change of light before the blur, which is taken back after it."""
        return Expansion(self.highlights)

    def check(self) -> None:
        """InputError for light and a pause that make no sense."""
        _ = self.expansion
        if not self.longest_pause > 0:
            raise InputError(f"`longest_pause` must be above 0 seconds, got {self.longest_pause:g}")

    @property
    def remark(self) -> str:
        """A line about an option without effect; or ''."""
        if self.pitch == "keep" or self.pace != 1:
            return ""
        return "`pitch` has no effect without `speed`"

    @property
    def pace(self) -> Fraction:
        """The speed, exactly."""
        try:
            found = Fraction(self.speed)
        except (ValueError, ZeroDivisionError):
            raise InputError(f"`speed` must be a number, got {self.speed!r}") from None
        if not Fraction(1, 100) <= found <= 100:
            raise InputError(f"`speed` must be 0.01 to 100, got {self.speed}")
        return found

    @property
    def range(self) -> tuple[Fraction | None, Fraction | None]:
        """Times to begin and to end at [s]."""
        begin, end = time_of("begin", self.begin), time_of("end", self.end)
        if begin is not None and end is not None and begin >= end:
            raise InputError(f"`end` must be after `begin`, got {self.begin} to {self.end}")
        return begin, end

    def clock(self, reader: VideoReader, frames: str | None, others: Collection[int] = ()) -> Clock:
        """The clock of the part that is asked for; InputError if there is no such part.

        `frames`: numbers of the video's pictures, such as 120-480. `others`: numbers of the streams
        that are written beside them: the first of all is at 0, however late the input's clock is.
        """
        start, (first, end) = reader.times[0], self.range
        first, end = (None if t is None else start + t for t in (first, end))
        if frames is not None:
            if self.begin or self.end:
                raise InputError("choose either `frames`, or `begin` and `end`")
            numbers = frame_numbers(frames)
            there = f"{reader.path} has pictures 0 to {len(reader) - 1}"
            if numbers != list(range(numbers[0], numbers[-1] + 1)):
                raise InputError(
                    f"frames of a video must be one ascending range such as 1-3, got {frames}"
                )
            if not 0 <= numbers[0] <= numbers[-1] < len(reader):
                raise InputError(f"frames {frames}: {there}")
            first = reader.times[numbers[0]]
            end = None if numbers[-1] + 1 == len(reader) else reader.times[numbers[-1] + 1]
        begin = reader.begin(others) if first is None else first
        return Clock(begin, self.pace, Fraction(0), first, end)


def time_of(name: str, text: str | None) -> Fraction | None:
    """`12.5`, `2:05` or `1:02:03.5` -> seconds, exactly."""
    if text is None:
        return None
    if not re.fullmatch(r"(\d{1,6}:){0,2}\d{1,9}(\.\d{1,9})?", text):
        raise InputError(f"`{name}` must be seconds, or like 1:02:03.5, got {text!r}")
    total = Fraction(0)
    for part in text.split(":"):
        total = 60 * total + Fraction(part)
    return total
