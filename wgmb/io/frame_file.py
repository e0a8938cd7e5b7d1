"""One frame as stored on disk: the layers of all its files, in one data window."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from . import exr, layers, limits, stills
from .frame_numbers import frame_range

Window = tuple[int, int, int, int]  # left, top, right, bottom; the last pixels belong to it


@dataclass(frozen=True, eq=False)
class FrameFile:
    """One frame as it came from disk."""

    number: int
    path: Path
    file: exr.Exr | None  # None: a still
    channels: dict[str, np.ndarray]  # of all its files, in the picture's data window
    attributes: dict[str, Any]
    wanted: str | None = None  # the picture's layer, if its name does not say so
    part: exr.Part | None = None  # of the file, that the picture is in

    @cached_property
    def color(self) -> list[str]:
        """Names of the picture's channels, 3 or 4."""
        with about(self.path):
            return layers.find_color(self.channels, self.wanted)

    @property
    def beside(self) -> str | None:
        """A channel whose neighbours are preferred: the picture's first, if there is one."""
        with contextlib.suppress(InputError):
            return self.color[0]
        return None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        height, width = next(iter(self.channels.values())).shape
        return width, height

    @property
    def whole(self) -> tuple[int, int]:
        """Width and height [px] of the whole picture, of which an EXR may hold a window."""
        return self.size if self.window is None else self.window[2:]

    @property
    def rgba(self) -> np.ndarray:
        """The picture, (height, width, 3 or 4), as stored (float16 or float32)."""
        planes = [self.channels[name] for name in self.color]
        kind = np.float16 if all(p.dtype == np.float16 for p in planes) else np.float32
        rgba = np.empty((*planes[0].shape, len(planes)), kind)
        for i, plane in enumerate(planes):
            rgba[..., i] = plane
        return rgba

    @property
    def window(self) -> Window | None:
        """Offset of the image in the full image, and the full size: x, y, width, height [px]."""
        if self.part is None:
            return None
        left, top, right, bottom = self.part.display_window
        x, y = self.part.data_window[:2]
        return x - left, y - top, right - left + 1, bottom - top + 1


def size_text(of: np.ndarray | tuple[int, int]) -> str:
    """Width x height of a plane, or of a pair, for messages."""
    width, height = of if isinstance(of, tuple) else of.shape[::-1]
    return f"{width} x {height}"


def odd_sizes(sizes: dict[int, tuple[int, int]]) -> str | None:
    """Return a message about frames of an unusual size; None if all have the same size."""
    by_size: dict[tuple[int, int], list[int]] = {}
    for number in sorted(sizes):
        by_size.setdefault(sizes[number], []).append(number)
    if len(by_size) < 2:
        return None
    usual = max(by_size, key=lambda size: len(by_size[size]))
    odd = [f"{frame_range(n)}: {size_text(s)}" for s, n in by_size.items() if s != usual]
    return f"frames of another size than most, {size_text(usual)}: {'; '.join(odd)}"


@contextlib.contextmanager
def about(path: Path):
    """Name the file in errors that do not."""
    try:
        yield
    except InputError as error:
        if str(path) in str(error):
            raise
        raise InputError(f"{path}: {error}") from None


def read(
    paths: list[Path], number: int, wanted: str | None, max_mb: float = limits.MAX_MB
) -> FrameFile:
    """One frame's files, their channels together; `wanted`: the picture's layer.

    `max_mb`: megabytes that each file may unpack to. `InputError` names the file that is missing,
    damaged, too large, or of another size.
    """
    path, channels, attributes = paths[0], {}, {}
    file: exr.Exr | None = None
    onto: exr.Part | None = None
    size: tuple[int, int] | None = None
    for p in paths:
        if p.suffix.lower() == ".exr":
            content = exr.read(p, max_mb=max_mb)
            onto = onto or _picture_part(content, wanted)
            file = content if p == path else file
            more = _one_window(content, onto)
            for part in reversed(content.parts):
                attributes = {**part.attributes, **attributes}
        elif p.suffix.lower() in stills.SUFFIXES:
            rgba = stills.read(p, max_mb=max_mb)
            more = {c: rgba[..., i] for i, c in enumerate("RGBA"[: rgba.shape[2]])}
        else:
            known = ", ".join((".exr", *stills.SUFFIXES))
            raise InputError(f"{p}: cannot read this kind of file; frames may be {known}")
        for name, plane in more.items():
            size = size or plane.shape[::-1]
            if plane.shape[::-1] != size:
                raise InputError(
                    f"{p}: layer {name} is {size_text(plane)}, {path.name} is {size_text(size)}"
                )
            channels.setdefault(name, plane)
    return FrameFile(number, path, file, channels, attributes, wanted, onto if file else None)


def _picture_part(read: exr.Exr, wanted: str | None) -> exr.Part:
    """The part that the picture is in; the first one where none is found."""
    places = {full: part for full, part, _ in read.places()}
    with contextlib.suppress(InputError):
        return places[layers.find_color(places, wanted)[0]]
    return read.parts[0]


def _one_window(read: exr.Exr, onto: exr.Part) -> dict[str, np.ndarray]:
    """All channels in the data window of the part `onto`; 0 where they have none."""
    channels = {}
    for full, part, name in read.places():
        plane = part.channels[name]
        if part.data_window != onto.data_window:
            if part.display_window != onto.display_window:
                raise InputError(
                    f"{read.path}: layer {full}, {size_text(plane)}, has a different "
                    f"display window from the image, {size_text(onto.size)}"
                )
            plane = _moved(plane, part.data_window, onto.data_window)
        channels[full] = plane
    return channels


def _moved(plane: np.ndarray, window: Window, onto: Window) -> np.ndarray:
    """Return the part of `plane`, which covers `window`, that lies in `onto`."""
    left, top = max(window[0], onto[0]), max(window[1], onto[1])
    right, bottom = min(window[2], onto[2]) + 1, min(window[3], onto[3]) + 1
    moved = np.zeros((onto[3] - onto[1] + 1, onto[2] - onto[0] + 1), plane.dtype)
    if left < right and top < bottom:
        moved[top - onto[1] : bottom - onto[1], left - onto[0] : right - onto[0]] = plane[
            top - window[1] : bottom - window[1], left - window[0] : right - window[0]
        ]
    return moved
