"""A reach of 2: what the frame and both neighbours hide is seen in the frames beyond them."""

import numpy as np
import pytest

import make_clips
import make_frames as make
from wgmb import (
    Blur,
    Clip,
    Frame,
    InputError,
    Shutter,
)
from wgmb.settings import BlurSettings

SIZE = (40, 112)
MIDDLE, STEP = 56, 12
BARS = (-STEP, 0, STEP)  # as far from one another as they move in a frame


def bars(offset, size=SIZE):
    """Three bars before a textured wall: colour, motion, depth. In the frame and both neighbours
    one of them stands in the middle, in those beyond none.
    """
    height, width = size
    y, x = np.mgrid[:height, :width].astype("f4")
    color, depth = make.texture(x, y), np.full(size, 9, "f4")
    motion = np.zeros((*size, 4), "f4")
    for bar in BARS:
        at = width // 2 + bar + STEP * offset
        there = (x >= at - 4) & (x < at + 4)
        color[there], depth[there], motion[there] = (0.9, 0.8, 0.1), 4, (-STEP, 0, STEP, 0)
    return color, motion, depth


def pan(offset, size=SIZE):
    """A textured wall that moves as a whole."""
    y, x = np.mgrid[: size[0], : size[1]].astype("f4")
    color = make.texture(x - 5 * offset, y + 2 * offset)
    return color, np.broadcast_to(np.float32([-5, 2, 5, -2]), (*size, 4)), np.full(size, 9, "f4")


def frame_at(shot, offsets=(-2, -1, 0, 1, 2), **options):
    """The frame of a shot, with as many to either side as `offsets` has."""
    shown = {o: shot(o) for o in offsets}
    made = {o: Frame(c, motion=m, depth=d, **options) for o, (c, m, d) in shown.items()}
    prev, after = made.get(-1), made.get(1)
    prev = prev and prev.between(made.get(-2), None)
    after = after and after.between(None, made.get(2))
    return made[0].between(prev, after)


def blurred(frame, reach, degrees=360, **options):
    return Blur("gather", shutter=degrees, samples=16, reach=reach, **options)(frame)


def truth(degrees=360):
    """The mean of many instants: of bars with hard edges, that of 16 is 38 dB from the limit, that
    of 256 is 62."""
    times = Shutter(degrees).sample_times(256)
    return np.mean([bars(float(t))[0] for t in times], axis=0)


def decibel(got, want):
    return -10 * np.log10(np.mean((got - want) ** 2))


def test_a_wall_that_three_frames_hide_is_seen_in_the_frames_beyond():
    want = truth()
    hidden = np.s_[4:-4, MIDDLE - 4 : MIDDLE + 4]
    near, far = (blurred(frame_at(bars), reach)[hidden] for reach in (1, 2))
    assert decibel(near, want[hidden]) < 30
    assert decibel(far, want[hidden]) > 55


def test_two_frames_to_one_side_are_enough():
    want, hidden = truth(), np.s_[4:-4, MIDDLE - 4 : MIDDLE + 4]
    for offsets in ((-2, -1, 0, 1), (-1, 0, 1, 2), (0, 1, 2)):
        got = blurred(frame_at(bars, offsets), 2)[hidden]
        assert decibel(got, want[hidden]) > 55, offsets


@pytest.mark.parametrize("degrees", [180, 360])
def test_where_nothing_is_hidden_and_paths_are_straight_it_changes_nothing(degrees):
    frame = frame_at(pan)
    np.testing.assert_allclose(
        blurred(frame, 2, degrees), blurred(frame, 1, degrees), atol=1e-4, rtol=0
    )


@pytest.mark.parametrize("shot", [bars, pan])
def test_a_reach_of_one_does_not_look_beyond_the_neighbours(shot):
    assert np.array_equal(blurred(frame_at(shot), 1), blurred(frame_at(shot, (-1, 0, 1)), 1))


@pytest.mark.parametrize("offsets", [(0,), (0, 1), (-1, 0), (-1, 0, 1)])
def test_without_frames_beyond_it_is_a_reach_of_one(offsets):
    frame = frame_at(bars, offsets)
    assert np.array_equal(blurred(frame, 2), blurred(frame, 1))


@pytest.mark.full
def test_what_is_held_out_in_the_frames_beyond_leaves_no_trace():
    plain, masked = frame_at(bars), frame_at(bars, holdout=np.zeros(SIZE, "f4"))
    np.testing.assert_allclose(blurred(masked, 2), blurred(plain, 2), atol=1e-5)
    red = np.broadcast_to(np.float32([9, 0, 0]), (*SIZE, 3))
    brightest = {}
    for held in (0, 1):
        mask = np.full(SIZE, held, "f4")
        far = [Frame(red, motion=bars(o)[1], depth=bars(o)[2], holdout=mask) for o in (-2, 2)]
        near = plain.prev.between(far[0], None), plain.next.between(None, far[1])
        brightest[held] = blurred(plain.between(*near), 2).max()
    assert brightest[0] > 2
    assert brightest[1] <= 1


