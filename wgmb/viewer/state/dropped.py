"""The source that files, folders and sequences dropped onto the window stand for."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError
from ...io.suffixes import STILLS, VIDEOS
from ...sequence.frame_file import is_video

_DIGITS = re.compile(r"(\d+)(?=\D*$)")
_FRAMES = (".exr", *STILLS)


def source_of(paths: Sequence[str | Path]) -> str:
    """The video or the pattern of frames; InputError names what cannot be shown.

    Of a folder, it is the sequence with the most frames; of one frame, that which it is one of.
    """
    files = [path for path in map(Path, paths) if not path.is_dir()]
    for folder in (path for path in map(Path, paths) if path.is_dir()):
        files += sorted(one for one in folder.iterdir() if one.is_file())
    if len(paths) == 1 == len(files) and files[0] == Path(paths[0]) and is_video(files[0]):
        return str(files[0])
    for file in files:
        if file.suffix.lower() in VIDEOS:
            return str(file)
    frames = [file for file in files if file.suffix.lower() in _FRAMES]
    if not frames:
        names = ", ".join(Path(path).name for path in paths)
        raise InputError(f"neither frames ({' '.join(_FRAMES)}) nor a video: {names}")
    pattern, count = Counter(map(pattern_of, frames)).most_common(1)[0]
    return pattern if count > 1 or len(_like(pattern)) > 1 else str(frames[0])


def pattern_of(file: Path) -> str:
    """The pattern that a frame is one of: the last number in its name is left open."""
    return str(file.with_name(_DIGITS.sub(lambda m: "#" * len(m[0]), file.stem) + file.suffix))


def _like(pattern: str) -> list[Path]:
    whole = Path(pattern)
    return [one for one in whole.parent.iterdir() if pattern_of(one) == pattern]
