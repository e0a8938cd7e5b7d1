"""Write MP4, MOV, MKV, WebM and GIF files frame by frame; complete or absent."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterator
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import OutputContainer
from av.error import BlockingIOError, EOFError, FFmpegError
from av.filter import Graph
from av.video.reformatter import Colorspace
from av.video.stream import VideoStream

from ..color import ToDisplay, to_display
from ..errors import InputError
from . import atomic

SUFFIXES = (".mp4", ".mov", ".mkv", ".webm", ".gif")
_CODECS = {  # suffix: container, codec, pixel format, options
    ".mp4": ("mp4", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mkv": ("matroska", "libx264", "yuv420p", {"crf": "16", "preset": "medium"}),
    ".mov": ("mov", "prores_ks", "yuv422p10le", {"profile": "3"}),
    ".webm": ("webm", "libvpx-vp9", "yuv420p", {"crf": "24", "b": "0"}),
    ".gif": ("gif", "gif", "pal8", {}),
}
_BT709, _SRGB, _UNKNOWN = 1, 13, 2  # as primaries, matrix or transfer (ITU-T H.273)
SRGB = frozenset({"srgb_rec709_display"})
_DISPLAYS = {  # primaries and transfer of displays, by the names that configs give them
    "srgb_rec709_display": (_BT709, _SRGB), "srgb_display": (_BT709, _SRGB),
    "g22_rec709_display": (_BT709, 4),
    "g24_rec709_display": (_BT709, 1), "rec1886_rec709_display": (_BT709, 1),
    "g24_rec2020_display": (9, 14), "rec1886_rec2020_display": (9, 14),
    "srgb_p3d65_display": (12, _SRGB), "displayp3_display": (12, _SRGB),
    "pq_rec2020_display": (9, 16), "rec2100_pq_display": (9, 16),
    "pq_p3d65_display": (12, 16), "st2084_p3d65_display": (12, 16),
    "hlg_rec2020_display": (9, 18), "rec2100_hlg_display": (9, 18),
}  # fmt: skip
_FINEST = 1_001_000  # denominator of a rate: FFmpeg counts in 32 bits
_TICK = Fraction(1, 100)  # of a GIF's clock [s]
_RATES = Fraction(1, 1000), Fraction(1000)
_GIF_RATES = Fraction(1, 600), Fraction(50)  # a delay has 16 bits; under two ticks it counts as ten


class Video:
    """A video being written under a temporary name; `close` gives it its own.

    Alpha is dropped (the colour is premultiplied, so it lies over black). Codecs that share
    colour between pixels need even sizes: the last row or column is then repeated. A GIF has 256
    colours per frame, dithered, and delays in steps of 1/100 s, which vary by a step to keep
    the mean frame rate. `display`: names of the display's colour space, for the tags.
    """

    def __init__(
        self,
        path: Path,
        temporary: Path,
        fps: Fraction,
        settings: str,
        display: Collection[str] = SRGB,
    ):
        self.path, self.temporary, self.settings = path, temporary, settings
        self._is_gif = path.suffix.lower() == ".gif"
        least, most = _GIF_RATES if self._is_gif else _RATES
        if not least <= fps <= most:
            raise InputError(
                f"output {path}: {path.suffix} takes {least} to {most} frames per second, "
                f"got {float(fps):g}"
            )
        self.fps = fps.limit_denominator(_FINEST)
        self._open: tuple[OutputContainer, VideoStream] | None = None
        self._palettes: Graph | None = None
        self._lock: int | None = None
        self._frames = 0
        known = [_DISPLAYS[name] for name in sorted(display) if name in _DISPLAYS]
        self._tags = known[0] if known else (_UNKNOWN, _UNKNOWN)
        self._size: tuple[int, ...] = ()

    def add(self, rgba: np.ndarray, convert: ToDisplay = to_display) -> None:
        """Append one frame of linear light, (height, width, 3 or 4); OSError if it cannot be."""
        shown = convert(rgba, 8, over_black=True)
        self._size = self._size or shown.shape
        if shown.shape != self._size:
            raise InputError(
                f"frame of {shown.shape[1]} x {shown.shape[0]} in a video of "
                f"{self._size[1]} x {self._size[0]}"
            )
        if not self._is_gif:
            height, width = shown.shape[:2]
            shown = np.pad(shown, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        try:
            self._open = self._open or self._begin(shown.shape[1], shown.shape[0])
            self._encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(shown), format="rgb24"))
        except (FFmpegError, OSError) as error:
            raise atomic.about(self.path, error) from None

    def _begin(self, width: int, height: int) -> tuple[OutputContainer, VideoStream]:
        kind, codec, pixels, options = _CODECS[self.path.suffix.lower()]
        self._lock = atomic.create(self.temporary)  # its own file, which nobody else writes to
        container = av.open(str(self.temporary), "w", format=kind)
        container.metadata["comment"] = f"wgmb {self.settings}"
        stream = cast(VideoStream, container.add_stream(codec, rate=self.fps, options=options))
        stream.width, stream.height, stream.pix_fmt = width, height, pixels
        context = stream.codec_context
        if self._is_gif:
            context.time_base = _TICK
            self._palettes = _palettes(width, height)
        else:
            context.color_primaries, context.color_trc = self._tags
            context.colorspace = _BT709
        return container, stream

    def _encode(self, frame: av.VideoFrame | None) -> None:
        """Write what can be written once `frame` is there; None: all the rest."""
        assert self._open is not None
        container, stream = self._open
        if self._palettes is None:
            if frame is not None:
                frame = frame.reformat(format=stream.pix_fmt, dst_colorspace=Colorspace.ITU709)
            container.mux(stream.encode(frame))
            return
        if frame is not None:
            frame.pts, frame.time_base = self._tick(self._frames), _TICK
            self._frames += 1
        self._palettes.push(frame)
        for paletted in _pulled(self._palettes):
            container.mux(stream.encode(paletted))
        if frame is None:
            container.mux(stream.encode(None))

    def _tick(self, frame: int) -> int:
        """Return the time at which a frame of a GIF is shown, in its ticks."""
        return round(frame / (self.fps * _TICK))

    def close(self) -> None:
        """Finish the file and put it in place; OSError if it cannot be."""
        if self._open is not None:
            try:
                self._encode(None)
                self._open[0].close()
            except FFmpegError as error:
                self.abandon()
                raise atomic.about(self.path, error) from None
            self._open = None
        if self._lock is not None:
            os.fsync(self._lock)
        atomic.rename(self.temporary, self.path)
        self._unlock()

    def _unlock(self) -> None:
        if self._lock is not None:
            lock, self._lock = self._lock, None
            os.close(lock)

    def abandon(self) -> None:
        """Leave nothing behind."""
        if self._open is not None:
            (container, _), self._open = self._open, None
            with contextlib.suppress(OSError, ValueError, FFmpegError):  # say, a full disk
                container.close()
        self._unlock()
        self.temporary.unlink(missing_ok=True)


def _palettes(width: int, height: int) -> Graph:
    """A filter that gives every frame the 256 colours that suit it, and dithers."""
    graph = Graph()
    pixels = av.VideoFormat("rgb24", width, height)
    source = graph.add_buffer(width=width, height=height, format=pixels, time_base=_TICK)
    copies = graph.add("split")
    colors = graph.add("palettegen", "stats_mode=single")
    painted = graph.add("paletteuse", "new=1:dither=floyd_steinberg")
    source.link_to(copies)
    copies.link_to(painted, 0, 0)
    copies.link_to(colors, 1, 0)
    colors.link_to(painted, 0, 1)
    painted.link_to(graph.add("buffersink"))
    graph.configure()
    return graph


def _pulled(graph: Graph) -> Iterator[av.VideoFrame]:
    """The frames that are ready."""
    with contextlib.suppress(BlockingIOError, EOFError):
        while True:
            yield cast(av.VideoFrame, graph.pull())
