"""`distributed` and `accumulate` against closed forms: they are what the others are measured by.

A white body glows on black and is flat and parallel to the picture, so a pixel's value is the
share of its area and of the exposure that the body covers, and can be written down. With n
independent rays it would be off by a standard error of sqrt(p (1 - p) / n), p the true value; the
shift of the low-discrepancy sequence is random and independent from pixel to pixel, so every
pixel's error is independent, without bias, and at most that large.
"""

import numpy as np
import pytest

import wgmb
from wgmb import (
    Body,
    CameraPath,
    InputError,
    Scene,
    Shutter,
)
from wgmb.methods.accumulate import spread
from wgmb.render import Render
from wgmb.scene import builtin
from wgmb.scene.bodies import rotation, translation

STILL = CameraPath(lambda t: (0 * t, 0 * t, 0 * t))
AWAY, THIN = 8.0, 1e-4  # distance to the flat bodies, half their thickness [m]
FPS = 24.0
CURVES = {
    "box": "box",
    "triangle": "triangle",
    "cosine": "cosine",
    "early": lambda x: np.exp(-4 * x),  # a flipped time would be seen
    "two flashes": lambda x: (x < 0.1) + 2.0 * (x > 0.8),
}
RAYS = 1024


def metres(pixels, height):
    """Of the plane that the bodies lie in."""
    return pixels * AWAY / (0.5 * height * 1.6)


def flat(shape, half, path):
    """A scene of one glowing body; `half` are its half extents [m]."""
    body = Body(shape, (*half, THIN), path, (1, 1, 1), emission=1.0)
    return Scene("flat", (body,), STILL, sun=(0, 0, 1, 0), sky=(0, 0, 0, 0), horizon=(0, 0, 0))


def rendered(scene, size, shutter, samples=RAYS, method="distributed", antialias=3, **options):
    blur = wgmb.Blur(method, samples=samples, shutter=shutter, **options)
    return wgmb.Render(scene, blur, size=size, fps=FPS, antialias=antialias)(0.0)[..., 0].astype(
        float
    )


def passed(shutter, times):
    """The share of the exposure that has passed by each of the times [frame intervals]."""
    at, integral = shutter.integral()
    return np.interp(times, at, integral, left=0, right=1)


def places(size, fine):
    """x, y (height, width, fine^2) [px] of a grid within every pixel."""
    width, height = size
    within = (np.arange(fine) + 0.5) / fine
    y, x, v, u = np.meshgrid(np.arange(height), np.arange(width), within, within, indexing="ij")
    return ((x + u).reshape(height, width, -1), (y + v).reshape(height, width, -1))


def assert_right(got, want, samples=RAYS):
    """No bias, and a variance at most that of independent rays; far less of so many."""
    variance = want * (1 - want) / samples
    off = got - want
    assert np.abs(off[variance == 0]).max(initial=0) < 1e-3  # all or nothing, up to rounding
    some = want * (1 - want) * samples > 4  # so that the error is nearly normal
    z = off[some] / np.sqrt(variance[some])
    assert z.size > 200
    # The mean error in its own standard errors: 4.5 by chance once in 100,000 runs.
    assert abs(off[some].mean()) < 4.5 * off[some].std() / np.sqrt(z.size) + 1e-5
    assert abs(off.mean()) < 1e-4
    assert np.abs(z).max() < 4
    # Independent rays: 1, by chance 1 +- 0.3 of 200 pixels. Measured: 0.01 to 0.09.
    assert (z**2).mean() < 0.25


SIZE = (96, 64)
START, SPEED = 36.0, 40.0  # of the edge at time 0 [px], [px per frame]


def edge(size=SIZE):
    half = metres(300, size[1])

    def path(t):
        right = metres(START - size[0] / 2 + SPEED * FPS * t, size[1])
        return translation(right - half, 0, -AWAY - THIN, t)

    return flat("box", (half, half), path)


def edge_covers(shutter, size=SIZE, flipped=False):
    """The edge has passed x by the time (x - start) / speed; what is left of the exposure, lit."""
    width, height = size
    x, y = places((width, height if shutter.rolling else 1), 16)  # else all rows are alike
    delay = shutter.delay[0] * (x / width - 0.5) + shutter.delay[1] * (y / height - 0.5)
    share = passed(shutter, (x - START) / (-SPEED if flipped else SPEED) - delay)
    lit = (share if flipped else 1 - share).mean(axis=2)
    return np.broadcast_to(lit, (height, width))


@pytest.mark.parametrize(
    "curve",
    [pytest.param(c, marks=[] if c in ("box", "early") else pytest.mark.full) for c in CURVES],
)
def test_a_moving_edge_is_the_shutters_integral(curve):
    shutter = Shutter(360, "start", CURVES[curve])
    got = rendered(edge(), SIZE, shutter)
    assert_right(got, edge_covers(shutter))
    with pytest.raises(AssertionError):
        assert_right(got, edge_covers(shutter, flipped=True))


