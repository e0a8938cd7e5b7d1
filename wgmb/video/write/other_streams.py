"""Streams of a video besides its pictures, copied beside other pictures.

Sound, subtitles, covers and attachments are copied packet for packet, with languages, titles and
dispositions; chapters and the file's own texts and dates come along. Streams that the new
container cannot hold are left out, and reported. Times go by a Clock; at another speed, sound is
encoded again.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import av
from av.audio.stream import AudioStream
from av.codec.codec import UnknownCodecError
from av.container import OutputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.stream import Discard, Disposition, Stream
from av.video.stream import VideoStream

from ...errors import counted
from ..clock import AS_IT_IS, Clock
from ..read.container import opened
from ..read.reader import PRIMING
from ..read.stream_text import stream_texts
from .audio import SoundAtSpeed, encoder
from .encoders import CONTAINERS, Encoding
from .texts import fitting
from .time_code import moved

if TYPE_CHECKING:
    from av.container.core import Chapter

_BEFORE = 20  # seconds before the part to copy, at which reading begins
_AFTER = 5  # seconds after it, at which reading ends
_OF_THE_FILE = (  # texts that say what another file holds
    "DURATION", "BPS", "NUMBER_OF_", "_STATISTICS", "HANDLER_NAME", "VENDOR_ID", "ENCODER",
)  # fmt: skip
_OWN = ("language", "title", "creation_time", "stereo_mode")  # texts of a stream of pictures
_TIME_CODE = "time code"
_WITH_CODE = ("mov", "mp4", "matroska")


class OtherStreams:
    """The streams of the file `path` but the one with number `pictures`.

    Use: `attach` to the new file before its first packet, then `until` the time of each picture
    that is written, then `rest`, then `close`. `keeps_pitch`: of sound at another speed.
    """

    def __init__(
        self, path: Path, pictures: int, clock: Clock = AS_IT_IS, keeps_pitch: bool = True
    ):
        self._path, self._pictures, self._clock = path, pictures, clock
        self._keeps_pitch = keeps_pitch
        self._container = opened(path, is_known=True)
        self._ways: dict[int, _Copied | SoundAtSpeed] = {}
        self._packets: Iterator[Packet[Any]] = iter(())
        self._next: Packet[Any] | None = None
        texts = self._container.metadata
        self._texts = {key: text for key, text in texts.items() if key.lower() != "timecode"}
        self._kinds = {n: text.kind for n, text in stream_texts(self._container).items()}

    @property
    def metadata(self) -> dict[str, str]:
        """Texts of the whole file: title, dates, places, the user's comment."""
        return self._texts

    def attach(self, to: OutputContainer) -> list[str]:
        """Add the streams and chapters; return the losses, in words."""
        said: list[str] = []
        unknown: list[int] = []
        for stream in self._container.streams:
            if stream.index == self._pictures:
                said += self._describe_pictures(cast(VideoStream, stream), to)
                stream.discard = Discard.all  # it is read elsewhere
                continue
            if self._is_of_chapters(stream):
                stream.discard = Discard.all
                continue
            if stream.type == "data" and stream.codec_context is None:
                if self._kinds.get(stream.index) != _TIME_CODE:  # a text of the pictures
                    unknown.append(stream.index)
                stream.discard = Discard.all
                continue
            why = self._why_not(stream) or self._add(stream, to)
            if why:
                stream.discard = Discard.all
                said.append(f"{_named(stream)} is left out: {why}")
        if unknown:
            said.append(_left_out(unknown, self._kinds))
        chapters = list(_moved(self._container.chapters(), self._clock))
        if chapters and to.format.name == "gif":
            are = "are" if len(chapters) > 1 else "is"
            said.append(f"{counted(len(chapters), 'chapter')} {are} left out: a GIF holds none")
        elif chapters:
            to.set_chapters(chapters)
        if self._clock.first is not None and self._clock.first > _BEFORE:
            self._container.seek(int((self._clock.first - _BEFORE) * 1_000_000))
        wanted = [self._container.streams[index] for index in self._ways]
        self._packets = self._container.demux(wanted) if wanted else iter(())
        self._next = self._following()
        return said

    def losses(self, encoding: Encoding, rate: Fraction) -> list[str]:
        """Streams, chapters and texts that a file cannot hold, in words; nothing is written."""
        trial = av.open(io.BytesIO(), "w", format=encoding.container)
        try:
            trial.add_stream(encoding.encoder.name, rate=rate)
            return [*fitting(encoding.suffix, self.metadata)[2], *self.attach(trial)]
        finally:
            with contextlib.suppress(FFmpegError, OSError, ValueError):
                trial.close()
            self.close()

    def _is_of_chapters(self, stream: Stream) -> bool:
        """Return True for the track in which MP4 and MOV keep chapters."""
        chapters = len(self._container.chapters())
        is_text = self._kinds.get(stream.index) == "text"
        return stream.type == "data" and chapters > 0 and (is_text or stream.frames == chapters)

    def _describe_pictures(self, stream: VideoStream, to: OutputContainer) -> list[str]:
        """Give the new pictures the texts of the old ones; return the losses, in words."""
        into = to.streams.video[0]
        texts = {key.lower(): text for key, text in stream.metadata.items()}
        into.metadata.update({key: texts[key] for key in _OWN if key in texts})
        whole = {key.lower(): text for key, text in self._container.metadata.items()}
        code = texts.get("timecode") or whole.get("timecode", "")
        if not code:
            return []
        begin = (stream.start_time or 0) * (stream.time_base or Fraction(0))
        by = (self._clock.first or begin) - begin
        rate, to_rate, kind = stream.average_rate, into.average_rate, to.format.name
        if kind == "matroska":  # there it is a text; elsewhere FFmpeg needs the rate
            to_rate = to_rate or 1 / (into.time_base or Fraction(1))
        if rate and to_rate and self._clock.speed == 1 and kind in _WITH_CODE:
            into.metadata["timecode"] = moved(code, rate, max(by, Fraction(0)), to_rate)
            return []
        return [f"its time code ({code}) is not kept"]

    def _why_not(self, stream: Stream) -> str:
        """The reason why a stream cannot be copied, or ''."""
        if stream.type == "video" and not _is_cover(stream):
            return "only one stream of pictures is written"
        if stream.type in ("audio", "subtitle") and stream.codec_context is None:
            return "its codec is not known"
        return ""

    def _add(self, stream: Stream, to: OutputContainer) -> str:
        """Add a stream to the new file; returns why it cannot be, or ''."""
        again = isinstance(stream, AudioStream) and self._clock.speed != 1
        if why := _refusal(stream, to.format.name, again, self._path):
            return why
        if _is_cover(stream) and to.format.name == "matroska":
            self._attach_cover(stream, to)
            return ""
        if again:
            source = cast(AudioStream, stream)
            into = encoder(source, to)
            _describe(into, stream)
            self._ways[stream.index] = SoundAtSpeed(source, into, self._clock, self._keeps_pitch)
            return ""
        made = _from_template(stream, to)
        _describe(made, stream)
        if stream.type != "attachment":
            self._ways[stream.index] = _Copied(stream, made, self._clock)
        return ""

    def _attach_cover(self, stream: Stream, to: OutputContainer) -> None:
        """Add a cover as a file, as Matroska keeps it: a stream would be another video there."""
        assert stream.codec_context is not None
        with opened(self._path, is_known=True) as container:
            packets = container.demux(container.streams[stream.index])
            data = next((bytes(packet) for packet in packets if packet.size), b"")
        codec = stream.codec_context.name
        kind, ending = ("jpeg", "jpg") if codec == "mjpeg" else (codec, codec)
        name = stream.metadata.get("filename", f"cover.{ending}")
        to.add_attachment(name, stream.metadata.get("mimetype", f"image/{kind}"), data)
        stream.discard = Discard.all

    def until(self, time: Fraction) -> Iterator[Packet[Any]]:
        """The packets up to an output time, as far as they have not been returned yet."""
        yield from self._up_to(self._clock.back(time))

    def rest(self) -> Iterator[Packet[Any]]:
        """The packets that are left."""
        yield from self._up_to(None)
        for way in self._ways.values():
            yield from way.take(None)

    def _up_to(self, time: Fraction | None) -> Iterator[Packet[Any]]:
        while (packet := self._next) is not None:
            at = packet.dts if packet.dts is not None else packet.pts
            here = None if at is None else at * packet.time_base
            if here is not None and time is not None and here > time:
                return
            self._next = self._following()
            end = self._clock.end
            if here is not None and end is not None and here > end + _AFTER:
                self._next = None
            if packet.size:  # the last ones only flush decoders
                yield from self._ways[packet.stream_index].take(packet)

    def _following(self) -> Packet[Any] | None:
        try:
            return next(self._packets, None)
        except FFmpegError:  # said by the VideoReader of the same file
            return None

    def close(self) -> None:
        """Close the file that is read."""
        self._container.close()


