"""Numbers that PNG, JPEG and TIFF files state, compared with their contents.

Each function takes a whole file and returns one for the decoder, with only the chunks, segments or
tags that its pixels need: the rest, texts and colour profiles among it, could unpack to gigabytes.
They raise ValueError where a file states more than it holds; `limits` has the law.
"""

from __future__ import annotations

import lzma
import re
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from . import limits

Allow = Callable[[int, int, int], None]
"""Told the width, the height and the bytes of all strips or tiles, 0 if there are none, before any
pixel is read; raises where they are too large."""

_MOST_PARTS = 1 << 16  # chunks of a PNG, segments of a JPEG; libpng writes chunks of 8 KB

# ---- PNG (Portable Network Graphics Specification, third edition) ----------------------------

_PNG = b"\x89PNG\r\n\x1a\n"
_PASSED = {b"PLTE": 768, b"tRNS": 256, b"gAMA": 4, b"cHRM": 32, b"sRGB": 1, b"cICP": 4}
"""Chunks for the decoder, and the most bytes of each; a colour profile is passed as well."""
_KEPT = {*_PASSED, b"IHDR", b"iCCP", b"IDAT"}
_PROFILE = 4 << 20  # bytes that a colour profile inflates to, at most
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # by the colour type
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
          (0, 1, 1, 2))  # fmt: skip
"""First column and row of each pass of an interlaced picture, and the steps to the next ones."""


def png(data: bytes, allow: Allow) -> bytes:
    """A PNG whose pixels are stored without compression, as long as its header says."""
    if data[:8] != _PNG or data[12:16] != b"IHDR" or data[8:12] != b"\0\0\0\r" or len(data) < 33:
        raise ValueError("no PNG header")
    chunks = [each for each in _chunks(data) if each[0] in _KEPT]
    width, height = struct.unpack_from(">2I", data, 16)
    allow(width, height, 0)
    pixels = [body for kind, body in chunks if kind == b"IDAT"]
    raw = limits.inflated(pixels, size := _unpacked(*struct.unpack_from(">2I5B", data, 16)), "IDAT")
    if len(raw) < size:
        raise ValueError(f"IDAT inflates to {len(raw)} bytes, the picture has {size}")
    passed = [chunks[0], *_passed(chunks), (b"IDAT", memoryview(zlib.compress(raw, 0)))]
    return _PNG + b"".join(_chunk(*each) for each in [*passed, (b"IEND", memoryview(b""))])


