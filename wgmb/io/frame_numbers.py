"""Frame numbers and file names: `shot.####.exr`, `shot.%04d.exr`, `$F4`; `1-100x2`; `%V`."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, did_you_mean

if TYPE_CHECKING:
    from fileseq.frameset import FrameSet

MOST_FRAMES = 1_000_000
"""Largest number of frames in one run."""
_NUMBER = re.compile(r"[#@]+|%0*([0-9]{0,3})d|\$F0*([0-9]{0,3})")
_COUNTED = re.compile(r"\d+(?=\.[A-Za-z]\w*$)")  # the number of a frame, before the suffix
_COLON = re.compile(r"(-?\d+)\s*-\s*(-?\d+)\s*:\s*(\d+)")
_RANGE = re.compile(r"(-?\d+)\s*-\s*(-?\d+)(?:\s*x\s*(\d+))?")


@dataclass(frozen=True)
class _Pattern:
    """A path in whose file name a number is left open."""

    folder: Path
    begin: str
    digits: int
    end: str

    def names(self, number: int) -> tuple[str, ...]:
        """Names of a frame's file. The sign of a negative number counts as a digit, as C's %04d
        counts it, or does not, as Blender and Houdini write it."""
        wide = (self.digits, self.digits + 1) if number < 0 else (self.digits,)
        return tuple(f"{self.begin}{number:0{width}d}{self.end}" for width in wide)


@lru_cache(maxsize=256)
def _parsed(path: str | Path) -> _Pattern | None:
    """The last run of # or @, %04d or $F4 in the file name is the number, all else literal."""
    whole = Path(path)
    places = list(_NUMBER.finditer(whole.name))
    if not places:
        return None
    place = places[-1]
    digits = len(place[0]) if place[0][0] in "#@" else int(place[1] or place[2] or 1)
    return _Pattern(whole.parent, whole.name[: place.start()], digits, whole.name[place.end() :])


def is_pattern(path: str | Path) -> bool:
    """Return True if a path is a pattern for several frames."""
    return _parsed(path) is not None


def frame_path(pattern: str | Path, number: int) -> Path:
    """The file of frame `number`; a path that is no pattern stands for itself.

    Of the two forms of a negative number, the one that exists, or else the first.
    """
    parsed = _parsed(pattern)
    if parsed is None:
        return Path(pattern)
    first, *others = (parsed.folder / name for name in parsed.names(number))
    return first if not others or first.exists() else next(filter(Path.exists, others), first)


def titles(patterns: Sequence[str | Path]) -> list[str]:
    """Names of files or patterns, without number, view and ending; all differ.

    `mv.%V.####.exr` is mv. One that is called as another before it is called as the folder in
    which its path differs from the first: beauty/s.####.exr, mv/s.####.exr are s and mv.
    """
    found: list[str] = []
    for i, pattern in enumerate(patterns):
        folders = zip_longest(*(Path(p).parts[-2::-1] for p in (pattern, patterns[0])))
        names = [_title(pattern), *(_plain(own or "") for own, other in folders if own != other)]
        free = [name for name in names if name and name not in found]
        found.append(free[0] if free else f"{names[0]}_{i + 1}")
    return found


def _title(path: str | Path) -> str:
    parsed = _parsed(path)
    if parsed is None:
        return _plain(re.sub(r"([0-9]+)(?=\.[^.\d][^.]*$)", "", Path(path).name).rpartition(".")[0])
    return _plain(parsed.begin + "." + parsed.end.rpartition(".")[0])


def _plain(name: str) -> str:
    """A name as one of a layer: without %V, and `_` for the characters between words."""
    return re.sub(r"[\W_]+", "_", name.replace("%V", "")).strip("_")


def has_view(path: str | Path) -> bool:
    """Return True if %V stands for the name of a view in a path."""
    return "%V" in str(path)


def in_view(path: str | Path, view: str | None) -> Path:
    """The path or pattern with the name of `view` for %V; unchanged if there is no view."""
    return Path(path) if view is None else Path(str(path).replace("%V", view))


def views_on_disk(pattern: str | Path) -> tuple[str, ...]:
    """The names for %V in a path or pattern for which there are files, in alphabetical order."""
    parts = Path(pattern).parts
    at = next(i for i, part in enumerate(parts) if "%V" in part)
    folder, part, last = Path(*parts[:at]), parts[at], at == len(parts) - 1
    places = list(_NUMBER.finditer(part)) if last else []
    begin, end = (part[: places[-1].start()], part[places[-1].end() :]) if places else (part, "")
    expression = re.escape(begin) + ("-?[0-9]+" if places else "") + re.escape(end)
    expression = expression.replace("%V", r"(?P<view>[^.\s]+?)", 1).replace("%V", "(?P=view)")
    try:
        matches = [m for m in map(re.compile(expression).fullmatch, os.listdir(folder)) if m]
    except OSError as error:
        raise InputError(f"{folder}: {(error.strerror or str(error)).lower()}") from None
    return tuple(sorted(v for v in {m["view"] for m in matches} if _is_there(in_view(pattern, v))))


def _is_there(pattern: Path) -> bool:
    """Return True if there is a file of this path or pattern."""
    if not is_pattern(pattern):
        return pattern.is_file()
    try:
        return bool(numbers_on_disk(pattern))
    except InputError:
        return False


