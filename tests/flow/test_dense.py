"""Dense inverse search on the GPU: its stages against twins, its laws, and what it takes."""

from itertools import pairwise

import numpy as np
import pytest
import wgpu

import wgmb
from twins import dense as twin
from wgmb.color.srgb import linear, to_display
from wgmb.errors import InputError
from wgmb.flow.dense import DenseInverseSearch
from wgmb.flow.dense.levels import STATE, sizes_of
from wgmb.lab.calls import counted
from wgmb.run.video import VideoRequest
from wgmb.settings import BlurSettings
from wgmb.settings.video import VideoSettings

WIDTH, HEIGHT, SIDE, SPEED = 336, 112, 40, 48
FIRST = 2  # so that the picture in the middle, 3, has the first layer of the pyramid


def soft(width, height, cell, seed):
    """(height, width, 3) soft cells, linear."""
    cells = np.random.default_rng(seed).uniform(
        0.05, 0.8, (height // cell + 3, width // cell + 3, 3)
    )
    y, x = np.arange(height) / cell, np.arange(width) / cell
    low_y, low_x = y.astype(int), x.astype(int)
    v, u = (3 * t**2 - 2 * t**3 for t in ((y - low_y)[:, None, None], (x - low_x)[:, None]))
    rows = [
        (1 - u) * cells[low_y + k][:, low_x] + u * cells[low_y + k][:, low_x + 1] for k in (0, 1)
    ]
    return ((1 - v) * rows[0] + v * rows[1]).astype("f4")


def crossing_at(x):
    """A body before a ground, `x` px right of the middle."""
    picture, body, left = soft(WIDTH, HEIGHT, 7, 1), soft(SIDE, SIDE, 8, 2), (WIDTH - SIDE) // 2 + x
    cut = slice(max(left, 0), max(min(left + SIDE, WIDTH), 0))
    picture[36 : 36 + SIDE, cut] = body[:, cut.start - left : cut.stop - left]
    return picture


def crossing(count=4):
    """Pictures of a body that crosses a ground, by their numbers from FIRST on."""
    return {FIRST + n: crossing_at(SPEED * (n - 1)) for n in range(count)}


class Found:
    """The stages of the picture in the middle of three."""

    def __init__(self, device):
        self.pictures = crossing(3)
        source = DenseInverseSearch(device=device)
        self.motion, self.depth = source.shot(self.pictures.get)(FIRST + 1)
        self.device, self.stages = device, source.pictures((WIDTH, HEIGHT)).stages
        full = [twin.grey(p) for p in self.pictures.values()]
        self.greys = {(WIDTH, HEIGHT): full}
        for larger, size in pairwise(self.stages.sizes):
            self.greys[size] = [twin.reduced(g, size) for g in self.greys[larger]]

    def texture(self, name, size, kind=STATE):
        texture = self.stages.images.texture(name, size, kind)
        return self.stages.images.download(self.device.create_command_encoder(), texture)


@pytest.fixture(scope="module")
def found(device):
    return Found(device)


def test_levels_are_at_most_twice_as_large_as_the_next():
    assert sizes_of((1920, 1080)) == [
        (1920, 1080), (1280, 720), (640, 360), (320, 180), (160, 90), (80, 45), (40, 22),
    ]  # fmt: skip
    assert sizes_of((640, 360))[1] == (320, 180) and sizes_of((7, 3)) == [(7, 3)]
    assert sizes_of((2000, 1)) == [(n, 1) for n in (2000, 1280, 640, 320, 160, 80, 40)]


def test_the_pyramid_is_of_means(found):
    for level, size in enumerate(found.stages.sizes):
        texture = found.stages.images.texture(f"level {level}", size, "r32float", 3)
        got = found.stages.images.download(found.device.create_command_encoder(), texture)
        want = found.greys[size][1]
        np.testing.assert_allclose(got[..., 0], want, atol=0.02)


def test_a_patch_goes_where_the_twin_leads_it(found):
    """Most to a thousandth of a pixel; a few begin elsewhere, as two starts are equally good."""
    rng, apart = np.random.default_rng(0), []
    for level in (1, 2):
        size = found.stages.sizes[level]
        prev, here, next = found.greys[size]
        columns, rows = (-(-n // 4) + 1 for n in size)
        ways = found.texture(f"patches {level}", (columns, 2 * rows))
        coarser = found.texture(f"dense {level + 1}", found.stages.sizes[level + 1])
        for _ in range(40):
            i, j, side = rng.integers(columns), rng.integers(rows), rng.integers(2)
            corner = 4 * i - 4, 4 * j - 4
            part = coarser[..., 2 * side : 2 * side + 2]
            want = twin.patch_way(here, (prev, next)[side], part, corner)
            apart.append(np.abs(ways[j + side * rows, i, :2] - want).max())
    assert np.mean(np.array(apart) < 0.01) > 0.9, np.sort(apart)[-15:]


def test_blocks_go_where_the_twin_finds_them(found):
    small = found.stages.sizes[2]
    assert small == (160, 53)
    ways = found.texture("ways", (40, 13))
    searched = np.argwhere(ways[..., 2] > 0)
    begin = found.texture("begin", small)[..., 2:].reshape(-1, 2)
    assert 10 < len(searched) < 300
    same = []
    for row, column in searched[:: max(1, len(searched) // 12)]:
        most = np.median(begin, axis=0)
        want = twin.block_way(*found.greys[small], (column, row), most)
        same.append(np.abs(ways[row, column, :2] - want).max() <= 1)
    assert np.mean(same) > 0.9


def test_a_state_is_raised_as_the_twin_raises_it(found):
    small, middle = found.stages.sizes[2], found.stages.sizes[1]
    state, got = found.texture("refined 0", small), found.texture("raised", middle)
    want = twin.raised(found.greys[small][1], found.greys[middle][1], state)
    assert np.mean(np.abs(got - want).max(axis=2) < 1e-3) > 0.99


def test_a_body_before_a_ground_is_found(found):
    """A translation of a seventh of the width, which dense inverse search alone loses."""
    left = (WIDTH - SIDE) // 2
    inside = np.s_[36 + 8 : 36 + SIDE - 8, left + 8 : left + SIDE - 8]
    assert np.abs(found.motion[inside] - [-SPEED, 0, SPEED, 0]).max() < 2
    dense = found.texture("dense 0", (WIDTH, HEIGHT))[inside]
    assert np.abs(dense[..., 2] - SPEED).mean() > 10
    far = np.s_[:, : left - SPEED - 24]
    assert np.abs(found.motion[far]).max() < 0.5
    assert found.depth[inside].max() < found.depth[far].min()


@pytest.mark.parametrize("pan", [0, 3])
@pytest.mark.parametrize("is_last", [False, True])
def test_ground_that_the_only_neighbour_hides_moves_like_all_else(device, pan, is_last):
    """A body hides it there, and nothing in that picture is like it."""
    wide, body, sign = soft(WIDTH + pan, HEIGHT, 9, 1), soft(SIDE, SIDE, 8, 2), 1 - 2 * is_last
    pictures, rows, left = {}, np.s_[36 : 36 + SIDE], (WIDTH - SIDE) // 2
    for n in (0, 1):
        first = pan * (1 - n if is_last else n)
        pictures[n * sign] = picture = wide[:, first : first + WIDTH].copy()
        picture[rows, left + SPEED * n * sign :][:, :SIDE] = body
    motion, _ = DenseInverseSearch(device=device).shot(pictures.get)(0)
    from_here = left + SPEED * sign
    hidden = motion[36 + 6 : 36 + SIDE - 6, from_here + 6 : from_here + SIDE - 6, 2]
    assert (np.abs(hidden + pan) < 1).mean() > 0.7
    inside = motion[36 + 10 : 36 + SIDE - 10, left + 10 : left + SIDE - 10]
    assert np.abs(inside - [-SPEED, 0, SPEED, 0]).max() < 2


@pytest.mark.parametrize("speeds", [(6, -5), (0, 0)])
def test_hardly_a_block_is_searched_in_a_dissolve(device, speeds):
    """Its light changes evenly, so places that fit neither neighbour fit the mean of both."""

    def picture(n):
        if not 0 <= n < 4:
            return None
        one, other = (
            to_display(soft(WIDTH + 40, HEIGHT, cell, cell)[:, 20 + v * n :][:, :WIDTH], 8)
            for cell, v in zip((9, 14), speeds, strict=True)
        )
        return linear(((1 - n / 4) * one + n / 4 * other).astype("f4") / 255)

    source = DenseInverseSearch(device=device)
    source.shot(picture)(2)
    stages, encoder = source.pictures((WIDTH, HEIGHT)).stages, device.create_command_encoder()
    ways = stages.images.download(encoder, stages.images.texture("ways", (40, 13), STATE))
    assert (ways[..., 2] > 0).mean() < 0.05  # half of all without this rule


@pytest.mark.parametrize(("x", "y"), [(0, 0), (-7, 3), (2.5, -1.5)])
def test_a_translation_is_found_to_a_tenth_of_a_pixel(device, x, y):
    """Also by half pixels: pictures are means of 2 x 2 of one that moves by whole ones."""
    wide = soft(480, 300, 11, 3)

    def picture(n):
        left, top = round(60 - 2 * x * n), round(40 - 2 * y * n)
        part = wide[top : top + 160, left : left + 240]
        return (part[::2, ::2] + part[1::2, ::2] + part[::2, 1::2] + part[1::2, 1::2]) / 4

    shot = DenseInverseSearch(device=device).shot(dict(enumerate(map(picture, range(3)))).get)
    for number in range(3):
        motion, _ = shot(number)
        inside = motion[16:-16, 16:-16]
        apart = np.abs(inside - [-x, -y, x, y]).max(axis=2)
        assert np.quantile(apart, 0.99) < 0.1, number
    first = shot(0)[0]
    np.testing.assert_array_equal(first[..., :2], -first[..., 2:])


def test_the_motion_of_a_picture_depends_on_its_neighbours_alone(device):
    pictures = crossing()
    source = DenseInverseSearch(device=device)
    whole = source.shot(pictures.get)
    wanted = {n: whole(n) for n in pictures}
    other, between = source.shot(pictures.get), source.shot(crossing(3).get)
    for n in (5, 2, 3, 3, 4):
        for one, two in zip(other(n), wanted[n], strict=True):
            np.testing.assert_array_equal(one, two)
    between(3)  # another shot of the same source
    np.testing.assert_array_equal(other(4)[0], wanted[4][0])
    part = {n: p for n, p in pictures.items() if 3 <= n <= 5}
    np.testing.assert_array_equal(source.shot(part.get)(4)[0], wanted[4][0])


def test_a_picture_is_one_submission_that_waits_for_nothing(device):
    """And no texture, view, buffer or bind group is made once the first pictures are done."""
    picture = device.create_texture(
        size=(192, 96, 1), format="rgba32float", usage=wgpu.TextureUsage.TEXTURE_BINDING
    )
    shot = DenseInverseSearch(device=device).shot(lambda n: picture if 0 <= n < 12 else None)
    for number in range(7):
        shot.textures(number)
    with counted() as counts:
        for number in range(7, 10):
            shot.textures(number)
    levels = len(sizes_of((192, 96)))
    assert levels == 4
    each = {"dispatches": 3 * levels + 13, "passes": 2, "encoders": 1, "submits": 1}
    assert counts == {kind: 3 * many for kind, many in each.items()}


def test_pictures_that_are_alone_or_of_another_size(device):
    alone = DenseInverseSearch(device=device).shot({4: soft(40, 24, 5, 0)}.get)
    assert alone(4) is None and alone(3) is None
    with pytest.raises(InputError, match="frame 1 is 30 x 24, others are 40 x 24"):
        DenseInverseSearch(device=device).shot({0: soft(40, 24, 5, 0), 1: soft(30, 24, 5, 0)}.get)(
            0
        )
    tiny = DenseInverseSearch(device=device).shot(dict.fromkeys(range(3), soft(5, 2, 3, 0)).get)
    np.testing.assert_allclose(tiny(1)[0], 0, atol=1e-3)


def test_it_is_the_default_of_videos_with_a_gpu(device, as_with_a_gpu):
    run = VideoRequest().open(device)
    assert isinstance(run.motion, DenseInverseSearch) and "on the GPU" in run.how
    assert run.at_edges is not None and run.at_edges.method.name == "gather"
    assert run.advice == "" and "flow=none" in run.quicker
    for settings in ({"flow": "search"}, {"flow_quality": "draft"}):
        run = VideoRequest(video=VideoSettings(**settings)).open(device)
        assert isinstance(run.motion, wgmb.Flow) and run.at_edges is None
    chosen = VideoRequest(blur=BlurSettings(method="tap")).open(device)
    assert isinstance(chosen.motion, DenseInverseSearch) and chosen.at_edges is None


def test_videos_are_blurred_along_it(device, as_with_a_gpu):
    """Its body is far nearer to its true blur than it is without."""
    pictures = [to_display(p, 8) for p in crossing(3).values()]
    blurred = list(wgmb.blur_pictures(pictures, shutter=180, device=device))[1].astype(float)
    half = SPEED // 4  # of the way while the shutter is open
    truth = np.mean([crossing_at(left) for left in range(-half, half + 1)], axis=0)
    rows, want = np.s_[36 + 10 : 36 + SIDE - 10], to_display(truth.astype("f4"), 8).astype(float)
    sharp = np.abs(pictures[1][rows] - want[rows]).mean()
    assert np.abs(blurred[rows] - want[rows]).mean() < sharp / 3
