"""The form in which the pictures of a video are written."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from ...color.coding import Coding
from . import views
from .encoders import NO_FACTS, Encoding, Facts


@dataclass(frozen=True)
class VideoFormat:
    """Encoding, coding, size and clock of a video."""

    encoding: Encoding
    coding: Coding
    """As `encoding.coding` returned it."""
    size: tuple[int, int]
    """(width, height) [px]."""
    rate: Fraction
    """Pictures a second, usually."""
    base: Fraction
    """The tick of the file's clock [s], of which all times should be multiples (see clock.tick)."""
    facts: Facts = NO_FACTS

    @property
    def pixels(self) -> str:
        """The encoder's format of pixels."""
        return self.encoding.pixels(self.coding)

    @property
    def options(self) -> dict[str, str]:
        """The encoder's options."""
        return self.encoding.options(self.coding, self.facts)

    @property
    def left_out(self) -> list[str]:
        """Facts that the file cannot hold, in words."""
        of_views = views.left_out(self.facts, self.encoding.suffix)
        return [*self.encoding.left_out(self.facts), *of_views]

    @property
    def padding(self) -> tuple[int, int]:
        """Columns and rows that the encoder needs beyond `size`."""
        if not self.encoding.encoder.even:
            return 0, 0
        steps = self.coding.steps
        across, down = (-length % step for length, step in zip(self.size, steps, strict=True))
        return across, down

    @property
    def padded(self) -> tuple[int, int]:
        """The size with its padding [px]."""
        (width, height), (across, down) = self.size, self.padding
        return width + across, height + down