def test_a_shutters_tails_are_as_long_as_they_are():
    """A curve that begins at 0 has a long first share of the exposure: no pixel is off."""
    shutter = Shutter(360, "start", "cosine")
    size = (96, 96)
    got, want = rendered(edge(size), size, shutter), edge_covers(shutter, size)
    tails = (want[0] > 1e-6) & (want[0] < 0.01) | (want[0] < 1 - 1e-6) & (want[0] > 0.99)
    assert tails.sum() > 6
    assert np.abs((got - want)[:, tails].mean(axis=0)).max() < 4e-4


@pytest.mark.full
@pytest.mark.parametrize("way", ["down", "up", "left", "right"])
def test_a_rolling_shutter_delays_every_ray_by_its_place(way):
    shutter = Shutter(90, "centre", CURVES["early"], rolling=way, rolling_duration=0.6)
    got = rendered(edge(), SIZE, shutter)
    assert_right(got, edge_covers(shutter))
    assert np.abs(got - edge_covers(Shutter(90, "centre", CURVES["early"]))).max() > 0.5


@pytest.mark.covers(0)
@pytest.mark.parametrize("curve", ["early", "box", "cosine"])
def test_a_moving_disk_covers_what_it_passes(curve):
    shutter, radius = Shutter(270, 0.2, CURVES[curve]), 13.0
    x0, y0, vx, vy = 40.0, 30.3, 30.0, -12.0  # [px], [px per frame]

    def path(t):
        x, y = (x0 - 48 + vx * FPS * t), -(y0 - 32 + vy * FPS * t)
        return translation(metres(x, 64), metres(y, 64), -AWAY - THIN, t)

    got = rendered(flat("cylinder", (metres(radius, 64),) * 2, path), SIZE, shutter)
    # |x - x0 - v t| < radius between the two roots of a square in t.
    x, y = places(SIZE, 16)
    a, b = vx**2 + vy**2, (x - x0) * vx + (y - y0) * vy
    square = b**2 - a * ((x - x0) ** 2 + (y - y0) ** 2 - radius**2)
    root = np.sqrt(np.maximum(square, 0))
    leaves, enters = (passed(shutter, (b + sign * root) / a) for sign in (1, -1))
    assert_right(got, np.where(square > 0, leaves - enters, 0).mean(axis=2))


@pytest.mark.parametrize("turn, curve", [(1.1, "early"), (-0.6, "box")])
def test_a_rotating_bar_covers_what_it_sweeps(turn, curve):
    """`turn` in radians a frame, anticlockwise as seen by the camera."""
    shutter, length, width = Shutter(360, "start", CURVES[curve]), 27.0, 5.0

    def path(t):
        return translation(0, 0, -AWAY - THIN, t) @ rotation("z", 0.3 + turn * FPS * t, t)

    got = rendered(flat("box", (metres(length, 64), metres(width, 64)), path), SIZE, shutter)
    x, y = places(SIZE, 12)
    far, angle = np.hypot(x - 48, y - 32), np.arctan2(32 - y, x - 48)
    # It is seen from the bar at an angle of e to s from its axis, or -s to -e, at either end.
    s, e = np.arcsin(np.minimum(1, width / far)), np.arccos(np.minimum(1, length / far))
    want = np.zeros_like(far)
    for end in np.arange(-2, 3) * np.pi:
        for begin, close in ((e, s), (-s, -e)):
            first, last = (passed(shutter, (angle - end - 0.3 - a) / turn) for a in (close, begin))
            want += np.where(e < s, np.abs(last - first), 0)
    assert_right(got, np.where(far < width, 1, want).mean(axis=2))


def test_one_ray_is_all_or_nothing_with_the_right_chance():
    """With a ray each, pixels are independent: mean and variance are those of a coin."""
    shutter = Shutter(360, "start", CURVES["early"])
    size = (96, 192)
    got, want = rendered(edge(size), size, shutter, samples=1), edge_covers(shutter, size)
    assert set(np.unique(got)) == {0.0, 1.0}
    p = want[(want > 0.02) & (want < 0.98)]
    square = (got[(want > 0.02) & (want < 0.98)] - p) ** 2 / (p * (1 - p))
    spread = np.sqrt(((1 - 2 * p) ** 2 / (p * (1 - p))).sum()) / p.size
    assert abs(square.mean() - 1) < 4.5 * spread
    assert abs((got - want).mean()) < 4.5 * np.sqrt((want * (1 - want)).sum()) / want.size


