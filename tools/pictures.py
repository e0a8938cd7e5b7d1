"""Parts of the documentation's pictures: labels, grids, enlargements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"
GAP = 4  # [px] between the pictures of a grid
_TEXT = 15  # [px]


def levels(shown: np.ndarray) -> np.ndarray:
    """Display values 0..1, grey or (height, width, 3), as (height, width, 3) bytes."""
    shown = np.asarray(shown, np.float32)
    if shown.ndim == 2:
        shown = np.repeat(shown[..., None], 3, axis=2)
    return (255 * np.clip(shown, 0, 1) + 0.5).astype(np.uint8)


def enlarged(picture: np.ndarray, corner: tuple[int, int], size: tuple[int, int], by: int):
    """The window of `size` at `corner` (x, y), every pixel a square of `by` pixels."""
    (x, y), (width, height) = corner, size
    window = picture[y : y + height, x : x + width]
    return window.repeat(by, axis=0).repeat(by, axis=1)


def labelled(picture: np.ndarray, text: str) -> np.ndarray:
    """The picture (bytes) with a label in its upper left corner."""
    image = Image.fromarray(picture)
    draw, font = ImageDraw.Draw(image, "RGBA"), ImageFont.load_default(_TEXT)
    left, top, right, bottom = draw.textbbox((10, 7), text, font=font)
    draw.rectangle((left - 6, top - 4, right + 6, bottom + 4), fill=(16, 16, 16, 200))
    draw.text((10, 7), text, font=font, fill=(255, 255, 255, 255))
    return np.asarray(image)


def grid(pictures: dict[str, np.ndarray], columns: int) -> np.ndarray:
    """Pictures of one size (display values 0..1, or bytes) with their labels, row by row."""
    made = [labelled(p if p.dtype == np.uint8 else levels(p), k) for k, p in pictures.items()]
    height, width, _ = made[0].shape
    rows = -(-len(made) // columns)
    size = (rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3)
    sheet = np.full(size, 255, np.uint8)
    for i, picture in enumerate(made):
        y, x = i // columns * (height + GAP), i % columns * (width + GAP)
        sheet[y : y + height, x : x + width] = picture
    return sheet


def save(sheet: np.ndarray, name: str) -> None:
    """Write a sheet under docs/images, as its suffix says."""
    path = IMAGES / name
    path.parent.mkdir(parents=True, exist_ok=True)
    options = {"quality": 84, "optimize": True} if path.suffix == ".jpg" else {"optimize": True}
    Image.fromarray(sheet).save(path, **options)
    print(f"{path.relative_to(IMAGES.parent.parent)}: {path.stat().st_size >> 10} kB", flush=True)
