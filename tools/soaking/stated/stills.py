"""Still images, EXR files and texts whose stated numbers are too large, for `stated`."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import tifffile
from PIL import Image

import make_frames as make
from wgmb.color.srgb import to_display
from wgmb.io import stills

from . import Mutations, StatedKind, copies, too_large

_PLAIN = "--method", "tap", "--overwrite", "-q"


def _of_stills(path: Path, output: Path) -> list[list[Any]]:
    """Commands on a still: alone, and as frame 2 of three, whose motion is found."""
    for number in (1, 3):
        other = path.with_name(f"{path.stem}.{number:04}{path.suffix}")
        if not other.exists():
            _still(other, number)
    middle = path.with_name(f"{path.stem}.0002{path.suffix}")
    if not middle.exists():
        middle.symlink_to(path.name)
    frames = path.with_name(f"{path.stem}.####{path.suffix}")
    return [["info", path], ["blur", frames, "-o", output, "--frames", 2, *_PLAIN]]


def _still(path: Path, number: int = 2) -> None:
    path.write_bytes(stills.encode(make.picture(number)[..., :3], path.suffix, 8, "{}"))


def _progressive(path: Path) -> None:
    Image.fromarray(to_display(make.picture(2)[..., :3], 8)).save(path, progressive=True)


def _tiff(**options: Any) -> Callable[[Path], object]:
    return lambda path: tifffile.imwrite(
        path, to_display(make.picture(2)[..., :3], 8), photometric="rgb", **options
    )


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


def jpeg(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The length of each segment, and each number of the frame's and the scans' headers."""
    at = 2
    while at < len(data) and data[at + 1] != 0xD9:
        marker, (length,) = data[at + 1], struct.unpack_from(">H", data, at + 2)
        places = [("length", at + 2, ">H")]
        if marker in (0xC0, 0xC2):
            places += [("bits", at + 4, ">B"), ("height", at + 5, ">H"), ("width", at + 7, ">H")]
            places += [("of the frame", at + 9 + i, ">B") for i in range(length - 7)]
        if marker == 0xDA:
            places += [("of the scan", at + 4 + i, ">B") for i in range(length - 2)]
        for name, place, form in places:
            for value, changed in too_large(data, place, form, less=(0,)):
                yield f"{marker:02X}: {name} at {place} {value}", changed
        at += 2 + length
        while marker == 0xDA and not (data[at] == 0xFF and data[at + 1] not in (0, *_RESTARTS)):
            at += 1


_RESTARTS = range(0xD0, 0xD8)
_FORMS = {1: "B", 3: "H", 4: "I", 16: "Q"}


def tiff(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Every number of the list of tags, and the first and last value of each tag."""
    big = data[2:4] == b"+\0"
    place, word, entry = (8, "<Q", 20) if big else (4, "<I", 12)
    count_form = "<Q" if big else "<H"
    (at,) = struct.unpack_from(word, data, place)
    (count,) = struct.unpack_from(count_form, data, at)
    begin = at + struct.calcsize(count_form)
    places = [("offset of the tags", place, word), ("count of tags", at, count_form)]
    places += [("next list", begin + count * entry, word)]
    for each in range(begin, begin + count * entry, entry):
        tag, kind = struct.unpack_from("<2H", data, each)
        (values,) = struct.unpack_from(word, data, each + 4)
        value = each + entry - place
        places += [(f"tag {tag}", each, "<H"), (f"type of {tag}", each + 2, "<H")]
        places += [(f"count of {tag}", each + 4, word), (f"value of {tag}", value, word)]
        if form := _FORMS.get(kind):
            size = struct.calcsize(form)
            where = value
            if values * size > place:
                (where,) = struct.unpack_from(word, data, value)
            for index in {0, values - 1}:
                places.append((f"{tag}[{index}]", where + index * size, "<" + form))
    for name, where, form in places:
        for value, changed in too_large(data, where, form, less=(0, 1)):
            yield f"{name} {value}", changed


def _kind(
    suffix: str, write: Callable[[Path], object], mutations: Mutations, *, is_tiff: bool = False
) -> StatedKind:
    one = copies.tiff if is_tiff else copies.pillow
    copied = ".tif" if is_tiff else ".png"
    return StatedKind(
        suffix, write, mutations, _of_stills, _pixels, _with_others(one), copied, suffix
    )


def _with_others(copy: Callable[[Path, Path], object]) -> Callable[[Path, Path], object]:
    """The same for a still and the frames before and after it."""

    def copies_of(path: Path, to: Path) -> None:
        for number in ("", ".0001", ".0003"):
            names = (f"{each.stem}{number}{each.suffix}" for each in (path, to))
            copy(*(path.with_name(name) for name in names))

    return copies_of


KINDS = {
    "png": _kind(".png", _still, png),
    "jpeg": _kind(".jpg", _still, jpeg),
    "jpeg-progressive": _kind(".jpg", _progressive, jpeg),
    "tiff": _kind(".tif", _still, tiff, is_tiff=True),
    "tiff-big": _kind(".tif", _tiff(bigtiff=True, rowsperstrip=8), tiff, is_tiff=True),
    "tiff-tiled": _kind(
        ".tif", _tiff(tile=(16, 16), compression="zlib", predictor=True), tiff, is_tiff=True
    ),
}
