"""Image difference metrics for blur, each with its unit.

Every metric takes `picture` and `truth`, (height, width, 3 or 4) linear light of the same size,
and returns one number. Alpha is left out: premultiplied colour is the picture over black.
"Display" means display values: clamped to 0..1 and sRGB encoded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .color.srgb import srgb
from .errors import InputError
from .extras import needed_by

TILE = 16  # [px] where `energy_error` adds light up
_SSIM_SIGMA, _SSIM_REACH = 1.5, 5  # Wang et al. 2004: 11 x 11 Gaussian window
FLIP_GAIN = 3.0  # of error maps, which would be dark
_HEAT = ((0, 0, 0), (0.33, 0.06, 0.45), (0.8, 0.2, 0.3), (0.98, 0.6, 0.2), (1, 1, 0.8))
_LUMA = np.array([0.2126, 0.7152, 0.0722])  # Rec. 709


def display(picture: np.ndarray) -> np.ndarray:
    """(height, width, 3) float32, 0..1: sRGB encoded (IEC 61966-2-1), 0 where it is not finite."""
    return srgb(_linear(picture))


def psnr(picture: np.ndarray, truth: np.ndarray) -> float:
    """Peak signal to noise ratio [dB] on the display; infinite if the two are the same."""
    a, b = _pair(picture, truth, display)
    return _decibel(a, b)


def psnr_linear(picture: np.ndarray, truth: np.ndarray) -> float:
    """Peak signal to noise ratio [dB] of linear light held to 0..1."""
    a, b = _pair(picture, truth, lambda p: np.clip(_linear(p), 0, 1))
    return _decibel(a, b)


def ssim(picture: np.ndarray, truth: np.ndarray) -> float:
    """Structural similarity on the display, mean over red, green and blue; 1 is the same.

    Z. Wang et al., "Image Quality Assessment", IEEE TIP 2004: Gaussian window of 11 x 11 with
    sigma 1.5, K1 = 0.01, K2 = 0.03, where the whole window lies within the picture.
    """
    a, b = _pair(picture, truth, display)
    edge = 2 * _SSIM_REACH + 1
    if min(a.shape[:2]) < edge:
        raise InputError(f"ssim needs {edge} x {edge} pixels, got {a.shape[1]} x {a.shape[0]}")
    mean_a, mean_b = _window(a), _window(b)
    var_a, var_b = _window(a * a) - mean_a**2, _window(b * b) - mean_b**2
    shared = _window(a * b) - mean_a * mean_b
    c1, c2 = 0.01**2, 0.03**2
    alike = (2 * mean_a * mean_b + c1) * (2 * shared + c2)
    return float(np.mean(alike / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2))))


def flip(picture: np.ndarray, truth: np.ndarray) -> float:
    """FLIP on the display, its mean: 0 is the same, 1 as different as can be.

    P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020: the
    difference that a viewer sees when the two alternate, at 67 pixels a degree.
    """
    return _flip(picture, truth)[1]


def flip_colors(picture: np.ndarray, truth: np.ndarray, gain: float = FLIP_GAIN) -> np.ndarray:
    """(height, width, 3) 0..1, display values: `gain` times FLIP, from black over red to white."""
    error = np.clip(gain * _flip(picture, truth)[0][..., 0], 0, 1)
    where, colors = np.linspace(0, 1, len(_HEAT)), np.array(_HEAT).T
    return np.dstack([np.interp(error, where, channel) for channel in colors]).astype(np.float32)


def energy_error(picture: np.ndarray, truth: np.ndarray) -> float:
    """Light in the wrong place: sum of |difference| of tiles' light over all the light.

    Linear, not held to 1; tiles of 16 x 16 pixels. A picture that is 6 % too bright has 0.06;
    noise within a tile hardly counts.
    """
    a, b = _pair(picture, truth, _linear)
    height, width = a.shape[:2]
    rows, columns = np.arange(0, height, TILE), np.arange(0, width, TILE)
    tiles = np.add.reduceat(np.add.reduceat(a - b, rows, axis=0), columns, axis=1)
    return _share(np.abs(tiles).sum(), np.abs(b).sum())


def edge_error(picture: np.ndarray, truth: np.ndarray) -> float:
    """Edges that are missing, added or moved: |difference of gradients| over |gradients|.

    Of the display's luma, between neighbouring pixels; sums over the picture. 0 is the same, 1
    as wrong as a picture without any edge.
    """
    a, b = _pair(picture, truth, lambda p: display(p) @ _LUMA)
    return _share(_slopes(a - b), _slopes(b))


@dataclass(frozen=True)
class Metric:
    """A metric and how to read it."""

    name: str
    title: str
    about: str
    compute: Callable[[np.ndarray, np.ndarray], float]
    digits: int
    more_is_better: bool = False


METRICS: dict[str, Metric] = {
    m.name: m
    for m in (
        Metric("flip", "FLIP", "seen difference, 0 to 1", flip, 4),
        Metric("psnr", "PSNR", "dB on the display", psnr, 2, True),
        Metric("psnr_linear", "PSNR linear", "dB of linear light", psnr_linear, 2, True),
        Metric("ssim", "SSIM", "structure, 1 is the same", ssim, 4, True),
        Metric("energy", "Energy error", "light in the wrong place, share", energy_error, 4),
        Metric("edges", "Edge error", "gradients that differ, share", edge_error, 3),
    )
}


def measure(picture: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Every metric's number by its name in METRICS."""
    return {name: m.compute(picture, truth) for name, m in METRICS.items()}


