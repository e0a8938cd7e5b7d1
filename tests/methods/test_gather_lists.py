"""Gather skips still parts of the picture near which nothing moves."""

from functools import cache, lru_cache

import numpy as np
import pytest

import wgmb
from wgmb import Shutter
from wgmb.gpu import kernels, wgsl

SIZE = (150, 340)
ALL_ACTIVE = (
    "methods/gather/tiles/active_tiles.wgsl",
    "var nearest = MARGIN + 1;",
    "var nearest = 0;",
)
SHORT_ROWS = (
    "methods/gather/worklist.wgsl",
    "const GROUPS_PER_ROW: u32 = 32768u;",
    "const GROUPS_PER_ROW: u32 = 5u;",
)


def ball(number, speed, bend=0.0, start=60):
    """A disk that flies to the right before a still wall, as the frame `number` shows it."""
    height, width = SIZE
    y, x = np.mgrid[:height, :width]
    rng = np.random.default_rng(1)
    wall, own = rng.random((2, height, width, 3), dtype="f4")

    def at(t):
        return np.array([start + speed * t, 50 + bend * t * t])

    here = at(number)
    disk = (x - here[0]) ** 2 + (y - here[1]) ** 2 < 15**2
    color = np.where(disk[..., None], np.roll(own, np.round(here[::-1]).astype(int), (0, 1)), wall)
    motion = np.zeros((height, width, 4), "f4")
    motion[disk] = np.concatenate([at(number - 1) - here, at(number + 1) - here])
    depth = np.where(disk, 1, 4).astype("f4")
    return wgmb.Frame(color.astype("f4"), motion=motion, depth=depth)


def shot(speed, bend=0.0, **more):
    prev, own, after = (ball(n, speed, bend, **more) for n in (-1, 0, 1))
    return own.between(prev, after)


@pytest.fixture
def with_shader(monkeypatch):
    """Change a shader: its file, what is there, what shall be there."""

    def change(file, old, new):
        original = wgsl.load.__wrapped__

        @cache
        def load(name):
            source = original(name)
            included = any(one == file for one, _ in source.files)
            assert not included or source.text.count(old) == 1
            return wgsl.WgslSource(source.text.replace(old, new), source.files)

        monkeypatch.setattr(wgsl, "load", load)
        monkeypatch.setattr(kernels, "_kernel", lru_cache(kernels._kernel.__wrapped__))

    return change


def far_from(box, picture):
    """The picture without what is in a box of (left, right, top, bottom)."""
    left, right, top, bottom = box
    outside = np.ones(picture.shape[:2], bool)
    outside[max(top, 0) : bottom, max(left, 0) : right] = False
    return picture[outside]


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    ("speed", "bend", "shutter"),
    [(30, 0, 180), (-45, 20, 360), (24, -8, Shutter(200, "start")), (60, 0, Shutter(40, "end"))],
)
@pytest.mark.parametrize("alone", [True, False])
def test_lists_leave_nothing_out(with_shader, speed, bend, shutter, alone):
    frame = shot(speed, bend)
    if alone:
        frame = frame.between(None, None)
    listed = wgmb.Blur("gather", shutter=shutter, samples=5)(frame)
    assert np.abs(listed - frame.color).max() > 0.1
    with_shader(*ALL_ACTIVE)
    everywhere = wgmb.Blur("gather", shutter=shutter, samples=5)(frame)
    np.testing.assert_array_equal(listed, everywhere)


def test_what_is_parted_only_where_it_is_needed_shows_the_same():
    """Frames that are kept are parted everywhere; lists of one frame are not left for the next."""
    blur = wgmb.Blur("gather", samples=5)
    for frame in (shot(30), shot(-20, start=280), shot(12, 6)):
        kept = frame.locked().between(frame.prev.locked(), frame.next.locked())
        want = wgmb.Blur("gather", samples=5)(kept)
        np.testing.assert_array_equal(blur(frame), want)


def test_far_from_all_that_moves_the_frame_stays_as_it_is():
    frame = shot(30)
    sure = wgmb.Blur("gather", show="confidence")(frame)
    box = (60 - 90, 60 + 90, 50 - 50, 50 + 60)
    same = wgmb.Blur("gather")(frame)
    np.testing.assert_array_equal(far_from(box, same), far_from(box, frame.color))
    np.testing.assert_array_equal(np.unique(far_from(box, sure)), [0, 1])
    assert (far_from(box, sure)[:, 0] == 1).all()


def test_masks_hold_where_nothing_moves():
    frame = shot(30)
    holdout = np.random.default_rng(2).random(SIZE, dtype="f4")
    masked = wgmb.Frame(frame.color, motion=frame.motion, depth=frame.depth, holdout=holdout)
    out = wgmb.Blur("gather", samples=5)(masked.between(frame.prev, frame.next))
    np.testing.assert_allclose(out[:, 200:], frame.color[:, 200:], atol=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("kept", [True, False])
def test_lists_may_be_longer_than_a_row_of_workgroups(with_shader, kept):
    frame = shot(30, 10)
    if kept:
        frame = frame.locked().between(frame.prev.locked(), frame.next.locked())
    want = wgmb.Blur("gather", samples=5)(frame)
    with_shader(*SHORT_ROWS)
    np.testing.assert_array_equal(wgmb.Blur("gather", samples=5)(frame), want)


def test_nothing_that_moves_is_nothing_to_do():
    frame = shot(0)
    np.testing.assert_array_equal(wgmb.Blur("gather")(frame), frame.color)


def test_textures_stay_while_neighbours_come_and_go(device):
    blur = wgmb.Blur("gather", device=device)
    frames = [ball(number, 12.0).locked() for number in range(3)]
    held = []
    for prev, own, after in zip([None, *frames], frames, [*frames[1:], None], strict=False):
        blur(own.between(prev, after))
        held.append(list(blur.method._layers.textures.values()))
    assert all(
        texture is first for now in held for texture, first in zip(now, held[0], strict=True)
    )
    alone = wgmb.Blur("gather", device=device)
    alone(frames[0])
    assert alone.method._layers.textures["surfaces"].size[2] == 2


def test_neighbours_change_no_kernel(device, monkeypatch):
    """A pass is compiled once for all frames of a sequence."""
    made, make = [], kernels.Kernel.__init__

    def counted(kernel, device, source, constants=None):
        made.append(source.name)
        make(kernel, device, source, constants)

    kernels.forget_kernels()
    monkeypatch.setattr(kernels.Kernel, "__init__", counted)
    blur = wgmb.Blur("gather", device=device, shading="off")
    frames = [ball(number, 12.0).locked() for number in range(3)]
    for prev, own, after in zip([None, *frames], frames, [*frames[1:], None], strict=False):
        blur(own.between(prev, after))
    assert made.count("methods/gather/layers/layers.wgsl") == 1
