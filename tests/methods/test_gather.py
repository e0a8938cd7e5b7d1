"""Gather finds in the neighbouring frames the surfaces that the frame itself hides."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import wgmb
from images import crossing, frame_of
from wgmb import Shutter, gpu
from wgmb.gpu import kernels
from wgmb.gpu.textures import TexturePool

SIZE = (54, 96)
SHUTTER = Shutter(180)


@pytest.fixture(scope="module")
def sources():
    return [crossing(SIZE, offset) for offset in (0, -1, 1)]


@pytest.fixture(scope="module")
def truth():
    times = SHUTTER.sample_times(64).astype(float)
    return np.mean([crossing(SIZE, t)[0] for t in times], axis=0)


def error(picture, truth):
    return np.sqrt(np.mean((picture - truth) ** 2))


def test_it_is_closer_to_the_truth_than_one_frame_can_be(sources, truth):
    frame = frame_of(sources)
    three = error(wgmb.Blur("gather")(frame), truth)
    alone = wgmb.Frame(frame.color, motion=frame.motion, depth=frame.depth)
    one = error(wgmb.Blur("gather")(alone), truth)
    taps = error(wgmb.Blur("tap")(frame), truth)
    assert three < 0.8 * one
    assert three < 0.4 * taps


def test_noise_in_vectors_breaks_no_surface(sources, truth):
    rng = np.random.default_rng(3)
    noisy = [(c, m + rng.normal(size=m.shape).astype("f4") * 0.5, d) for c, m, d in sources]
    clean = error(wgmb.Blur("gather")(frame_of(sources)), truth)
    assert error(wgmb.Blur("gather")(frame_of(noisy)), truth) < 1.5 * clean + 0.002
    share = wgmb.Blur("gather", show="confidence")(frame_of(noisy))[..., 0]
    assert share.mean() > 0.98


def test_vectors_of_the_other_sign_are_worse(sources):
    times = Shutter(360).sample_times(64).astype(float)
    truth = np.mean([crossing(SIZE, t)[0] for t in times], axis=0)
    blur = wgmb.Blur("gather", shutter=360)
    right = error(blur(frame_of(sources)), truth)
    turned = frame_of([(c, -m, d) for c, m, d in sources])
    assert error(blur(turned), truth) > 5 * right


def test_stillness_is_kept_to_the_bit_beside_neighbours(noise):
    depth = np.ones(noise.shape[:2], "f4")
    still = np.zeros((*depth.shape, 4), "f4")
    others = [np.roll(noise, k, axis=1) for k in (1, 2)]
    frame = frame_of([(c, still, depth) for c in (noise, *others)])
    assert np.array_equal(wgmb.Blur("gather")(frame), noise)


def test_energy_of_a_moving_spark_is_kept():
    sources = []
    for offset in (0, -1, 1):
        color = np.zeros((48, 96, 3), "f4")
        motion = np.zeros((48, 96, 4), "f4")
        depth = np.full((48, 96), 9.0, "f4")
        at = np.s_[22:26, 46 + 12 * offset : 50 + 12 * offset]
        color[at], motion[at], depth[at] = 500.0, (-12, 0, 12, 0), 4.0
        sources.append((color, motion, depth))
    out = wgmb.Blur("gather", samples=64)(frame_of(sources))
    assert out.sum() == pytest.approx(sources[0][0].sum(), rel=0.01)


def shapes(offset, mixed):
    """A disc flies over a box, over nothing: colour with alpha, vectors mixed or not, depth."""
    fine, (height, width) = 8, (90, 160)
    y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
    velocity = np.array([[0, 0], [3, 1], [-36, 4]])
    fx, fy = x - 3 * offset - 80, y - offset - 45
    which = ((abs(fx) < 35) & (abs(fy) < 27)).astype(int)
    which[(x + 36 * offset - 121) ** 2 + (y - 4 * offset - 45) ** 2 < 24**2] = 2
    color = np.array([[0, 0, 0, 0], [0.8, 0.5, 0.1, 1], [0.1, 0.4, 0.9, 1]])[which]
    motion = np.concatenate([-velocity, velocity], axis=1)[which]
    middle = np.s_[fine // 2 :: fine, fine // 2 :: fine]

    def mean(a):
        return a.reshape(height, fine, width, fine, -1).mean(axis=(1, 3)).astype("f4")

    motion = mean(motion) if mixed else motion[middle].astype("f4")
    return mean(color), motion, np.array([np.inf, 9, 4], "f4")[which[middle]]


def test_alpha_tells_the_coverage_that_vectors_do_not():
    """Many renderers give the vector of one of the surfaces that a pixel shows."""
    times = Shutter(360).sample_times(24)
    truth = np.mean([shapes(t, True)[0] for t in times], axis=0)
    errors = []
    for mixed in (True, False):
        frame = frame_of([shapes(offset, mixed) for offset in (0, -1, 1)])
        errors.append(error(wgmb.Blur("gather", shutter=360, samples=24)(frame), truth))
    assert errors[1] < 1.5 * errors[0]
    assert errors[0] < 0.1 * error(shapes(0, True)[0], truth)


def test_what_moves_by_half_a_pixel_blurs_to_both_sides():
    """Its motion resembles that of the ground, which was taken for it: nothing came of it beyond
    its silhouettes, where 0.1 of its light is."""
    y, x = np.mgrid[:40, :64] + 0.5
    wall = 0.2 + 0.05 * np.sin(1.3 * x)

    def at(t):
        left, right = 20 + 2.6 * t, 44 + 2.6 * t
        covered = np.clip(np.minimum(x + 0.5, right) - np.maximum(x - 0.5, left), 0, 1)
        covered = (covered * (abs(y - 20) < 12))[..., None]
        motion = np.where(covered >= 0.5, (-2.6, 0, 2.6, 0), 0)
        color = np.repeat(wall[..., None] * (1 - covered) + 0.9 * covered, 3, axis=2)
        depth = np.where(covered[..., 0] >= 0.5, 3.0, 6.0)
        return tuple(a.astype("f4") for a in (color, motion, depth))

    got = wgmb.Blur("gather", samples=16)(frame_of([at(0), at(-1), at(1)]))[20, :, 0]
    want = np.mean([at(t)[0] for t in np.linspace(-0.25, 0.25, 129)], axis=0)[20, :, 0]
    for beyond in (19, 44):
        share = (got[beyond] - wall[20, beyond]) / (want[beyond] - wall[20, beyond])
        assert 0.4 < share < 1.1


@pytest.mark.parametrize("length", [40, 200, 480])
def test_a_long_flight_leaves_a_whole_streak(length):
    """A block over still ground; at the ends of the exposure it is half of `length` px away."""
    y, x = np.mgrid[:24, :800] + 0.5

    def at(t):
        block = (abs(x - 400 - length * t) < 20) & (abs(y - 12) < 8)
        motion = np.zeros((24, 800, 4), "f4")
        motion[block] = (-length, 0, length, 0)
        color = np.where(block[..., None], 1.0, 0.25).repeat(3, axis=2).astype("f4")
        return color, motion, np.where(block, 2.0, 9.0).astype("f4")

    frame = frame_of([at(0), at(-1), at(1)])
    got = wgmb.Blur("gather", shutter=360, samples=64)(frame)
    times = (np.arange(64) + 0.5) / 64 - 0.5
    want = np.mean([at(t)[0] for t in times], axis=0)
    assert got.sum() - 0.25 * got.size == pytest.approx(want.sum() - 0.25 * want.size, rel=1e-3)
    np.testing.assert_allclose(got, want, atol=0.75 * 3 / 64)


def test_confidence_tells_where_the_neighbours_were_needed(sources):
    frame = frame_of(sources)
    shown = wgmb.Blur("gather", show="confidence")(frame)
    accepted, others, residual, left = np.moveaxis(shown, 2, 0)
    assert accepted.min() > 0.9
    assert 0.002 < others.mean() < 0.2
    assert others[:8].max() < 0.01  # nothing is hidden up there
    assert residual.max() <= 1
    assert left.max() <= 1


def test_what_can_be_shown_is_told():
    with pytest.raises(wgmb.InputError, match="color, confidence"):
        wgmb.Blur("gather", show="depth")


def test_a_neighbour_that_lacks_what_the_method_needs_is_named(sources):
    blur = wgmb.Blur("gather", shutter=360)
    frame = frame_of(sources)
    inputs = blur.upload(frame)
    output = TexturePool(blur.device).view("picture", frame.size, blur.output)
    inputs["next"] = replace(inputs["next"], depth=None)
    with pytest.raises(wgmb.InputError, match=r"needs next\.depth"):
        blur.encode(blur.device.create_command_encoder(), output=output, **inputs)


@pytest.mark.parametrize("degrees", [180, 360])
@pytest.mark.parametrize("alone", [True, False])
def test_the_short_cut_of_plain_times_shows_the_same(degrees, alone):
    """Times so little jittered that they are the same, but that blocks do not share them."""
    frame = frame_of([crossing((96, 160), offset) for offset in (0, -1, 1)])
    if alone:
        frame = frame.between(None, None)
    short = wgmb.Blur("gather", shutter=degrees)(frame)
    long = wgmb.Blur("gather", shutter=degrees, jitter=1e-6)(frame)
    apart = np.abs(short - long).max(axis=2)
    assert (apart > 2e-3).mean() < 0.005
    assert apart.max() < 0.05


@pytest.mark.full
def test_textures_that_are_read_as_storage_show_the_same(sources, monkeypatch):
    """As lavapipe reads them, and as all other drivers do."""
    shown = []
    for as_storage in (True, False):
        monkeypatch.setattr(kernels, "reads_storage", lambda device, there=as_storage: there)
        monkeypatch.setattr(kernels, "_kernel", lru_cache(kernels._kernel.__wrapped__))
        shown.append(wgmb.Blur("gather", shutter=360, samples=5)(frame_of(sources)))
        made = kernels.kernel(gpu.open_device(), "methods/gather/search/cubic.wgsl").source.text
        assert ("<rgba32uint, read>" in made) == as_storage
    np.testing.assert_array_equal(*shown)


def test_a_software_adapter_takes_no_more_samples_than_its_loops_have_turns(sources, mixing):
    frame = frame_of(sources)
    some, most = (wgmb.Blur("gather", samples=n)(frame) for n in (128, 512))
    np.testing.assert_allclose(most, some, atol=2e-3 + mixing)
    if gpu.open_device().adapter_info["adapter_type"] == gpu.SOFTWARE:
        with pytest.raises(wgmb.InputError, match="1 to 512 samples without a GPU, got 513"):
            wgmb.Blur("gather", samples=513)


def flight(is_there, t, fine=4):
    """Something flies over a wall of one colour; vectors are of the middles of pixels."""
    height, width = 64, 120
    y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
    shape = is_there(x - 60 - 22 * t, y - 32)
    color = np.where(shape[..., None], [0.9, 0.5, 0.1], [0.2, 0.3, 0.4])
    color = color.reshape(height, fine, width, fine, 3).mean(axis=(1, 3)).astype("f4")
    middle = shape[fine // 2 :: fine, fine // 2 :: fine]
    motion = np.where(middle[..., None], [-22, 0, 22, 0], 0).astype("f4")
    return color, motion, np.where(middle, 2.0, 9.0).astype("f4")


def blurred(is_there):
    """Such a flight blurred, what is there, and confidence."""
    times = Shutter(360).sample_times(16)
    truth = np.mean([flight(is_there, t)[0] for t in times], axis=0)
    frame = frame_of([flight(is_there, t) for t in (0, -1, 1)])
    return *wgmb.Blur("gather", shutter=360).with_confidence(frame), truth


def test_what_all_frames_hide_is_like_what_is_around():
    """Bars, each of which is at its neighbour's place a frame later."""
    picture, told, truth = blurred(lambda x, y: (x % 22 < 16) & (abs(y) < 20))
    hidden = (told["accepted"] < 0.9)[14:50, 30:90]
    assert hidden.mean() > 0.2
    assert np.abs(picture - truth)[14:50, 30:90][hidden].max() < 0.06


