"""Flow where a picture repeats: the guide chooses between repeats."""

import numpy as np
import pytest
from test_flow import (
    grid,
    texture,
)

from wgmb import Flow


@pytest.mark.parametrize("quality", [pytest.param("best", marks=pytest.mark.full), "fast"])
def test_checks_that_change_their_shade_are_not_confused(quality):
    """A shadow moves over a checkered cloth by half of its period more than the cloth does."""
    way, period, centre = np.array([3.0, 1.0]), 40, (128, 72)
    x, y = grid((144, 256))

    def seen(n):
        i, j = x - n * way[0], y - n * way[1]
        is_cloth = np.maximum(np.abs(i - centre[0]) / 90, np.abs(j - centre[1]) / 60) < 1
        waves = np.sin(2 * np.pi * i / period) * np.sin(2 * np.pi * j / period)
        color = np.where((waves > 0)[..., None], [0.9, 0.9, 0.85], [0.8, 0.1, 0.12])
        shade = 0.7 + 0.3 * np.cos(2 * np.pi * (j - n * period / 2) / 200)
        return np.where(is_cloth[..., None], color * shade[..., None], texture(x, y)).astype("f4")

    motion, _ = Flow(quality=quality)(seen(-1), seen(0), seen(1))
    error = np.abs(motion - [*-way, *way]).max(axis=2)[20:-20, 50:-50]
    assert (error < 4).mean() > 0.95


@pytest.mark.full
def test_cloth_that_turns_back_is_found_on_both_sides():
    """Waves run through it: slopes and speeds differ so much that one side seems hidden."""
    highest, length, turn = 8, 90, 1.0  # px, px, radians per frame
    x, y = grid((180, 320))
    wave = 2 * np.pi / length

    def cloth(n):
        at = x
        for _ in range(60):
            at = x - highest * np.sin(wave * at + turn * n)
        return at

    place = [highest * np.sin(wave * cloth(0) + turn * n) for n in (-1, 0, 1)]
    true = np.stack([place[0] - place[1], 0 * x, place[2] - place[1], 0 * x], axis=2)
    pictures = (texture(cloth(n), y).astype("f4") for n in (-1, 0, 1))
    motion, _ = Flow()(*pictures)
    error = np.abs(motion - true).max(axis=2)[20:-20, 30:-30]
    assert (error < 1).mean() > 0.8
