"""A request to blur rendered frames: every setting, as `wgmb blur` receives it."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

from ..color.spaces import Display
from ..errors import InputError
from ..methods import METHODS, frame_methods
from ..sequence.clip import Clip
from ..sequence.findings import SequenceFindings
from ..sequence.frame_file import FrameFile
from ..sequence.layers.names import layers
from ..settings import OutputSettings, rate_of
from ..settings.color import color_record
from ..settings.groups import SettingsGroups
from .conversion import RateConversion


@dataclass(frozen=True, kw_only=True)
class BlurRequest(SettingsGroups):
    """Request to blur rendered frames, as `wgmb blur` receives it."""

    pattern: str
    output: OutputSettings
    confidence: bool = False
    fps_in: str | None = None
    averages: bool = False
    """The frames have no motion, and `flow` is "none"; found out by `settle`."""
    is_by_place: bool = False
    """Their motion is found by dense inverse search, better by place; found out by `settle`."""
    has_edges_gathered: bool = False
    """Frames with edges of motion are blurred by gather there; found out by `settle`."""

    @property
    def conversion(self) -> RateConversion | None:
        """To the output's rate, if the frames have another one; InputError where it cannot be.

        Frames that are averaged are also converted to their own rate.
        """
        made = self._rates
        if made is None or (made.step == 1 and not self.averages):
            return None
        by = "`flow` none" if made.step == 1 else "`fps_in`"
        if self.confidence:
            raise InputError(f"`confidence` cannot be combined with {by}")
        if self.shutter.make().rolling is not None:
            raise InputError(f"a rolling shutter needs frames of the output's own rate, not {by}")
        return made

    @property
    def _rates(self) -> RateConversion | None:
        """Rates of the frames and of the output; None if they are not to differ."""
        if self.fps_in is None:
            return RateConversion(self.output.rate, self.output.rate) if self.averages else None
        if self.output.fps is None:
            raise InputError("`fps_in` needs `fps`, the rate of the output, such as 60")
        return RateConversion(rate_of(self.fps_in, "fps_in"), self.output.rate)

    def opened(self, settled: SequenceFindings | None = None) -> tuple[Clip, Display | None]:
        """The Clip, and how it is shown."""
        shown = self.color.open(needed=not self.output.is_exr)
        input = replace(self.input, frames=None, skip_missing=True) if settled else self.input
        space = self.color.space(shown)
        holdout, scale = self.blur.holdout, self.blur.scale
        holdout = () if holdout == ("none",) else holdout
        return input.open(self.pattern, holdout, scale, space, settled), shown

    def color_record(self, display: Display | None) -> dict[str, str | None]:
        """Colour settings that change the contents of the files."""
        space = self.color.space(display)
        return color_record(display, self.output.output, space, self.pattern)


def check_needs(clip: Clip, method: str) -> None:
    """InputError where the first, middle and last frame lack layers that the method needs.

    A frame that alone lacks it, or cannot be read, fails in its turn.
    """
    numbers = clip.numbers
    errors: list[InputError] = []
    for number in dict.fromkeys(numbers[i] for i in (0, len(numbers) // 2, -1)):
        with contextlib.suppress(InputError, OSError):
            source = clip.source(number)
            has = {"color", *clip.frame(source, picture=False, normal=False, light=False).has}
            missing = METHODS[method].needs - has
            if not missing:
                return
            errors.append(_lacking(str(clip.pattern), source, method, missing))
    if errors:
        raise errors[0]


def _lacking(pattern: str, source: FrameFile, method: str, missing: frozenset[str]) -> InputError:
    names = [name for name in layers(source.channels) if name]
    there = f" (layers: {', '.join(names)})" if names else ""
    if "motion" in missing:
        return InputError(
            f"{pattern} has no motion vectors{there}; name several frames, such as "
            f"'shot.####{source.path.suffix}', to find the motion in their pictures, or "
            "give a `camera` file for frames with depth"
        )
    able = [name for name in frame_methods() if METHODS[name].needs <= {"color", "motion"}]
    return InputError(
        f"{pattern} has no depth{there}; {method} needs it, {' and '.join(able)} do not"
    )
