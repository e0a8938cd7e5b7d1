"""The page's block search in numpy, one pixel after the other."""

import numpy as np

PATCH, PRICE = 2, 0.002


def shrunk(picture):
    """Half the size: the mean of four pixels."""
    height, width = (max(1, n // 2) for n in picture.shape[:2])
    made = np.zeros((height, width, picture.shape[2]), np.float32)
    for y in range(height):
        for x in range(width):
            rows = np.minimum([2 * y, 2 * y + 1], picture.shape[0] - 1)
            columns = np.minimum([2 * x, 2 * x + 1], picture.shape[1] - 1)
            made[y, x] = picture[np.ix_(rows, columns)].mean((0, 1))
    return made


def clamped(picture, x, y):
    """A pixel; outside, the nearest one."""
    return picture[np.clip(y, 0, picture.shape[0] - 1), np.clip(x, 0, picture.shape[1] - 1)]


def between(picture, x, y):
    """Bilinear, at positions whose whole numbers are the middles of pixels."""
    left, top = int(np.floor(x)), int(np.floor(y))
    across, down = np.float32(x - left), np.float32(y - top)
    upper = clamped(picture, left, top) * (1 - across) + clamped(picture, left + 1, top) * across
    lower = (clamped(picture, left, top + 1) * (1 - across)
             + clamped(picture, left + 1, top + 1) * across)  # fmt: skip
    return upper * (1 - down) + lower * down


def cost(first, second, x, y, by):
    """Mean difference of a patch and the same one moved, and the price of the way."""
    total = 0.0
    for dy in range(-PATCH, PATCH + 1):
        for dx in range(-PATCH, PATCH + 1):
            u = int(np.clip(x + dx, 0, first.shape[1] - 1))
            v = int(np.clip(y + dy, 0, first.shape[0] - 1))
            total += np.abs(first[v, u, :3] - between(second, u + by[0], v + by[1])[:3]).sum()
    return total / (3 * (2 * PATCH + 1) ** 2) + PRICE * np.hypot(*by)


def searched(first, second, coarser=None, reach=0, some=None):
    """The best displacement of each pixel (height, width, 2), and its cost.

    `some`: rows and columns that are enough.
    """
    height, width = some or first.shape[:2]
    made = np.zeros((height, width, 3))
    nine = [(i % 3 - 1, i // 3 - 1) for i in range(9)]
    for y in range(height):
        for x in range(width):
            if reach:
                ways = [(u, v) for v in range(-reach, reach + 1) for u in range(-reach, reach + 1)]
            else:
                ways = [2 * clamped(coarser, x // 2 + u, y // 2 + v)[:2] for u, v in nine]
            best = min(
                [(0.0, 0.0), *ways], key=lambda by: cost(first, second, x, y, by)
            )  # fmt: skip
            for step in (1.0, 0.5, 0.25):
                ways = [(best[0] + step * u, best[1] + step * v) for u, v in nine]
                best = min([best, *ways], key=lambda by: cost(first, second, x, y, by))
            made[y, x] = *best, cost(first, second, x, y, best)
    return made


def smoothed(found):
    """Of the displacements around a pixel, the one that differs least from the others."""
    made = np.zeros_like(found)
    nine = [(i % 3 - 1, i // 3 - 1) for i in range(9)]
    for y in range(found.shape[0]):
        for x in range(found.shape[1]):
            near = [clamped(found, x + u, y + v) for u, v in nine]
            apart = [sum(np.hypot(*(a[:2] - b[:2])) for b in near) for a in near]
            made[y, x] = near[int(np.argmin(apart))]
    return made
