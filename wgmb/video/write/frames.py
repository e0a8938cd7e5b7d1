"""Write MP4, MOV, MKV, WebM and GIF files frame by frame; complete or absent."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from pathlib import Path

import numpy as np
from av.error import FFmpegError

from ...color.coding import (
    BT709,
    SRGB,
    UNSPECIFIED,
    Coding,
)
from ...color.srgb import ToDisplay, to_display
from ...errors import InputError
from ...io import atomic
from .encoders import FINEST_RATE, NO_FACTS, Encoding, Facts, chosen
from .encoders import SUFFIXES as SUFFIXES
from .format import VideoFormat
from .gif import check_rate
from .writer import VideoWriter

SRGB_DISPLAY = frozenset({"srgb_rec709_display"})
_DISPLAYS = {  # primaries and transfer of displays, by the names that configs give them
    "srgb_rec709_display": (BT709, SRGB), "srgb_display": (BT709, SRGB),
    "g22_rec709_display": (BT709, 4),
    "g24_rec709_display": (BT709, 1), "rec1886_rec709_display": (BT709, 1),
    "g24_rec2020_display": (9, 14), "rec1886_rec2020_display": (9, 14),
    "srgb_p3d65_display": (12, SRGB), "displayp3_display": (12, SRGB),
    "pq_rec2020_display": (9, 16), "rec2100_pq_display": (9, 16),
    "pq_p3d65_display": (12, 16), "st2084_p3d65_display": (12, 16),
    "hlg_rec2020_display": (9, 18), "rec2100_hlg_display": (9, 18),
}  # fmt: skip
_RATES = Fraction(1, 1000), Fraction(1000)


class FrameVideo:
    """A video being written under a temporary name; `close` gives it its own.

    Alpha is dropped (the colour is premultiplied, so it lies over black). Encoders that share
    colour between pixels may need even sizes: the last row or column is then repeated. A GIF has
    256 colours per frame, dithered, and delays in steps of 1/100 s, which vary by a step to keep
    the mean frame rate. `comment`: a text for players. `record`, which may be set until the first
    frame: see io/record.py. `display`: names of the display's colour space, for the tags.
    `encoding`: see encoders.chosen; by default that of the suffix. `mode`, which may be set until
    the first frame: the permissions, see atomic.mode_of.
    """

    def __init__(
        self,
        path: Path,
        temporary: Path,
        fps: Fraction,
        comment: str = "",
        display: Collection[str] = SRGB_DISPLAY,
        encoding: Encoding | None = None,
    ):
        self.path, self.temporary = path, temporary
        self.record, self._texts, self.mode = "", {"comment": comment}, atomic.PUBLIC
        self._encoding = encoding or chosen(path)
        check_rate(path, fps, *(() if self._encoding.codec == "gif" else (_RATES,)))
        self.fps = fps.limit_denominator(FINEST_RATE)
        self._coding = self._encoding.coding(_coding(display, self._encoding.codec == "ffv1"))[0]
        self._video: VideoWriter | None = None
        self._frames = 0
        self._size: tuple[int, ...] = ()

    def add(
        self,
        rgba: np.ndarray,
        convert: ToDisplay = to_display,
        pixel_aspect: Fraction = NO_FACTS.pixel_aspect,
    ) -> None:
        """Append one frame of linear light, (height, width, 3 or 4); OSError if it cannot be.

        `pixel_aspect`: width of a pixel to its height; that of the first frame is the video's.
        """
        rgb = convert(rgba, 8, over_black=True)
        self._size = self._size or rgb.shape
        if rgb.shape != self._size:
            raise InputError(
                f"frame of {rgb.shape[1]} x {rgb.shape[0]} in a video of "
                f"{self._size[1]} x {self._size[0]}"
            )
        if self._encoding.encoder.even:
            height, width = rgb.shape[:2]
            rgb = np.pad(rgb, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        if self._video is None:
            size = rgb.shape[1], rgb.shape[0]
            facts = Facts(pixel_aspect)
            form = VideoFormat(self._encoding, self._coding, size, self.fps, 1 / self.fps, facts)
            self._video = VideoWriter(
                self.path,
                self.temporary,
                form,
                self._texts,
                record=self.record,
                mode=self.mode,
            )
        self._video.add_rgb(rgb, self._frames / self.fps)
        self._frames += 1

    def close(self, *, is_complete: bool = True) -> None:
        """Finish the file and put it in place; OSError if it cannot be.

        Without `is_complete`, its record has no seal: a resumed run makes it again.
        """
        if self._video is None:
            raise OSError(f"{self.path}: no frames")
        self._video.file.is_complete = is_complete
        try:
            self._video.close()
        except (FFmpegError, OSError) as error:
            self.abandon()
            raise atomic.about(self.path, error) from None

    def abandon(self) -> None:
        """Leave nothing behind."""
        if self._video is not None:
            self._video.abandon()
        self.temporary.unlink(missing_ok=True)


def _coding(display: Collection[str], lossless: bool) -> Coding:
    """Coding of pictures for this display, if the encoder supports it."""
    known = [_DISPLAYS[name] for name in sorted(display) if name in _DISPLAYS]
    primaries, transfer = known[0] if known else (UNSPECIFIED, UNSPECIFIED)
    if lossless:
        return Coding("rgb", 8, (1, 1), full_range=True, matrix=0, transfer=transfer,
                      primaries=primaries)  # fmt: skip
    return Coding(transfer=transfer, primaries=primaries)
