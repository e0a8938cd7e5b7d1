"""Motion from depth and cameras against closed forms of a pinhole camera."""

import numpy as np
import pytest

import wgmb
from images import body, camera
from wgmb import (
    Camera,
    InputError,
    Reprojections,
    Shutter,
)
from wgmb.gpu_frame import velocity

SIZE = (40, 60)  # height, width: the lens of `camera` makes 1.7 half heights of distance 1
FOCAL = 1.7 * SIZE[0] / 2  # [px]


def motion(depth, here, prev=None, next_=None, ids=None, **options):
    frame = wgmb.Frame(
        np.zeros((*SIZE, 3), "f4"),
        depth=np.broadcast_to(np.asarray(depth, "f4"), SIZE),
        object_id=ids,
        camera=Reprojections(here, prev, next_, **options),
    )
    found = wgmb.Blur("tap").motion(frame)
    return found[..., :2], found[..., 2:]


def positions():
    """x to the right and y down from the middle [px]."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] + 0.5
    return x - SIZE[1] / 2, y - SIZE[0] / 2


STILL = camera((0, 0, 0))
PICTURE = np.random.default_rng(1).random((*SIZE, 3), "f4")


def test_a_still_camera_moves_nothing_to_the_bit():
    back, ahead = motion(7.0, STILL, STILL, STILL)
    assert not back.any()
    assert not ahead.any()


def test_translation_is_focal_length_times_way_over_depth():
    depth = np.linspace(2, 20, SIZE[1])[None, :]
    back, ahead = motion(depth, STILL, camera((-0.1, 0, 0)), camera((0.1, 0.2, 0)))
    np.testing.assert_allclose(back[..., 0], (FOCAL * 0.1 / depth).repeat(SIZE[0], 0), atol=1e-3)
    np.testing.assert_allclose(ahead[..., 0], (-FOCAL * 0.1 / depth).repeat(SIZE[0], 0), atol=1e-3)
    np.testing.assert_allclose(ahead[..., 1], (FOCAL * 0.2 / depth).repeat(SIZE[0], 0), atol=1e-3)


def test_dolly_scales_about_the_middle():
    x, y = positions()
    _, ahead = motion(8.0, STILL, None, camera((0, 0, -2)))
    np.testing.assert_allclose(ahead[..., 0], x * (8 / 6 - 1), atol=1e-3)
    np.testing.assert_allclose(ahead[..., 1], y * (8 / 6 - 1), atol=1e-3)


@pytest.mark.parametrize("depth", [3.0, np.inf])
def test_zoom_scales_alike_at_every_depth(depth):
    x, y = positions()
    _, ahead = motion(depth, STILL, None, camera((0, 0, 0), zoom=1.7 * 1.25))
    np.testing.assert_allclose(ahead, np.stack([x, y], 2) * 0.25, atol=1e-3)


@pytest.mark.parametrize("depth", [3.0, np.inf])
def test_roll_turns_about_the_middle(depth):
    """The camera rolls to the left (anticlockwise), the picture clockwise."""
    x, y = positions()
    _, ahead = motion(depth, STILL, None, camera((0, 0, 0), roll=0.1))
    cos, sin = np.cos(0.1), np.sin(0.1)
    np.testing.assert_allclose(ahead[..., 0], x * cos - y * sin - x, atol=1e-3)
    np.testing.assert_allclose(ahead[..., 1], x * sin + y * cos - y, atol=1e-3)


@pytest.mark.parametrize("depth", [4.0, 1e10, np.inf, np.nan, 0.0, -3.0])
def test_pan_moves_all_depths_and_the_sky_alike(depth):
    x, _ = positions()
    _, ahead = motion(depth, STILL, None, camera((0, 0, 0), yaw=0.05))
    want = FOCAL * np.tan(np.arctan(x / FOCAL) + 0.05) - x
    np.testing.assert_allclose(ahead[..., 0], want, atol=1e-3)


def test_the_sky_does_not_move_with_the_cameras_place():
    _, ahead = motion(np.inf, STILL, None, camera((5, 3, -2)))
    np.testing.assert_allclose(ahead, 0, atol=1e-4)


def test_behind_the_camera_in_one_frame_goes_on_as_in_the_other():
    back, ahead = motion(2.0, STILL, camera((0.1, 0, 0.5)), camera((0.1, 0, -5)))
    assert np.abs(back).max() > 1
    assert np.array_equal(ahead, -back)
    back, ahead = motion(2.0, STILL, camera((0, 0, -9)), camera((0, 0, -5)))
    assert not back.any()
    assert not ahead.any()


def test_one_neighbour_alone_means_a_straight_path():
    back, ahead = motion(5.0, STILL, None, camera((0.3, 0, 0)))
    assert np.array_equal(back, -ahead)


def test_orthographic_motion_does_not_depend_on_depth():
    still, moved = (camera((x, 0, 0), orthographic=True) for x in (0, 0.5))
    for depth in (2.0, 30.0):
        _, ahead = motion(depth, still, None, moved)
        np.testing.assert_allclose(ahead[..., 0], -0.5 * 0.2 * SIZE[1] / 2, atol=1e-3)
        np.testing.assert_allclose(ahead[..., 1], 0, atol=1e-4)


def test_bodies_move_by_their_matrices_and_unknown_ones_with_the_world():
    here = camera((0, 0, 0), bodies={2: body(0, 0)})
    there = camera((0, 0, 0), bodies={2: body(0.5, 0)})
    ids = np.zeros(SIZE, int)
    ids[:, 20:40] = 2
    ids[:, 40:] = 9
    _, ahead = motion(6.0, here, None, there, ids)
    np.testing.assert_allclose(ahead[:, 20:40, 0], FOCAL * 0.5 / 6, atol=1e-3)
    assert not ahead[:, :20].any()
    assert not ahead[:, 40:].any()


def test_indices_may_be_any_32_bit_numbers_and_there_may_be_many_bodies():
    rng = np.random.default_rng(3)
    drawn = rng.choice(2**32 - 2, SIZE[0] * SIZE[1], replace=False) + 1
    drawn[:2] = 1, 2**32 - 1
    known = drawn[: len(drawn) * 3 // 4]  # the others move with the world
    ways = dict(zip(known.tolist(), rng.uniform(-0.5, 0.5, len(known)), strict=True))
    here = camera((0, 0, 0), bodies={k: body(0, 0) for k in ways})
    there = camera((0, 0, 0), bodies={k: body(way, 0) for k, way in ways.items()})
    ids = rng.permutation(drawn).reshape(SIZE)
    _, ahead = motion(6.0, here, None, there, ids)
    want = [FOCAL * ways.get(k, 0.0) / 6 for k in ids.ravel().tolist()]
    np.testing.assert_allclose(ahead[..., 0].ravel(), want, atol=1e-3)


def test_a_cut_out_window_moves_like_its_part_of_the_whole():
    here, there = STILL, camera((0.1, 0.05, -0.4), roll=0.1)
    whole = motion(5.0, here, None, there)[1]
    frame = wgmb.Frame(
        np.zeros((10, 12, 3), "f4"),
        depth=np.full((10, 12), 5, "f4"),
        camera=Reprojections(here, None, there, window=(30, 7, SIZE[1], SIZE[0])),
    )
    part = wgmb.Blur("tap").motion(frame)[..., 2:]
    np.testing.assert_allclose(part, whole[7:17, 30:42], atol=1e-4)


def test_depth_buffer_values_do_as_well_as_distances():
    here, there = STILL, camera((0.2, 0, -0.3), yaw=0.03)
    z = np.linspace(2, 20, SIZE[1])
    clip = np.asarray(here.clip_from_world) @ np.stack([0 * z, 0 * z, -z, 1 + 0 * z])
    want = motion(z[None], here, None, there)[1]
    got = motion((clip[2] / clip[3])[None], here, None, there, depth_kind="clip")[1]
    np.testing.assert_allclose(got, want, atol=2e-3)


def given_vectors(value):
    return np.full((*SIZE, 2), value, "f4")


def test_vectors_come_before_the_camera_but_the_sky_follows_it():
    depth = np.full(SIZE, 5, "f4")
    depth[:, :10] = 1e10
    around = Reprojections(STILL, None, camera((0, 0, 0), yaw=0.05))
    frame = wgmb.Frame(np.zeros((*SIZE, 3), "f4"), given_vectors(3.0), depth=depth, camera=around)
    got = wgmb.Blur("tap").motion(frame)[..., 2:]
    np.testing.assert_array_equal(got[:, 10:], 3)
    want = motion(np.inf, STILL, None, camera((0, 0, 0), yaw=0.05))[1]
    np.testing.assert_allclose(got[:, :10], want[:, :10], atol=1e-4)


def test_object_motion_is_added_to_the_cameras():
    around = Reprojections(STILL, None, camera((0.1, 0, 0)))
    depth = np.full(SIZE, 5, "f4")
    frame = wgmb.Frame(np.zeros((*SIZE, 3), "f4"), given_vectors(3.0), depth=depth, camera=around,
                       object_motion=True)  # fmt: skip
    got = wgmb.Blur("tap").motion(frame)[..., 2:]
    want = motion(5.0, STILL, None, camera((0.1, 0, 0)))[1] + 3
    np.testing.assert_allclose(got, want, atol=1e-4)


@pytest.mark.parametrize(
    "here, options, word",
    [
        (Camera(np.zeros((4, 4))), {}, "invertible"),
        (STILL, {"depth_kind": "round"}, "planar"),
        (STILL, {"far": float("nan")}, "far"),
    ],
)
def test_senseless_cameras_are_named(here, options, word):
    with pytest.raises(InputError, match=word):
        Reprojections(here, STILL, **options)


def test_a_camera_without_neighbours_is_refused():
    with pytest.raises(InputError, match="neighbouring"):
        Reprojections(STILL)


@pytest.mark.parametrize("matrix", [np.eye(3), np.full((4, 4), np.nan)])
def test_a_matrix_must_be_finite_and_4_by_4(matrix):
    with pytest.raises(InputError, match="4 x 4"):
        Camera(matrix)


def test_the_longest_streak_is_limited_on_the_way_out_and_back():
    """6.25 px out and back within the exposure; its ends are in one place."""
    blur = wgmb.Blur("tap", max_blur=1.0)
    got = blur.motion(
        wgmb.Frame(PICTURE, given_vectors((100, 0)), to_prev=given_vectors((100, 0)))
    )[0, 0]
    assert got[2] == pytest.approx(16, rel=1e-4)


@pytest.mark.parametrize("phase", ["start", "centre", "end"])
def test_no_motion_is_too_large_to_be_limited(phase):
    forth = given_vectors((6, 2))
    forth[20, 30, 0] = 3e38
    blur = wgmb.Blur("tap", shutter=Shutter(180, phase), max_blur=5.0)
    got = blur.motion(wgmb.Frame(PICTURE, forth, to_prev=-forth))[20, 30]
    assert np.abs(got).max() <= 10


@pytest.mark.parametrize("kind, value", [("clip", np.nan), ("clip", np.inf), ("planar", 1e-39)])
def test_no_depth_makes_motion_bad(kind, value):
    depth = np.full(SIZE, 0.5, "f4")
    depth[20, 30] = value
    frame = wgmb.Frame(
        PICTURE, depth=depth, camera=Reprojections(STILL, STILL, STILL, depth_kind=kind)
    )
    assert np.isfinite(wgmb.Blur("tap").motion(frame)).all()
    assert np.array_equal(wgmb.Blur("tap")(frame), PICTURE)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["to_next", "to_prev", "scale"])
def test_bad_motion_stands_still(where, bad):
    inputs = {
        "to_next": given_vectors((6, 2)),
        "to_prev": given_vectors((-6, -2)),
        "scale": np.ones(SIZE, "f4"),
    }
    inputs[where][20, 30] = bad
    got = wgmb.Blur("tap").motion(wgmb.Frame(PICTURE, **inputs))
    assert not got[20, 30].any()
    assert np.isfinite(got).all()


@pytest.mark.parametrize("phase", ["start", "centre", "end"])
@pytest.mark.parametrize("degrees", [90, 360])
def test_the_limit_is_of_the_streak_while_the_shutter_is_open(degrees, phase):
    blur = wgmb.Blur("tap", shutter=Shutter(degrees, phase), max_blur=5.0)
    got = blur.motion(wgmb.Frame(PICTURE, given_vectors((400, 300))))[..., 2:]
    length = np.hypot(*got[0, 0]) * degrees / 360
    assert length == pytest.approx(5, rel=1e-5)


def test_the_limit_follows_a_bent_path_as_the_shutter_sees_it():
    """From 0 to 1 of this path are (20, 0) px, whatever it did before."""
    blur = wgmb.Blur("tap", shutter=Shutter(360, "start"), max_blur=5.0)
    got = blur.motion(wgmb.Frame(PICTURE, given_vectors((20, 0)), to_prev=given_vectors(0)))
    np.testing.assert_allclose(got[0, 0], (0, 0, 5, 0), atol=1e-4)


def test_bands_give_the_same_bits_as_the_whole(monkeypatch):
    rng = np.random.default_rng(5)
    ids = rng.integers(0, 4, SIZE)
    here, there = (camera((x, 0, 0), bodies={2: body(x, 0), 3: body(0, x)}) for x in (0.0, 0.3))
    depth = rng.uniform(2, 9, SIZE)
    whole = motion(depth, here, there, None, ids)
    monkeypatch.setattr(velocity, "_BAND", 7 * SIZE[1])
    np.testing.assert_array_equal(motion(depth, here, there, None, ids), whole)
    assert np.abs(whole).max() > 1