def rolling(t):
    """A body behind a pole: it moves by 8 px a frame, what is seen of it by 20, as of a wheel."""
    x = np.arange(64) + 0.5 + np.zeros((24, 1))
    body = abs(x - 27 - 8 * t) < 7
    pole = abs(x - 32) < 4
    depth = np.where(pole, 2.0, np.where(body, 5.0, 9.0)).astype("f4")
    tone = np.where(pole, 0.0, np.where(body, 0.9, 0.2)).astype("f4")
    motion = np.zeros((24, 64, 4), "f4")
    motion[body & ~pole] = -20, 0, 20, 0
    return np.dstack([tone] * 3 + [np.ones_like(tone)]), motion, depth


def test_a_surface_goes_on_behind_something_nearer():
    """No frame shows the end of the body: it is not there yet when the pole hides what was seen."""
    times = SHUTTER.sample_times(64).astype(float)
    truth = np.mean([rolling(t)[0] for t in times], axis=0)[12, 24:28, 0]
    got = wgmb.Blur("gather")(frame_of([rolling(t) for t in (0, -1, 1)]))[12, 24:28, 0]
    assert abs(got - truth).max() < 0.1


def turning(t):
    """A card that turns by 30 degrees a frame about an axis in the picture, edge on at 0."""
    x = np.arange(64) - 31.5 + np.zeros((24, 1))
    turn = np.pi / 6
    half = max(12 * abs(np.sin(turn * t)), 0.75)
    card = abs(x) < half
    steps = [12 * abs(np.sin(turn * (t + k))) / half for k in (-1, 1)]
    motion = np.zeros((24, 64, 4), "f4")
    motion[..., 0] = np.where(card, (steps[0] - 1) * x, 0)
    motion[..., 2] = np.where(card, (steps[1] - 1) * x, 0)
    tone = np.where(card, 0.9, 0.2).astype("f4")
    depth = np.where(card, 5.0, 9.0).astype("f4")
    return np.dstack([tone] * 3 + [np.ones_like(tone)]), motion, depth


