"""A video in segments, so that a run that was killed can go on.

Segments of about ten seconds are encoded one by one, in a folder beside the video, in its own kind
of container. Each is complete or absent, and beside it is a record of its inputs and settings, and
a checksum (see record.py). When all are there their packets are copied into the video, at the times
that one run would have given them, and the folder is removed.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.packet import Packet
from av.video.stream import VideoStream

from ...color.coding import CodedPicture
from ...errors import InputError
from ...io import atomic, leftovers, record
from ..read.container import opened, picture_stream
from . import views
from .container import NewFile, stream_like
from .format import VideoFormat
from .other_streams import OtherStreams
from .writer import VideoWriter

SECONDS = 10
_NAME = re.compile(r"\d{5}\.(mp4|mov|mkv|webm|json)")
_CLAIM = "run"  # a file of this name is locked by each run that makes segments
_PART = 1 << 20  # bytes that are read at once


class Segments:
    """The segments of the video `path`, whose pictures are shown at `times` [s].

    `made_of`: dependencies of the pictures (settings, inputs); segments with other dependencies
    are made again. Use: for every range of numbers in `to_do`, `begin` it, add its pictures, close
    it; then `join`; `release` in any case. `mode`: permissions of the video and of the segments,
    see atomic.mode_of. InputError for a GIF, which has no segments.
    """

    def __init__(
        self,
        path: Path,
        format: VideoFormat,
        times: Sequence[Fraction],
        made_of: dict[str, Any],
        mode: int = atomic.PUBLIC,
    ):
        encoding = format.encoding
        if encoding.codec == "gif":
            raise InputError(f"output {path}: a GIF cannot be resumed")
        self.path, self.folder = path, folder_of(path)
        self._claim: tuple[Path, int] | None = None
        self._format, self._times, self._mode = format, times, mode
        per = max(round(SECONDS * format.rate), 1)
        self._ranges = [
            range(n, min(n + per, len(times))) for n in range(0, len(times), per)
        ]  # fmt: skip
        self._made_of = made_of | {
            "encoding": [encoding.suffix, encoding.encoder.name, format.options],
            "coding": list(asdict(format.coding).values()),
            "size": list(format.size),
            "rate": str(format.rate),
            "base": str(format.base),
            "pixel_aspect": str(format.facts.pixel_aspect),
            "views": [(one or b"").hex() for one in (format.facts.projection, format.facts.stereo)],
            "encoders": {name: list(v) for name, v in av.library_versions.items()},
        }

    def to_do(self) -> list[range]:
        """The numbers of the pictures of every segment that is not there, whole and as wanted."""
        self._claimed()
        return [r for index, r in enumerate(self._ranges) if not self._is_there(index)]

    def begin(self, numbers: range) -> Segment:
        """Begin a segment that `to_do` returned."""
        self._claimed()
        index = self._ranges.index(numbers)
        path = self._file(index)
        path.with_suffix(".json").unlink(missing_ok=True)  # of what it is going to replace
        temporary = atomic.temporary_name(path)
        return Segment(self, index, VideoWriter(path, temporary, self._format, mode=self._mode))

    def join(self, record: str = "", others: OtherStreams | None = None) -> list[str]:
        """Write the video, with `others` beside its pictures; return the losses, in words.

        `record`: see io/record.py. InputError if a segment lacks or does not hold its pictures.
        """
        texts = others.metadata if others else {}
        temporary = atomic.temporary_name(self.path)
        file = NewFile(
            self.path, temporary, self._format.encoding.suffix, texts, record, self._mode
        )
        file.has_views = views.are_stated(self._format.facts)
        try:
            left_out = self._written(file, others)
            file.close()
        except BaseException:
            file.abandon()
            raise
        finally:
            if others is not None:
                others.close()
        self.clear()
        return left_out

    def _written(self, file: NewFile, others: OtherStreams | None) -> list[str]:
        left_out = [*self._format.left_out, *file.left_out]
        orders = [self._display_order(self._file(n), r) for n, r in enumerate(self._ranges)]
        delay = max(min(o) + at - number for o in orders for at, number in enumerate(o))
        into: VideoStream | None = None
        for index, order in enumerate(orders):
            path = self._file(index)
            with opened(path, is_known=True) as container:
                stream = picture_stream(container, path)
                if into is None:
                    into = stream_like(file.container, stream, self._format)
                    if others is not None:
                        left_out += others.attach(file.container)
                for packet, number in self._timed(container.demux(stream), order, delay):
                    packet.stream = into
                    file.mux([packet])
                    if others is not None:
                        file.mux(others.until(self._times[number]))
        if others is not None:
            file.mux(others.rest())
        return left_out

    def _timed(
        self, packets: Iterator[Packet[VideoStream]], order: list[int], delay: int
    ) -> Iterator[tuple[Packet[VideoStream], int]]:
        """The packets of a segment with the video's times, and the numbers of their pictures."""
        for at, (packet, number) in enumerate(zip(packets, order, strict=False)):
            packet.time_base = self._format.base
            packet.pts, packet.dts = self._tick(number), self._tick(min(order) + at - delay)
            packet.duration = self._tick(number + 1) - packet.pts
            yield packet, number

    def _display_order(self, path: Path, numbers: range) -> list[int]:
        """The numbers of the pictures in a segment, in the order of its packets.

        The container may have rounded their times. InputError unless each is there once.
        """
        with opened(path, is_known=True) as container:
            stream = picture_stream(container, path)
            base = stream.time_base or self._format.base
            shown = [p.pts for p in container.demux(stream) if p.size and p.pts is not None]
        exact = np.array([float(self._times[n] - self._times[numbers[0]]) for n in numbers])
        times = (np.array(shown) - shown[:1]) * float(base)
        between = (exact[1:] + exact[:-1]) / 2
        order = [numbers[0] + int(n) for n in np.searchsorted(between, times)]
        if sorted(order) != list(numbers):
            raise InputError(
                f"{path}: holds {len(order)} pictures of {len(numbers)}; please remove the file"
            )
        return order

    def _tick(self, number: int) -> int:
        """Time of a picture in ticks; numbers before the first and after the last continue the
        rate."""
        inside = min(max(number, 0), len(self._times) - 1)
        return round(
            (self._times[inside] + (number - inside) / self._format.rate) / self._format.base
        )

    def _claimed(self) -> None:
        """Make the folder, without unfinished files of dead runs, and mark it as in use."""
        if self._claim is not None:
            return
        try:
            for _ in range(3):  # another run may remove it meanwhile
                if self.folder.is_symlink():
                    raise InputError(f"{self.folder}: is a link; it must be a folder")
                leftovers.add(self.folder, self.folder.rmdir)  # if there is nothing in it
                self.folder.mkdir(exist_ok=True)
                temporary = atomic.temporary_name(self.folder / _CLAIM)
                with contextlib.suppress(FileNotFoundError):
                    self._claim = temporary, atomic.create(temporary)
                    break
        except OSError as error:
            raise InputError(f"{self.folder}: {(error.strerror or str(error)).lower()}") from None
        _sweep(self.folder)

    def release(self) -> None:
        """Let others remove the segments."""
        if self._claim is not None:
            (temporary, lock), self._claim = self._claim, None
            atomic.remove(temporary)
            os.close(lock)
            with contextlib.suppress(OSError):  # unless there are segments in it
                self.folder.rmdir()
            leftovers.forget(self.folder)

    def clear(self) -> None:
        """Remove the segments and their folder, unless others use it."""
        self.release()
        remove_left(self.path)

    def _file(self, index: int) -> Path:
        return self.folder / f"{index:05d}{self._format.encoding.suffix}"

    def finished(self, index: int) -> None:
        """Write the record of a segment that is in place."""
        path = self._file(index)
        text = record.blank(self._content(index) | _sum(path))
        sealed = record.seal(text.encode(), text)
        atomic.write_file(path.with_suffix(".json"), *sealed, mode=self._mode)

    def drop(self, index: int) -> None:
        """Remove a segment that has no record, which no run can use."""
        path = self._file(index)
        if not path.with_suffix(".json").exists():
            with contextlib.suppress(OSError):
                path.unlink()

    def _content(self, index: int) -> dict[str, Any]:
        numbers = self._ranges[index]
        times = ",".join(str(self._times[n]) for n in numbers)
        at = {"numbers": [numbers[0], numbers[-1]], "times": zlib.crc32(times.encode())}
        return json.loads(json.dumps(self._made_of | at))

    def _is_there(self, index: int) -> bool:
        path = self._file(index)
        try:
            content = record.read(path.with_suffix(".json").read_bytes())
            return content is not None and content == self._content(index) | _sum(path)
        except OSError:
            return False


