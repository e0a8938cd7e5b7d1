"""Reels: shots, repeated pictures, what is kept; and exposures summed from cells."""

import numpy as np
import pytest

import make_frames as make
from wgmb import Blur, Frame, Shutter
from wgmb.exposer import Exposer
from wgmb.io.cuts import pictures_differ, repeats
from wgmb.reel import Picture, Reel


class Known:
    """A source of motion that knows the frames of make_frames, and who was asked for."""

    def __init__(self):
        self.shots = 0
        self.seen: dict[int, list[int]] = {}

    def shot(self, load):
        self.shots += 1

        def found(number):
            near = [n for n in range(number - 4, number + 5) if load(n) is not None]
            self.seen[number] = near
            to_prev, to_next = make.motion(0)
            flat = np.ones((make.HEIGHT, make.WIDTH), "f4")
            if len(near) == 1:
                return None
            return np.concatenate([to_prev, to_next], axis=2), flat

        return found


def pictures(count, fps=240.0, times=None, **more):
    for n in range(count):
        at = n / fps if times is None else times[n]
        yield Picture(at, make.picture(n % 12), n, **more)


def linear_average(at, interval, degrees, fps=240.0, count=40):
    """The exposure of frames that are shown as they are, by their cells."""
    edges = (np.arange(count) + 0.5) / fps
    opens, closes = at - interval * degrees / 720, at + interval * degrees / 720
    begins = np.concatenate([[-0.5 / fps], edges[:-1]])
    part = np.clip(np.minimum(edges, closes) - np.maximum(begins, opens), 0, None)
    total = sum(w * make.picture(n % 12) for n, w in enumerate(part) if w > 0)
    return total / part.sum()


@pytest.mark.parametrize("degrees", [90, 180, 360, 720])
def test_without_motion_an_exposure_is_the_average_of_its_cells(degrees):
    reel, exposer = Reel(pictures(40)), Exposer(Blur("tap"))
    for k in range(6):
        got = exposer(reel.parts(k / 60, 1 / 60, Shutter(degrees)))
        np.testing.assert_allclose(got, linear_average(k / 60, 1 / 60, degrees), atol=2e-6)


def test_with_motion_it_is_the_sum_of_blurs_over_the_cells():
    motion, blur = Known(), Blur("gather", samples=8)
    got = Exposer(blur)(Reel(pictures(20), motion=motion).parts(8 / 240, 1 / 60, Shutter(180)))
    to_prev, to_next = make.motion(0)
    want, flat = 0.0, np.ones((make.HEIGHT, make.WIDTH), "f4")
    for n, opens, closes in ((7, 0.0, 0.5), (8, -0.5, 0.5), (9, -0.5, 0.0)):
        near = [
            Frame(make.picture(m), to_next, to_prev=to_prev, depth=flat, number=m)
            for m in (n - 1, n, n + 1)
        ]
        shutter = Shutter(360 * (closes - opens), (opens + closes) / 2)
        part = Blur("gather", samples=8, shutter=shutter)(near[1].between(near[0], near[2]))
        want = want + (closes - opens) / 2 * part
    np.testing.assert_allclose(got, want, atol=1e-5)


def test_a_cut_ends_exposures_and_motion():
    motion = Known()

    def is_cut(before, after):
        return np.array_equal(before, make.picture(9)) and np.array_equal(after, make.picture(10))

    reel = Reel(pictures(20), motion=motion, is_cut=is_cut)
    parts = reel.parts(9 / 240, 1 / 60, Shutter(360))
    assert max(cell.index for cell, _ in parts) <= 9 and reel.cuts == [10]
    reel.parts(12 / 240, 1 / 60, Shutter(360))
    assert motion.shots == 2
    assert all(max(near) <= 9 for n, near in motion.seen.items() if n <= 9)
    assert all(min(near) >= 10 for n, near in motion.seen.items() if n >= 10)


def test_a_repeated_picture_is_left_out_and_its_neighbours_reach_over_it():
    def doubled():
        for n in range(12):
            yield Picture(n / 60, make.picture(n // 2), n)

    reel = Reel(doubled(), is_double=repeats)
    (cell, frame), *_ = reel.parts(2 / 60, 1 / 60, Shutter(180))
    assert frame.number == 2 and reel.doubles[:3] == [1, 3, 5]
    assert cell.shutter.span == pytest.approx((-0.125, 0.125))  # its own interval is twice as long


def test_uneven_times_stretch_the_motion():
    motion = Known()
    times = [0.0, 0.1, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1]
    reel = Reel(pictures(10, times=times), motion=motion)
    ((_, frame),) = reel.parts(0.1, 0.05, Shutter(180))
    to_prev, to_next = make.motion(0)
    np.testing.assert_allclose(frame.motion[..., :2], 2 * to_prev)
    np.testing.assert_allclose(frame.motion[..., 2:], 2 / 3 * to_next, rtol=1e-6)


def test_however_long_the_reel_only_what_is_around_is_kept():
    reel = Reel(pictures(400), motion=Known())
    most = 0
    for k in range(90):
        reel.parts(k / 60, 1 / 60, Shutter(360))
        most = max(most, len(reel._kept))
    assert most <= 26


def test_unrelated_pictures_differ_and_moving_ones_do_not():
    y, x = np.mgrid[:270, :480].astype(np.float32)
    a, b = (make.texture(x / 20, y / 20, seed) ** 2 for seed in (0.0, 7.0))
    b = b[:, ::-1] * [0.3, 1, 0.2]
    moved = make.texture((x - 60) / 20, (y + 20) / 20, 0.0) ** 2
    assert pictures_differ(a, b) and not pictures_differ(a, moved) and not pictures_differ(a, a)
    assert pictures_differ(a, np.zeros_like(a)) and pictures_differ(a, a[:100])


def test_a_copy_differs_by_the_noise_of_a_codec_and_not_by_motion():
    rng = np.random.default_rng(0)
    a = make.picture(3)
    noise = np.clip(a + rng.normal(0, 0.0006, a.shape), 0, 1).astype("f4")
    assert repeats(a, a) and repeats(a, noise)
    assert not repeats(a, make.picture(4)) and not repeats(a, a[:20])
    small = a.copy()
    small[20:26, 20:26] *= 0.8  # something small has moved
    assert not repeats(a, small)
