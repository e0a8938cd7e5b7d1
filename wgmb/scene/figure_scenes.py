"""The article's figures as scenes (P. Cusa, "Motion Blur All the Way Down", 2022)."""

from __future__ import annotations

from ..cone import VIDEOS
from ..errors import InputError, check_choice
from .figure import RATE, Figure
from .scene import CameraPath, Scene


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