def test_what_is_seen_edge_on_is_not_as_wide_as_in_the_neighbours():
    """Neighbours made it twice as wide: the sum of errors along a row was 1.4."""
    times = Shutter(45).sample_times(64).astype(float)
    truth = np.mean([turning(t)[0] for t in times], axis=0)
    got = wgmb.Blur("gather", shutter=45)(frame_of([turning(t) for t in (0, -1, 1)]))
    assert abs(got - truth)[12, :, 0].sum() < 0.1


def pan(t):
    """A pattern that enters from the left and from above."""
    y, x = np.mgrid[:64, :96] + 0.5
    x, y = x - 24 * t, y - 9 * t
    slow, quick = np.sin(0.11 * x + 0.05 * y), np.sin(0.31 * y - 0.09 * x + 2 * np.sin(0.07 * x))
    color = np.stack([0.5 + 0.25 * slow + 0.2 * quick] * 3, axis=-1).astype("f4")
    motion = np.broadcast_to(np.array([-24, -9, 24, 9], "f4"), (*y.shape, 4))
    return color, motion, np.full(y.shape, 5, "f4")


@pytest.mark.parametrize("sides, most", [("next", 0.6), ("", 0.85), ("prev next", 0.25)])
def test_what_comes_over_the_border_is_like_the_border(sides, most):
    """At the ends of a shot no frame shows it; the frame's own pixels are no substitute."""
    frame = frame_of([pan(t) for t in (0, -1, 1)])
    frame = frame.between(*(getattr(frame, s) if s in sides else None for s in ("prev", "next")))
    got, told = wgmb.Blur("gather", samples=16).with_confidence(frame)
    truth = np.mean([pan(t)[0] for t in SHUTTER.sample_times(64)], axis=0)
    border = np.ones(truth.shape[:2], bool)
    border[3:-3, 7:-7] = False
    assert error(got[border], truth[border]) < most * error(frame.color[border], truth[border])
    np.testing.assert_allclose(got[~border], truth[~border], atol=0.01)
    assert told["left"][~border].max() == 0


