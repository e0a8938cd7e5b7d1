"""A stand-in for VapourSynth, which has no wheel for Python 3.11: what wgmb and its tests use.

As there, frames are made by whichever thread asks for them, and are kept nowhere.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np

GRAY, RGB, YUV = 1, 2, 3
INTEGER, FLOAT = 0, 1


class Error(Exception):
    """As vapoursynth.Error."""


@dataclass(frozen=True)
class VideoFormat:
    """As vapoursynth.VideoFormat."""

    name: str
    color_family: int
    sample_type: int
    bits_per_sample: int
    subsampling_w: int = 0
    subsampling_h: int = 0

    @property
    def num_planes(self) -> int:
        return 1 if self.color_family == GRAY else 3

    @property
    def dtype(self) -> np.dtype:
        kind = "f" if self.sample_type == FLOAT else "u"
        return np.dtype(
            f"{kind}{1 if self.bits_per_sample == 8 else -(-self.bits_per_sample // 16) * 2}"
        )


RGB24 = VideoFormat("RGB24", RGB, INTEGER, 8)
RGBS = VideoFormat("RGBS", RGB, FLOAT, 32)
GRAY8 = VideoFormat("GRAY8", GRAY, INTEGER, 8)
YUV420P8 = VideoFormat("YUV420P8", YUV, INTEGER, 8, 1, 1)
YUV420P10 = VideoFormat("YUV420P10", YUV, INTEGER, 10, 1, 1)
YUV444PS = VideoFormat("YUV444PS", YUV, FLOAT, 32)


class VideoFrame:
    """As vapoursynth.VideoFrame: planes that can be written in a copy alone."""

    def __init__(self, form: VideoFormat, planes: list[np.ndarray], props: dict[str, Any]):
        self.format, self._planes, self.props = form, planes, props
        self.height, self.width = planes[0].shape

    def __getitem__(self, index: int) -> np.ndarray:
        return self._planes[index]

    def copy(self) -> VideoFrame:
        return VideoFrame(self.format, [plane.copy() for plane in self._planes], dict(self.props))

    def close(self) -> None:
        self._planes = []

    def __enter__(self) -> VideoFrame:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@dataclass(frozen=True)
class VideoNode:
    """As vapoursynth.VideoNode."""

    format: VideoFormat | None
    width: int
    height: int
    num_frames: int
    fps: Fraction
    make: Callable[[int], VideoFrame]

    def get_frame(self, number: int) -> VideoFrame:
        if not 0 <= number < self.num_frames:
            raise Error(f"frame {number} is not there")
        return self.make(number)

    @property
    def std(self) -> Any:
        def modify(clip: VideoNode, clips: VideoNode, selector: Any) -> VideoNode:
            def make(number: int) -> VideoFrame:
                try:
                    return selector(n=number, f=clips.get_frame(number))
                except Exception as error:
                    raise Error(str(error)) from None

            return replace(clip, make=make)

        return SimpleNamespace(
            BlankClip=lambda **given: blank(self, **given),
            ModifyFrame=lambda clips, selector: modify(self, clips, selector),
        )

    def frames(self, close: bool = False):
        for number in range(self.num_frames):
            frame = self.get_frame(number)
            yield frame
            with contextlib.suppress(ValueError):
                frame.close()


def blank(clip: VideoNode | None = None, **given: Any) -> VideoNode:
    """As std.BlankClip."""
    width, height, form = (
        given.get(name, getattr(clip, name, None)) for name in ("width", "height", "format")
    )
    fps = Fraction(given["fpsnum"], given["fpsden"]) if given["fpsnum"] else Fraction(0)
    across, down = 1 << form.subsampling_w, 1 << form.subsampling_h
    shapes = [(height, width)] + [(height // down, width // across)] * (form.num_planes - 1)

    def make(number: int) -> VideoFrame:
        planes = [np.zeros(shape, form.dtype) for shape in shapes]
        for plane in planes:
            plane.flags.writeable = False
        lasts = {"_DurationNum": fps.denominator, "_DurationDen": fps.numerator}
        return VideoFrame(form, planes, lasts)

    return VideoNode(form, width, height, given["length"], fps, make)


core = SimpleNamespace(std=SimpleNamespace(BlankClip=lambda **given: blank(**given)))
