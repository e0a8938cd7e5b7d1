"""One frame as textures: the GPU counterpart of `Frame`, and the input of `Blur.encode`."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from dataclasses import dataclass, field, fields

import wgpu

from .camera import Reprojections
from .errors import InputError

View = wgpu.GPUTextureView


# Of per-pixel inputs: the format that arrays are uploaded in, and whether only methods that name
# the input in their `needs` or `uses` get it.
_X = {"format": "r32float", "if_used": False}
_X_IF_USED = {"format": "r32float", "if_used": True}
_XY = {"format": "rg32float", "if_used": False}
_XYZW = {"format": "rgba32float", "if_used": False}
_XYZ_IF_USED = {"format": "rgba32float", "if_used": True}
_INDEX = {"format": "r32uint", "if_used": False}


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameViews:
    """One frame as views of textures, all of one size; names, units and meanings as in Frame.

    Only `color` is required.
    """

    color: View
    """Filterable float (rgba16float always is), linear, premultiplied alpha."""
    to_prev: View | None = field(default=None, metadata=_XY)
    """Displacement to the previous frame [px] in x and y."""
    to_next: View | None = field(default=None, metadata=_XY)
    """Displacement to the next frame [px] in x and y."""
    motion: View | None = field(default=None, metadata=_XYZW)
    """`to_prev` and `to_next` in one texture, instead of the two; saves a pass."""
    depth: View | None = field(default=None, metadata=_X_IF_USED)
    """Distance along the view axis [scene units] in x."""
    camera: Reprojections | None = None
    """Camera and body motion around this frame; needs `depth`."""
    object_id: View | None = field(default=None, metadata=_INDEX)
    """Index of each pixel's body in `camera`; 0 is the world."""
    normal: View | None = field(default=None, metadata=_XYZ_IF_USED)
    """Unit vectors in the world in x, y, z."""
    holdout: View | None = field(default=None, metadata=_X)
    """0..1 in x: 1 stays sharp and out of its neighbours' blur."""
    scale: View | None = field(default=None, metadata=_X)
    """Multiplies the motion, in x."""
    object_motion: bool = False
    """The vectors exclude the camera's motion, which is added."""
    check: bool = False
    """Ignore pixels that are not finite, at the cost of three small passes."""
    key: object | None = None
    """Cache key: equal keys mean identical pixels, so that a method may reuse derived data.
    The commands that computed them must have been submitted."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.color.size[0], self.color.size[1]

    @property
    def has_vectors(self) -> bool:
        """True if motion vectors are set, with or without a camera."""
        return any(v is not None for v in (self.to_prev, self.to_next, self.motion))

    @property
    def has(self) -> frozenset[str]:
        """Available inputs, of "color", "motion" and "depth"."""
        there = {"color"}
        if self.has_vectors or self.camera is not None:
            there.add("motion")
        if self.depth is not None:
            there.add("depth")
        return frozenset(there)

    @property
    def has_plain_motion(self) -> bool:
        """True if `motion` is used as it is, without camera or scale."""
        return self.motion is not None and self.camera is None and self.scale is None

    def check_fit(self, size: tuple[int, int], whose: str = "") -> None:
        """InputError unless every view is of `size` (width, height) and all fit together.

        `whose`: begins the names in the errors of a neighbouring frame.
        """
        for f in fields(self):
            view = getattr(self, f.name)
            if isinstance(view, View):
                check_view(whose + f.name, view, size)
        if self.camera is not None and self.depth is None:
            raise InputError(f"{whose}camera: motion from a camera needs depth")
        if self.motion is not None and not (self.to_next is None and self.to_prev is None):
            raise InputError(f"pass either {whose}motion or to_next and to_prev, not both")


TEXTURES = {f.name: f.metadata for f in fields(FrameViews) if "format" in f.metadata}
"""The per-pixel inputs beside `color`: `format` and `if_used` by name."""


def check_view(name: str, view: View, size: tuple[int, int]) -> None:
    """InputError unless a view is of `size` (width, height) [px]."""
    if tuple(view.size[:2]) != tuple(size):
        width, height = view.size[:2]
        raise InputError(f"{name} is {width} x {height}, the image {size[0]} x {size[1]}")
