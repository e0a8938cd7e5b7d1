"""Frame numbers and file names: `shot.####.exr`, `shot.%04d.exr`, `$F4`; `1-100x2`."""

from __future__ import annotations

import re
from pathlib import Path

from fileseq.constants import PAD_STYLE_HASH1
from fileseq.exceptions import FileSeqException
from fileseq.filesequence import FileSequence
from fileseq.frameset import FrameSet

from .errors import InputError

_PATTERN = re.compile(r"[#@]|%\d*d|\$F\d*")


def is_pattern(path: str | Path) -> bool:
    """Whether a path stands for many frames."""
    return bool(_PATTERN.search(Path(path).name))


def _sequence(pattern: str | Path) -> FileSequence:
    """The file name alone: a folder may be called what it likes."""
    try:
        return FileSequence(Path(pattern).name, pad_style=PAD_STYLE_HASH1)
    except FileSeqException as error:
        raise InputError(f"{pattern}: not a frame pattern: {error}") from None


def frame_path(pattern: str | Path, number: int) -> Path:
    """The file of frame `number`; a path that is no pattern stands for itself."""
    if not is_pattern(pattern):
        return Path(pattern)
    return Path(pattern).parent / _sequence(pattern).frame(number)


def frame_numbers(text: str) -> list[int]:
    """The numbers that `1-100x2` or `1,3,5-8` stands for, in that order."""
    try:
        numbers = [int(n) for n in FrameSet(text)]
    except (FileSeqException, ValueError) as error:
        raise InputError(f"frames {text!r}: {error}") from None
    if not numbers:
        raise InputError(f"frames {text!r}: none")
    return numbers


def frame_range(numbers: list[int]) -> str:
    """Numbers for people: `1-4,9`."""
    return str(FrameSet(numbers))


def numbers_on_disk(pattern: str | Path) -> list[int]:
    """The frames of a pattern that exist, padded as it says, in order; at least one."""
    sequence, folder = _sequence(pattern), Path(pattern).parent
    begin, end = re.escape(sequence.basename()), re.escape(sequence.extension())
    name = re.compile(rf"{begin}(-?\d+){end}")
    try:
        matches = [m for m in map(name.fullmatch, (p.name for p in folder.iterdir())) if m]
    except OSError as error:
        raise InputError(f"{folder}: {(error.strerror or str(error)).lower()}") from None
    found = sorted(int(m[1]) for m in matches if sequence.frame(int(m[1])) == m[0])
    if not found:
        raise InputError(f"{pattern}: no such frames")
    return found


def number_in(path: Path) -> int:
    """The frame number at the end of a file's name; 0 if there is none."""
    m = re.search(r"(\d+)(?=\.[^.\d][^.]*$)", path.name)
    return int(m[1]) if m else 0