def test_colours_tell_coverage_if_neither_alpha_nor_vectors_do():
    picture, told, truth = blurred(lambda x, y: x**2 + y**2 < 26**2)
    assert error(picture, truth) < 0.003
    assert told["disocclusion"].max() > 0.2


def hemmed(t):
    """A bright body with a dark hem, 9 px a frame, before a wall that is as dark beside the hem."""
    x = np.arange(64) + np.zeros((24, 1))
    is_whole = (abs(np.arange(24) - 11.5) < 3)[:, None]  # the hem fills its pixels in these rows
    left, right = 20.5 + 9 * t, np.where(is_whole, 44, 44.5) + 9 * t

    def share(low, high):
        return np.clip(np.minimum(x + 1, high) - np.maximum(x, low), 0, 1)

    body, hem = share(left, right - 1), share(right - 1, right)
    cover = body + hem
    tone = 0.9 * body + 0.3 * hem + np.where(abs(x - 45) < 5, 0.2, 0.7) * (1 - cover)
    motion = cover[..., None] * np.array([-9, 0, 9, 0], "f4")
    depth = np.where(cover >= 0.5, 5.0, 9.0).astype("f4")
    color = np.dstack([tone] * 3 + [np.ones_like(tone)])
    return color.astype("f4"), motion.astype("f4"), depth


