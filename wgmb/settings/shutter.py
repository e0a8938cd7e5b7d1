"""Settings of the shutter."""

import re
import zlib
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, Self

from ..errors import InputError, check_choice
from ..io.frame_numbers import readable
from ..scene.scene import Scene
from ..shutter import CURVES, PHASES, Shutter, curve_bytes, read_curve
from .record import plain

_FEW_DEGREES = 5  # below, an angle is rather the share of an interval that others count in


@dataclass(frozen=True, kw_only=True)
class ShutterSettings:
    """Shutter angle, phase and curve."""

    shutter: float | str | None = None
    """Shutter angle in degrees, where 360 is one frame interval, or a part of a second, such as
    1/48. Default: 180 (scenes: their own).
    """
    phase: str = "centre"
    "start (opens at the frame), centre, end (closes at it), or the time of its middle in frames."
    curve: str | None = None
    "box (default), trapezoid, triangle, cosine, gaussian, or a CSV file of time, weight."
    rolling: Literal["up", "down", "left", "right"] | None = None
    "Rolling shutter: direction in which the exposure moves across the image."
    rolling_duration: float = 1.0
    "Rolling shutter: delay from the first row or column to the last, in frame intervals."

    def resolved(self, scene: Scene | None = None, fps: Fraction | float | None = None) -> Self:
        """Return a copy with unset fields taken from the scene, or 180 degrees and a box.

        `fps`: frames per second of the output, which turn a part of a second into degrees;
        InputError where one is set and they are not known.
        """
        degrees, curve = 180.0, "box"
        if scene is not None and scene.exposure is not None and fps is not None:
            seconds, curve = scene.exposure
            degrees = round(360 * seconds * float(fps), 9)
        if self.shutter is not None:
            degrees = self.shutter
        if self.seconds is not None:
            if fps is None:
                raise InputError(
                    f"`shutter` {self.shutter}: a part of a second needs the rate of the frames; "
                    "set `fps`, or give degrees such as 180"
                )
            degrees = float(360 * self.seconds * Fraction(fps))
        return replace(self, shutter=degrees, curve=curve if self.curve is None else self.curve)

    @property
    def degrees(self) -> float:
        """The angle; InputError where a part of a second is set."""
        angle = self.resolved().shutter
        assert angle is not None and not isinstance(angle, str)
        return angle

    @property
    def seconds(self) -> Fraction | None:
        """The exposure as a part of a second; None if it is in degrees.

        InputError for a text that is neither.
        """
        if not isinstance(self.shutter, str):
            return None
        match = re.fullmatch(r"(\d{1,6}(?:\.\d{1,6})?)/(\d{1,6}(?:\.\d{1,6})?)", self.shutter)
        if match is None or not Fraction(match[2]):
            raise InputError(
                f"`shutter` must be degrees such as 180, or a part of a second such as 1/48, "
                f"got {self.shutter!r}"
            )
        return Fraction(match[1]) / Fraction(match[2])

    @property
    def remark(self) -> str:
        """A line about an angle that is too small to be one, or an option without effect; or ''."""
        return "; ".join(filter(None, (self._few_degrees, self._without_rolling)))

    @property
    def _without_rolling(self) -> str:
        if self.rolling is not None or self.rolling_duration == 1.0:
            return ""
        return "`rolling_duration` has no effect without `rolling`"

    @property
    def _few_degrees(self) -> str:
        angle = self.shutter
        if isinstance(angle, str) or angle is None or not 0 < angle < _FEW_DEGREES:
            return ""
        return (
            f"`shutter` {angle:g} is in degrees, and hardly blurs; Blender's {angle:g} is "
            f"{360 * angle:g} degrees"
        )

    def curve_read(self) -> str | None:
        """Return the curve's name, and for a file its checksum, as its contents may change."""
        if self.curve is None or self.curve in CURVES:
            return self.curve
        return f"{self.curve} (CRC-32 {zlib.crc32(curve_bytes(self.curve)):08x})"

    @property
    def looks(self) -> dict[str, Any]:
        """The settings for a record."""
        return plain(self) | {"curve": self.curve_read()}

    def make(self) -> Shutter:
        """Return the Shutter these settings describe; of scenes, call `resolved` first."""
        angle = self.degrees
        phase: str | float = self.phase
        if phase not in PHASES:
            try:
                phase = float(phase)
            except ValueError:
                check_choice("`phase`", phase, ("start", "centre", "end"), " or a number")
        curve = self.curve or "box"
        if curve not in CURVES:
            if not readable(Path(curve)):
                check_choice("`curve`", curve, CURVES, " or a CSV file")
            curve = read_curve(curve)
        return Shutter(angle, phase, curve, self.rolling, self.rolling_duration)
