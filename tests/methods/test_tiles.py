"""The pictures of `tiles`: without specks where tiles meet."""

import numpy as np
import pytest

import wgmb

HEIGHT, WIDTH = 180, 320  # tiles of 40 px


@pytest.mark.parametrize("velocity", [(48, 0), (34, 20), (0, 40)])
def test_a_box_without_depth_is_as_its_exposure(velocity):
    """Root of the mean square error: .0026 and less; `tap` has six times that."""
    at, instants = (50, 113), (np.arange(64) + 0.5) / 128 - 0.25
    truth = np.full((HEIGHT, WIDTH), 0.25, np.float32)
    shares = np.zeros((HEIGHT, WIDTH), np.float32)
    for t in instants:
        top, left = (round(p + v * t) for p, v in zip(at, velocity[::-1], strict=True))
        shares[top : top + 60, left : left + 80] += 1 / len(instants)
    truth += 0.65 * shares
    error = np.sqrt(np.mean((moving_box(*at, velocity) - truth) ** 2))
    assert error < 0.01


def moving_box(top: int, left: int, velocity) -> np.ndarray:
    """A flat box that moves before flat ground, blurred; red, (height, width)."""
    color = np.full((HEIGHT, WIDTH, 3), 0.25, np.float32)
    color[top : top + 60, left : left + 80] = 0.9
    motion = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    motion[top : top + 60, left : left + 80] = velocity
    return wgmb.blur(color, motion, method="tiles")[..., 0]


@pytest.mark.parametrize("depth", [None, 2])
@pytest.mark.parametrize("speed", [0.5, 1, 1.9])
def test_slow_motion_blurs_as_along_its_path(speed, depth):
    """The published filter leaves motion that reaches less than half a pixel to either side."""
    ground = np.random.default_rng(0).random((90, 120, 3), np.float32)
    motion = np.full((90, 120, 2), (speed, 0), np.float32)
    layers = {} if depth is None else {"depth": np.full((90, 120), depth, np.float32)}
    tap = wgmb.blur(ground, motion, method="tap", **layers)
    got = wgmb.blur(ground, motion, method="tiles", **layers)
    assert np.abs(got - tap).max() < 1e-5 < np.abs(tap - ground).max()


@pytest.mark.parametrize("velocity", [(48, 0), (34, 20), (0, 40)])
@pytest.mark.parametrize(("top", "left"), [(60, 120), (50, 113)])
def test_a_box_has_no_specks_at_its_corners(top, left, velocity):
    """No pixel differs much from the two beside it in a row, nor from those in a column.

    The rule that left diagonal tiles out gave differences of up to .33.
    """
    got = moving_box(top, left, velocity)
    for picture in (got, got.T):
        beside = np.minimum(
            np.abs(picture[1:-1] - picture[:-2]), np.abs(picture[1:-1] - picture[2:])
        )
        turns = (picture[1:-1] - picture[:-2]) * (picture[1:-1] - picture[2:]) > 0
        assert (beside * turns).max() < 0.05