def test_vectors_tell_that_a_hem_is_of_its_body():
    """Its colour is near the wall's: with a coverage of 0.14, the sum of errors was 0.11."""
    shutter = Shutter(360)
    times = shutter.sample_times(64).astype(float)
    truth = np.mean([hemmed(t)[0] for t in times], axis=0)
    got = wgmb.Blur("gather", shutter=shutter)(frame_of([hemmed(t) for t in (0, -1, 1)]))
    assert abs(got - truth)[12, 36:, 0].sum() < 0.09


def waves(t):
    """Bright waves that pass by at 3 px a frame, dark in between."""
    y, x = np.mgrid[:40, :80] + 0.5
    bright = 0.5 + 0.5 * np.cos(2 * np.pi * (x + 0.4 * y - 3 * t) / 10)
    color = np.repeat((0.01 + 0.99 * bright**2)[..., None], 3, axis=2).astype("f4")
    motion = np.broadcast_to(np.array([-3, 0, 3, 0], "f4"), (*color.shape[:2], 4))
    return color, motion, np.full(color.shape[:2], 5, "f4")


def test_dark_texture_beside_bright_stays_sharp():
    shutter = Shutter(120)
    truth = np.mean([waves(t)[0] for t in shutter.sample_times(64)], axis=0)
    picture = wgmb.Blur("gather", shutter=shutter)(frame_of([waves(t) for t in (0, -1, 1)]))
    inner = slice(8, -8), slice(8, -8)
    assert np.sqrt(np.mean((picture - truth)[inner] ** 2)) < 0.003


def test_no_dark_ring_is_beside_a_lamp():
    color = np.full((40, 80, 3), 0.01, "f4")
    color[14:26, 34:46] = 1000
    motion = np.broadcast_to(np.array([-1, -1, 1, 1], "f4"), (40, 80, 4))
    frame = wgmb.Frame(color, motion=motion, depth=np.full((40, 80), 5, "f4"))
    half_way = wgmb.Blur("gather", shutter=Shutter(360, "start"), samples=1)(frame)
    assert half_way.min() > 0.004


