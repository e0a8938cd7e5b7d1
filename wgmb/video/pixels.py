"""FFmpeg's pixel formats as planes of samples, and planes as its frames.

Planar formats are taken as they are. Others (nv12, p010, packed ones, big-endian, palettes) are
sorted into planes of the same samples; no sample changes its value, except that those of under 8
bits are spread over 8.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Literal

import av
import numpy as np
from av.stream import Discard as Discard  # a PyAV that is too old for videos lacks it
from av.video.plane import VideoPlane
from av.video.reformatter import VideoReformatter

from ..color.coding import Coding

_STEPS = {"420": (2, 2), "422": (2, 1), "444": (1, 1), "440": (1, 2), "411": (4, 1), "410": (4, 4)}
_NAMES = {steps: name for name, steps in _STEPS.items()}
_DEPTHS = (8, 9, 10, 12, 14, 16)
THREADS = 1  # of a VideoReformatter: with more, FFmpeg 8 at times spoils the start of a row
_UNREADABLE = re.compile(r"bayer_|xyz|.*f(16|32)(le|be)$")


@dataclass(frozen=True)
class PlaneLayout:
    """A planar format, with the properties of its samples."""

    name: str
    """Of the planar format."""
    via: str | None
    """Another format to go through first."""
    model: Literal["yuv", "rgb", "grey"]
    bits: int
    steps: tuple[int, int]
    alpha: bool
    full_range: bool
    """The format itself says so (yuvj, RGB)."""


@cache
def layout(name: str, transparent: bool = False) -> PlaneLayout | None:
    """The planes that a frame of pixel format `name` becomes; None if it cannot be read.

    `transparent`: the palette of a format that has one has transparent colours.
    """
    if _UNREADABLE.match(name):
        return None
    pixels = av.VideoFormat(name, 16, 16)
    parts = pixels.components
    alpha = any(part.is_alpha for part in parts) or transparent
    bits = _depth(max(part.bits for part in parts))
    if pixels.has_palette:
        return _rgb(8, transparent, "rgba" if transparent else "rgb24")
    if pixels.is_rgb:
        narrow = max(part.bits for part in parts) < 8
        return _rgb(bits, alpha, "rgb24" if narrow else None)
    if len(parts) < 3:
        if alpha:  # grey with alpha has no planar format
            return _rgb(bits, True, "rgba" if bits == 8 else "rgba64le")
        planar = "gray" if bits == 8 else f"gray{bits}le"
        return PlaneLayout(planar, None, "grey", bits, (1, 1), False, False)
    steps = 16 // pixels.chroma_width(16), 16 // pixels.chroma_height(16)
    planar = _yuv(bits, steps, alpha)
    return PlaneLayout(planar, None, "yuv", bits, steps, alpha, name.startswith("yuvj"))


def _depth(bits: int) -> int:
    return next(depth for depth in _DEPTHS if bits <= depth)


def _rgb(bits: int, alpha: bool, via: str | None) -> PlaneLayout:
    name = ("gbrap" if alpha else "gbrp") + ("" if bits == 8 else f"{bits}le")
    return PlaneLayout(name, via, "rgb", bits, (1, 1), alpha, True)


def _yuv(bits: int, steps: tuple[int, int], alpha: bool) -> str:
    return f"yuv{'a' if alpha else ''}{_NAMES[steps]}p{'' if bits == 8 else f'{bits}le'}"


def pixel_format(coding: Coding) -> str:
    """FFmpeg's name of the planar format that holds such pictures."""
    if coding.model == "rgb":
        return _rgb(coding.bits, coding.alpha, None).name
    if coding.model == "grey":
        return "gray" if coding.bits == 8 else f"gray{coding.bits}le"
    return _yuv(coding.bits, coding.steps, coding.alpha)


def is_transparent(frame: av.VideoFrame) -> bool:
    """Return True if the frame's palette, if it has one, has transparent colours."""
    if not frame.format.has_palette:
        return False
    colors = np.frombuffer(buffer(frame.planes[1]), np.uint32, 256)  # 0xAARRGGBB
    return bool((colors >> 24 < 255).any())


def planes_of(
    frame: av.VideoFrame, into: PlaneLayout, by: VideoReformatter
) -> tuple[np.ndarray, ...]:
    """The samples of a frame: Y, Cb, Cr or R, G, B or grey, then alpha; (height, width) each.

    They are the frame's own, not to be written to, with gaps between their rows. `by` is
    best the same for all frames of a video.
    """
    if into.via and frame.format.name != into.name:
        frame = by.reformat(frame, format=into.via, threads=THREADS)
    if frame.format.name.replace("yuvj", "yuv") not in (into.name, "gray8"):
        frame = by.reformat(frame, format=into.name, threads=THREADS)
    # The components of RGB are in the order R, G, B wherever their planes are.
    return tuple(_samples(frame, part.plane, into.bits) for part in frame.format.components)


def _samples(frame: av.VideoFrame, index: int, bits: int) -> np.ndarray:
    """One plane of a frame, which stays in memory as long as this does."""
    plane = frame.planes[index]
    kind = np.dtype(np.uint8 if bits == 8 else "<u2")
    stride = abs(plane.line_size) // kind.itemsize
    rows = np.frombuffer(buffer(plane), kind, plane.height * stride)
    rows = rows.reshape(plane.height, stride)
    if plane.line_size < 0:  # the last row comes first
        rows = rows[::-1]
    samples = rows[:, : plane.width]
    samples.flags.writeable = False
    return samples


def frame_of(planes: tuple[np.ndarray, ...], name: str) -> av.VideoFrame:
    """A frame of the planar format `name` that holds these samples."""
    height, width = planes[0].shape
    frame = av.VideoFrame(width, height, name)
    for part, samples in zip(frame.format.components, planes, strict=True):
        plane = frame.planes[part.plane]
        kind = np.dtype(np.uint8 if part.bits == 8 else "<u2")
        rows = np.frombuffer(buffer(plane), kind).reshape(plane.height, -1)
        rows[:, : plane.width] = samples
    return frame


def buffer(plane: VideoPlane) -> memoryview:
    """The bytes of a plane, to be read and written in place."""
    return memoryview(plane)  # pyright: ignore[reportArgumentType]
