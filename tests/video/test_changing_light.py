"""Light that changes from picture to picture changes evenly while the shutter is open."""

import numpy as np
import pytest

import wgmb
from wgmb import Shutter
from wgmb.gpu.textures import TexturePool
from wgmb.video.changing_light import ChangingLight, Surroundings, shares_of, step_of

SIZE = HEIGHT, WIDTH = 48, 70
STEP = 4


def texture(seed):
    """Waves of 9 to 30 px, linear."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    rng = np.random.default_rng(seed)
    waves = sum(
        np.sin(a * x + b * y + c)[..., None] * rng.uniform(0.5, 1, 3)
        for a, b, c in rng.uniform([0.2, -0.5, 0], [0.6, 0.5, 6], (4, 3))
    )
    return (0.3 + 0.07 * waves).astype(np.float32)


def changed(device, pictures, motion, shares, holdout=None, factors=(1.0, 1.0), parts=(1.0,)):
    """The middle one of three pictures, of which one may lack, with its changes."""
    images = TexturePool(device)

    def load(index):
        rgba = np.dstack([pictures[index], np.ones(pictures[index].shape[:2], np.float32)])
        return images.upload(f"picture {index}", rgba, "rgba32float").texture

    held = None if holdout is None else images.upload("holdout", holdout, "r32float")
    ways = images.upload("motion", motion, "rgba32float")
    indices = (0 if 0 in pictures else None, 1, 2 if 2 in pictures else None)
    around = Surroundings(indices, factors, ways, held)
    light = ChangingLight(device)
    encoder = device.create_command_encoder()
    for k, part in enumerate(parts):
        light.encode(encoder, load, around, shares, part, k == 0)
    height, width = pictures[1].shape[:2]
    output = images.texture("output", (width, height), "rgba32float")
    light.add(encoder, load(1).create_view(), output.create_view())
    return images.download(encoder, output)[..., :3]


def reduced(picture):
    """Twin of reduce.wgsl."""
    height, width = (-(-n // STEP) for n in picture.shape[:2])
    small = np.zeros((height, width, 3))
    for y, x in np.ndindex(height, width):
        block = picture[STEP * y : STEP * (y + 1), STEP * x : STEP * (x + 1)]
        small[y, x] = np.sqrt(block.reshape(-1, 3).mean(0))
    return small


def between(picture, x, y):
    height, width = picture.shape[:2]
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    left, top = int(x), int(y)
    right, low = min(left + 1, width - 1), min(top + 1, height - 1)
    s, t = x - left, y - top
    above = (1 - s) * picture[top, left] + s * picture[top, right]
    return (1 - t) * above + t * ((1 - s) * picture[low, left] + s * picture[low, right])


def toward(here, other, x, y, way):
    """Twin of change.wgsl's `toward`."""
    height, width = here.shape[:2]
    to = x + way[0], y + way[1]
    if not (0 <= to[0] <= width - 1 and 0 <= to[1] <= height - 1):
        return np.zeros(3), 1.0, 0.0
    around = [(dx, dy) for dy in range(-2, 3) for dx in range(-2, 3)]
    own = np.array(
        [here[np.clip(y + dy, 0, height - 1), np.clip(x + dx, 0, width - 1)] for dx, dy in around]
    )
    found = np.array([between(other, to[0] + dx, to[1] + dy) for dx, dy in around])
    a, b = own.mean(1), found.mean(1)
    shared = max(np.mean(a * b) - a.mean() * b.mean(), 0)
    unlike = 1 - shared**2 / ((a.var() + 1.5e-5) * (b.var() + 1.5e-5))
    far = np.abs((found - own).mean(0)).mean()
    near = np.exp(-((far / 0.1) ** 2))
    same = max(np.exp(-((unlike / 0.5) ** 4)), near)
    is_no_noise = 1 - np.exp(-((far / 0.0157) ** 2))
    return is_no_noise * (between(other, *to) ** 2 - here[y, x] ** 2), same, near


def resting(way, other):
    """Twin of change.wgsl's, of ways [px]."""
    on, back = (way - other) / 2, (way + other) / 2 / 3
    return np.exp(-min(np.square(way).sum(), np.square([on, back]).sum()) / 2)


def roots_to(light, near, shares):
    """Twin of the standing part of changed.wgsl: of a pixel, towards both neighbours."""
    root = np.sqrt(np.maximum(light, 0))
    changed = root.copy()
    for share, other in zip(shares, near, strict=True):
        apart = np.sqrt(other) - root
        changed += share * np.exp(-np.square(apart).mean() / 0.4**2) * apart
    return light + changed**2 - root**2


