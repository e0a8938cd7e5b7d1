"""Videos from a stream that cannot be sought: whatever FFmpeg reads so, such as Matroska."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO

import av
from av.container import InputContainer
from av.error import EOFError, FFmpegError
from av.sidedata.sidedata import Type
from av.video.reformatter import VideoReformatter

from ...color.coding import CodedPicture
from ...errors import InputError, counted
from ...io import limits, watch
from ..pixels import is_transparent, layout, planes_of
from ..write.encoders import Facts
from . import damage
from .color_tags import COLORS, assumed, either, tags_of
from .container import (
    READERS,
    bound_pictures,
    largest_picture,
    picture_stream,
)
from .rotation import rotation_of
from .side_data import light_level_of, mastering_of, side_data_of
from .stream_text import StreamText, cropped, stream_texts, whole_samples
from .timeline import known_rate

_JITTER = Fraction(1, 4)  # of an interval
_SELDOM, _FEW = 0.05, 2  # pictures of all, and at least, that may come at another time
_LACKS = Fraction(1, 10)  # seconds that a stream may be shorter than it states, and an interval


class StreamReader:
    """Reads the pictures of a video once. `name`: of the stream, for messages.

    `color`: a name in COLORS, instead of the tags of the stream. `keeps_time`: the times of the
    pictures count, and must be multiples of an interval; else each picture lasts one. `pause`:
    how long one may be missing [s]. InputError in one line for a stream that cannot be read so, and
    for pictures that would take more than `max_mb` megabytes each.
    """

    def __init__(
        self,
        stream: BinaryIO,
        name: str,
        color: str | None = None,
        max_mb: float = limits.MAX_MB,
        *,
        keeps_time: bool = True,
        pause: float = 600.0,
    ):
        self.name, self._keeps_time, self._pause = name, keeps_time, pause
        self.loss = ""
        """The loss, in words, once the stream has been read."""
        self._failed, self._uneven = 0, 0
        self._source = _Source(stream)
        try:
            self._container = watch.watched(name, self._opened, 0, max_mb)
        except (FFmpegError, UnicodeError, ValueError):
            self._source.check()
            raise InputError(f"{name}: {_what_is_wrong(self._source.beginning)}") from None
        bound_pictures(self._container, largest_picture(sys.maxsize, max_mb))
        self._stream = picture_stream(self._container, name)
        context = self._stream.codec_context
        self._check_size((context.width, context.height), max_mb)
        self._frames = self._decoded()
        first = next(self._frames, None)
        if first is None:
            raise InputError(f"{name}: none of its pictures can be decoded ({context.name})")
        self._first, self._by = first, VideoReformatter()
        found = layout(first.format.name, is_transparent(first))
        if found is None:
            raise InputError(f"{name}: pixels of kind {first.format.name} are not supported")
        if first.interlaced_frame:
            raise InputError(f"{name}: is interlaced, which a pipe cannot be; deinterlace it first:"
                             " `ffmpeg -vf bwdif`")  # fmt: skip
        side = side_data_of(first)
        self._layout, self._turn = found, rotation_of(side.get(Type.DISPLAYMATRIX), first.rotation)
        tags = either(tags_of(first), tags_of(context))
        if color:
            tags = (tags[0], *COLORS[color])
        coding, said = assumed(found, (first.width, first.height), context.name, tags)
        turned = coding.steps[::-1] if self._turn.swaps else coding.steps
        self.coding = replace(coding, steps=turned)
        texts, size = stream_texts(self._container), (first.width, first.height)
        crop = texts.get(self._stream.index, StreamText()).crop
        self._crop = left, right, top, bottom = whole_samples(crop, size, found.steps)
        across, down = first.width - left - right, first.height - top - bottom
        self.size = (down, across) if self._turn.swaps else (across, down)
        self.rate = known_rate(self._stream.average_rate) or self._stream.guessed_rate
        """Pictures a second, as stated or found at the beginning; None if it is not known."""
        aspect = self._stream.sample_aspect_ratio or Fraction(1)
        self.facts = Facts(
            1 / aspect if self._turn.swaps else aspect,
            mastering_of(side),
            light_level_of(side),
            side.get(Type.SPHERICAL),
            side.get(Type.STEREO3D),
        )
        self.notes = [
            f"does not state its colours: {', '.join(said)} assumed; `color_in` sets others"
        ] if said else []  # fmt: skip
        others = [s.type or "data" for s in self._container.streams if s is not self._stream]
        if others:
            self.notes.append(only_pictures(others))

    def _opened(self) -> InputContainer:
        return av.open(
            self._source,
            "r",
            container_options={"protocol_whitelist": "pipe", "format_whitelist": READERS},
            metadata_errors="replace",
        )

    def _check_size(self, size: tuple[int, int], max_mb: float) -> None:
        if not 0 < min(size) <= max(size) <= limits.MOST_PIXELS_A_SIDE:
            raise InputError(f"{self.name}: pictures of {size[0]} x {size[1]}, expected 1 to "
                             f"{limits.MOST_PIXELS_A_SIDE} pixels a side")  # fmt: skip
        promised = limits.unpacked(size, limits.AVERAGED)
        limits.check(Path(self.name), f"{size[0]} x {size[1]}", promised, promised, max_mb)

    def pictures(self) -> Iterator[tuple[int, CodedPicture]]:
        """The pictures and their places in time, in intervals from the first on.

        Those that are lost leave their places free; `loss` tells at the end.
        """
        number, damaged, frame = 0, 0, self._first
        while frame is not None:
            damaged += damage.is_damaged(frame)
            if (frame.width, frame.height) != (self._first.width, self._first.height):
                raise InputError(
                    f"{self.name}: picture {number} is {frame.width} x {frame.height}, "
                    f"the first one {self._first.width} x {self._first.height}"
                )
            planes = planes_of(frame, self._layout, self._by)
            planes = cropped(planes, self._crop, self._layout.steps)
            yield number, CodedPicture(tuple(map(self._turn, planes)), self.coding)
            following = next(self._frames, None)
            number += self._steps(frame, following, number)
            frame = following
        lost = [f"{counted(self._failed, 'picture')} not decoded"] if self._failed else []
        lost += [counted(damaged, "damaged picture")] if damaged else []
        lost += [self.loss] if self.loss else []
        self.loss = f"{self.name}: {', '.join(lost)}" if lost else ""

    def _steps(self, frame: av.VideoFrame, following: av.VideoFrame | None, number: int) -> int:
        """Intervals from a picture to the following one."""
        if following is None or not self._keeps_time or not self.rate:
            return 1
        if frame.pts is None or following.pts is None:
            return 1
        base = self._stream.time_base or Fraction(0)
        passed = (following.pts - frame.pts) * base
        steps = max(int(passed * self.rate + _JITTER), 1)
        off = abs(passed - steps / self.rate)
        if passed < -2 / self.rate:
            raise InputError(
                f"{self.name}: its clock goes back by {float(-passed):.2f} s after picture {number}"
            )
        if passed > self._pause:
            raise InputError(
                f"{self.name}: nothing for {float(passed):.0f} s after picture {number}; "
                f"`longest_pause={-(-passed // 1)}` allows it"
            )
        self._uneven += off > max(_JITTER / self.rate, base)
        if self._uneven > max(_FEW, _SELDOM * number):
            raise InputError(
                f"{self.name}: picture {number + 1} follows after {1000 * float(passed):.1f} ms, at"
                f" {float(self.rate):g} pictures a second: a pipe needs a steady rate; "
                "`ffmpeg -vf fps=60` makes one, `fps_in` leaves the times out"
            )
        return steps

    def _decoded(self) -> Iterator[av.VideoFrame]:
        """The frames in order; those that cannot be decoded are left out, and counted."""
        packets = damage.marked(self._container.demux(self._stream), self._stream.codec_context)
        end = Fraction(0)
        while True:
            try:
                packet = next(packets, None)
            except FFmpegError as error:
                self.loss = f"is damaged: {str(error.strerror or error).lower()}"
                packet = None
            self._source.check()
            if packet is not None and not packet.size:
                continue
            if packet is not None and packet.pts is not None and packet.time_base:
                end = max(end, (packet.pts + (packet.duration or 0)) * packet.time_base)
            try:
                yield from self._stream.decode(packet)
            except EOFError:
                break
            except FFmpegError:
                self._failed += 1
            if packet is None:
                break
        lacks = _stated(self._container) - end
        if lacks > _LACKS and not self.loss:
            self.loss = f"is cut off: it ends at {float(end):.2f} s of {float(end + lacks):.2f} s"


def only_pictures(kinds: Iterable[str]) -> str:
    """A line on the other streams of a video, which no pipe carries here."""
    return f"only its pictures go through a pipe; left out: {', '.join(dict.fromkeys(kinds))}"


class _Source:
    """A stream as FFmpeg reads it; FFmpeg cannot pass on exceptions."""

    def __init__(self, stream: BinaryIO):
        self._stream = stream
        self.beginning = b""
        self.seek, self.tell, self.seekable = stream.seek, stream.tell, stream.seekable
        self._raised: BaseException | None = None

    def read(self, count: int) -> bytes:
        """At most `count` bytes; none at the end."""
        try:
            data = self._stream.read(count)
        except BaseException as error:
            self._raised = error
            return b""
        self.beginning = self.beginning or data
        return data

    def check(self) -> None:
        """Raise the exception that was raised while it was read."""
        if self._raised is not None:
            raise self._raised


def _stated(container: InputContainer) -> Fraction:
    """Duration that the header of a format that has one states [s]."""
    if container.duration is None or not container.format.name.startswith(("matroska", "flv")):
        return Fraction(0)
    return Fraction(container.duration, 1_000_000)


def _what_is_wrong(beginning: bytes) -> str:
    if beginning[4:8] in (b"ftyp", b"wide", b"mdat"):
        return (
            "is an MP4 or MOV whose index comes last, which a pipe cannot go back for: name the "
            "file, or write it with `ffmpeg -movflags frag_keyframe+empty_moov`"
        )
    return "is not a video that can be read from a pipe, or its beginning is damaged"
