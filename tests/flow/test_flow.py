"""Motion of pictures without vectors: kernels that have closed forms, and known motion."""

from functools import cache

import numpy as np
import pytest

from textures import grid, shifted, texture
from twins import flow as twin
from wgmb import (
    Blur,
    Flow,
    Frame,
    InputError,
)
from wgmb.flow import homography as flow_homography
from wgmb.flow import passes as flow_passes
from wgmb.flow.dominant import follow_most
from wgmb.flow.homography import dominant_homography
from wgmb.flow.passes import STATES, FlowPasses
from wgmb.flow.pyramid import COARSER, features, level_sizes
from wgmb.flow.result import result
from wgmb.flow.shot import EFFORTS, Shot, matched
from wgmb.flow.sweeps import SweptLevel, sweep
from wgmb.flow.views import (
    AROUND,
    BESIDE,
    Views,
    views_of,
)

MIDDLE, FIRST = Views(1, 2, 0, AROUND), Views(0, 1, 2, BESIDE)
LARGE = pytest.mark.full


@cache
def kit():
    return FlowPasses(Flow().device)


def read(texture):
    """A texture of two layers, or one, as (height, width, channels)."""
    kit().submit()
    width, height, layers = texture.size
    kind, channels = ("u1", 4) if texture.format == "rgba8unorm" else ("f4", 4)
    planes = []
    for layer in range(layers):
        data = texture._device.queue.read_texture(
            {"texture": texture, "origin": (0, 0, layer)},
            {"bytes_per_row": width * channels * np.dtype(kind).itemsize, "rows_per_image": height},
            (width, height, 1),
        )
        planes.append(np.asarray(data).view(kind).reshape(height, width, channels))
    return np.concatenate(planes, axis=2)


def states_texture(states):
    """(height, width, 8) on the GPU."""
    height, width = states.shape[:2]
    kept = kit().device.create_texture(size=(width, height, 2), format="rgba32float", usage=31)
    for layer in (0, 1):
        kit().device.queue.write_texture(
            {"texture": kept, "origin": (0, 0, layer)},
            np.ascontiguousarray(states[..., 4 * layer :][..., :4], "f4"),
            {"bytes_per_row": 16 * width},
            (width, height, 1),
        )
    return kept


@cache
def small(size=(9, 13), bend=0.0):
    """Features of three small pictures that move, on the GPU and as numbers, by frame."""
    on_gpu, numbers = {}, {}
    for n in range(3):
        picture = shifted(size, 1.3 * n + bend * (n - 1) ** 2 / 2, -0.6 * n, longest=16.0)
        rgba = np.dstack([picture, np.ones(size, "f4")])
        view = kit().images.upload(f"small {n}", rgba, "rgba32float")
        on_gpu[n] = features(kit(), view, size[::-1])
        numbers[n] = read(on_gpu[n][0])[..., :7] / 255.0
    return on_gpu, numbers


def random_states(size=(9, 13), seed=0):
    rng = np.random.default_rng(seed)
    states = rng.normal(0, 0.05, (*size, 8))
    states[..., :2] += rng.normal([1.3, -0.6], 1, (*size, 2))
    return states.astype("f4").astype(float)


# ---- kernels --------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(9, 13), (1, 1), (4, 1)])
def test_features(size, close, mixing):
    picture = shifted(size, 0, 0)
    picture[0, 0] = np.nan
    rgba = np.dstack([picture, np.ones(size, "f4")])
    got = features(kit(), kit().images.upload("one", rgba, "rgba32float"), size[::-1])
    picture[0, 0] = 0
    assert len(got) == 1 + COARSER
    close(read(got[0])[..., :7] / 255.0, twin.features(picture), 0.51 / 255 + mixing)


