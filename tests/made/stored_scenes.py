"""Small scenes whose blur, or motion, is stored in tests/stored, to be compared with today's.

Run as a program, it makes the files anew, all or those that are named, and says what they had been:

    python tests/made/stored_scenes.py uncovered
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

if __name__ == "__main__":  # as pytest does
    sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parent)]

from fine_scenes import soft_disk

from images import blades, crossing
from moving_light_scenes import AT_REST, PAN, SIZE, around, bare, behind_a_body, between_bodies
from textures import grid, texture
from wgmb import Blur, Flow, Frame
from wgmb.io import exr
from wheels import wheel

FOLDER = Path(__file__).parents[1] / "stored"


class Stored(NamedTuple):
    """A scene: what makes its channels (height, width, channels), and how much may differ."""

    make: Callable[[], np.ndarray]
    amount: float  # from which on a pixel differs
    share: float  # of the pixels, that may


# ---- gather ---------------------------------------------------------------------------------


def gathered(sources, degrees, **options):
    """Frames (color, motion, depth) at the times 0, -1, 1 and so on, blurred by gather."""
    made = [Frame(c, motion=m, depth=d) for c, m, d in sources]
    made += [None] * (5 - len(made))
    own, prev, after, before, beyond = made
    near = prev and prev.between(before, None), after and after.between(None, beyond)
    return Blur("gather", samples=4, shutter=degrees, reach=2, **options)(own.between(*near))


def crossed():
    """A box over a wall, in five frames and a long exposure."""
    return gathered([crossing((28, 42), t) for t in (0, -1, 1, -2, 2)], 400)


def crossed_alone():
    """A box over nothing, whose vectors are not filtered, in five frames and a long exposure."""
    return gathered([crossing((28, 42), t, wall=False) for t in (0, -1, 1, -2, 2)], 400)


def grass():
    """Over a fifth of the pixels show three surfaces: nothing is separated."""
    return gathered([blades((36, 52), t) for t in (0, -1, 1)], 180)


def turning():
    """A body turns under its outline, which rests and shows the same of both sides."""
    return gathered([crossing((24, 40), t, turns=True) for t in (0, -1, 1)], 180)


def soft():
    """A rim out of focus, over which motions change evenly."""
    return gathered([soft_disk(t, size=(24, 72)) for t in (0, -1, 1)], 72)


def uncovered():
    """The ground behind a box is darker in the neighbours, in the left part; a wrong depth, too."""
    sources = []
    for t in (0, -1, 1):
        color, motion, depth = crossing((28, 44), t)
        darker = (depth > 5) & (np.arange(44) < 26) & bool(t)
        color[darker, :3] *= 0.35
        last = (depth < 5) & ~np.roll(depth < 5, -1, axis=1)
        motion[last] += (-3, 1, 3, -1)
        sources.append((color, motion, np.where(last, np.float32(9), depth)))
    return gathered(sources, 360)


def spokes():
    """More motions come than a tile lists; a post hides some of them."""
    look = {"spokes": 4, "turn": np.radians(80), "post": 14}
    return gathered([wheel(t, (48, 52), **look) for t in (0, -1, 1)], 360)


# ---- light that moves -----------------------------------------------------------------------


def lit(frame, shading="auto"):
    """The blur, and how sure it is, of every second pixel each way."""
    blur = Blur("gather", shutter=360, samples=4, shading=shading)
    image, sure = blur.with_confidence(frame)
    return np.dstack([image[..., :3], sure["accepted"]])[::2, ::2]


def folded(frame):
    """With edges here and there, and depth that grows from the middle on."""

    def one(frame, seed):
        edges = np.random.default_rng(seed).random(SIZE) < 0.002
        beyond = np.maximum(np.arange(SIZE[1]) - 36, 0)
        depth = np.where(edges, 14, frame.depth * (1 + 0.05 * beyond)).astype("f4")
        return replace(frame, depth=depth, prev=None, next=None)

    return one(frame, 5).between(one(frame.prev, 4), one(frame.next, 6))


def shadow():
    return lit(folded(around(pan=PAN)))


def reflection():
    return lit(folded(around(pan=PAN, glossy=True)))


def shadow_without_passes():
    """Static surfaces; a pixel of light is 2 x 2."""
    return lit(bare(around(radius=3, **AT_REST)), "frames")[::2, ::2]


def shadow_of_a_body():
    return lit(behind_a_body(0).between(behind_a_body(-1), behind_a_body(1)))


def shadow_between_bodies():
    return lit(between_bodies(0).between(between_bodies(-1), between_bodies(1)))


# ---- motion of pictures ---------------------------------------------------------------------


def searched(picture, quality):
    """Motion to the previous and the next picture [px], and depth."""
    motion, depth = Flow(quality=quality)(*(picture(n).astype("f4") for n in (-1, 0, 1)))
    return np.dstack([motion, depth])


def square():
    """A square that speeds up over a wall that stands, part of it hidden on one side."""
    x, y = grid((36, 64))

    def picture(n):
        at = x - 30 - 7 * n - 1.5 * n * n
        inside = (np.abs(at) < 11) & (np.abs(y - 18) < 9)
        return np.where(inside[..., None], texture(at, y, seed=5), texture(x, y, seed=6))

    return searched(picture, "best")


def zoomed():
    """A texture that turns and grows, of which some leaves the picture, and two white lights."""
    x, y = grid((40, 72))
    x, y = x - 36, y - 20

    def picture(n):
        c, s, k = np.cos(0.06 * n), np.sin(0.06 * n), 1.03**-n
        ground = 0.7 * texture(k * (c * x + s * y), k * (c * y - s * x))
        for column, row, u in ((-16, -8, 15), (12, 9, -13)):
            inside = np.hypot(x - column - n * u, y - row - 3 * n) < 1.8
            ground = np.where(inside[..., None], 1, ground)
        return ground

    return searched(picture, "fast")


def repeats():
    """Checks that change their shade by half of their period while they move."""
    x, y = grid((48, 96))

    def picture(n):
        i, j = x - 2 * n, y - n
        waves = np.sin(2 * np.pi * i / 16) * np.sin(2 * np.pi * j / 16)
        color = np.where((waves > 0)[..., None], [0.9, 0.9, 0.85], [0.8, 0.1, 0.12])
        color = color * (0.7 + 0.3 * np.cos(2 * np.pi * (j - 8 * n) / 70))[..., None]
        is_cloth = (np.abs(x - 48) < 36) & (np.abs(y - 24) < 20)
        return np.where(is_cloth[..., None], color, texture(x, y))

    return searched(picture, "best")[::2, ::2]


# ---- files ----------------------------------------------------------------------------------

SCENES = {make.__name__: Stored(make, *bounds) for bounds, scenes in {
    (2e-3, 0.005): (crossed, crossed_alone, grass, turning, soft, uncovered, spokes),
    (5e-3, 0.01): (shadow, reflection, shadow_without_passes, shadow_of_a_body,
                   shadow_between_bodies),
    (0.1, 0.02): (square, zoomed, repeats),
}.items() for make in scenes}  # fmt: skip


def read(name):
    """The stored channels, (height, width, channels)."""
    part = exr.read(FOLDER / f"{name}.exr").parts[0]
    return np.dstack([part.channels[c] for c in sorted(part.channels)]).astype("f4")


def write(name, picture):
    """Store channels as halves."""
    height, width, count = picture.shape
    planes = {f"{k}": exr.to_half(picture[..., k]) for k in range(count)}
    window = (0, 0, width - 1, height - 1)
    (FOLDER / f"{name}.exr").write_bytes(
        exr.encode(exr.Exr(FOLDER, [exr.Part("", planes, {}, window, window)]))
    )


def differing(name, picture):
    """Share of the pixels that are not those of the stored file."""
    want = read(name)
    if want.shape != picture.shape or not np.isfinite(picture).all():
        return 1.0
    return (np.abs(picture - want) > SCENES[name].amount).any(axis=2).mean()


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for scene in sys.argv[1:] or SCENES:
        new = SCENES[scene].make()
        if (FOLDER / f"{scene}.exr").exists():
            print(f"{scene}: {differing(scene, new):.2%} of the pixels had been others")
        write(scene, new)
