"""Cameras and rigid bodies over time: the matrices that turn depth into motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .errors import InputError

MOST_BODIES = 65535
MAX_INDEX = 2**32 - 1
Window = tuple[int, int, int, int]
"""Position of an image in the display window: x, y of its first pixel, then the display window's
width and height [px]."""


@dataclass(frozen=True, eq=False)
class Camera:
    """One frame's camera: 4 x 4 matrices for column vectors, OpenGL clip space (y up).

    InputError for matrices that are not finite, and for bodies that cannot be inverted.
    """

    clip_from_world: np.ndarray
    """(4, 4): the product of projection and view matrix."""
    view_from_world: np.ndarray | None = None
    """(4, 4), required for orthographic projections; the camera looks along -z."""
    bodies: dict[int, np.ndarray] = field(default_factory=dict)
    """(4, 4) world from object of every moving body, by object index, 1 to 4294967295."""

    def __post_init__(self) -> None:
        for name, matrix in (
            ("clip_from_world", self.clip_from_world),
            ("view_from_world", self.view_from_world),
            *((f"body {k}", m) for k, m in self.bodies.items()),
        ):
            if matrix is None:
                continue
            array = np.asarray(matrix, np.float64)
            if array.shape != (4, 4) or not np.isfinite(array).all():
                raise InputError(f"{name} must be a finite 4 x 4 matrix, got shape {array.shape}")
        if self.bodies:
            can = _invertible(np.asarray([*self.bodies.values()], np.float64))
            for k in (k for k, one in zip(self.bodies, can, strict=True) if not one):
                raise InputError(f"body {k} must be invertible")
        if any(not 0 < k <= MAX_INDEX for k in self.bodies):
            raise InputError(f"object indices must be 1 to {MAX_INDEX}")
        if len(self.bodies) > MOST_BODIES:
            raise InputError(f"{len(self.bodies)} bodies; at most {MOST_BODIES}")

    def toward(self, other: Camera, share: float) -> Camera:
        """The camera at a `share`, 0 to 1, of the way to another.

        Position and projection are interpolated linearly, the orientation at constant speed
        (spherical linear interpolation). InputError unless both have `view_from_world`.
        """
        own, others = self.view_from_world, other.view_from_world
        if own is None or others is None:
            raise InputError("interpolating cameras needs view_from_world in both")
        a, b = np.linalg.inv(own), np.linalg.inv(others)
        world_from_view = np.eye(4)
        world_from_view[:3, 3] = (1 - share) * a[:3, 3] + share * b[:3, 3]
        world_from_view[:3, :3] = a[:3, :3] @ _power(a[:3, :3].T @ b[:3, :3], share)
        lenses = self.clip_from_world @ a, other.clip_from_world @ b
        view = np.linalg.inv(world_from_view)
        return Camera(((1 - share) * lenses[0] + share * lenses[1]) @ view, view)

    @property
    def orthographic(self) -> bool:
        """True if there is no perspective divide: the projection's last row is constant."""
        return bool(np.abs(np.asarray(self.clip_from_world)[3, :3]).max() < 1e-12)