def test_every_level_is_half_as_large(close, mixing):
    assert level_sizes((640, 360)) == [(640, 360), (320, 180), (160, 90)]
    assert level_sizes((3, 1)) == [(3, 1)]
    assert level_sizes((301, 3)) == [(301, 3), (151, 2)]
    picture = shifted((3, 301), 0, 0)
    rgba = np.dstack([picture, np.ones((3, 301), "f4")])
    got = features(kit(), kit().images.upload("two", rgba, "rgba32float"), (301, 3))
    close(read(got[1])[..., :7] / 255.0, twin.features(twin.halved(picture)), 0.51 / 255 + mixing)


def test_a_motion_of_most_that_does_not_bend_is_left_to_the_search():
    states, centres = states_texture(random_states()), np.array([[0, 0], [9, 0], [0, 9], [9, 9.0]])
    bound = matched(kit(), MIDDLE, small()[0], 0)
    for ways in (np.zeros((4, 4)), np.tile([1.3, -0.6, -1.3, 0.6], (4, 1))):
        assert follow_most(kit(), (13, 9), bound, MIDDLE, states, centres, ways)[0] is states


def test_a_sweep_takes_a_state_that_is_right_and_carried():
    """Nothing but the guess is right, and only the guess has what is left of the energy."""
    wrong = np.tile([-4.0, 4, 0, 0, 0, 0, 0, 0], (9, 13, 1))
    right = np.tile([1.3, -0.6, 0, 0, 0, 0, 0, 0], (9, 13, 1))
    bound = matched(kit(), MIDDLE, small()[0], 0)
    guesses = [states_texture(wrong), states_texture(right)]
    on = SweptLevel(0, (13, 9), bound, guesses, np.eye(3))
    got = read(sweep(kit(), on, states_texture(wrong), 1))
    assert np.abs(got[2:-2, 3:-3, :2] - [1.3, -0.6]).max() < 0.3


def test_states_grow_along_their_slopes(close):
    states = random_states((3, 4))
    output = kit().take((7, 5), STATES)
    kit().run("grow.wgsl", "main", (7, 5), states=states_texture(states), output=output)
    close(read(output), twin.grown(states, (5, 7)), 1e-5)


def test_motion_and_depth(close):
    states = random_states((9, 13), seed=5)
    states[2:7, 3:9, :2] += 40
    got = result(kit(), (13, 9), MIDDLE, states_texture(states))
    motion = np.concatenate([states[..., 2:4] - states[..., :2], states[..., :2]], axis=2)
    close(read(got.motion), motion, 1e-5)
    x, y = grid((9, 13))
    places = np.stack([x, y], axis=2).reshape(-1, 2)
    homographies = [
        dominant_homography(places, motion[..., k : k + 2].astype("f4").reshape(-1, 2), 13)
        for k in (0, 2)
    ]
    want = twin.depth(motion, *homographies)
    depth = kit().read(got.depth)[..., 0]
    close(depth, want, 1e-4)
    assert depth[4, 6] < 0.9 < depth[0, 0]


def test_the_homography_of_most_is_found_among_others():
    rng = np.random.default_rng(3)
    matrix = np.array([[1.02, 0.03, 4], [-0.02, 0.97, -6], [1e-5, -2e-5, 1]])
    points = rng.uniform(0, 600, (400, 2))
    moved = np.concatenate([points, np.ones((400, 1))], axis=1) @ matrix.T
    motion = moved[:, :2] / moved[:, 2:] - points
    motion[:150] += rng.uniform(-90, 90, (150, 2))
    found = dominant_homography(points, motion, 600)
    again = np.concatenate([points, np.ones((400, 1))], axis=1) @ found.T
    assert np.abs(again[:, :2] / again[:, 2:] - moved[:, :2] / moved[:, 2:]).max() < 0.5
    few = dominant_homography(points[:3], motion[:3], 600)
    assert (few == np.eye(3)).all()
    line = np.repeat(np.arange(40.0)[:, None], 2, axis=1)
    assert np.allclose(dominant_homography(line, 0 * line, 40), np.eye(3))