class _Copied:
    """A stream whose packets are passed on as they are."""

    def __init__(self, source: Stream, into: Stream, clock: Clock):
        self._source, self._into, self._clock = source, into, clock
        self._last: int | None = None
        self._rate, self._frame = 0, 0
        if isinstance(source, AudioStream) and source.codec_context is not None:
            self._rate, self._frame = source.rate, source.codec_context.frame_size
        self._expected: int | None = None  # sample that the next packet of sound begins with

    def take(self, packet: Packet[Any] | None) -> Iterator[Packet[Any]]:
        """The packet with its output times, unless it is outside of the clock's part."""
        if packet is None:
            return
        packet.stream = self._into
        if _is_cover(self._source):
            packet.pts = packet.dts = 0
            yield packet
            return
        if packet.pts is None or _is_cut(packet) or not self._fits(packet):
            return
        self._time(packet)
        assert packet.dts is not None and packet.pts is not None
        if self._last is not None and packet.dts <= self._last:  # muxers take no time twice
            packet.dts = self._last + 1
            packet.pts = max(packet.pts, packet.dts)
        self._last = packet.dts
        yield packet

    def _time(self, packet: Packet[Any]) -> None:
        """Set the packet's output times."""
        assert packet.pts is not None
        base, shown = packet.time_base, packet.pts
        exact = self._clock.out(shown * base)
        if packet.duration:
            packet.duration = round(packet.duration / self._clock.speed)
        if self._rate and self._frame and base > Fraction(1, self._rate):
            # Times are coarser than samples: count samples, as long as that agrees.
            sample = round(exact * self._rate)
            if self._expected is not None and abs(sample - self._expected) <= base * self._rate:
                sample = self._expected
            self._expected = sample + self._frame
            packet.time_base, packet.duration = Fraction(1, self._rate), self._frame
            packet.pts = packet.dts = sample
            return
        packet.pts = round(exact / base)
        dts = packet.dts if packet.dts is not None else shown
        packet.dts = dts + packet.pts - shown if self._clock.speed == 1 else packet.pts

    def _fits(self, packet: Packet[Any]) -> bool:
        """Shorten a subtitle to the clock's part; return False if all of it is outside."""
        assert packet.pts is not None
        base, clock = packet.time_base, self._clock
        begins, until = packet.pts * base, (packet.pts + (packet.duration or 0)) * base
        if clock.end is not None and begins >= clock.end:
            return False
        if self._source.type != "subtitle":
            return clock.first is None or begins >= clock.first
        first = clock.start if clock.first is None else clock.first
        if begins < first and until <= first:
            return False
        until = until if clock.end is None else min(until, clock.end)
        if begins < first:
            begins, packet.pts, packet.dts = first, round(first / base), round(first / base)
        if packet.duration:
            packet.duration = round((until - begins) / base)
        return True


