"""A video file being written: under a temporary name, then complete under its own, or absent."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
from av.container import OutputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.video.codeccontext import VideoCodecContext
from av.video.stream import VideoStream

from ...color.coding import Coding
from ...errors import InputError
from ...io import atomic, record_block
from ...io import record as records
from ..pixels import buffer
from ..read.color_tags import RANGES
from . import views
from .encoders import CONTAINERS, HARDWARE, Encoding
from .format import VideoFormat
from .texts import fitting

_FEW = 2  # frames: x265 states no decoding times for so few
# No checksum of the texts, which the seal changes; no random number as the file's name.
_MATROSKA = {"write_crc32": "0", "fflags": "+bitexact"}
_MUXING = {"matroska": _MATROSKA, "webm": _MATROSKA, "mp4": {"strict": "unofficial"}}  # 360 degrees


class NewFile:
    """A file of some container. Until `close` there is nothing at `path`.

    `metadata`: texts of the whole file; those that it cannot hold are in `left_out`. `record`:
    see io/record.py; it gets its seal if the file `is_complete`. `mode`: see atomic.mode_of.
    `is_new`, which may be set: no file of another process is replaced. OSError, whose text names
    `path`, if it cannot be written.
    """

    def __init__(
        self,
        path: Path,
        temporary: Path,
        suffix: str,
        metadata: dict[str, str],
        record: str = "",
        mode: int = atomic.PUBLIC,
    ):
        self.path, self.temporary = path, temporary
        self.is_new, self.is_complete = False, True
        self.has_views = False  # two in each picture, or a projection
        self._record = record
        self._texts, options, self.left_out = fitting(suffix, metadata)
        self._container: OutputContainer | None = None
        self._lock: int | None = None
        try:
            self._lock = atomic.create(temporary, mode)  # its own file
            kind = CONTAINERS[suffix]
            options = options | _MUXING.get(kind, {})
            self._container = av.open(
                _Disk(self._lock), "w", format=kind, container_options=options
            )
        except (FFmpegError, OSError) as error:
            self.abandon()
            raise atomic.about(path, error) from None
        self._container.metadata.update(self._texts)

    @property
    def container(self) -> OutputContainer:
        """FFmpeg's container, to which streams are added before the first packet."""
        assert self._container is not None
        return self._container

    def mux(self, packets: Iterable[Packet[Any]]) -> None:
        """Write packets."""
        try:
            for packet in packets:
                self.container.mux_one(packet)
        except (FFmpegError, OSError) as error:
            raise atomic.about(self.path, error) from None

    def close(self) -> None:
        """Complete the file and put it in place."""
        try:
            if self._container is not None:
                self._container.close()
                self._container = None
            if self.has_views and self.path.suffix.lower() == ".mp4":
                views.leave_one_form(self.temporary)
            self._add_texts()
            if self._lock is not None:
                os.fsync(self._lock)
            atomic.rename(self.temporary, self.path, is_new=self.is_new)
        except (FFmpegError, OSError) as error:
            self.abandon()
            raise atomic.about(self.path, error) from None
        self._unlock()

    def _add_texts(self) -> None:
        """Add parts that FFmpeg does not write to the whole file: a GIF's comment, the record."""
        if self.path.suffix.lower() == ".gif":
            for text in self._texts.values():
                record_block.comment(self.temporary, text)
        if self._record:
            records.put_into(self.temporary, self._record, is_complete=self.is_complete)

    def _unlock(self) -> None:
        if self._lock is not None:
            lock, self._lock = self._lock, None
            os.close(lock)

    def abandon(self) -> None:
        """Leave nothing behind."""
        if self._container is not None:
            container, self._container = self._container, None
            with contextlib.suppress(OSError, ValueError, FFmpegError):  # say, a full disk
                container.close()
        if self._lock is not None:
            self._unlock()
            atomic.remove(self.temporary)


