"""A wheel that turns so far that a tile cannot list all of its motions."""

import numpy as np

TURN = np.radians(50)  # per frame


def wheel(t, size=(90, 100), spokes=5, turn=TURN, post=0):
    """A wheel of thin spokes that turns before a textured wall: colour, motion, depth.

    Its middle is beside that of the picture, so that no two motions are equally long. `post`: the
    width of a post before it [px].
    """
    fine, (height, width) = 4, size
    y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
    u, v = x - 0.47 * width - 0.23, y - 0.48 * height + 0.17
    radius, angle = np.hypot(u, v), np.arctan2(v, u) - turn * t
    beside = radius * np.abs(np.sin((angle % (2 * np.pi / spokes)) - np.pi / spokes))
    spoke = (beside < 1.6) & (radius < 0.45 * height)
    wall = 0.4 + 0.2 * np.sin(0.3 * x + 0.5 * y)
    color = np.where(spoke, 0.9, wall)[..., None] * [1.0, 0.8, 0.6]
    before = np.abs(x - 0.63 * width) < post / 2
    color[before], spoke = 0.2, spoke & ~before

    def mean(a):
        return a.reshape(height, fine, width, fine, -1).mean(axis=(1, 3)).astype("f4")

    def turned(by):
        c, s = np.cos(by), np.sin(by)
        return np.stack([c * u - s * v - u, s * u + c * v - v], axis=-1)

    middle = np.s_[2::fine, 2::fine]
    motion = np.where(spoke[..., None], np.dstack([turned(-turn), turned(turn)]), 0.0)[middle]
    depth = np.where(before, 2.0, np.where(spoke, 4.0, 9.0))[middle]
    return mean(color), motion.astype("f4"), depth.astype("f4")
