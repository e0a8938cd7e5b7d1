"""Small white lights that move fast: found in the picture, matched, given to their pixels."""

import numpy as np
import pytest
from test_flow import grid
from test_flow import texture as textured

from wgmb import Flow
from wgmb.flow.lights import find_lights, follow_lights


def spotted(*spots, size=(40, 60)):
    """Bytes of dark ground with white rectangles x, y, width, height."""
    shown = np.full((*size, 4), 60, "u1")
    for x, y, wide, high in spots:
        shown[y : y + high, x : x + wide] = 255
    return shown


def test_spots_of_a_size_are_found():
    shown = spotted((5, 6, 3, 4), (30, 20, 9, 8), (50, 3, 2, 5), (5, 25, 17, 4))
    got = find_lights(shown, 16)
    assert got.tolist() == [[6, 7.5, 3, 4], [34, 23.5, 9, 8]]
    shown[..., 2] = 200  # yellow
    assert find_lights(shown, 16).shape == (0, 4)
    y, x = np.mgrid[:160, :160]
    assert find_lights(np.where((x % 8 < 4) & (y % 8 < 4), 255, 0)[..., None], 16).shape == (0, 4)


def test_lights_are_matched_in_both_frames_or_one():
    here = np.array([[50, 50, 4, 4], [80, 20, 4, 4], [20, 80, 9, 9.0]])
    near = np.array([[70, 55, 4, 4], [21, 110, 9, 8.0]])
    far = np.array([[31, 45, 4, 4], [80, 50, 4, 4.0]])
    got = follow_lights(here, near, far, -1.0, 640)
    assert got[0].tolist() == [50, 50, 2, 2, 20, 5, 1, 0]
    assert sorted(got[1:].tolist()) == [
        [20, 80, 4.5, 4.5, 1, 30, 0, 0], [80, 20, 2, 2, 0, -30, 0, 0]
    ]  # fmt: skip
    assert len(follow_lights(here, near[:0], far[:0], -1.0, 640)) == 0


@pytest.mark.parametrize("quality", ["fast", pytest.param("best", marks=pytest.mark.full)])
def test_small_fast_lights_are_followed(quality):
    """White dots 3 to 5 px across move 20 to 40 px over texture, one of them hidden at last."""
    x, y = grid((120, 320))
    dots = ((60.5, 30.5, 1.6, 38, 6), (150, 90, 2, -30, -10), (250, 50, 2.5, 20, 22))

    def seen(n):
        picture = 0.7 * textured(x, y)
        for column, row, radius, u, v in dots[: 2 if n > 0 else 3]:
            inside = np.hypot(x - column - n * u, y - row - n * v) < radius
            picture = np.where(inside[..., None], 1, picture)
        return picture.astype("f4")

    motion, _ = Flow(quality=quality)(seen(-1), seen(0), seen(1))
    moved = np.zeros((120, 320), bool)
    for column, row, radius, u, v in dots:
        inside = np.hypot(x - column, y - row) < radius
        moved |= np.hypot(x - column, y - row) < radius + 4
        assert np.abs(motion - [-u, -v, u, v])[inside].max(axis=1).mean() < 1.5
    assert np.abs(motion[~moved]).mean() < 0.1