class _Disk:
    """A file that FFmpeg writes through Python, which lets other threads run meanwhile.

    Writing by itself, it keeps Python's lock: no signal is heard while a disk does not answer.
    """

    name = "file"

    def __init__(self, descriptor: int):
        self._descriptor = descriptor

    def write(self, data: bytes) -> int:
        """Write all of it."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._descriptor, rest) :]
        return len(data)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place; returns it."""
        return os.lseek(self._descriptor, offset, whence)

    def tell(self) -> int:
        """Return the place."""
        return self.seek(0, os.SEEK_CUR)


class VideoFile(NewFile):
    """A video with one stream of pictures, encoded here, and others beside it.

    Frames are given with exact times, in ticks of the format's `base`. InputError for an encoder
    that does not start.
    """

    def __init__(
        self,
        path: Path,
        temporary: Path,
        format: VideoFormat,
        metadata: dict[str, str] | None = None,
        record: str = "",
        mode: int = atomic.PUBLIC,
    ):
        super().__init__(path, temporary, format.encoding.suffix, metadata or {}, record, mode)
        self.has_views = views.are_stated(format.facts)
        self._base, self._rate, self._packets = format.base, format.rate, 0
        self._late_times = format.encoding.encoder.name == "libx265"
        try:
            self._pictures = PictureStream(self.container, format)
        except (FFmpegError, OSError) as error:
            self.abandon()
            raise _why(path, format.encoding, error) from None

    def encode(self, frame: av.VideoFrame | None, tick: int = 0) -> None:
        """Encode `frame`, of the encoder's format, and write the packets that are ready."""
        if frame is not None:
            frame.pts, frame.time_base = tick, self._base
            self._packets += 1
        try:
            packets = self._pictures.encode(frame)
        except (FFmpegError, OSError) as error:
            raise atomic.about(self.path, error) from None
        self.mux(self._timed(packets))

    def _timed(self, packets: list[Packet[VideoStream]]) -> list[Packet[VideoStream]]:
        """The packets, with decoding times also where x265 leaves them to chance."""
        if self._late_times and self._packets <= _FEW:
            delay = round(_FEW / (self._rate * self._base))
            for packet in packets:
                assert packet.pts is not None
                packet.dts = packet.pts - delay
        return packets

    def finish(self) -> None:
        """Write the packets that the encoder still holds."""
        self.encode(None)


class PictureStream:
    """A stream of pictures that is added to a container, and its encoder.

    The encoder belongs to a stream of its own where the container's one is made after a sample,
    as a projection or two views need it (see views.py).
    """

    def __init__(self, container: OutputContainer, format: VideoFormat):
        self._source: OutputContainer | None = None  # of the encoder, beside the file
        self._into: VideoStream | None = None
        if format.encoding.codec == "gif" or not views.are_stated(format.facts):
            self._stream = begin(container, format)
            return
        self._into = views.stream_after(container, sample_of(format), format.facts)
        self._into.time_base = format.base
        name_codec(self._into, format.encoding)
        self._source = av.open(io.BytesIO(), "w", format="matroska")
        self._stream = begin(self._source, format)
        # Matroska's form of it would say that packets have Matroska's form, too.
        self._into.codec_context.extradata = self._stream.codec_context.extradata

    def encode(self, frame: av.VideoFrame | None) -> list[Packet[VideoStream]]:
        """The packets that are ready once `frame` is there; None: all that are left."""
        packets = self._stream.encode(frame)
        for packet in packets if self._into is not None else ():
            packet.stream = self._into
        return packets


def stream_like(
    container: OutputContainer, source: VideoStream, format: VideoFormat
) -> VideoStream:
    """Add a stream for packets of a file that was written in this format.

    That of an encoder states its rate, which FFmpeg needs for a time code in MP4 and MOV.
    """
    if views.are_stated(format.facts):  # only a copied stream states them
        into = container.add_stream_from_template(source, opaque=True)
        into.time_base = format.base
        name_codec(into, format.encoding)
        return into
    into = begin(container, format)
    into.codec_context.extradata = source.codec_context.extradata  # in the form of its packets
    return into


