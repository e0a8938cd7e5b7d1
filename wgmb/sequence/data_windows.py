"""Data windows: frames of different windows on one canvas, and the window of a result.

A renderer or compositor may store only the part of a frame that holds something: the data window.
Where it ends within the display window, nothing lies beyond: transparent, infinitely far, still.
Where it ends with the display window, or cuts through the picture, the rest is unknown, and the
pixels at its edge are repeated. Overscan beyond the display window counts as picture.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..frame import Frame
from ..io.limits import MOST_PIXELS_A_SIDE

Window = tuple[int, int, int, int]  # left, top, right, bottom [px]; the last pixels belong to it
Sides = tuple[bool, bool, bool, bool]  # of a window: left, top, right, bottom
OUTSIDE = ("auto", "nothing", "edge")
NONE: Sides = (False, False, False, False)
_GRID = 128, 64  # canvases begin and end at multiples of it [px], for methods that work by tiles
_LARGE = 0.5  # share of all there may be, from which on a canvas is all of it
_MOST_AREA = 4  # times the display window, of a canvas
_OPAQUE = 0.5  # share of a side that is covered if the window cuts through the picture there
_EMPTY = {"depth": np.inf, "scale": 1.0}  # what is outside; the rest is 0


@dataclass(frozen=True)
class Placement:
    """Position of a frame's pixels, and the limits to which the window of its result may grow."""

    canvas: Window
    bounds: Window


def size_of(window: Window) -> tuple[int, int]:
    """Width and height [px]."""
    return window[2] - window[0] + 1, window[3] - window[1] + 1


def union(windows: Iterable[Window]) -> Window:
    """The smallest window that holds all of them."""
    left, top, right, bottom = zip(*windows, strict=True)
    return min(left), min(top), max(right), max(bottom)


def common(one: Window, other: Window) -> Window | None:
    """Intersection of two windows; None if it is empty."""
    left, top = max(one[0], other[0]), max(one[1], other[1])
    right, bottom = min(one[2], other[2]), min(one[3], other[3])
    return (left, top, right, bottom) if left <= right and top <= bottom else None


def covered(rgba: np.ndarray) -> Sides:
    """The sides of a picture that it goes on beyond: over half of the pixels there are covered.

    rgba: (height, width, 3 or 4); without alpha a pixel that is not black is covered.
    """
    solid = rgba[..., 3] > 0.5 if rgba.shape[2] == 4 else (rgba != 0).any(axis=2)
    rows = solid[:, 0], solid[0], solid[:, -1], solid[-1]
    left, top, right, bottom = (bool(row.mean() > _OPAQUE) for row in rows)
    return left, top, right, bottom


def unknown(window: Window, display: Window, cut: Sides) -> Sides:
    """The sides of a window beyond which the picture is unknown.

    `cut`: sides at which windows of these frames cut through the picture.
    """
    left, top, right, bottom = (
        end == border or through for end, border, through in zip(window, display, cut, strict=True)
    )
    return left, top, right, bottom


def allowed(windows: Iterable[Window], display: Window, cut: Sides) -> Window:
    """The largest window that a canvas of `windows` may have.

    The display window, and beyond it as far as one of the windows leads; not beyond a side at
    which they cut through the picture.
    """
    held = union(windows)
    left, top, right, bottom = (
        own if through else (min if i < 2 else max)(own, border)
        for i, (own, border, through) in enumerate(zip(held, display, cut, strict=True))
    )
    return left, top, right, bottom


def moved_by(window: Window, by: tuple[int, int]) -> Window:
    """A window counted from elsewhere."""
    return window[0] + by[0], window[1] + by[1], window[2] + by[0], window[3] + by[1]


