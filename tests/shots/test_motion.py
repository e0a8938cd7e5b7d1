"""The motion of frames within their shots: what a source may look at, whatever was asked before."""

import itertools

import numpy as np
import pytest

import make_frames as make
from wgmb.sequence.clip import Clip
from wgmb.shots.motion import ShotMotion

pytestmark = pytest.mark.fast

REACH = 3


class Watcher:
    """A source of motion that tells what it could look at from each frame."""

    def __init__(self):
        self.seen: dict[int, list[int]] = {}
        self.shots = 0

    def reach(self, size):
        return 1

    def shot(self, load, depth=True):
        self.shots += 1

        def motion(number):
            near = range(number - REACH, number + REACH + 1)
            pictures = {n: picture for n in near if (picture := load(n)) is not None}
            self.seen[number] = list(pictures)
            here = pictures.get(number)
            if here is None or len(pictures) < 2:
                return None
            return np.zeros((*here.shape[:2], 4), "f4"), np.ones(here.shape[:2], "f4")

        return motion


@pytest.mark.parametrize("order", [*itertools.permutations((1, 4, 5))])
def test_a_frame_looks_at_its_own_shot_whatever_was_asked_before(order):
    """Shots of the frames 0 to 4 and 5 to 7."""
    watcher = Watcher()
    motion = ShotMotion(
        watcher,
        lambda n: np.full((2, 2, 3), n, "f4") if 0 <= n < 8 else None,
        lambda a, b: (a < 5) == (b < 5),
    )
    assert all(motion(number) is not None for number in order)
    assert watcher.seen == {1: [0, 1, 2, 3, 4], 4: [1, 2, 3, 4], 5: [5, 6, 7]}


def test_frames_of_one_shot_share_what_their_source_keeps():
    watcher = Watcher()
    motion = ShotMotion(watcher, lambda n: np.zeros((2, 2, 3)), lambda a, b: (a < 5) == (b < 5))
    for number in (1, 2, 3, 4, 5, 6, 2):
        motion(number)
    assert watcher.shots == 3


@pytest.mark.parametrize("order", [(1, 2, 3, 4, 5), (5, 3, 1, 4, 2)])
def test_pictures_of_another_data_window_are_of_another_shot(tmp_path, order):
    """They cannot be compared pixel by pixel; what was asked for first makes no difference.

    Frame 5 is alone: it is named, and stands (tests/sequence/test_alone.py).
    """
    for n in range(1, 6):
        left = 6 if n in (3, 4) else 8
        box = (left, 6, left + make.WIDTH - 1, 6 + make.HEIGHT - 1)
        channels = make.colors(make.picture(n))
        make.write_exr(tmp_path / f"a.{n}.exr", channels, data=box, display=(0, 0, 119, 89))
    clip, watcher = Clip(tmp_path / "a.#.exr"), Watcher()
    clip.move_by(watcher)
    has = {n: "motion" in clip.frame(clip.source(n)).has for n in order}
    assert watcher.seen == {1: [1, 2], 2: [1, 2], 3: [3, 4], 4: [3, 4], 5: [5]}
    assert all(has.values())
    assert [on for text, on in clip.notes.items() if "alone in a shot" in text] == [[5]]
