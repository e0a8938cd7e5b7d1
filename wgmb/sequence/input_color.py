"""Frames whose colour space is given: made linear where it is not, and labelled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..color.spaces import ColorConfig, ColorSpace
from ..io import exr
from .frame_file import FrameFile, about

_SAID_OF_COLOR = (
    "chromaticities", "colorInteropID", "oiio:ColorSpace", "colorspace",
    "acesImageContainerFlag", "adoptedNeutral",
)  # fmt: skip


def in_space(frame: FrameFile, space: ColorSpace) -> FrameFile:
    """The frame, its picture being in `space`, or in `scene_linear` where that is not linear.

    A linear EXR stays as it is. A still comes from stills.read in `scene_linear` already.
    """
    if frame.file is not None and space.is_linear:
        return replace(frame, space=space)
    working = space.config.scene_linear
    if frame.file is None or frame.reference_channel is None:
        return replace(frame, space=working)
    with about(frame.name):
        light = space.linear(frame.rgba).transpose(2, 0, 1)
    there = {name: plane for name, plane in zip(frame.color, light, strict=True) if name}
    stored = {name: _as(plane, frame.channels[name].dtype) for name, plane in there.items()}
    return replace(frame, channels=frame.channels | stored, space=working, made_linear=True)


def _as(plane: np.ndarray, kind: np.dtype) -> np.ndarray:
    return exr.to_half(plane) if kind == np.float16 else plane.astype(kind)


def space_of(frame: FrameFile, config: ColorConfig) -> ColorSpace:
    """The space of the frame's picture: as it was given, or as its attributes say.

    That of a still is linear Rec. 709, which stills.read makes of sRGB.
    """
    with about(frame.name):
        return frame.space or config.space_of(frame.part.attributes if frame.part else {})


def without_pixels(frame: FrameFile) -> FrameFile:
    """The frame with only the fields that `space_of` needs."""
    part = frame.part and replace(frame.part, channels={})
    return replace(frame, file=None, channels={}, part=part, origin={})


def relabelled(attributes: dict[str, Any], space: ColorSpace) -> dict[str, Any]:
    """Attributes of a part whose picture is now in another, linear space."""
    kept = {name: value for name, value in attributes.items() if name not in _SAID_OF_COLOR}
    return kept | chromaticities(space)


def chromaticities(space: ColorSpace | None) -> dict[str, Any]:
    """The attribute of that name of an EXR in a linear space, where its config tells."""
    found = space.config.chromaticities(space) if space else None
    return {"chromaticities": found} if found else {}
