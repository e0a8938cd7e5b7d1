"""Cameras and rigid bodies from frame to frame: the matrices behind motion from depth."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .errors import InputError

MOST_BODIES = 65536
_MOST_BYTES = 256 << 20  # of a camera file


@dataclass(frozen=True, eq=False)
class Camera:
    """One frame's camera: 4 x 4 matrices for column vectors, OpenGL clip space (y up)."""

    clip_from_world: np.ndarray
    view_from_world: np.ndarray | None = None
    """Needed where the projection is orthographic; the camera looks along -z."""
    bodies: dict[int, np.ndarray] = field(default_factory=dict)
    """`world_from_object` of every moving body, by object index."""

    def __post_init__(self):
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
            if name.startswith("body") and not _invertible(array):
                raise InputError(f"{name}: its matrix has no inverse")
        if any(not 0 < k < MOST_BODIES for k in self.bodies):
            raise InputError(f"object indices must be 1 to {MOST_BODIES - 1}")

    def toward(self, other: Camera, share: float) -> Camera:
        """The camera on the way to another: position and projection linear, orientation turned
        at constant speed (spherical linear interpolation). Both need `view_from_world`.
        """
        own, others = self.view_from_world, other.view_from_world
        if own is None or others is None:
            raise InputError("cameras are interpolated by their view_from_world")
        a, b = np.linalg.inv(own), np.linalg.inv(others)
        world_from_view = np.eye(4)
        world_from_view[:3, 3] = (1 - share) * a[:3, 3] + share * b[:3, 3]
        world_from_view[:3, :3] = a[:3, :3] @ _power(a[:3, :3].T @ b[:3, :3], share)
        lenses = self.clip_from_world @ a, other.clip_from_world @ b
        view = np.linalg.inv(world_from_view)
        return Camera(((1 - share) * lenses[0] + share * lenses[1]) @ view, view)

    @property
    def orthographic(self) -> bool:
        """Whether depth does not divide: the last row of the projection is constant."""
        return bool(np.abs(np.asarray(self.clip_from_world)[3, :3]).max() < 1e-12)


@dataclass(frozen=True, eq=False)
class Reprojections:
    """Where points seen from one frame are in the previous and the next frame.

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
    """Planar depth from here on means that nothing is there (sky)."""
    window: tuple[int, int, int, int] | None = None
    """Where the image lies in the whole picture: x, y, whole width, whole height [px]."""

    def __post_init__(self):
        if self.prev is None and self.next is None:
            raise InputError("motion from a camera needs the camera of a neighbouring frame")
        if self.depth_kind not in ("planar", "clip"):
            raise InputError(f"depth must be planar or clip, got {self.depth_kind!r}")
        if not _invertible(np.asarray(self.here.clip_from_world, np.float64)):
            raise InputError("clip_from_world has no inverse")
        if not self.far > 0:
            raise InputError(f"far must be over 0, got {self.far}")
        self.world_from_pixel()  # refuses what is no camera

    def matrices(self) -> np.ndarray:
        """(bodies, 2, 4, 4): clip position in the previous, the next frame from the pixel.

        Row 0 is the world, row k the body of index k. Where one neighbour is missing, its
        matrix maps everything behind the camera, and the other one's motion goes on.
        """
        ids = sorted(self.here.bodies)
        table = np.empty((1 + max(ids, default=0), 2, 4, 4))
        table[:] = [self._reprojection(self.prev, None), self._reprojection(self.next, None)]
        for k in ids:
            table[k] = [self._reprojection(self.prev, k), self._reprojection(self.next, k)]
        return table

    def displacement(self, size: tuple[int, int], x, y, depth, side: int) -> np.ndarray:
        """(n, 2) way of the world at pixels x, y [px] to the previous (side -1), next (1) frame.

        NaN where there is no such frame, or it is behind its camera; bodies count as the world.
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
            clip = pixel @ self._reprojection(self.prev if side < 0 else self.next, None).T
            way = (clip[:, :2] / clip[:, 3:] - ndc) * scale
        return np.where(clip[:, 3:] > 0, way, np.nan)

    def _reprojection(self, there: Camera | None, body: int | None) -> np.ndarray:
        if there is None:
            return np.diag([0.0, 0.0, 0.0, 0.0])
        moved = np.eye(4)
        if body is not None and body in there.bodies:
            moved = np.asarray(there.bodies[body]) @ np.linalg.inv(self.here.bodies[body])
        return np.asarray(there.clip_from_world) @ moved @ self.world_from_pixel()

    def world_from_pixel(self) -> np.ndarray:
        """World position from (x d, y d, d, 1), or (x, y, d, 1) without perspective."""
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


