"""The article's figures from time itself: where the disk is at many instants, and nothing else."""

import numpy as np

GRID, SOLID = np.array([0.2, 0.2, 0.501]), np.array([0.8, 0.9, 1.0])


def positions(width, height):
    """(height, width) x and y of the pixels' centres: 1 is the height, y up."""
    y, x = np.mgrid[:height, :width] + 0.5
    return (x - width / 2) / height, (height / 2 - y) / height


def smoothstep(a, b, x):
    u = np.clip((x - a) / (b - a), 0, 1)
    return u * u * (3 - 2 * u)


def in_disk(x, y, phi):
    """True at places that the disk covers, turned clockwise by `phi`."""
    return np.hypot(x - 0.2 * np.cos(np.pi - phi), y - 0.2 * np.sin(np.pi - phi)) < 0.1


def antialiased(x, y, phi, height):
    """The disk as it is drawn without blur."""
    apart = np.hypot(x - 0.2 * np.cos(np.pi - phi), y - 0.2 * np.sin(np.pi - phi))
    return 1 - smoothstep(0.1, 0.1 + 1 / height, apart)


def in_section(x, y, phi, minor, major, slice_):
    """True at places in the plane z = slice that the torus covers, turned by `phi`."""
    u, v = x * np.cos(phi) + y * np.sin(phi), y * np.cos(phi) - x * np.sin(phi)
    return np.hypot(np.hypot(u, slice_) - major, v) < minor


def exposed(inside, times):
    """Mean over the times."""
    return sum(inside(t).astype(float) for t in times) / len(times)


def grid(x, y, width, height):
    """The lines behind figure 5."""
    near = [np.abs(p % 0.16 - 0.08) for p in (x, y)]
    amount = [
        1 - smoothstep(0.6 / n, 1.6 / n, d) for n, d in zip((width, height), near, strict=True)
    ]
    return np.maximum(*amount)[..., None] * GRID


def response(x):
    """W, the answer of a cone cell to a flash `x` seconds ago."""
    return 50 * np.exp(2.5 - 50 * x) * np.exp(-np.exp(np.minimum(2.5 - 50 * x, 60)))


def perceived(inside, step=1e-4, back=0.4):
    """`inside(x)` x seconds ago, weighted with W."""
    ages = np.arange(-0.05, back, step)
    return sum(inside(a) * response(a) * step for a in ages)
