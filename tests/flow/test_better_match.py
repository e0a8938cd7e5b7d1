"""Motion of two sources, per pixel that which matches better; and which pictures need both."""

from itertools import pairwise

import numpy as np
import pytest

import make_frames as make
from wgmb.color.srgb import linear, to_display
from wgmb.flow import Flow

pytest.importorskip("cv2")

from wgmb.flow.dis import Dis
from wgmb.flow.dis.better_match import AROUND, BetterMatch, Both, chosen, costs


def shifted(shift, height, width):
    y, x = np.mgrid[:height, :width].astype(np.float32)
    picture = make.texture((x - shift) / 3, y / 3)
    return to_display(picture, 8)[..., 1]


def found(dx, depth, height, width):
    way = np.zeros((height, width, 4), np.float32)
    way[..., 0], way[..., 2] = -dx, dx
    return way, np.full((height, width), depth, np.float32)


def better(near, one, other, *how):
    ours, its = costs(near, one[0], other[0], *how)
    return chosen(one, other, its < ours)


@pytest.mark.parametrize("height, width", [(90, 221), (203, 601), (100, 481)])
@pytest.mark.parametrize("sides", [(-1, 1), (-1,), (1,)])
def test_each_half_of_a_picture_follows_the_source_that_is_right_there(height, width, sides):
    """The left half moves by 2 px, the right one by 6; each source has one motion throughout."""
    near = [None, None, None]
    for n in (0, *sides):
        near[n + 1] = shifted(2 * n, height, width)
        near[n + 1][:, width // 2 :] = shifted(6 * n, height, width)[:, width // 2 :]
    motion, depth = better(near, found(2, 1.0, height, width), found(6, 0.5, height, width))
    reach = AROUND + 8  # px; at the border of the halves, both may be right
    left, right = width // 2 - reach, width // 2 + reach
    assert (motion[8:-8, 8:left, 2] == 2).mean() > 0.99 and (depth[:, 8:left] == 1).mean() > 0.99
    assert (motion[8:-8, right:-8, 2] == 6).mean() > 0.99
    assert ((motion[..., 2] == 6) == (depth == 0.5)).all()
    np.testing.assert_array_equal(motion[..., 0], -motion[..., 2])


@pytest.mark.parametrize("margin, is_taken", [(1.0, False), (1.5, True)])
@pytest.mark.parametrize("is_lost", [False, True])
def test_the_other_source_may_match_worse_up_to_the_margin_where_the_one_is_lost(
    margin, is_taken, is_lost
):
    """The picture moves by 2 px; what is 2.5 px off differs a little more than what is 2 px off."""
    near = [shifted(2 * n, 96, 320) for n in (-1, 0, 1)]
    one, other = found(4, 1.0, 96, 320), found(4.5, 0.5, 96, 320)
    loss = np.zeros((24, 80), bool)
    loss[:, :40] = is_lost
    motion, depth = better(near, one, other, margin, loss)
    left, right = np.s_[24:-24, 24:136], np.s_[24:-24, 184:-24]
    for inner, taken in ((left, is_taken and is_lost), (right, False)):
        assert (motion[inner][..., 2] == (4.5 if taken else 4)).all()
        assert (depth[inner] == (0.5 if taken else 1)).all()


@pytest.mark.parametrize("sides", [(-1, 1), (-1,)])
def test_what_matches_in_both_neighbours_is_better_than_what_matches_in_one(sides):
    """A picture that speeds up: the one knows it, the other goes on as before, and is smoother."""
    shifts = {-1: -2, 0: 0, 1: 9}
    near = [shifted(shifts[n], 96, 320) if n in (0, *sides) else None for n in (-1, 0, 1)]
    one, other = found(2, 1.0, 96, 320), found(2, 0.5, 96, 320)
    one[0][..., 2] = 9
    one[0][..., 0] += np.random.default_rng(1).normal(0, 0.1, (96, 320)).astype(np.float32)
    _, depth = better(near, one, other)
    assert (depth[24:-24, 24:-24] == (1.0 if 1 in sides else 0.5)).all()


def test_loss_counts_around_it():
    """Every second block along both axes is lost: with what is around, all is."""
    near = [shifted(2 * n, 96, 160) for n in (-1, 0, 1)]
    one, other = found(4, 1.0, 96, 160), found(4.5, 0.5, 96, 160)
    loss = np.zeros((24, 40), bool)
    loss[::2, ::2] = True
    motion, _ = better(near, one, other, 1.5, loss)
    assert (motion[24:-24, 24:-24, 2] == 4.5).all()


def test_of_two_that_match_alike_the_one_that_changes_less_is_taken():
    """Nothing is seen in the picture; in half of it, the one is ragged, in the other the other."""
    near = [np.full((96, 320), 90, np.uint8)] * 3
    ragged = np.random.default_rng(1).normal(0, 0.5, (96, 320)).astype(np.float32)
    one, other = found(2, 1.0, 96, 320), found(6, 0.5, 96, 320)
    one[0][:, :160, 2] += ragged[:, :160]
    other[0][:, 160:, 2] += ragged[:, 160:]
    _, depth = better(near, one, other)
    assert (depth[:, :130] == 0.5).all() and (depth[:, 190:] == 1).all()


@pytest.mark.parametrize("is_throughout", [False, True])
def test_where_something_is_lost_its_difference_counts_more_but_not_its_change(is_throughout):
    """Nothing is seen; the one is ragged, and the other a little more."""
    near = [np.full((96, 160), 90, np.uint8)] * 3
    ragged = np.random.default_rng(1).normal(0, 0.5, (96, 160)).astype(np.float32)
    one, other = found(2, 1.0, 96, 160), found(6, 0.5, 96, 160)
    one[0][..., 2] += ragged
    other[0][..., 2] += 1.2 * ragged
    loss = None if is_throughout else np.ones((24, 40), bool)
    _, depth = better(near, one, other, 1.5, loss)
    assert (depth == (0.5 if is_throughout else 1)).all()


def test_without_depth_there_is_none():
    near = [shifted(2 * n, 64, 96) for n in (-1, 0, 1)]
    one, other = found(2, 1.0, 64, 96), found(6, 0.5, 64, 96)
    motion, depth = better(near, (one[0], None), other)
    assert depth is None
    np.testing.assert_array_equal(motion, one[0])


def test_what_dense_inverse_search_loses_comes_from_the_search():
    """A disc at 44 px a frame before squares that stand."""
    shown = enumerate(make.disc_before_squares(5, 44))
    pictures = {n: linear(np.repeat(grey[..., None] / np.float32(255), 3, 2)) for n, grey in shown}
    quick, search = Dis("fast"), Flow(quality="draft")

    def both(n):
        light = pictures.get(n)
        return None if light is None else Both(quick.grey(light), lambda: light)

    motion, depth = BetterMatch(quick, search).shot(both)(2)
    one = quick.shot(pictures.get)(2)
    other = search.shot(pictures.get)(2)
    is_searched = (motion == other[0]).all(axis=2)
    assert ((motion == one[0]).all(axis=2) | is_searched).all()
    np.testing.assert_array_equal(depth[is_searched], other[1][is_searched])
    moved = np.abs(other[0][..., 2] - 44) < 1
    assert moved.sum() > 100 and is_searched[moved].mean() > 0.8
    assert (np.abs(one[0][..., 2] - 44) < 1)[moved].mean() < 0.5
    alone = BetterMatch(quick, search).shot(pictures.get)(2)
    np.testing.assert_array_equal(alone[0], motion)
    np.testing.assert_array_equal(alone[1], depth)
    assert BetterMatch(quick, search).shot(both)(9) is None


class Told:
    """A source that knows the motion of pictures, and counts how often it is asked."""

    def __init__(self, motions):
        self.motions, self.asked = motions, []

    def reach(self, size):
        return 3

    def change(self, *near):
        return Dis().change(*near)

    def shot(self, load, depth=True):
        return lambda number: self.asked.append(number) or self.motions.get(number)


COUNT, HEIGHT, WIDTH = 5, 96, 160


def repeating():
    """Pictures of waves that repeat after 24 px and move by 10; and two sources of their motion.

    The quick one follows the repeat in every second picture; the other is 0.3 px off in all.
    """
    y, x = np.mgrid[:HEIGHT, :WIDTH]

    def picture(n):
        waves = np.sin((x - 10 * n) * np.pi / 12) * np.cos(y / 3)
        return np.rint(128 + 90 * waves).astype(np.uint8)

    pictures = {n: Both(picture(n), lambda: None) for n in range(COUNT)}
    size = HEIGHT, WIDTH
    quick = Told({n: found(10 if n % 2 else -14, 1.0, *size) for n in pictures})
    return pictures, quick, Told({n: found(10.3, 0.5, *size) for n in pictures})


@pytest.mark.parametrize("number", range(COUNT))
@pytest.mark.parametrize("by_ways", [True, False])
def test_a_search_whose_ways_lead_back_is_taken_throughout_though_it_matches_worse(number, by_ways):
    pictures, quick, search = repeating()
    source = BetterMatch(quick, search, by_ways=by_ways)
    motion, depth = source.shot(pictures.get)(number)
    assert source.reach((WIDTH, HEIGHT)) == (4 if by_ways else 3)
    is_searched = depth == 0.5
    assert is_searched.all() if by_ways else is_searched[20:-20, 20:-20].mean() < 0.5
    np.testing.assert_array_equal(is_searched, motion[..., 2] == np.float32(10.3))


class Judge(Told):
    """A source that says that too much is lost in some pictures."""

    def __init__(self, lossy):
        super().__init__({})
        self.lossy = lossy

    def shot(self, load, depth=True):
        shot = super().shot(load, depth)
        shot.loses = lambda number: number in self.lossy
        return shot


def test_only_pictures_in_which_the_judge_loses_something_are_searched():
    pictures, quick, search = repeating()
    shot = BetterMatch(quick, search, judge=Judge({2, 3}), others=[(0.4, 9)]).shot(pictures.get)
    plain = BetterMatch(quick, search).shot(pictures.get)
    for number in (0, 1, 4):
        np.testing.assert_array_equal(shot(number)[0], quick.motions[number][0])
        ((share, motion),) = shot.hypotheses(number)
        assert share == 1 and motion is quick.motions[number]
    assert not search.asked
    for number in (2, 3):
        np.testing.assert_array_equal(shot(number)[1], plain(number)[1])
    assert set(search.asked) == {2, 3}
    assert shot(COUNT) is None


def test_what_moves_slowly_is_not_searched_by_the_best_search():
    """Squares that pan by 2 px a frame, and the same with a disc at 44 px."""
    pan = {n: shifted(2 * n, 96, 160) for n in range(5)}
    fast = dict(enumerate(make.disc_before_squares(5, 44)))
    for shown, is_searched in ((pan, False), (fast, True)):
        search = Told({n: found(3, 0.5, *grey.shape) for n, grey in shown.items()})
        pictures = {n: Both(grey, lambda: None) for n, grey in shown.items()}
        BetterMatch(Dis("best"), search, judge=Dis("fast")).shot(pictures.get)(2)
        assert bool(search.asked) == is_searched


def halves():
    """Three pictures that move by 2 px; the quick source is right on the left, the search right."""
    height, width = 96, 320
    pictures = {n: Both(shifted(2 * n, height, width), lambda: None) for n in range(3)}
    one, other = found(2, 1.0, height, width), found(4, 0.5, height, width)
    one[0][:, width // 2 :] *= 2
    other[0][:, width // 2 :] /= 2
    return pictures, one, other


def test_a_second_hypothesis_takes_the_search_where_it_costs_at_most_so_much_more():
    """The search is not taken on the left, for a cost of more than ten times as much."""
    pictures, one, other = halves()
    quick, search = (Told(dict.fromkeys(pictures, f)) for f in (one, other))

    def shot(times):
        return BetterMatch(quick, search, others=[(0.3, times)]).shot(pictures.get)

    near = [pictures[n].grey for n in range(3)]
    ours, its = costs(near, one[0], other[0])
    likeliest = BetterMatch(quick, search).shot(pictures.get)(1)
    taken = [likeliest[1] == 0.5]
    for times in (1.5, 3, 10):
        (first, plain), (share, second) = shot(times).hypotheses(1)
        assert first == 0.7 and share == 0.3
        for got, expected in zip(plain, likeliest, strict=True):
            np.testing.assert_array_equal(got, expected)
        np.testing.assert_array_equal(shot(times)(1)[1], likeliest[1])
        motion, depth = second
        np.testing.assert_array_equal(depth == 0.5, its < times * ours)
        np.testing.assert_array_equal(motion[depth == 0.5], other[0][depth == 0.5])
        np.testing.assert_array_equal(motion[depth == 1], one[0][depth == 1])
        taken.append(depth == 0.5)
    for less, more in pairwise(taken):
        assert (less <= more).all() and (less < more).any()
    assert not taken[-1][24:-24, 24:120].any()
    assert len(shot(1).hypotheses(1)) == 1 and not shot(2).hypotheses(7)


def test_costs_of_what_matches_and_does_not_change_are_none_and_sources_may_change_places():
    pictures, one, other = halves()
    near = [pictures[n].grey for n in range(3)]
    ours, its = costs(near, one[0], other[0])
    for got, expected in zip((its, ours), costs(near, other[0], one[0]), strict=True):
        np.testing.assert_array_equal(got, expected)
    assert (ours[24:-24, 24:120] < 1).all() and (its[24:-24, 200:-24] < 1).all()
    assert (ours[24:-24, 200:-24] > 10).all() and (its[24:-24, 24:120] > 10).all()


def test_where_neither_loses_clearly_less_the_match_decides():
    """The search loses as much: it follows the repeat as well, in the other pictures."""
    pictures, quick, search = repeating()
    size = HEIGHT, WIDTH
    search.motions = {n: found(-13.7 if n % 2 else 10.3, 0.5, *size) for n in pictures}
    _, depth = BetterMatch(quick, search, by_ways=True).shot(pictures.get)(2)
    assert (depth[20:-20, 20:-20] == 1).all()


@pytest.mark.parametrize("lost, is_taken", [(8, False), (60, True)])
def test_where_much_is_lost_the_margin_holds_throughout(lost, is_taken):
    """All moves by 2 px but the left, which flickers; there, the quick source turns from picture to
    picture. Elsewhere it is 2 px off, and the search 2.5 px."""
    height, width = 96, 320
    pictures = {n: Both(shifted(2 * n, height, width), lambda: None) for n in range(3)}
    for n, picture in pictures.items():
        picture.grey[:, :lost] = 128 + 100 * (-1) ** n
    quick = Told({n: found(4, 1.0, height, width) for n in pictures})
    for n, (motion, _) in quick.motions.items():
        motion[:, :lost] *= 4 * (-1) ** n
    search = Told({n: found(4.5, 0.5, height, width) for n in pictures})
    _, depth = BetterMatch(quick, search, margin=1.5).shot(pictures.get)(1)
    assert (depth[24:-24, 120:-24] == (0.5 if is_taken else 1)).all()


def test_each_picture_of_a_shot_is_asked_for_once_and_the_order_changes_nothing():
    pictures, quick, search = repeating()
    shot = BetterMatch(quick, search, by_ways=True).shot(pictures.get)
    inner = [shot(n) for n in range(COUNT)]
    assert shot(COUNT) is None
    for source in (quick, search):
        assert sorted(n for n in source.asked if 0 <= n < COUNT) == list(range(COUNT))
    for n in (4, 1, 3, 0, 2):
        for one, other in zip(shot(n), inner[n], strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("first", [0, 3, 7])
def test_whether_a_picture_loses_something_depends_on_its_neighbours_alone(first):
    """A disc is too fast for some pictures of a shot; they and those beside them count."""
    pictures = {n: next(make.disc_before_squares(1, 1)) for n in range(12)}
    fast = make.disc_before_squares(5, 45)
    pictures |= dict(zip(range(4, 9), fast, strict=True))
    whole = Dis().shot(pictures.get, depth=False)
    told = {n: whole.loses(n) for n in range(12)}
    assert told[6] and told[7] and not told[0] and not told[11]
    part = Dis().shot(pictures.get, depth=False)
    assert [part.loses(n) for n in range(first, 12)] == [told[n] for n in range(first, 12)]
    alone = Dis().shot(pictures.get, depth=False)
    np.testing.assert_array_equal(part(11)[0], alone(11)[0])
    np.testing.assert_array_equal(part(10)[0], alone(10)[0])