class CameraFile:
    """Per-frame cameras read from JSON.

    `{"frames": {"10": {...}, ...}}`, each frame with either `clip_from_world`, or
    `camera_matrix_world` and `projection` (row-major lists, column vectors, OpenGL clip
    space, the camera looking along -z), and optionally `objects`: name -> `index` (as in the
    object index pass) and `matrix_world`. Keys that are not needed are left alone.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._frames = _read_json(self.path)

    def numbers(self) -> list[float]:
        """The frames it speaks of."""
        return sorted(self._frames)

    def around(self, number: int, **options) -> Reprojections:
        """The reprojections from frame `number` to its neighbours, which the file must have."""
        if number not in self._frames:
            raise InputError(f"{self.path}: no camera for frame {number}")
        near = {k: self._camera(number + k) for k in (-1, 0, 1) if number + k in self._frames}
        try:
            for k in near:
                self._check_shared(number, number + k)
            return Reprojections(near[0], near.get(-1), near.get(1), **options)
        except InputError as error:
            raise InputError(f"{self.path}: frame {number:g}: {error}") from None

    def _check_shared(self, here: float, there: float) -> None:
        """Objects that share an index can only be told apart if they move as one."""
        objects, then = (self._frames[k].get("objects", {}) for k in (here, there))
        by_index: dict[int, list[str]] = {}
        for name in objects.keys() & then.keys():
            by_index.setdefault(objects[name]["index"], []).append(name)
        for index, names in by_index.items():
            if index == 0 or len(names) == 1:
                continue
            ways = [
                _matrix(then[name]["matrix_world"])
                @ np.linalg.pinv(_matrix(objects[name]["matrix_world"]))
                for name in sorted(names)
            ]
            apart = [np.abs(way - ways[0]).max() > 1e-4 * np.abs(ways[0]).max() for way in ways]
            if any(apart):
                first, other = sorted(names)[0], sorted(names)[apart.index(True)]
                raise InputError(
                    f"objects {first} and {other} share index {index} but move apart "
                    f"between frames {here:g} and {there:g}"
                )

    def _camera(self, number: float) -> Camera:
        given = self._frames[number]
        try:
            view = None
            if "camera_matrix_world" in given:
                view = np.linalg.inv(_matrix(given["camera_matrix_world"]))
            if "clip_from_world" in given:
                clip = _matrix(given["clip_from_world"])
            elif view is not None and "projection" in given:
                clip = _matrix(given["projection"]) @ view
            else:
                raise InputError("needs clip_from_world, or camera_matrix_world and projection")
            return Camera(clip, view, _bodies(given.get("objects", {})))
        except (
            InputError,
            TypeError,
            AttributeError,
            KeyError,
            np.linalg.LinAlgError,
            OverflowError,
        ) as error:
            raise InputError(f"{self.path}: frame {number:g}: {_first_line(error)}") from None


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


def _invertible(matrix: np.ndarray) -> bool:
    with np.errstate(all="ignore"):
        return bool(np.linalg.cond(matrix) < 1e15)  # NaN is not


def _read_json(path: Path) -> dict[float, dict]:
    try:
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path}: over {_MOST_BYTES >> 20} MiB, not read")
        content = json.loads(path.read_bytes())
        frames = content["frames"]
        numbered = {float(k): v for k, v in frames.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not a camera file: {_first_line(error)}") from None
    if not all(math.isfinite(k) for k in numbered):
        raise InputError(f"{path}: frame numbers must be finite")
    return numbered


def _matrix(rows) -> np.ndarray:
    try:
        array = np.array(rows, np.float64)
    except (ValueError, TypeError, OverflowError):
        raise InputError("a matrix is not 4 lists of 4 numbers") from None
    if array.shape != (4, 4) or not np.isfinite(array).all():
        raise InputError(f"a matrix is not 4 lists of 4 finite numbers (shape {array.shape})")
    return array


def _bodies(objects: dict) -> dict[int, np.ndarray]:
    """World matrices by object index; parts that share an index must move as one."""
    bodies: dict[int, np.ndarray] = {}
    for name, given in objects.items():
        index = given["index"]
        if not isinstance(index, int) or not 0 <= index < MOST_BODIES:
            raise InputError(f"object {name}: index must be 0 to {MOST_BODIES - 1}, got {index!r}")
        if index > 0:  # 0 is what everything has that nobody numbered
            bodies.setdefault(index, _matrix(given["matrix_world"]))
    return bodies


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
