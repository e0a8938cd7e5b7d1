"""A folder of frames as programs write it: picture, vectors and depth, found by their names."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ..errors import InputError, counted
from ..io import exr
from ..io.data_files import FLO
from ..io.frame_numbers import (
    frame_path,
    is_pattern,
    number_in,
    numbered,
    numbers_on_disk,
    sequences_in,
    singles_in,
    title,
)
from .layers import light, names, vectors

_KINDS = (".exr", FLO, ".tif", ".tiff", ".png", ".jpg", ".jpeg")
"""Ends of names: of files that are called the same, the first is taken."""
_OTHERS = frozenset(
    ("normal", "normals", "position", "positions", "uv", "crypto", "cryptomatte", "cryptoobject",
     "cryptomaterial", "cryptoasset", "matte", "mattes", "mask", "masks", "ao",
     "ambientocclusion", "shadow", "shadows", "mist", "emission", "emit", "indexob", "indexma",
     "id", "ids", "alpha", "albedo", "env", "environment", "denoisingalbedo", "denoisingnormal")
)  # fmt: skip
"""Ends of the names of passes that are neither picture, vectors nor depth."""


@dataclass(frozen=True)
class FolderFrames:
    """The frames in a folder: the pattern of the picture, those of the files that go with it, and
    a line about them."""

    pattern: str
    also: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class _Sequence:
    """A sequence in a folder or a folder within; a file without a number is a sequence of one."""

    pattern: Path
    folder: Path

    @cached_property
    def numbers(self) -> frozenset[int]:
        if self.is_single:
            return frozenset((number_in(self.pattern),))
        return frozenset(numbers_on_disk(self.pattern))

    @property
    def is_single(self) -> bool:
        """True for a file without a number."""
        return not is_pattern(self.pattern)

    def goes_with(self, picture: _Sequence) -> bool:
        """True if it has frames of the picture; a file without a number goes with a single one."""
        return self.is_single or picture.is_single or bool(self.numbers & picture.numbers)

    @cached_property
    def titles(self) -> list[str]:
        """Its name, and that of the folder within in which it is."""
        inner = self.pattern.parent.relative_to(self.folder).parts
        return [name for name in (title(self.pattern), *inner) if name]

    @cached_property
    def channels(self) -> list[str]:
        """Channels of its first file, if it is an EXR that can be read."""
        with contextlib.suppress(InputError, OSError):  # its turn to fail comes
            if self.pattern.suffix.lower() == ".exr":
                first = frame_path(self.pattern, min(self.numbers))
                return list(exr.read(first, header_only=True).channels())
        return []

    def says(self, of: Callable[[str], object]) -> bool:
        """True if its name, or else that of its folder, is such."""
        return any(bool(of(name)) for name in self.titles)

    @property
    def direction(self) -> int | None:
        """Of motion, as its name says (see vectors.direction_of)."""
        found = (vectors.direction_of(name) for name in self.titles)
        return next((one for one in found if one is not None), None)

    @property
    def is_depth(self) -> bool:
        return self.direction is None and self.says(names.is_depth)

    @property
    def is_other(self) -> bool:
        """True if its name says that it is a pass that is no picture."""
        if self.direction is not None or self.is_depth:
            return True
        return self.says(lambda name: names.ending(name, _OTHERS) or light.is_pass(name))

    @property
    def has_vectors(self) -> bool:
        return vectors.named(self.channels, vectors.Vectors()) is not None

    @property
    def place(self) -> int:
        return _KINDS.index(self.pattern.suffix.lower())

    def __str__(self) -> str:
        return str(self.pattern.relative_to(self.folder))


def frames_in(folder: str | Path, also: tuple[str, ...] = (), leave_out: str = "") -> FolderFrames:
    """The frames in a folder or in the folders directly within.

    `also`: patterns that are to go with the picture, instead of those found. `leave_out`: a pattern
    that is no input. InputError, in which both are named, where two are as good.
    """
    base = Path(folder)
    there = [s for s in _sequences(base) if not leave_out or s.pattern != Path(leave_out)]
    picture = _picture(base, there)
    others = [s for s in there if s is not picture]
    companions = [s for s in others if s.goes_with(picture)]
    beside: dict[str, list[_Sequence]] = {"vectors": [], "depth": []}
    if not also and not picture.has_vectors:
        vectors = (
            _one(base, companions, "vectors", lambda s, d=d: s.direction == d) for d in (1, -1)
        )
        beside["vectors"] = [s for s in vectors if s is not None]
    if not also and names.find_depth(picture.channels) is None:
        depth = _one(base, companions, "depth", lambda s: s.is_depth)
        beside["depth"] = [depth] if depth is not None else []
    own = [f"picture {picture}"]
    own += [f"{kind} {' and '.join(map(str, some))}" for kind, some in beside.items() if some]
    text = f"{base}: {', '.join(own)} ({counted(len(picture.numbers), 'frame')})"
    if not also:
        needed = {
            "vectors": not picture.has_vectors and not beside["vectors"],
            "depth": names.find_depth(picture.channels) is None and not beside["depth"],
        }
        text += _left_out(picture, [s for s in others if s not in companions], needed)
    patterns = tuple(str(s.pattern) for some in beside.values() for s in some)
    return FolderFrames(str(picture.pattern), also or patterns, text)


def _left_out(picture: _Sequence, others: list[_Sequence], needed: dict[str, bool]) -> str:
    """The end of the line about passes that would be taken if their frames had the same numbers."""
    kinds = {"vectors": lambda s: s.direction is not None, "depth": lambda s: s.is_depth}
    text = ""
    for kind in (kind for kind, is_needed in needed.items() if is_needed):
        for one in [s for s in others if kinds[kind](s)][:1]:
            own, wanted = (numbered(sorted(s.numbers)) for s in (one, picture))
            text += f"; {kind} {one} left out, as it holds {own}, and the picture holds {wanted}"
    return text


def _sequences(base: Path) -> list[_Sequence]:
    """The sequences; if none has a second frame, files without a number too."""
    try:
        within = sorted(p for p in base.iterdir() if p.is_dir() and not p.name.startswith("."))
        folders = base, *within
        found = _of_kinds(base, [p for one in folders for p in sequences_in(one)])
        if all(len(s.numbers) == 1 for s in found):
            found += _of_kinds(base, [p for one in folders for p in singles_in(one)])
    except OSError as error:
        raise InputError(f"{base}: {(error.strerror or str(error)).lower()}") from None
    return found


def _of_kinds(base: Path, patterns: Iterable[Path]) -> list[_Sequence]:
    return [_Sequence(p, base) for p in patterns if p.suffix.lower() in _KINDS]


def _picture(base: Path, sequences: list[_Sequence]) -> _Sequence:
    """The sequence that is blurred: one that is called as the picture, or else as no other pass."""
    images = [s for s in sequences if s.pattern.suffix.lower() != FLO]
    able = images if len(images) == 1 else [s for s in images if not s.is_other]
    able = [s for s in able if not s.is_single] or able
    called = [s for s in able if s.says(names.is_color)]
    holding = [s for s in called or able if s.has_vectors]
    chosen = _best(holding or called or able)
    if not chosen:
        held = f"; it holds {', '.join(map(str, sequences))}" if sequences else ""
        raise InputError(f"{base}: a folder without pictures or videos{held}")
    if len(chosen) > 1:
        raise InputError(
            f"{base}: the picture may be {chosen[0]} or {chosen[1]}; name one instead of the "
            f"folder, such as '{chosen[0].pattern}'"
        )
    return chosen[0]


def _one(
    base: Path, rest: Iterable[_Sequence], kind: str, fits: Callable[[_Sequence], bool]
) -> _Sequence | None:
    chosen = _best([s for s in rest if fits(s)])
    if len(chosen) > 1:
        raise InputError(
            f"{base}: the {kind} may be {chosen[0]} or {chosen[1]}; `also` takes one, such as "
            f"'{chosen[0].pattern}'"
        )
    return chosen[0] if chosen else None


def _best(some: list[_Sequence]) -> list[_Sequence]:
    """Of sequences that are called the same, the one of the first kind of file."""
    first = {}
    for one in sorted(some, key=lambda s: s.place):
        first.setdefault((one.pattern.parent, title(one.pattern)), one)
    return list(first.values())
