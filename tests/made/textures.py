"""Textures at real positions, to be moved by parts of a pixel."""

import numpy as np


def texture(x, y, seed=0, waves=24, longest=40.0):
    """Band-limited noise at real positions [px], 0.05 to 0.95, three channels."""
    rng = np.random.default_rng(seed)
    total = np.zeros((*np.broadcast(x, y).shape, 3))
    for _ in range(waves):
        wave = 2 * np.pi / np.exp(rng.uniform(np.log(5), np.log(longest)))
        angle = rng.uniform(0, 2 * np.pi)
        phase = rng.uniform(0, 2 * np.pi, 3)
        along = wave * (x * np.cos(angle) + y * np.sin(angle))
        total += np.cos(along[..., None] + phase)
    return np.clip(0.5 + 0.14 * total * np.sqrt(10 / waves), 0.05, 0.95).astype("f4")


def grid(size):
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    return x, y


def shifted(size, dx, dy, **more):
    x, y = grid(size)
    return texture(x - dx, y - dy, **more)
