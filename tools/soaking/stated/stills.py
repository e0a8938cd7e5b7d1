"""Still images, EXR files and texts whose stated numbers are too large, for `stated`."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import make_frames as make
from wgmb.io import stills

from . import StatedKind, too_large

_PLAIN = "--method", "tap", "--overwrite", "-q"


def _of_stills(path: Path, output: Path) -> list[list]:
    """Commands on a still: alone, and as frame 2 of three, whose motion is found."""
    for number in (1, 3):
        _still(path.with_name(f"{path.stem}.{number:04}{path.suffix}"), number)
    middle = path.with_name(f"{path.stem}.0002{path.suffix}")
    if not middle.exists():
        middle.symlink_to(path.name)
    frames = path.with_name(f"{path.stem}.####{path.suffix}")
    return [["info", path], ["blur", frames, "-o", output, "--frames", 2, *_PLAIN]]


def _still(path: Path, number: int = 2) -> None:
    path.write_bytes(stills.encode(make.picture(number)[..., :3], path.suffix, 8, "{}"))


def _pixels(path: Path) -> str:
    return hashlib.sha256(stills.read(path).tobytes()).hexdigest()


def png(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The length of each chunk, and each number of the header, under a right checksum."""
    at = 8
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind = data[at + 4 : at + 8].decode("latin-1")
        for value, changed in too_large(data, at, ">I"):
            yield f"length of {kind} {value}", changed
        at += 12 + length
    for name, place, form in (
        ("width", 16, ">I"), ("height", 20, ">I"), ("bits", 24, ">B"), ("colour", 25, ">B"),
        ("compression", 26, ">B"), ("filter", 27, ">B"), ("interlace", 28, ">B"),
    ):  # fmt: skip
        for value, changed in too_large(data, place, form, less=(0, 1, 16)):
            yield f"{name} {value}", _with_crc(changed)


def _with_crc(data: bytes) -> bytes:
    return data[:29] + struct.pack(">I", zlib.crc32(data[12:29])) + data[33:]


KINDS = {
    "png": StatedKind(".png", _still, png, _of_stills, _pixels),
}
