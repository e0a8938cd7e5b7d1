"""Paths through five positions, from the vectors of three frames, one pixel at a time."""

import numpy as np

NO_DEPTH = 2.0**33


def valid(depth):
    """Depths as the shaders read them."""
    return np.where(np.isfinite(depth) & (depth > 0), np.minimum(depth, NO_DEPTH), NO_DEPTH)


def found_again(frame, step, back, z, y, x):
    """The vectors of a pixel's surface in another frame, and its depth there as a ratio; or None.

    `step` leads there; `back`: which of the vectors there lead back. Where another surface is, the
    one of the four pixels around whose vector leads back best; else what is a little off in depth.
    """
    place = np.array([x, y]) + 0.5 + step
    if frame is None or (place < 0).any() or (place >= frame[3].shape[::-1]).any():
        return None

    def surface(i, j):
        vectors, given = frame[2][j, i].astype(float), frame[3][j, i]
        ratio, off = valid(given) / z, np.hypot(*(vectors[back] + step))
        return (vectors, ratio, off) if given > 0 and off < 1.5 else (vectors, 0.0, off)

    own = surface(int(place[0]), int(place[1]))
    if is_same(own):
        return own[:2]
    last = np.array(frame[3].shape[::-1]) - 1
    corner = np.floor(place - 0.5)
    beside = [
        surface(*np.clip(corner + off, 0, last).astype(int))
        for off in ((0, 0), (1, 0), (0, 1), (1, 1))
    ]
    same = [one for one in beside if is_same(one)]
    if same:
        return min(same, key=lambda one: one[2])[:2]
    return own[:2] if 1 / 1.5 < own[1] < 1.5 else None


def is_same(found):
    """True if a depth, as a ratio, is that of the same surface."""
    return 1 / 1.15 < found[1] < 1.15


def bend(motion, z, y, x, prev, next):
    """Third term of the path of a pixel through five positions, 1 if it has a kink instead."""
    here, there = (motion[:2] + motion[2:]) / 2, []
    for frame, step, back in ((prev, motion[:2], np.s_[2:]), (next, motion[2:], np.s_[:2])):
        found = found_again(frame, step, back, z, y, x)
        there.append((found[0][:2] + found[0][2:]) / 2 if found and is_same(found) else None)
    before, after = there
    if (before is None and after is None) or (np.abs(motion) < 0.01).all():
        return 0.0, 0.0, 0.0
    most = max(np.hypot(*c) for c in there if c is not None)
    if before is not None and after is not None and np.hypot(*here) > max(1.0, most / 0.15):
        return 0.0, 0.0, 1.0
    limit = 3 * np.hypot(*here) + 2
    if most > limit:
        return 0.0, 0.0, 0.0
    before = continued(here, after) if before is None else before
    after = continued(here, before) if after is None else after
    factor = np.minimum(turn_factors(here, (before + after) / 2), limit / max(most, 1e-6))
    return *(factor * (after - before) / 6), 0.0


def continued(here, there):
    """The acceleration on the side that is not seen: turned back, or changed the other way."""
    length2 = here @ here
    turns = length2 > 1 and -0.5 * length2 < here @ there < length2
    if turns and abs(there @ there / length2 - 1) < 0.2:
        return 2 * (here @ there) / length2 * here - there
    return 2 * here - there


def turn_factors(here, mean):
    """Return the factors of the third term, across and down, for a path that turns or swings."""
    if here @ here > 1:
        cosine = mean @ here / (here @ here)
        off = mean - cosine * here
        if cosine > -0.5 and off @ off < 0.04 * (here @ here):
            return np.full(2, turn_factor(cosine))
    return np.array(
        [
            turn_factor(m / h) if abs(h) > 1 and m / h > -0.7 else 1.0
            for h, m in zip(here, mean, strict=True)
        ]
    )


def turn_factor(cosine):
    """Of an angle per frame."""
    angle = np.arccos(np.clip(cosine, -0.5, 1.0))
    # By which the cubic misses a circle in the middle between two frames.
    circle = np.sin(angle / 2) - np.sin(angle) / 2
    cubic = np.sin(angle) * (1 - np.cos(angle)) / 8
    return circle / cubic if cubic > 1e-9 else 1.0


def moved(path, u):
    """Displacement [px] after `u` frame intervals; path: velocity, half acceleration, bend."""
    bend = np.where(path[..., 6:] > 0, np.abs(u), u**2)
    return path[..., :2] * u + path[..., 2:4] * bend + path[..., 4:6] * (u**3 - u)
