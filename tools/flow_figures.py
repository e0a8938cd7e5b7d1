"""Both searches of motion on pictures of known motion: python tools/flow_figures.py [MOTION ...]

Prints a table of the searches of docs/engineers/flow.md: for every motion, the mean error in
pixels, over all pixels and over those that the other frame still shows, and FLIP of the picture
that `gather` blurs with it at 180 degrees; `Flow()`, `Flow(quality="fast")` and OpenCV's DIS at
full size. Pictures are 256 x 144, in 8 bits: noise that falls with frequency as a photograph's
does, and discs of all sizes that hide one another. Takes some minutes.
"""

import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import cv2
import numpy as np

from wgmb import (
    Blur,
    Flow,
    Frame,
    metrics,
)
from wgmb.color.srgb import linear, to_display
from wgmb.flow.dis import Dis

SIZE = WIDTH, HEIGHT = 256, 144
TILE = 1024  # pixels along a texture
DEGREES = 180.0
INSTANTS = 49  # of a true picture
Place = Callable[[float], tuple[np.ndarray, np.ndarray]]


@cache
def noise() -> np.ndarray:
    """Display values whose spectrum falls like a photograph's."""
    rng = np.random.default_rng(1)
    y, x = np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE)[None]
    far = np.hypot(x, y)
    far[0, 0] = 1.0
    fall = far**-1.1 * np.exp(-((far / 0.35) ** 4))
    phases = np.exp(2j * np.pi * rng.random((3, TILE, TILE)))
    waves = np.fft.ifft2(phases * fall).real
    waves /= waves.std(axis=(1, 2), keepdims=True)
    mixed = 0.45 + 0.16 * (0.8 * waves.mean(axis=0) + 0.35 * waves)
    return np.clip(np.moveaxis(mixed, 0, -1), 0.02, 0.98).astype(np.float32)


@cache
def discs() -> np.ndarray:
    """Dead leaves: discs of 4 to 60 pixels, each hiding what came before."""
    rng = np.random.default_rng(2)
    out = np.full((TILE, TILE, 3), 0.3, np.float32)
    y, x = np.mgrid[:TILE, :TILE].astype(np.float32)
    for _ in range(2500):
        radius = rng.uniform(60.0**-2, 4.0**-2) ** -0.5
        centre = rng.uniform(0, TILE, 2)
        color = rng.uniform(0.05, 0.9) + rng.normal(0, 0.1, 3)
        low = np.maximum(0, centre - radius - 2).astype(int)
        high = np.minimum(TILE, centre + radius + 3).astype(int)
        part = slice(low[1], high[1]), slice(low[0], high[0])
        inside = radius - np.hypot(x[part] - centre[0], y[part] - centre[1]) + 0.5
        share = np.clip(inside, 0, 1)[..., None]
        out[part] = share * color + (1 - share) * out[part]
    return np.clip(out, 0.01, 0.99)


@cache
def plain() -> np.ndarray:
    """One colour, of which no patch tells how it moves."""
    return np.full((TILE, TILE, 3), (0.7, 0.2, 0.2), np.float32)


def moving(turn=0.0, zoom=1.0, shift=(0.0, 0.0), grows=(0.0, 0.0), shear=0.0) -> Place:
    """Matrix and shift that bring a point from time 0 to another; `turn` [degrees], `shift` [px]
    per frame, `grows` [px] per frame and frame."""

    def at(time: float) -> tuple[np.ndarray, np.ndarray]:
        c, s = np.cos(np.radians(turn) * time), np.sin(np.radians(turn) * time)
        matrix = zoom**time * np.array([[c, -s], [s, c]]) @ [[1, shear * time], [0, 1]]
        return matrix, np.array(shift) * time + np.array(grows) * time * time / 2

    return at


def disc(radius: float) -> Callable:
    """Return the depth of places inside a disc [px]."""
    return lambda x, y: radius - np.hypot(x, y)


def bar(wide: float, high: float) -> Callable:
    """Return the depth of places inside a bar of twice this width and height [px]."""
    return lambda x, y: np.minimum(wide - np.abs(x), high - np.abs(y))


