"""Ways that do not lead back tell what a quick search lost."""

import numpy as np
import pytest

import make_frames as make
from wgmb.flow.dis import Dis
from wgmb.flow.dis.consistency import APART, SHARE, SPACING, Consistency, lost, returns

pytestmark = pytest.mark.fast


def returns_slowly(way, back, spacing):
    out = np.ones(way.shape[:2], bool)
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            to_x, to_y = round(x + way[y, x, 0] / spacing), round(y + way[y, x, 1] / spacing)
            if 0 <= to_x < width and 0 <= to_y < height:
                out[y, x] = np.hypot(*(way[y, x] + back[to_y, to_x])) <= APART
    return out


def test_ways_there_and_back_are_compared_where_they_lead():
    rng = np.random.default_rng(3)
    way = rng.integers(-20, 20, (9, 14, 2)) + 0.25
    back = -np.roll(way, 1, axis=1)
    found = returns(way, back, 4)
    assert (found == returns_slowly(way, back, 4)).all() and 0.1 < found.mean() < 0.9


@pytest.mark.parametrize("numbers", [(0, 1, 2), (1, 2), (0, 1)])
def test_lost_is_what_changes_and_leads_back_from_no_neighbour_that_is_there(numbers):
    rng = np.random.default_rng(4)
    ways = {n: tuple(rng.integers(-4, 4, (2, 9, 14, 2))) for n in numbers}
    changes = rng.random((9, 14)) < 0.7
    want = changes.copy()
    if 0 in ways:
        want &= ~returns_slowly(ways[1][0], ways[0][1], SPACING)
    if 2 in ways:
        want &= ~returns_slowly(ways[1][1], ways[2][0], SPACING)
    np.testing.assert_array_equal(lost(ways, 1, changes), want)
    assert 0.02 < want.mean() < 0.68


CHANGED = np.full((16, 24), 90, np.uint8)
CHANGED[:3] = 0


def steady(dx, height=64, width=96):
    way = np.zeros((height, width, 2), np.float32)
    way[..., 0] = dx
    return way


def test_a_steady_motion_and_what_one_side_hides_are_not_lost():
    kept = Consistency()
    for n in range(5):
        to_prev, to_next = steady(-6), steady(6)
        if n == 2:
            to_next[20:40, 30:60] = 40  # the next picture hides it
        kept.add(n, to_prev, to_next, CHANGED)
    assert list(kept.shares) == [1, 2, 3] and kept.lost == 0
    assert max(kept.shares.values()) < SHARE


def test_what_leads_back_from_neither_side_is_lost():
    kept = Consistency()
    for n in range(3):
        to_prev, to_next = steady(-6), steady(6)
        if n == 1:
            to_prev[20:40, 30:60] = to_next[20:40, 30:60] = 15
        kept.add(n, to_prev, to_next, CHANGED)
    assert kept.shares[1] == pytest.approx(20 * 30 / (64 * 96), abs=0.01) and kept.lost == 1


def test_dense_inverse_search_says_what_it_lost():
    """A disc that is far too fast for it, and one that is not."""
    pytest.importorskip("cv2")

    def lost(speed):
        source = Dis()
        shot = source.shot(dict(enumerate(make.disc_before_squares(5, speed))).get, depth=False)
        for n in range(5):
            shot(n)
        return source.lost, source.checked

    assert lost(1) == (0, 3)
    assert lost(45)[0] >= 2


@pytest.mark.parametrize("size, loses", [(4, False), (11, True)])
def test_what_is_lost_of_the_little_that_changes_counts_too(size, loses):
    """Of a walker before a room that stands, a limb is a small share of the picture."""
    kept, change = Consistency(), np.zeros((32, 48), np.uint8)
    change[5:11, 10:20] = 40
    for n in range(3):
        to_prev, to_next = (np.zeros((128, 192, 2), np.float32) for _ in range(2))
        if n == 1:
            to_prev[24 : 24 + size, 48 : 48 + size] = to_next[24 : 24 + size, 48 : 48 + size] = 15
        kept.add(n, to_prev, to_next, change)
    assert kept.shares[1] < SHARE and kept.loses[1] == loses
    still = Consistency()
    for n in range(3):
        still.add(n, to_prev * 0, to_next * 0, 0 * change)
    assert still.loses == {1: False}


def test_noise_is_no_change_but_what_moves_in_it_is():
    rng = np.random.default_rng(2)
    noise = rng.integers(14, 22, (32, 48)).astype(np.uint8)
    moving = noise.copy()
    moving[8:16, 10:20] += 30
    for change, loses in ((noise, False), (moving, True)):
        kept = Consistency()
        for n in range(3):
            kept.add(n, *rng.integers(-20, 20, (2, 128, 192, 2)).astype(np.float32), change)
        assert kept.loses == {1: loses}


def test_what_does_not_change_is_not_lost():
    """Ways of one plain colour lead anywhere."""
    kept, rng = Consistency(), np.random.default_rng(1)
    for n in range(3):
        ways = rng.integers(-20, 20, (2, 64, 96, 2)).astype(np.float32)
        kept.add(n, *ways, np.where(n == 1, 12, 90) * np.ones((16, 24), np.uint8))
    assert kept.shares == {1: 0} and not kept.lost
