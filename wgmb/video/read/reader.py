"""Videos as pictures with times: any file that FFmpeg decodes.

A video is read forwards once, from the key frame before the first picture asked for. Pictures come
as they are stored (color/coding.py), upright and without interlacing. Colours are not converted.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.audio.stream import AudioStream
from av.sidedata.sidedata import Type
from av.stream import Stream
from av.video.reformatter import VideoReformatter
from av.video.stream import VideoStream

from ...color.coding import CodedPicture
from ...errors import InputError, counted
from ...io import limits, watch
from ...threads import apart
from ..hdr10 import is_base_layer
from ..pixels import (
    THREADS,
    PlaneLayout,
    is_transparent,
    layout,
    planes_of,
)
from ..write.encoders import Facts
from . import damage
from .color_tags import assumed, either, tags_of
from .container import has_alpha_beside, opened, picture_stream, size_of
from .decoder import REORDERED, Decoder, decoded
from .deinterlace import Deinterlaced
from .matroska import has_ordered_chapters
from .rotation import rotation_of
from .side_data import SideData, light_level_of, mastering_of, side_data_of
from .stream_text import StreamText, cropped, stream_texts, whole_samples
from .timeline import Times, scanned

PRIMING = Fraction(-1, 10)  # seconds before 0, in which decoders of sound begin
_OF_FILM = Fraction(30_000, 1001)  # frames a second of television to which film is spread (2:3)
_PACE = 1 << 20  # bytes of a file whose packets are listed in a second of the processor, at least
_OF_FIELDS = (2, 3, 4, 5)  # field orders: two fields a frame

_NOT_KEPT = {
    Type.DYNAMIC_HDR_PLUS: "HDR10+ data is",
    Type.DYNAMIC_HDR_VIVID: "HDR Vivid data is",
    Type.A53_CC: "closed captions in its pictures (CEA-608, CEA-708) are",
    Type.AFD: "its active format description (AFD) is",
    Type.S12M_TIMECODE: "time codes in its pictures (SMPTE 12M) are",
    Type.ICC_PROFILE: "its colour profile (ICC) is not used, and",
    Type.AMBIENT_VIEWING_ENVIRONMENT: "its ambient viewing environment is",
}


@dataclass(frozen=True)
class OtherStream:
    """A stream of sound, subtitles, attachments or data."""

    index: int
    kind: str
    """audio, subtitle, attachment, data; video for covers and further pictures."""
    codec: str
    language: str
    title: str
    text: str
    """Its kind in words, such as "aac, 48000 Hz, stereo"."""


class VideoReader:
    """A video file.

    Pictures have numbers from 0 on and are at `times` [s], on the clock that the file's streams
    share. `rate`: pictures a second, usually; `is_variable` if the times keep no steady rate.
    `size` [px] is that of upright pictures. `assumed`: colour tags that the file lacks,
    and the values assumed. `notes`: lines that a user should know. Numbers of the pictures,
    of those asked for so far, that could not be decoded are `missing`; that the decoder mended,
    `damaged`; that had another size, `scaled`. `index`: of their stream in the file.

    InputError in one line for a file that cannot be read, that has no pictures, or whose pictures
    would take more than `max_mb` megabytes each (see limits.py).
    """

    def __init__(self, path: str | Path, *, max_mb: float = limits.MAX_MB):
        self.path = Path(path)
        self.missing: set[int] = set()
        self.damaged: set[int] = set()
        self.scaled: set[int] = set()
        self._is_at_end = False
        self.notes: list[str] = []
        self._max_mb = max_mb
        watch.watched(self.path, self._read_packets, size_of(self.path), max_mb, _PACE)
        if not len(self._packets.times):
            raise InputError(f"{self.path}: {self._packets.problem or 'holds no pictures'}")
        if self._packets.goes_back is not None:
            number, before, after = self._packets.goes_back
            raise InputError(
                f"{self.path}: its clock goes back before picture {number}, from "
                f"{float(before):.2f} to {float(after):.2f} s; `ffmpeg -i IN -c copy OUT.mkv` "
                "puts its parts one after the other"
            )
        apart(self._probe)

    def _read_packets(self) -> None:
        """Read the tags of the file, and the times of its packets.

        The thread that opens the file also closes it: it may be left while FFmpeg reads.
        """
        with opened(self.path, self._max_mb) as container:
            stream = picture_stream(container, self.path)
            self.index = stream.index
            self._check_size(stream)
            self.container = container.format.name
            self.codec = stream.codec_context.codec.canonical_name  # not that of the decoder
            self.chapters = len(container.chapters())
            texts = stream_texts(container)
            self._crop = texts.get(stream.index, StreamText()).crop
            self.streams = tuple(
                _described(s, texts.get(s.index, StreamText()).kind)
                for s in container.streams
                if s is not stream
            )
            self._tagged = tags_of(stream.codec_context)
            self._field_order = stream.codec_context.field_order
            self._pixel_aspect = stream.sample_aspect_ratio or Fraction(1)
            if stream.metadata.get("alpha_mode") == "1":
                self.notes.append("its transparency (VP8 or VP9 alpha) is not read")
            if has_alpha_beside(container, stream):
                self.notes.append("its transparency (a stream of its own, in AVIF) is not read")
            if self.chapters and has_ordered_chapters(self.path):
                self.notes.append(
                    "its chapters are ordered: players may skip or repeat parts, or take some from "
                    "other files; all of this file is taken once, from beginning to end"
                )
            self._packets = scanned(container, stream, self.path)

    def _check_size(self, stream: VideoStream) -> None:
        width, height = stream.codec_context.width, stream.codec_context.height
        if not (width and height) and stream.codec_context.name == "webp":
            raise InputError(f"{self.path}: animated WebP is not read; GIF, APNG and AVIF are")
        stored = self.path.stat().st_size
        if not (width and height):  # FFmpeg forgets sizes over its limit
            most = limits.most_pixels(stored, limits.AVERAGED, self._max_mb)
            raise InputError(
                f"{self.path}: the size of its pictures cannot be read: the file is cut off, or "
                f"they have over {most:,} pixels, too many for a file of {stored:,} bytes; "
                f"`max_mb={2 * self._max_mb:g}` allows twice as many"
            )
        if not 0 < min(width, height) <= max(width, height) <= limits.MOST_PIXELS_A_SIDE:
            raise InputError(
                f"{self.path}: pictures of {width} x {height}, expected 1 to "
                f"{limits.MOST_PIXELS_A_SIDE} pixels a side"
            )
        promised = limits.unpacked((width, height), limits.AVERAGED)
        limits.check(self.path, f"{width} x {height}", promised, stored, self._max_mb)

    def _probe(self) -> None:
        """Decode one picture: its own tags count more than those of the header."""
        if self._packets.is_encrypted:  # some of its noise may be taken for pictures
            raise InputError(f"{self.path}: is encrypted")
        with opened(self.path, self._max_mb, is_known=True) as container:
            stream = cast(VideoStream, container.streams[self.index])
            frames = decoded(container, stream)
            frame = next(frames, None)
            if (whole := self._packets.counted) is not None:
                shown = [one.pts for one in islice(frames, REORDERED) if one.pts is not None]
                if shown != sorted(shown):  # as in VC-1 and RealVideo: times of decoding
                    self._packets = whole
        if frame is None:
            raise InputError(f"{self.path}: none of its pictures can be decoded ({self.codec})")
        self.pixels = frame.format.name
        found = layout(self.pixels, is_transparent(frame))
        if found is None:
            raise InputError(f"{self.path}: pixels of kind {self.pixels} are not supported")
        self._layout: PlaneLayout = found
        self._frame_size = frame.width, frame.height
        self._crop = whole_samples(self._crop, self._frame_size, found.steps)
        side = side_data_of(frame)
        self._turn = rotation_of(side.get(Type.DISPLAYMATRIX), frame.rotation)
        self.mastering, self.light_level = mastering_of(side), light_level_of(side)
        self.projection, self.stereo = side.get(Type.SPHERICAL), side.get(Type.STEREO3D)
        tags = either(tags_of(frame), self._tagged)
        coding, self.assumed = assumed(found, self._frame_size, self.codec, tags)
        turned = coding.steps[::-1] if self._turn.swaps else coding.steps
        self.coding = replace(coding, steps=turned)
        self.is_interlaced = frame.interlaced_frame or self._field_order in _OF_FIELDS
        if not self._packets.in_order and frame.pts is not None:
            first = int(np.searchsorted(self._packets.times.ticks, frame.pts))
            if 0 < first < len(self._packets.times):
                self._packets = self._packets.from_picture(first)
                lost = counted(first, "picture")
                self.notes.append(f"left out at its beginning: {lost}, not decodable alone")
        self._decoder = Decoder(self.path, self.index, self._packets, self._max_mb)
        self._timeline = self._packets.doubled() if self.is_interlaced else self._packets
        self._note(side)

    def _note(self, side: SideData) -> None:
        if self.assumed:
            self.notes.append(f"does not state its colours: {', '.join(self.assumed)} assumed")
        if self.is_interlaced:
            film = self._packets.rate == _OF_FILM
            self.notes.append(
                f"interlaced: each of its {len(self._packets.times)} frames is taken as two "
                f"pictures ({float(self.rate):g} a second)"
                + ("; if it was made of film, `ffmpeg -i IN -vf fieldmatch,decimate OUT` undoes "
                   "that first" if film else "")
            )  # fmt: skip
        if many := len(self._packets.repeated):
            at = float(int(self._packets.repeated[0]) * self._packets.times.base)
            have = "picture has" if many == 1 else "pictures have"
            self.notes.append(
                f"{many} {have} the time of another, the first at {at:.2f} s: left out"
            )
        if slowed := self._packets.slowed:
            are = "is" if slowed == 1 else "are"
            self.notes.append(
                f"{counted(slowed, 'picture')} with a delay under 0.02 s {are} shown for 0.1 s, as "
                "in browsers"
            )
        if self._packets.is_assumed:
            self.notes.append(f"does not say when its pictures are shown: {float(self.rate):g} a "
                              "second assumed")  # fmt: skip
        if not is_base_layer(side.get(Type.DOVI_METADATA, b"")):
            self.notes.append(
                "is Dolby Vision without a base layer (profile 5): its colours come out wrong"
            )
        elif Type.DOVI_METADATA in side or Type.DOVI_RPU_BUFFER in side:
            self.notes.append("Dolby Vision data is not used: pictures are those of its base layer")
        self.notes += [f"{text} not kept" for kind, text in _NOT_KEPT.items() if kind in side]
        if self._turn.odd:
            self.notes.append("its rotation is no multiple of 90 degrees, and is left out")
        if self._packets.lacks:
            end, whole = (float(self._packets.end + more) for more in (0, self._packets.lacks))
            self.notes.append(f"is cut off: it ends at {end:.2f} s of {whole:.2f} s")
        elif gaps := self._packets.gaps:
            at, longest = gaps[0], max(length for _, length in gaps)
            often = "once" if len(gaps) == 1 else f"{len(gaps)} times"
            self.notes.append(
                f"its pictures, steady elsewhere, pause {often} for up to {longest:.2f} s, "
                f"first at {at[0]:.2f} s: perhaps some were lost"
            )
        if self._packets.problem:
            at = float(self._packets.end)
            self.notes.append(f"is damaged after {at:.2f} s: {self._packets.problem.lower()}")

    @property
    def times(self) -> Times:
        """Times of the pictures [s]: ascending Fractions."""
        return self._timeline.times

    @property
    def exact_times(self) -> Sequence[Fraction]:
        """The times [s], those of the rate where the file rounds that to its ticks."""
        return self._timeline.exact

    @property
    def rate(self) -> Fraction:
        """Pictures a second, without gaps and hitches; a known rate if within 0.1 % of one."""
        return self._timeline.rate

    @property
    def steps(self) -> tuple[float, float]:
        """Shortest and longest time from a picture to the next [s]."""
        steps = self._timeline.steps
        base = float(self.times.base)
        return (float(steps.min()) * base, float(steps.max()) * base) if len(steps) else (0.0, 0.0)

    @property
    def is_variable(self) -> bool:
        """Return True if the pictures keep no steady rate."""
        return self._timeline.is_variable

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Begin and length of the pauses of a rate that is steady elsewhere [s]."""
        return self._timeline.gaps

    @property
    def has_rate(self) -> bool:
        """Return True if the steps are alike to a quarter, apart from a few pauses."""
        return self._timeline.has_rate

    @property
    def duration(self) -> Fraction:
        """From the first picture to the end of the last one [s]."""
        return self.until - self.times[0]

    @property
    def until(self) -> Fraction:
        """The end of the last picture [s]."""
        return self._timeline.until

    def begin(self, others: Collection[int] = ()) -> Fraction:
        """The time of the first picture [s], or of those `others` of its streams that begin before.

        Priming samples of a decoder of sound, shortly before 0, are no sound.
        """
        begins = [self._packets.begins.get(number, self.times[0]) for number in others]
        return min([self.times[0], *(max(t, Fraction(0)) if t >= PRIMING else t for t in begins)])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of upright pictures [px]."""
        left, right, top, bottom = self._crop
        width, height = self._frame_size[0] - left - right, self._frame_size[1] - top - bottom
        return (height, width) if self._turn.swaps else (width, height)

    @property
    def pixel_aspect(self) -> Fraction:
        """Width of an upright pixel to its height."""
        return 1 / self._pixel_aspect if self._turn.swaps else self._pixel_aspect

    @property
    def tolerance(self) -> float:
        """By how much times of its pictures may be rounded [s]: a tick, if that is short."""
        tick = self.times.base
        return float(tick) if 4 * tick * self.rate <= 1 else 0.0

    @property
    def facts(self) -> Facts:
        """Facts about the pictures besides their coding."""
        return Facts(
            self.pixel_aspect, self.mastering, self.light_level, self.projection, self.stereo
        )

    @property
    def rotation(self) -> int:
        """Degrees by which pictures are turned clockwise to be upright."""
        return self._turn.degrees

    def loss(self) -> str:
        """Requested pictures that could not be read, in one line; '' if there are none."""
        said = []
        if self.missing:
            at, all_ = float(self.times[min(self.missing)]), len(self.times)
            text = f"{len(self.missing)} of {all_} pictures could not be decoded"
            said.append(f"{text}, the first at {at:.2f} s")
        if self.damaged:
            at = float(self.times[min(self.damaged)])
            said.append(f"{counted(len(self.damaged), 'damaged picture')}, the first at {at:.2f} s")
        if self._packets.lacks and self._is_at_end:
            count, at = round(self._packets.lacks * self.rate), float(self._packets.end)
            lost = counted(count, "picture")
            said.append(f"cut off after {at:.2f} s, about {lost} before its end")
        return f"{self.path}: {'; '.join(said)}" if said else ""

    def scaling(self) -> str:
        """Requested pictures that were scaled, in one line; '' if there are none."""
        if not self.scaled:
            return ""
        at, size = float(self.times[min(self.scaled)]), "{} x {}".format(*self.size)
        what = counted(len(self.scaled), "picture")
        return f"{what} of another size scaled to {size}, from {at:.2f} s"

    def __len__(self) -> int:
        return len(self.times)

    def __iter__(self) -> Iterator[tuple[int, CodedPicture]]:
        return self.pictures()

    def pictures(
        self, first: int = 0, last: int | None = None
    ) -> Iterator[tuple[int, CodedPicture]]:
        """The pictures from number `first` to `last`, both included, each with its number.

        Those that cannot be decoded are left out, and listed in `missing`.
        """
        last = len(self) - 1 if last is None else min(last, len(self) - 1)
        first = max(first, 0)
        expected, by = first, VideoReformatter()
        for number, frame in self._from(first):
            if number < expected:
                continue
            self.missing.update(range(expected, min(number, last + 1)))
            if number > last:
                expected = number
                break
            if damage.is_damaged(frame):
                self.damaged.add(number)
            expected = number + 1
            self._is_at_end |= expected == len(self)
            planes = planes_of(self._fitted(frame, number, by), self._layout, by)
            planes = cropped(planes, self._crop, self._layout.steps)
            yield number, CodedPicture(tuple(map(self._turn, planes)), self.coding)
            if number == last:
                break
        self.missing.update(range(expected, last + 1))
        self._is_at_end |= last + 1 == len(self)

    def _fitted(self, frame: av.VideoFrame, number: int, by: VideoReformatter) -> av.VideoFrame:
        """The frame in the size of the first one."""
        if (frame.width, frame.height) == self._frame_size:
            return frame
        self.scaled.add(number)
        pixels, size = frame.format.name, self._frame_size
        return by.reformat(frame, *size, format=pixels, interpolation="BICUBIC", threads=THREADS)

    def _from(self, first: int) -> Iterator[tuple[int, av.VideoFrame]]:
        """Frames with their numbers, in order, beginning at or before `first`."""
        if not self.is_interlaced:
            yield from self._decoder.frames(first)
            return
        before = max(first // 2 - 2, 0)  # what bwdif looks back on
        fields = Deinterlaced(self._frame_size, self.pixels, self._packets.times.base)
        by = VideoReformatter()
        for number, frame in self._decoder.frames(before):
            if number >= before:
                yield from fields.of(self._fitted(frame, 2 * number, by), number)
        yield from fields.of(None)


def _described(stream: Stream, kind: str) -> OtherStream:
    context = stream.codec_context
    codec = context.name if context is not None else kind or "unknown"
    text = codec
    if isinstance(stream, AudioStream) and context is not None:
        text += f", {stream.rate} Hz, {stream.layout.name}"
    meta = stream.metadata
    return OtherStream(
        stream.index,
        stream.type or "unknown",
        codec,
        meta.get("language", ""),
        meta.get("title", "") or meta.get("filename", ""),
        text,
    )