def begin(container: OutputContainer, format: VideoFormat) -> VideoStream:
    """Add a stream of pictures to a container, and start its encoder."""
    encoding, aspect = format.encoding, format.facts.pixel_aspect
    if encoding.codec == "av1":
        os.environ.setdefault("SVT_LOG", "1")  # it writes pages to the terminal otherwise
    name, rate, options = encoding.encoder.name, format.rate, format.options
    stream = cast(VideoStream, container.add_stream(name, rate=rate, options=options))
    stream.width, stream.height = format.padded
    context = stream.codec_context
    context.pix_fmt, context.time_base = format.pixels, format.base
    if aspect != 1:
        context.sample_aspect_ratio = aspect
    if encoding.codec != "gif":
        tag(context, format.coding)
    name_codec(stream, encoding)
    with kept_scheduling():
        context.open()
    return stream


def sample_of(format: VideoFormat) -> bytes:
    """One picture of a format, in Matroska; see views.stream_after."""
    file = io.BytesIO()
    with av.open(file, "w", format="matroska", container_options={"live": "1"}) as out:
        stream = begin(out, format)
        if mode := views.stereo_mode(format.facts):
            stream.metadata["stereo_mode"] = mode
        frame = av.VideoFrame(*format.padded, format.pixels)
        for plane in frame.planes:
            np.frombuffer(buffer(plane), np.uint8)[:] = 0
        frame.pts, frame.time_base = 0, format.base
        tag(frame, format.coding)
        for packet in [*stream.encode(frame), *stream.encode(None)]:
            packet.dts = packet.pts
            out.mux_one(packet)
    return file.getvalue()


def name_codec(stream: VideoStream, encoding: Encoding) -> None:
    """Give H.265 the name that Apple's players ask for."""
    if encoding.codec == "h265" and encoding.suffix != ".mkv":
        stream.codec_context.codec_tag = "hvc1"


def tag(on: av.VideoFrame | VideoCodecContext, coding: Coding) -> None:
    """Write the four tags of a Coding."""
    on.color_range = RANGES[coding.full_range]
    on.colorspace, on.color_trc = coding.matrix, coding.transfer
    on.color_primaries = coding.primaries


def _why(path: Path, encoding: Encoding, error: Exception) -> Exception:
    """The error in one line: where a hardware encoder does not start, it says so."""
    kind = encoding.encoder.name.rsplit("_", 1)[-1]
    if "avcodec_open" in str(getattr(error, "filename", "")) and kind in HARDWARE:
        return InputError(
            f"encoder {encoding.encoder.name} does not start: it needs the "
            "hardware and the driver of its maker; a software encoder needs neither"
        )
    return atomic.about(path, error)


# ---- threads keep their scheduling while a library opens an encoder ---------------------------
# SVT-AV1 makes the calling thread and its own real-time where the process may, as root in a
# container. Every thread that is made afterwards inherits this, and whatever waits by yielding,
# such as OpenEXR's pool, keeps others from running: frames took three times the processor time.


@contextlib.contextmanager
def kept_scheduling() -> Iterator[None]:
    """Within it, no thread of this process becomes real-time; Linux only, nothing elsewhere."""
    before = _policies()
    try:
        yield
    finally:
        for thread, policy in _policies().items():
            if policy in _REAL_TIME and before.get(thread) not in _REAL_TIME:
                with contextlib.suppress(OSError):  # it has ended
                    os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


_REAL_TIME = {getattr(os, name, None) for name in ("SCHED_FIFO", "SCHED_RR")} - {None}


def _policies() -> dict[int, int]:
    """The scheduling policy of each thread, by its number."""
    found = {}
    with contextlib.suppress(OSError):  # there is no /proc
        for name in os.listdir("/proc/self/task"):
            with contextlib.suppress(OSError):
                found[int(name)] = os.sched_getscheduler(int(name))
    return found
