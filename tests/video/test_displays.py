"""Displays and captions before moving ground stay legible, and nothing else is taken for one."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest

import wgmb
from tests.made import make_displays as make
from wgmb.errors import InputError
from wgmb.video import displays
from wgmb.video.displays import Displays
from wgmb.video.holdouts import Holdout, check_masks

COUNT = 12
MIDDLE = 6


def grey(picture):
    red, green, blue = np.moveaxis(picture.astype(np.uint16), 2, 0)
    return ((2 * red + 5 * green + blue) >> 3).astype(np.uint8)


def finder(pictures, always=False):
    found = [grey(one) for one in pictures]
    return Displays(found.__getitem__, lambda _, n: 0 <= n < len(found), always)


class Shots:
    """Stands for a ShotReader of one shot, whose first picture has the number 100."""

    def __init__(self, pictures):
        self.pictures = pictures

    def __getitem__(self, index):
        content = SimpleNamespace(grey=grey(self.pictures[index]))
        return SimpleNamespace(content=content, number=100 + index)

    def moves_on(self, _, other):
        return 0 <= other < len(self.pictures)


def leaves(count, speed=make.SPEED):
    big, nothing = make.ground(), np.zeros((*make.SIZE[::-1], 4), np.uint8)
    return [make.over(nothing, make.seen(big, n, speed)) for n in range(count)]


@pytest.fixture(scope="module")
def clip():
    return make.clip(COUNT)


def test_text_before_moving_leaves_is_legible(clip, device):
    pictures, truth, where = clip

    def judged(holdout):
        run = wgmb.blur_pictures(pictures, flow="dis", shutter=180, holdout=holdout, device=device)
        out = [next(run) for _ in range(MIDDLE + 2)]
        both = [
            (make.decibels(out[n], truth[n], make.thin_text(where[n])),
             make.decibels(out[n], truth[n], where[n]))
            for n in (MIDDLE - 1, MIDDLE)
        ]  # fmt: skip
        return np.mean(both, axis=0)

    text, display = judged("none")
    assert text < 19 and display < 19
    text, display = judged(None)
    assert text > 28 and display > 33


def test_it_is_found_where_it_is(clip):
    pictures, _, where = clip
    found = finder(pictures).mask(MIDDLE)
    assert displays.SHARES[0] < found.mean() < displays.SHARES[1]
    text = make.thin_text(where[MIDDLE])
    strokes = text & (make.display(MIDDLE)[..., 3] > 220)
    assert found[strokes].mean() > 0.8
    assert (found & ~where[MIDDLE]).mean() < 0.03


def test_digits_that_change_with_every_picture_are_found(clip):
    pictures, _, _ = clip
    before, here, after = (make.display(MIDDLE + k)[..., 3] for k in (-1, 0, 1))
    digits = (here != before) & (here != after) & (here > 128)
    digits[22:] = False  # of the score
    assert digits.sum() > 20 and finder(pictures).mask(MIDDLE)[digits].mean() > 0.9


def test_a_digit_has_no_gaps(clip):
    """Single pixels of a stroke were blurred with the ground, while those around stayed sharp."""
    found = finder(clip[0]).mask(MIDDLE)
    around = [np.roll(found, way, axis) for axis in (0, 1) for way in (-1, 1)]
    assert not (np.logical_and.reduce(around) & ~found)[1:-1, 1:-1].any()


def test_there_is_none_in_ground_that_moves_or_stands():
    for pictures in (leaves(COUNT), leaves(COUNT, speed=1.0), leaves(COUNT, speed=0.0)):
        assert finder(pictures).mask(MIDDLE) is None


def test_a_camera_that_stands_makes_no_display_of_its_ground():
    """Something that moves before half of it changes nothing of that."""
    still, moves = leaves(COUNT, speed=0.0), leaves(COUNT)
    for n, picture in enumerate(still):
        picture[:, :110] = moves[n][:, :110]
    assert finder(still).mask(MIDDLE) is None


def test_lines_along_the_motion_of_the_ground_are_no_display():
    """Storeys of a house that passes do not change, except at the ends of the house."""
    pictures = leaves(COUNT)
    for n, picture in enumerate(pictures):
        y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
        house = (y >= 60) & (y < 120) & ((x - 8 * n) % 160 < 120)
        picture[house] = 60
        picture[house & (y % 12 < 2)] = 200
    assert finder(pictures).mask(MIDDLE) is None
    assert finder(pictures, always=True).mask(MIDDLE) is not None


@pytest.mark.parametrize(("down", "across"), [(0, 1), (1, 0), (1, 1), (1, -1)])
def test_lines_of_any_slope_run_one_way(down, across):
    y, x = np.mgrid[:60, :60]
    line = (down * x + across * y) % 12 < 2
    cross = line | ((across * x - down * y) % 12 < 2)
    inside = (abs(x - 30) < 25) & (abs(y - 30) < 25)
    shares = [
        displays._two_ways(strokes & inside, np.where(strokes, 200, 60).astype(np.uint8))
        for strokes in (line, cross)
    ]
    assert shares[0] == 0 and shares[1] > 0.1


def test_a_crosshair_is_found_also_before_ground_that_is_as_bright(clip):
    """Level arms before bands that are as bright as they are in half of the pictures."""
    pictures = [picture.copy() for picture in clip[0]]
    arms = np.zeros(pictures[0].shape[:2], bool)
    arms[150, 200:207] = arms[150, 213:220] = True
    for n, picture in enumerate(pictures):
        x = np.arange(picture.shape[1])
        band = (x - 8 * n - 40) % 96 < 48
        picture[130:170, band] = 140
        picture[130:170, ~band] = 40
        picture[arms] = 140
    for n in (MIDDLE - 1, MIDDLE, MIDDLE + 1):
        assert finder(pictures).mask(n)[arms].all()


def test_a_caption_is_found_from_its_first_picture_on():
    pictures, _, where = make.clip(COUNT, first=5)
    found = finder(pictures)
    text = make.thin_text(where[5]) & (make.display(5)[..., 3] > 220)
    before = found.mask(4)
    assert before is None or before[text].mean() < 0.1
    assert found.mask(5)[text].mean() > 0.6


def test_few_pictures_tell_nothing(clip):
    assert finder(clip[0][:5]).mask(2) is None


def test_a_mask_depends_on_the_pictures_around_alone(clip):
    pictures = clip[0] + clip[0]
    near = range(10 - displays.REACH, 10 + displays.REACH + 1)
    shown = {n: grey(pictures[n]) for n in near}
    in_order = finder(pictures)
    for n in range(10):
        in_order.mask(n)
    alone = Displays(shown.__getitem__, lambda _, n: n in shown)
    np.testing.assert_array_equal(in_order.mask(10), alone.mask(10))


def test_masks_begun_ahead_are_the_same_and_made_in_another_thread(clip, monkeypatch):
    """Also where more pictures are there when a mask is asked for than when it was begun."""
    found, made = [grey(one) for one in clip[0]], []
    want = [finder(clip[0]).mask(n) for n in range(COUNT)]
    there = range(COUNT)
    ahead = Displays(found.__getitem__, lambda _, n: n in there, ahead=True)
    make_one = Displays._searched

    def noted(self, window):
        made.append((window.number, threading.current_thread().name))
        return make_one(self, window)

    monkeypatch.setattr(Displays, "_searched", noted)
    got = [ahead.mask(n) for n in range(5)]
    there = range(8)  # fewer for the picture that is begun next
    got.append(ahead.mask(5))
    there = range(COUNT)
    got += [ahead.mask(n) for n in range(6, COUNT)]
    for n in set(range(COUNT)) - {5}:
        np.testing.assert_array_equal(got[n], want[n])
    here = threading.current_thread().name
    assert [n for n, name in made if name == here] == [0, 1, 5, 6]
    assert [n for n, name in made if name == "displays"] == list(range(2, COUNT))


def test_greys_are_made_where_the_mask_is(clip):
    shown, made = list(enumerate(clip[0])), {}

    def noted(picture):
        made[picture[0]] = threading.current_thread().name
        return grey(picture[1])

    ahead = Displays(shown.__getitem__, lambda _, n: 0 <= n < len(shown), ahead=True, grey=noted)
    for n in range(4):
        ahead.mask(n)
    here = threading.current_thread().name
    reach = displays.REACH
    assert {n: name for n, name in made.items() if n <= 3 + reach} == {
        n: here if n <= 1 + reach else "displays" for n in range(4 + reach)
    }


def test_sums_and_contrast_are_those_of_loops():
    plane = np.random.default_rng(1).integers(0, 256, (19, 23)).astype(np.uint8)
    contrast = displays._contrast(plane)
    sums = displays._sum_around(plane > 128, 2)
    for y, x in np.ndindex(plane.shape):
        near = plane[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].astype(int)
        assert contrast[y, x] == near.max() - near.min()
        assert sums[y, x] == (plane > 128)[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].sum()


def test_the_line_tells_how_much_stays_sharp(clip):
    shots, holdout = Shots(clip[0]), Holdout()
    assert holdout.message == ""
    plane = holdout.of(shots)(MIDDLE)
    assert plane.dtype == np.float32 and set(np.unique(plane)) == {0, 1}
    assert list(holdout.shares) == [100 + MIDDLE] and "9.9 % of 1 picture;" in holdout.message
    assert Holdout(displays=False).of(shots)(MIDDLE) is None


def test_a_mask_and_what_is_found_stay_sharp_together(clip):
    mask = np.zeros(clip[0][0].shape[:2], np.float32)
    mask[100:] = 0.5
    held = Holdout(mask).of(Shots(clip[0]))
    found = finder(clip[0]).mask(MIDDLE)
    np.testing.assert_array_equal(held(MIDDLE), np.maximum(found, mask))


def test_none_stands_alone():
    check_masks(("none",))
    with pytest.raises(InputError, match="cannot be combined with other masks"):
        check_masks(("none", "static"))
