"""HDR data of a video: the display it was graded on (SMPTE ST 2086, CTA-861.3), Dolby Vision."""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass

_RATIONALS = struct.Struct("=20i2i")  # AVMasteringDisplayMetadata of FFmpeg
_LEVELS = struct.Struct("=2I")  # the beginning of its AVContentLightMetadata
_CHROMATICITY = 50000  # steps to 1, as bit streams count
_LUMINANCE = 10000  # steps to 1 cd/m2


@dataclass(frozen=True)
class Mastering:
    """The mastering display; None where it is not told."""

    primaries: tuple[tuple[float, float], ...] | None
    """x, y (CIE 1931) of red, green, blue and white."""
    luminance: tuple[float, float] | None
    """Least and greatest [cd/m2]."""

    @staticmethod
    def read(data: bytes) -> Mastering:
        """From FFmpeg's side data."""
        *numbers, has_primaries, has_luminance = _RATIONALS.unpack_from(data)
        ratios = [n / d if d else 0.0 for n, d in zip(numbers[::2], numbers[1::2], strict=True)]
        points = tuple(zip(ratios[:8:2], ratios[1:8:2], strict=True))
        return Mastering(
            points if has_primaries else None,
            (ratios[8], ratios[9]) if has_luminance else None,
        )

    @property
    def is_whole(self) -> bool:
        """Return True if all of it is told; encoders take nothing less."""
        return self.primaries is not None and self.luminance is not None

    def for_x265(self) -> str:
        """The value of x265's option master-display."""
        assert self.primaries is not None and self.luminance is not None
        red, green, blue, white = (
            f"({round(x * _CHROMATICITY)},{round(y * _CHROMATICITY)})" for x, y in self.primaries
        )
        least, most = (round(v * _LUMINANCE) for v in self.luminance)
        return f"G{green}B{blue}R{red}WP{white}L({most},{least})"

    def for_svt_av1(self) -> str:
        """The value of SVT-AV1's option mastering-display."""
        assert self.primaries is not None and self.luminance is not None
        red, green, blue, white = (f"({x:.5f},{y:.5f})" for x, y in self.primaries)
        least, most = self.luminance
        return f"G{green}B{blue}R{red}WP{white}L({most:.4f},{least:.4f})"

    def __str__(self) -> str:
        parts = []
        if self.luminance is not None:
            parts.append("{:g} to {:g} cd/m2".format(*self.luminance))
        if self.primaries is not None:
            names = ("red", "green", "blue", "white")
            points = zip(names, self.primaries, strict=True)
            parts.append(", ".join(f"{name} {x:.3f} {y:.3f}" for name, (x, y) in points))
        return "; ".join(parts)


@dataclass(frozen=True)
class LightLevel:
    """The brightest pixel and the brightest picture [cd/m2]."""

    max_cll: int
    max_fall: int

    @staticmethod
    def read(data: bytes) -> LightLevel:
        """From FFmpeg's side data."""
        return LightLevel(*_LEVELS.unpack_from(data))

    def __str__(self) -> str:
        """As x265 and SVT-AV1 take it."""
        return f"{self.max_cll},{self.max_fall}"


def is_base_layer(dolby_vision: bytes) -> bool:
    """Return True if pictures with this AVDOVIMetadata have colours of their own.

    Those of profile 5 are in coordinates (IPT) that only Dolby Vision's data makes colours of.
    """
    with suppress(struct.error):
        (header,) = struct.unpack_from("=Q", dolby_vision)  # where AVDOVIRpuDataHeader begins
        profile, full_range = struct.unpack_from("=B5xB", dolby_vision, header + 4)
        return not (profile == 0 and full_range)  # as FFmpeg tells profile 5
    return True