def _is_cover(stream: Stream) -> bool:
    return bool(stream.disposition & Disposition.attached_pic)


def _is_cut(packet: Packet[Any]) -> bool:
    """Return True for packets that an edit list leaves out, but not for priming packets."""
    assert packet.pts is not None
    return packet.is_discard and not PRIMING <= packet.pts * packet.time_base < 0


def _from_template(stream: Stream, to: OutputContainer) -> Stream:
    return to.add_stream_from_template(stream, opaque=True)


def _describe(stream: Stream, like: Stream) -> None:
    """Language, title, name, default and forced."""
    for key, text in like.metadata.items():
        if not key.upper().startswith(_OF_THE_FILE):
            stream.metadata[key] = text
    if "name" in like.metadata:  # what MP4 calls a title
        stream.metadata.setdefault("title", like.metadata["name"])
    stream.disposition = like.disposition


def sounds_in(path: Path, suffix: str, *, is_encoded: bool) -> list[int]:
    """The numbers of the streams of sound in a file that a container of that suffix holds.

    `is_encoded`: sound is encoded again, as at another speed.
    """
    kind = CONTAINERS[suffix]
    with opened(path, is_known=True) as container:
        streams = [s for s in container.streams.audio if s.codec_context is not None]
        return [s.index for s in streams if not _refusal(s, kind, is_encoded, path)]


