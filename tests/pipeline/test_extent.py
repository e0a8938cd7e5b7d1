"""The extent of a blur, measured on pictures over nothing, for every method."""

import numpy as np
import pytest

import wgmb
from images import camera, crossing
from wgmb import (
    Blur,
    Frame,
    Reprojections,
    Shutter,
)

SIZE = 72, 120  # height, width
SHUTTERS = [
    Shutter(90),
    Shutter(360, "start"),
    Shutter(270, -0.4),
    Shutter(180, rolling="down", rolling_duration=0.8),
]
IMAGE_METHODS = sorted(m for m, c in wgmb.METHODS.items() if "scene" not in c.needs)


def frames(**more):
    """A curved path over nothing: the frame before, itself, and the one after."""
    made = (crossing(SIZE, k, wall=False) for k in (-1, 0, 1))
    prev, here, after = (Frame(c, motion=m * (c[..., 3:] > 0), depth=d, **more) for c, m, d in made)
    return prev, here.between(prev, after), after


def filled(picture):
    """Left, top, right, bottom of what is not empty."""
    y, x = np.nonzero((picture != 0).any(axis=2))
    return int(x.min()), int(y.min()), int(x.max()), int(y.max())


def reached(blur, around):
    """The union of the boxes of three frames, as far as the method looks at them."""
    prev, here, after = around
    boxes = [blur.extent.box(here)]
    if "neighbours" in blur.method.uses:
        boxes += [blur.extent.box(prev, -1), blur.extent.box(after, 1)]
    left, top, right, bottom = zip(*boxes, strict=True)
    return min(left), min(top), max(right), max(bottom)


@pytest.mark.covers(1)
@pytest.mark.parametrize("shutter", SHUTTERS, ids=str)
@pytest.mark.parametrize("method", IMAGE_METHODS)
def test_every_pixel_of_a_result_is_within_reach(method, shutter):
    blur = Blur(method, shutter=shutter)
    around = frames()
    got, box = filled(blur(around[1])), reached(blur, around)
    spare = np.array(got) - box
    assert (spare[:2] >= 0).all() and (spare[2:] <= 0).all(), (got, box)
    if shutter.rolling is None and method != "tiles":  # whose grid of tiles has a margin
        own = blur.extent.box(around[1])
        assert np.abs(np.subtract(got, own)).max() <= 3


def test_a_picture_of_nothing_reaches_nowhere():
    empty = Frame(np.zeros((4, 6, 4), "f4"), motion=np.full((4, 6, 4), 9, "f4"))
    assert Blur("gather").extent.box(empty) is None


def test_scale_and_a_longest_blur_shorten_it():
    color = np.zeros((9, 99, 4), "f4")
    color[4, 50] = 1
    motion = np.zeros((9, 99, 4), "f4")
    motion[4, 50] = -40, 0, 40, 0
    long = Blur("gather", shutter=360).extent.box(Frame(color, motion=motion))
    assert long == (50 - 20 - 1, 3, 50 + 20 + 1, 5)
    half = Frame(color, motion=motion, scale=np.full((9, 99), 0.5, "f4"))
    assert Blur("gather", shutter=360).extent.box(half) == (39, 3, 61, 5)
    held = Blur("gather", shutter=360, max_blur=10).extent.box(Frame(color, motion=motion))
    assert held == (44, 3, 56, 5)


def test_bad_motion_counts_as_none():
    color, motion = np.ones((3, 5, 3), "f4"), np.full((3, 5, 4), np.nan, "f4")
    motion[1, 2] = np.inf
    assert Blur("reproject").extent.box(Frame(color, motion=motion)) == (-1, -1, 5, 3)


def test_motion_of_a_camera_and_its_bodies_is_within_reach():
    color, _, depth = crossing(SIZE, 0, wall=False)
    ids = np.where(np.isfinite(depth), 3, 0)
    moved = np.eye(4)
    moved[:3, 3] = 0.3, -0.2, 0
    cameras = [camera((0.02 * k, 0, 0), yaw=0.01 * k, bodies={3: np.linalg.matrix_power(moved, k)})
               for k in (-1, 0, 1)]  # fmt: skip
    around = Reprojections(cameras[1], cameras[0], cameras[2])
    frame = Frame(color, depth=depth, camera=around, object_id=ids)
    for method in ("tap", "tiles", "gather"):
        blur = Blur(method, shutter=300)
        got, box = filled(blur(frame)), np.array(blur.extent.box(frame))
        assert (got[0] - box[0]) >= 0 and (got[1] - box[1]) >= 0
        assert (got[2] - box[2]) <= 0 and (got[3] - box[3]) <= 0
        motion = blur.motion(frame)
        y, x = np.nonzero(np.isfinite(depth))
        velocity, acceleration = blur.extent._paths(frame, x, y)
        want = motion[y, x].astype(float)
        np.testing.assert_allclose(velocity, (want[:, 2:] - want[:, :2]) / 2, atol=2e-3)
        np.testing.assert_allclose(acceleration, (want[:, 2:] + want[:, :2]) / 2, atol=2e-3)
