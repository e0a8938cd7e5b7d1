"""The time of videos in the viewer: from state to state, without a window."""

from fractions import Fraction

import numpy as np
import pytest

import make_clips as clips
from viewer_hand import put
from wgmb import InputError, Shutter
from wgmb.cli.app import main
from wgmb.cone import Cone
from wgmb.settings.video import VideoSettings
from wgmb.video.clock import Clock
from wgmb.video.output_times import OutputFrame, OutputFrames
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.timeline import Times
from wgmb.viewer import State, controls
from wgmb.viewer.draw.perception import seen_frames
from wgmb.viewer.panel.sections import at_pace, in_part
from wgmb.viewer.panel.widgets import shortened
from wgmb.viewer.state.state import video_time
from wgmb.viewer.state.video_time import described
from wgmb.viewer.subjects.video_exposure import ClockedTimes, exposure_of
from wgmb.viewer.subjects.video_motion import PictureFinding

pytestmark = pytest.mark.fast

UNEVEN = [Fraction(n, 48) for n in (0, 1, 2, 6, 7, 8, 9, 12, 13, 14)]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """24 pictures, 24 a second."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(24)]
    return clips.write(tmp_path_factory.mktemp("clip") / "a.mp4", frames)


@pytest.fixture(scope="module")
def uneven(tmp_path_factory):
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(10)]
    return clips.write(tmp_path_factory.mktemp("uneven") / "a.mp4", frames, UNEVEN)


@pytest.fixture
def state(clip):
    return State().opened(str(clip))


def test_slow_motion_has_more_output_frames_and_stays_where_it_is(state):
    assert state.span == (0, 23)
    at = put(state, frame=10.0)
    slow = at_pace(at, "0.4")
    assert slow.span == (0, 59) and slow.frame == 25
    assert at_pace(slow, "1") == at
    fast = video_time.at_rate(slow, "60000/1001")
    assert fast.span == (0, 149) and abs(fast.frame - 62.5) < 0.6
    assert video_time.rate(fast) == Fraction(60000, 1001)
    assert fast.arguments()["fps"] == "60000/1001" and fast.arguments()["speed"] == "0.4"
    with pytest.raises(InputError, match="`speed` must be"):
        at_pace(at, "fast")


def test_a_part_begins_with_its_own_first_output_frame(state):
    part = in_part(in_part(put(state, frame=12.0), "begin", "0.25"), "end", "0.75")
    assert part.span == (0, 11) and part.frame == 6
    assert video_time.output(part).clock.back(video_time.output_frame(part).time) == Fraction(1, 2)
    assert in_part(in_part(part, "end", ""), "begin", "") == put(state, frame=12.0)
    words = part.command("b.mp4")
    assert "--frames" not in words and words[words.index("--begin") + 1] == "0.25"
    assert State.of_toml(part.toml()) == part
    with pytest.raises(InputError, match="no pictures in this range"):
        in_part(state, "begin", "7")
    frames = video_time.in_frames(put(state, frame=12.0), "6-17")
    assert frames.span == (0, 11) and frames.frame == 6
    with pytest.raises(InputError, match="0 to 23"):
        video_time.in_frames(state, "6-30")
    with pytest.raises(InputError, match="choose either"):
        in_part(frames, "begin", "0.5")


def test_at_its_own_times_it_plays_as_unevenly_as_it_is(uneven):
    state = video_time.at_rate(State().opened(str(uneven)), "source")
    assert state.own_times and state.span == (0, 9)
    assert State.of_toml(state.toml()) == state and state.arguments()["fps"] == "source"
    for frame, seconds, want in [(0, 1 / 48, 1), (2, 2 / 48, 2.5), (0, 6 / 48, 3), (9, 0, 9)]:
        assert video_time.passed(put(state, frame=float(frame)), seconds) == pytest.approx(want)
    moments = video_time.output(state).frames
    found = [moments.nearest(moments[n].time + d) for n in range(10) for d in (0, Fraction(1, 99))]
    assert found[::2] == list(range(10)) and set(found) <= set(range(10))
    even = video_time.at_rate(put(state, frame=4.0), "48")
    assert not even.own_times and even.frame == 7


def test_playing_begins_anew_after_the_last_output_frame(state):
    slow = put(at_pace(state, "0.5"), frame=47.0)
    assert controls.played(slow, 1 / 24).frame == pytest.approx(0)
    assert controls.stepped(slow, 1).frame == 0 and controls.stepped(slow, -1).frame == 46
    layout = controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9))
    assert controls.key(slow, layout, "Home")[0].frame == 0
    assert controls.key(put(slow, frame=3.0), layout, "End")[0].frame == 47


def test_the_panel_says_which_output_frame_it_is_and_what_it_is_made_of(state):
    slow = put(at_pace(state, "0.5"), frame=9.0)
    assert described(slow, (4, 5)) == "output frame 9, 0.375 s: pictures 4 - 5"
    assert described(slow, (4,)) == "output frame 9, 0.375 s: picture 4"


@pytest.mark.parametrize("fps", [None, Fraction(30), Fraction(24000, 1001)])
@pytest.mark.parametrize("part", [{}, {"begin": "0.1"}, {"begin": "0.1", "end": "0.25"}])
def test_moments_are_all_there_and_ascend(uneven, fps, part):
    footage = VideoReader(uneven)
    clock = VideoSettings(speed="0.7", **part).clock(footage, None)
    found = OutputFrames(footage, clock, fps)
    times = [moment.time for moment in found]
    assert len(times) == len(found) and times == sorted(set(times))
    assert [found.nearest(time) for time in times] == [m.number for m in found]
    assert found[1:3] == list(found)[1:3] and found[-1] == list(found)[-1]
    assert clock.back(times[0]) in footage.times


def test_frames_that_are_perceived_begin_with_the_first_one(state):
    seen = seen_frames(put(state, look="perceived", frame=20.0))
    assert [one.frame for one in seen][:3] == [20, 19, 18]
    assert len(seen) / 24 > Cone().memory
    assert [one.frame for one in seen_frames(put(state, look="perceived", frame=2.0))] == [
        2, 1, 0,
    ]  # fmt: skip


# ---- what an output frame is made of --------------------------------------------------------


def shown_at(ticks):
    """Times on a clock of 48 ticks a second."""
    return Times(np.array(ticks), Fraction(1, 48))


def chain(numbers, cuts=(), without=()):
    """Knowledge of a video of these pictures; the others are left out."""

    def known(n):
        if n in without:
            return None
        before = max((k for k in numbers if k < n), default=None)
        after = min((k for k in numbers if k > n), default=None)
        if n not in numbers:
            return PictureFinding(None, None, before, after, is_left_out=True)
        begins, ends = before is None or n in cuts, after is None or after in cuts
        return PictureFinding(None, None, before, after, begins, ends, begins, ends)

    return known


def made(known, frame, fps=48, degrees=180, speed=Fraction(1), count=20):
    moment = OutputFrame(frame, Fraction(frame, fps), Fraction(1, fps))
    times = ClockedTimes(shown_at(range(count)), Clock(speed=speed))
    return exposure_of(times, moment, Shutter(degrees), known)


def test_an_exposure_is_made_of_the_pictures_whose_cells_it_meets():
    whole = chain(range(20))
    assert [cell.index for cell in made(whole, 5).cells] == [5]
    assert [cell.index for cell in made(whole, 2, fps=12, degrees=360).cells] == [6, 7, 8, 9, 10]
    half = made(whole, 11, speed=Fraction(1, 2))
    assert half.here == 5 and [cell.index for cell in half.cells] == [5, 6]
    assert [cell.share for cell in half.cells] == pytest.approx([0.5, 0.5])
    assert [made(whole, n).cells[0].index for n in (0, 19)] == [0, 19]


def test_it_ends_at_cuts_and_reaches_over_pictures_that_are_left_out():
    assert [c.index for c in made(chain(range(20), cuts=(7,)), 2, fps=12, degrees=360).cells] == [
        7, 8, 9, 10,
    ]  # fmt: skip
    some = [n for n in range(20) if n not in (5, 6)]
    found = made(chain(some), 6)
    assert found.here == 4 and [cell.index for cell in found.cells] == [7]
    assert [cell.index for cell in made(chain(some), 5).cells] == [4]
    assert made(chain([0, 1, 5, 6, 7]), 3, degrees=0).here == 1
    assert made(chain(range(3, 20)), 1).here == 3


def test_what_is_not_known_yet_is_asked_for():
    assert made(chain(range(20), without=range(20)), 5).lacking == (5,)
    found = made(chain(range(20), without=(7,)), 2, fps=12, degrees=360)
    assert found.lacking == (7,) and found.cells[0].index == 7
    assert made(chain([4, 7], without=(4,)), 6).lacking == (4,)


def test_the_picture_at_a_time_is_found_exactly():
    times = ClockedTimes(shown_at(range(0, 40, 2)), Clock())
    for frame, want in [(0, 0), (1, 0), (2, 1), (3, 1), (39, 19)]:
        assert times.shown_at(frame / 48) == want
    rounded = ClockedTimes(shown_at(range(0, 40, 2)), Clock(), tolerance=1 / 480)
    assert rounded.shown_at(2 / 48 - 1 / 500) == 1 and rounded.shown_at(2 / 48 - 1 / 400) == 0


# ---- options that do not fit ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["wheel", "--flow", "dis"], "--flow is for videos, not for wheel"),
        (["wheel", "--layer", "beauty"], "--layer is for frames, wheel is a scene"),
        (["wheel", "--cuts", "3"], "--cuts is for frames and videos, wheel is a scene"),
        (["wheel", "--codec", "h265"], "--codec is for videos, not for wheel"),
        (["SHOT", "--flow", "dis"], "--flow of frames is for `wgmb blur`"),
        (["SHOT", "--begin", "1"], "--begin is for videos"),
        (["CLIP", "--depth", "Z"], "--depth is for rendered frames, a video has no layers"),
        (["CLIP", "--scale", "a.png"], "--scale is for rendered frames"),
        (["CLIP", "--from", "acescg"], "--from is for rendered frames, a video says"),
        (["CLIP", "--begin", "9"], "has no pictures in this range"),
        (["CLIP", "--highlights", "90"], "--highlights must be 1 to 32"),
        (["CLIP", "--workers", "3"], "--workers is for `wgmb blur`: the viewer writes no files"),
        (
            ["CLIP", "--fps-in", "3"],
            "--fps-in is for `wgmb blur`: the viewer shows frames at their",
        ),
        (["CLIP", "--nonsense", "3"], "unknown option --nonsense"),
        (["CLIP", "--fps"], "view needs --fps and its value"),
        (["CLIP", "--frames", "5-99"], "0 to 23"),
        (["CLIP", "--begin", "0.1", "--frames", "5-9"], "choose either --frames, or --begin"),
    ],
)
def test_options_that_do_not_fit_are_refused_in_one_line(clip, capsys, words, said):
    places = {"CLIP": str(clip), "SHOT": "sample/crossing.####.exr"}
    assert main(["view", *[places.get(word) or word for word in words]]) == 2
    assert said in (line := capsys.readouterr().err) and line.count("\n") == 1


def test_settings_written_by_hand_are_of_the_whole_video(clip):
    text = f'[blur]\npattern = "{clip}"\nfps = "60000/1001"\nbegin = "0.5"\n[view]\nframe = 3\n'
    state = State.of_toml(text)
    assert state.frames == "0-23" and state.span == (0, 29) and state.frame == 3
    assert video_time.rate(state) == Fraction(60000, 1001)


def test_long_names_lose_their_middle():
    assert shortened("clip.mp4", lambda text: len(text) <= 8) == "clip.mp4"
    assert shortened("Meridian-ProRes-HDR10.mp4", lambda text: len(text) <= 15) == "Meridia..10.mp4"
    assert shortened("abc", lambda text: False) == "abc"