@pytest.mark.parametrize("astray", [0.0, 0.2, 0.6, 0.8])
def test_homographies_are_left_out_only_where_they_cannot_be_the_best(monkeypatch, astray):
    rng = np.random.default_rng(5)
    points = rng.uniform(0, 160, (700, 2))
    motion = points * (0.02, -0.05) + rng.normal(0, 0.3, (700, 2))
    lost = rng.random(700) < astray
    motion[lost] = rng.uniform(-30, 30, (lost.sum(), 2))
    found = dominant_homography(points, motion, 160, 0.5 / 160)
    monkeypatch.setattr(flow_homography, "PARTS", 1)
    assert np.allclose(found, dominant_homography(points, motion, 160, 0.5 / 160), atol=1e-9)


def test_a_frame_is_compared_with_those_around_it():
    there = {3, 4, 5, 9, 10}.__contains__
    assert views_of(4, there) == Views(4, 5, 3, AROUND)
    assert views_of(3, there) == Views(3, 4, 5, BESIDE)
    assert views_of(5, there) == Views(5, 4, 3, BESIDE)
    assert views_of(9, there) == Views(9, 10, None, BESIDE)
    assert views_of(7, there) is None


# ---- known motion ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "way"), [((40, 96), (12.3, -3.6)), pytest.param((44, 232), (37.3, -3.6), marks=LARGE)]
)
def test_a_shift_is_found(size, way):
    """Large on two levels, a tenth of a pixel where the picture stays, on both sides."""
    way = np.array(way)
    pictures = [shifted(size, *(n * way), waves=60) for n in (-1, 0, 1)]
    motion, _ = Flow()(*pictures)
    margin = int(way[0]) + 13
    inside = motion[8:-8, margin:-margin]
    assert np.abs(inside - [*-way, *way]).mean() < 0.1
    assert np.percentile(np.abs(inside - [*-way, *way]), 95) < 0.3


@pytest.mark.parametrize(
    ("before", "after", "width"), [(-5, 10, 112), pytest.param(3, 6, 232, marks=LARGE)]
)
def test_a_shift_that_grows_is_found(before, after, width):
    """5 px before, 10 px after, or a turning back: no constant velocity fits both sides."""
    ways = np.array([[before, 1], [0, 0], [after, 2]])
    motion, _ = Flow()(*[shifted((44, width), *way) for way in ways])
    error = np.abs(motion - [*ways[0], *ways[2]]).max(axis=2)[8:-8, 22:-22]
    assert error.mean() < 0.1


def test_bands_give_the_same_bits(monkeypatch):
    """Without a GPU, long passes are submitted in parts."""
    pictures = [shifted((21, 230), 4 * n, n * n / 4) for n in range(3)]
    found = []
    for most in (8, 200, 1 << 30):
        monkeypatch.setattr(flow_passes, "AT_ONCE", most)
        monkeypatch.setattr(flow_passes.gpu, "SOFTWARE", kit().device.adapter_info["adapter_type"])
        found.append(Flow(quality="fast")(*pictures))
    for motion, depth in found[1:]:
        assert (motion == found[0][0]).all()
        assert (depth == found[0][1]).all()


@pytest.mark.parametrize(
    ("turn", "zoom"), [(0.06, 1.03), pytest.param(np.radians(12), 1.0, marks=LARGE)]
)
def test_a_turning_and_zooming_texture_is_followed(turn, zoom):
    size = (48, 120)
    x, y = grid(size)
    x, y = x - 60, y - 24

    def seen(n):
        c, s, k = np.cos(turn * n), np.sin(turn * n), zoom**-n
        return texture(k * (c * x + s * y), k * (c * y - s * x))

    def way(n):
        c, s = zoom**n * np.cos(turn * n), zoom**n * np.sin(turn * n)
        return np.stack([c * x - s * y - x, s * x + c * y - y], axis=2)

    motion, _ = Flow()(seen(-1), seen(0), seen(1))
    want = np.concatenate([way(-1), way(1)], axis=2)
    ends = np.abs(np.stack([x, y, x, y], axis=2) + want)
    is_seen = (ends < [54, 18, 54, 18]).all(axis=2)
    assert is_seen.mean() > 0.4
    assert np.abs(motion - want)[is_seen].mean() < 0.1
    assert np.abs(motion - want).mean() < 0.1  # what leaves the picture goes on as the rest does