def _chunks(data: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Kind and body of each chunk up to IEND, which must be there."""
    view, at = memoryview(data), 8
    for _ in range(_MOST_PARTS):
        if at + 12 > len(data):
            raise ValueError("cut off before its end")
        length, kind = struct.unpack_from(">I4s", data, at)
        if at + 12 + length > len(data):
            raise ValueError("cut off before its end")
        yield kind, view[at + 8 : at + 8 + length]
        if kind == b"IEND":
            return
        at += 12 + length
    raise ValueError(f"has over {_MOST_PARTS:,} chunks")


def _passed(chunks: list[tuple[bytes, memoryview]]) -> Iterator[tuple[bytes, memoryview]]:
    """The first of each kind of chunk that says what the pixels mean."""
    seen = set()
    for kind, body in chunks:
        if kind in seen or (kind not in _PASSED and kind != b"iCCP"):
            continue
        seen.add(kind)
        if kind == b"iCCP":
            limits.inflated([body[bytes(body).find(b"\0") + 2 :]], _PROFILE, "its colour profile")
        elif len(body) > _PASSED[kind]:
            raise ValueError(f"{kind.decode()} has {len(body)} bytes, at most {_PASSED[kind]}")
        yield kind, body


def _unpacked(
    width: int, height: int, bits: int, color: int, compression: int, kind: int, interlace: int
) -> int:
    """Bytes of all rows of a picture with these facts in its header, each with its filter."""
    if bits not in (1, 2, 4, 8, 16) or color not in _CHANNELS or interlace > 1:
        raise ValueError(f"no PNG has {bits} bits, colour type {color} and interlace {interlace}")
    if compression or kind:
        raise ValueError(f"compression {compression} and filter {kind} are none of PNG's")
    passes = _ADAM7 if interlace else ((0, 0, 1, 1),)
    sizes = [(-((x - width) // dx), -((y - height) // dy)) for x, y, dx, dy in passes]
    each = bits * _CHANNELS[color]
    return sum(rows * (1 + -(-columns * each // 8)) for columns, rows in sizes if columns > 0)


def _chunk(kind: bytes, body: memoryview) -> bytes:
    crc = zlib.crc32(body, zlib.crc32(kind))
    return b"".join([struct.pack(">I", len(body)), kind, body, struct.pack(">I", crc)])


# ---- JPEG (ITU-T T.81) ------------------------------------------------------------------------

_MOST_SCANS = 100  # of a picture: each takes the time of all its blocks, and about 10 are usual
_MARKER = re.compile(rb"\xff+([^\x00\xff])", re.DOTALL)
_NEXT = re.compile(rb"\xff+[^\x00\xff\xd0-\xd7]", re.DOTALL)  # the end of a scan's data
_SOS, _EOI = 0xDA, 0xD9
_ALONE = {0x01, _EOI, *range(0xD0, 0xD9)}  # markers without a length
_LEFT_OUT = {0xFE, *range(0xE1, 0xF0)} - {0xEE}  # comments and applications; EE tells the colours


def jpeg(data: bytes) -> bytes:
    """A JPEG of at most 100 scans, without comments and metadata."""
    view, at, kept, scans, segments = memoryview(data), 0, [], 0, 0
    if data[:2] != b"\xff\xd8":
        raise ValueError("no JPEG header")
    while match := _MARKER.search(data, at):
        marker, begin, at = match[1][0], match.start(), match.end()
        if (segments := segments + 1) > _MOST_PARTS:
            raise ValueError(f"has over {_MOST_PARTS:,} segments")
        if marker not in _ALONE:
            at += int.from_bytes(data[at : at + 2], "big")
        if marker == _SOS:
            if (scans := scans + 1) > _MOST_SCANS:
                raise ValueError(f"has over {_MOST_SCANS} scans")
            ends = _NEXT.search(data, at)
            at = ends.start() if ends else len(data)
        if marker not in _LEFT_OUT:
            kept.append(view[begin:at])
        if marker == _EOI:
            break
    return b"".join(kept)


# ---- TIFF (revision 6.0, its supplements, and BigTIFF) ---------------------------------------

_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8,
          17: 8, 18: 8}  # fmt: skip
"""Bytes of a value, by the type of a tag."""
_TAGS = {
    254, 256, 257, 258, 259, 262, 266, 273, 277, 278, 279, 284, 317, 322, 323, 324, 325, 338, 339,
    530, 32997, 32998,
}  # fmt: skip
"""Of a picture's size, samples, compression, strips and tiles."""
_MOST_TAGS = 4096
_MOST_SEGMENTS = 1 << 20  # strips or tiles
_MOST_DICTIONARY = 64 << 20  # bytes, of LZMA


def tiff(data: bytes) -> bytes:
    """A TIFF of one picture with the tags that its pixels need; ValueError if it has others."""
    order = {b"II": "<", b"MM": ">"}.get(data[:2], "")
    big = {42: False, 43: True}.get(int.from_bytes(data[2:4], "little" if order == "<" else "big"))
    if not order or big is None or len(data) < 16:
        raise ValueError("no TIFF header")
    count_form, entry, place = (order + "Q", 20, 8) if big else (order + "H", 12, 4)
    at = struct.unpack_from(order + ("Q" if big else "I"), data, place)[0]
    begin = at + struct.calcsize(count_form)
    count = struct.unpack_from(count_form, data, at)[0] if begin <= len(data) else _MOST_TAGS + 1
    end = begin + count * entry
    if count > _MOST_TAGS or end + entry - place > len(data) + place:
        raise ValueError("damaged: its list of tags is beyond its end")
    after = struct.unpack_from(order + ("Q" if big else "I"), data, end)[0]
    if after:
        raise ValueError("must be a single image, has more pages")
    kept: dict[int, bytes] = {}
    for each in range(begin, end, entry):
        tag, kind, values = struct.unpack_from(order + ("HHQ" if big else "HHI"), data, each)
        if tag not in _TAGS or tag in kept:
            continue
        limits.held(f"values of tag {tag}", values, _SIZES.get(kind, 1), len(data))
        limits.held(f"values of tag {tag}", values, 1, _MOST_SEGMENTS)
        if (size := values * _SIZES.get(kind, 1)) > place:  # they lie elsewhere in the file
            offset = struct.unpack_from(order + ("Q" if big else "I"), data, each + entry - place)
            _inside(f"tag {tag}", offset, (size,), len(data))
        kept[tag] = data[each : each + entry]
    new = struct.pack(count_form, len(kept)) + b"".join(kept[tag] for tag in sorted(kept))
    head = data[:place] + struct.pack(order + ("Q" if big else "I"), padded := len(data) + 16)
    body = memoryview(data)[len(head) :]
    return b"".join([head, body, bytes(padded - len(data)), new, bytes(8)])


def tiff_segment(page: Any) -> int:
    """Bytes of one strip or tile of a page of tifffile; ValueError where the page is not flat."""
    if page.imagedepth != 1 or page.tiledepth != 1:
        raise ValueError(f"must be flat, has a depth of {page.imagedepth}")
    samples = page.samplesperpixel if page.planarconfig == 1 else 1
    if page.is_tiled:
        width, rows = page.tilewidth, page.tilelength
    else:
        width, rows = page.imagewidth, min(page.rowsperstrip, page.imagelength)
    return rows * -(-width * samples * page.bitspersample // 8)


def tiff_segments_held(page: Any, stored: int) -> None:
    """ValueError where a strip or tile of a page of tifffile ends beyond a file of so many bytes.

    The list of tags that `tiff` puts behind the file would be read as pixels.
    """
    _inside("its strips or tiles", page.dataoffsets, page.databytecounts, stored)


def _inside(name: str, offsets: Iterable[int], counts: Iterable[int], stored: int) -> None:
    if any(offset + count > stored for offset, count in zip(offsets, counts, strict=False)):
        raise ValueError(f"cut off: {name} would end beyond its {stored} bytes")


def bound_segments(page: Any, decompressors: Any) -> None:
    """Let a page of tifffile decode strips and tiles only to their own size.

    `decompressors`: tifffile's, by the number of the compression. ValueError for a compression
    that cannot be bounded, or that needs a package which is missing.
    """
    compression, size = page.compression, tiff_segment(page)
    if compression == 1:
        return
    unpack = _UNPACK.get(compression)
    if compression == 5:  # of the package imagecodecs
        try:
            unpack = partial(_lzw, decompressors[5])
        except KeyError:
            raise ValueError("LZW compression needs the package imagecodecs") from None
    if unpack is None:
        name = getattr(compression, "name", compression)
        raise ValueError(f"{name} compression is not read; Deflate, LZW, PackBits and none are")
    page.compression = 1
    plain = page.decode
    page.compression = compression

    def decode_bounded(data: bytes | None, index: int, **options: Any) -> Any:
        return plain(data and unpack(data, size), index, **options)

    page.decode = decode_bounded


def _deflate(data: bytes, size: int) -> bytes:
    return limits.inflated([data], size, "a strip")


def _lzw(decode: Callable[..., bytes], data: bytes, size: int) -> bytes:
    return decode(data, out=bytearray(size))


def _lzma(data: bytes, size: int) -> bytes:
    stream = lzma.LZMADecompressor(memlimit=_MOST_DICTIONARY)
    found = stream.decompress(data, size + 1)
    if len(found) > size:
        raise ValueError(f"a strip inflates to more than {size} bytes")
    return found


def _packbits(data: bytes, size: int) -> bytes:
    """The bytes of a strip of PackBits (TIFF 6.0, section 9)."""
    found, at = bytearray(), 0
    while at < len(data) and len(found) < size:
        count = data[at]
        if count < 128:
            found += data[at + 1 : at + 2 + count]
            at += 2 + count
        else:
            found += data[at + 1 : at + 2] * (257 - count if count > 128 else 0)
            at += 2 if count > 128 else 1
    return bytes(found[:size])


_UNPACK = {8: _deflate, 32946: _deflate, 32773: _packbits, 34925: _lzma}
"""By the number of the compression: data and the most bytes that they may unpack to."""
