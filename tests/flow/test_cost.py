"""Of two motions of a picture, per place the one that matches better and changes less."""

import numpy as np
import pytest

import make_frames as make
from wgmb.color.srgb import to_display

pytest.importorskip("cv2")

from wgmb.flow.dis.cost import AROUND, is_better


def shifted(shift, height, width):
    y, x = np.mgrid[:height, :width].astype(np.float32)
    picture = make.texture((x - shift) / 3, y / 3)
    return to_display(picture, 8)[..., 1]


def moving(dx, height, width):
    way = np.zeros((height, width, 4), np.float32)
    way[..., 0], way[..., 2] = -dx, dx
    return way


@pytest.mark.parametrize("height, width", [(90, 221), (203, 601), (100, 481)])
@pytest.mark.parametrize("sides", [(-1, 1), (-1,), (1,)])
def test_in_each_half_of_a_picture_the_motion_is_better_that_is_right_there(height, width, sides):
    """The left half moves by 2 px, the right one by 6; each motion is the same throughout."""
    near = [None, None, None]
    for n in (0, *sides):
        near[n + 1] = shifted(2 * n, height, width)
        near[n + 1][:, width // 2 :] = shifted(6 * n, height, width)[:, width // 2 :]
    takes = is_better(near, moving(2, height, width), moving(6, height, width), 1.0)
    reach = AROUND + 8  # px; at the border of the halves, both may be right
    assert takes.shape == (height, width)
    assert takes[8:-8, 8 : width // 2 - reach].mean() < 0.01
    assert takes[8:-8, width // 2 + reach : -8].mean() > 0.99


@pytest.mark.parametrize("margin", [1.0, 1.5])
def test_the_other_motion_may_match_worse_up_to_the_margin(margin):
    """The picture moves by 2 px; what is 2.5 px off differs a little more than what is 2 px off."""
    near = [shifted(2 * n, 96, 320) for n in (-1, 0, 1)]
    takes = is_better(near, moving(4, 96, 320), moving(4.5, 96, 320), margin)
    assert (takes[24:-24, 24:-24] == (margin > 1)).all()


@pytest.mark.parametrize("sides", [(-1, 1), (-1,)])
def test_what_matches_in_both_neighbours_is_better_than_what_matches_in_one(sides):
    """A picture that speeds up: the one knows it, the other goes on as before, and is smoother."""
    shifts = {-1: -2, 0: 0, 1: 9}
    near = [shifted(shifts[n], 96, 320) if n in (0, *sides) else None for n in (-1, 0, 1)]
    one, other = moving(2, 96, 320), moving(2, 96, 320)
    one[..., 2] = 9
    one[..., 0] += np.random.default_rng(1).normal(0, 0.1, (96, 320)).astype(np.float32)
    takes = is_better(near, one, other, 1.0)
    assert (takes[24:-24, 24:-24] == (1 not in sides)).all()


def test_of_two_that_match_alike_the_one_that_changes_less_is_better():
    """Nothing is seen in the picture; in half of it, the one is ragged, in the other the other."""
    near = [np.full((96, 320), 90, np.uint8)] * 3
    ragged = np.random.default_rng(1).normal(0, 0.5, (96, 320)).astype(np.float32)
    one, other = moving(2, 96, 320), moving(6, 96, 320)
    one[:, :160, 2] += ragged[:, :160]
    other[:, 160:, 2] += ragged[:, 160:]
    takes = is_better(near, one, other, 1.0)
    assert takes[:, :130].all() and not takes[:, 190:].any()


def test_the_change_of_a_motion_counts_as_often_as_its_match():
    """Nothing is seen; the one is ragged, and the other a little more."""
    near = [np.full((96, 160), 90, np.uint8)] * 3
    ragged = np.random.default_rng(1).normal(0, 0.5, (96, 160)).astype(np.float32)
    one, other = moving(2, 96, 160), moving(6, 96, 160)
    one[..., 2] += ragged
    other[..., 2] += 1.2 * ragged
    assert not is_better(near, one, other, 1.0).any()
    assert is_better(near, one, other, 1.5).all()