def test_what_is_hidden_on_one_side_follows_the_other():
    """A square moves over a wall that stands: beside it, the wall still stands."""
    size = (52, 80)
    x, y = grid(size)

    def seen(n):
        inside = (np.abs(x - 40 - 9 * n) < 14) & (np.abs(y - 26) < 14)
        return np.where(inside[..., None], texture(x - 9 * n, y, seed=5), texture(x, y, seed=6))

    motion, depth = Flow()(seen(-1), seen(0), seen(1))
    inside = (np.abs(x - 40) < 14) & (np.abs(y - 26) < 14)
    want = np.where(inside[..., None], [-9, 0, 9, 0], 0)
    error = np.abs(motion - want).max(axis=2)
    strip = (np.abs(np.abs(x - 40) - 18.5) < 4) & (np.abs(y - 26) < 12)
    assert (error < 0.5).mean() > 0.97
    assert (error[strip] < 0.5).mean() > 0.9
    assert depth[26, 40] < 0.97 < 0.999 < depth[5, 5]


@pytest.mark.parametrize(
    "size",
    [
        pytest.param((37, 53), marks=LARGE),
        (2, 3),
        pytest.param((1, 1), marks=LARGE),
        pytest.param((20, 230), marks=LARGE),
    ],
)
def test_a_still_picture_is_left_alone(size):
    rng = np.random.default_rng(size[1])
    picture = rng.random((*size, 3)).astype("f4")
    motion, depth = Flow()(picture, picture, picture)
    assert (motion == 0).all()
    assert (depth == 1).all()
    frame = Frame(picture, motion=motion, depth=depth)
    assert (Blur("gather")(frame.between(frame, frame)) == picture).all()


def test_one_neighbour_or_none():
    pictures = [shifted((48, 64), 5 * n, 2 * n) for n in range(3)]
    way = np.array([5, 2])
    for prev, after in ((None, pictures[2]), (pictures[0], None)):
        motion, _ = Flow()(prev, pictures[1], after)
        error = np.abs(motion - [*-way, *way])[8:-8, 8:-8]
        assert np.median(error) < 0.1
    motion, depth = Flow()(None, pictures[1], None)
    assert (motion == 0).all()
    assert (depth == 1).all()


def test_a_frame_of_a_shot_does_not_depend_on_what_was_asked_before():
    pictures = [shifted((9, 230), 4 * n, n * n / 4) for n in range(7)]

    def load(n):
        return pictures[n] if 0 <= n < 7 else None

    whole, alone = (Flow(quality="fast").shot(load) for _ in range(2))
    motions = [whole(n) for n in range(7)]
    for n in (5, 0, 3):
        got, want = alone(n), motions[n]
        assert got is not None
        assert want is not None
        assert (got[0] == want[0]).all()
        assert (got[1] == want[1]).all()
    assert whole(7) is None


def test_a_shot_keeps_no_more_than_it_needs():
    pictures = [shifted((24, 40), n, 0) for n in range(3)]
    shot = Shot(kit(), lambda n: pictures[n % 3], EFFORTS["fast"])
    counts = []
    for n in range(12):
        shot(n)
        counts.append(len(shot._results))
    assert max(counts[6:]) == counts[6] < 25


def test_wrong_pictures_are_named():
    picture = np.zeros((4, 6, 3), "f4")
    with pytest.raises(
        InputError, match=r"frame 0 must be \(height, width, 3 or 4\), got \(4, 6\)"
    ):
        Flow()(None, picture[..., 0], None)
    with pytest.raises(InputError, match="frame 1 is 6 x 3, others are 6 x 4"):
        Flow()(None, picture, picture[:3])
    with pytest.raises(InputError, match="frame 0 must be floating point, got uint8"):
        Flow()(None, picture.astype("u1"), None)
    with pytest.raises(InputError, match=r"no flow quality 'fat'.*did you mean 'fast'"):
        Flow(quality="fat")