def folder_of(path: Path) -> Path:
    """Folder of the segments of a video."""
    return path.with_name(f"{path.name}.segments")


def remove_left(path: Path) -> None:
    """Remove the segments that runs which have ended left of the video `path`.

    Nothing is touched while another run makes them, and other files stay.
    """
    folder = folder_of(path)
    if not folder.is_dir() or folder.is_symlink():
        return
    _sweep(folder)
    names = os.listdir(folder)
    if any(atomic.is_temporary(name) for name in names):  # of a run that is alive
        return
    for name in filter(_NAME.fullmatch, names):
        (folder / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def _sweep(folder: Path) -> None:
    """Remove unfinished segments of dead runs from a folder."""
    atomic.sweep(folder, lambda name: name == _CLAIM or bool(_NAME.fullmatch(name)))


class Segment:
    """A segment being written: VideoWriter's own words; `close` records it."""

    def __init__(self, segments: Segments, index: int, video: VideoWriter):
        self._segments, self._index, self._video = segments, index, video
        self._start: Fraction | None = None

    def add(self, picture: CodedPicture, time: Fraction) -> None:
        """Append a picture, with its time in the whole video [s]."""
        self._start = time if self._start is None else self._start
        self._video.add(picture, time - self._start)

    def close(self) -> None:
        """Put the segment in place, and its record beside it: both or neither."""

        def drop() -> None:
            self._segments.drop(self._index)

        with leftovers.removed_by(drop):
            try:
                self._video.close()
                self._segments.finished(self._index)
            finally:
                drop()

    def abandon(self) -> None:
        """Leave nothing of it behind."""
        self._video.abandon()


def _sum(path: Path) -> dict[str, int]:
    """Length and CRC-32 of a file."""
    crc, length = 0, os.stat(path).st_size
    with open(path, "rb") as file:
        while part := file.read(_PART):
            crc = zlib.crc32(part, crc)
    return {"length": length, "crc": crc}
