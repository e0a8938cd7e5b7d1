"""The built-in scenes, one function each; `--set name=value` sets its keyword arguments.

Speeds are made for 24 frames per second and pictures about 640 pixels wide.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..cone import VIDEOS
from ..errors import InputError, check_choice, did_you_mean
from .bodies import Body, Color, at, moving, rotation, translation
from .figure import RATE, Figure
from .scene import CameraPath, Scene
from .torusphere import torusphere

# ---- the article's figures as scenes (P. Cusa, "Motion Blur All the Way Down", 2022) ----------


def _scene(name: str, figure: Figure) -> Scene:
    still = CameraPath(lambda t: (0 * t, 0 * t, 1 + 0 * t))
    return Scene(name, (), still, figure=figure, exposure=(1 / RATE, "box"))


def disk(speed: float = 20.0, rotation: float = 1.0) -> Scene:
    """Figure 5: a frame of a disk on a circle, `speed` [rad/s], turned by `rotation` at time 0."""
    return _scene("disk", Figure(kind="DISK", speed=speed, rotation=rotation))


def cone(video: str = "natural", time: float = 0.0, speed: float = 15.0) -> Scene:
    """Figures 2 and 3: the disk beside the response of a cone cell, `time` [s] later.

    `video`: "natural", or how frames are blurred: none, box, trapezoid, cosine, at 60 a second.
    """
    if video == "natural":
        return _scene("cone", Figure(kind="NATURAL", speed=speed, begin=time))
    check_choice("video", video, ("natural", *VIDEOS))
    shutter = VIDEOS[video]
    return _scene("cone", Figure(kind="SCREEN", speed=speed, begin=time, shutter=shutter))


def spiric(
    minor_radius: float = 0.18,
    major_radius: float = 0.32,
    slice: float = 0.08,
    speed: float = 60.0,
) -> Scene:
    """Figure 6: a torus that turns, `speed` [rad/s], in the plane z = `slice`."""
    if not 0 < minor_radius <= major_radius:
        raise InputError(
            "minor_radius must be over 0 and at most major_radius, "
            f"got {minor_radius} and {major_radius}"
        )
    figure = Figure(kind="SPIRIC", small=minor_radius, large=major_radius, slice=slice, speed=speed)
    return _scene("spiric", figure)


# ---- the scenes by their names ----------------------------------------------------------------


RED, ORANGE, YELLOW = (0.72, 0.10, 0.07), (0.85, 0.36, 0.08), (0.90, 0.72, 0.18)
GREEN, TEAL, BLUE = (0.12, 0.42, 0.16), (0.08, 0.45, 0.46), (0.08, 0.20, 0.58)
PLUM, CREAM, STONE = (0.36, 0.12, 0.36), (0.88, 0.84, 0.74), (0.48, 0.46, 0.44)
SAND = (0.62, 0.57, 0.48)
INK, WOOD = (0.05, 0.05, 0.07), (0.42, 0.24, 0.12)
TURN = 2 * math.pi


def _ground(color: Color = SAND, other: Color = STONE) -> Body:
    return Body(
        "box", (40, 0.5, 40), at(0, -0.5, 0), color, other, "CHECKER", (0.5, 0.5), specular=0.1
    )


def _wall(z: float = -8.0) -> Body:
    brick = (0.50, 0.20, 0.13)
    return Body("box", (14, 3, 0.3), at(0, 3, z), brick, (0.62, 0.58, 0.53), "BRICKS", (3.2, 3.2))


def _room() -> tuple[Body, ...]:
    """A hall with pillars, crates and balls: Taylor's kind of static scene."""
    pillars = [
        Body(
            "cylinder",
            (0.35, 0.35, 1.7),
            at(x, 1.7, z, pitch=math.pi / 2),
            CREAM,
            TEAL,
            "STRIPES",
            (6, 1),
            specular=0.2,
        )
        for x in (-3.4, 3.4)
        for z in (-6.0, -3.2, -0.4)
    ]
    crates = [
        Body("box", (s, s, s), at(x, s, z, yaw), color, INK, "CHECKER", (2 / s, 2 / s))
        for x, z, s, yaw, color in (
            (-1.7, -4.6, 0.55, 0.4, ORANGE),
            (1.5, -5.2, 0.7, -0.3, BLUE),
            (0.3, -2.6, 0.32, 0.9, GREEN),
            (-2.4, -1.9, 0.38, 0.2, RED),
            (2.3, -2.3, 0.34, 0.6, PLUM),
        )
    ]
    balls = [
        Body("sphere", (r, r, r), at(x, r, z), color, CREAM, pattern, repeats, specular=0.5)
        for x, z, r, color, pattern, repeats in (
            (-0.6, -3.7, 0.5, RED, "DOTS", (16, 16)),
            (1.1, -3.4, 0.38, TEAL, "STRIPES", (14, 1)),
            (-1.2, -1.4, 0.24, YELLOW, "CHECKER", (12, 12)),
            (0.9, -6.3, 0.8, PLUM, "CHECKER", (18, 18)),
        )
    ]
    return (_ground(), _wall(), *pillars, *crates, *balls)


