"""MP4, MOV, MKV, WebM and GIF out: frames one by one, the file complete or not there."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

import av
import imageio.v3 as iio
import numpy as np
from av.video.reformatter import Colorspace

from .stills import to_display

SUFFIXES = (".mp4", ".mov", ".mkv", ".webm", ".gif")
_CODECS = {  # suffix: container, codec, pixel format, options
    ".mp4": ("mp4", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mkv": ("matroska", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mov": ("mov", "prores_ks", "yuv422p10le", {"profile": "3"}),
    ".webm": ("webm", "libvpx-vp9", "yuv420p", {"crf": "24", "b": "0"}),
}


class Video:
    """A video being written under a temporary name; `close` gives it its own.

    Alpha is dropped (the colour is premultiplied, so it lies over black). Codecs that share
    colour between pixels need even sizes: the last row or column is then repeated.
    """

    def __init__(self, path: Path, temporary: Path, fps: Fraction, settings: str):
        self.path, self.temporary, self.fps, self.settings = path, temporary, fps, settings
        self._container = self._stream = None
        self._gif: list[np.ndarray] = []

    def add(self, rgba: np.ndarray) -> None:
        """Append one frame of linear light, (height, width, 3 or 4); OSError if it cannot be."""
        try:
            self._add(rgba)
        except av.error.FFmpegError as error:
            raise OSError(f"{self.path}: {error}") from None

    def _add(self, rgba: np.ndarray) -> None:
        shown = to_display(rgba[..., :3], 8)
        if self.path.suffix.lower() == ".gif":
            self._gif.append(shown)
            return
        height, width = shown.shape[:2]
        shown = np.pad(shown, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        if self._stream is None:
            self._open(shown.shape[1], shown.shape[0])
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(shown), format="rgb24")
        frame = frame.reformat(format=self._stream.pix_fmt, dst_colorspace=Colorspace.ITU709)
        self._container.mux(self._stream.encode(frame))

    def _open(self, width: int, height: int) -> None:
        kind, codec, pixels, options = _CODECS[self.path.suffix.lower()]
        self._container = av.open(str(self.temporary), "w", format=kind)
        self._container.metadata["comment"] = f"wgmb {self.settings}"
        self._stream = self._container.add_stream(codec, rate=self.fps, options=options)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, pixels
        context = self._stream.codec_context
        context.color_primaries, context.color_trc, context.colorspace = 1, 13, 1  # 709, sRGB

    def close(self) -> None:
        """Finish the file and put it in place."""
        if self._gif:
            duration = round(1000 / self.fps)
            data = iio.imwrite("<bytes>", np.stack(self._gif), extension=".gif",
                               duration=duration, loop=0)  # fmt: skip
            self.temporary.write_bytes(data)
        elif self._container is not None:
            try:
                self._container.mux(self._stream.encode(None))
                self._container.close()
            except av.error.FFmpegError as error:
                self.abandon()
                raise OSError(f"{self.path}: {error}") from None
            self._container = None
        with open(self.temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(self.temporary, self.path)

    def abandon(self) -> None:
        """Leave nothing behind."""
        if self._container is not None:
            container, self._container = self._container, None
            try:
                container.close()
            except (OSError, ValueError, av.error.FFmpegError):
                pass  # a full disk: the file goes anyway
        self.temporary.unlink(missing_ok=True)
