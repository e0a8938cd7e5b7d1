"""Camera cuts are found, and nothing else is taken for one."""

from dataclasses import replace

import numpy as np
import pytest

import wgmb
from images import camera
from make_frames import (
    HEIGHT,
    WIDTH,
    colors,
    frame,
    inside,
    motion,
    picture,
    projection,
    texture,
    write_exr,
    write_sequence,
    written,
)
from wgmb import (
    Camera,
    Clip,
    InputError,
    Passes,
    Reprojections,
    Vectors,
)
from wgmb.cli import app
from wgmb.color.srgb import linear
from wgmb.io import stills
from wgmb.shots.cuts import is_cut, jumps, pictures_differ
from wgmb.shots.prediction import predicted


@pytest.fixture
def two_shots(tmp_path):
    """Frames 1 to 3, then another shot of two."""
    pattern = write_sequence(tmp_path, [1, 2, 3])
    for n in (4, 5):
        channels = {k: v[::-1, ::-1].copy() for k, v in frame(n - 3).items()}
        write_exr(tmp_path / f"shot.{n:04d}.exr", channels)
    return pattern


def neighbours(clip, number):
    near = clip.with_neighbours(clip.source(number))
    return near.prev is not None, near.next is not None


def test_frames_beyond_a_cut_are_no_neighbours(two_shots):
    clip = Clip(two_shots)
    assert [neighbours(clip, n) for n in clip.numbers] == [
        (False, True), (True, True), (True, False), (False, True), (True, False),
    ]  # fmt: skip
    assert clip.cuts == {4}


def test_the_command_says_where_the_cut_is(two_shots, tmp_path, capsys):
    line = ("blur", two_shots, "-o", tmp_path / "out.####.exr", "--method", "reproject")
    code, out, err = inside(capsys, *line)
    assert code == 0
    assert "camera cut before frame 4" in out + err


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (4.0, 2.0), (-9.0, 5.0)])
def test_motion_is_no_cut(tmp_path, velocity):
    clip = Clip(write_sequence(tmp_path, [1, 2, 3], velocity=velocity))
    assert neighbours(clip, 2) == (True, True)
    assert not clip.cuts


def test_noise_is_no_cut(tmp_path):
    clip = Clip(write_sequence(tmp_path, [1, 2]))
    near = clip.with_neighbours(clip.source(1))
    rng = np.random.default_rng(0)
    noisy = [
        replace(f, color=(f.color + rng.normal(0, 0.15, f.color.shape)).astype("f4"), next=None)
        for f in (near, near.next)
    ]
    assert not is_cut(*noisy, 1)


def test_pictures_without_anything_in_them_are_no_cut():
    dark = wgmb.Frame(np.zeros((HEIGHT, WIDTH, 3), "f4"))
    assert not is_cut(dark, dark, 1)


