"""Extent of a frame's content: to its neighbours, and while the shutter is open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .frame import Frame

Box = tuple[int, int, int, int]  # left, top, right, bottom [px]; the last pixels belong to it
Spread = Literal["nowhere", "along", "around", "everywhere"]
"""Direction in which a method puts colour beyond a silhouette: nowhere (as far as nothing moves
there), along the motion, at the motion's length all around, or everywhere (for methods that want
the whole display window)."""


@dataclass(frozen=True)
class Extent:
    """Distance over which a blur moves colours."""

    times: tuple[float, float]
    """First and last instant at which any pixel is exposed [frame intervals]."""
    span: tuple[float, float]
    """The same of a single pixel, without the delay of a rolling shutter."""
    spread: Spread = "along"
    max_blur: float | None = None
    """Longest blur [px]."""
    margin: Callable[[int], int] = lambda height: 0
    """Pixels that the method looks at beyond that, in pictures of this height [px]."""
    bend: float = 0.0
    """Largest deviation of its paths from the parabola through three positions, as a share of half
    the acceleration."""

    def box(self, frame: Frame, offset: int = 0) -> Box | None:
        """The pixels that content of `frame`, `offset` frame intervals away, may get to.

        In the frame's own pixels, which the box may lead out of; None where it has no content.
        """
        content = (frame.color != 0).any(axis=2)
        if not content.any():
            return None
        y, x = np.nonzero(content)
        at = np.stack([x, y], axis=1)
        if self.spread == "nowhere":
            at = np.stack([at.min(axis=0), at.max(axis=0)])
            if frame.camera is None:
                x, y = np.zeros((2, 0), int)
            else:  # what is empty turns with the camera
                y, x = (places.ravel() for places in np.indices(content.shape))
        velocity, acceleration = self._paths(frame, x, y)
        opens, closes = (t - offset for t in self.times)
        with np.errstate(all="ignore"):
            turns = np.clip(np.nan_to_num(-velocity / (2 * acceleration)), opens, closes)
        ways = [velocity * t + acceleration * t**2 for t in (opens, closes, turns)]
        spare = self.bend * np.abs(acceleration)
        if self.spread == "nowhere":  # what such a method reads: see wgsl/common/backwards.wgsl
            length = np.hypot(*velocity.T)[:, None]
            spare = spare + length * max(opens * opens, closes * closes)
        least, most = np.min(ways, axis=0) - spare, np.max(ways, axis=0) + spare
        if self.spread == "around":
            far = np.hypot(*np.maximum(-least, most).T)[:, None]
            least, most = -far, far
        if self.spread == "nowhere":
            least = least.min(axis=0, initial=0.0)
            most = most.max(axis=0, initial=0.0)
        more = 1 + self.margin((frame.window or frame.color.shape[1::-1])[-1])
        low = np.floor((at + least).min(axis=0)) - more
        high = np.ceil((at + most).max(axis=0)) + more
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _paths(self, frame: Frame, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2) velocity and half acceleration at pixels x, y, as in gpu_frame/velocity.wgsl."""
        back, ahead = (displacement(frame, side, x, y) for side in (-1, 1))
        back = np.where(np.isfinite(back), back, -ahead)
        ahead = np.where(np.isfinite(ahead), ahead, -back)
        back, ahead = (np.where(np.isfinite(way), way, 0.0) for way in (back, ahead))
        if frame.scale is not None:
            factor = frame.scale[y, x].astype(np.float64)[:, None]
            factor = np.where(np.isfinite(factor), factor, 0.0)
            back, ahead = back * factor, ahead * factor
        velocity, acceleration = (ahead - back) / 2, (ahead + back) / 2
        if self.max_blur is not None:
            opening, closing = (velocity * t + acceleration * t**2 for t in self.span)
            length = np.hypot(*(closing - opening).T)
            factor = np.minimum(1.0, self.max_blur / np.maximum(length, 1e-6))[:, None]
            velocity, acceleration = velocity * factor, acceleration * factor
        return velocity, acceleration


EVERYWHERE = Extent((0.0, 0.0), (0.0, 0.0), "everywhere")
"""Of those who want the whole display window, whatever is in it."""


def displacement(frame: Frame, side: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 2) way [px] of pixels x, y to the previous (`side` -1) or next (1) frame.

    Infinite where that is behind its camera; a straight path goes on where one side is unknown.
    """
    way = np.zeros((len(x), 2))
    if frame.motion is not None:
        way = frame.motion[y, x, :2] if side < 0 else frame.motion[y, x, 2:]
    elif frame.to_next is not None or frame.to_prev is not None:
        own, other = (frame.to_prev, frame.to_next)[::-side]
        way = own[y, x] if own is not None else -other[y, x]  # pyright: ignore
    elif frame.camera is not None:
        return _by_camera(frame, side, x, y)
    way = np.where(np.isfinite(way), way, 0.0).astype(np.float64)
    return way + _by_camera(frame, side, x, y) if frame.object_motion else way


def _by_camera(frame: Frame, side: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    if frame.camera is None or frame.depth is None:
        return np.zeros((len(x), 2))
    there = frame.camera.prev if side < 0 else frame.camera.next
    sign = 1 if there is not None else -1  # a path goes on as on its other side
    bodies = frame.object_id[y, x] if frame.object_id is not None else None
    way = frame.camera.displacement(frame.size, x, y, frame.depth[y, x], sign * side, bodies)
    return np.where(np.isfinite(way), sign * way, np.inf)