def translation_(speed: float = 2.4) -> Scene:
    """Taylor's translation: the camera moves sideways, `speed` [m/s]."""
    shot = CameraPath(lambda t: (-0.05 + speed * t, 1.3, 2.2), pitch=lambda t: -0.07 + 0 * t)
    return Scene("translation", _room(), shot)


def scaling_(dolly: float = 6.0, zoom: float = 0.0) -> Scene:
    """Taylor's scaling: the camera comes closer, `dolly` [m/s], or zooms, `zoom` [ln/s]."""
    shot = CameraPath(
        lambda t: (0 * t, 1.3, 2.6 - dolly * t),
        pitch=lambda t: -0.07 + 0 * t,
        zoom=lambda t: 1.6 * np.exp(zoom * t),
    )
    return Scene("scaling", _room(), shot)


def rotation_(roll: float = 1.5, yaw: float = 0.0) -> Scene:
    """Taylor's rotation: the camera rolls and turns, `roll` and `yaw` [rad/s]."""
    shot = CameraPath(
        lambda t: (0 * t, 1.4, 2.4),
        yaw=lambda t: yaw * t,
        pitch=lambda t: -0.06 + 0 * t,
        roll=lambda t: roll * t,
    )
    return Scene("rotation", _room(), shot)


def crossing(speed: float = 1.0) -> Scene:
    """Balls and crates cross in front of and behind each other; `speed` scales all motion."""
    v = speed
    movers = (
        Body(
            "sphere",
            (0.55, 0.55, 0.55),
            moving((-0.9, 1.25, -2.6), (6.5 * v, 0, 0), spin=-9 * v),
            RED,
            CREAM,
            "CHECKER",
            (12, 12),
            specular=0.5,
        ),
        Body(
            "sphere",
            (0.75, 0.75, 0.75),
            moving((1.2, 1.7, -4.4), (-8 * v, 0.6 * v, 0), spin=6 * v),
            TEAL,
            CREAM,
            "STRIPES",
            (12, 1),
            specular=0.5,
        ),
        Body(
            "box",
            (0.4, 0.4, 0.4),
            moving((1.7, 0.75, -1.6), (-4 * v, 0.5 * v, 0), spin=7 * v, axis="y"),
            YELLOW,
            INK,
            "CHECKER",
            (3, 3),
        ),
        Body(
            "box",
            (0.16, 0.9, 0.16),
            moving((-1.8, 1.0, -3.4), (7 * v, 0, 0.4 * v), spin=5 * v),
            ORANGE,
            CREAM,
            "STRIPES",
            (4, 4),
        ),
        Body(
            "cylinder",
            (0.22, 0.22, 0.7),
            moving((0.2, 2.5, -3.2), (0, -5 * v, 0), spin=8 * v, axis="x"),
            BLUE,
            CREAM,
            "STRIPES",
            (8, 1),
            specular=0.3,
        ),
    )
    still = (
        _ground(),
        _wall(-7),
        Body(
            "cylinder",
            (0.12, 0.12, 1.6),
            at(-0.55, 1.6, -0.9, pitch=math.pi / 2),
            YELLOW,
            INK,
            "CHECKER",
            (4, 3),
        ),
        Body("box", (0.5, 0.5, 0.5), at(1.9, 0.5, -5.4, 0.5), PLUM, CREAM, "CHECKER", (2, 2)),
        Body("box", (0.4, 0.4, 0.4), at(-2.3, 0.4, -5.0, 0.2), GREEN, CREAM, "CHECKER", (3, 3)),
    )
    return Scene("crossing", (*movers, *still), _still_camera())


def _still_camera() -> CameraPath:
    return CameraPath(lambda t: (0 * t, 1.4, 2.6), pitch=lambda t: -0.04 + 0 * t)


def wheel(speed: float = 24.0, roll: float = 0.0) -> Scene:
    """Two spoked wheels and a fan, `speed` [rad/s]; with `roll` [m/s] they travel."""
    bodies = [_ground(), _wall(-6)]
    for x, z, radius, spokes, turn, color in (
        (-1.2, -1.8, 1.0, 8, -speed, RED),
        (1.5, -2.6, 0.85, 5, 0.6 * speed, TEAL),
    ):
        hub = (x, radius + 0.12, z)
        for k in range(spokes):
            bodies.append(
                Body(
                    "box",
                    (radius * 0.5, 0.05, 0.04),
                    _on_wheel(hub, roll, turn, TURN * k / spokes, radius * 0.5),
                    CREAM,
                )
            )
        for k in range(12):
            bodies.append(
                Body(
                    "box",
                    (radius * 0.27, 0.07, 0.09),
                    _on_wheel(hub, roll, turn, TURN * (k + 0.5) / 12, radius, 0.5 * TURN / 2),
                    color if k % 2 else INK,
                )
            )
        bodies.append(
            Body(
                "cylinder",
                (0.16, 0.16, 0.1),
                _on_wheel(hub, roll, turn, 0.0, 0.0),
                YELLOW,
                specular=0.5,
            )
        )
    return Scene("wheel", tuple(bodies), _still_camera())