def held(holdout, x, y):
    """The most in the pixels that the change of small pixel (x, y) reaches."""
    reached = [max(STEP * k - STEP // 2, 0) for k in (x, y)]
    ends = [STEP * k + STEP // 2 + STEP for k in (x, y)]
    return holdout[reached[1] : ends[1], reached[0] : ends[0]].max()


@pytest.mark.parametrize("parts", [(1.0,), (0.25, 0.75)])
def test_the_passes_are_their_twin(device, mixing, parts):
    pictures = {k: gain * texture(1) for k, gain in enumerate((0.8, 1.0, 1.15))}
    pictures[2][:, 40:] = texture(2)[:, 40:]
    pictures[0][:20, 50:] = 3 * texture(5)[:20, 50:]
    rng = np.random.default_rng(3)
    motion = rng.uniform(-9, 9, (HEIGHT, WIDTH, 4)).astype(np.float32)
    motion[:, 30:60] /= 9
    holdout = 0.8 * (rng.random(SIZE) < 0.01).astype(np.float32)
    shares, factors = (0.1, 0.2), (1.25, 0.8)
    small = {k: reduced(picture) for k, picture in pictures.items()}
    height, width = small[1].shape[:2]
    changes, standing = np.zeros((height, width, 3)), np.zeros((height, width, 2))
    for y, x in np.ndindex(height, width):
        px = min(STEP * y + STEP // 2, HEIGHT - 1), min(STEP * x + STEP // 2, WIDTH - 1)
        ways = [motion[px][2 * k : 2 * k + 2] / factors[k] for k in (0, 1)]
        ends = [toward(small[1], small[2 * k], x, y, ways[k] / STEP) for k in (0, 1)]
        lost = (1 - ends[0][1]) * (1 - ends[1][1])
        free = 1 - held(holdout, x, y)
        for k, (gained, same, near) in enumerate(ends):
            stands = near * resting(ways[k], ways[1 - k]) * (len(parts) == 1)
            changes[y, x] += free * shares[k] * (1 - stands) * (same + lost) * gained
            standing[y, x, k] = free * shares[k] * stands
    expected = pictures[1].astype(np.float64)
    for y, x in np.ndindex(HEIGHT, WIDTH):
        at = (np.array([x, y]) + 0.5) / STEP - 0.5
        expected[y, x] += between(changes, *np.maximum(at, 0))
        near = pictures[0][y, x], pictures[2][y, x]
        expected[y, x] = roots_to(expected[y, x], near, between(standing, *np.maximum(at, 0)))
    got = changed(device, pictures, motion, shares, holdout, factors, parts)
    assert np.abs(changes).max() > 0.01
    assert (standing.max() > 0.05) == (len(parts) == 1)
    np.testing.assert_allclose(got, expected, atol=2e-5 + 0.3 * mixing)


@pytest.mark.parametrize(
    "size, step", [((70, 48), 4), ((960, 540), 4), ((1080, 1920), 8), ((3840, 2160), 16)]
)
def test_small_pictures_are_of_like_size(size, step):
    assert step_of(size) == step


def test_a_fade_is_even(device):
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pictures = {0: 0.85 * texture(1), 1: texture(1), 2: 1.25 * texture(1)}
    got = changed(device, pictures, motion, (0.0625, 0.0625))
    even = 0.875 * pictures[1] + 0.0625 * (pictures[0] + pictures[2])
    both = sum(0.0625 * np.abs(pictures[k] - pictures[1]).mean() for k in (0, 2))
    assert np.abs(got - even).mean() < 0.1 * both
    pictures.pop(0)
    one = changed(device, pictures, motion, (0.0625, 0.0625))
    assert (one.mean() - pictures[1].mean()) > 0.003  # from the next picture alone


def test_what_glare_covers_fades(device):
    """The same waves behind much more light, about 70 levels of 255 apart."""
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    here, other = 0.02 + texture(1) / 2, 0.3 + texture(1) / 2
    apart = np.abs(np.sqrt(other) - np.sqrt(here)).mean()
    assert 60 / 255 < apart < 80 / 255
    got = changed(device, {0: other, 1: here, 2: here}, motion, (0.0625, 0.0625))
    fade = 0.0625 * (other - here)
    assert ((got - here) * fade).sum() / (fade * fade).sum() > 0.9


def test_what_is_unlike_but_little_apart_fades(device):
    """Other waves, about 20 levels of 255 apart, in patches that no light explains."""
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    here, other = 0.15 + texture(1) / 2, 0.2 + texture(5) / 2
    got = changed(device, {0: other, 1: here, 2: other}, motion, (0.0625, 0.0625))
    fade = 0.125 * (other - here)
    assert ((got - here) * fade).sum() / (fade * fade).sum() > 0.5


def noisy(seed):
    """Waves with noise of about a level of 255."""
    noise = np.random.default_rng(seed).normal(0, 0.004, (HEIGHT, WIDTH, 3))
    return texture(1) + noise.astype(np.float32)


def share_taken(got, pictures):
    """Share of an even fade to both neighbours of a picture that was added to it."""
    fade = 0.0625 * (pictures[0] + pictures[2] - 2 * pictures[1])
    return ((got - pictures[1]) * fade).sum() / (fade * fade).sum()


@pytest.mark.parametrize("found, least", [(0.3, 0.8), (1.5, 0.6)])
def test_noise_is_averaged_where_a_picture_stands(device, found, least):
    """Also where motion is found in it, there and back."""
    pictures = {k: noisy(k) for k in range(3)}
    motion = np.full((HEIGHT, WIDTH, 4), found, np.float32)
    assert share_taken(changed(device, pictures, motion, (0.0625, 0.0625)), pictures) > least
    parts = changed(device, pictures, motion, (0.0625, 0.0625), parts=(0.5, 0.5))
    assert share_taken(parts, pictures) < 0.1  # these are averaged as they are


@pytest.mark.parametrize("speed", [2, 6])
def test_a_pan_is_not_averaged(device, speed):
    motion = np.full((HEIGHT, WIDTH, 4), speed, np.float32) * [-1, -1, 1, 1]
    moving = {k: np.roll(noisy(k), speed * (k - 1), (0, 1)) for k in range(3)}
    got = changed(device, moving, motion.astype(np.float32), (0.0625, 0.0625))
    assert share_taken(got, moving) < 0.1


def test_what_is_the_same_before_and_after_keeps_its_bits(device):
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    here = noisy(1)
    got = changed(device, {0: here, 1: here, 2: here}, motion, (0.0625, 0.0625))
    np.testing.assert_array_equal(got, here)


def test_a_light_that_nobody_finds_leaves_no_trace(device):
    """A point that is elsewhere in each picture, whose motion is not known."""
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pictures = {k: np.full((HEIGHT, WIDTH, 3), 0.01, np.float32) for k in range(3)}
    for k in range(3):
        pictures[k][20, 10 + 25 * k] = 1
    got = changed(device, pictures, motion, (0.0625, 0.0625))
    for k in (0, 2):
        assert np.sqrt(got[20, 10 + 25 * k]).max() < 0.1 + 4 / 255


@pytest.mark.parametrize("other", ["something else", "another place"])
def test_what_is_no_change_of_light_leaves_the_picture(device, other):
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    here = texture(1)
    there = {
        "something else": texture(5) * 3,
        "another place": here * 1.4,
    }[other]
    if other == "another place":
        motion[..., :] = 500.0
    after = here if other == "something else" else there
    got = changed(device, {0: there, 1: here, 2: after}, motion, (0.0625, 0.0625))
    assert np.abs(got - here).mean() < 0.15 * 0.125 * np.abs(there - here).mean()


def test_what_neither_neighbour_shows_fades(device):
    """It is not there all the time, wherever it moves."""
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    here, there = texture(1), texture(5) * 3
    got = changed(device, {0: there, 1: here, 2: there}, motion, (0.0625, 0.0625))
    fade = 0.125 * (there - here)
    assert ((got - here) * fade).sum() / (fade * fade).sum() > 0.5
    one = changed(device, {0: there, 1: here}, motion, (0.0625, 0.0625))
    assert np.abs(one - here).mean() < 0.15 * np.abs(got - here).mean()


def test_what_is_held_out_keeps_its_light(device):
    """To the pixel, although changes are of small pixels."""
    motion = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    is_held = np.random.default_rng(1).random(SIZE) < 0.01
    pictures = {k: gain * texture(1) for k, gain in enumerate((0.7, 1.0, 1.5))}
    got = changed(device, pictures, motion, (0.0625, 0.0625), is_held.astype(np.float32))
    np.testing.assert_array_equal(got[is_held], pictures[1][is_held])
    assert not np.array_equal(got, pictures[1])


@pytest.mark.parametrize(
    "shutter, factors, shares",
    [
        (Shutter(180), (1, 1), (0.0625, 0.0625)),
        (Shutter(360), (1, 1), (0.125, 0.125)),
        (Shutter(180, phase="start"), (1, 1), (0, 0.25)),
        (Shutter(36, phase=0.3), (0.5, 2), (0, 0.6)),
        (Shutter(180, curve="triangle"), (1, 1), (1 / 24, 1 / 24)),
    ],
)
def test_shares_are_those_of_even_changes(shutter, factors, shares):
    np.testing.assert_allclose(shares_of(shutter, factors), shares, atol=1e-4)


def test_videos_have_it(device):
    """A picture that flares up between two: a sixteenth of the light of each neighbour."""
    pytest.importorskip("cv2")
    y, x = np.mgrid[:72, :96]
    waves = 0.3 + 0.1 * (np.sin(x / 4) * np.cos(y / 5))[..., None] * [1, 0.8, 0.6]
    pictures = [(gain * waves).astype(np.float32) for gain in (1, 1, 1.5, 1, 1)]
    made = list(wgmb.blur_pictures(pictures, transfer="linear", flow="dis", device=device))
    assert made[2].mean() == pytest.approx((0.875 * 1.5 + 0.125) * waves.mean(), rel=0.02)
    assert made[1].mean() == pytest.approx((0.9375 + 0.0625 * 1.5) * waves.mean(), rel=0.02)
    plain = list(
        wgmb.blur_pictures(pictures, transfer="linear", flow="dis", shutter=0, device=device)
    )
    np.testing.assert_allclose(plain[2], pictures[2], atol=1e-6)