BARS = [(bar(2.5, 60), (x, 0), discs, moving(shift=(14, 0))) for x in (-90, -45, 10, 70)]
MOTIONS: dict[str, tuple] = {
    "pan of 3.3 px, noise": (noise, moving(shift=(3.3, 0.4))),
    "pan of 3.3 px, discs": (discs, moving(shift=(3.3, 0.4))),
    "pan of 17 px, noise": (noise, moving(shift=(17.3, -2.7))),
    "pan of 17 px, discs": (discs, moving(shift=(17.3, -2.7))),
    "turns by 12 degrees, noise": (noise, moving(turn=12)),
    "turns by 4 degrees, discs": (discs, moving(turn=4)),
    "grows by 6 per cent, noise": (noise, moving(zoom=1.06)),
    "shrinks by a tenth and turns by 2 degrees, discs": (discs, moving(turn=2, zoom=0.9)),
    "shears, noise": (noise, moving(shear=0.08, shift=(2, 1))),
    "speeds up from 5 to 10 px, noise": (noise, moving(shift=(7.5, 0), grows=(5, 0))),
    "turns back, from -3 to 6 px, discs": (discs, moving(shift=(1.5, 0), grows=(9, 0))),
    "a disc at 20 px before discs that stand": (
        discs, moving(), (disc(24), (-20, 0), noise, moving(shift=(19, 5)))),
    "a disc that turns by 20 degrees before a pan": (
        noise, moving(shift=(6, 1)), (disc(30), (10, 5), discs, moving(20, 1, (3, -2)))),
    "a plain disc at 20 px before a pan, discs": (
        discs, moving(shift=(5, 0)), (disc(34), (0, 0), plain, moving(shift=(-20, 4)))),
    "bars 5 px wide at 14 px": (noise, moving(shift=(2, 0)), *BARS),
    "two fast things": (
        discs, moving(shift=(-4, 0)), (bar(20, 14), (50, -30), noise, moving(shift=(-24, 6))),
        (disc(18), (-50, 30), discs, moving(zoom=1.1, shift=(22, 0)))),
}  # fmt: skip


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Centres of pixels from the picture's middle [px]."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    return x - WIDTH / 2, y - HEIGHT / 2


def picture(time: float, texture, place: Place, *movers) -> np.ndarray:
    """Return the picture at an instant, linear."""

    def drawn(texture, place, centre=(0.0, 0.0), aside=0.0):
        matrix, shift = place(time)
        back = np.linalg.inv(matrix)
        x, y = (n - s - c for n, s, c in zip(grid(), shift, centre, strict=True))
        own = back[0, 0] * x + back[0, 1] * y, back[1, 0] * x + back[1, 1] * y
        at = [(n + TILE / 2 - 0.5 + aside).astype(np.float32) for n in own]
        shown = cv2.remap(texture(), at[0], at[1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        return own, linear(np.clip(shown, 0, 1))

    _, out = drawn(texture, place)
    for shape, centre, skin, path in movers:
        own, color = drawn(skin, path, centre, 200.0)
        share = np.clip(shape(*own) + 0.5, 0, 1)[..., None]
        out = share * color + (1 - share) * out
    return out


def true_motion(time: float, texture, place: Place, *movers) -> np.ndarray:
    """Motion of the pixels of time 0 [px]."""
    x, y = grid()

    def way(place, centre=(0.0, 0.0)):
        (matrix, shift), at = place(time), np.stack([x - centre[0], y - centre[1]], axis=2)
        return at @ matrix.T + shift - at

    out = way(place)
    for shape, centre, _, path in movers:
        inside = shape(x - centre[0], y - centre[1]) > 0
        out = np.where(inside[..., None], way(path, centre), out)
    return out


def measured(flow: Any, scene: tuple, blur: Blur) -> tuple[float, float, float]:
    """Error over all pixels and over those seen, and FLIP of the blurred picture."""
    pictures = [linear(to_display(picture(n, *scene).astype(np.float32), 8) / np.float32(255))
                for n in (-1, 0, 1)]  # fmt: skip
    shot = flow.shot(lambda n: pictures[n + 1].astype(np.float32) if abs(n) < 2 else None)
    frames = []
    for n in (-1, 0, 1):
        motion, depth = shot(n)
        frames.append(Frame(pictures[n + 1], motion=motion, depth=depth))
        if n == 0:
            found = motion
    x, y = grid()
    errors, seen = [], []
    for k, time in ((0, -1), (2, 1)):
        true = true_motion(time, *scene)
        errors.append(np.hypot(*np.moveaxis(found[..., k : k + 2] - true, 2, 0)))
        ends = np.abs(np.stack([x, y], axis=2) + true)
        seen.append((ends < [WIDTH / 2 - 0.5, HEIGHT / 2 - 0.5]).all(axis=2))
    instants = ((np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5) * DEGREES / 360
    truth = np.mean([picture(t, *scene) for t in instants], axis=0).astype(np.float32)
    flip = metrics.flip(blur(frames[1].between(frames[0], frames[2])), truth)
    return float(np.mean(errors)), float(np.array(errors)[np.array(seen)].mean()), flip


def main(names: list[str]) -> None:
    """Print a line for every motion."""
    flows = [Flow(), Flow(quality="fast"), Dis("best")]
    blur = Blur("gather", shutter=DEGREES)
    print("| | `Flow()` | `fast` | DIS |\n|---|---|---|---|")
    for name in names or MOTIONS:
        cells = ["{:.2f}, {:.2f}; {:.4f}".format(*measured(f, MOTIONS[name], blur)) for f in flows]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
