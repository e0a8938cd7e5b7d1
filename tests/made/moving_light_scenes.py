"""Scenes whose light moves: shadows and reflections over surfaces, with passes of light."""

from dataclasses import replace

import numpy as np

from wgmb import Frame

SIZE = (45, 70)  # height, width
SPEED = (4.0, -1.5)  # of the shadow [px per frame]
PAN = (1.25, 0.5)  # of everything [px per frame]
AT_REST = {"pan": (0, 0), "scale": 2}


def centres(size):
    """x, y of all pixels' middles; `size`: height, width."""
    y, x = np.mgrid[: size[0], : size[1]]
    return x + 0.5, y + 0.5


def ground(x, y):
    """A textured surface."""
    wave = np.sin(0.7 * x) * np.cos(0.55 * y + 0.2 * x)
    return 0.5 + 0.25 * wave[..., None] * np.array([1, 0.8, 0.5])


def shadow(x, y, t, radius):
    """A soft disc that moves over the surface, and a bar that rests."""
    far = np.hypot(x - 34 - SPEED[0] * t, y - 25 - SPEED[1] * t)
    disc = 1 / (1 + np.exp(1.5 * (far - radius)))
    bar = 1 / (1 + np.exp(2.0 * (np.abs(y - 10) - 3)))
    return (1 - 0.85 * disc)[..., None] * (1 - 0.5 * bar)[..., None] * np.array([1.1, 1, 0.9])


def scene(t, pan=PAN, glossy=False, size=SIZE, still=False, radius=8, scale=1):
    """The frame at the time t, without neighbours, with passes of light; `scale` times as large."""
    size = size[0] * scale, size[1] * scale
    x, y = (at / scale for at in centres(size))
    x, y = x - pan[0] * t, y - pan[1] * t
    albedo, light = ground(x, y), shadow(x, y, 0 if still else t, radius)
    motion = np.broadcast_to(np.array([-pan[0], -pan[1], *pan]), (*size, 4))
    passes = ("glossy_light", "glossy_color") if glossy else ("diffuse_light", "diffuse_color")
    given = dict(zip(passes, (light, albedo), strict=True))
    given |= {"color": albedo * light, "motion": motion, "depth": np.full(size, 7.0)}
    return Frame(**{name: np.asarray(array, "f4") for name, array in given.items()})


def behind_a_body(t):
    """A body before flat ground, and the shadow that it draws behind it; both move to the left."""
    x, y = centres(SIZE)
    body = (np.abs(x - 23 + 11 * t) < 13) & (np.abs(y - 23) < 13)
    far = np.maximum(np.abs(y - 24) - 11 + 0.5 * (x - 36 + 11 * t), x - 50 + 11 * t)
    light = np.where(body, 0.8, 1 - 0.8 / (1 + np.exp(3 * far)))[..., None] * np.ones(3)
    albedo = np.where(body[..., None], 0.3, ground(x, y))
    motion = np.where(body[..., None], np.array([11.0, 0, -11, 0]), 0)
    given = {"color": albedo * light, "diffuse_light": light, "diffuse_color": albedo,
             "motion": motion, "depth": np.where(body, 4.0, 7)}  # fmt: skip
    return Frame(**{name: np.asarray(array, "f4") for name, array in given.items()})


def between_bodies(t):
    """A shadow that goes to the right with a body far above it, behind one that goes to the left.

    In either neighbour one of the two bodies hides the ground that is in the shadow.
    """
    x, y = centres(SIZE)
    low = (np.abs(x - 42 + 22 * t) < 12) & (np.abs(y - 30) < 11)
    high = (np.abs(x - 24 - 22 * t) < 9) & (np.abs(y - 12) < 6)
    far = np.maximum(np.abs(x - 24 - 22 * t) - 9, np.abs(y - 30) - 6)
    body = low | high
    light = np.where(body, 0.8, 1 - 0.8 / (1 + np.exp(3 * far)))[..., None] * np.ones(3)
    albedo = np.where(body[..., None], 0.3, ground(x, y))
    motion = np.where(low[..., None], (22.0, 0, -22, 0), high[..., None] * [-22.0, 0, 22, 0])
    given = {"color": albedo * light, "diffuse_light": light, "diffuse_color": albedo,
             "motion": motion, "depth": np.where(low, 4.0, np.where(high, 5, 7))}  # fmt: skip
    return Frame(**{name: np.asarray(array, "f4") for name, array in given.items()})


def around(**how):
    """The frame between its neighbours."""
    return scene(0, **how).between(scene(-1, **how), scene(1, **how))


def bare(frame):
    """The frame and its neighbours without passes of light."""
    none = {"diffuse_light": None, "diffuse_color": None, "prev": None, "next": None}
    one, before, after = (replace(f, **none) for f in (frame, frame.prev, frame.next))
    return one.between(before, after)
