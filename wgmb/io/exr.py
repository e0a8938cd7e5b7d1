"""EXR files: all parts, channels and attributes are read and written; damage is an error.

The OpenEXR library answers a damaged file with a line on the terminal and fewer parts; here
that is an error that names the file.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from ..errors import InputError, check_choice
from ..files import bounded
from . import chroma, deep, exr_headers, limits, lossy
from .exr_library import hushed, inside
from .limits import MOST_PIXELS_A_SIDE

COMPRESSIONS = {
    "none": OpenEXR.NO_COMPRESSION,
    "rle": OpenEXR.RLE_COMPRESSION,
    "zips": OpenEXR.ZIPS_COMPRESSION,
    "zip": OpenEXR.ZIP_COMPRESSION,
    "piz": OpenEXR.PIZ_COMPRESSION,
    "pxr24": OpenEXR.PXR24_COMPRESSION,
    "b44": OpenEXR.B44_COMPRESSION,
    "b44a": OpenEXR.B44A_COMPRESSION,
    "dwaa": OpenEXR.DWAA_COMPRESSION,
    "dwab": OpenEXR.DWAB_COMPRESSION,
}
"""The library's names of compressions that every program reads; see also `check_compression`."""
_SAME = "same"
_MAGIC = b"\x76\x2f\x31\x01"
_DEEP = OpenEXR.deepscanline, OpenEXR.deeptile
_FLATTENED = "deep pixels are flattened, the nearest sample first"
_VOLUMES = "; volumes (ZBack) count as points at their front"
_CHROMA = "luminance and chroma (Y, RY, BY) become R, G, B in half floats"
_LEVELS = "of tiles in several sizes the largest is used"
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
    "maxSamplesPerPixel",
    "name",
)


@dataclass
class Part:
    """One part: channels by name as stored, (height, width) float16, float32 or uint32."""

    name: str
    channels: dict[str, np.ndarray]
    attributes: dict[str, Any]
    data_window: tuple[int, int, int, int]  # left, top, right, bottom; the last pixels belong to it
    display_window: tuple[int, int, int, int]
    compression: OpenEXR.Compression = OpenEXR.ZIP_COMPRESSION  # as it was stored
    notes: tuple[str, ...] = ()  # how it was stored otherwise than as flat planes

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
        found = {}
        for part in self.parts:
            for name, plane in part.channels.items():
                leads = len(self.parts) > 1 and part.name and not name.startswith(part.name + ".")
                found[f"{part.name}.{name}" if leads else name] = plane
        return found


def read(
    path: str | Path,
    *,
    header_only: bool = False,
    max_mb: float = limits.MAX_MB,
    data_layers: Collection[str] = (),
    held: Callable[[Collection[str]], int] | None = None,
) -> Exr:
    """Read `path`; `header_only` leaves every channel an empty array.

    Deep pixels are flattened, luminance and chroma become R, G and B, and of tiles' levels the
    largest is read; the part's `notes` say so. `max_mb`: megabytes that its pixels may take.
    `data_layers`: layers of deep pixels that hold no colours (see `deep.flatten`). `held`: told
    the names of the channels, returns the values of 32 bits that a run holds of a pixel (see
    limits.check_held).
    `InputError` names the file where it is missing, damaged, cut off, absurdly large or beyond
    that limit, and where memory is short.
    """
    path = Path(path)
    if not path.is_file():
        raise bounded.missing(path)
    with inside():
        header, unknown = _open(path, header_only=True)
    try:
        promised = [_promised(path, part, unknown) for part in header.parts]
        is_deep = [part.header.get("type") in _DEEP for part in header.parts]
    except (UnicodeDecodeError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"{path}: not a readable EXR file: {_first_line(error)}") from None
    if (count := sum(len(part.channels) for part in promised)) > limits.MOST_CHANNELS:
        raise InputError(f"{path}: {count} channels; at most {limits.MOST_CHANNELS}")
    tiles = sum(map(_tiles, promised, [part.header for part in header.parts]))
    if tiles > limits.MOST_TILES:
        raise InputError(f"{path}: {tiles:,} tiles; at most {limits.MOST_TILES:,}")
    if header_only:
        return Exr(path, promised)
    needed = sum(limits.unpacked(part.size, len(part.channels)) for part in promised)
    description = "{} x {}, ".format(*promised[0].size) + f"{count} channels,"
    if any(is_deep):
        needed += deep.needed(path, header.parts)
        description += " deep,"
    stored = path.stat().st_size
    limits.check(path, description, needed, stored, max_mb)
    if held is not None:
        each = held(list(Exr(path, promised).channels()))
        limits.check_held(path, promised[0].size, each, stored, max_mb)
    with inside(), hushed() as heard:
        content, _ = _open(path, header_only=False)
    if len(content.parts) != len(promised):
        if _short_of_memory(heard, needed):
            raise InputError(f"{path}: not enough memory for {needed >> 20} MB of pixels")
        raise InputError(
            f"{path}: damaged or cut off: pixels of {len(content.parts)} of "
            f"{len(promised)} parts could be read"
        )
    try:
        for want, stored in zip(promised, content.parts, strict=True):
            _fill(path, want, stored, data_layers)
    except MemoryError:
        raise InputError(f"{path}: not enough memory for {needed >> 20} MB of pixels") from None
    return Exr(path, promised)