def test_more_rays_refine_the_same_picture():
    """The error falls faster than that of independent rays, by 8 from 16 to 1,024."""
    shutter = Shutter(360, "start", "cosine")
    want = edge_covers(shutter)
    wrong = {n: np.sqrt(((rendered(edge(), SIZE, shutter, n) - want) ** 2).mean())
             for n in (16, 64, 256, 1024)}  # fmt: skip
    assert wrong[64] < 0.5 * wrong[16]
    assert wrong[256] < 0.5 * wrong[64]
    assert wrong[1024] < 0.5 * wrong[256]
    assert wrong[1024] < 0.06 * wrong[16]


@pytest.mark.parametrize("method", ["distributed", "accumulate"])
def test_bit_by_bit_is_the_same_as_at_once(method):
    blur = wgmb.Blur(method, samples=24, shutter=Shutter(270, "start", "triangle"))
    render = wgmb.Render(builtin.make("crossing"), blur, size=(40, 23), antialias=1)
    on_gpu = render.on_gpu(0.1)
    pictures = []
    for bits in ([(0, 24)], [(0, 7), (7, 1), (8, 16)]):
        output = render._images.texture("output", render.size, blur.output)
        for progress in bits:
            encoder = blur.device.create_command_encoder()
            blur.encode_scene(encoder, on_gpu, output.create_view(), progress=progress)
            wgmb.gpu.submit(blur.device, encoder)
        pictures.append(render._images.download(blur.device.create_command_encoder(), output))
    assert np.array_equal(*pictures)
    assert np.array_equal(pictures[0], render(0.1))


def test_a_seed_is_its_noise():
    scene, shutter = builtin.make("crossing"), Shutter(180)
    one, again, other = (rendered(scene, (48, 27), shutter, 16, seed=s) for s in (5, 5, 6))
    assert np.array_equal(one, again)
    assert (one != other).mean() > 0.5
    assert abs((one - other).mean()) < 0.005


@pytest.mark.parametrize("curve", ["box", "early"])
def test_accumulate_is_wrong_by_half_a_picture_at_most(curve):
    """At any place the share of N pictures is within 1 / 2 N of the share of the exposure."""
    size, shutter = (96, 4), Shutter(360, "start", CURVES[curve])
    want = edge_covers(shutter, size)
    for pictures in (16, 64, 256):
        got = rendered(edge(size), size, shutter, pictures, "accumulate", antialias=4)
        assert np.abs(got - want).max() < 0.5 / pictures
        assert np.abs(got - want).max() > 0.02 / pictures


def test_accumulate_approaches_distributed_until_its_antialiasing_is_what_is_left():
    """Root of the mean square: 0.055 sharp, 0.0049, 0.0039, 0.0039; 4 x 4 rays have no filter."""
    scene, shutter, size = builtin.make("crossing", speed=4), Shutter(360, "start"), (64, 36)
    truth = rendered(scene, size, shutter)

    def wrong(*arguments):
        return np.sqrt(((rendered(scene, size, *arguments, antialias=4) - truth) ** 2).mean())

    sharp = wrong(Shutter(0), 1, "accumulate")
    few, some, many = (wrong(shutter, n, "accumulate") for n in (4, 16, 64))
    assert few < 0.2 * sharp
    assert some < 0.9 * few
    assert many < 1.01 * some
    assert many < 0.006


def test_accumulate_is_the_mean_of_its_pictures():
    shutter = Shutter(360, "start", "triangle")
    times = shutter.sample_times(5)
    each = [rendered(builtin.make("crossing"), (32, 18), Shutter(1e-4, float(t)), 1, "accumulate")
            for t in times]  # fmt: skip
    got = rendered(builtin.make("crossing"), (32, 18), shutter, 5, "accumulate")
    np.testing.assert_allclose(got, np.mean(each, axis=0), atol=2e-4)


@pytest.mark.parametrize("count", [1, 2, 7, 64, 100])
def test_accumulate_begins_with_pictures_from_all_over_the_exposure(count):
    order = spread(count)
    assert sorted(order) == list(range(count))
    for few in range(1, count + 1):
        gaps = np.diff([-1, *sorted(order[:few]), count])
        assert gaps.max() <= 2 * (count / few) + 1


def test_accumulate_cannot_roll():
    with pytest.raises(InputError, match="cannot roll"):
        rendered(edge(), (32, 18), Shutter(180, rolling="down"), 2, "accumulate")


def test_every_frame_has_noise_of_its_own():
    render = Render(builtin.make("crossing"), wgmb.Blur("distributed", samples=1), size=(32, 18))
    assert np.array_equal(render(0.0, number=3), render(0.0, number=3))
    assert np.abs(render(0.0, number=3) - render(0.0, number=4)).max() > 0.05
