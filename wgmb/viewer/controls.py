"""Mouse and keys: an event and a State make a new State, and perhaps something to do.

Nothing here draws or waits, so every control can be tested without a window.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Collection
from dataclasses import dataclass, replace

from ..scene import builtin
from .state.state import State
from .state.video_time import passed

Box = tuple[float, float, float, float]  # x, y, width, height [logical px]

TURN = math.degrees(4.0)  # of the camera, for a drag over the whole width
ELEVATION = (-10.0, 85.0)  # degrees: from just over the ground to nearly above
CAM_Y = (-1.0, 0.75)  # of scenes with a camera of their own, cam_x and cam_y [radians]
_DOLLY = (0.1, 10.0)
_ZOOM = (0.25, 32.0)
_NOTCH = 0.0012  # of a wheel's 100 units: how much nearer, as a power of e
_GRIP = 8.0  # how near to the wipe's line it is taken hold of [logical px]
SIZES = {"larger": 1.25, "smaller": 0.8}
"""Factors of the interface's size, by action."""
_STOPS = {"[": -0.5, "]": 0.5}
_SUB = 0.1  # a step within a frame

KEYS = {
    "space": "play or pause",
    "left, right": "one frame back, forward",
    "up, down": "a tenth of a frame forward, back (scenes)",
    "home, end": "first frame, last frame",
    "1 - 9": "method",
    "c": "next comparison",
    "b": "keep the settings as B, to compare with",
    "x": "exchange the settings and B",
    "l": "next view",
    "e": "stereo frames: next eye, pair, red-cyan",
    "tab": "panel",
    "[ ] 0": "exposure half a stop down, up; as it was",
    "+ -": "size of the panel",
    "r": "reset the view",
    "s": "save image, PNG and EXR",
    "v": "start or stop recording MP4",
    "f": "full screen",
    "i": "numbers under the mouse, and scopes",
    "a": "motion as arrows",
    "h": "this help",
    "Esc": "quit",
}
MOUSE = {
    "left drag": "orbit (frames and videos: move)",
    "right or shift drag": "pan",
    "wheel, two fingers": "zoom in, out",
    "drag the divider": "move the wipe",
}


@dataclass(frozen=True)
class WindowLayout:
    """Layout of the window [logical px], and the available choices."""

    area: Box
    place: Box
    methods: tuple[str, ...] = ()
    looks: tuple[str, ...] = ()
    compare: tuple[str, ...] = ()
    eyes: tuple[str, ...] = ()


def grip(
    state: State, layout: WindowLayout, x: float, y: float, button: int, modifiers: Collection[str]
) -> str | None:
    """Return the drag that a press at x, y starts: "wipe", "orbit", "pan", or None."""
    if not is_inside(layout.area, x, y):
        return None
    left, _, width, _ = layout.place
    if state.mode == "wipe" and abs(x - left - state.wipe * width) <= _GRIP:
        return "wipe"
    if button == 2 or button == 3 or (button == 1 and "Shift" in modifiers):
        return "pan"
    return "orbit" if button == 1 else None


def drag(state: State, layout: WindowLayout, held: str, dx: float, dy: float) -> State:
    """Return the state after dragging by dx, dy [logical px]."""
    _, _, width, height = layout.place
    x, y = dx / max(width, 1), dy / max(height, 1)
    if held == "wipe":
        return replace(state, wipe=_held(state.wipe + x, 0.0, 1.0))
    if not state.is_scene:
        across, down = state.center
        return replace(state, center=(_held(across - x, 0, 1), _held(down - y, 0, 1)))
    if held == "orbit" and (own := _own_camera(state)):
        cam_x, cam_y = own
        cam_y = _held(cam_y + 4 * dy / max(layout.area[3], 1), *CAM_Y)
        turned = state.with_parameter("cam_x", cam_x - 4 * dx / max(layout.area[2], 1))
        return turned.with_parameter("cam_y", cam_y)
    if held == "orbit":
        aside, up = state.scene.orbit
        aside -= TURN * dx / max(layout.area[2], 1)
        up += TURN * dy / max(layout.area[3], 1)
        turn = (aside + 180) % 360 - 180
        return state.with_settings(orbit=(turn, _held(up, *ELEVATION)))
    right, over = state.scene.pan
    reach = 6.25 * state.scene.dolly  # the picture's height at the pivot [scene units]
    per_px = reach / max(height, 1)
    return state.with_settings(pan=(right - dx * per_px, over + dy * per_px))


