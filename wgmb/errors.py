"""Exceptions raised by wgmb.

Error
├── InputError    invalid arrays, files or options (also a ValueError)
├── ShaderError   a WGSL file could not be read, compiled or bound; says file:line
├── DeviceError   no adapter, one that lacks a feature or a limit, or a device that was lost
└── GpuMemoryError  not enough GPU memory for one frame; other frames may still fit

A message names an argument that would help as `name=value` between backticks; the command line
spells it as its option.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

TYPE_CHECKING = False  # typing's own, without the time that loading it takes
if TYPE_CHECKING:
    from numpy.typing import NDArray


class Error(Exception):
    """Base class of wgmb's errors; the message states what was expected and what was given."""


class InputError(Error, ValueError):
    """Invalid arrays, files or options."""


class ShaderError(Error):
    """A shader could not be read, compiled or bound; the text names file and line."""


class DeviceError(Error):
    """No usable GPU adapter, a missing feature or limit, or a lost device."""


class GpuMemoryError(Error):
    """Not enough GPU memory for one frame; smaller or later frames may still fit."""


def reason(error: BaseException) -> str:
    """The error in one line that names the file it is about."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror.lower()}"
    return " ".join(str(error).split()) or type(error).__name__


def check_choice(name: str, value: object, known: Iterable[str], more: str = "") -> None:
    """InputError unless `value` is one of the `known` words.

    `name`: the argument. `more`: what it may be besides, such as " or a number".
    """
    words = list(known)
    if value not in words:
        hint = did_you_mean(value, words)
        raise InputError(f"{name} must be one of {', '.join(words)}{more}, got {value!r}{hint}")


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """The end of a message about a word that is not among the `known` ones, if one is close."""
    from difflib import get_close_matches  # only when something is wrong

    close = get_close_matches(str(word), [str(k) for k in known], n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


_MEANT = {  # names that people know from other programs, and the setting that they look for
    "shutter": "angle shutter_angle shutter_degrees amount blur_amount blur strength",
    "streams video": "no_audio no_sound audio sound mute an no_subtitles",
    "fps": "framerate frame_rate rate output_fps fps_out",
    "fps_in": "input_fps source_fps",
    "output": "out to destination",
    "adapter": "gpu",
    "device": "gpu adapter",
    "begin": "start ss from_time",
    "end": "stop duration until",
    "quality": "crf qp cq",
    "codec": "vcodec video_codec",
    "holdout": "mask masks",
    "overwrite": "force yes y",
    "workers": "threads jobs processes cores",
    "frames": "range frame_range",
    "flow none": "no_flow",
    "cuts none": "no_cuts",
    "duplicates fill": "deduplicate dedup",
    "samples": "spp quality_samples steps",
}
_NEAR = 0.75  # of difflib's ratio, from which a name is taken for a slip


def meant_setting(name: str, known: Collection[str]) -> tuple[str, str]:
    """The setting among the `known` that a wrong name means, and the value it takes then, or "".

    Names are written with underscores. ("", "") where no setting is near: a guess would mislead.
    """
    from difflib import SequenceMatcher  # only when something is wrong

    for meant, words in _MEANT.items():
        setting, _, value = meant.partition(" ")
        if name in words.split() and setting in known:
            return setting, value
    near = {k: SequenceMatcher(None, name, k).ratio() for k in known}
    best = max(near, key=near.__getitem__, default="")
    is_slip = best and (near[best] >= _NEAR or sorted(name) == sorted(best))
    return (best, "") if is_slip else ("", "")


def did_you_mean_setting(name: str, known: Collection[str]) -> str:
    """The end of a message about a keyword that is not among the `known` ones, if one is meant."""
    setting, value = meant_setting(name, known)
    return f"; did you mean {f'{setting}={value!r}' if value else repr(setting)}?" * bool(setting)


def counted(number: int, noun: str) -> str:
    """A number of things, for messages: 1 frame, 3 frames."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def size_text(of: NDArray[Any] | tuple[int, int]) -> str:
    """Width x height of a plane, or of a pair, for messages."""
    width, height = of if isinstance(of, tuple) else of.shape[::-1]
    return f"{width} x {height}"
