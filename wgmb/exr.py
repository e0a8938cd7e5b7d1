"""EXR files: every part, channel and attribute in, the same out, and no fault passed over.

The OpenEXR library answers a damaged file with a line on the terminal and fewer parts; here
that is an error that names the file. What it prints is held back while the program that
runs us keeps its own output apart from the process's descriptors 1 and 2 (the command line
does), because only then nothing else can get lost.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import OpenEXR

from .errors import InputError

MOST_PIXELS_A_SIDE = 32768
_WRITTEN_ANEW = (
    "channels",
    "compression",
    "dataWindow",
    "displayWindow",
    "type",
    "lineOrder",
    "tiles",
    "chunkCount",
    "version",
    "name",
)
_CHATTER = "Warning: Exception raised reading pixel data"
_lock = threading.Lock()


@dataclass
class Part:
    """One part: channels by name as stored, (height, width) float16, float32 or uint32."""

    name: str
    channels: dict[str, np.ndarray]
    attributes: dict
    data_window: tuple[int, int, int, int]  # left, top, right, bottom; the last pixels belong to it
    display_window: tuple[int, int, int, int]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the data window [px]."""
        left, top, right, bottom = self.data_window
        return right - left + 1, bottom - top + 1


@dataclass
class Exr:
    """A whole file."""

    path: Path
    parts: list[Part] = field(default_factory=list)

    def channels(self) -> dict[str, np.ndarray]:
        """Every channel by its full name; in a multi-part file the part's name leads."""
        return {full: part.channels[name] for full, part, name in self.places()}

    def places(self) -> list[tuple[str, Part, str]]:
        """Full name, part and name within the part of every channel."""
        found = []
        for part in self.parts:
            for name in part.channels:
                leads = len(self.parts) > 1 and part.name and not name.startswith(part.name + ".")
                found.append((f"{part.name}.{name}" if leads else name, part, name))
        return found


def read(path: str | Path, *, header_only: bool = False) -> Exr:
    """Read `path`; `header_only` leaves every channel an empty array.

    `InputError` names the file where it is missing, damaged, cut off, deep or absurdly large.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    header = _open(path, header_only=True)
    try:
        promised = [_promised(path, part) for part in header.parts]
    except (UnicodeDecodeError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"{path}: not a readable EXR file: {_first_line(error)}") from None
    if header_only:
        return Exr(path, promised)
    content = _open(path, header_only=False)
    if len(content.parts) != len(promised):
        raise InputError(
            f"{path}: damaged or cut off: pixels of {len(content.parts)} of "
            f"{len(promised)} parts could be read"
        )
    for want, got in zip(promised, content.parts, strict=True):
        for name in want.channels:
            pixels = got.channels[name].pixels if name in got.channels else None
            width, height = want.size
            if pixels is None or pixels.shape != (height, width):
                shape = "nothing" if pixels is None else f"{pixels.shape[::-1]}"
                raise InputError(
                    f"{path}: channel {name} must be {width} x {height}, got {shape} "
                    "(damaged, or subsampled, which is not supported)"
                )
            want.channels[name] = pixels
    return Exr(path, promised)


def encode(exr: Exr) -> bytes:
    """The file's bytes: every part, ZIP compressed scan lines."""
    parts = []
    for part in exr.parts:
        # An empty list says nothing, and the library cannot write it.
        kept = {k: v for k, v in part.attributes.items() if not (isinstance(v, list) and not v)}
        header = {k: v for k, v in kept.items() if k not in _WRITTEN_ANEW} | {
            "compression": OpenEXR.ZIP_COMPRESSION,
            "type": OpenEXR.scanlineimage,
            "dataWindow": _box(part.data_window),
            "displayWindow": _box(part.display_window),
        }
        # The library ignores strides and would write wrong pixels.
        channels = {k: np.ascontiguousarray(v) for k, v in part.channels.items()}
        parts.append(OpenEXR.Part(header, channels, part.name))
    stream = io.BytesIO()
    try:
        with _quiet():
            OpenEXR.File(parts, num_threads=2).write(stream)
    except (RuntimeError, TypeError, ValueError) as error:
        raise InputError(f"{exr.path}: cannot be written as EXR: {_first_line(error)}") from None
    return stream.getvalue()


