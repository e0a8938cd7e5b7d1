"""H.264 whose fields come in packets of their own (PAFF), as in broadcasts (ITU-T H.264).

FFmpeg's reader of transport streams and raw H.264 makes two packets of such a frame, of which its
decoder makes one picture. The second one shows nothing new.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_SLICE, _SLICE_IDR, _PARAMETERS = 1, 5, 7  # kinds of NAL units (table 7-1)
_WITH_CHROMA = (100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135)  # profiles, 7.3.2.1.1
_START = re.compile(rb"\x00\x00\x01")
_SLICE_HEAD = 32  # bytes of a slice that hold the facts about its field
_EMULATION = re.compile(rb"\x00\x00\x03")  # the last of these bytes is none of the data
_HEAD = 1024  # bytes of a unit that are looked at: more than parameters take


@dataclass(frozen=True)
class _Parameters:
    """Facts about the slices of a sequence."""

    has_fields: bool
    frame_bits: int
    """Bits of the number of a frame."""
    has_planes: bool
    """Three planes are coded apart."""


class SecondFields:
    """Tells packets with the second field of a frame, one packet after the other.

    `header`: the codec's own data, with the parameters of the sequence in either form.
    """

    def __init__(self, header: bytes):
        self._length = header[4] % 4 + 1 if _is_boxed(header) else 0
        self._parameters: _Parameters | None = None
        self._first: tuple[int, int] | None = None  # number of a frame that lacks a field, parity
        for unit in _units(header[6:], 2) if self._length else _units(header, 0):
            if unit and unit[0] & 31 == _PARAMETERS:  # they come first
                self._parameters = _parameters(unit)
                break

    def __call__(self, data: memoryview) -> bool:
        """Return True if a packet has only the second field of the frame before."""
        fields = self._read(bytes(data), self._length)
        before, self._first = self._first, None
        if len(fields) != 1 or None in fields:
            return False
        (field,) = fields
        assert field is not None
        if before is not None and before == (field[0], 1 - field[1]):
            return True
        self._first = field
        return False

    def _read(self, data: bytes, length: int) -> set[tuple[int, int] | None]:
        """Number and parity of the fields in a packet; None for a frame, or if nothing is known."""
        fields: set[tuple[int, int] | None] = set()
        for unit in _units(data, length):
            kind = unit[0] & 31 if unit else 0
            if kind == _PARAMETERS:
                self._parameters = _parameters(unit)
            elif kind in (_SLICE, _SLICE_IDR):
                fields.add(self._field(unit))
                if None in fields:
                    break
        return fields

    def _field(self, unit: bytes) -> tuple[int, int] | None:
        """See 7.3.3, slice_header."""
        known = self._parameters
        if known is None or not known.has_fields:
            return None
        bits = _Bits(unit[1:_SLICE_HEAD])
        for _ in range(3):  # the first macroblock, the kind of slice, the picture's parameters
            bits.number()
        bits.take(2 if known.has_planes else 0)
        frame = bits.take(known.frame_bits)
        return (frame, bits.take(1)) if bits.take(1) else None


def _is_boxed(header: bytes) -> bool:
    """Return True for the header of an MP4, where lengths stand in place of start codes.

    (ISO/IEC 14496-15, 5.3.3.1.)
    """
    return header[:1] == b"\1" and len(header) > 8


def _units(data: bytes, length: int) -> Iterator[bytes]:
    """The beginnings of the NAL units of a packet; the bytes of others may follow.

    `length`: bytes of the length before each; 0: start codes are between.
    """
    if not length:
        for match in _START.finditer(data):
            yield data[match.end() : match.end() + _HEAD]
        return
    at = 0
    while at + length < len(data):
        begin = at + length
        at = begin + int.from_bytes(data[at:begin], "big")
        yield data[begin : begin + _HEAD]


class _Bits:
    """Reads numbers from the bits of a unit; zeros after its end."""

    def __init__(self, data: bytes):
        data = _EMULATION.sub(b"\0\0", data)
        self._value, self._left = int.from_bytes(data, "big"), 8 * len(data)

    def take(self, count: int) -> int:
        """A number of so many bits."""
        self._left -= count
        by = self._value >> self._left if self._left >= 0 else 0
        return by & ((1 << count) - 1)

    def number(self) -> int:
        """A number in the code of Exp-Golomb (9.1)."""
        zeros = 0
        while self._left > 0 and not self.take(1):
            zeros += 1
        return (1 << zeros) - 1 + self.take(zeros)

    def signed(self) -> int:
        """The same with a sign (9.1.1)."""
        number = self.number()
        return (number + 1) // 2 if number % 2 else -number // 2


def _parameters(unit: bytes) -> _Parameters:
    """See 7.3.2.1.1, seq_parameter_set_data."""
    bits, has_planes = _Bits(unit[1:]), False
    profile = bits.take(8)
    bits.take(16)
    bits.number()
    if profile in _WITH_CHROMA:
        has_planes = _skip_chroma(bits)
    frame_bits = bits.number() + 4
    order = bits.number()
    if order == 0:
        bits.number()
    elif order == 1:
        bits.take(1)
        bits.number()
        bits.number()
        for _ in range(min(bits.number(), 255)):
            bits.number()
    bits.number()
    bits.take(1)
    bits.number()
    bits.number()
    return _Parameters(not bits.take(1), min(frame_bits, 16), has_planes)


def _skip_chroma(bits: _Bits) -> bool:
    """Read over the numbers of higher profiles; True if three planes are coded apart."""
    chroma = bits.number()
    has_planes = chroma == 3 and bool(bits.take(1))
    bits.number()
    bits.number()
    bits.take(1)
    if bits.take(1):  # lists of scaling, 7.3.2.1.1.1
        for n in range(12 if chroma == 3 else 8):
            if bits.take(1):
                _skip_scaling(bits, 16 if n < 6 else 64)
    return has_planes


def _skip_scaling(bits: _Bits, count: int) -> None:
    last = following = 8
    for _ in range(count):
        if following:
            following = (last + bits.signed()) % 256
        last = following or last
