"""Rigid bodies as data, and 4 x 4 matrices over time.

World: right-handed, y up, metres; time in seconds. A body is a unit sphere, cube (-1..1),
cylinder (along z) or ring (about y) that `place(t)` puts into the world; patterns are listed in
wgsl/scene/pattern.wgsl. Every function of time takes an array of times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

Color = tuple[float, float, float]
Pose = Callable[[np.ndarray], np.ndarray]  # times (n,) -> world_from_body (n, 4, 4)
SHAPES = ("sphere", "box", "cylinder", "ring")
PATTERNS = ("PLAIN", "CHECKER", "STRIPES", "BRICKS", "DOTS", "GROUND")


def times_of(t: ArrayLike) -> np.ndarray:
    """(n,) float64 of a number or an array."""
    return np.atleast_1d(np.asarray(t, np.float64))


def translation(x: ArrayLike, y: ArrayLike, z: ArrayLike, like: ArrayLike) -> np.ndarray:
    """(n, 4, 4) translations [scene units], by numbers or by (n,) arrays over the times `like`."""
    m = np.tile(np.eye(4), (len(times_of(like)), 1, 1))
    for row, value in enumerate((x, y, z)):
        m[:, row, 3] = value
    return m


def scaling(size: Iterable[float], like: ArrayLike) -> np.ndarray:
    """(n, 4, 4) scalings by three constant half extents, for the n times `like`."""
    return np.tile(np.diag([*size, 1.0]), (len(times_of(like)), 1, 1))


def rotation(axis: str, angle: ArrayLike, like: ArrayLike) -> np.ndarray:
    """(n, 4, 4) right-handed rotations about "x", "y" or "z" by `angle` [rad], at times `like`."""
    angle = np.broadcast_to(np.asarray(angle, np.float64), times_of(like).shape)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    m = translation(0, 0, 0, like)
    m[:, i, i] = m[:, j, j] = np.cos(angle)
    m[:, j, i] = np.sin(angle)
    m[:, i, j] = -m[:, j, i]
    return m


@dataclass(frozen=True)
class Body:
    """One rigid body of a scene. Colours are linear, three numbers each."""

    shape: str
    """"sphere", "box", "cylinder" (along z) or "ring" (about y)."""
    size: tuple[float, float, float]
    """Half extents [scene units], over 0; a ring's tube is as thick as it is high, 2 size[1]."""
    pose: Pose
    """A function of (n,) times [s]: (n, 4, 4) world from body, without the size."""
    color: Color = (0.7, 0.7, 0.7)
    second_color: Color = (0.2, 0.2, 0.2)
    """The other colour of the pattern."""
    pattern: str = "PLAIN"
    """"PLAIN", "CHECKER", "STRIPES", "BRICKS", "DOTS" or "GROUND"."""
    repeats: tuple[float, float] = (1.0, 1.0)
    """Repetitions of the pattern along the two directions of the surface."""
    emission: float = 0.0
    """Factor of the body's own light, which is its colour times this."""
    specular: float = 0.0
    """Strength of the highlight of the sun."""

    def world_from_body(self, t: ArrayLike) -> np.ndarray:
        """(n, 4, 4) world from body at the (n,) times `t` [s], size included."""
        return self.pose(times_of(t)) @ scaling(self.size, t)


def at(x: float, y: float, z: float, yaw: float = 0.0, pitch: float = 0.0) -> Pose:
    """A static pose at x, y, z [scene units], with yaw about y and then pitch about x [rad]."""
    return lambda t: translation(x, y, z, t) @ rotation("y", yaw, t) @ rotation("x", pitch, t)


def moving(
    start: Iterable[float],
    velocity: Iterable[float],
    *,
    spin: float = 0.0,
    axis: str = "z",
    fall: float = 0.0,
) -> Pose:
    """A pose along a line or, with `fall`, a parabola.

    `start` [scene units] is the position at time 0, `velocity` [scene units/s], `fall` the
    acceleration along -y [scene units/s^2], `spin` the rotation about `axis` [rad/s].
    """
    (x, y, z), (u, v, w) = start, velocity
    return lambda t: (
        translation(x + u * t, y + v * t - 0.5 * fall * t * t, z + w * t, t)
        @ rotation(axis, spin * t, t)
    )
