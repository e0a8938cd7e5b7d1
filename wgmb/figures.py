"""The article's figures as scenes (P. Cusa, "Motion Blur All the Way Down", 2022).

Flat pictures in display values: an orbiting disk, what a cone cell makes of it, a torus in section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .errors import InputError
from .perceive import VIDEOS, Cone
from .scene import Scene, Shot
from .shutter import Shutter

KINDS = ("DISK", "NATURAL", "SCREEN", "SPIRIC")
RADIUS, ORBIT = 0.1, 0.2  # of the disk and its circle [picture heights]
RATE = 60.0  # frames a second of figures 2 and 3
WAYS = 10  # frames that figure 3 adds up
FASTEST = 1e4  # rad/s: beyond, nothing changes and a loop over passes is long


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One of KINDS. `small`, `large`: radii; `rotation`: clockwise at time 0 [rad].

    `shutter`: of a kind that has its own, with RATE frames a second.
    """

    kind: str
    small: float = RADIUS
    large: float = ORBIT
    slice: float = 0.0
    speed: float
    rotation: float = 0.0
    begin: float = 0.0
    shutter: Shutter | None = None

    def __post_init__(self):
        if not 0 <= self.speed <= FASTEST:
            raise InputError(f"speed must be 0 to {FASTEST:g} rad/s, got {self.speed}")

    def fill(self, row: np.ndarray, time: float) -> None:
        """Write what is seen at `time` [s] into a `Figure` of wgsl/figure.wgsl."""
        cone, time = Cone(), self.begin + time
        row["small"], row["large"], row["slice"] = self.small, self.large, self.slice
        # Standing still is perceived as the slowest motion is.
        row["speed"] = max(self.speed, 1e-3)
        row["sharpness"] = cone.rate, cone.shift
        row["passes"] = math.ceil(cone.memory * self.speed / (2 * math.pi)) + 1
        row["dash"] = 1.0 if self.kind == "NATURAL" else 0.0
        if self.kind == "SCREEN":
            number = math.floor(RATE * time + 1e-9)
            frames = (number - np.arange(WAYS)) / RATE
            # As the article has it: each frame counts from its instant on.
            row["frames"][:WAYS, 1] = cone.weights(time - frames + 0.5 / RATE, 1 / RATE)
            row["frames"][:WAYS, 0] = self._angle(frames)
            row["ways"], time = WAYS, number / RATE
        row["rotation"] = row["shown"] = self._angle(time)

    def _angle(self, time):
        return np.remainder(self.rotation + self.speed * time, 2 * math.pi)


def _scene(name: str, figure: Figure) -> Scene:
    still = Shot(lambda t: (0 * t, 0 * t, 1 + 0 * t))
    return Scene(name, (), still, figure=figure, exposure=(1 / RATE, "box"))


def disk(speed: float = 20.0, rotation: float = 1.0) -> Scene:
    """Figure 5: a frame of a disk on a circle, `speed` [rad/s], turned by `rotation` at time 0."""
    return _scene("disk", Figure(kind="DISK", speed=speed, rotation=rotation))


def cone(video: str = "natural", time: float = 0.0, speed: float = 15.0) -> Scene:
    """Figures 2 and 3: the disk beside what a cone cell makes of it, `time` [s] later.

    `video`: "natural", or how frames are blurred: none, box, trapezoid, cosine, at 60 a second.
    """
    if video == "natural":
        return _scene("cone", Figure(kind="NATURAL", speed=speed, begin=time))
    if video not in VIDEOS:
        raise InputError(f"video must be natural or one of {', '.join(VIDEOS)}, got {video!r}")
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
