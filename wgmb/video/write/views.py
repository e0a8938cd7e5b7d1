"""Streams of pictures that state a projection (360 degrees) or two views.

PyAV cannot give these facts to an encoder, but copies those of a stream that is read: one picture
is encoded into a Matroska file in memory, whose header states them (RFC 9559, 5.1.4.1.28), and the
new stream is made after it.
"""

from __future__ import annotations

import io
import mmap
import re
import struct
from pathlib import Path

import av
from av.container import OutputContainer
from av.video.stream import VideoStream

from .encoders import Facts

_SPHERICAL = struct.Struct("=4i5I")  # AVSphericalMapping: kind, yaw, pitch, roll; bounds, padding
_STEREO = struct.Struct("=2i")  # AVStereo3D: kind, flags
_MODES = {
    (1, 0): "left_right", (1, 1): "right_left", (2, 0): "top_bottom", (2, 1): "bottom_top",
    (3, 0): "block_lr", (3, 1): "block_rl", (4, 0): "checkerboard_lr", (4, 1): "checkerboard_rl",
    (6, 0): "row_interleaved_lr", (6, 1): "row_interleaved_rl", (7, 0): "col_interleaved_lr",
    (7, 1): "col_interleaved_rl",
}  # fmt: skip
"""Matroska's names of two views in a picture, by FFmpeg's kind and order."""
_IN_MP4 = ("left_right", "top_bottom")
_FLAT = 0  # kind of a picture of one view
_WHOLE, _CUBE, _PART = 0, 1, 2  # kinds of projection that Matroska has
_PROJECTIONS = {
    _WHOLE: "360 degrees (equirectangular)", _CUBE: "360 degrees (cube)",
    _PART: "part of a sphere (equirectangular)", 3: "half of a sphere (equirectangular)",
    4: "none (rectilinear)", 5: "fisheye",
}  # fmt: skip
_PATH = (0x18538067, 0x1654AE6B, 0xAE, 0xE0)  # Segment, Tracks, TrackEntry, Video
_APPLE = re.compile(rb"\0\0\0.(vexu)\0\0\0.(?:eyes\0\0\0.stri|proj\0\0\0.prji)", re.DOTALL)
_FIXED = 1 << 16  # to a degree


def stereo_mode(facts: Facts) -> str:
    """The arrangement of two views, by Matroska's name; '' if none is known."""
    if facts.stereo is None:
        return ""
    kind, flags = _STEREO.unpack_from(facts.stereo)
    return _MODES.get((kind, flags & 1), "")


def are_stated(facts: Facts) -> bool:
    """Return True if pictures have a projection, or views, that a file may hold."""
    return bool(_projection(facts) or stereo_mode(facts))


def described(facts: Facts) -> dict[str, str]:
    """The projection and the two views of pictures, in words."""
    said = {}
    if facts.projection is not None:
        kind = _SPHERICAL.unpack_from(facts.projection)[0]
        said["sphere"] = _PROJECTIONS.get(kind, "unknown projection")
    if _has_two_views(facts):
        said["views"] = f"two in a picture: {_arrangement(facts)}"
    return said


def left_out(facts: Facts, suffix: str) -> list[str]:
    """Such facts that a container does not hold, in words."""
    said, mode, is_mkv = [], stereo_mode(facts), suffix in (".mkv", ".webm")
    held = is_mkv or suffix == ".mp4" or (suffix == ".mov" and _is_upright_sphere(facts))
    if facts.projection is not None and not (held and _projection(facts)):
        said.append("its projection (360 degrees) is not kept (.mkv and .mp4 hold most)")
    held = mode and (is_mkv or (suffix == ".mp4" and mode in _IN_MP4))
    if _has_two_views(facts) and not held:
        said.append(f"its stereo layout ({_arrangement(facts)}) is not kept (.mkv holds most)")
    return said


def _has_two_views(facts: Facts) -> bool:
    return facts.stereo is not None and _STEREO.unpack_from(facts.stereo)[0] != _FLAT


def _arrangement(facts: Facts) -> str:
    return stereo_mode(facts).replace("_", " ") or "of unknown arrangement"


def stream_after(to: OutputContainer, sample: bytes, facts: Facts) -> VideoStream:
    """Add a stream to a file: that of a sample in Matroska, with a projection and two views.

    `sample`: made with the muxer's option `live`, so that the lengths of its longest parts are not
    stated, and with `stereo_mode` as a text.
    """
    projection = _projection(facts)
    data = _inserted(sample, _PATH, projection) if projection else sample
    with av.open(io.BytesIO(data)) as source:
        return to.add_stream_from_template(source.streams.video[0], opaque=True)


def leave_one_form(path: Path) -> None:
    """Leave one of the two forms in which FFmpeg states views and projections in an MP4.

    Apple's (vexu), as FFmpeg 8 writes it, tells less: neither how two views lie, nor how a sphere
    is turned; its own reader believes it rather than st3d and sv3d. Its box becomes a free one.
    """
    with open(path, "r+b") as file, mmap.mmap(file.fileno(), 0) as data:
        for match in _APPLE.finditer(data):
            data[match.start(1) : match.end(1)] = b"free"


def _is_upright_sphere(facts: Facts) -> bool:
    """Return True for a whole sphere that is not turned, which a MOV holds."""
    return facts.projection is not None and not any(_SPHERICAL.unpack_from(facts.projection)[:4])


def _projection(facts: Facts) -> bytes:
    """Matroska's element of a projection; nothing for a kind that it lacks."""
    if facts.projection is None:
        return b""
    kind, *angles, left, top, right, bottom, padding = _SPHERICAL.unpack_from(facts.projection)
    private = {
        _WHOLE: b"",
        _CUBE: struct.pack(">3I", 0, 0, padding),
        _PART: struct.pack(">5I", 0, top, bottom, left, right),
    }.get(kind)
    if private is None:
        return b""
    parts = _element(0x7671, bytes([2 if kind == _CUBE else 1]))
    parts += _element(0x7672, private) if private else b""
    for number, angle in zip((0x7673, 0x7674, 0x7675), angles, strict=True):
        parts += _element(number, struct.pack(">f", angle / _FIXED))
    return _element(0x7670, parts)


def _element(number: int, content: bytes) -> bytes:
    return number.to_bytes(2, "big") + _length(len(content)) + content


def _length(length: int) -> bytes:
    """A length in the form of eight bytes."""
    return (length | 1 << 56).to_bytes(8, "big")


def _inserted(data: bytes, path: tuple[int, ...], element: bytes) -> bytes:
    """Matroska's bytes with an element at the beginning of the first one in a path of others."""
    at = 0
    while at < len(data):
        number, size_at = _number(data, at)
        length, begin = _number(data, size_at)
        length &= (1 << 7 * (begin - size_at)) - 1
        is_open = length == (1 << 7 * (begin - size_at)) - 1
        end = len(data) if is_open else begin + length
        if number == path[0]:
            inner = data[begin:end]
            inner = _inserted(inner, path[1:], element) if path[1:] else element + inner
            size = data[size_at:begin] if is_open else _length(len(inner))
            return data[:size_at] + size + inner + data[end:]
        at = end
    raise ValueError(f"no element {path[0]:x}")


def _number(data: bytes, at: int) -> tuple[int, int]:
    """A number whose first byte tells its length, with that mark; and where it ends."""
    end = at + 9 - data[at].bit_length()
    return int.from_bytes(data[at:end], "big"), end