def test_confidence_counts_what_the_frames_beyond_gave():
    got = {}
    for reach in (1, 2):
        blur = Blur("gather", shutter=360, samples=16, reach=reach, shading="off")
        _, planes = blur.with_confidence(frame_at(bars))
        got[reach] = planes["disocclusion"][10:-10, MIDDLE - 2 : MIDDLE + 2].mean()
    assert got[2] > got[1] + 0.2


@pytest.mark.parametrize("reach", [0, 3, 1.5])
def test_other_reaches_are_refused(reach):
    with pytest.raises(InputError, match="reach must be 1 to 2"):
        Blur("gather", reach=reach)


@pytest.mark.parametrize("method", ["reproject", "tap", "tiles"])
def test_methods_that_do_not_take_it_say_so(method):
    with pytest.raises(InputError, match="has no option reach"):
        Blur(method, reach=2)


# ---- sequences ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Frames 1 to 6, the bars in the middle of the third."""
    folder = tmp_path_factory.mktemp("bars")
    for n in range(1, 7):
        color, motion, depth = bars(n - 3)
        channels = make.colors(color, kind=np.float32) | {"Z": depth}
        channels |= make.written("nuke", motion[..., :2], motion[..., 2:])
        make.write_exr(folder / f"b.{n:04d}.exr", channels)
    return str(folder / "b.####.exr")


def test_a_sequence_is_its_frames_alone(shot, tmp_path, capsys):
    options = "--method", "gather", "--shutter", 360, "--reach", 2
    for name, frames in (("all", "1-6"), ("one", "3"), ("two", "5,2")):
        pattern = tmp_path / name / "o.####.exr"
        code, _, err = make.inside(
            capsys, "blur", shot, "-o", pattern, "--frames", frames, *options
        )
        assert code == 0, err
    for name, n in (("one", 3), ("two", 5), ("two", 2)):
        file = f"o.{n:04d}.exr"
        assert (tmp_path / name / file).read_bytes() == (tmp_path / "all" / file).read_bytes()
    got = make.plain_read(tmp_path / "all" / "o.0003.exr")
    clip = Clip(shot)
    want = Blur("gather", shutter=360, reach=2)(clip.with_neighbours(clip.source(3), reach=2))
    assert np.array_equal(got["R"], want[..., 0])
    hidden = np.s_[4:-4, MIDDLE - 4 : MIDDLE + 4]
    assert decibel(want[hidden][..., :3], truth()[hidden]) > 38


def beside(frame):
    """Number of frames read before and after."""
    counts = []
    for side in ("prev", "next"):
        count, one = 0, getattr(frame, side)
        while one is not None:
            count, one = count + 1, getattr(one, side)
        counts.append(count)
    return tuple(counts)


def test_the_ends_and_cuts_of_a_shot_have_fewer_frames_beside_them(shot):
    clip = Clip(shot)
    found = [beside(clip.with_neighbours(clip.source(n), reach=2)) for n in clip.numbers]
    assert found == [(0, 2), (1, 2), (2, 2), (2, 2), (2, 1), (2, 0)]
    clip = Clip(shot, cuts="only:4")
    found = [beside(clip.with_neighbours(clip.source(n), reach=2)) for n in clip.numbers]
    assert found == [(0, 2), (1, 1), (2, 0), (0, 2), (1, 1), (2, 0)]


def test_a_clip_keeps_five_files_and_makes_every_frame_once(shot):
    clip, made = Clip(shot), {}
    for n in clip.numbers:
        frame = clip.with_neighbours(clip.source(n), reach=2)
        made.setdefault(n, frame.color)
        after = frame.next
        while after is not None:
            assert made.setdefault(after.number, after.color) is after.color
            after = after.next
        assert len(clip.cache._kept) <= 5


def test_a_result_depends_on_the_files_of_five_frames(shot, tmp_path, capsys):
    clip = Clip(shot)
    names = [name for name, *_ in clip.made_of(3, 2)["files"]]
    assert sorted(names) == [f"b.{n:04d}.exr" for n in range(1, 6)]
    for n in range(1, 7):
        source = clip.dependencies.of(n)[0]
        (tmp_path / source.name).write_bytes(source.read_bytes())
    command = "blur", tmp_path / "b.####.exr", "-o", tmp_path / "o.####.exr", "--reach", 2
    make.inside(capsys, *command)
    before = {n: (tmp_path / f"o.{n:04d}.exr").stat().st_mtime_ns for n in range(1, 7)}
    (tmp_path / "b.0006.exr").touch()
    make.inside(capsys, *command, "--resume")
    again = [n for n in before if (tmp_path / f"o.{n:04d}.exr").stat().st_mtime_ns != before[n]]
    assert again == [4, 5, 6]


def test_it_is_a_setting():
    made = BlurSettings(method="gather", reach=2).make(Shutter(180), None)
    assert made.method.reach == 2


def test_a_video_says_that_it_takes_one(tmp_path, capsys):
    make_clips.write(tmp_path / "in.mkv")
    code, _, err = make.inside(
        capsys, "blur", tmp_path / "in.mkv", "-o", tmp_path / "o.mkv", "--method", "gather",
        "--reach", 2,
    )  # fmt: skip
    assert code == 2
    assert err.splitlines()[-1].endswith("a --reach of 2 is for rendered frames, a video takes 1")
