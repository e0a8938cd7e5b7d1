"""Scenes as data: rigid bodies, turning volumes, a camera and light, anywhere in time.

World: right-handed, y up, metres; time in seconds. A body is a unit sphere, cube (-1..1),
cylinder (along z) or ring (about y) that `place(t)` puts into the world; patterns are listed in
wgsl/scene/pattern.wgsl. Every function of time takes an array of times.
A volume is a sphere on a circle or a turning torus whose blur has a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .errors import InputError

if TYPE_CHECKING:
    from .figures import Figure

Color = tuple[float, float, float]
Place = Callable[[np.ndarray], np.ndarray]  # times (n,) -> world_from_body (n, 4, 4)
SHAPES = ("sphere", "box", "cylinder", "ring")
PATTERNS = ("PLAIN", "CHECKER", "STRIPES", "BRICKS", "DOTS", "GROUND")


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
    """One rigid thing; `path` gives its place without its size.

    `size`: half extents; a ring's tube is as thick as it is high, 2 size[1].
    """

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


@dataclass(frozen=True, kw_only=True)
class Orbit:
    """A sphere of `radius` whose centre runs on a circle of radius `orbit` about an axis along y.

    `phase`: its angle at time 0 [rad], right-handed from +x. `speed`: [rad/s], any size and sign.
    `opacity`: multiplies its density; more than 1 makes fast ones visible, as what is seen goes
    with the square of density. `facing`: how much it counts in the normals of all the volumes
    that are blended; None: as much as its density at the place.
    """

    radius: float
    orbit: float
    speed: float = 0.0
    phase: float = 0.0
    color: Color = (0.8, 0.9, 1.0)
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    opacity: float = 1.0
    facing: float | None = None

    def __post_init__(self):
        _positive(self, "radius")
        if not (math.isfinite(self.orbit) and self.orbit >= 0):
            raise InputError(f"orbit must be 0 or more, got {self.orbit}")
        _check_volume(self)

    @property
    def reach(self) -> float:
        """Radius of the sphere around the centre that it never leaves."""
        return self.orbit + self.radius

    def solid(self) -> Body:
        """The sphere itself, at every time."""
        r = self.radius
        return Body(
            "sphere",
            (r, r, r),
            lambda t: (
                translation(*self.centre, t)
                @ rotation("y", self.phase + self.speed * t, t)
                @ translation(self.orbit, 0, 0, t)
            ),
            self.color,
        )


@dataclass(frozen=True, kw_only=True)
class Torus:
    """A torus whose ring lies in xz at angle 0 and that turns about z.

    `phase`: its angle at time 0 [rad], right-handed. `speed`: [rad/s], any size and sign.
    `opacity`, `facing`: as for Orbit; `swell`: its normals are those of a torus so much smaller.
    """

    minor_radius: float
    major_radius: float
    speed: float = 0.0
    phase: float = 0.0
    color: Color = (0.8, 0.9, 1.0)
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    opacity: float = 1.0
    facing: float | None = None
    swell: float = 1.0

    def __post_init__(self):
        _positive(self, "minor_radius")
        _positive(self, "major_radius")
        _positive(self, "swell")
        if self.minor_radius > self.major_radius:
            raise InputError(
                "minor_radius must not exceed major_radius, "
                f"got {self.minor_radius} and {self.major_radius}"
            )
        _check_volume(self)

    @property
    def reach(self) -> float:
        """Radius of the sphere around the centre that it never leaves."""
        return self.major_radius + self.minor_radius

    def solid(self) -> Body:
        """The torus itself, at every time."""
        return Body(
            "ring",
            (self.reach, self.minor_radius, self.reach),
            lambda t: translation(*self.centre, t) @ rotation("z", self.phase + self.speed * t, t),
            self.color,
        )


Volume = Orbit | Torus


def _positive(volume: Volume, name: str) -> None:
    if not (math.isfinite(value := getattr(volume, name)) and value > 0):
        raise InputError(f"{name} must be over 0, got {value}")


def _check_volume(volume: Volume) -> None:
    for name in ("speed", "phase"):
        if not math.isfinite(value := getattr(volume, name)):
            raise InputError(f"{name} must be finite, got {value}")
    for name in ("opacity", "facing"):
        value = getattr(volume, name)
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise InputError(f"{name} must be 0 or more, got {value}")
    if not all(map(math.isfinite, (*volume.centre, *volume.color))):
        raise InputError(f"centre and color must be finite, got {volume.centre}, {volume.color}")


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What volumes are shown on: a ground with three grids of lines, a sky, a light.

    Colours are display values, as in the animation that this is from (Cusa 2022, torusphere).
    `grids`: side of the cells and brightness of each. `strobe`: phase [rad] and amount of a
    flicker. `bound`: radius of the sphere around the origin that is searched for volumes, a
    twentieth of it a step; None: what holds them all. `grain`: another number is other noise.
    """

    tint: Color = (0.33, 0.18, 0.10)
    ground: float = -0.8
    light: tuple[float, float, float] = (5.0, 6.0, 1.0)
    grids: tuple[tuple[float, float], ...] = ((2.0, 0.2), (0.5, 0.1), (0.125, 0.05))
    strobe: tuple[float, float] = (0.0, 0.0)
    bound: float | None = None
    grain: int = 0

    def __post_init__(self):
        if len(self.grids) != 3 or not all(
            side > 0 and math.isfinite(side + light) for side, light in self.grids
        ):
            raise InputError(f"grids must be three sides over 0 and brightnesses, got {self.grids}")
        if not any(self.light):
            raise InputError(f"light must be a direction, got {self.light}")

    def body(self) -> Body:
        """The ground."""
        size = (1000.0, 0.5, 1000.0)
        return Body("box", size, at(0, self.ground - 0.5, 0), self.tint, pattern="GROUND")

    def fill(self, row: np.ndarray) -> None:
        """Write it into a `Stage` of wgsl/scene/stage.wgsl."""
        row["tint"] = (*self.tint, self.ground)
        row["light"][:3] = np.array(self.light) / np.linalg.norm(self.light)
        row["cells"][:3], row["weights"][:3] = zip(*self.grids, strict=True)