def test_what_comes_nearer_keeps_its_edges():
    """A neighbour shows a body nearer than the frame does, which is the same body still: 42 dB."""

    def shot(t):
        """A disk at the depth 4 - 0.8 t: colour, motion, depth."""
        fine, (height, width) = 4, (90, 100)
        y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
        u, v = x - width / 2, y - height / 2
        disk = np.hypot(u, v) < 20 / (1 - 0.2 * t)
        wall = 0.4 + 0.2 * np.sin(0.3 * x + 0.5 * y)
        color = np.where(disk, 0.9, wall)[..., None] * [1.0, 0.8, 0.6]
        color = color.reshape(height, fine, width, fine, 3).mean(axis=(1, 3)).astype("f4")
        grow = [(1 - 0.2 * t) / (1 - 0.2 * (t + side)) - 1 for side in (-1, 1)]
        vectors = np.stack([u * grow[0], v * grow[0], u * grow[1], v * grow[1]], axis=-1)
        middle = np.s_[2::fine, 2::fine]
        motion = np.where(disk[..., None], vectors, 0.0)[middle].astype("f4")
        return color, motion, np.where(disk, 4 - 0.8 * t, 9.0)[middle].astype("f4")

    truth = np.mean([shot(t)[0] for t in SHUTTER.sample_times(64).astype(float)], axis=0)
    got = wgmb.Blur("gather", shutter=SHUTTER, samples=16)(frame_of([shot(t) for t in (0, -1, 1)]))
    assert -20 * np.log10(error(got, truth)) > 48


def passing(t):
    """A striped bar that passes by at 60 px a frame, with filtered coverage and vectors."""
    x, middle = np.arange(240), 120.3 + 60 * t
    covered = np.minimum(x + 1, middle + 30) - np.maximum(x, middle - 30)
    covered = np.clip(covered, 0, 1) + np.zeros((24, 1))
    bar = 0.6 + 0.3 * np.sin((x + 0.5 - middle) * 2 * np.pi / 4)
    color = np.dstack([covered * bar + (1 - covered) * 0.2] * 3 + [np.ones_like(covered)])
    depth = np.where(covered >= 0.5, 2.0, 9.0)
    return (
        color.astype("f4"),
        (covered[..., None] * [-60, 0, 60, 0]).astype("f4"),
        depth.astype("f4"),
    )


def test_long_steps_leave_no_stairs():
    """Samples lie 3.75 px apart; each read at one place, the stripes stay: 0.043."""
    truth = np.mean([passing(t)[0] for t in Shutter(360).sample_times(512)], axis=0)
    frame = frame_of([passing(t) for t in (0, -1, 1)])
    got = wgmb.Blur("gather", samples=16, shutter=360)(frame)
    assert np.sqrt(np.mean((got - truth)[12, 60:180, :3] ** 2)) < 0.01


@pytest.mark.parametrize(("speed", "count"), [(5, 2), (31, 8)])
def test_auto_takes_a_sample_for_two_pixels_of_blur_and_is_as_close_to_the_truth(speed, count):
    """Each is read at two places of its way, so a streak has no steps."""
    wide = np.random.default_rng(0).random((48, 160), np.float32)
    wide = np.mean([np.roll(wide, k, axis=1) for k in range(-2, 3)], axis=0)
    wide = np.repeat(wide[..., None], 3, axis=2)
    colors = [wide[:, 32 - speed * n : 128 - speed * n] for n in (-1, 0, 1)]
    motion = np.full((48, 96, 2), (speed, 0.0), np.float32)
    depth = np.ones((48, 96), np.float32)
    prev, here, next = (wgmb.Frame(color, motion, depth=depth) for color in colors)
    whole = here.between(prev, next)
    auto, few, many = (wgmb.Blur("gather", samples=n)(whole) for n in ("auto", count, 64))
    middle = np.s_[4:-4, 34:-34]
    np.testing.assert_allclose(auto[middle], few[middle], atol=1e-6)
    assert np.abs(auto - many)[middle].mean() < 0.01
