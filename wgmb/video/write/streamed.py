"""Matroska with FFV1 into a stream that cannot be sought: no loss, and the colours are stated."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import contextlib
from fractions import Fraction

import av
from av.error import FFmpegError
from av.video.reformatter import VideoReformatter

from ...color.coding import CodedPicture, Coding
from ...io.pipes import PipeWriter
from ..pixels import THREADS, frame_of, pixel_format
from .container import begin, tag
from .encoders import Encoding, Facts


class MatroskaStream:
    """Writes pictures of one size into a stream. `coding` is what `encoding.coding` returned."""

    def __init__(
        self,
        stream: PipeWriter,
        size: tuple[int, int],
        rate: Fraction,
        coding: Coding,
        encoding: Encoding,
        facts: Facts,
    ):
        self._out, self._coding = stream, coding
        self._planar, self._pixels = pixel_format(coding), encoding.pixels(coding)
        self._by, self._base, self._count = VideoReformatter(), 1 / rate, 0
        self._container = av.open(stream, "w", format="matroska")
        self._stream = begin(self._container, encoding, coding, size, rate, self._base, facts)

    def add(self, picture: CodedPicture) -> None:
        """Append a picture."""
        frame = frame_of(picture.planes, self._planar)
        tag(frame, self._coding)
        if self._pixels != self._planar:
            frame = self._by.reformat(frame, format=self._pixels, threads=THREADS)
        frame.pts, frame.time_base = self._count, self._base
        self._container.mux(self._stream.encode(frame))
        self._count += 1
        self._out.pictures = self._count

    def close(self) -> None:
        """Write what is left."""
        self._container.mux(self._stream.encode(None))
        self._container.close()

    def abandon(self) -> None:
        """End in the middle."""
        with contextlib.suppress(OSError, ValueError, FFmpegError):
            self._container.close()
