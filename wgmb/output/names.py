"""The names of outputs: which exist, and which must not be written."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable
from pathlib import Path

from ..errors import InputError
from ..io.frame_numbers import is_pattern, numbered, numbers_on_disk
from ..io.suffixes import STILLS, VIDEOS

ENDS = ".exr", *STILLS, *VIDEOS
"""The ends of the names of outputs."""


def check_suffix(pattern: str | Path, known: Collection[str] = ENDS) -> None:
    """InputError for an output of a kind that is not among the `known`."""
    if Path(pattern).suffix.lower() not in known:
        raise InputError(f"output {pattern}: the name must end in one of {', '.join(known)}")


def refuse_inputs(
    folder: Path, names: Iterable[str], existing: Iterable[Path], inputs: Iterable[Path]
) -> None:
    """InputError where an output, NAME in `folder`, is one of `inputs`.

    By the folder itself, however it is reached; and, for `existing`, the outputs that exist, by the
    file itself, whatever links lead to it.
    """
    real = Path(os.path.realpath(folder))  # also through folders that are to be made
    place, wanted, folders = _identity(real), set(names), {}
    outputs = {_identity(path): path for path in existing}
    for path in inputs:
        if path.parent not in folders:
            folders[path.parent] = _identity(path.parent)
        same = place is not None and folders[path.parent] == place and path.name in wanted
        if same or (outputs and (own := _identity(path)) is not None and own in outputs):
            written = folder / path.name if same else outputs[_identity(path)]
            raise InputError(f"output {written} is the input {path}; choose another name or folder")


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and number of a file or folder; None where there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino


def that_exist(folder: Path, names: Iterable[str]) -> list[Path]:
    """The files of these names that there are in `folder`."""
    try:
        existing = set(os.listdir(os.path.realpath(folder)))
    except OSError:  # not there yet, or said when it is prepared
        return []
    return [folder / name for name in names if name in existing]


def beyond(pattern: str | Path, last: int) -> str:
    """A line on the files of `pattern` with higher numbers than `last`; "" if there are none.

    They are of a longer run, where numbers count output frames. They are never deleted.
    """
    try:
        numbers = [n for n in numbers_on_disk(pattern) if n > last] if is_pattern(pattern) else []
    except InputError:  # there are none at all
        numbers = []
    if not numbers:
        return ""
    remain = "remains" if len(numbers) == 1 else "remain"
    return f"{numbered(numbers)} of a longer run {remain}"


def prepare(folder: Path) -> None:
    """Make the folder of an output; InputError where it cannot be, or cannot be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"output folder {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"output folder {folder}: not writable")
