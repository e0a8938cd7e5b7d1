"""The page's motion from blocks that match: as a slow version finds it, and as it is known."""

import numpy as np
import pytest

import wgmb
from twins import block_search as twin
from wgmb import gpu
from wgmb.gpu.textures import TexturePool

SIZE = 26, 19  # width, height


@pytest.fixture(scope="module")
def search():
    device = wgmb.gpu.open_device()
    images = TexturePool(device)

    def run(entry, size, first, second=None, found=None, other=None, reach=0):
        """One pass; arrays (height, width, 4) in and out."""
        kernel = gpu.kernel(device, "hosts/block_search.wgsl", REACH=reach)
        nothing = np.zeros((1, 1, 4), np.float32)
        given = {"first": first, "second": second, "found": found, "other": other}
        views = {
            name: images.upload(name, nothing if one is None else filled(one), "rgba32float")
            for name, one in given.items()
        }
        output = images.texture("output", size, "rgba32float")
        encoder = device.create_command_encoder()
        frame = gpu.FrameBindings.of_size(device, size)
        kernel.run(encoder, entry, frame, **views, output=output.create_view())
        return images.download(encoder, output).copy()

    return run


def filled(array):
    made = np.zeros((*array.shape[:2], 4), np.float32)
    made[..., : array.shape[2]] = array
    return made


def picture(by=(0, 0), size=SIZE):
    """Random squares of three pixels, moved."""
    tones = np.random.default_rng(1).random((size[1] // 3 + 2, size[0] // 3 + 2, 3), np.float32)
    return np.roll(tones.repeat(3, 0).repeat(3, 1), by[::-1], (0, 1))[: size[1], : size[0]]


def test_the_passes_are_those_of_the_twin(search):
    first, second = picture(), picture((3, -2))
    half = SIZE[0] // 2, SIZE[1] // 2
    small = [search("shrink", half, one)[..., :3] for one in (first, second)]
    for ours, one in zip(small, (first, second), strict=True):
        np.testing.assert_allclose(ours, twin.shrunk(one), atol=1e-6)
    coarse = search("search", half, *small, reach=2)
    part = coarse[:5, :7]
    slow = twin.searched(*small, reach=2, some=part.shape[:2])
    assert np.mean(np.abs(part[..., :2] - slow[..., :2]).max(2) < 1e-3) > 0.94  # ties
    np.testing.assert_allclose(part[..., 2], slow[..., 2], atol=1e-4)
    smooth = search("smooth_out", half, small[0], found=coarse)
    np.testing.assert_allclose(smooth[..., :2], twin.smoothed(coarse)[..., :2], atol=1e-5)
    fine = search("search", SIZE, first, second, smooth)
    slow = twin.searched(first, second, smooth, some=(4, 5))
    assert np.mean(np.abs(fine[:4, :5, 2] - slow[..., 2]) < 1e-4) > 0.97


def test_a_known_motion_is_found_and_spread(search):
    first, second = picture(), picture((3, -2))
    half = SIZE[0] // 2, SIZE[1] // 2
    small = [search("shrink", half, one)[..., :3] for one in (first, second)]
    coarse = search("smooth_out", half, small[0], found=search("search", half, *small, reach=2))
    fine = search("smooth_out", SIZE, first, found=search("search", SIZE, first, second, coarse))
    inner = np.s_[5:-5, 5:-5]
    assert np.median(np.abs(fine[inner][..., 0] - 3)) < 0.3
    assert np.median(np.abs(fine[inner][..., 1] + 2)) < 0.3
    motion = search("spread", (2 * SIZE[0], 2 * SIZE[1]), first, found=fine, other=-fine)
    straight = search("spread_straight", (2 * SIZE[0], 2 * SIZE[1]), first, found=fine)
    np.testing.assert_array_equal(straight, motion)
    assert np.median(np.abs(motion[10:-10, 10:-10] - [-6, 4, 6, -4])) < 0.6


def test_what_does_not_move_has_no_motion(search):
    still = picture()
    found = search("search", SIZE, still, still, np.zeros((1, 1, 4), np.float32))
    np.testing.assert_array_equal(found[..., :2], 0)
