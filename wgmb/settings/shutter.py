"""Settings of the shutter."""

import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

from ..errors import check_choice
from ..io.frame_numbers import readable
from ..scene.scene import Scene
from ..shutter import (
    CURVES,
    PHASES,
    Shutter,
    curve_bytes,
    read_curve,
)
from .record import plain


@dataclass(frozen=True, kw_only=True)
class ShutterSettings:
    """Shutter angle, phase and curve."""

    shutter: float | None = None
    "Shutter angle in degrees; 360 is one frame interval. Default: 180 (scenes: their own)."
    phase: str = "centre"
    "start (opens at the frame), centre, end (closes at it), or the time of its middle in frames."
    curve: str | None = None
    "box (default), trapezoid, triangle, cosine, gaussian, or a CSV file of time, weight."
    rolling: Literal["up", "down", "left", "right"] | None = None
    "Rolling shutter: direction in which the exposure moves across the image."
    rolling_duration: float = 1.0
    "Rolling shutter: delay from the first row or column to the last, in frame intervals."

    def resolved(self, scene: Scene | None = None, fps: float = 24.0) -> Self:
        """Return a copy with unset fields taken from the scene, or 180 degrees and a box."""
        degrees, curve = 180.0, "box"
        if scene is not None and scene.exposure is not None:
            seconds, curve = scene.exposure
            degrees = round(360 * seconds * fps, 9)
        return replace(
            self,
            shutter=degrees if self.shutter is None else self.shutter,
            curve=curve if self.curve is None else self.curve,
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
        """Return the Shutter these settings describe; call `resolved` first."""
        phase: str | float = self.phase
        if phase not in PHASES:
            try:
                phase = float(phase)
            except ValueError:
                check_choice("phase", phase, ("start", "centre", "end"), " or a number")
        curve = self.curve
        assert self.shutter is not None and curve is not None
        if curve not in CURVES:
            if not readable(Path(curve)):
                check_choice("curve", curve, CURVES, " or a CSV file")
            curve = read_curve(curve)
        return Shutter(self.shutter, phase, curve, self.rolling, self.rolling_duration)
