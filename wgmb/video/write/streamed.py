"""Matroska with FFV1 into a stream that cannot be sought: no loss, and the colours are stated."""

from __future__ import annotations

import contextlib

import av
from av.error import FFmpegError
from av.video.reformatter import VideoReformatter

from ...color.coding import CodedPicture
from ...io.pipes import PipeWriter
from ..pixels import THREADS, frame_of, pixel_format
from .container import PictureStream, tag
from .format import VideoFormat


class MatroskaStream:
    """Writes pictures of one size into a stream, one tick of the format's clock for each."""

    def __init__(self, stream: PipeWriter, format: VideoFormat):
        self._out, self._format = stream, format
        self._planar, self._pixels = pixel_format(format.coding), format.pixels
        self._by, self._count = VideoReformatter(), 0
        self._container = av.open(stream, "w", format="matroska")
        self._stream = PictureStream(self._container, format)

    def add(self, picture: CodedPicture) -> None:
        """Append a picture."""
        frame = frame_of(picture.planes, self._planar)
        tag(frame, self._format.coding)
        if self._pixels != self._planar:
            frame = self._by.reformat(frame, format=self._pixels, threads=THREADS)
        frame.pts, frame.time_base = self._count, self._format.base
        self._container.mux(self._stream.encode(frame))
        self._count += 1
        self._out.pictures = self._count

    def close(self) -> None:
        """Write the remaining data."""
        self._container.mux(self._stream.encode(None))
        self._container.close()

    def abandon(self) -> None:
        """End in the middle."""
        with contextlib.suppress(OSError, ValueError, FFmpegError):
            self._container.close()
