"""Scenes as data: rigid bodies, a camera and light, anywhere in time.

World: right-handed, y up, metres; time in seconds. A body is a unit sphere, cube (-1..1) or
cylinder (along z) that `place(t)` puts into the world; patterns are listed in
wgsl/scene/pattern.wgsl. Every function of time takes an array of times.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .errors import InputError

Color = tuple[float, float, float]
Place = Callable[[np.ndarray], np.ndarray]  # times (n,) -> world_from_body (n, 4, 4)
SHAPES = ("sphere", "box", "cylinder")
PATTERNS = ("PLAIN", "CHECKER", "STRIPES", "BRICKS", "DOTS")


# ---- matrices over time ---------------------------------------------------------------------


def _times(t) -> np.ndarray:
    return np.atleast_1d(np.asarray(t, np.float64))


def translation(x, y, z, like) -> np.ndarray:
    """(n, 4, 4) for numbers or arrays over the times `like`."""
    m = np.tile(np.eye(4), (len(_times(like)), 1, 1))
    for row, value in enumerate((x, y, z)):
        m[:, row, 3] = value
    return m


def scaling(size, like) -> np.ndarray:
    """(n, 4, 4) of constant half extents."""
    return np.tile(np.diag([*size, 1.0]), (len(_times(like)), 1, 1))


def rotation(axis: str, angle, like) -> np.ndarray:
    """(n, 4, 4) about "x", "y" or "z" by radians, right-handed."""
    angle = np.broadcast_to(np.asarray(angle, np.float64), _times(like).shape)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    m = translation(0, 0, 0, like)
    m[:, i, i] = m[:, j, j] = np.cos(angle)
    m[:, j, i] = np.sin(angle)
    m[:, i, j] = -m[:, j, i]
    return m


@dataclass(frozen=True)
class Body:
    """One rigid thing; `path` gives its place without its size."""

    shape: str
    size: tuple[float, float, float]
    path: Place
    color: Color = (0.7, 0.7, 0.7)
    other: Color = (0.2, 0.2, 0.2)
    pattern: str = "PLAIN"
    repeats: tuple[float, float] = (1.0, 1.0)
    light: float = 0.0
    gloss: float = 0.0

    def world_from_body(self, t) -> np.ndarray:
        """(n, 4, 4) at the times `t` [s]."""
        return self.path(_times(t)) @ scaling(self.size, t)


def at(x: float, y: float, z: float, yaw: float = 0.0, pitch: float = 0.0) -> Place:
    """A place that does not move; yaw about y, then pitch about x [radians]."""
    return lambda t: translation(x, y, z, t) @ rotation("y", yaw, t) @ rotation("x", pitch, t)


def moving(start, velocity, *, spin: float = 0.0, axis: str = "z", fall: float = 0.0) -> Place:
    """Along a line or, with `fall` [m/s^2], a parabola; spinning about `axis` [rad/s]."""
    (x, y, z), (u, v, w) = start, velocity
    return lambda t: (
        translation(x + u * t, y + v * t - 0.5 * fall * t * t, z + w * t, t)
        @ rotation(axis, spin * t, t)
    )


@dataclass(frozen=True)
class Shot:
    """A camera over time: where it is and looks, and how wide [functions of seconds]."""

    position: Callable[[np.ndarray], tuple]
    yaw: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    pitch: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    roll: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    zoom: Callable[[np.ndarray], np.ndarray] = lambda t: 1.6 + 0 * t
    """Focal length in halves of the picture's height."""
    orbit: tuple[float, float] = (0.0, 0.0)
    """Angles by which a viewer went round the pivot: to the right, and up [radians]."""
    pan: tuple[float, float] = (0.0, 0.0)
    """How far a viewer then went to the right, and up [scene units]."""
    dolly: float = 1.0
    """Times the distance to the pivot."""
    pivot: float = 5.0
    """How far in front of the camera the pivot is [scene units]."""

    def world_from_camera(self, t) -> np.ndarray:
        """(n, 4, 4); the camera looks along -z, y up."""
        t = _times(t)
        x, y, z = self.position(t)
        turned = rotation("y", self.yaw(t), t) @ rotation("x", self.pitch(t), t)
        own = translation(x, y, z, t) @ turned @ rotation("z", self.roll(t), t)
        if (self.orbit, self.pan, self.dolly) == ((0.0, 0.0), (0.0, 0.0), 1.0):
            return own
        px, py, pz = (own @ np.array([0, 0, -self.pivot, 1.0]))[:, :3].T
        aside, up = self.orbit
        round_ = (
            translation(px, py, pz, t) @ rotation("y", aside, t) @ translation(-px, -py, -pz, t)
        )
        over = translation(0, 0, -self.pivot, t) @ rotation("x", -up, t)
        return round_ @ own @ over @ translation(*self.pan, self.pivot * self.dolly, t)

    def clip_from_camera(self, t, aspect: float, near: float = 0.05, far: float = 1000.0):
        """(n, 4, 4) OpenGL projections."""
        zoom = np.broadcast_to(self.zoom(_times(t)), _times(t).shape)
        m = np.zeros((len(zoom), 4, 4))
        m[:, 0, 0], m[:, 1, 1] = zoom / aspect, zoom
        m[:, 2, 2] = -(far + near) / (far - near)
        m[:, 2, 3] = -2 * far * near / (far - near)
        m[:, 3, 2] = -1
        return m


@dataclass(frozen=True)
class Scene:
    """What is rendered."""

    name: str
    bodies: tuple[Body, ...]
    shot: Shot
    sun: tuple[float, float, float, float] = (0.45, 0.8, 0.5, 0.95)
    """Direction towards it (any length) and its strength."""
    sky: tuple[float, float, float, float] = (0.22, 0.42, 0.78, 0.32)
    """Colour straight up; strength of the light from all round."""
    horizon: Color = (0.62, 0.72, 0.82)

    def __post_init__(self):
        for body in self.bodies:
            if body.shape not in SHAPES:
                raise InputError(f"shape must be one of {', '.join(SHAPES)}, got {body.shape!r}")
            if not all(1e-15 < s < 1e15 for s in body.size):
                raise InputError(f"a {body.shape} needs positive sizes, got {body.size}")
            if body.pattern not in PATTERNS:
                raise InputError(
                    f"pattern must be one of {', '.join(PATTERNS)}, got {body.pattern!r}"
                )
            looks = (*body.color, *body.other, *body.repeats, body.light, body.gloss)
            if not _all_finite(looks):
                raise InputError(f"a {body.shape} needs colours and lights in f32, got {looks}")
        if not _all_finite((*self.sun, *self.sky, *self.horizon)) or not any(self.sun[:3]):
            raise InputError(
                f"sun and sky must be finite and somewhere, got {self.sun}, {self.sky}"
            )
        # Bodies come by shape on the GPU; the stable order keeps indices.
        object.__setattr__(
            self, "bodies", tuple(sorted(self.bodies, key=lambda b: SHAPES.index(b.shape)))
        )

    def seen_from(
        self, orbit: tuple[float, float], pan: tuple[float, float], dolly: float
    ) -> Scene:
        """The same scene, its camera moved as `Shot.orbit`, `pan` and `dolly` say."""
        values = (*orbit, *pan, dolly)
        if not _all_finite(values) or not 0 < dolly <= 1000:
            raise InputError(f"orbit, pan and dolly must be finite, dolly over 0, got {values}")
        return replace(self, shot=replace(self.shot, orbit=orbit, pan=pan, dolly=dolly))


def _all_finite(numbers) -> bool:
    """As the GPU has them, with room for a product."""
    return all(abs(x) < 1e30 for x in numbers)
