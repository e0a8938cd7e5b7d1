"""Pictures of a display before moving leaves, and what a shutter would see of them."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from wgmb.color.srgb import to_display

SIZE = 320, 180
SPEED = 8.0  # px a frame, to the right
_FINE = 4  # steps to a pixel


def ground(seed: int = 3, contrast: float = 0.6) -> np.ndarray:
    """(height, _FINE width, 3) linear: leaves before a sky, that go on at the other end."""
    width, height = SIZE
    rng = np.random.default_rng(seed)
    noise = np.fft.rfft2(rng.standard_normal((height, _FINE * width)))
    y, x = np.fft.fftfreq(height)[:, None], _FINE * np.fft.rfftfreq(_FINE * width)
    smooth = np.fft.irfft2(noise * np.exp(-40 * (x * x + y * y)), (height, _FINE * width))
    cover = np.clip(0.5 + 0.6 * smooth / smooth.std(), 0, 1)[..., None]
    sky, leaves = np.array((0.45, 0.6, 0.8)), np.array((0.02, 0.05, 0.015))
    mean = (sky + leaves) / 2
    return (mean + contrast * (sky * cover + leaves * (1 - cover) - mean)).astype(np.float32)


def seen(big: np.ndarray, time: float, speed: float = SPEED) -> np.ndarray:
    """The ground at a time [frames], as one instant shows it."""
    moved = np.roll(big, round(_FINE * speed * time), axis=1)
    return moved.reshape(moved.shape[0], -1, _FINE, 3).mean(2)


def exposed(big: np.ndarray, time: float, degrees: float = 180, speed: float = SPEED) -> np.ndarray:
    """The same through a shutter around that time."""
    half = degrees / 720
    times = np.linspace(-half, half, 2 * round(_FINE * speed * half) + 1)
    weights = np.ones(len(times))
    weights[[0, -1]] = 0.5
    pictures = (w * seen(big, time + t, speed) for w, t in zip(weights, times, strict=True))
    return sum(pictures) / weights.sum()


def display(number: int) -> np.ndarray:
    """(height, width, 4) uint8, straight alpha: labels, counters, a crosshair, a panel, a caption.

    The score and the clock change with every picture.
    """
    width, height = SIZE
    image = Image.new("RGBA", SIZE, (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    white, black, red = (255, 255, 255, 255), (0, 0, 0, 255), (255, 40, 40, 255)

    def text(x, y, words, size, fill=white, **more):
        draw.text((x, y), words, fill=fill, font=ImageFont.load_default(size=size), **more)

    text(150, 6, f"SCORE 0040{number % 100:02d}", 14)
    text(150, 24, "reach the gate before noon", 11)
    text(150, 38, f"00:0{number // 10 % 10}.{37 * number % 100:02d}", 13)
    draw.rectangle((8, height - 34, 96, height - 8), fill=(20, 20, 30, 255))
    text(14, height - 31, f"HEALTH {100 - number % 10}", 15, (90, 255, 90, 255))
    x, y = width // 2, height // 2
    for a, b in ((4, 12), (-12, -4)):
        draw.line((x + a, y, x + b, y), fill=red)
        draw.line((x, y + a, x, y + b), fill=red)
    text(128, height - 34, "We have to go now!", 17, stroke_width=1, stroke_fill=black)
    return np.asarray(image)


def over(shown: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """A display over a linear picture, as 8-bit display values, in which programs mix them."""
    alpha = shown[..., 3:] / np.float32(255)
    below = to_display(picture.astype(np.float32), 8)
    return np.rint(shown[..., :3] * alpha + below * (1 - alpha)).astype(np.uint8)


def clip(count: int, first: int = 0) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Pictures, what a shutter of 180 degrees sees (both uint8), and where there is a display.

    The display is there from picture `first` on.
    """
    big = ground()
    nothing = np.zeros((*SIZE[::-1], 4), np.uint8)
    shown = [display(n) if n >= first else nothing for n in range(count)]
    pictures = [over(one, seen(big, n)) for n, one in enumerate(shown)]
    truth = [over(one, exposed(big, n)) for n, one in enumerate(shown)]
    return pictures, truth, [one[..., 3] > 0 for one in shown]


def decibels(a: np.ndarray, b: np.ndarray, where: np.ndarray) -> float:
    """PSNR of 8-bit values in a part of the picture."""
    error = (a.astype(np.float64) - b)[where]
    return float(10 * np.log10(255**2 / np.mean(error**2)))


def thin_text(where: np.ndarray) -> np.ndarray:
    """The part of a display that is thin text."""
    found = where.copy()
    found[60:] = False
    return found
