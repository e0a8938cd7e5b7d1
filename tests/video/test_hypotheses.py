"""A picture whose motion may be one of several is the mean of the blurs along each."""

from dataclasses import replace

import numpy as np
import pytest

from wgmb import Blur, Shutter
from wgmb.color.coding import CodedPicture, Coding
from wgmb.gpu.textures import TexturePool
from wgmb.pipeline.exposure_sum import ExposureSum
from wgmb.shots.reader import Picture, ShotReader
from wgmb.video.gpu_frames import VideoFrames
from wgmb.video.motion import VideoMotion
from wgmb.video.thumbnail import Thumbnail

pytest.importorskip("cv2")

from wgmb.flow.dis.better_match import Hypothesis, MixedShot

LINEAR = Coding(model="rgb", bits=8, steps=(1, 1), full_range=True, matrix=0, transfer=8)
COUNT, HEIGHT, WIDTH = 5, 48, 64
FLAT = np.ones((HEIGHT, WIDTH), np.float32)
LEFT, RIGHT = (-6.0, 0.0), (9.0, 0.0)
SURE = dict.fromkeys(range(COUNT), (LEFT,))
IN_DOUBT = dict.fromkeys(range(COUNT), (LEFT, RIGHT))
IN_DOUBT_AT_TWO = SURE | {2: (LEFT, RIGHT)}


class Told(MixedShot):
    """A source of motion, and its shot, that knows what pictures may move by [px]."""

    def __init__(self, steps):
        self._steps = steps

    def reach(self, size):
        return 1

    def shot(self, load, depth=True):
        return self

    def __call__(self, number):
        return self._of(number)[0].motion

    def hypotheses(self, number):
        return self._of(number)

    def _of(self, number):
        shares = (0.75, 0.25) if len(self._steps[number]) == 2 else (1.0,)
        return [
            Hypothesis(share, (np.tile(np.float32([-x, -y, x, y]), (HEIGHT, WIDTH, 1)), FLAT))
            for share, (x, y) in zip(shares, self._steps[number], strict=True)
        ]


def shots():
    """Noise of 8 bits that pans."""
    rng = np.random.default_rng(1)
    wide = [rng.integers(0, 256, (HEIGHT, WIDTH + 3 * COUNT), np.uint8) for _ in range(3)]
    for n in range(COUNT):
        planes = tuple(np.ascontiguousarray(p[:, 3 * n : 3 * n + WIDTH]) for p in wide)
        yield Picture(float(n), Thumbnail(CodedPicture(planes, LINEAR)), n)


def parts(views, blur, cells):
    for cell in cells:
        for share, frame in views.in_shot(cell.index):
            yield replace(cell, share=share * cell.share), frame, blur


def blurred(device, method, steps, interval=1.0):
    """The pictures, and of how many parts each is."""
    blur, images = Blur(method, device=device), TexturePool(device)
    reader = ShotReader(shots())
    views, exposer, made, counts = (
        VideoFrames(reader, blur, Told(steps)),
        ExposureSum(device),
        [],
        [],
    )
    for n in range(COUNT):
        cells = reader.cells(float(n), interval, Shutter(180))
        found = list(parts(views, blur, cells))
        texture = exposer.texture((WIDTH, HEIGHT), found)
        made.append(images.download(device.create_command_encoder(), texture)[..., :3])
        counts.append(len(found))
    return np.array(made), counts


@pytest.mark.parametrize("method", ["gather", "tap"])
@pytest.mark.parametrize("interval, count", [(1.0, 2), (3.0, 6)])
def test_a_picture_is_the_mean_of_what_its_motions_make_of_it(device, method, interval, count):
    """Also in an exposure that several pictures share."""
    got, counts = blurred(device, method, IN_DOUBT, interval)
    left, right = (
        blurred(device, method, dict.fromkeys(SURE, (step,)), interval)[0] for step in (LEFT, RIGHT)
    )
    assert np.abs(left - right).mean() > 0.01 and counts[2] == count
    np.testing.assert_allclose(got, 0.75 * left + 0.25 * right, atol=1e-5)


def test_neighbours_that_are_sure_stand_beside_each_hypothesis(device):
    got, counts = blurred(device, "gather", IN_DOUBT_AT_TWO)
    left, right = (blurred(device, "gather", SURE | {2: (step,)})[0] for step in (LEFT, RIGHT))
    np.testing.assert_allclose(got, 0.75 * left + 0.25 * right, atol=1e-5)
    np.testing.assert_array_equal(got[[0, 4]], left[[0, 4]])
    assert counts == [1, 2, 2, 2, 1]
    assert blurred(device, "tap", IN_DOUBT_AT_TWO)[1] == [1, 1, 2, 1, 1]


class Viewed(Told):
    """A source whose other hypotheses nobody may ask for."""

    def hypotheses(self, number):
        raise AssertionError(number)


def test_where_one_motion_is_wanted_the_others_are_not_made(device):
    """As for the viewer, and for vectors."""
    reader = ShotReader(shots())
    reader.at(2.0, COUNT)
    motion, _ = VideoMotion(Viewed(IN_DOUBT_AT_TWO), reader, device)(2)
    assert (motion == [-LEFT[0], 0, LEFT[0], 0]).all()
