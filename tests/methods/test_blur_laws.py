"""Laws that hold for every method that blurs frames: those of wgmb.testing, and of their inputs."""

import numpy as np
import pytest

import wgmb
from wgmb.testing import MethodLaws

IMAGE_METHODS = sorted(m for m, c in wgmb.METHODS.items() if "scene" not in c.needs)


class TestLaws(MethodLaws):
    @pytest.fixture(params=IMAGE_METHODS)
    def method(self, request):
        return request.param


def test_bad_pixels_are_counted(noise):
    color, motion = noise.copy(), np.full((48, 64, 2), (12, 0), "f4")
    color[3, 4] = np.nan
    color[5, 6, 1] = np.inf
    motion[7, 8, 0] = np.nan
    assert wgmb.Frame(color, motion).bad == {"color": 2, "to_next": 1}
