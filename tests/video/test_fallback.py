"""Pictures in which dense inverse search loses something are blurred along a search's motion."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import make_frames as make
from wgmb import Blur, Flow, gpu
from wgmb.run.pictures import PictureBlur, steady
from wgmb.run.video import VideoRequest
from wgmb.settings import BlurSettings
from wgmb.settings.video import VideoSettings

pytest.importorskip("cv2")

from wgmb.flow.dis.better_match import BetterMatch

COUNT = 11


class Sideways:
    """A source of motion that leads 8 px to the right, and the pictures that it was asked for."""

    def __init__(self):
        self.asked = set()

    def reach(self, size):
        return 1

    def shot(self, load, depth=True):
        def found(number):
            here = load(number)
            if here is None:
                return None
            self.asked.add(number)
            motion = np.full((*here.shape[:2], 4), [-8, 0, 8, 0], np.float32)
            return motion, np.ones(here.shape[:2], np.float32)

        return found


def pictures():
    """A disc that creeps, but for three steps in the middle of the shot."""
    at = [0, 1, 2, 3, 4, 49, 94, 139, 140, 141, 142]
    for x in at:
        grey = next(make.disc_before_squares(1, -(x - 70) // 2))
        yield np.repeat(grey[..., None], 3, axis=2)


def blurred(run, methods):
    """All pictures, which `methods` blurred, as the report tells."""
    made = steady(run, Fraction(1), Fraction(1))
    shutter = run.request.shutter.make()
    results = list(PictureBlur(pictures(), made, shutter, "srgb", run.how))
    assert run.report(made.exposures, path=Path(), output="", frames=0, seconds=0).method == methods
    return results


def test_only_pictures_that_lose_something_and_those_beside_them_are_searched(device):
    settings = VideoSettings(flow="dis", flow_quality="fast")
    run = VideoRequest(video=settings).open(device)
    source, gather = Sideways(), Blur("gather", device=run.blur.device)
    mixed = blurred(replace(run, fallback=(gather, source)), "tap and gather")
    quick = blurred(run, "tap")
    searched = blurred(replace(run, blur=gather, motion=Sideways()), "gather")
    told = [n for n in range(COUNT) if (mixed[n] != quick[n]).any()]
    assert told and told == list(range(told[0], told[-1] + 1))
    assert 3 <= told[0] <= 5 and 5 <= told[-1] <= 8
    for n in range(COUNT):
        np.testing.assert_array_equal(mixed[n], (searched if n in told else quick)[n])
    assert source.asked <= set(range(told[0] - 1, told[-1] + 2))


def test_auto_has_a_fallback_without_a_gpu_alone(device):
    run = VideoRequest().open(device)
    is_slow = run.blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE
    assert (run.fallback is not None) == is_slow == ("is searched" in run.how)
    for flow in ("dis", "search", "none"):
        assert VideoRequest(video=VideoSettings(flow=flow)).open(device).fallback is None
    if run.fallback is None:
        return
    assert run.blur.method.name == "tap" and run.fallback[0].method.name == "gather"
    assert run.quicker.startswith("`flow=dis`")


@pytest.mark.parametrize("settings", [{"method": "tap"}, {"method": "gather"}, {"samples": 1000}])
def test_a_method_that_is_asked_for_blurs_searched_pictures_too(device, settings):
    run = VideoRequest(blur=BlurSettings(**settings)).open(device)
    if run.fallback is not None:
        assert run.fallback[0] is run.blur


@pytest.mark.parametrize("quality", ["best", "fast"])
def test_without_a_gpu_the_best_search_takes_dense_inverse_search_where_that_matches_better(
    device, quality, monkeypatch
):
    settings = VideoSettings(flow="search", flow_quality=quality)
    is_slow = device.adapter_info["adapter_type"] == gpu.SOFTWARE
    motion, how = settings.source(device)
    is_mixed = quality == "best" and is_slow
    assert type(motion) is (BetterMatch if is_mixed else Flow)
    assert ("dense inverse search" in how) == is_mixed
    if is_mixed:
        assert motion.reach((640, 360)) == 1 + Flow(quality="fast", device=device).reach((640, 360))
    monkeypatch.setattr("wgmb.settings.video.is_installed", lambda package: False)
    assert type(settings.source(device)[0]) is Flow and settings.source(device)[1] == "search"
