"""Cameras and rigid bodies from JSON."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from ...camera import MAX_INDEX, Camera, Reprojections, Window
from ...errors import InputError
from ...files import bounded

_MOST_BYTES = 256 << 20


class CameraFile:
    """Per-frame cameras read from JSON.

    `{"frames": {"10": {...}, ...}}`, each frame with either `clip_from_world`, or
    `camera_matrix_world` and `projection` (row-major lists, column vectors, OpenGL clip
    space, the camera looking along -z), and optionally `objects`: name -> `index` (as in the
    object index pass) and `matrix_world`. Other keys are ignored.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._frames = _read_json(self.path)

    def numbers(self) -> list[float]:
        """Numbers of the frames in the file."""
        return sorted(self._frames)

    def around(
        self,
        number: int,
        *,
        depth_kind: str = "planar",
        far: float = 1e9,
        window: Window | None = None,
    ) -> Reprojections:
        """The reprojections from frame `number` to its neighbours: see Reprojections.

        InputError unless the file has the frame and a neighbour.
        """
        if number not in self._frames:
            raise InputError(f"{self.path}: no camera for frame {number}")
        near = {k: self._camera(number + k) for k in (-1, 0, 1) if number + k in self._frames}
        try:
            for k in near:
                self._check_shared(number, number + k)
            return Reprojections(
                near[0], near.get(-1), near.get(1), depth_kind=depth_kind, far=far, window=window
            )
        except InputError as error:
            raise InputError(f"{self.path}: frame {number:g}: {error}") from None

    def _check_shared(self, number: float, near: float) -> None:
        """Objects that share an index can only be told apart if they move as one."""
        objects, then = (self._frames[k].get("objects", {}) for k in (number, near))
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
                    f"between frames {number:g} and {near:g}"
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


def _read_json(path: Path) -> dict[float, dict[str, Any]]:
    try:
        if not path.is_file():
            raise bounded.missing(path)
        content = json.loads(bounded.read(path, _MOST_BYTES, "a camera file"))
        frames = content["frames"]
        numbered = {float(k): v for k, v in frames.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not a camera file: {_first_line(error)}") from None
    if not all(math.isfinite(k) for k in numbered):
        raise InputError(f"{path}: frame numbers must be finite")
    return numbered


def _matrix(rows: Any) -> np.ndarray:
    try:
        array = np.array(rows, np.float64)
    except (ValueError, TypeError, OverflowError):
        raise InputError("a matrix is not 4 lists of 4 numbers") from None
    if array.shape != (4, 4) or not np.isfinite(array).all():
        raise InputError(f"a matrix is not 4 lists of 4 finite numbers (shape {array.shape})")
    return array


def _bodies(objects: dict[str, Any]) -> dict[int, np.ndarray]:
    """World matrices by object index; parts that share an index must move as one."""
    bodies: dict[int, np.ndarray] = {}
    for name, given in objects.items():
        index = given["index"]
        if not isinstance(index, int) or not 0 <= index <= MAX_INDEX:
            raise InputError(f"object {name}: index must be 0 to {MAX_INDEX}, got {index!r}")
        if index > 0:  # 0 is what everything has that nobody numbered
            bodies.setdefault(index, _matrix(given["matrix_world"]))
    return bodies


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
