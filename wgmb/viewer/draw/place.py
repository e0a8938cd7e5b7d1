"""Places of a picture and its parts on the canvas."""

from __future__ import annotations

from ..state.state import BOTH_EYES, State

_WHEEL, _KEY_HEIGHT, _KEY_WIDTH, _MARGIN = 96, 8, 180, 16  # logical pixels

Box = tuple[float, float, float, float]  # x, y, width, height [px]


def fit(shape: tuple[float, float], area: Box, state: State) -> Box:
    """Return the box of an image of that shape: fitted and centred in the area, then zoomed."""
    x, y, width, height = area
    scale = min(width / shape[0], height / shape[1]) * state.zoom
    w, h = shape[0] * scale, shape[1] * scale
    left = x + width / 2 - w * state.center[0]
    top = y + height / 2 - h * state.center[1]
    return round(left), round(top), max(round(w), 1), max(round(h), 1)


def key_box(state: State, kind: str, place: Box, area: Box, ratio: float) -> Box | None:
    """Return the box of the first image's colour key [px], or None if it needs none."""
    if state.mode in ("split", "difference", *BOTH_EYES):
        return None
    x, y, width, height = overlap(place, area)
    margin = _MARGIN * ratio
    if kind == "MOTION":
        edge = min(_WHEEL * ratio, 0.3 * min(width, height))
        return x + width - edge - margin, y + height - edge - margin, edge, edge
    is_false = kind == "COLOR" and state.tone == "false"
    if kind == "DEPTH" or state.mode == "error" or is_false:
        long, high = min(_KEY_WIDTH * ratio, 0.4 * width), _KEY_HEIGHT * ratio
        return x + margin, y + height - high - margin, long, high
    return None


def whole(place: Box) -> tuple[int, int]:
    """Width and height in whole pixels."""
    return max(round(place[2]), 1), max(round(place[3]), 1)


def overlap(a: Box, b: Box) -> Box:
    """Return the intersection of two boxes."""
    left, top = max(a[0], b[0]), max(a[1], b[1])
    right, bottom = min(a[0] + a[2], b[0] + b[2]), min(a[1] + a[3], b[1] + b[3])
    return left, top, max(right - left, 0), max(bottom - top, 0)
