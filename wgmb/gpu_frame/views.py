"""One frame as textures: the GPU counterpart of `Frame`, and the input of `Blur.encode`."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any

import wgpu

from ..camera import Reprojections, Window, window_of
from ..errors import InputError

View = wgpu.GPUTextureView


# Of per-pixel inputs: the format that arrays are uploaded in, and whether only methods that name
# the input in their `needs` or `uses` get it.
_X = {"format": "r32float", "if_used": False}
_X_IF_USED = {"format": "r32float", "if_used": True}
_XY = {"format": "rg32float", "if_used": False}
_XYZW = {"format": "rgba32float", "if_used": False}
_XYZ_IF_USED = {"format": "rgba32float", "if_used": True}
_RGB_IF_USED = {"format": "rgba16float", "if_used": True}
_INDEX = {"format": "r32uint", "if_used": False}


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameViews:
    """One frame as views of textures, all of one size; names, units and meanings as in Frame.

    Only `color` is required. A texture is taken in place of its default view.
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
    window: Window | None = None
    """As in Frame.window."""
    camera: Reprojections | None = None
    """Camera and body motion around this frame; needs `depth`."""
    object_id: View | None = field(default=None, metadata=_INDEX)
    """Index of each pixel's body in `camera`; 0 is the world."""
    normal: View | None = field(default=None, metadata=_XYZ_IF_USED)
    """Unit vectors in the world in x, y, z."""
    diffuse_light: View | None = field(default=None, metadata=_RGB_IF_USED)
    """As in Frame; linear, in x, y, z."""
    diffuse_color: View | None = field(default=None, metadata=_RGB_IF_USED)
    """As in Frame; linear, in x, y, z."""
    glossy_light: View | None = field(default=None, metadata=_RGB_IF_USED)
    """As in Frame; linear, in x, y, z."""
    glossy_color: View | None = field(default=None, metadata=_RGB_IF_USED)
    """As in Frame; linear, in x, y, z."""
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

    def __post_init__(self) -> None:
        for name in _LIKE:
            object.__setattr__(self, name, view_of(getattr(self, name)))
        object.__setattr__(self, "window", window_of(self.window, self.camera))

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

    def check_fit(self, device: wgpu.GPUDevice, size: tuple[int, int], whose: str = "") -> None:
        """InputError unless `device` can read every view, all are of `size` and fit together.

        `whose`: begins the names in the errors of a neighbouring frame.
        """
        for name, like in _LIKE.items():
            view = getattr(self, name)
            if view is not None:
                check_view(whose + name, view, device, size)
                _check_readable(whose + name, view, like)
        if self.camera is not None and self.depth is None:
            raise InputError(f"{whose}camera: motion from a camera needs depth")
        if self.motion is not None and not (self.to_next is None and self.to_prev is None):
            raise InputError(f"pass either {whose}motion or to_next and to_prev, not both")


TEXTURES = {f.name: f.metadata for f in fields(FrameViews) if "format" in f.metadata}
"""The per-pixel inputs beside `color`: `format` and `if_used` by name."""
_LIKE = {"color": "filterable"} | {name: data["format"] for name, data in TEXTURES.items()}


def view_of(texture: Any) -> Any:
    """The default view of a texture; all else as it is."""
    return texture.create_view() if isinstance(texture, wgpu.GPUTexture) else texture


def check_view(name: str, view: View, device: wgpu.GPUDevice, size: tuple[int, int]) -> None:
    """InputError unless it is a plain 2D texture of `device`, of `size` (width, height) [px]."""
    if tuple(view.size[:2]) != tuple(size):
        width, height = view.size[:2]
        raise InputError(f"{name} is {width} x {height}, the image {size[0]} x {size[1]}")
    texture = view.texture
    if texture._device is not device:  # wgpu-py has no public way to ask
        raise InputError(f"{name} belongs to another device than the Blur's")
    if texture.sample_count != 1:
        raise InputError(f"{name} has {texture.sample_count} samples per pixel: resolve it first")
    if texture.dimension != "2d":
        raise InputError(f"{name} must be a 2D texture, got {texture.dimension}")


def check_output(name: str, view: View, format: str) -> None:
    """InputError unless a shader can write `format` into the view."""
    texture = view.texture
    if texture.format != format:
        raise InputError(f"{name} must be {format}, the Blur's output format; got {texture.format}")
    if not texture.usage & wgpu.TextureUsage.STORAGE_BINDING:
        raise InputError(f"{name} needs the usage STORAGE_BINDING")


def _check_readable(name: str, view: View, like: str) -> None:
    """InputError unless a shader can read the view where a texture `like` this is expected."""
    format = view.texture.format
    if not view.texture.usage & wgpu.TextureUsage.TEXTURE_BINDING:
        raise InputError(f"{name} needs the usage TEXTURE_BINDING")
    has, needs = _channels(format), 4 if like == "filterable" else _channels(like)
    if like.endswith("uint"):
        ok, wanted = format.endswith("uint"), "unsigned integers, such as r32uint"
    elif like == "filterable":
        ok = not (format.endswith(("uint", "sint")) or format.startswith(("depth", "stencil")))
        needs, wanted = 3, "colours, such as rgba16float"
        if ok and "32float" in format and "float32-filterable" not in view.texture._device.features:
            raise InputError(
                f"{name} is {format}, which this device cannot filter: use rgba16float, or request "
                "the device with the feature float32-filterable"
            )
    else:
        ok = not format.endswith(("uint", "sint")) and format != "stencil8"
        wanted = f"{needs} float channel{'s' if needs > 1 else ''}, such as {like}"
    if not ok or has < needs:
        raise InputError(f"{name} must hold {wanted}; got {format}")


@cache
def _channels(format: str) -> int:
    """The number of channels that a texture format has for a shader."""
    if format.startswith(("depth", "stencil")):
        return 1
    return len({*re.sub(r"(unorm|snorm|ufloat|float|uint|sint).*", "", format)} & {*"rgba"})


@dataclass(frozen=True)
class FrameInShot:
    """A frame between its neighbours in one shot, those with motion, as Blur.encode takes it."""

    frame: FrameViews
    prev: FrameViews | None = None
    next: FrameViews | None = None
    number: int = 0