def new(rgba: np.ndarray, attributes: dict | None = None) -> Exr:
    """A file with one part of half channels R, G, B and, for four channels, A."""
    height, width, count = rgba.shape
    window = (0, 0, width - 1, height - 1)
    channels = {c: to_half(rgba[..., i]) for i, c in enumerate("RGBA"[:count])}
    return Exr(Path(), [Part("", channels, attributes or {}, window, window)])


def to_half(values: np.ndarray) -> np.ndarray:
    """Float16, with what is too large for it held to its largest value."""
    limit = np.finfo(np.float16).max
    return np.clip(values, -limit, limit).astype(np.float16)


def _open(path: Path, *, header_only: bool):
    try:
        with _quiet():
            OpenEXR.setMaxImageSize(MOST_PIXELS_A_SIDE, MOST_PIXELS_A_SIDE)
            OpenEXR.setMaxTileSize(MOST_PIXELS_A_SIDE, MOST_PIXELS_A_SIDE)
            return OpenEXR.File(
                str(path), separate_channels=True, header_only=header_only, num_threads=2
            )
    except (RuntimeError, ValueError, TypeError, OSError, MemoryError) as error:
        raise InputError(f"{path}: not a readable EXR file: {_first_line(error)}") from None


def _promised(path: Path, part) -> Part:
    """What the header says the part holds, with empty arrays."""
    header = part.header
    if header.get("type") in (OpenEXR.deepscanline, OpenEXR.deeptile):
        raise InputError(f"{path}: deep images are not supported")
    data, display = (_corners(header[k]) for k in ("dataWindow", "displayWindow"))
    width, height = data[2] - data[0] + 1, data[3] - data[1] + 1
    if not (0 < width <= MOST_PIXELS_A_SIDE and 0 < height <= MOST_PIXELS_A_SIDE):
        raise InputError(
            f"{path}: image of {width} x {height}; at most {MOST_PIXELS_A_SIDE} a side"
        )
    channels = {c.name: np.empty((0, 0), np.float32) for c in header["channels"]}
    if not channels:
        raise InputError(f"{path}: a part without channels")
    attributes = {k: v for k, v in header.items() if k not in _WRITTEN_ANEW}
    return Part(header.get("name", "") or "", channels, attributes, data, display)


def _corners(box) -> tuple[int, int, int, int]:
    (left, top), (right, bottom) = box
    return int(left), int(top), int(right), int(bottom)


def _box(corners: tuple[int, int, int, int]):
    left, top, right, bottom = corners
    return np.array([left, top], np.int32), np.array([right, bottom], np.int32)


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


class _Sieve:
    """A text stream without the lines that the OpenEXR module prints about damaged files."""

    def __init__(self, stream):
        self._stream, self._holding = stream, False

    def write(self, text: str) -> int:
        if text.startswith(_CHATTER):
            self._holding = True  # until its line ends
        elif not self._holding:
            self._stream.write(text)
        if text.endswith("\n"):
            self._holding = False
        return len(text)

    def flush(self) -> None:
        self._stream.flush()

    def __getattr__(self, name: str):
        return getattr(self._stream, name)


@contextlib.contextmanager
def _quiet():
    """Hold back what native code prints, where Python's own streams live elsewhere."""
    with _lock, contextlib.redirect_stdout(_Sieve(sys.stdout)):
        try:
            apart = sys.stdout.fileno() != 1 and sys.stderr.fileno() != 2
        except (OSError, ValueError, AttributeError):
            apart = False
        if not apart:
            yield
            return
        kept = os.dup(1), os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(kept[0], 1)
            os.dup2(kept[1], 2)
            for fd in (*kept, nowhere):
                os.close(fd)
