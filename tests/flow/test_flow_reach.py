"""Frames on which a motion depends: as far as `reach` tells."""

import numpy as np
import pytest

from wgmb.flow import Flow
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


def test_a_job_watches_as_many_files_as_motion_depends_on():
    flow, largest = Flow(), (16384, 16384)
    assert flow.reach(largest) <= FAR
    pytest.importorskip("cv2")
    from wgmb.flow.dis import Dis
    from wgmb.flow.dis.better_match import BetterMatch

    assert BetterMatch(Dis(), flow, by_ways=True).reach(largest) == FAR


@pytest.mark.parametrize("quality", ["fast", "draft"])
@pytest.mark.parametrize("width", [320, pytest.param(1920, marks=pytest.mark.full)])
def test_quick_searches_do_not_look_farther_than_they_tell(quality, width):
    flow = Flow(quality=quality)
    assert farthest(flow, width, True) <= flow.reach((width, HEIGHT))


def test_two_sources_whose_ways_are_compared_do_not_look_farther_than_they_tell():
    pytest.importorskip("cv2")
    from wgmb.flow.dis import Dis
    from wgmb.flow.dis.better_match import BetterMatch

    both = BetterMatch(Dis("best"), Flow(quality="fast", whole=True), by_ways=True)
    assert farthest(both, 160, True) <= both.reach((160, HEIGHT))


def test_dense_inverse_search_does_not_look_farther_than_it_tells():
    pytest.importorskip("cv2")
    from wgmb.flow.dis import Dis

    dis = Dis("fast")
    assert farthest(dis, 160, False) <= dis.reach((160, HEIGHT))
    asked = set()

    def load(number):
        asked.add(number)
        return grey(160, number)

    dis.shot(load).loses(10)
    assert max(abs(number - 10) for number in asked) <= dis.reach((160, HEIGHT))