def _refusal(stream: Stream, container: str, again: bool, path: Path) -> str:
    """Try a file with this stream alone; returns why it cannot be written, or ''.

    `path`: of the stream's file. Of sound that is copied, a packet is tried as well: what its
    header says may not fit.
    """
    trial = av.open(io.BytesIO(), "w", format=container)
    packet = _first_packet(path, stream.index) if stream.type == "audio" and not again else None
    try:
        if again:
            made: Stream = encoder(cast(AudioStream, stream), trial)
        else:
            made = _from_template(stream, trial)
            _describe(made, stream)
        trial.start_encoding()
        if packet is not None:
            packet.stream, packet.pts, packet.dts = made, 0, 0
            trial.mux_one(packet)
    except (ValueError, UnknownCodecError, FFmpegError, NotImplementedError):
        name = stream.codec_context.name if stream.codec_context is not None else stream.type
        holds = " (.mkv holds it)" if container != "matroska" else ""
        return f"{_SUFFIXES.get(container, container)} cannot hold {name}{holds}"
    finally:
        with contextlib.suppress(FFmpegError, OSError, ValueError):
            trial.close()
    return ""


def _first_packet(path: Path, number: int) -> Packet[Any] | None:
    """The first packet of a stream; None where it has none, or none can be read."""
    with opened(path, is_known=True) as container:
        packets = container.demux(container.streams[number])
        with contextlib.suppress(FFmpegError):
            return next((packet for packet in packets if packet.size), None)
    return None


_SUFFIXES = {"matroska": ".mkv", "mp4": ".mp4", "mov": ".mov", "webm": ".webm", "gif": ".gif"}


def _named(stream: Stream) -> str:
    kind = {"audio": "sound", "subtitle": "subtitles"}.get(stream.type or "", stream.type)
    kind = "cover" if _is_cover(stream) else kind
    language = stream.metadata.get("language", "und")
    text = f"stream {stream.index} ({kind}"
    return text + (f", {language})" if language != "und" else ")")


def _left_out(numbers: list[int], kinds: dict[int, str]) -> str:
    """That streams of data are left out, in words; phones and cameras write several."""
    named = {number: kinds.get(number) or "data of unknown kind" for number in numbers}
    together = ", ".join(
        f"{', '.join(str(n) for n in named if named[n] == kind)} ({kind})"
        for kind in dict.fromkeys(named.values())
    )
    several = len(numbers) > 1
    return f"stream{'s' if several else ''} {together} {'are' if several else 'is'} left out"


def _moved(chapters: list[Chapter], clock: Clock) -> Iterator[Chapter]:
    """The chapters within the clock's part, at output times."""
    for chapter in chapters:
        base = chapter["time_base"] or Fraction(1, 1000)
        begin, end = chapter["start"] * base, chapter["end"] * base
        begin = begin if clock.first is None else max(begin, clock.first)
        end = end if clock.end is None else min(end, clock.end)
        if begin < end:
            start, stop = (round(clock.out(time) / base) for time in (begin, end))
            yield {**chapter, "start": start, "end": stop, "time_base": base}