Instant = tuple[tuple[Volume, ...], Stage]


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


DENSITIES = ("exact", "published")


@dataclass(frozen=True)
class Scene:
    """What is rendered.

    `volumes` are shown blurred by the method "volume", and as solid bodies by all others. A
    function gives them and their stage around an instant [s], with `phase` the angle at it.
    `density`: "exact" counts every revolution within the exposure, "published" one crossing.
    """

    name: str
    bodies: tuple[Body, ...]
    shot: Shot
    sun: tuple[float, float, float, float] = (0.45, 0.8, 0.5, 0.95)
    """Direction towards it (any length) and its strength."""
    sky: tuple[float, float, float, float] = (0.22, 0.42, 0.78, 0.32)
    """Colour straight up; strength of the light from all round."""
    horizon: Color = (0.62, 0.72, 0.82)
    volumes: tuple[Volume, ...] | Callable[[float], Instant] = ()
    stage: Stage | None = None
    density: str = "exact"
    exposure: tuple[float, str] | None = None
    """The shutter it is made for: seconds, curve."""
    loop: float | None = None
    """After this time it begins anew [s]."""
    figure: Figure | None = None
    """A flat picture instead, for the method "volume"."""

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
        if self.density not in DENSITIES:
            raise InputError(f"density must be one of {', '.join(DENSITIES)}, got {self.density!r}")
        # Bodies come by shape on the GPU; the stable order keeps indices.
        object.__setattr__(
            self, "bodies", tuple(sorted(self.bodies, key=lambda b: SHAPES.index(b.shape)))
        )

    @property
    def has_volumes(self) -> bool:
        """Whether the method "volume" has anything to show."""
        return bool(self.volumes) or self.figure is not None

    def instant(self, time: float) -> Instant:
        """Its volumes and their stage around `time` [s]; phases are the angles at it."""
        if callable(self.volumes):
            return self.volumes(time)
        turned = tuple(
            replace(v, phase=math.fmod(v.phase + v.speed * time, 2 * math.pi)) for v in self.volumes
        )
        return turned, self.stage or Stage()

    def solid(self, time: float) -> Scene:
        """The scene around `time` [s], its volumes turned into bodies.

        Of volumes that are blended into one another, the densest is there.
        """
        volumes, stage = self.instant(time)
        if not volumes:
            return self
        most = max((v.opacity for v in volumes if v.facing is not None), default=0.0)
        there = [v for v in volumes if v.facing is None or v.opacity == most]
        bodies = [_since(v.solid(), time) for v in there]
        return replace(self, bodies=(*self.bodies, *bodies, stage.body()), stage=stage)

    def seen_from(
        self, orbit: tuple[float, float], pan: tuple[float, float], dolly: float
    ) -> Scene:
        """The same scene, its camera moved as `Shot.orbit`, `pan` and `dolly` say."""
        values = (*orbit, *pan, dolly)
        if not _all_finite(values) or not 0 < dolly <= 1000:
            raise InputError(f"orbit, pan and dolly must be finite, dolly over 0, got {values}")
        return replace(self, shot=replace(self.shot, orbit=orbit, pan=pan, dolly=dolly))


def _since(body: Body, time: float) -> Body:
    """A body whose path counts from `time` [s]."""
    return replace(body, path=lambda t: body.path(t - time))


def _all_finite(numbers) -> bool:
    """As the GPU has them, with room for a product."""
    return all(abs(x) < 1e30 for x in numbers)
