"""Camera cuts, detected from colour and motion; frames across a cut are never used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..frame import Frame

_PROBES = 2000  # pixels looked at
_CUT = (
    0.5  # of the difference of unrelated places; measured: 0.0 to 0.3 without a cut, 0.6 to 1 with
)
_INSIDE = 0.05  # share of probes that must still be in the neighbour's picture
_MOST = 0.5  # difference of tones beyond which a pixel has merely changed
_JUMP = 8  # times the motion to the other side
_FAR = 0.1  # of the picture's width


def jumps(frame: Frame, side: int) -> bool:
    """Return True if the motion to the previous (`side` -1) or next (1) frame indicates a cut.

    Half of the picture moves over a tenth of its width, and 8 times as far as to the other side.
    """
    width, height = frame.size
    rng = np.random.default_rng(0)
    at = rng.integers(0, width, _PROBES), rng.integers(0, height, _PROBES)
    with np.errstate(all="ignore"):
        here, other = (np.median(np.hypot(*_way(frame, s, *at).T)) for s in (side, -side))
    return bool(here > max(_FAR * width, _JUMP * other))


def straightened(frame: Frame, side: int) -> Frame:
    """The frame without its motion to one side: paths go on there as they do on the other."""
    motion = frame.motion
    if motion is not None:
        back, ahead = motion[..., :2], motion[..., 2:]
        motion = np.concatenate([-ahead, ahead] if side < 0 else [back, -back], axis=2)
    camera = frame.camera
    if camera is not None and camera.prev is not None and camera.next is not None:
        camera = replace(camera, **{"prev" if side < 0 else "next": None})
    return replace(frame, motion=motion, camera=camera)


def still(frame: Frame) -> Frame:
    """The frame without motion: cuts lie on both of its sides."""
    motion = np.zeros((*frame.color.shape[:2], 4), np.float32) if "motion" in frame.has else None
    return replace(frame, motion=motion, camera=None, object_id=None, object_motion=False)


def is_cut(frame: Frame, near: Frame, side: int) -> bool:
    """Return True if a cut lies between `frame` and its neighbour `near` on `side` (-1 or 1).

    2,000 pixels, each the mean of 3 x 3, are compared with where their motion puts them in
    `near`, and with places picked at random: across a cut the two differ alike.
    """
    width, height = frame.size
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, width, _PROBES), rng.integers(0, height, _PROBES)
    with np.errstate(all="ignore"):
        where = np.stack([x, y], axis=1) + _way(frame, side, x, y)
        inside = ((where >= 0) & (where <= (width - 1, height - 1))).all(axis=1)
    if inside.mean() < _INSIDE:
        return True
    there = np.rint(where[inside]).astype(int)
    here = _tones(frame.color, x[inside], y[inside])
    follows = _difference(here, _tones(near.color, *there.T))
    unrelated = _difference(here, _tones(near.color, *rng.permutation(there).T))
    return bool(follows > _CUT * unrelated)


def _way(frame: Frame, side: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 2) displacement [px] to the neighbouring frame; infinite behind its camera."""
    way = np.zeros((len(x), 2))
    if frame.motion is not None:
        way = frame.motion[y, x, :2] if side < 0 else frame.motion[y, x, 2:]
    elif frame.to_next is not None or frame.to_prev is not None:
        own, other = (frame.to_prev, frame.to_next)[::-side]
        way = own[y, x] if own is not None else -other[y, x]  # pyright: ignore
    elif frame.camera is not None:
        return _by_camera(frame, side, x, y)
    way = np.where(np.isfinite(way), way, 0.0)
    return way + _by_camera(frame, side, x, y) if frame.object_motion else way


def _by_camera(frame: Frame, side: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    if frame.camera is None or frame.depth is None:
        return np.zeros((len(x), 2))
    there = frame.camera.prev if side < 0 else frame.camera.next
    sign = 1 if there is not None else -1  # a path goes on as on its other side
    way = frame.camera.displacement(frame.size, x, y, frame.depth[y, x], sign * side)
    return np.where(np.isfinite(way), sign * way, np.inf)


def _tones(color: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 3) means of 3 x 3 pixels, held below 1 so that no highlight decides."""
    height, width = color.shape[:2]
    total = np.zeros((len(x), 3))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            at = np.clip(y + dy, 0, height - 1), np.clip(x + dx, 0, width - 1)
            light = np.clip(np.nan_to_num(color[at][:, :3].astype(np.float64)), 0, 1e6)
            total += light / (1 + light)
    return total / 9


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.minimum(np.abs(a - b).sum(axis=1), _MOST).mean())