def _on_wheel(
    hub: Any, travel: float, turn: float, angle: float, radius: float, twist: float = 0.0
):
    """A place on a turning wheel: at `angle` and `radius`, turned by `twist` there."""
    x, y, z = hub
    return lambda t: (
        translation(x + travel * t, y, z, t)
        @ rotation("z", angle + turn * t, t)
        @ translation(radius, 0, 0, t)
        @ rotation("z", twist, t)
    )


def fence(speed: float = 3.0, posts: int = 15) -> Scene:
    """A thin fence close by, the hall behind it, the camera passing, `speed` [m/s]."""
    if not 1 <= posts <= 200:
        raise InputError(f"posts must be 1 to 200, got {posts}")
    xs = (np.arange(posts) - (posts - 1) / 2) * 0.34
    pickets = [Body("box", (0.028, 0.75, 0.02), at(float(x), 0.75, 0.9), CREAM) for x in xs]
    wide = float(abs(xs[0])) + 0.2
    rails = [Body("box", (wide, 0.03, 0.015), at(0, y, 0.86), WOOD) for y in (0.45, 1.2)]
    shot = CameraPath(lambda t: (-0.06 + speed * t, 1.25, 2.4), pitch=lambda t: -0.06 + 0 * t)
    return Scene("fence", (*_room(), *pickets, *rails), shot)


def bounce(gravity: float = 60.0, speed: float = 5.0) -> Scene:
    """Balls on parabolas, curved well within a frame: `gravity` [m/s^2], `speed` [m/s]."""
    balls = [
        Body(
            "sphere",
            (r, r, r),
            moving((x, y, z), (vx * speed, vy * speed, 0), spin=s, fall=gravity),
            color,
            CREAM,
            "DOTS",
            (14, 14),
            specular=0.5,
        )
        for x, y, z, r, vx, vy, s, color in (
            (-1.6, 1.0, -2.4, 0.4, 1.0, 1.1, -8, RED),
            (0.2, 2.2, -3.2, 0.5, -0.8, 0.3, 7, BLUE),
            (1.6, 0.9, -1.8, 0.3, -0.6, 1.5, 9, ORANGE),
            (-0.4, 1.2, -1.4, 0.22, 0.9, 0.9, -9, GREEN),
        )
    ]
    return Scene("bounce", (_ground(), _wall(-6), *balls), _still_camera())


def hdr(light: float = 60.0, speed: float = 1.0) -> Scene:
    """Small, very bright lights on circles and lines at dusk; `light` times white."""
    lamps = []
    for k, color in enumerate((RED, YELLOW, TEAL, CREAM, ORANGE, BLUE)):
        hub = (-1.9 + 0.75 * k, 1.5 + 0.35 * (k % 2), -2.2 - 0.4 * (k % 3))
        turn = (14.0 - 3 * k) * speed
        path = _on_wheel(hub, 0.0, turn, 1.1 * k, 0.55)
        size = 0.035 + 0.01 * (k % 3)
        lamps.append(Body("sphere", (size, size, size), path, color, emission=light))
    return Scene(
        "hdr",
        (*_room(), *lamps),
        _still_camera(),
        sun=(0.4, 0.5, 0.6, 0.25),
        sky=(0.02, 0.03, 0.08, 0.12),
        horizon=(0.10, 0.09, 0.12),
    )


SCENES: dict[str, Callable[..., Scene]] = {
    "translation": translation_,
    "scaling": scaling_,
    "rotation": rotation_,
    "crossing": crossing,
    "wheel": wheel,
    "fence": fence,
    "bounce": bounce,
    "hdr": hdr,
    "torusphere": torusphere,
    "disk": disk,
    "cone": cone,
    "spiric": spiric,
}


def make(name: str, /, **settings: float | str) -> Scene:
    """The built-in scene `name`; `InputError` names an unknown scene, setting or bad value."""
    if name not in SCENES:
        known = f"available: {', '.join(SCENES)}{did_you_mean(name, SCENES)}"
        raise InputError(f"unknown scene {name!r}; {known}")
    known = inspect.signature(SCENES[name]).parameters
    values = {}
    for key, text in settings.items():
        if key not in known:
            there = f"only {', '.join(known)}{did_you_mean(key, known)}"
            raise InputError(f"scene {name!r} has no setting {key!r}, {there}")
        kind = type(known[key].default)
        try:
            value = kind(text)
        except ValueError:
            raise InputError(f"{key} must be a number, got {text!r}") from None
        if kind is not str and not math.isfinite(value):
            raise InputError(f"{key} must be finite, got {text!r}")
        values[key] = value
    return SCENES[name](**values)
