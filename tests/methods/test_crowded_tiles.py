"""Searches start from scattered pixels where more motions come than a tile lists."""

import numpy as np
import pytest

import wgmb
from images import frame_of
from wgmb import Shutter
from wheels import wheel


@pytest.mark.parametrize(("degrees", "least"), [(180, 43.5), (360, 41)])
def test_spokes_that_turn_far_are_found(degrees, least):
    """From the four motions of a tile alone: 42.2 and 35.9 dB."""
    frame = frame_of([wheel(t) for t in (0, -1, 1)])
    got = wgmb.Blur("gather", shutter=degrees, samples=16)(frame)
    times = Shutter(degrees).sample_times(64).astype(float)
    truth = np.mean([wheel(t)[0] for t in times], axis=0)
    assert -10 * np.log10(np.mean((got - truth) ** 2)) > least


def test_spokes_behind_a_post_are_those_of_the_neighbours():
    """From what the frame itself scatters: 26.0 dB."""
    look = {"spokes": 7, "post": 14}
    frame, off = frame_of([wheel(t, **look) for t in (0, -1, 1)]), []
    for t in (-0.4, -0.3, 0.3, 0.4):
        got = wgmb.Blur("gather", shutter=Shutter(1, phase=t), samples=1)(frame)
        off.append(np.square(got - wheel(t, **look)[0]).mean())
    assert -10 * np.log10(np.mean(off)) > 26.1
