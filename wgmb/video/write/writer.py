"""Write coded pictures as a video, at exact times, with the other streams beside them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import Colorspace, VideoReformatter

from ...color.coding import CodedPicture
from ...errors import InputError
from ...io import atomic
from ..pixels import THREADS, frame_of, pixel_format
from .container import VideoFile, tag
from .format import VideoFormat
from .gif import TICK, Palettes, check_rate
from .other_streams import OtherStreams

_RGB = "rgb24"
_WHOLE = 0, 3  # planes of luma and alpha: of all sizes, even where chroma has one sample


class VideoWriter:
    """A video of CodedPictures; complete under its name after `close`, or absent.

    Encoders that share colour between pixels may need even sizes: the last row or column is then
    repeated (VideoFormat.padding). A GIF counts hundredths of a second, and has 256 colours a
    picture. OSError if the file cannot be written, InputError for an encoder
    that does not start. `others`: streams to put beside the pictures, with their texts and
    dates; those that the file cannot hold are in `left_out`. `record`: see io/record.py. `is_new`:
    OSError, when it is closed, where another process has made a file of this name meanwhile.
    `mode`: its permissions, see atomic.mode_of.
    """

    def __init__(
        self,
        path: Path,
        temporary: Path,
        format: VideoFormat,
        metadata: dict[str, str] | None = None,
        others: OtherStreams | None = None,
        *,
        record: str = "",
        is_new: bool = False,
        mode: int = atomic.PUBLIC,
    ):
        if is_gif := format.encoding.codec == "gif":
            check_rate(path, format.rate)
            format = replace(format, base=TICK)
        self.path, self._format, self._others = path, format, others
        self._last: int | None = None  # tick of the picture before
        self._planar, self._pixels = pixel_format(format.coding), format.pixels
        self._by = VideoReformatter()
        self._palettes = Palettes(*format.padded) if is_gif else None
        texts = (metadata or {}) | (others.metadata if others else {})
        self.file = VideoFile(path, temporary, format, texts, record, mode)
        self.left_out = [*format.left_out, *self.file.left_out]
        self.file.is_new = is_new
        try:
            if others is not None:
                self.left_out += others.attach(self.file.container)
        except BaseException:
            self.abandon()
            raise

    def add(self, picture: CodedPicture, time: Fraction) -> None:
        """Append a picture that is shown at `time` [s], later than the one before."""
        coding, size = self._format.coding, self._format.size
        if picture.coding != coding or picture.size != size:
            raise InputError(
                f"{self.path}: picture of {picture.size} as {picture.coding} in a video of "
                f"{size} as {coding}"
            )
        now = round(time / self._format.base)
        if self._last is not None and now <= self._last:
            raise InputError(f"{self.path}: pictures at times that do not ascend ({float(time)} s)")
        frame = frame_of(self._filled(picture.planes), self._planar)
        if self._palettes is None:
            tag(frame, coding)
        kind = self._pixels if self._palettes is None else _RGB
        if kind != self._planar:
            frame = self._by.reformat(frame, format=kind, threads=THREADS)
        self._put(frame, now)
        if self._others is not None:
            self.file.mux(self._others.until(time))

    def add_rgb(self, rgb: np.ndarray, time: Fraction) -> None:
        """Append a picture of display values (height, width, 3) uint8; see `add`."""
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(rgb), format=_RGB)
        if self._palettes is None:
            try:
                frame = self._by.reformat(
                    frame, format=self._pixels, dst_colorspace=Colorspace.ITU709, threads=THREADS
                )
            except FFmpegError as error:
                raise atomic.about(self.path, error) from None
            tag(frame, self._format.coding)
        self._put(frame, round(time / self._format.base))

    def _put(self, frame: av.VideoFrame, tick: int) -> None:
        """Encode a picture in the encoder's format, or, of a GIF, in RGB."""
        self._last = tick
        if self._palettes is not None:
            self._paint(self._palettes, frame, tick)
        else:
            self.file.encode(frame, tick)

    def _paint(self, palettes: Palettes, frame: av.VideoFrame | None, tick: int = 0) -> None:
        """Encode a picture of a GIF, or its changed part."""
        for painted, at in palettes.of(frame, tick):
            self.file.encode(painted, at)

    def _filled(self, planes: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
        across, down = self._format.padding
        if not (across or down):
            return planes
        return tuple(  # chroma was rounded up already
            np.pad(p, ((0, down), (0, across)), "edge") if n in _WHOLE else p
            for n, p in enumerate(planes)
        )

    def close(self) -> None:
        """Complete the file and put it in place; InputError if it has no pictures."""
        if self._last is None:
            self.abandon()
            raise InputError(f"output {self.path}: no pictures to write")
        if self._palettes is not None:
            self._paint(self._palettes, None)
        self.file.finish()
        if self._others is not None:
            self.file.mux(self._others.rest())
            self._others.close()
        self.file.close()

    def abandon(self) -> None:
        """Leave nothing behind."""
        self.file.abandon()
        if self._others is not None:
            self._others.close()
