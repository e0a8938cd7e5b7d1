"""Motion of pictures is a function of the pictures: asked for in any order, any number of times."""

import numpy as np
import pytest

import make_frames as make
from wgmb.settings.video import VideoSettings
from wgmb.shots.motion import ShotMotion

pytest.importorskip("cv2")


SOURCES = {
    "dis": {"flow": "dis"},
    "dis, fast": {"flow": "dis", "flow_quality": "fast"},
    "draft": {"flow": "search", "flow_quality": "draft"},
    "search, fast": {"flow": "search", "flow_quality": "fast"},
    "best": {"flow": "search"},
    "default": {},
}


LONG = "search, fast", "best"


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.full) if k in LONG else k for k in SOURCES]
)
def test_motion_is_the_same_in_any_order_and_any_number_of_times(kind, device, as_without_a_gpu):
    source, _ = VideoSettings(**SOURCES[kind]).source(device)
    pictures = {n: make.picture(n, (9.0, 3.0))[..., :3] for n in range(7)}
    motion = ShotMotion(source, pictures.get, lambda a, b: True)
    wanted = {n: motion(n) for n in pictures}
    rng = np.random.default_rng(0)
    order = [2, 1, 3, *rng.integers(0, 7, 8).tolist()]
    motion = ShotMotion(source, pictures.get, lambda a, b: True)
    for number in order:
        for one, other in zip(motion(number), wanted[number], strict=True):
            np.testing.assert_array_equal(one, other)