def canvas(needed: Window, limit: Window, windows: Iterable[Window], display: Window) -> Window:
    """The canvas that holds the window `needed`, within `limit`, for frames of these `windows`.

    It ends at a grid that begins with the display window, so that neighbouring frames often
    have the same one; from half of `limit` on it is all of that.
    """
    snapped = []
    for i in range(4):
        step, origin = _GRID[i % 2], display[i % 2]
        cells = (needed[i] - origin) // step if i < 2 else -(-(needed[i] + 1 - origin) // step)
        snapped.append(origin + cells * step - (i >= 2))
    window = common((snapped[0], snapped[1], snapped[2], snapped[3]), limit)
    if window is None or _area(window) >= _LARGE * _area(limit):
        window = limit
    width, height = size_of(window)
    if max(width, height) > MOST_PIXELS_A_SIDE or _area(window) > _MOST_AREA * max(
        map(_area, (display, *windows))
    ):
        raise InputError(
            f"its data window and its neighbours' need a canvas of {width} x {height}; at most "
            f"{MOST_PIXELS_A_SIDE} per side and {_MOST_AREA} times the display window"
        )
    return window


def near_enough(one: Window, other: Window) -> bool:
    """True if a canvas may hold two windows."""
    return _area(union([one, other])) <= _MOST_AREA * (_area(one) + _area(other))


def _area(window: Window) -> int:
    width, height = size_of(window)
    return width * height


def placed(frame: Frame, window: Window, onto: Window, edges: Sides) -> Frame:
    """`frame`, which fills `window`, on the canvas `onto`.

    Beyond the sides in `edges` its outermost pixels are repeated; beyond the others is nothing.
    `onto` must hold the frame's pixels, or the frame none that are not 0.
    """
    if window == onto:
        return frame
    given = {name: laid(array, window, onto, edges, _EMPTY.get(name, 0.0))
             for name, array in frame.arrays.items()}  # fmt: skip
    x, y, width, height = frame.window or (0, 0, *size_of(window))
    at = x + onto[0] - window[0], y + onto[1] - window[1], width, height
    camera = replace(frame.camera, window=at) if frame.camera is not None else None
    if camera is not None and camera.depth_kind == "clip":
        outside = laid(np.ones(frame.size[::-1], bool), window, onto, edges, 0)
        given["depth"] = np.where(outside, given["depth"], 1.0).astype(given["depth"].dtype)
    return replace(frame, **given, camera=camera, window=at)


def laid(
    array: np.ndarray,
    window: Window,
    onto: Window,
    edges: Sides = NONE,
    empty: float = 0.0,
) -> np.ndarray:
    """An array (height, width, ...) that fills `window`, on `onto`; see `placed`."""
    if window == onto:
        return array
    shared = common(window, onto)
    if shared is None:
        return np.full((*size_of(onto)[::-1], *array.shape[2:]), empty, array.dtype)
    left, top, right, bottom = (abs(a - b) for a, b in zip(shared, onto, strict=True))
    rows = slice(shared[1] - window[1], shared[3] - window[1] + 1)
    columns = slice(shared[0] - window[0], shared[2] - window[0] + 1)
    spread = [n if edge else 0 for n, edge in zip((left, top, right, bottom), edges, strict=True)]
    filled = np.pad(array[rows, columns], _sides(spread, array.ndim), mode="edge")
    margins = [n - done for n, done in zip((left, top, right, bottom), spread, strict=True)]
    return np.pad(filled, _sides(margins, array.ndim), constant_values=empty)


def _sides(by: list[int], dimensions: int) -> list[tuple[int, int]]:
    """The same for numpy.pad: rows, columns, and nothing along the rest."""
    left, top, right, bottom = by
    return [(top, bottom), (left, right), *[(0, 0)] * (dimensions - 2)]


def result_window(picture: np.ndarray, placement: Placement, own: Window) -> Window:
    """The window of a result that fills the canvas: the frame's own, and all visible pixels."""
    filled = (picture != 0).any(axis=2)
    rows, columns = (np.flatnonzero(filled.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return own
    ends = int(columns[0]), int(rows[0]), int(columns[-1]), int(rows[-1])
    grown = common(moved_by(ends, placement.canvas[:2]), placement.bounds)
    return union([own, grown]) if grown else own