@pytest.mark.parametrize("size", [(16, 1920), (120, 1920), (640, 24)])
def test_cuts_are_told_from_motion_in_bands(size):
    """The small copy of a band is not so low that nothing can be found again in it."""
    height, width = size
    cell = max(4, min(size) // 6)
    noise = np.random.default_rng(1).random((height // cell + 2, width // cell + 2, 3), np.float32)
    whole = noise.repeat(cell, axis=0).repeat(cell, axis=1)
    a, b = whole[:height, :width], whole[2 : height + 2, 4 : width + 4]
    assert not pictures_differ(a, b)
    assert pictures_differ(a, np.ascontiguousarray(whole[::-1, ::-1][:height, :width]))


def cells(side, seed=1):
    """(460, 740, 3) display values of random cells."""
    whole = np.random.default_rng(seed).random((-(-460 // side), -(-740 // side), 3), np.float32)
    return whole.repeat(side, axis=0).repeat(side, axis=1)[:460, :740]


def seen(whole, down=0, right=0):
    """The part of it before a camera, in linear light."""
    return linear(whole[50 + down : 410 + down, 50 + right : 690 + right])


@pytest.mark.parametrize("side", [3, 5, 8])
@pytest.mark.parametrize("way", [(3, 2), (-15, 9), (21, 33)])
def test_fine_texture_before_a_hand_held_camera_is_no_cut(side, way):
    here = seen(cells(side))
    assert not pictures_differ(here, seen(cells(side), *way))
    assert pictures_differ(here, seen(cells(side, seed=2), *way))


def test_rain_is_no_cut():
    def rain(picture, seed):
        wet, rng = picture.copy(), np.random.default_rng(seed)
        for y, x in zip(rng.integers(0, 420, 2200), rng.integers(0, 738, 2200), strict=True):
            wet[y : y + 40, x : x + 3] += 0.3 * (1 - wet[y : y + 40, x : x + 3])
        return seen(wet)

    ground = 0.05 + 0.8 * cells(5)
    for seed in range(1, 4):
        assert not pictures_differ(rain(ground, seed), rain(ground, seed + 1))
        assert pictures_differ(rain(ground, seed), rain(ground[::-1], seed + 1))


def test_the_share_predicted_is_by_place():
    """Half of a picture that is another one is not predicted, and nothing is where all is flat."""
    here, other = (cells(5, seed)[:96, :96].mean(axis=2) for seed in (1, 2))
    half = np.concatenate([here[:48], other[48:]])
    assert predicted(here, here, 9) > 0.95
    assert 0.4 < predicted(here, half, 9) < 0.65
    assert predicted(here, 0.5 * here + 0.3, 9) > 0.95  # of another brightness and contrast
    assert predicted(here, other, 9) < 0.2
    assert predicted(np.full_like(here, 0.5), here, 9) == 0


@pytest.mark.parametrize("side", [-1, 1])
def test_motion_across_a_cut_is_left_out(tmp_path, side):
    """A renderer writes where the next shot's camera would see it: far away."""
    given = np.zeros((2, HEIGHT, WIDTH, 2), "f4")
    given[:] = np.array([3, 1]) * np.array([-1, 1])[:, None, None, None]
    given[(side + 1) // 2] = (0.6 * WIDTH, -20)
    names = ("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")
    planes = np.moveaxis(given, 3, 1).reshape(4, HEIGHT, WIDTH)
    channels = frame(1, None) | {n: p.copy() for n, p in zip(names, planes, strict=True)}
    clip = Clip(write_exr(tmp_path / "shot.0007.exr", channels))
    found = clip.frame(clip.source(7)).motion
    np.testing.assert_allclose(found[5, 5], (-3, -1, 3, 1))
    assert clip.cuts == {7 if side < 0 else 8}


def test_a_camera_that_jumps_is_a_cut():
    here, near = camera((0, 0, 0)), camera((0.05, 0, 0))
    there = Camera(projection() @ np.linalg.inv(np.diag([-1.0, 1, -1, 1])))  # turned right round
    color, depth = np.ones((HEIGHT, WIDTH, 3), "f4"), np.full((HEIGHT, WIDTH), 5, "f4")
    jumping = wgmb.Frame(color, depth=depth, camera=Reprojections(here, near, camera((9, 0, 0))))
    assert jumps(jumping, 1)
    assert not jumps(jumping, -1)
    behind = wgmb.Frame(color, depth=depth, camera=Reprojections(here, near, there))
    assert jumps(behind, 1)
    assert is_cut(behind, jumping, 1)
    first = wgmb.Frame(color, depth=depth, camera=Reprojections(here, None, near))
    assert not jumps(first, -1)
    assert not jumps(first, 1)


@pytest.mark.parametrize("kind", ["planar", "clip"])
@pytest.mark.parametrize("orthographic", [False, True])
def test_displacement_is_what_the_gpu_finds(kind, orthographic):
    ways = [camera((0.1 * k, 0.05 * k, -0.2 * k), 0.02 * k, orthographic=orthographic)
            for k in (-1, 0, 1)]  # fmt: skip
    depth = np.random.default_rng(0).uniform(0.3, 0.9, (20, 30)).astype("f4")
    if kind == "planar":
        depth *= 20
        depth[3, 4] = 1e10 if not orthographic else 20
    around = Reprojections(ways[1], ways[0], ways[2], kind, window=(3, 5, 40, 31))
    want = wgmb.Blur("tap").motion(
        wgmb.Frame(np.zeros((20, 30, 3), "f4"), depth=depth, camera=around)
    )
    y, x = np.mgrid[:20, :30].reshape(2, -1)
    for side, begin in ((-1, 0), (1, 2)):
        got = around.displacement((30, 20), x, y, depth[y, x], side)
        np.testing.assert_allclose(got, want[y, x, begin : begin + 2], atol=2e-3)


def test_cuts_that_are_known_are_kept_to_though_nothing_shows_them(tmp_path):
    clip = Clip(write_sequence(tmp_path, range(1, 5)), cuts="3")
    assert [neighbours(clip, n) for n in clip.numbers] == [
        (False, True), (True, False), (False, True), (True, False),
    ]  # fmt: skip
    assert clip.cuts == {3}
    before, after = clip.frame(clip.source(2)).motion, clip.frame(clip.source(3)).motion
    np.testing.assert_array_equal(before[..., 2:], -before[..., :2])
    np.testing.assert_array_equal(after[..., :2], -after[..., 2:])


@pytest.mark.parametrize("method", ["tap", "gather"])
def test_a_shot_of_one_frame_stays_sharp(tmp_path, method):
    pattern = write_sequence(tmp_path, range(1, 4))
    out = tmp_path / "out.####.png"
    line = ("blur", pattern, "-o", out, "--method", method, "--cuts", "2,3", "--bits", "16")
    assert app.main([str(word) for word in line]) == 0
    clip = Clip(pattern, cuts="2-3")
    got = stills.read(tmp_path / "out.0002.png")
    np.testing.assert_allclose(got, clip.source(2).rgba, atol=2e-4)
    assert np.abs(stills.read(tmp_path / "out.0001.png") - clip.source(1).rgba).max() > 0.02


@pytest.mark.parametrize("cuts", ["x", "1-", "0.5"])
def test_senseless_cuts_are_refused(tmp_path, cuts):
    with pytest.raises(InputError, match=r"cuts .*whole numbers"):
        Clip(write_sequence(tmp_path, [1, 2]), cuts=cuts)


# ---- no cut where vectors fail, or light changes everywhere ---------------------------------


def lit(n, velocity=(4.0, 2.0)):
    """A frame under light that is another one everywhere, and its passes."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype("f4")
    light = np.clip(texture(x + 31 * n, y - 17 * n, 3.0 * n), 0.05, None)
    albedo = picture(n, velocity)[..., :3]
    made = {"DiffCol": albedo, "DiffDir": light, "Combined": albedo * light}
    channels = {f"ViewLayer.{layer}.{c}": image[..., i].astype("f4")
                for layer, image in made.items() for i, c in enumerate("RGB")}  # fmt: skip
    return channels | written("blender", *motion(n, velocity))


def test_light_that_moves_everywhere_is_no_cut_and_leaves_vectors_right(tmp_path):
    for n in (1, 2, 3):
        write_exr(tmp_path / f"s.{n:04d}.exr", lit(n))
    clip = Clip(tmp_path / "s.####.exr")
    assert "blender, tested" in clip.finding
    assert neighbours(clip, 2) == (True, True)
    assert not clip.cuts
    channels = {k: v[::-1, ::-1].copy() for k, v in lit(1).items()}
    write_exr(tmp_path / "s.0004.exr", channels)
    clip = Clip(tmp_path / "s.####.exr")
    assert neighbours(clip, 3) == (True, False)  # a real one is found under that light, too


@pytest.mark.parametrize("told", ["auto", "nuke"])
@pytest.mark.parametrize("damage", ["scaled", "random", "far"])
def test_vectors_that_are_wrong_are_no_cut(tmp_path, damage, told):
    """Neither those that fail their test nor those that nobody tests."""
    rng = np.random.default_rng(0)
    wrong = {"scaled": lambda v: v * 30, "random": lambda v: rng.uniform(-9, 9, v.shape),
             "far": lambda v: v * 0 + 40}[damage]  # fmt: skip
    for n in (1, 2, 3):
        vectors = written("nuke", *(wrong(v).astype("f4") for v in motion(n)))
        write_exr(tmp_path / f"s.{n:04d}.exr", frame(n, None) | vectors)
    clip = Clip(tmp_path / "s.####.exr", passes=Passes(vectors=Vectors(told)))
    assert neighbours(clip, 2) == (True, True)
    assert not clip.cuts


def test_what_crosses_emptiness_quickly_is_no_cut(tmp_path):
    """Most is empty before and after, and much of the rest is uncovered."""
    for n in (1, 2, 3):
        rgba = picture(n, (10.0, 3.0)) * motion(n, (10.0, 3.0))[1].any(axis=2)[..., None]
        write_exr(tmp_path / f"s.{n:04d}.exr", frame(n, "nuke", (10.0, 3.0)) | colors(rgba))
    clip = Clip(tmp_path / "s.####.exr")
    assert neighbours(clip, 2) == (True, True)
