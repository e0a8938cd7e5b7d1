"""Colour tags of a video, and the assumptions where tags are missing."""

from __future__ import annotations

import av
from av.video.codeccontext import VideoCodecContext

from ...color.coding import (
    BT601,
    BT709,
    BT2020,
    HLG,
    PQ,
    SRGB,
    UNSPECIFIED,
    Coding,
)
from ..pixels import PlaneLayout

PAL = 5  # primaries of 625 lines
_LIMITED, _FULL = 1, 2  # ranges, as FFmpeg counts them
RANGES = {False: _LIMITED, True: _FULL}
_RESERVED = (0, 3)  # as primaries and transfer; as matrix 3 only
_VIDEO_CODECS = ("h264", "hevc", "av1", "vp8", "vp9", "mpeg2video", "mpeg4", "vvc")

COLORS = {
    "bt601": (BT601, BT601, BT601),
    "bt709": (BT709, BT709, BT709),
    "bt2020-pq": (BT2020, PQ, BT2020),
    "bt2020-hlg": (BT2020, HLG, BT2020),
}
"""Matrix, transfer and primaries by the names that a user chooses from."""

_OF_MATRIX = {BT709: BT709, PAL: PAL, BT601: BT601, BT2020: BT2020, 10: BT2020}
_OF_PRIMARIES = {BT709: BT709, PAL: PAL, BT601: BT601, BT2020: BT2020}

Tags = tuple[int, int, int, int]
"""Range, matrix, transfer, primaries."""


def tags_of(said_by: VideoCodecContext | av.VideoFrame) -> Tags:
    """The four tags, whether they say something or not."""
    return (
        said_by.color_range, said_by.colorspace, said_by.color_trc, said_by.color_primaries
    )  # fmt: skip


def either(first: Tags, second: Tags) -> Tags:
    """The tags of the first, and those of the second where it says nothing."""
    a, b, c, d = (
        one if _is_told(one, which) else other
        for which, (one, other) in enumerate(zip(first, second, strict=True))
    )
    return a, b, c, d


def _is_told(tag: int, which: int) -> bool:
    """Return True if a tag says something; `which`: range, matrix, transfer, primaries."""
    if which == 0:
        return tag in (_LIMITED, _FULL)
    return tag != UNSPECIFIED and tag not in (_RESERVED if which > 1 else (3,))


def assumed(
    of: PlaneLayout, size: tuple[int, int], codec: str, tags: Tags
) -> tuple[Coding, tuple[str, ...]]:
    """The Coding with these tags, and the assumptions, in words.

    Untagged pictures are BT.709 if they are 1280 pixels wide or over 576 high, else BT.601; RGB is
    sRGB. So do players, and so did those who left the tags out. Where either the matrix or the
    primaries are stated, the other is of the same standard.
    """
    range_, matrix, transfer, primaries = tags
    told = [_is_told(tag, which) for which, tag in enumerate(tags)]
    is_hd = size[0] >= 1280 or size[1] > 576
    said: list[str] = []
    full = range_ == _FULL
    if not told[0]:
        full = of.full_range or (of.model == "grey" and codec not in _VIDEO_CODECS)
    if of.model == "rgb":
        matrix = 0
    elif matrix == 0 or not told[1]:  # 0 is the matrix of RGB
        by_size = BT709 if is_hd else BT601
        matrix = _OF_PRIMARIES.get(primaries, by_size) if told[3] else by_size
        if of.model == "yuv":
            said.append(f"matrix {_name(matrix)}")
    if not told[2]:
        transfer = SRGB if of.model == "rgb" else BT709
        said.append("transfer sRGB" if transfer == SRGB else "transfer BT.709")
    if not told[3]:
        small = PAL if size[1] == 576 else BT601
        primaries = BT709 if is_hd or of.model == "rgb" else small
        if matrix == BT2020 or told[1]:
            primaries = _OF_MATRIX.get(matrix, primaries)
        said.append(f"primaries {_name(primaries)}")
    coding = Coding(of.model, of.bits, of.steps, of.alpha, full, matrix, transfer, primaries)
    return coding, tuple(said)


def _name(number: int) -> str:
    return {BT709: "BT.709", BT2020: "BT.2020"}.get(number, "BT.601")
