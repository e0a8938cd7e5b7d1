"""Pictures that are searched at a smaller size: the kernels against their twins, and the whole."""

import numpy as np
import pytest
from test_flow import kit, random_states, read, shifted, states_texture

from twins import flow as twin
from wgmb import Flow
from wgmb.flow.pyramid import features
from wgmb.flow.raising import raised, reduced
from wgmb.flow.shot import EFFORTS

SIZES = [((9, 13), (4, 6)), ((7, 16), (7, 5)), ((5, 4), (1, 1))]


def on_gpu(name, picture):
    rgba = np.dstack([picture, np.ones(picture.shape[:2], "f4")])
    return kit().images.upload(name, rgba, "rgba32float")


@pytest.mark.parametrize("size, less", SIZES)
def test_a_reduced_picture_is_the_mean_over_areas(size, less, close):
    picture = shifted(size, 0, 0)
    picture[0, 0] = np.nan, 2, -1
    small, display = reduced(kit(), on_gpu("whole", picture), size[::-1], less[::-1])
    picture[0, 0] = 0
    close(read(small.texture)[..., :3], twin.reduced(picture, less), 1e-5)
    close(read(display)[..., :3] / 255, twin.features(picture)[..., :3], 0.6 / 255)


@pytest.mark.parametrize("size, less", SIZES)
def test_raised_states_are_those_of_the_likest_pixel(size, less, close):
    picture, states = shifted(size, 0, 0, longest=12.0), random_states(less)
    depth = np.random.default_rng(3).random(less).astype("f4")
    small, display = reduced(kit(), on_gpu("whole", picture), size[::-1], less[::-1])
    here = features(kit(), small, less[::-1])[0]
    deep = kit().images.upload("deep", depth, "r32float").texture
    got = raised(kit(), display, here, states_texture(states), deep)
    colors = read(display)[..., :3] / 255, read(here)[..., :3] / 255
    want = twin.raised(*colors, states, depth)
    close(read(got[0]), want[0], 1e-4)
    depths = kit().read(got[1])
    close(depths[..., 0], want[1], 1e-6)


@pytest.mark.parametrize("quality, size, searched", [
    ("draft", (640, 360), (440, 248)), ("draft", (1080, 1920), (248, 440)),
    ("draft", (440, 9), (440, 9)), ("draft", (4000, 1), (440, 1)), ("best", (9000, 90), (9000, 90)),
    ("fast", (1920, 1080), (1920, 1080)),
])  # fmt: skip
def test_sizes_that_are_searched(quality, size, searched):
    assert EFFORTS[quality].searched_size(size) == searched


@pytest.mark.full
def test_a_draft_follows_a_shift_and_a_thing_before_it():
    """All of a picture above the size of the search, and a disc before it; both to half a pixel."""
    size = (90, 600)
    y, x = np.mgrid[: size[0], : size[1]]

    def picture(n):
        ground, disc = shifted(size, 5.5 * n, 0), shifted(size, -9 * n, 0, seed=4)
        is_disc = np.hypot(x + 0.5 - 300 + 9 * n, y + 0.5 - 45) < 30
        return np.where(is_disc[..., None], disc, ground)

    motion, depth = Flow(quality="draft")(*(picture(n) for n in (-1, 0, 1)))
    assert motion.shape == (*size, 4) and depth.shape == size
    inside = np.hypot(x + 0.5 - 300, y + 0.5 - 45) < 26
    outside = (np.hypot(x + 0.5 - 300, y + 0.5 - 45) > 40) & (x > 20) & (x < 580)
    assert np.abs(motion[inside] - [9, 0, -9, 0]).mean() < 0.5
    assert np.abs(motion[outside] - [-5.5, 0, 5.5, 0]).mean() < 0.5
    assert depth[inside].mean() < depth[outside].mean()


def test_a_draft_of_a_picture_alone_stands_still():
    picture = shifted((4, 500), 0, 0)
    motion, depth = Flow(quality="draft")(None, picture, None)
    assert motion.shape == (4, 500, 4) and not motion.any() and depth.shape == (4, 500)
