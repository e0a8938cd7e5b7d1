"""Poses that are held, as in animation on twos: the jumps between them are no motion."""

import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb.sequence.clip import Clip
from wgmb.sequence.layers.passes import Passes
from wgmb.shots.held_poses import without_jumps

PAN = 0.75  # of the camera [px a frame]
BODY = np.s_[12:30, 20:40]


def frame_at(places, shift=0.0):
    """A frame whose body was and will be at these places, in its neighbours too; all of it pans.

    `places`: at the five instants around, [px]. The body is where it is in the middle one.
    """

    def one(offset):
        before, here, after = places[offset + 1 : offset + 4]
        motion = np.tile(np.float32([-PAN, 0, PAN, 0]), (40, 120, 1))
        left = round(20 + here - places[2] + shift + PAN * offset)
        motion[12:30, left : left + 20] = before - here - PAN, 0, after - here + PAN, 0
        return wgmb.Frame(np.ones((40, 120, 3), "f4"), motion=motion)

    return one(0).between(one(-1), one(1))


@pytest.mark.fast
@pytest.mark.parametrize(
    ("places", "to_prev", "to_next"),
    [
        ((0, 0, 12, 12, 24), -PAN, PAN),  # on twos: the first frame of a pose, and the last
        ((0, 12, 12, 24, 24), -PAN, PAN),
        ((0, 0, -9, -9, -9), -PAN, PAN),  # on threes
        ((0, 0, 0, 9, 9), -PAN, PAN),
        ((0, 12, 24, 36, 48), -12 - PAN, 12 + PAN),  # steady motion, and motion that
        ((0, 0, 0, 12, 24), -PAN, 12 + PAN),  # begins,
        ((0, 12, 24, 24, 24), -12 - PAN, PAN),  # ends,
        ((0, 4, 12, 24, 40), -8 - PAN, 12 + PAN),  # gets faster
        ((0, 8, 14, 8, 0), -6 - PAN, -6 + PAN),  # or turns back
    ],
)
def test_jumps_alone_are_left_out(places, to_prev, to_next):
    frame = frame_at(places)
    motion = without_jumps(frame).motion
    np.testing.assert_allclose(motion[BODY], np.tile([to_prev, 0, to_next, 0], (18, 20, 1)))
    motion, given = motion.copy(), frame.motion.copy()
    motion[10:32, 18:42] = given[10:32, 18:42] = 0
    np.testing.assert_array_equal(motion, given)


@pytest.mark.fast
def test_vectors_alone_are_no_proof():
    """Without neighbours, motion that begins looks the same."""
    frame = frame_at((0, 0, 12, 12, 24)).between(None, None)
    assert without_jumps(frame) is frame


@pytest.fixture
def on_twos(tmp_path):
    """Frames 1 to 4 of a square that goes 24 px from pose to pose: 0, 0, 1, 1."""
    poses = np.array([0, 0, 0, 1, 1, 2]) * 2
    for number in range(1, 5):
        before, here, after = poses[number - 1 : number + 2]
        *_, inside = make._square(here, (6.0, 0.0))
        way = [
            inside[..., None] * np.float32([12.0 * 0.5 * (to - here), 0]) for to in (before, after)
        ]
        channels = make.frame(here, None, (6.0, 0.0))
        channels["ViewLayer.Depth.Z"] = channels.pop("Z")
        make.write_exr(tmp_path / f"f.{number:04d}.exr", channels | make.written("blender", *way))
    return tmp_path / "f.####.exr"


@pytest.mark.parametrize("method", ["gather", "reproject"])
def test_a_pose_that_is_held_is_as_sharp_as_its_frame(on_twos, method):
    clip = Clip(on_twos)
    blur = wgmb.Blur(method, samples=8, shutter=180)
    for number in (2, 3):
        frame = clip.with_neighbours(clip.source(number))
        got = blur(frame)
        np.testing.assert_allclose(got, frame.color, atol=0.01)
        np.testing.assert_array_equal(blur(clip[number]), got)
        smeared = Clip(on_twos, passes=Passes(twos="off"))
        assert abs(blur(smeared[number]) - got).max() > 0.05
    assert [on for text, on in clip.notes.items() if "held" in text] == [[2, 3]]


def test_info_tells_of_poses_that_are_held(on_twos, capsys):
    code, out, _ = make.inside(capsys, "info", str(on_twos))
    assert code == 0
    assert "held, as in animation on twos (at frames 2-3)" in out
    code, out, _ = make.inside(capsys, "info", str(on_twos), "--twos", "off")
    assert code == 0
    assert "held" not in out
