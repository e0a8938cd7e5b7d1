"""Volumes whose blur has a closed form, and the backdrop they are shown on (Cusa 2022)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .bodies import Body, Color, at, rotation, translation


@dataclass(frozen=True, kw_only=True)
class OrbitingSphere:
    """A sphere of `radius` whose centre runs on a circle of radius `orbit` about an axis along y.

    `phase`: its angle at time 0 [rad], right-handed from +x. `speed`: [rad/s], any size and sign.
    `opacity`: factor of its density, 0 or more; more than 1 makes fast spheres visible, because
    visibility goes with the square of density. `facing`: its weight in the normals of all blended
    volumes; None: its density at the place. `centre` and radii are in scene units.
    """

    radius: float
    orbit: float
    speed: float = 0.0
    phase: float = 0.0
    color: Color = (0.8, 0.9, 1.0)
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    opacity: float = 1.0
    facing: float | None = None

    def __post_init__(self) -> None:
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
    `opacity`, `facing`: as for OrbitingSphere. `swell`: its normals are those of a torus smaller by
    this factor, over 0. `minor_radius` must not exceed `major_radius`; both are in scene units.
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

    def __post_init__(self) -> None:
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


Volume = OrbitingSphere | Torus


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
class Backdrop:
    """Surroundings of volumes: a ground with three grids of lines, a sky, a light.

    Colours are display values, as in the animation that this is from (Cusa 2022, torusphere).
    `grids`: side of the cells and brightness of each. `strobe`: phase [rad] and amount of a
    flicker. `bound`: radius of the sphere around the origin that is searched for volumes, a
    twentieth of it a step; None: one that holds them all. `grain`: another number is other noise.
    """

    tint: Color = (0.33, 0.18, 0.10)
    ground: float = -0.8
    light: tuple[float, float, float] = (5.0, 6.0, 1.0)
    grids: tuple[tuple[float, float], ...] = ((2.0, 0.2), (0.5, 0.1), (0.125, 0.05))
    strobe: tuple[float, float] = (0.0, 0.0)
    bound: float | None = None
    grain: int = 0

    def __post_init__(self) -> None:
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
        """Write it into a `Backdrop` of wgsl/scene/backdrop.wgsl."""
        row["tint"] = (*self.tint, self.ground)
        row["light"][:3] = np.array(self.light) / np.linalg.norm(self.light)
        row["cells"][:3], row["weights"][:3] = zip(*self.grids, strict=True)


Instant = tuple[tuple[Volume, ...], Backdrop]
