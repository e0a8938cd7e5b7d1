"""Frames on which a motion depends: as far as `reach` tells."""

from collections import Counter

import numpy as np
import pytest

from wgmb.flow import Flow
from wgmb.lab.calls import counted
from wgmb.sequence.flow_motion import FAR

HEIGHT, COUNT = 16, 24  # narrow bands: the number of levels depends on the longer side


def grey(width, number):
    """A picture of noise that moves by 2 px a frame, as display values."""
    noise = np.random.default_rng(1).integers(0, 256, (HEIGHT, width + 2 * COUNT), np.uint8)
    return np.ascontiguousarray(noise[:, 2 * number : 2 * number + width])


def farthest(source, width, light):
    """The distance from a frame of the pictures that are asked for."""
    asked = set()

    def load(number):
        asked.add(number)
        if not 0 <= number < COUNT:
            return None
        picture = grey(width, number)
        return np.repeat(picture[..., None] / np.float32(255), 3, axis=2) if light else picture

    assert source.shot(load)(COUNT // 2) is not None
    return max(abs(number - COUNT // 2) for number in asked)


@pytest.mark.parametrize("width", [160, 320, pytest.param(1920, marks=pytest.mark.full)])
def test_best_looks_farther_with_every_level(width):
    flow = Flow()
    assert farthest(flow, width, True) == flow.reach((width, HEIGHT))


def test_pictures_of_many_levels_are_measured_once():
    """And after the first frames no texture is made."""
    width, loaded = 960, Counter()
    flow = Flow(quality="fast")
    assert flow.reach((width, HEIGHT)) == 5

    def load(number):
        loaded[number] += 0 <= number < COUNT
        return grey(width, number)[..., None].repeat(3, 2) / np.float32(255)

    shot = flow.shot(load)
    for number in range(5, 12):
        with counted() as counts:
            assert shot.textures(number) is not None
    assert loaded.most_common(1)[0][1] == 1
    assert counts["textures"] == 0


def test_a_job_watches_as_many_files_as_motion_depends_on():
    assert Flow().reach((16384, 16384)) <= FAR


@pytest.mark.parametrize("quality", ["fast", "draft"])
@pytest.mark.parametrize("width", [320, pytest.param(1920, marks=pytest.mark.full)])
def test_quick_searches_do_not_look_farther_than_they_tell(quality, width):
    flow = Flow(quality=quality)
    assert farthest(flow, width, True) <= flow.reach((width, HEIGHT))


@pytest.mark.parametrize("by_place", [False, True])
def test_dense_inverse_search_does_not_look_farther_than_it_tells(by_place):
    pytest.importorskip("cv2")
    from wgmb.flow.dis import Dis
    from wgmb.flow.dis.by_place import ByPlace

    dis = ByPlace() if by_place else Dis("fast")
    assert farthest(dis, 160, False) == dis.reach((160, HEIGHT)) == 1
