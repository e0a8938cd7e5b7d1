"""Taps along each pixel's own path, one pixel and one tap at a time."""

import math

import numpy as np

from twins.five_positions import bend, moved, valid


def displacement(motion, t):
    """The point of the parabola through the three places at time t, or a column of t."""
    to_prev, to_next = motion[:2], motion[2:]
    return to_prev * (t * (t - 1) / 2) + to_next * (t * (t + 1) / 2)


def source(motion, y, x, t):
    """The way to what a pixel shows at time t, or a column of t: -v t + (J v - a) t^2."""
    back, ahead = motion[y, x].astype(float).reshape(2, 2)
    v, a = (ahead - back) / 2, (ahead + back) / 2
    return -v * t + (change_along(motion, y, x, v) - a) * t**2


def change_along(motion, y, x, v):
    """Of the velocity along itself, from a quarter interval either way; at most the velocity."""

    def velocity(at):
        between = bilinear(motion, *at)
        return (between[2:] - between[:2]) / 2

    here = np.array([x, y]) + 0.5
    change = 2 * (velocity(here + v / 4) - velocity(here - v / 4))
    return change * min(1.0, np.linalg.norm(v) / max(np.linalg.norm(change), 1e-6))


def bilinear(image, x, y):
    """The image at a position in pixels, centres at + 0.5, edges repeated."""
    height, width = image.shape[:2]
    u, v = float(x) - 0.5, float(y) - 0.5
    i, j = math.floor(u), math.floor(v)
    total = 0.0
    for dj in (0, 1):
        for di in (0, 1):
            share = (1 - abs(u - (i + di))) * (1 - abs(v - (j + dj)))
            column, row = min(max(i + di, 0), width - 1), min(max(j + dj, 0), height - 1)
            total = total + share * image[row, column]
    return total


def tap(color, motion, times, delay=(0.0, 0.0), curved=True, weight=None):
    """Mean over `times` of the colour where the pixel's content was when it passes here.

    `delay`: rolling shutter, across the width and the height [frame intervals].
    """
    height, width = color.shape[:2]
    color, out = color.astype(float), np.zeros(color.shape)
    for y in range(height):
        for x in range(width):
            late = delay[0] * ((x + 0.5) / width - 0.5) + delay[1] * ((y + 0.5) / height - 0.5)
            out[y, x] = pixel(color, motion, x, y, np.asarray(times) + late, curved, weight)
    return out


def pixel(color, motion, x, y, times, curved=True, weight=None):
    """One pixel of `tap`."""
    t = np.reshape(times, (-1, 1))
    moved = source(motion, y, x, t)
    if not curved:
        moved = (motion[y, x, :2].astype(float) - motion[y, x, 2:]) / 2 * t
    total, counted = 0.0, 0.0
    places = np.array([x + 0.5, y + 0.5]) + moved
    for at in places:
        total = total + bilinear(color, *at)
        counted += 1.0 if weight is None else bilinear(weight, *at)
    if counted <= 0:
        total, counted = color[y, x], weight[y, x]
    return total / counted if counted > 0 else 0.0


def published(color, to_prev, samples):
    """Rosado's taps: velocity is half the difference to the previous place."""
    height, width = color.shape[:2]
    out = np.zeros(color.shape)
    for y in range(height):
        for x in range(width):
            here, velocity = np.array([x + 0.5, y + 0.5]), -to_prev[y, x] / 2
            for i in range(samples):
                at = here + velocity * (i / samples)
                out[y, x] += bilinear(color, *at) / samples
    return out


def through_five(frames, times):
    """Taps along paths through five positions; `frames`: as `sources` of reproject."""
    at = {one[0]: one for one in frames}
    _, color, motion, depth = frames[0]
    color, motion, z = color.astype(float), motion.astype(float), valid(depth)
    out = np.zeros(color.shape)
    for y, x in np.ndindex(z.shape):
        back, ahead = motion[y, x, :2], motion[y, x, 2:]
        bent = np.float16(bend(motion[y, x], z[y, x], y, x, at.get(-1), at.get(1)))
        v, a = (ahead - back) / 2, (ahead + back) / 2
        half = -a if bent[2] > 0 else change_along(motion, y, x, v) - a
        path = np.concatenate([-v, half, -bent[:2], bent[2:]])
        for t in times:
            out[y, x] += bilinear(color, *(np.array([x, y]) + 0.5 + moved(path, t))) / len(times)
    return out