def _tiles(part: Part, header: dict[str, Any]) -> int:
    """Tiles of a part with this header; 0 if it has none. Each takes the library some time."""
    tiles = header.get("tiles")
    if tiles is None:
        return 0
    width, height = part.size
    return -(-width // max(tiles.xSize, 1)) * -(-height // max(tiles.ySize, 1))


def _fill(path: Path, part: Part, stored: Any, data_layers: Collection[str]) -> None:
    """Give a part, promised by its header, the stored planes."""
    sampling: dict[str, tuple[int, int]] = {}
    for name in part.channels:
        channel = stored.channels.get(name)
        pixels = channel.pixels if channel is not None else None
        width, height = part.size
        if channel is not None and (channel.xSampling, channel.ySampling) != (1, 1):
            sampling[name] = channel.xSampling, channel.ySampling
            width, height = width // channel.xSampling, height // channel.ySampling
        if pixels is None or pixels.shape != (height, width):
            shape = "nothing" if pixels is None else "{1} x {0}".format(*pixels.shape)
            raise InputError(
                f"{path}: channel {name} must be {width} x {height}, got {shape} (damaged)"
            )
        part.channels[name] = pixels
    try:
        if stored.header.get("type") in _DEEP:
            volumes = deep.has_volumes(part.channels)
            part.channels = deep.flatten(part.channels, data_layers)
            part.notes += (_FLATTENED + (_VOLUMES if volumes else ""),)
        _fill_gaps(part, sampling)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    tiles = stored.header.get("tiles")
    if tiles is not None and tiles.mode != OpenEXR.ONE_LEVEL:
        part.notes += (_LEVELS,)


def _fill_gaps(part: Part, sampling: dict[str, tuple[int, int]]) -> None:
    """Give subsampled channels a value for every pixel, and chroma its colours."""
    of_chroma = [name for name in part.channels if name.rpartition(".")[2] in ("RY", "BY")]
    for lead in dict.fromkeys(name[:-2] for name in of_chroma):
        luminance = part.channels.get(f"{lead}Y")
        if luminance is None or any(f"{lead}{c}" in part.channels for c in "RGB"):
            continue  # they are something else
        none = np.zeros(part.size[::-1], np.float32)
        both = [
            chroma.whole(part.channels.pop(c, none), sampling.pop(c, (1, 1)))
            for c in (f"{lead}RY", f"{lead}BY")
        ]
        del part.channels[f"{lead}Y"]
        shares = chroma.weights(part.attributes.get("chromaticities"))
        colors = to_half(chroma.rgb(luminance, (both[0], both[1]), shares))
        part.channels |= {f"{lead}{c}": colors[..., i] for i, c in enumerate("RGB")}
        part.notes += (_CHROMA,)
    for name, (x, y) in sampling.items():
        part.channels[name] = part.channels[name].repeat(x, axis=1).repeat(y, axis=0)
        part.notes += (f"channel {name}, stored for every {x} x {y} pixels, gets a value for each",)


def check_compression(name: str) -> None:
    """InputError unless `name` is in COMPRESSIONS, or "same": as the file that was read."""
    check_choice("`compression`", name, (*COMPRESSIONS, _SAME))


def encode(
    exr: Exr,
    compression: str = "zip",
    holds_numbers: Callable[[str], bool] = lambda layer: False,
) -> bytes:
    """The file's bytes: every part in scan lines; the same parts give the same bytes.

    A lossy compression is for pictures: layers of numbers that it would change (vectors, depth,
    normals, ids of a Cryptomatte) get a part of their own in "zip". `holds_numbers`: True
    of such a layer though its channels are called R, G and B.
    """
    check_compression(compression)
    parts = []
    taken = [part.name for part in exr.parts]
    for whole in exr.parts:
        kind = whole.compression if compression == _SAME else COMPRESSIONS[compression]
        for part, own in lossy.separated(whole, kind, holds_numbers, taken):
            taken.append(part.name)
            # An empty list says nothing, and the library cannot write it.
            kept = {k: v for k, v in part.attributes.items() if not (isinstance(v, list) and not v)}
            header = {k: v for k, v in kept.items() if k not in _WRITTEN_ANEW} | {
                "compression": own,
                "type": OpenEXR.scanlineimage,
                "dataWindow": _box(part.data_window),
                "displayWindow": _box(part.display_window),
            }
            # The library ignores strides and would write wrong pixels.
            channels = {k: np.ascontiguousarray(v) for k, v in part.channels.items()}
            parts.append((header, channels, part.name))
    stream = io.BytesIO()
    try:
        with inside():
            OpenEXR.File([OpenEXR.Part(*part) for part in parts]).write(stream)
    except (RuntimeError, TypeError, ValueError) as error:
        raise InputError(f"{exr.path}: cannot be written as EXR: {_first_line(error)}") from None
    return stream.getvalue()


def new(rgba: np.ndarray, attributes: dict[str, Any] | None = None) -> Exr:
    """A file with one part of half channels R, G, B and, for four channels, A."""
    height, width, count = rgba.shape
    window = (0, 0, width - 1, height - 1)
    channels = {c: to_half(rgba[..., i]) for i, c in enumerate("RGBA"[:count])}
    return Exr(Path(), [Part("", channels, attributes or {}, window, window)])


def to_half(values: np.ndarray) -> np.ndarray:
    """Float16, with larger values clamped to its largest one."""
    limit = np.finfo(np.float16).max
    return np.clip(values, -limit, limit).astype(np.float16)


def _open(path: Path, *, header_only: bool):
    """The library's file, and the names of attributes that no number can hold."""
    options = {"separate_channels": True, "header_only": header_only}
    try:
        try:
            # Of a stream, the library lets other threads run while the disk is waited for.
            with open(path, "rb") as file:
                return OpenEXR.File(file, **options), set()
        except ZeroDivisionError:
            stream, unknown = exr_headers.with_rationals(path)
            return OpenEXR.File(stream, **options), unknown
    except MemoryError:
        raise InputError(f"{path}: not enough memory to read it") from None
    except (RuntimeError, ValueError, TypeError, OSError, ArithmeticError) as error:
        if not _begins_as_exr(path):
            raise InputError(f"{path}: not an EXR file, whatever its name") from None
        raise InputError(f"{path}: not a readable EXR file: {_first_line(error)}") from None


def _begins_as_exr(path: Path) -> bool:
    with contextlib.suppress(OSError), open(path, "rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC
    return True  # it cannot be read, which the library says


def _short_of_memory(heard: list[str], needed: int) -> bool:
    """True if pixels could not be read for lack of memory: the library reports this for arrays, but
    not for its own smaller buffers."""
    if "MemoryError" in "".join(heard):
        return True
    try:
        np.empty(needed + (needed >> 3), np.uint8)
    except MemoryError:
        return True
    return False


def _promised(path: Path, part: Any, unknown: Collection[str]) -> Part:
    """Return the part that its header declares, with empty arrays, without `unknown` attributes."""
    header = part.header
    data, display = (_corners(header[k]) for k in ("dataWindow", "displayWindow"))
    width, height = data[2] - data[0] + 1, data[3] - data[1] + 1
    if not (0 < width <= MOST_PIXELS_A_SIDE and 0 < height <= MOST_PIXELS_A_SIDE):
        raise InputError(
            f"{path}: image of {width} x {height}; at most {MOST_PIXELS_A_SIDE} per side"
        )
    channels = {c.name: np.empty((0, 0), np.float32) for c in header["channels"]}
    if not channels:
        raise InputError(f"{path}: has a part without channels")
    attributes = {k: v for k, v in header.items() if k not in _WRITTEN_ANEW}
    lost = [name for name in unknown if attributes.pop(name, None) is not None]
    notes = tuple(
        f"attribute {name} has a denominator of 0, and is left out" for name in sorted(lost)
    )
    name, compression = header.get("name", "") or "", header["compression"]
    return Part(name, channels, attributes, data, display, compression, notes)


def _corners(box: Any) -> tuple[int, int, int, int]:
    (left, top), (right, bottom) = box
    return int(left), int(top), int(right), int(bottom)


def _box(corners: tuple[int, int, int, int]):
    left, top, right, bottom = corners
    return np.array([left, top], np.int32), np.array([right, bottom], np.int32)


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
