"""Damage that a decoder hides: it logs wrong checksums, and shows a picture all the same."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from typing import Any

import av
from av.packet import Packet

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_FOOTER, _FOOTER_WITH_CHECKSUM = 3, 8  # bytes at the end of a slice of FFV1


def marked(packets: Iterable[Packet[Any]], codec: av.CodecContext) -> Iterator[Packet[Any]]:
    """The same packets of a stream; those whose checksums are wrong are marked for `is_damaged`.

    So are those that build on them, up to the following key frame.
    """
    if codec.name != "ffv1" or not codec.extradata:  # version 1 has neither slices nor checksums
        yield from packets
        return
    codec.copy_opaque = True
    damaged = False
    for packet in packets:
        if packet.size:
            is_wrong = _is_wrong_ffv1(bytes(packet))
            damaged = is_wrong or (damaged and not packet.is_keyframe)
            packet.opaque = object() if damaged else None  # PyAV keeps each under its identity
        yield packet


def is_damaged(frame: av.VideoFrame) -> bool:
    """Return True for a frame that the decoder, or the checksum of its packet, calls damaged."""
    return frame.is_corrupt or frame.opaque is not None


def _is_wrong_ffv1(data: bytes) -> bool:
    """Return True for a frame of FFV1 with a slice whose checksum is wrong (RFC 9043, section 4.9).

    A slice ends with its size in 3 bytes. In files with checksums follow one byte and the checksum,
    with which the remainder of the slice is 0.
    """
    if _slices(data, _FOOTER):
        return False
    slices = _slices(data, _FOOTER_WITH_CHECKSUM)
    # zlib takes the bits of a byte in the other order, and inverts its register before and after
    return not slices or any(
        zlib.crc32(one.translate(_REVERSED), 0xFFFFFFFF) != 0xFFFFFFFF for one in slices
    )


def _slices(data: bytes, footer: int) -> list[bytes]:
    """The slices of a frame, whose footers have so many bytes; none if their sizes do not fit."""
    slices, end = [], len(data)
    while end >= footer:
        begin = end - footer - int.from_bytes(data[end - footer : end - footer + 3], "big")
        slices.append(data[max(begin, 0) : end])
        end = begin
    return slices if end == 0 else []
