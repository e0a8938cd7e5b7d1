"""Facts that a decoded frame has beside its samples: turns, displays, light levels."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterable
from typing import cast

import av
from av.sidedata.sidedata import SideData as _SideData
from av.sidedata.sidedata import Type

from ..hdr10 import LightLevel, Mastering

SideData = dict[Type, bytes]


def side_data_of(frame: av.VideoFrame) -> SideData:
    """Side data of a frame; nothing if PyAV does not know all their kinds."""
    with contextlib.suppress(ValueError):
        data = cast(Iterable[_SideData], frame.side_data)
        return {one.type: bytes(one) for one in data}  # pyright: ignore[reportArgumentType]
    return {}


def mastering_of(data: SideData) -> Mastering | None:
    """The display that pictures were graded on, if it is stated."""
    with contextlib.suppress(struct.error, KeyError):
        return Mastering.read(data[Type.MASTERING_DISPLAY_METADATA])
    return None


def light_level_of(data: SideData) -> LightLevel | None:
    """The light levels of pictures, if they are stated."""
    with contextlib.suppress(struct.error, KeyError):
        return LightLevel.read(data[Type.CONTENT_LIGHT_LEVEL])
    return None
