"""Dense inverse search: shifts, ends of a shot, and the order in depth."""

import re
import sys

import cv2
import numpy as np
import pytest

import make_frames as make
from wgmb import InputError
from wgmb.extras import install_command
from wgmb.flow.dis import Dis

SHIFT = 3.0, -2.0


def textured(number, height=96, width=128):
    y, x = np.mgrid[:height, :width].astype(np.float32)
    return make.texture((x - SHIFT[0] * number) / 3, (y - SHIFT[1] * number) / 3)


@pytest.mark.parametrize("quality", ["fast", "best"])
def test_a_shifted_picture_gives_its_shift(quality):
    shot = Dis(quality).shot({-1: textured(-1), 0: textured(0), 1: textured(1)}.get)
    motion, depth = shot(0)
    inner = motion[16:-16, 16:-16].reshape(-1, 4)
    np.testing.assert_allclose(np.median(inner, axis=0), [-3, 2, 3, -2], atol=0.2)
    assert depth.shape == (96, 128) and depth.min() > 0.9


@pytest.mark.parametrize("width, side", [(240, 12), (640, 24)])
def test_small_things_before_a_still_ground_move_in_small_pictures(width, side):
    """Ending at a quarter of the size, less than a third of their motion was found."""
    y, x = np.mgrid[:120, :width].astype(np.float32)
    ground = make.texture(x / 3, y / 3)
    thing = make.texture(x[:side, :side] / 3, y[:side, :side] / 3, 4.0)

    def shown(number):
        picture, left = ground.copy(), width // 2 + 3 * number
        picture[48 : 48 + side, left : left + side] = thing
        return picture

    motion, _ = Dis().shot({n: shown(n) for n in (-1, 0, 1)}.get)(0)
    inner = motion[50 : 46 + side, width // 2 + 2 : width // 2 + side - 2].reshape(-1, 4)
    np.testing.assert_allclose(np.median(inner, axis=0), [-3, 0, 3, 0], atol=0.5)


def test_at_the_ends_of_a_shot_a_path_goes_straight_on():
    shot = Dis().shot({0: textured(0), 1: textured(1)}.get)
    for number in (0, 1):
        motion, _ = shot(number)
        np.testing.assert_array_equal(motion[..., :2], -motion[..., 2:])
    assert shot(7) is None
    assert Dis().shot({0: textured(0)}.get)(0) is None


def test_a_still_picture_does_not_move_and_small_ones_are_taken():
    """OpenCV itself ends the program at 16 x 160, and refuses 31 x 640."""
    for size in ((96, 128), (5, 9), (16, 160), (31, 640), (640, 20)):
        still = textured(0, *size)
        motion, _ = Dis().shot(dict.fromkeys((-1, 0, 1), still).get)(0)
        assert np.abs(motion).max() < 0.02


def test_what_moves_otherwise_than_most_is_nearer():
    def moved(number):
        picture = textured(0, 160, 240).copy()
        at = 100 + 5 * number
        y, x = np.mgrid[:48, :48].astype(np.float32)
        picture[60:108, at : at + 48] = make.texture(x / 3, y / 3, 4.0)
        return picture

    _, depth = Dis("best").shot({n: moved(n) for n in (-1, 0, 1)}.get)(0)
    assert depth[70:98, 110:138].mean() < 0.985 < 0.995 < depth[:40].mean()


def test_motion_without_depth_is_the_same_and_depth_is_that_of_the_formula():
    pictures = {n: textured(n) for n in (-1, 0, 1)}
    motion, depth = Dis().shot(pictures.get)(0)
    alone, none = Dis().shot(pictures.get, depth=False)(0)
    assert none is None
    np.testing.assert_array_equal(alone, motion)
    want = np.minimum(slow_depth(motion[..., :2]), slow_depth(motion[..., 2:]))
    np.testing.assert_allclose(depth, want, atol=1e-5)


def slow_depth(way):
    """By float64: how far each pixel is from the homography that most of them follow."""
    height, width = way.shape[:2]
    step = max(1, max(width, height) // 40)
    y, x = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    points = np.stack([x.ravel(), y.ravel()], 1).astype(float)
    most, _ = cv2.findHomography(points, points + way[y, x].reshape(-1, 2), cv2.LMEDS)
    y, x = np.mgrid[:height, :width].astype(float)
    there = np.stack([x, y, np.ones_like(x)], 2) @ most.T
    off = there[..., :2] / there[..., 2:] - np.stack([x, y], 2) - way
    return cv2.medianBlur((1 / (1 + 0.005 * np.hypot(*np.moveaxis(off, 2, 0)))).astype("f4"), 5)


def test_without_opencv_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=re.escape(install_command("flow"))):
        Dis()
    with pytest.raises(InputError, match="fast, best"):
        Dis("good")