def _linear(picture: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.asarray(picture)[..., :3].astype(np.float64), posinf=0, neginf=0)


def _pair(
    picture: np.ndarray, truth: np.ndarray, prepare: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    shapes = np.shape(picture), np.shape(truth)
    for name, shape in zip(("picture", "truth"), shapes, strict=True):
        if len(shape) != 3 or shape[2] not in (3, 4) or 0 in shape:
            raise InputError(f"{name} must be (height, width, 3 or 4), got {shape}")
    if shapes[0][:2] != shapes[1][:2]:
        (height, width), (high, wide) = shapes[0][:2], shapes[1][:2]
        raise InputError(f"image is {width} x {height}, the truth {wide} x {high}")
    return np.asarray(prepare(picture), np.float64), np.asarray(prepare(truth), np.float64)


def _decibel(a: np.ndarray, b: np.ndarray) -> float:
    error = np.mean((a - b) ** 2)
    return float(-10 * np.log10(error)) if error > 0 else float("inf")


def _share(part: float, whole: float) -> float:
    """part / whole; where there is no whole, any part is infinitely much."""
    return float(part / whole) if whole > 0 else (float("inf") if part > 0 else 0.0)


def _slopes(plane: np.ndarray) -> float:
    across, down = np.diff(plane, axis=1)[:-1], np.diff(plane, axis=0)[:, :-1]
    return float(np.hypot(across, down).sum())


def _window(planes: np.ndarray) -> np.ndarray:
    """The Gaussian window's mean wherever it lies within the picture."""
    x = np.arange(-_SSIM_REACH, _SSIM_REACH + 1)
    weights = np.exp(-0.5 * (x / _SSIM_SIGMA) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        views = np.lib.stride_tricks.sliding_window_view(planes, len(weights), axis=axis)
        planes = views @ weights
    return planes


def check_flip() -> None:
    """InputError with the command that installs FLIP's package, if it is missing."""
    with needed_by("FLIP"):
        import flip_evaluator  # noqa: F401  # pyright: ignore[reportMissingImports]


def _flip(picture: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, float]:
    with needed_by("FLIP"):
        from flip_evaluator import evaluate  # pyright: ignore[reportMissingImports]
    a, b = _pair(picture, truth, display)
    image, mean, _ = evaluate(b.astype(np.float32), a.astype(np.float32), "LDR", applyMagma=False)
    return np.asarray(image), float(mean)
