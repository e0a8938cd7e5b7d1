"""Settings of the output files."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from ..color.spaces import Display
from ..errors import InputError
from ..output.output import Output, check_uses
from .record import plain

_NO_LOOK = "output", "fps", "overwrite", "resume"


@dataclass(frozen=True, kw_only=True)
class OutputSettings:
    """Output files."""

    output: str
    "Pattern or file: .exr .png .jpg .tif, or a video .mp4 .mov .mkv .webm .gif."
    bits: int = 8
    "Bits per sample of PNG and TIFF: 8 or 16."
    fps: str | None = None
    "Frames per second, such as 60 or 30000/1001; default: 24, or the rate of an input video."
    overwrite: bool = False
    "Replace existing files."
    resume: bool = False
    "Keep finished frames; make frames with changed settings or inputs again."
    layers: Literal["all", "picture"] = "all"
    "EXR to EXR: copy all layers of the input, or write the picture only (faster)."
    compression: str = "zip"
    "EXR: none, rle, zips, zip, piz; lossy: pxr24, b44, b44a, dwaa, dwab; or same (as the input)."
    window: Literal["grow", "keep"] = "grow"
    "EXR: the data window grows with the streaks, or keeps the input's size."

    @property
    def is_exr(self) -> bool:
        """True if the output keeps linear light, instead of showing it to people."""
        return self.output.lower().endswith(".exr")

    def check(self) -> None:
        """InputError for an option that has no use for this kind of output, as from `make`."""
        check_uses(self.output, **self.looks)

    @property
    def looks(self) -> dict[str, Any]:
        """The settings that change the contents of the files; the Output has them too."""
        return {k: v for k, v in plain(self).items() if k not in _NO_LOOK}

    def make(
        self,
        settings: dict[str, Any],
        numbers: list[int],
        inputs: Iterable[Path] = (),
        views: Sequence[str] = (),
        display: Display | None = None,
        since: int | None = None,
    ) -> Output:
        """The Output for frames of these `numbers`; see there for the others."""
        return Output(
            self.output,
            settings=settings,
            numbers=numbers,
            fps=self.rate,
            inputs=inputs,
            overwrite=self.overwrite,
            resume=self.resume,
            views=views,
            display=display,
            since=since,
            **self.looks,
        )

    @property
    def rate(self) -> Fraction:
        """Frames per second, exactly."""
        return self.rate_or(Fraction(24))

    def rate_or(self, rate: Fraction) -> Fraction:
        """Frames per second, exactly; `rate` unless another is set."""
        return rate if self.fps is None else rate_of(self.fps)


def rate_of(text: str, name: str = "fps") -> Fraction:
    """`24`, `23.976`, `30000/1001` -> frames per second, exactly; 0.001 to 1000.

    `name`: of the setting, for messages.
    """
    try:
        if re.search(r"e[+-]?[\d_]{4}", text, re.IGNORECASE):  # would be worked out in full
            raise ValueError
        fps = Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"`{name}` must be a number or a fraction, got {text!r}") from None
    if not Fraction(1, 1000) <= fps <= 1000:
        raise InputError(f"`{name}` must be 0.001 to 1000, got {text}")
    return fps
