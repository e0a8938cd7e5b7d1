"""MP4, MOV, MKV, WebM and GIF out: frames one by one, the file complete or not there."""

from __future__ import annotations

import contextlib
import os
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import imageio.v3 as iio
import numpy as np
from av.container import OutputContainer
from av.error import FFmpegError
from av.video.reformatter import Colorspace
from av.video.stream import VideoStream

from .errors import InputError
from .stills import to_display

SUFFIXES = (".mp4", ".mov", ".mkv", ".webm", ".gif")
_CODECS = {  # suffix: container, codec, pixel format, options
    ".mp4": ("mp4", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mkv": ("matroska", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mov": ("mov", "prores_ks", "yuv422p10le", {"profile": "3"}),
    ".webm": ("webm", "libvpx-vp9", "yuv420p", {"crf": "24", "b": "0"}),
}
_BT709, _SRGB = 1, 13  # colour primaries and matrix, transfer (ITU-T H.273)


class Video:
    """A video being written under a temporary name; `close` gives it its own.

    Alpha is dropped (the colour is premultiplied, so it lies over black). Codecs that share
    colour between pixels need even sizes: the last row or column is then repeated.
    """

    def __init__(self, path: Path, temporary: Path, fps: Fraction, settings: str):
        self.path, self.temporary, self.fps, self.settings = path, temporary, fps, settings
        self._open: tuple[OutputContainer, VideoStream] | None = None
        self._gif: list[np.ndarray] = []
        self._size: tuple[int, ...] = ()

    def add(self, rgba: np.ndarray) -> None:
        """Append one frame of linear light, (height, width, 3 or 4); OSError if it cannot be."""
        shown = to_display(rgba[..., :3], 8)
        self._size = self._size or shown.shape
        if shown.shape != self._size:
            raise InputError(
                f"frame of {shown.shape[1]} x {shown.shape[0]} in a video of "
                f"{self._size[1]} x {self._size[0]}"
            )
        if self.path.suffix.lower() == ".gif":
            self._gif.append(shown)
            return
        height, width = shown.shape[:2]
        shown = np.pad(shown, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        try:
            self._open = self._open or self._begin(shown.shape[1], shown.shape[0])
            container, stream = self._open
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(shown), format="rgb24")
            frame = frame.reformat(format=stream.pix_fmt, dst_colorspace=Colorspace.ITU709)
            container.mux(stream.encode(frame))
        except FFmpegError as error:
            raise OSError(f"{self.path}: {error}") from None

    def _begin(self, width: int, height: int) -> tuple[OutputContainer, VideoStream]:
        kind, codec, pixels, options = _CODECS[self.path.suffix.lower()]
        container = av.open(str(self.temporary), "w", format=kind)
        container.metadata["comment"] = f"wgmb {self.settings}"
        stream = cast(VideoStream, container.add_stream(codec, rate=self.fps, options=options))
        stream.width, stream.height, stream.pix_fmt = width, height, pixels
        context = stream.codec_context
        context.color_primaries, context.color_trc, context.colorspace = _BT709, _SRGB, _BT709
        return container, stream

    def close(self) -> None:
        """Finish the file and put it in place; OSError if it cannot be."""
        if self._gif:
            duration = round(1000 / self.fps)
            frames = np.stack(self._gif)
            data = iio.imwrite("<bytes>", frames, extension=".gif", duration=duration, loop=0)
            self.temporary.write_bytes(cast(bytes, data))
        elif self._open is not None:
            (container, stream), self._open = self._open, None
            try:
                container.mux(stream.encode(None))
                container.close()
            except FFmpegError as error:
                self.abandon()
                raise OSError(f"{self.path}: {error}") from None
        with open(self.temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(self.temporary, self.path)

    def abandon(self) -> None:
        """Leave nothing behind."""
        if self._open is not None:
            (container, _), self._open = self._open, None
            with contextlib.suppress(OSError, ValueError, FFmpegError):  # say, a full disk
                container.close()
        self.temporary.unlink(missing_ok=True)
