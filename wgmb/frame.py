"""One frame: colour, motion, depth, and the conventions for them.

image    (height, width, channels) float, linear light, premultiplied alpha, row 0 on top
motion   `to_next`, `to_prev`: displacement [px], x right, y down, to where this pixel's
         content is one frame later, earlier; one alone means a straight path
time     frame intervals, 0 = the frame's instant; a 180 degree shutter is open -0.25..0.25
depth    distance along the view axis [scene units], larger is farther, inf = nothing there
matrix   `clip_from_world`: destination first, so that products read as chains

Foreign conventions are translated in sequence/layers/ (vectors.py, camera_file.py), nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import Reprojections, Window, window_of
from .errors import InputError, check_choice
from .gpu import wgsl
from .png import show

_F32_MAX = float(np.finfo(np.float32).max)
_BAND = 256  # rows that are looked at together
_CHANNELS = {
    "to_next": (2,),
    "to_prev": (2,),
    "motion": (4,),
    "normal": (3,),
    "diffuse_light": (3,),
    "diffuse_color": (3,),
    "glossy_light": (3,),
    "glossy_color": (3,),
    "depth": (),
    "holdout": (),
    "scale": (),
}


Floats = NDArray[np.floating[Any]]
"""Array of float16, float32 or float64."""
Integers = NDArray[np.integer[Any]]


@dataclass(frozen=True, eq=False)
class Frame:
    """Input of a method. Only `color` is required.

    Arrays of floats are float16, float32 or float64; masked arrays are refused.
    """

    color: Floats
    """(height, width, 3 or 4) float, linear, premultiplied alpha."""
    to_next: Floats | None = None
    """(height, width, 2) float [px]."""
    to_prev: Floats | None = None
    """(height, width, 2) float [px]."""
    motion: Floats | None = None
    """(height, width, 4) float [px]: to_prev and to_next side by side, instead of the two."""
    depth: Floats | None = None
    """(height, width) float [scene units], required if motion comes from `camera`."""
    window: Window | None = None
    """Position of the image in the display window, of which it may hold a part, or more: x, y of
    its first pixel, and the display window's width and height [px]. None: the camera's window, or
    the image is the whole display window."""
    camera: Reprojections | None = None
    """Camera and body motion around this frame; gives motion from depth."""
    object_id: Integers | None = None
    """(height, width) integer: index of each pixel's body in `camera`; 0 is the world."""
    normal: Floats | None = None
    """(height, width, 3) float: unit vectors in world space; 0 for empty pixels."""
    holdout: Floats | None = None
    """(height, width) float 0..1: 1 stays sharp and out of its neighbours' blur."""
    scale: Floats | None = None
    """(height, width) float: multiplies the motion."""
    object_motion: bool = False
    """`to_next`, `to_prev` exclude the camera's motion, which is added."""
    prev: Frame | None = None
    """The frame before, for methods that use neighbours; its own `prev`, for those that take two
    frames to either side."""
    next: Frame | None = None
    """The frame after, and its own `next`."""
    number: int = 0
    """Frame number; varies the jitter."""
    diffuse_light: Floats | None = None
    """(height, width, 3) float, linear: the light that matt surfaces scatter, before it is
    multiplied by `diffuse_color`; with it the neighbours' own, so that shadows can move."""
    diffuse_color: Floats | None = None
    """(height, width, 3) float, linear: the colour of matt surfaces (albedo)."""
    glossy_light: Floats | None = None
    """(height, width, 3) float, linear: light reflected by gloss, before `glossy_color`."""
    glossy_color: Floats | None = None
    """(height, width, 3) float, linear: the colour of glossy surfaces."""
    wrap: Literal["off", "on"] = "off"
    """on: a whole equirectangular panorama of 360 degrees, whose left and right edge are one
    meridian. Motion across it is taken by the short way, and what leaves one edge comes in from
    the other."""
    bad: dict[str, int] = field(init=False, default_factory=dict)
    """Number of pixels per input that are not finite, or have no depth in front of the camera.

    Colours beyond 1e30 count as infinite: sums of them would overflow. Bad colours get no
    weight, bad motion counts as zero, bad depth as infinitely far (in a depth buffer: as no
    motion).
    """

    def __post_init__(self) -> None:
        width, height = _size_of(self.color)
        if max(width, height) > MOST_SIDE:  # before any value is looked at
            raise InputError(f"color must be at most {MOST_SIDE} pixels a side, got "
                             f"{width} x {height}")  # fmt: skip
        color = _float_array("color", self.color)
        if color.ndim != 3 or color.shape[2] not in (3, 4):
            raise InputError(f"color must be (height, width, 3 or 4), got {color.shape}")
        if 0 in color.shape:
            raise InputError(f"color must have at least one pixel, got {width} x {height}")
        object.__setattr__(self, "color", color)
        for name, channels in _CHANNELS.items():
            given = getattr(self, name)
            if given is not None:
                want = (*color.shape[:2], *channels)
                object.__setattr__(self, name, _shaped(name, _float_array(name, given), want))
        if self.object_id is not None:
            ids = _array("object_id", self.object_id)
            if ids.dtype.kind not in "iu":
                raise InputError(f"object_id must be integers, got {ids.dtype}")
            if ids.size and ids.min() < 0:
                raise InputError(f"object_id must be 0 or more, got {ids.min()}")
            ids = ids if ids.dtype.itemsize <= 4 else np.minimum(ids, 2**32 - 1)
            ids = _shaped("object_id", ids, color.shape[:2]).astype(np.uint32, copy=False)
            object.__setattr__(self, "object_id", ids)
        check_choice("`wrap`", self.wrap, ("off", "on"))
        if self.camera is not None and self.wrap == "on":
            raise InputError("a panorama takes no camera; cameras are perspective or orthographic")
        if self.camera is not None and self.depth is None:
            raise InputError("motion from a camera needs depth")
        object.__setattr__(self, "window", window_of(self.window, self.camera))
        if self.object_id is not None and self.camera is None:
            raise InputError("object_id needs a camera, which holds the motion of the bodies")
        if self.motion is not None and not (self.to_next is None and self.to_prev is None):
            raise InputError("pass either motion or to_next/to_prev, not both")
        self._check_neighbours()
        for name in ("color", "to_next", "to_prev", "motion", "scale", "holdout"):
            most = _brightest() if name == "color" else _F32_MAX
            if given := _count_bad(getattr(self, name), most):
                self.bad[name] = given
        if self.camera is not None and self.depth is not None:
            with np.errstate(invalid="ignore"):
                clip = self.camera.depth_kind == "clip"
                good = np.isfinite(self.depth) if clip else self.depth > 0
            if given := int(np.count_nonzero(~good)):
                self.bad["depth"] = given

    def _check_neighbours(self) -> None:
        for name, neighbour in (("prev", self.prev), ("next", self.next)):
            if neighbour is None:
                continue
            if neighbour.size != self.size:
                raise InputError(f"{name} must be {self.size} like the frame, got {neighbour.size}")
            whole = (0, 0, *self.size)
            if (neighbour.window or whole) != (self.window or whole):
                wanted = f"{self.window or whole} like the frame's"
                raise InputError(f"{name}'s window must be {wanted}, got {neighbour.window}")

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays that are set, by name."""
        given = {name: getattr(self, name) for name in ("color", *_CHANNELS, "object_id")}
        return {name: array for name, array in given.items() if array is not None}

    def __repr__(self) -> str:
        width, height = self.size
        color = f"color {'rgba'[: self.color.shape[2]]} f{8 * self.color.itemsize}"
        given = [name for name in _SHORT if getattr(self, name) is not None]
        return f"Frame({width} x {height}, {', '.join([color, *given])}, number {self.number})"

    def _repr_png_(self) -> bytes:
        return show(self.color).png

    @property
    def is_locked(self) -> bool:
        """True if all arrays are read-only; such frames are uploaded only once."""
        return not any(array.flags.writeable for array in self.arrays.values())

    def locked(self) -> Frame:
        """Return the same frame with read-only arrays."""
        locked = copy(self)
        for name, array in self.arrays.items():
            view = array.view()
            view.flags.writeable = False
            object.__setattr__(locked, name, view)
        return locked

    def between(self, prev: Frame | None, next: Frame | None) -> Frame:
        """Return the same frame with these neighbours, which may have neighbours of their own.

        Of those, methods that take two frames to either side (gather with a `reach` of 2) read
        `prev.prev` and `next.next`.
        """
        frame = copy(self)
        object.__setattr__(frame, "prev", prev)
        object.__setattr__(frame, "next", next)
        frame._check_neighbours()
        return frame

    @property
    def size(self) -> tuple[int, int]:
        """Width, height [px]."""
        return self.color.shape[1], self.color.shape[0]

    @property
    def has(self) -> frozenset[str]:
        """Available inputs, of "color", "motion" and "depth"."""
        there = {"color"}
        given = (self.to_next, self.to_prev, self.motion, self.camera)
        if any(source is not None for source in given):
            there.add("motion")
        if self.depth is not None:
            there.add("depth")
        return frozenset(there)


MOST_SIDE = 32768
"""Pixels along a side of a frame at most."""
_SHORT = ("to_next", "to_prev", "motion", "depth", "camera", "object_id", "normal", "holdout",
          "scale", "prev", "next")  # fmt: skip
PASSES = tuple(f.name for f in fields(Frame) if f.init and f.name != "color")


class PassKeywords(TypedDict, total=False):
    """The passes of a Frame as keywords: all PASSES but `to_next`."""

    to_prev: Floats | None
    motion: Floats | None
    depth: Floats | None
    window: Window | None
    camera: Reprojections | None
    object_id: Integers | None
    normal: Floats | None
    holdout: Floats | None
    scale: Floats | None
    object_motion: bool
    prev: Frame | None
    next: Frame | None
    number: int
    wrap: Literal["off", "on"]
    diffuse_light: Floats | None
    diffuse_color: Floats | None
    glossy_light: Floats | None
    glossy_color: Floats | None


def bad_colors(planes: Sequence[np.ndarray]) -> int:
    """Pixels of a picture that Frame.bad counts; `planes`: its channels, (height, width) each."""
    bands = range(0, len(planes[0]), _BAND)
    most = _brightest()
    return sum(_count_bad(np.stack([p[y : y + _BAND] for p in planes], 2), most) for y in bands)


def _brightest() -> float:
    return wgsl.load("common/finite.wgsl").constant("BRIGHTEST")


def _size_of(color: ArrayLike) -> tuple[int, int]:
    """Width and height of a picture, 0 where it is none."""
    shape = np.shape(color)
    return (shape[1], shape[0]) if len(shape) == 3 else (0, 0)


def _array(name: str, values: ArrayLike) -> np.ndarray:
    if isinstance(values, np.ma.MaskedArray):
        raise InputError(f"{name} must not be a masked array: fill it, with NaN for no value")
    return np.asarray(values)


def _float_array(name: str, values: ArrayLike) -> np.ndarray:
    array = _array(name, values)
    if array.dtype.kind != "f":
        hint = "; divide by its maximum and undo its gamma first" if name == "color" else ""
        raise InputError(f"{name} must be floating point, got {array.dtype}{hint}")
    if array.dtype.itemsize > 8:
        raise InputError(f"{name} must be float16, float32 or float64, got {array.dtype}")
    return array


def _shaped(name: str, array: np.ndarray, want: tuple[int, ...]) -> np.ndarray:
    if array.shape != want:
        raise InputError(f"{name} must be {want} like color, got {array.shape}")
    return array


def _count_bad(array: np.ndarray | None, most: float) -> int:
    """Pixels with a value that is not a number, or beyond `most` either way, as float32."""
    if array is None:
        return 0
    with np.errstate(all="ignore"):  # quick: any bad value spoils these; halves have slow extremes
        half = array.dtype == np.float16
        spoilt = [np.sum(array, dtype=np.float32)] if half else [array.min(), array.max()]
        if (np.abs(np.array(spoilt, np.float32)) <= most).all():
            return 0
        bad = ~(np.abs(array.astype(np.float32, copy=False)) <= most)
    return int(np.count_nonzero(bad.any(axis=2) if bad.ndim == 3 else bad))
