"""Facts about streams that FFmpeg knows and PyAV has no names for, read from FFmpeg's own text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from threading import Lock

import av.logging
import numpy as np
from av.container import InputContainer

_STREAM = re.compile(r"^\s*Stream #\d+:(\d+)", re.MULTILINE)
_TAG = re.compile(r"(?:Data|Unknown|Audio|Video|Subtitle): [^\n]*?\(([\w ]{4}) / 0x[0-9A-F]{8}\)")
_CODEC = re.compile(r"Data: (?!none)(\w+)")
_CROP = re.compile(r"Frame Cropping: (\d+)/(\d+)/(\d+)/(\d+)")
_LOCK = Lock()
_KINDS = {
    "tmcd": "time code", "gpmd": "telemetry of GoPro", "fdsc": "GoPro's recovery data",
    "mebx": "Apple's timed metadata", "camm": "telemetry of a camera (CAMM)",
    "mett": "timed metadata", "metx": "timed metadata", "djmd": "telemetry of DJI",
    "dbgi": "debugging data of DJI", "rtmd": "metadata of a Sony camera", "klv": "telemetry (KLV)",
    "smpte_2038": "ancillary data", "scte_35": "marks of advertisements (SCTE 35)",
    "timed_id3": "ID3 tags", "epg": "programme guide", "text": "text", "rtp ": "RTP hints",
}  # fmt: skip


@dataclass(frozen=True)
class StreamText:
    """Facts about one stream."""

    kind: str = ""
    """Of data: its kind in words, or the four letters by which the file calls it; else ''."""
    crop: tuple[int, int, int, int] = (0, 0, 0, 0)
    """Pixels that are not to be shown: left, right, top, bottom."""


def stream_texts(container: InputContainer) -> dict[int, StreamText]:
    """Facts about the streams of a file, by number; of one that is not there, nothing is known."""
    with _LOCK:  # FFmpeg says nothing unless its messages are on
        level = av.logging.get_level()
        av.logging.set_level(av.logging.INFO)
        try:
            text = container.dumps_format()  # pyright: ignore[reportAttributeAccessIssue]
        finally:
            av.logging.set_level(level)
    parts = _STREAM.split(text)[1:]
    return {int(n): _read(part) for n, part in zip(parts[::2], parts[1::2], strict=True)}


def _read(text: str) -> StreamText:
    first = text.split("\n", 1)[0]
    names = [match[1] for match in (_CODEC.search(first), _TAG.search(first)) if match]
    kind = next((_KINDS[name] for name in names if name in _KINDS), names[0] if names else "")
    crop = _CROP.search(text)
    left, right, top, bottom = map(int, crop.groups()) if crop else (0, 0, 0, 0)
    return StreamText(kind, (left, right, top, bottom))


def cropped(
    planes: tuple[np.ndarray, ...], crop: tuple[int, int, int, int], steps: tuple[int, int]
) -> tuple[np.ndarray, ...]:
    """The planes of a picture within its crop; `steps`: pixels to one of chroma.

    The numbers of `crop` are multiples of `steps`, see `whole_samples`.
    """
    if not any(crop):
        return planes
    left, right, top, bottom = crop
    height, width = planes[0].shape
    parts = []
    for plane in planes:
        across, down = (1, 1) if plane.shape == (height, width) else steps
        rows = slice(top // down, (height - bottom + down - 1) // down)
        parts.append(plane[rows, left // across : (width - right + across - 1) // across])
    return tuple(parts)


def whole_samples(
    crop: tuple[int, int, int, int], size: tuple[int, int], steps: tuple[int, int]
) -> tuple[int, int, int, int]:
    """The crop in whole samples of chroma; none if it leaves nothing of the picture."""
    across, down = steps
    left, top = crop[0] // across * across, crop[2] // down * down
    if left + crop[1] >= size[0] or top + crop[3] >= size[1]:
        return 0, 0, 0, 0
    return left, crop[1], top, crop[3]