def wheel(state: State, layout: WindowLayout, x: float, y: float, dx: float, dy: float) -> State:
    """Nearer or farther by dy / 100 notches; frames on disk: larger or smaller about x, y."""
    if not is_inside(layout.area, x, y):
        return state
    factor = math.exp(_NOTCH * dy)
    if state.is_scene:
        return state.with_settings(dolly=_held(state.scene.dolly * factor, *_DOLLY))
    zoom = _held(state.zoom / factor, *_ZOOM)
    left, top, width, height = layout.place
    u, v = (x - left) / max(width, 1), (y - top) / max(height, 1)
    share = 1 - state.zoom / zoom  # what is under the pointer stays there
    across, down = state.center
    center = (_held(across + (u - across) * share, 0, 1), _held(down + (v - down) * share, 0, 1))
    return replace(state, zoom=zoom, center=center)


def key(state: State, layout: WindowLayout, name: str) -> tuple[State, str | None]:
    """A pressed key; with it an action: "screenshot", "record", "fullscreen", "quit" or one of
    SIZES.
    """
    low = name.lower()
    actions = {
        "s": "screenshot", "v": "record", "f": "fullscreen", "escape": "quit",
        "+": "larger", "=": "larger", "-": "smaller",
    }  # fmt: skip
    if low in actions:
        return state, actions[low]
    steps = {"arrowleft": -1.0, "arrowright": 1.0, "arrowup": _SUB, "arrowdown": -_SUB}
    if low in steps:
        return stepped(replace(state, playing=False), steps[low]), None
    ends = dict(zip(("home", "end"), state.span, strict=True))
    if low in ends:
        return replace(state, frame=float(ends[low]), playing=False), None
    if name.isdigit() and 1 <= int(name) <= len(layout.methods):
        return state.with_method(layout.methods[int(name) - 1]), None
    if low == " ":
        return replace(state, playing=not state.playing), None
    if low == "h":
        return replace(state, help=not state.help), None
    if low == "b":
        return state.keeping(), None
    if low == "x":
        return state.swapped(), None
    if low == "i":
        return replace(state, inspect=not state.inspect), None
    if low == "a":
        return replace(state, arrows=not state.arrows), None
    if low == "tab":
        return replace(state, panel=not state.panel), None
    if low in _STOPS:
        return replace(state, exposure=_held(state.exposure + _STOPS[low], -8, 8)), None
    if low == "0":
        return replace(state, exposure=0.0), None
    if low == "r":
        state = state.unmoved()
        own = ("cam_x=", "cam_y=")
        kept = tuple(text for text in state.scene.set if not text.startswith(own))
        return state.with_settings(set=kept), None
    if low == "c" and layout.compare:
        return replace(state, compare=_next(layout.compare, state.compare)), None
    if low == "e" and layout.eyes:
        return replace(state, eyes=_next(layout.eyes, state.eyes)), None
    if low == "l" and layout.looks:
        return replace(state, look=_next(layout.looks, state.look)), None
    return state, None


def stepped(state: State, frames: float) -> State:
    """`frames` on; beyond the last frame it begins anew."""
    first, last = state.span
    if not state.is_scene:
        frames = math.copysign(max(1.0, abs(frames)), frames)
    length = last - first + 1
    frame = first + (round(state.frame + frames, 6) - first) % length
    return replace(state, frame=frame)


def played(state: State, seconds: float) -> State:
    """Return the state `seconds` later."""
    first, last = state.span
    frame = passed(state, seconds * state.speed)
    return replace(state, frame=first + (frame - first) % (last - first + 1))


def _own_camera(state: State) -> tuple[float, float] | None:
    known = inspect.signature(builtin.SCENES[state.source]).parameters
    if not {"cam_x", "cam_y"} <= known.keys():
        return None
    values = {name: known[name].default for name in ("cam_x", "cam_y")}
    values |= state.scene.parameters()
    return float(values["cam_x"]), float(values["cam_y"])


def is_inside(box: Box, x: float, y: float) -> bool:
    """Return True for a place in a box."""
    return box[0] <= x < box[0] + box[2] and box[1] <= y < box[1] + box[3]


def _held(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _next(names: tuple[str, ...], now: str) -> str:
    return names[(names.index(now) + 1) % len(names)] if now in names else names[0]
