"""Camera cuts, detected from colour and motion; frames across a cut are never used."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from ..color.srgb import srgb
from ..extent import displacement
from ..frame import Frame
from .prediction import BLOCK, predicted

_PROBES = 2000  # pixels looked at
_CUT = 0.5  # of the difference of unrelated places, in the middle; measured: 0.0 to 0.25 without
# a cut, where half of a small picture is uncovered too, and 0.75 to 1.15 with one
_STANDS = 0.85  # the same where nothing is moved: 0.72 where all but the background moves
_SEEN = 0.005  # difference of tones below which two places are both empty, or one
_INSIDE = 0.05  # share of probes that must still be in the neighbour's picture
_JUMP = 8  # times the motion to the other side
_FAR = 0.1  # of the picture's width
_SMALL = 96  # pixels of width of the copies that are compared where there are no vectors
_SEARCH = 0.2  # of the width: farther nothing is looked for
_STEP = 2  # pixels between places where a block is looked for
_ALIKE = 0.02  # difference of display values under which there is no cut
_UNLIKE = 0.78  # of the contrast
_FADED = 0.6  # of the contrast, when one picture is as bright as the other
_FADE = 0.125  # of display values: what a fade adds to the mean from one picture to the next
_FADE_CONTRAST = 1.5  # times the contrast of the picture before
_PREDICTED = 0.45  # of the textured blocks; where as many are found again, there is no cut
_LUMA = np.array([0.25, 0.625, 0.125], np.float32)


def pictures_differ(before: np.ndarray, after: np.ndarray) -> bool:
    """Return True if a cut lies between two pictures (height, width, 3 or 4) without vectors."""
    return smalls_differ(_small(before), _small(after))


def frames_differ(frame: Frame, near: Frame) -> bool:
    """Return True if a cut lies between two frames, by their pictures alone.

    Light may change everywhere at once; where both have the colour of surfaces, that tells too.
    """
    return is_cut(still(frame), near, 1, _STANDS) and all(
        pictures_differ(_on_display(frame, a), _on_display(near, b))
        for a, b in _pictures(frame, near)
    )


def _pictures(frame: Frame, near: Frame) -> list[tuple[np.ndarray, np.ndarray]]:
    """The pictures of two frames, and the colours of their surfaces if both have them."""
    found: list[tuple[np.ndarray, np.ndarray]] = [(frame.color, near.color)]
    if frame.diffuse_color is not None and near.diffuse_color is not None:
        found.append((frame.diffuse_color, near.diffuse_color))
    return found


def _on_display(frame: Frame, image: np.ndarray) -> np.ndarray:
    """An image of a frame in its display window; black where there is none of it."""
    left, top, width, height = frame.window or (0, 0, *frame.size)
    if (left, top, width, height) == (0, 0, *frame.size):
        return image
    whole = np.zeros((height, width, 3), image.dtype)
    rows, columns = (
        slice(max(top, 0), top + image.shape[0]),
        slice(max(left, 0), left + image.shape[1]),
    )
    there = whole[rows, columns]
    there[:] = image[max(-top, 0) :, max(-left, 0) :, :3][: there.shape[0], : there.shape[1]]
    return whole


def small_step(width: int, height: int) -> int:
    """Pixels of a picture along each axis of one pixel of its small copy.

    The copy is about 96 pixels wide; that of a band is at least two blocks high.
    """
    return max(1, min(width // _SMALL, height // (2 * BLOCK)))


def smalls_differ(a: np.ndarray, b: np.ndarray) -> bool:
    """Return True if a cut lies between two pictures, of which these are small copies.

    Copies are display values (height, width, 3); see small_step. Blocks of one are looked
    for in the other within a fifth of the width. Measured: the residual is 0.55 to 0.63 of the
    blocks' own contrast where all moves, by up to 118 of 640 px, and 0.97 to 1.48 between unrelated
    pictures. A fade is no cut: its pictures are compared at equal brightness and contrast, where
    0.2 to 0.45 is left, and 0.73 to 2.3 of unrelated pictures.

    Fine texture that moves by parts of a pixel, and rain, leave as much as a cut does; there is no
    cut where nearly half of the textured blocks are found again, see prediction.py.
    """
    if a.shape != b.shape:
        return True
    if np.abs(a - b).mean() < _ALIKE:
        return False
    if min(a.shape[:2]) < BLOCK:
        return True
    if _follows(a, b, _UNLIKE, _ALIKE):
        return False
    contrast = float(b.std()) / max(float(a.std()), 1e-6)
    brighter = float(b.mean() - a.mean())
    if abs(brighter) > _FADE or not 1 / _FADE_CONTRAST <= contrast <= _FADE_CONTRAST:
        return True
    if _follows(a, (b - b.mean()) / contrast + a.mean(), _FADED, 0):
        return False
    return predicted(a @ _LUMA, b @ _LUMA, _reach(b)) < _PREDICTED


def _follows(a: np.ndarray, b: np.ndarray, share: float, least: float) -> bool:
    """Return True if blocks of `a`, found again in `b`, leave at most a share of their contrast.

    A contrast below `least` counts as that.
    """
    height, width = (n // BLOCK for n in a.shape[:2])
    a = a[: height * BLOCK, : width * BLOCK]
    blocks = _blocks(a)
    contrast = np.abs(blocks - blocks.mean(axis=(1, 3), keepdims=True)).sum(axis=4).mean()
    most = share * max(float(contrast), least)
    reach = round(_reach(b) / _STEP) * _STEP
    a = np.ascontiguousarray(np.moveaxis(a, 2, 0))  # planes: sums along rows are quick
    b = np.pad(np.moveaxis(b, 2, 0), ((0, 0), (reach, reach), (reach, reach)), mode="edge")
    left, apart = np.full((height, width), np.inf), np.empty_like(a)
    for y, x in _ways(min(reach, a.shape[1]), reach):
        there = b[:, reach + y : reach + y + a.shape[1], reach + x : reach + x + a.shape[2]]
        np.abs(np.subtract(a, there, out=apart), out=apart)
        rows = apart.sum(axis=0).reshape(height, BLOCK, -1).sum(axis=1)
        left = np.minimum(left, rows.reshape(height, width, BLOCK).sum(axis=2) / BLOCK**2)
        if left.mean() <= most:  # it can only become less
            return True
    return False


def _reach(small: np.ndarray) -> int:
    """Pixels up to which something is looked for along an axis."""
    return round(_SEARCH * min(small.shape[1], 2 * _SMALL))


@cache
def _ways(down: int, across: int) -> list[tuple[int, int]]:
    """Displacements up to so many pixels down and across, the shortest first."""
    rows, columns = (range(-n, n + 1, _STEP) for n in (down, across))
    return sorted(product(rows, columns), key=lambda way: way[0] ** 2 + way[1] ** 2)


def _blocks(plane: np.ndarray) -> np.ndarray:
    """(rows, BLOCK, columns, BLOCK, ...) of a plane whose sides are multiples of BLOCK."""
    height, width = (n // BLOCK for n in plane.shape[:2])
    return plane.reshape(height, BLOCK, width, BLOCK, *plane.shape[2:])


def _small(color: np.ndarray) -> np.ndarray:
    """Display values of the small copy of a picture."""
    step = small_step(color.shape[1], color.shape[0])
    height, width = (n // step for n in color.shape[:2])
    cut = color[: height * step, : width * step, :3]
    parts = cut.reshape(height, step, width * step, 3).mean(axis=1, dtype=np.float32)
    small = parts.reshape(height, width, step, 3).mean(axis=2)
    return srgb(np.clip(np.nan_to_num(small), 0, 1))


def jumps(frame: Frame, side: int) -> bool:
    """Return True if the motion to the previous (`side` -1) or next (1) frame indicates a cut.

    Half of the picture moves over a tenth of its width, and 8 times as far as to the other side.
    """
    x, y, width, _ = _probes(frame, np.random.default_rng(0))
    with np.errstate(all="ignore"):
        here, other = (np.median(np.hypot(*_way(frame, s, x, y).T)) for s in (side, -side))
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


def is_cut(frame: Frame, near: Frame, side: int, most: float = _CUT) -> bool:
    """Return True if a cut lies between `frame` and its neighbour `near` on `side` (-1 or 1).

    2,000 pixels, each the mean of 3 x 3, are compared with where their motion puts them in
    `near`, and with places picked at random: across a cut the two differ alike, and so do those of
    the surfaces' colours, if both have them. The images may be different parts of one display
    window; outside them is nothing.
    """
    rng = np.random.default_rng(0)
    x, y, width, height = _probes(frame, rng)
    first, other = (np.array((one.window or (0, 0))[:2]) for one in (frame, near))
    with np.errstate(all="ignore"):
        where = np.stack([x, y], axis=1) + _way(frame, side, x, y)
        at = where + first
        inside = ((at >= 0) & (at <= (width - 1, height - 1))).all(axis=1)
    if inside.mean() < _INSIDE:
        return True
    there = np.rint(where[inside]).astype(int) + first - other
    random = rng.permutation(there)
    return all(
        _are_unrelated(
            _tones(own, x[inside], y[inside]),
            _tones(others, *there.T),
            _tones(others, *random.T),
            most,
        )
        for own, others in _pictures(frame, near)
    )


def _are_unrelated(here: np.ndarray, moved: np.ndarray, random: np.ndarray, most: float) -> bool:
    """Return True if tones differ from the `moved` ones about as much as from those at random."""
    follows, unrelated = (np.abs(here - tones).sum(axis=1) for tones in (moved, random))
    told = (follows > _SEEN) | (unrelated > _SEEN)
    if not told.any():
        return False
    return bool(np.median(follows[told]) > most * np.median(unrelated[told]))


def _probes(frame: Frame, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int, int]:
    """Pixels x, y picked at random from the display window, and its width and height [px].

    They are counted from the image's first pixel; where the image has none, nothing is there.
    """
    left, top, width, height = frame.window or (0, 0, *frame.size)
    x, y = rng.integers(0, width, _PROBES), rng.integers(0, height, _PROBES)
    return x - left, y - top, width, height


def _way(frame: Frame, side: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 2) way [px] of pixels x, y to a neighbouring frame; 0 outside the image."""
    there = _within(frame.color, x, y)
    way = np.zeros((len(x), 2))
    way[there] = displacement(frame, side, x[there], y[there])
    return way


def _within(color: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    height, width = color.shape[:2]
    return (x >= 0) & (x < width) & (y >= 0) & (y < height)


def _tones(color: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 3) means of 3 x 3 pixels, held below 1 so that no highlight decides; 0 outside."""
    height, width = color.shape[:2]
    total = np.zeros((len(x), 3))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            at = np.clip(y + dy, 0, height - 1), np.clip(x + dx, 0, width - 1)
            light = np.clip(np.nan_to_num(color[at][:, :3].astype(np.float64)), 0, 1e6)
            total += light / (1 + light)
    return np.where(_within(color, x, y)[:, None], total / 9, 0.0)
