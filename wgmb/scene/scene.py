"""Scenes as data: rigid bodies, volumes, a camera and light, anywhere in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, check_choice
from .bodies import PATTERNS, SHAPES, Body, Color, rotation, times_of, translation
from .volumes import Backdrop, Instant, Volume

if TYPE_CHECKING:
    from .figure import Figure


@dataclass(frozen=True)
class CameraPath:
    """A camera over time: position, rotation and zoom as functions of (n,) times [s].

    It looks along -z with y up, turned by roll, then pitch, then yaw.
    """

    position: Callable[[np.ndarray], tuple[ArrayLike, ArrayLike, ArrayLike]]
    """x, y and z [scene units], each a number or (n,)."""
    yaw: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    """Rotation about y [rad], positive to the left."""
    pitch: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    """Rotation about x [rad], positive upwards."""
    roll: Callable[[np.ndarray], np.ndarray] = lambda t: 0 * t
    """Rotation about z [rad]."""
    zoom: Callable[[np.ndarray], np.ndarray] = lambda t: 1.6 + 0 * t
    """Focal length in halves of the picture's height, over 0."""
    orbit: tuple[float, float] = (0.0, 0.0)
    """Orbit of the camera around the pivot: to the right, and up [rad]."""
    pan: tuple[float, float] = (0.0, 0.0)
    """Camera movement after the orbit: to the right, and up [scene units]."""
    dolly: float = 1.0
    """Scale of the camera's distance to the pivot, over 0."""
    pivot: float = 5.0
    """Distance of the pivot in front of the camera [scene units]."""

    def world_from_camera(self, t: ArrayLike) -> np.ndarray:
        """(n, 4, 4) world from camera at the (n,) times `t` [s]."""
        t = times_of(t)
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

    def clip_from_camera(
        self, t: ArrayLike, aspect: float, near: float = 0.05, far: float = 1000.0
    ) -> np.ndarray:
        """(n, 4, 4) OpenGL projections at the (n,) times `t` [s].

        `aspect`: width over height of the picture. `near`, `far`: distances of the clip planes
        [scene units].
        """
        zoom = np.broadcast_to(self.zoom(times_of(t)), times_of(t).shape)
        m = np.zeros((len(zoom), 4, 4))
        m[:, 0, 0], m[:, 1, 1] = zoom / aspect, zoom
        m[:, 2, 2] = -(far + near) / (far - near)
        m[:, 2, 3] = -2 * far * near / (far - near)
        m[:, 3, 2] = -1
        return m


DENSITIES = ("exact", "published")


@dataclass(frozen=True)
class Scene:
    """A scene to render: bodies, volumes, camera and light.

    `volumes` are shown blurred by the method "volume", and as solid bodies by all others. A
    function gives them and their backdrop around an instant [s], with `phase` the angle at it.
    `density`: "exact" counts every revolution within the exposure, "published" one crossing.
    """

    name: str
    bodies: tuple[Body, ...]
    camera: CameraPath
    sun: tuple[float, float, float, float] = (0.45, 0.8, 0.5, 0.95)
    """Direction towards the sun (any length but 0), and its strength."""
    sky: tuple[float, float, float, float] = (0.22, 0.42, 0.78, 0.32)
    """Linear colour at the zenith, and the strength of the ambient light."""
    horizon: Color = (0.62, 0.72, 0.82)
    """Linear colour at the horizon."""
    volumes: tuple[Volume, ...] | Callable[[float], Instant] = ()
    """At most 16 of OrbitingSphere and Torus, or a function of the time [s]."""
    backdrop: Backdrop | None = None
    """Surroundings of the volumes; None: a default Backdrop, if there are volumes."""
    density: str = "exact"
    exposure: tuple[float, str] | None = None
    """Default shutter of the scene: seconds, curve."""
    loop: float | None = None
    """Duration after which the scene repeats [s]."""
    figure: Figure | None = None
    """A flat picture instead, for the method "volume"."""

    def __post_init__(self) -> None:
        for body in self.bodies:
            check_choice("shape", body.shape, SHAPES)
            if not all(1e-15 < s < 1e15 for s in body.size):
                raise InputError(f"a {body.shape} needs positive sizes, got {body.size}")
            check_choice("pattern", body.pattern, PATTERNS)
            looks = (*body.color, *body.second_color, *body.repeats, body.emission, body.specular)
            if not _all_finite(looks):
                raise InputError(f"a {body.shape} needs colours and lights within f32, got {looks}")
        if not _all_finite((*self.sun, *self.sky, *self.horizon)) or not any(self.sun[:3]):
            raise InputError(
                "sun direction must not be zero; sun and sky must be finite, "
                f"got {self.sun}, {self.sky}"
            )
        check_choice("density", self.density, DENSITIES)
        # Bodies come by shape on the GPU; the stable order keeps indices.
        object.__setattr__(
            self, "bodies", tuple(sorted(self.bodies, key=lambda b: SHAPES.index(b.shape)))
        )

    @property
    def has_volumes(self) -> bool:
        """True if the method "volume" can draw the scene."""
        return bool(self.volumes) or self.figure is not None

    def instant(self, time: float) -> Instant:
        """The volumes and their backdrop around `time` [s]; phases are the angles at that time."""
        if callable(self.volumes):
            return self.volumes(time)
        turned = tuple(
            replace(v, phase=math.fmod(v.phase + v.speed * time, 2 * math.pi)) for v in self.volumes
        )
        return turned, self.backdrop or Backdrop()

    def solid(self, time: float) -> Scene:
        """The scene around `time` [s], its volumes turned into bodies.

        Of volumes that are blended into one another, only the densest becomes a body.
        """
        volumes, backdrop = self.instant(time)
        if not volumes:
            return self
        most = max((v.opacity for v in volumes if v.facing is not None), default=0.0)
        there = [v for v in volumes if v.facing is None or v.opacity == most]
        bodies = [_since(v.solid(), time) for v in there]
        return replace(self, bodies=(*self.bodies, *bodies, backdrop.body()), backdrop=backdrop)

    def seen_from(
        self, orbit: tuple[float, float], pan: tuple[float, float], dolly: float
    ) -> Scene:
        """The same scene with another `orbit`, `pan` and `dolly` of its camera (see CameraPath)."""
        values = (*orbit, *pan, dolly)
        if not _all_finite(values) or not 0 < dolly <= 1000:
            raise InputError(f"orbit, pan and dolly must be finite, dolly over 0, got {values}")
        return replace(self, camera=replace(self.camera, orbit=orbit, pan=pan, dolly=dolly))


def _since(body: Body, time: float) -> Body:
    """A body whose path counts from `time` [s]."""
    return replace(body, pose=lambda t: body.pose(t - time))


def _all_finite(numbers: Iterable[Any]) -> bool:
    """As the GPU has them, with room for a product."""
    return all(abs(x) < 1e30 for x in numbers)