@dataclass(frozen=True, eq=False)
class Reprojections:
    """Positions in the previous and the next frame of points visible in one frame.

    Rosado (2007, GPU Gems 3, chapter 27) goes depth -> world -> previous clip position per
    pixel. Both steps are linear in (ndc.x d, ndc.y d, d, 1), so they are multiplied here
    once, in double precision; a body's own motion comes in between.
    """

    here: Camera
    prev: Camera | None = None
    next: Camera | None = None
    depth_kind: str = "planar"
    """"planar": distance along the view axis; "clip": z after projection, as in a depth buffer."""
    far: float = 1e9
    """Planar depth from which a pixel counts as empty (sky)."""
    window: Window | None = None
    """As in Frame.window."""

    def __post_init__(self) -> None:
        if self.prev is None and self.next is None:
            raise InputError("motion from a camera needs the camera of a neighbouring frame")
        if self.depth_kind not in ("planar", "clip"):
            raise InputError(f"`depth_kind` must be planar or clip, got {self.depth_kind!r}")
        if not _invertible(np.asarray(self.here.clip_from_world, np.float64)):
            raise InputError("clip_from_world must be invertible")
        if not self.far > 0:
            raise InputError(f"far must be over 0, got {self.far}")
        self.world_from_pixel()  # refuses what is no camera

    def matrices(self) -> np.ndarray:
        """(1 + bodies, 2, 4, 4): clip position in the previous, the next frame from the pixel.

        Row 0 is the world, the others are the bodies in the order of `indices`. Where one
        neighbour is missing, its matrix maps everything behind the camera, and the other one's
        motion goes on.
        """
        bodies = [int(k) for k in self.indices[1:]]
        world = self.world_from_pixel()
        if not bodies:  # a third of the time, for those who blur live
            none = np.zeros((4, 4))
            around = [t and np.asarray(t.clip_from_world) @ world for t in (self.prev, self.next)]
            return np.array([[none if one is None else one for one in around]])
        own = np.array([self.here.bodies[k] for k in bodies], np.float64).reshape(-1, 4, 4)
        inverse = np.linalg.inv(own)
        made = np.zeros((1 + len(bodies), 2, 4, 4))
        for side, there in enumerate((self.prev, self.next)):
            if there is None:
                continue
            moved = np.tile(np.eye(4), (1 + len(bodies), 1, 1))
            known = [row for row, k in enumerate(bodies) if k in there.bodies]
            if known:
                theirs = np.array([there.bodies[bodies[row]] for row in known], np.float64)
                moved[1 + np.array(known)] = theirs @ inverse[known]
            made[:, side] = np.asarray(there.clip_from_world) @ moved @ world
        return made

    @property
    def indices(self) -> np.ndarray:
        """(1 + bodies,) uint32, ascending: 0 for the world, then the bodies' object indices."""
        return np.array([0, *sorted(self.here.bodies)], np.uint32)

    def displacement(
        self,
        size: tuple[int, int],
        x: np.ndarray,
        y: np.ndarray,
        depth: np.ndarray,
        side: int,
        bodies: np.ndarray | None = None,
    ) -> np.ndarray:
        """(n, 2) motion of surfaces at pixels x, y [px] to the previous (side -1), next (1) frame.

        `bodies`: (n,) object index of each, 0 for the world. NaN where there is no such frame, or
        it is behind its camera.
        """
        left, top, width, height = self.window or (0, 0, *size)
        scale = np.array([width / 2, -height / 2])
        ndc = (np.stack([x, y], axis=1) + 0.5 + (left, top)) / scale + (-1, 1)
        z = np.asarray(depth, np.float64)[:, None]
        one = np.ones_like(z)
        with np.errstate(all="ignore"):
            planar = self.depth_kind == "planar" and not self.here.orthographic
            nothing = ~np.isfinite(z) | (z >= self.far) | (z <= 0)
            inverse = np.where(nothing, 0.0, 1 / z)
            pixel = np.hstack([ndc, one, inverse] if planar else [ndc, z, one])
            there = self.prev if side < 0 else self.next
            clip = pixel @ self._reprojection(there, None).T
            moving = () if bodies is None else np.intersect1d(bodies, self.indices[1:])
            for body in moving:
                of_body = (bodies == body) & ~nothing[:, 0]
                clip[of_body] = pixel[of_body] @ self._reprojection(there, int(body)).T
            way = (clip[:, :2] / clip[:, 3:] - ndc) * scale
        return np.where(clip[:, 3:] > 0, way, np.nan)

    def _reprojection(self, other: Camera | None, body: int | None) -> np.ndarray:
        if other is None:
            return np.diag([0.0, 0.0, 0.0, 0.0])
        moved = np.eye(4)
        if body is not None and body in other.bodies:
            moved = np.asarray(other.bodies[body]) @ np.linalg.inv(self.here.bodies[body])
        return np.asarray(other.clip_from_world) @ moved @ self.world_from_pixel()

    def world_from_pixel(self) -> np.ndarray:
        """World position from (x d, y d, d, 1), or (x, y, d, 1) without perspective."""
        return self._world_from_pixel

    @cached_property
    def _world_from_pixel(self) -> np.ndarray:
        clip = np.asarray(self.here.clip_from_world, np.float64)
        if self.depth_kind == "clip":
            return np.linalg.inv(clip)
        rows = clip[[0, 1, 3]]
        if self.here.orthographic:
            if self.here.view_from_world is None:
                raise InputError("planar depth of an orthographic camera needs view_from_world")
            rows = np.stack([clip[0], clip[1], -np.asarray(self.here.view_from_world)[2]])
        pixel_from_world = np.vstack([rows, [0, 0, 0, 1]])
        if not _invertible(pixel_from_world):
            raise InputError("clip_from_world is not the projection of a camera")
        return np.linalg.inv(pixel_from_world)


def window_of(window: Window | None, camera: Reprojections | None) -> Window | None:
    """The window of a frame, which may have been given with its camera only."""
    if camera is None or camera.window is None or camera.window == window:
        return window
    if window is not None:
        raise InputError(f"the camera's window is {camera.window}, the frame's {window}")
    return camera.window


def _power(turn: np.ndarray, share: float) -> np.ndarray:
    """Part of a rotation, about the same axis (Rodrigues' formula)."""
    cos = np.clip((np.trace(turn) - 1) / 2, -1, 1)
    angle = math.acos(cos)
    if angle < 1e-9:
        return np.eye(3)
    values, vectors_ = np.linalg.eig(turn)
    axis = np.real(vectors_[:, np.argmin(np.abs(values - 1))])
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    if np.trace(k.T @ (turn - turn.T)) < 0:  # the axis points the other way
        k = -k
    part = angle * share
    return np.eye(3) + math.sin(part) * k + (1 - math.cos(part)) * k @ k


def _invertible(matrices: np.ndarray) -> np.ndarray:
    """True for each of (..., 4, 4) matrices that has an inverse."""
    with np.errstate(all="ignore"):
        return np.linalg.cond(matrices) < 1e15  # NaN is not