def readable(path: Path) -> bool:
    """Return True if the path is a file; InputError if it is not readable."""
    try:
        if not path.is_file():
            return False
        with open(path, "rb"):
            return True
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or str(error)).lower()}") from None


def numbers_on_disk(pattern: str | Path) -> list[int]:
    """The frames of a pattern that exist, padded as it says, in order; at least one."""
    parsed = _parsed(pattern)
    if parsed is None:
        raise InputError(f"{pattern}: not a frame pattern such as shot.####.exr")
    name = re.compile(f"{re.escape(parsed.begin)}(-?[0-9]+){re.escape(parsed.end)}")
    try:
        matches = [m for m in map(name.fullmatch, os.listdir(parsed.folder)) if m]
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{parsed.folder}: {(why or str(error)).lower()}") from None
    numbers = sorted({int(m[1]) for m in matches if m[0] in parsed.names(int(m[1]))})
    if not numbers:
        raise InputError(f"{pattern}: no such frames{_near(pattern)}")
    return numbers


def patterns_in(folder: str | Path) -> list[str]:
    """The names of the sequences in a folder, with # for the digits of their numbers."""
    names = [name for name in os.listdir(folder or ".") if _COUNTED.search(name)]
    return sorted({_COUNTED.sub(lambda m: "#" * len(m[0]), name) for name in names})


def sequences_in(folder: str | Path) -> list[Path]:
    """The patterns of the sequences in a folder: one for names that differ in their number alone,
    with as many digits as its shortest number has.
    """
    shortest: dict[str, str] = {}
    for name in patterns_in(folder):
        alike = re.sub("#+", "#", name)
        shortest[alike] = min(shortest.get(alike, name), name, key=len)
    return [Path(folder) / name for name in sorted(shortest.values())]


def singles_in(folder: str | Path) -> list[Path]:
    """The files in a folder that have no number, hidden ones apart."""
    names = [name for name in os.listdir(folder) if name[0] != "." and not _COUNTED.search(name)]
    return [path for name in sorted(names) if (path := Path(folder) / name).is_file()]


def title(path: str | Path) -> str:
    """The name of a file or pattern without number, view and ending."""
    return _title(path)


def _near(pattern: str | Path) -> str:
    """The end of a message on frames that are not there: a sequence that may be meant, or ''."""
    folder, name = os.path.split(str(pattern))
    stem = _stem(name)
    there = [one for one in patterns_in(folder) if did_you_mean(stem, [_stem(one)])]
    meant = did_you_mean(name, there)  # the number is as long in all, and says nothing
    return meant if folder == "" else meant.replace("'", f"'{folder}{os.sep}", 1)


def _stem(name: str) -> str:
    """The name before its number, without the marks between: shot.####.exr -> shot."""
    return _NUMBER.split(name)[0].rstrip("._-")


def frame_numbers(text: str, name: str = "frames") -> list[int]:
    """The numbers that `1-100x2`, `1-100:2` or `1,3,5-8` stands for, in that order.

    At most MOST_FRAMES. A colon is the step of OpenJD's ranges. `name`: for messages.
    """
    asked = f"{name} {text if len(text) < 60 else f'{text[:60]}...'!r}"
    text = _COLON.sub(r"\1-\2x\3", text)
    try:
        ranges = [(int(a), int(b), int(step or 1)) for a, b, step in _RANGE.findall(text)]
        count = sum(abs(b - a) // max(step, 1) + 1 for a, b, step in ranges)
        sensible = count <= MOST_FRAMES and "." not in text
        numbers = [int(n) for n in _frame_set(text)] if sensible else []
    except ValueError:  # such as those of fileseq
        count, numbers = 0, []
    if count > MOST_FRAMES:
        raise InputError(f"{asked}: {count} frames, but one run takes {MOST_FRAMES} at most")
    if not numbers:
        raise InputError(f"{asked}: must be whole numbers such as 1-100, 1-100x2 or 1,3,5-8")
    return numbers


def frame_range(numbers: list[int]) -> str:
    """Numbers as `frame_numbers` takes them: `1-4,9`."""
    return str(_frame_set(numbers))


def _frame_set(of: str | list[int]) -> FrameSet:
    """Numbers as fileseq reads and writes them; it is loaded where numbers are given."""
    from fileseq.frameset import FrameSet

    return FrameSet(of)


def numbered(numbers: list[int], noun: str = "frame") -> str:
    """Numbers for people, with their noun: frame 9, frames 9-11."""
    return f"{noun}{'' if len(numbers) == 1 else 's'} {frame_list(numbers)}"


def frame_list(numbers: list[int], longest: int = 120) -> str:
    """Numbers for people: as `frame_range`, cut off after `longest` characters."""
    text = frame_range(numbers)
    if len(text) <= longest:
        return text
    return f"{text[:longest].rpartition(',')[0]},... ({len(numbers)} frames)"


def number_in(path: Path) -> int:
    """The frame number at the end of a file's name; 0 if there is none."""
    m = re.search(r"([0-9]+)(?=\.[^.\d][^.]*$)", path.name)
    return int(m[1]) if m else 0
