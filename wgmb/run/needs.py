"""Needs of the chosen method, compared with the frames before any is blurred."""

from __future__ import annotations

import contextlib

from ..errors import InputError
from ..methods import METHODS, frame_methods
from ..sequence.clip import Clip
from ..sequence.frame_file import FrameFile
from ..sequence.layers.names import layers


def check_needs(clip: Clip, method: str) -> None:
    """InputError where the first, the middle and the last frame lack what the method needs.

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
