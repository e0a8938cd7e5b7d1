"""Motion that is ragged is smoothed; motion that is not keeps its bits."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from wgmb.flow.dis import Dis
from wgmb.gpu.textures import TexturePool
from wgmb.shots.reader import Picture, ShotReader
from wgmb.video.motion import VideoMotion
from wgmb.video.ragged import RaggedMotion

SIZE = HEIGHT, WIDTH = 40, 67
REACH, RADIUS = 4, 2


def smoothed(device, motion, depth=None, index=0):
    images = TexturePool(device)
    ways = images.upload("ways", motion, "rgba32float").texture
    far = None if depth is None else images.upload("far", depth, "r32float").texture
    made, made_depth = RaggedMotion(device)(index, ways, far)
    read = [images.download(device.create_command_encoder(), t) for t in (made, made_depth) if t]
    return (read[0], read[1][..., 0]) if depth is not None else read[0]


def near(image, x, y):
    height, width = image.shape[:2]
    return image[min(max(y, 0), height - 1), min(max(x, 0), width - 1)]


def there_and_back(motion, x, y, step):
    """Twin of measure.wgsl."""
    along = [near(motion, x + k * step[0], y + k * step[1]) for k in range(-RADIUS, RADIUS + 1)]
    changes = sum(np.abs(b - a) for a, b in pairwise(along))
    return float((changes - np.abs(along[-1] - along[0])).sum())


def twin(motion, depth):
    """Twin of smooth.wgsl; also how far each pixel is from the limit, relative to it."""
    motion, depth = motion.astype(np.float64), depth.astype(np.float64)
    rows, columns = np.zeros(SIZE), np.zeros(SIZE)
    for y, x in np.ndindex(SIZE):
        rows[y, x] = there_and_back(motion, x, y, (1, 0))
        columns[y, x] = there_and_back(motion, x, y, (0, 1))
    made, made_depth, ragged = motion.copy(), depth.copy(), np.zeros(SIZE)
    for y, x in np.ndindex(SIZE):
        inside = range(-RADIUS, RADIUS + 1)
        across = sum(near(rows, x, y + k) for k in inside)
        down = sum(near(columns, x + k, y) for k in inside)
        ragged[y, x] = min(across, down) / 60
        if ragged[y, x] > 1:
            reach = range(-REACH, REACH + 1)
            around = [(x + i, y + j) for j in reach for i in reach]
            made[y, x] = np.mean([near(motion, *at) for at in around], axis=0)
            made_depth[y, x] = np.mean([near(depth, *at) for at in around])
    return made, made_depth, ragged


def flat():
    """Ground that zooms, and depth."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    ways = 0.2 * np.stack([20 - x, 9 - y, x - 20, y - 9], axis=-1)
    return ways, np.ones(SIZE, np.float32)


def test_the_passes_are_their_twin(device):
    motion, depth = flat()
    rng = np.random.default_rng(1)
    motion[8:20, 30:] += rng.uniform(-60, 60, (12, WIDTH - 30, 4)).astype(np.float32)
    motion[24:, :9] += rng.uniform(-5, 5, (HEIGHT - 24, 9, 4)).astype(np.float32)
    depth[8:20, 30:] = rng.random((12, WIDTH - 30), np.float32)
    want, want_depth, ragged = twin(motion, depth)
    assert np.abs(ragged - 1).min() > 1e-4
    got, got_depth = smoothed(device, motion, depth)
    np.testing.assert_allclose(got, want, atol=1e-4)
    np.testing.assert_allclose(got_depth, want_depth, atol=1e-6)
    assert 0.1 < (ragged > 1).mean() < 0.5
    np.testing.assert_array_equal(got[ragged < 1], motion[ragged < 1])
    np.testing.assert_array_equal(smoothed(device, motion), got)


def edge(motion, y, x):
    motion[:, 30:] += [120, -80, -120, 80]


def slanted_edge(motion, y, x):
    motion[x > y + 10] += [120, -80, -120, 80]


def corner(motion, y, x):
    motion[15:, 30:] += [120, -80, -120, 80]


def thin_line(motion, y, x):
    motion[:, 30:32] += [120, -80, -120, 80]


@pytest.mark.parametrize("changed", [edge, slanted_edge, corner, thin_line])
def test_edges_of_what_is_fast_keep_their_bits(device, changed):
    motion, depth = flat()
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    changed(motion, y, x)
    got, got_depth = smoothed(device, motion, depth)
    assert got.tobytes() == motion.tobytes() and got_depth.tobytes() == depth.tobytes()


class Speckled:
    """A source whose motion leads from pixel to pixel elsewhere in a rectangle."""

    def reach(self, size):
        return 1

    def shot(self, load, depth=True):
        return lambda number: (self.motion(number), np.ones(SIZE, np.float32) if depth else None)

    def motion(self, number):
        motion, _ = flat()
        rng = np.random.default_rng(number)
        motion[10:30, 20:50] += rng.uniform(-60, 60, (20, 30, 4)).astype(np.float32)
        return motion


def roughness(motion):
    """Mean change from a pixel to the next, in the middle of the rectangle [px]."""
    inner = motion[14:26, 24:46]
    return np.abs(np.diff(inner, axis=1)).mean() + np.abs(np.diff(inner, axis=0)).mean()


def motion_of(device, source, depth=True):
    """A VideoMotion by a source, and the textures of three pictures, all kept."""
    content = SimpleNamespace(grey=np.zeros(SIZE, np.uint8))
    shots = ShotReader(iter([Picture(n / 25, content, n) for n in range(5)]))
    shots.at(0.08, 4)
    motion = VideoMotion(source, shots, device, depth)
    return motion, {n: motion.textures(n) for n in (1, 2, 3)}


def down(device, texture):
    return TexturePool(device).download(device.create_command_encoder(), texture)


@pytest.mark.parametrize("depth", [True, False])
def test_the_motion_of_a_video_is_nowhere_ragged(device, depth):
    """As arrays, which the viewer takes, and as textures, which a blur takes."""
    source = Speckled()
    motion, kept = motion_of(device, source, depth)
    for n, (ways, far) in kept.items():
        found, found_depth = motion(n)
        np.testing.assert_array_equal(down(device, ways), found)
        assert (far is None) == (found_depth is None) == (not depth)
        plain = source.motion(n)
        assert roughness(found) < 0.2 * roughness(plain)
        np.testing.assert_array_equal(found[:4], plain[:4])


def test_dense_inverse_search_is_left_as_it_is(device, monkeypatch):
    """Its motion is smooth, and found quickly. Its depth is found when it is asked for."""
    pytest.importorskip("cv2")

    plain = Speckled().motion(0)
    monkeypatch.setattr(Dis, "motion", lambda self, pictures: plain)
    motion, kept = motion_of(device, Dis("fast"))
    for n, (ways, far) in kept.items():
        np.testing.assert_array_equal(down(device, ways), plain)
        found, depth = motion(n)
        np.testing.assert_array_equal(found, plain)
        assert far is None and depth.shape == SIZE
        np.testing.assert_array_equal(down(device, motion.depth(n))[..., 0], depth)
