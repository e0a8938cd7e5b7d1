"""The viewer shows videos: pictures at once, their blur as soon as their motion is known."""

import gc
import os
import time
import weakref
from dataclasses import replace
from fractions import Fraction
from itertools import count

import numpy as np
import pytest

import make_clips as clips
import make_frames as make
from viewer_hand import ALONE, SAMPLE, put
from wgmb import (
    Blur,
    InputError,
    Shutter,
    gpu,
)
from wgmb.cli.app import main
from wgmb.color.coding import BT2020, HLG, PQ
from wgmb.color.primaries import REC709, REC2020, conversion
from wgmb.color.srgb import srgb
from wgmb.flow import Flow
from wgmb.flow.dis import Dis
from wgmb.gpu.textures import TexturePool
from wgmb.io import stills
from wgmb.observer import Observer
from wgmb.settings.video import FlowSettings, VideoSettings
from wgmb.shots.cut_list import CutList
from wgmb.video.exposures import VideoBlur
from wgmb.video.holdouts import holdout_of
from wgmb.video.linear_frames import VideoPictures
from wgmb.video.output_times import OutputFrames
from wgmb.video.planes import Planes
from wgmb.video.read.reader import VideoReader
from wgmb.viewer import State, controls, offscreen
from wgmb.viewer.draw.portions import DroppedError, Portions
from wgmb.viewer.draw.renderer import Renderer
from wgmb.viewer.draw.request import Request
from wgmb.viewer.panel import overlay
from wgmb.viewer.panel.panel import commands
from wgmb.viewer.state.state import video_time
from wgmb.viewer.subjects import motion_thread
from wgmb.viewer.subjects.video import VideoSubject
from wgmb.viewer.subjects.video_motion import MotionRequest, PictureFinder, PictureFinding
from wgmb.viewer.window import frame

SIZE = 96, 64
WINDOW = 96, 64  # of the picture alone
BY_DIS = VideoSettings(flow="dis")


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A square that passes over a background, 48 a second, and a cut before picture 10."""
    return passing(tmp_path_factory.mktemp("clip") / "a.mp4")


@pytest.fixture(scope="module")
def flash(tmp_path_factory):
    """The same with a white picture 5."""
    return passing(tmp_path_factory.mktemp("flash") / "a.mp4", white=5)


@pytest.mark.parametrize("flow", ["dis", pytest.param("search", marks=pytest.mark.full)])
def test_pictures_are_let_go_of_at_once_after_a_seek_and_at_the_end(flow, tmp_path):
    pictures = [clips.frame(clips.planes(n % 12), "yuv420p") for n in range(120)]
    reader = VideoReader(clips.write(tmp_path / "long.mp4", pictures))
    source, _ = FlowSettings(flow=flow).source(gpu.open_device())
    gc.collect()
    gc.disable()
    try:
        find = PictureFinder(reader, gpu.open_device(), source, MotionRequest())
        seen = []
        for number in (1, 100):  # the second one is far away
            find(number)
            shots = find._shots
            seen += [weakref.ref(shots[i].content) for i in shots.kept]
            del shots
        early = [ref() is None for ref in seen[:2]]
        find.close()
        assert all(early) and all(ref() is None for ref in seen)
        gone = weakref.ref(find)
        del find
        assert gone() is None
    finally:
        gc.enable()


def passing(path, white=None, repeats=(), times=None, count=14, pace=3.0):
    width, height = SIZE
    y, x = np.mgrid[:height, :width].astype(np.float32)
    frames, last = [], np.zeros((height, width), np.uint8)
    for n in range(count):
        at = 12 + pace * n
        inside = (abs(x - at) < 12) & (abs(y - 32) < 14)
        is_first = n < 10 or count > 14
        behind = make.texture(x, y, 0.0 if is_first else 9.0)[..., 0]
        tone = np.where(inside, make.texture(x - at, y, 5.0)[..., 1], behind)
        tone = tone if is_first else 1 - tone[::-1] ** 3
        tone = np.ones_like(tone) if n == white else tone
        luma = np.clip(16 + 219 * tone, 16, 235).round().astype(np.uint8)
        luma = last if n in repeats else luma
        last = luma
        chroma = np.full((height // 2, width // 2), 128, np.uint8)
        frames.append(clips.frame([luma, chroma, chroma], "yuv420p"))
    return clips.write(path, frames, times or [Fraction(n, 48) for n in range(count)])


class Held:
    """A source of motion that waits until it may go on, and counts."""

    def __init__(self):
        self.made, self.free = [], True
        self.dis = Dis("best")

    def reach(self, size):
        return 4

    def shot(self, load, depth=True):
        found = self.dis.shot(load)

        def motion(number):
            while not self.free:
                time.sleep(0.01)
            self.made.append(number)
            return found(number)

        return motion


@pytest.fixture
def held(monkeypatch):
    source = Held()
    monkeypatch.setattr(FlowSettings, "source", lambda self, device: (source, "held"))
    return source


def opened(clip, output_speed="1", **changes):
    state = put(State().opened(str(clip)), panel=False, method="tap", samples=8)
    state = put(state.with_settings(speed=output_speed), **changes)
    return offscreen(state.settled(), WINDOW)


def settled(viewer):
    """The result when nothing lacks any more (height, width, 3)."""
    for _ in range(600):
        frame(viewer)
        if not viewer.stage.report.busy:
            return viewer.stage.download()[..., :3]
    raise AssertionError(viewer.stage.report)


def motion_of(video, device):
    """A source of motion that shares nothing with that of the viewer."""
    if video.flow == "search":
        return Flow(quality=video.flow_quality, device=device)
    return Dis(video.flow_quality) if video.flow == "dis" else None


def command_line(
    clip, number, fps=48, method="tap", masks=(), frames=None, cuts="", video=BY_DIS, **shutter
):
    """The output frame of that number that `wgmb blur` makes; `fps` None: at the video's times."""
    footage, blur = VideoReader(clip), Blur(method, samples=8)
    clock = video.clock(footage, frames)
    cut_list = CutList(cuts)
    run = VideoBlur(
        footage,
        blur,
        motion_of(video, blur.device),
        clock=clock,
        has_own_times=fps is None,
        holdout=holdout_of(masks, footage),
        fill=video.duplicates == "fill",
        cuts=cut_list.is_search,
        known_cuts=cut_list.frames(0),
        planes=Planes(blur.device, video.expansion),
    )
    wanted = list(OutputFrames(footage, clock, None if fps is None else Fraction(fps)))
    exposes = Shutter(**shutter)
    for moment, exposure in run.of(run.pictures(exposes, wanted), exposes, wanted):
        if moment.number == number:
            encoder = blur.device.create_command_encoder()
            return TexturePool(blur.device).download(encoder, exposure.light())[..., :3]
    raise AssertionError(f"{len(wanted)} frames")


FULL = pytest.mark.full


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    ("changes", "made"),
    [
        ({}, {}),
        ({"shutter": 360.0, "phase": "start"}, {"degrees": 360, "phase": "start"}),
        ({"fps": 12.0, "frame": 1.0}, {"fps": 12}),
        ({"method": "gather"}, {"method": "gather"}),
        pytest.param({"fps": 12.0, "shutter": 360.0, "frame": 2.0},
                     {"fps": 12, "degrees": 360}, marks=FULL),
        ({"fps": 12.0, "flow": "none", "frame": 1.0}, {"fps": 12}),
        pytest.param({"output_speed": "0.5", "frame": 8.0},
                     {}, marks=FULL),
        ({"output_speed": "0.5", "frame": 9.0}, {}),
        ({"output_speed": "0.4", "fps": 60.0, "frame": 13.0, "method": "gather"},
         {"fps": 60, "method": "gather"}),
        ({"output_speed": "0.4", "fps": 60.0, "frame": 34.0, "shutter": 360.0},
         {"fps": 60, "degrees": 360}),
        pytest.param({"output_speed": "0.5", "frame": 11.0, "flow": "search",
                      "flow_quality": "fast"}, {}, marks=FULL),
        ({"output_speed": "4", "frame": 1.0}, {}),
        ({"begin": "0.05", "end": "0.2", "frame": 3.0}, {}),
        ({"frames": "3-9", "output_speed": "0.3", "frame": 0.0}, {"frames": "3-9"}),
        pytest.param({"frames": "3-9", "output_speed": "0.3", "frame": 22.0},
                     {"frames": "3-9"}, marks=FULL),
        ({"highlights": 8.0, "frame": 4.0}, {}),
        ({"cuts": "3,5", "shutter": 720.0}, {"cuts": "3,5", "degrees": 720}),
        ({"cuts": "only:5", "frame": 9.0}, {"cuts": "only:5"}),
    ],
    ids=[
        "own rate",
        "into the next",
        "four in one",
        "neighbours",
        "up to the cut",
        "averaged",
        "slow, at a picture",
        "slow, in between",
        "slow at another rate",
        "slow, across the cut",
        "slow, searched",
        "quick",
        "a part by times",
        "the beginning of a part",
        "the end of a part",
        "highlights",
        "cuts by hand",
        "no cuts",
    ],
)  # fmt: skip
def test_it_shows_what_the_command_line_makes(clip, changes, made):
    viewer = opened(clip, **{"flow": "dis", "frame": 4.0} | changes)
    state = viewer.state
    want = command_line(clip, int(state.frame), video=state.video, **made)
    np.testing.assert_array_equal(settled(viewer), want)
    viewer.stage.choices.close()


def fast(path):
    """A textured square that moves 40 px a picture, 24 a second."""
    width, height, edge = 320, 96, 40
    y, x = np.mgrid[:height, :width].astype(np.float32)
    behind = make.texture(x / 3, y / 3, 0.0)[..., 0]
    body = make.texture(x[:edge, :edge] / 2, y[:edge, :edge] / 2, 5.0)[..., 1]
    frames = []
    for n in range(6):
        tone = 0.3 + 0.4 * behind
        tone[30 : 30 + edge, 10 + 40 * n : 10 + 40 * n + edge] = body
        luma = np.clip(16 + 219 * tone, 16, 235).round().astype(np.uint8)
        chroma = np.full((height // 2, width // 2), 128, np.uint8)
        frames.append(clips.frame([luma, chroma, chroma], "yuv420p"))
    return clips.write(path, frames, [Fraction(n, 24) for n in range(6)])


@pytest.mark.parametrize("method", [None, "gather"])
def test_its_command_writes_the_bytes_that_it_shows_of_something_fast(tmp_path, method):
    clip, made = fast(tmp_path / "fast.mp4"), tmp_path / "made.mkv"
    state = put(State().opened(str(clip)), panel=False, frame=3.0)
    state = state if method is None else state.with_method(method)
    viewer = offscreen(state, (320, 96))
    light = settled(viewer)
    words = viewer.state.command(str(made))
    assert ("--method" in words) == (method is not None)
    viewer.stage.choices.close()
    assert main([*words, "--codec", "ffv1", "--quiet"]) == 0
    device = gpu.open_device()
    footage, planes = VideoReader(made), Planes(device)
    written = dict(footage.pictures())[3]
    texture = TexturePool(device).upload("light", np.dstack([light, light[..., 0] * 0 + 1]),
                                         "rgba32float")  # fmt: skip
    encoder = device.create_command_encoder()
    shown = planes.encode(encoder, texture, footage.coding)
    for plane, want in zip(shown.planes, written.planes, strict=True):
        np.testing.assert_array_equal(plane, want)
    sharp = dict(VideoReader(clip).pictures())[3]
    square = np.s_[34:66, 126:166]
    off = shown.planes[0][square].astype(int) - sharp.planes[0][square]
    assert np.abs(off).mean() > 10  # it is not left sharp


def test_a_finding_that_comes_meanwhile_leaves_nothing_out(clip, monkeypatch):
    """The thread may add findings while the exposure is worked out."""
    viewer = opened(clip, flow="dis", frame=9.0, output_speed="0.5", shutter=720.0)
    settled(viewer)
    subject, shutter = viewer.stage.choices.subject(viewer.state), viewer.state.shutter.make()
    known = subject._maker.known
    whole = subject.stamp([viewer.state], shutter, False)
    assert not subject.busy
    for late in range(1, 40):
        calls = count()
        monkeypatch.setattr(
            subject._maker, "known", lambda n, c=calls, k=late: known(n) if next(c) >= k else None
        )
        assert subject.stamp([viewer.state], shutter, False) == whole or subject.busy
    viewer.stage.choices.close()


def test_b_may_find_the_motion_in_another_way(clip):
    settings = {"fps": 12.0, "shutter": 360.0, "frame": 1.0}
    viewer = opened(clip, flow="none", **settings)
    viewer.state = put(viewer.state.keeping(), flow="dis", compare="difference", gain=1.0)
    first = settled(viewer)
    second = viewer.stage.download(viewer.stage._slots["second"])[..., :3]
    averaged = VideoSettings(flow="none")
    made = {"fps": 12, "degrees": 360}
    np.testing.assert_array_equal(first, command_line(clip, 1, **made))
    np.testing.assert_array_equal(second, command_line(clip, 1, video=averaged, **made))
    assert np.abs(first - second).max() > 0.05
    both = [*viewer.stage.choices._clips.values()]
    assert len(both) == 2
    viewer.state = put(viewer.state.swapped(), exposure=1.0)
    assert (viewer.state.video.flow, viewer.state.kept.flow) == ("none", "dis")
    np.testing.assert_allclose(settled(viewer), second, atol=1e-6)
    assert {*viewer.stage.choices._clips.values()} == {*both}  # nothing was opened again
    one, other = commands(viewer.state, "out.mp4").splitlines()
    assert "--flow none" in one and "--flow dis" in other
    viewer.state = put(viewer.state, kept=None, compare="off", flow="dis", flow_quality="fast")
    settled(viewer)
    assert len(viewer.stage.choices._clips) == 1
    for subject in both:
        subject._maker._thread.join(20)
        assert not subject._maker._thread.is_alive()
    viewer.stage.choices.close()


def test_the_next_video_finds_its_motion_with_what_was_compiled_for_the_last(clip, monkeypatch):
    used, source = [], FlowSettings.source

    def noted(self, device):
        used.append(device)
        return source(self, device)

    monkeypatch.setattr(FlowSettings, "source", noted)
    device, state = gpu.open_device(), opened(clip, flow="none").state
    first = VideoSubject(device, state)
    other = VideoSubject(device, state)
    first.close()
    first._maker._thread.join(20)
    third = VideoSubject(device, state)
    assert used[0] is not used[1] and used[2] is used[0]
    for subject in (other, third):
        subject.close()


def test_quick_motion_is_called_a_draft_in_the_picture(clip, monkeypatch):
    said, tag = [], overlay.tag

    def noted(text, *place, **how):
        said.append(text)
        tag(text, *place, **how)

    monkeypatch.setattr(overlay, "tag", noted)
    for changes, is_draft in (
        ({"flow": "dis"}, True),
        ({"flow": "dis", "look": "sharp"}, False),
        ({"flow": "none"}, False),
    ):
        viewer = opened(clip, **changes)
        settled(viewer)
        said.clear()
        frame(viewer)
        assert any(text.startswith("draft motion: dense inverse") for text in said) == is_draft
        viewer.stage.choices.close()
    searched = VideoSubject(gpu.open_device(), put(viewer.state, flow="search"))
    searched.close()
    assert searched.draft == ""


@pytest.mark.parametrize("flow", ["dis", "none"])
def test_an_exposure_is_dropped_before_its_next_picture_and_leaves_nothing_behind(clip, flow):
    viewer = opened(clip, flow=flow, fps=12.0, shutter=360.0, frame=1.0)
    state = viewer.state
    viewer.stage.choices.close()
    left = [10**9]

    def wanted():
        left[0] -= 1
        return left[0] > 0

    renderer = Renderer(gpu.open_device(), Portions(gpu.open_device(), wanted))
    request = Request(state, (0, 0, *WINDOW), full=True)
    renderer.draw(request, 0.0)
    whole, checks = renderer.download(), 10**9 - left[0]
    assert checks >= 4
    other = replace(request, state=put(state, shutter=180.0))
    renderer.draw(other, 0.0)
    for after in range(1, checks):
        left[0] = after
        with pytest.raises(DroppedError):
            renderer.draw(request, 0.0)
        assert left[0] == 0
    left[0] = 10**9
    renderer.draw(request, 0.0)
    np.testing.assert_array_equal(renderer.download(), whole)
    renderer.choices.close()


TIMES = [Fraction(n, 48) for n in (0, 1, 2, 4, 5, 7, 8, 9, 12, 13, 14, 16, 17, 18)]


def test_the_line_tells_of_the_frame_on_the_canvas(clip, monkeypatch):
    """While it played, it told of a frame that was drawn already, but not composed."""
    viewer, told = opened(clip, flow="none", frame=2.0), []
    monkeypatch.setattr(
        viewer.panel, "draw", lambda state, info, *place: told.append(info.frame) or state
    )
    settled(viewer)
    assert told[-1] == "output frame 2, 0.042 s: picture 2"
    monkeypatch.setattr(viewer.screen, "show", lambda view: None)  # composing takes long
    viewer.state = put(viewer.state, frame=5.0)
    settled(viewer)
    assert told[-1].startswith("output frame 2, ")
    monkeypatch.undo()
    monkeypatch.setattr(
        viewer.panel, "draw", lambda state, info, *place: told.append(info.frame) or state
    )
    settled(viewer)
    assert told[-1].startswith("output frame 5, ")


@pytest.mark.covers(0)
@pytest.mark.parametrize("speed", ["0.4", "1"])
@pytest.mark.parametrize("own_times", [False, True])
@pytest.mark.parametrize("fill", ["keep", "fill"])
def test_variable_rates_and_repeats_are_as_by_the_command_line(tmp_path, speed, own_times, fill):
    clip = passing(tmp_path / "a.mp4", repeats=(4, 5, 8), times=TIMES)
    viewer = opened(
        clip, flow="dis", output_speed=speed, own_times=own_times, duplicates=fill,
        method="gather", shutter=300.0,
    )  # fmt: skip
    fps = None if own_times else video_time.rate(viewer.state)
    settings = viewer.state.video
    assert settings.duplicates == fill
    count = len(video_time.output(viewer.state).frames)
    assert own_times == (count == 14)
    for number in (count - 1, 5, 4, 8, 0):
        made = {"fps": fps, "method": "gather", "degrees": 300}
        want = command_line(clip, number, video=settings, **made)
        viewer.state = put(viewer.state, frame=float(number))
        np.testing.assert_array_equal(settled(viewer), want)
    viewer.stage.choices.close()


def of_a_cadence(path):
    """24 pictures a second in a file of 30: every fifth repeats the one before."""
    repeats = [n for n in range(40) if n % 5 == 4]
    return passing(path, repeats=repeats, times=[Fraction(n, 30) for n in range(40)], count=40,
                   pace=2.0)  # fmt: skip


def rounded(path):
    """59.94 pictures a second, in a file of whole milliseconds."""
    times = [Fraction(round(n * Fraction(1001, 60)), 1000) for n in range(30)]
    return passing(path.with_suffix(".mkv"), times=times, count=30, pace=2.0)


def standing(path):
    """Pictures 4 to 8 are the same."""
    return passing(path.with_suffix(".mkv"), repeats=range(4, 9))


@pytest.mark.parametrize(
    ("clip_of", "numbers", "changes"),
    [
        (of_a_cadence, (21, 16, 18), {"duplicates": "fill"}),
        (of_a_cadence, (21,), {"duplicates": "fill", "fps": 60.0}),
        (rounded, (7, 10), {"fps": 23.976, "shutter": 360.0}),
        (rounded, (20, 3), {"own_times": True}),
        (standing, (2, 4), {"fps": 24.0, "shutter": 360.0}),
        (standing, (6,), {}),
    ],
)
def test_its_pictures_have_the_times_that_the_command_line_gives_them(
    tmp_path, clip_of, numbers, changes
):
    clip = clip_of(tmp_path / "a.mp4")
    viewer = opened(clip, flow="dis", method="gather", **changes)
    state = viewer.state
    fps = None if state.own_times else video_time.rate(state)
    for number in numbers:
        made = {"fps": fps, "method": "gather", "degrees": state.shutter.shutter}
        want = command_line(clip, number, video=state.video, **made)
        viewer.state = put(viewer.state, frame=float(number))
        np.testing.assert_array_equal(settled(viewer), want)
    viewer.stage.choices.close()


def test_what_is_held_out_stays_sharp_as_by_the_command_line(clip, tmp_path):
    matte = tmp_path / "matte.png"
    mask = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    mask[:, : SIZE[0] // 4] = 1
    matte.write_bytes(stills.encode(mask, ".png", 8, ""))
    viewer = opened(clip, flow="dis", frame=4.0, holdout=(str(matte), "static"))
    got = settled(viewer)
    want = command_line(clip, 4, masks=(str(matte), "static"))
    np.testing.assert_array_equal(got, want)
    sharp = VideoPictures(VideoReader(clip), Planes(gpu.open_device())).at(4)
    kept = np.abs(got - sharp)[:, : SIZE[0] // 4 - 2]
    assert kept.max() < 1e-3 < 0.02 < np.abs(got - command_line(clip, 4)).max()
    viewer.stage.choices.close()


@pytest.mark.parametrize(
    ("mask", "said"), [("Layer", "must be static, none, or an image"), ("small.png", "96 x 64")]
)
def test_a_holdout_that_cannot_be_is_refused(clip, tmp_path, monkeypatch, mask, said):
    monkeypatch.chdir(tmp_path)
    small = stills.encode(np.ones((8, 8, 3), np.float32), ".png", 8, "")
    (tmp_path / "small.png").write_bytes(small)
    with pytest.raises(InputError, match=said):
        frame(opened(clip, holdout=(mask,)))


def test_the_speed_of_the_output_is_saved_and_played(clip):
    state = put(State().opened(str(clip)).with_settings(speed="0.5"), speed=2.0)
    words = state.command("b.mp4")
    assert words[words.index("--speed") + 1] == "0.5"
    assert State.of_toml(state.toml()) == state
    assert controls.played(put(state, speed=1.0), 0.125).frame == pytest.approx(6)
    assert "--speed" not in state.with_settings(speed="1").command("b.mp4")
    with pytest.raises(InputError, match=r"`speed` must be 0\.01 to 100"):
        State.of_toml(state.toml().replace('speed = "0.5"', 'speed = "0"'))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["wheel", "--speed", "0.5"], "--speed is for videos"),
        (["wheel", "--holdout", "static"], "--holdout is for frames and videos"),
        (["CLIP", "--speed", "0"], "--speed must be 0.01 to 100"),
    ],
)
def test_options_that_do_not_fit_are_refused_before_a_window_opens(clip, capsys, changes, said):
    words = [str(clip) if word == "CLIP" else word for word in changes]
    assert main(["view", *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.covers(0)
@pytest.mark.parametrize("changes", [{"frame": 1.0}, {"frame": 1.0, "method": "gather"}])
def test_it_shows_a_flash_as_the_command_line_does(clip, flash, changes):
    made = {"fps": 12, "degrees": 360, "method": changes.get("method", "tap")}
    viewer = opened(flash, flow="dis", fps=12.0, shutter=360.0, **changes)
    want = command_line(flash, 1, **made)
    np.testing.assert_array_equal(settled(viewer), want)
    assert want.mean() > command_line(clip, 1, **made).mean() + 0.1
    viewer.stage.choices.close()


def test_the_sharp_picture_comes_first_and_says_so(clip, held):
    held.free = False
    viewer = opened(clip, frame=5.0)
    for _ in range(3):
        frame(viewer)
    report = viewer.stage.report
    assert report.waiting.startswith("sharp: finding the motion of picture 5")
    sharp = VideoPictures(VideoReader(clip), Planes(gpu.open_device())).at(5)
    np.testing.assert_allclose(viewer.stage.download()[..., :3], sharp, atol=1e-6)
    held.free = True
    assert np.abs(settled(viewer) - sharp).max() > 0.05
    assert not viewer.stage.report.waiting
    viewer.stage.choices.close()


def test_motion_is_made_once_whatever_changes(clip, held):
    viewer = opened(clip, frame=5.0)
    first = settled(viewer)
    assert held.made == [5]  # tap takes no neighbours
    for change in (
        {"shutter": 90.0},
        {"samples": 4},
        {"method": "reproject"},
        {"look": "velocity"},
    ):
        viewer.state = put(viewer.state, **change)
        settled(viewer)
    viewer.state = put(viewer.state, frame=2.0)
    settled(viewer)
    assert sorted(held.made) == sorted(set(held.made)) and {2, 5} <= set(held.made)
    before = len(held.made)
    viewer.state = put(viewer.state, frame=5.0, shutter=180.0, samples=8, method="tap",
                           look="result")  # fmt: skip
    np.testing.assert_array_equal(settled(viewer), first)
    assert len(held.made) == before
    viewer.stage.choices.close()


def test_as_many_motions_are_kept_as_there_is_memory_for_or_an_exposure_needs(clip, monkeypatch):
    monkeypatch.setattr(motion_thread, "_MEMORY", 5 * SIZE[0] * SIZE[1] * 20)
    flow, device = FlowSettings(flow="dis"), gpu.open_device()
    thread = motion_thread.MotionThread(clip, 1000, flow, device, MotionRequest())
    for wanted, needed, want in [(range(12), 2, 5), ((2, 3, 4, *range(5, 13)), 7, 7)]:
        thread.want(tuple(wanted), needed)
        for _ in range(400):
            time.sleep(0.05)
            if thread.making is None and all(thread.known(n) for n in wanted[:needed]):
                break
        time.sleep(0.3)  # in which it would go on
        there = [n for n in range(14) if thread.known(n) is not None]
        assert len(there) == want and set(wanted[:needed]) <= {*there}
    thread.close()


def test_it_plays_at_its_own_rate_and_steps_from_picture_to_picture(clip):
    state = State().opened(str(clip))
    assert (state.frames, state.frame, state.fps) == ("0-13", 0.0, 48.0)
    assert controls.stepped(state, 1).frame == 1
    assert controls.played(state, 0.125).frame == pytest.approx(6)
    assert controls.played(put(state, fps=12.0), 0.125).frame == pytest.approx(1.5)


def test_what_it_is_set_to_is_what_the_command_line_is_told(clip):
    state = put(State().opened(str(clip)), flow="dis", frames="2-5").settled()
    words = state.command("b.mp4")
    assert words[:4] == ["blur", str(clip), "-o", "b.mp4"] and "--fps" not in words
    assert words[words.index("--flow") + 1] == "dis" and words[words.index("--frames") + 1] == "2-5"
    assert "--fps" in put(state, fps=24.0).command("b.mp4")
    assert State.of_toml(state.toml()) == state
    with pytest.raises(InputError, match="flow cannot be 'dise'"):
        State.of_toml(state.toml().replace('"dis"', '"dise"'))


def test_options_of_rendered_frames_are_refused(clip):
    with pytest.raises(InputError, match="--layer is for rendered frames"):
        frame(opened(clip, layer="beauty"))


def test_pictures_are_found_in_any_order(clip):
    pictures, want = VideoPictures(VideoReader(clip), Planes(gpu.open_device())), {}
    for number, light in VideoPictures(VideoReader(clip), Planes(gpu.open_device())).read():
        want[number] = light
    for number in (3, 4, 5, 9, 2, 2, 13, 0, 12):
        np.testing.assert_array_equal(pictures.at(number), want[number])
    assert pictures.at(14) is None


def wide(path, transfer):
    """A 10-bit video of one colour a quarter, in BT.2020 primaries; grey is white of paper."""
    width, height = SIZE
    rgb = np.full((height, width, 3), 0.58 if transfer == PQ else 0.75)
    for i, color in enumerate([(0.55, 0.4, 0.4), (0.4, 0.5, 0.42), (0.35, 0.4, 0.5)]):
        rgb[:, i * width // 4 : (i + 1) * width // 4] = color
    luma = rgb @ [0.2627, 0.678, 0.0593]  # BT.2020, non-constant luminance
    blue, red = (rgb[..., 2] - luma) / 1.8814, (rgb[..., 0] - luma) / 1.4746
    found = [4 * (16 + 219 * luma)] + [4 * (128 + 224 * c[::2, ::2]) for c in (blue, red)]
    planes = [plane.round().astype(np.uint16) for plane in found]
    made = [clips.frame(planes, "yuv420p10le") for _ in range(2)]
    tags = (1, BT2020, transfer, BT2020)
    return clips.write(path, made, codec="ffv1", pixels="yuv420p10le", tags=tags)


@pytest.mark.parametrize("transfer", [PQ, HLG], ids=["PQ", "HLG"])
def test_hdr_is_shown_in_the_colours_of_the_display(tmp_path, transfer):
    path = wide(tmp_path / "a.mkv", transfer)
    assert VideoReader(path).coding.transfer == transfer
    assert State().opened(str(path)).tone == "soft"  # the sky of a phone's video is not all white
    viewer = opened(path, look="sharp", flow="none", tone="clip")
    for _ in range(3):
        frame(viewer)
    light = VideoPictures(VideoReader(path), Planes(gpu.open_device())).at(0).astype(np.float64)
    if transfer == HLG:
        light *= (light @ [0.2627, 0.678, 0.0593])[..., None] ** 0.2  # BT.2100, table 5
    want = srgb(light @ conversion(REC2020, REC709).T)
    got = viewer.screen.picture()
    np.testing.assert_allclose(got, want, atol=2e-3)
    assert got[32, -8].min() > 0.97  # white of paper is white
    assert np.abs(srgb(light) - want).max() > 0.03  # the primaries count
    assert np.allclose(viewer.stage.chromaticities["chromaticities"], REC2020)
    viewer.stage.choices.close()


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    ("changes", "frame_shown"),
    [
        ({"shutter": 0.0, "flow": "none", "own_times": True}, 6.0),
        ({"shutter": 0.0, "flow": "none", "own_times": True}, 13.0),
        ({"flow": "dis", "output_speed": "0.5", "fps": 24.0}, 11.0),
    ],
    ids=["near the beginning", "as wgmb perceive", "of slow motion"],
)
def test_a_video_is_perceived_by_output_frames_held_until_the_next(tmp_path, changes, frame_shown):
    clip = passing(tmp_path / "a.mp4", times=TIMES)
    viewer = opened(clip, look="perceived", frame=frame_shown, **changes)
    state = viewer.state
    moments, fps = video_time.output(state).frames, None
    if not state.own_times:
        fps = video_time.rate(state)
    observer = Observer(100, state.eye, device=viewer.stage.device)
    for number in range(int(frame_shown) + 1):
        settings = state.video
        made = {"fps": fps, "video": settings, "degrees": state.shutter.shutter}
        observer.present(command_line(clip, number, **made), video_time.held_for(state, number))
    assert len(moments) > frame_shown
    got = settled(viewer)
    np.testing.assert_allclose(got, observer.perceived()[..., :3], atol=1e-3)  # it holds halves
    assert np.abs(got - command_line(clip, int(frame_shown), **made)).max() > 0.05
    assert viewer.stage.report.labels[0].endswith("perceived")
    viewer.stage.choices.close()


def test_what_is_perceived_waits_for_the_motion_of_all_its_frames(clip, held):
    held.free = False
    viewer = opened(clip, look="perceived", frame=7.0)
    for _ in range(3):
        frame(viewer)
    assert viewer.stage.report.busy and "finding the motion" in viewer.stage.report.waiting
    blurry = viewer.stage.download()
    held.free = True
    assert np.abs(settled(viewer) - blurry[..., :3]).max() > 1e-3
    assert set(held.made) == set(range(8)) and not viewer.stage.report.waiting
    viewer.stage.choices.close()


def test_a_file_that_vanishes_while_it_plays_is_said_and_the_picture_stays(tmp_path):
    clip = passing(tmp_path / "a.mp4")
    viewer = opened(clip, flow="none", shutter=0.0, frame=3.0)
    shown = settled(viewer)
    clip.unlink()
    subject = viewer.stage.choices.subject(viewer.state)
    assert isinstance(subject, VideoSubject)
    subject._shots._kept.clear()  # as if there had been many more
    for frame_wanted in (12.0, 0.0, 13.0):
        viewer.state = put(viewer.state, frame=frame_wanted, playing=True)
        for _ in range(3):
            frame(viewer)
    assert str(clip) in viewer.message[0] or "sharp: " in viewer.stage.report.waiting
    assert shown.shape == viewer.stage.download()[..., :3].shape
    viewer.stage.choices.close()


def test_a_file_that_changes_is_read_anew(tmp_path):
    clip = passing(tmp_path / "a.mp4")
    viewer = opened(clip, flow="none", shutter=0.0, frame=3.0)
    before = settled(viewer)
    passing(tmp_path / "a.mp4", white=3)
    os.utime(clip, (1, 1))
    assert np.abs(settled(viewer) - before).max() > 0.2
    viewer.stage.choices.close()


def test_pixels_that_are_not_square_are_shown_in_their_shape(tmp_path):
    def wide(stream):
        stream.codec_context.sample_aspect_ratio = Fraction(2)

    frames = [clips.frame(clips.planes(n, SIZE), "yuv420p") for n in range(3)]
    clip = clips.write(tmp_path / "a.mp4", frames, setup=wide)
    viewer = opened(clip, look="sharp")
    frame(viewer)
    assert viewer.stage.report.place == (0, 16, 96, 32)
    assert viewer.stage.download().shape[:2] == (64, 96)
    viewer.stage.choices.close()


def test_where_nothing_can_be_decoded_a_picture_is_left_out_or_the_run_says_so(
    tmp_path, monkeypatch
):
    frames = [clips.frame(clips.planes(n % 12), "yuv420p") for n in range(36)]
    clip = clips.write(tmp_path / "a.mp4", frames)
    decoded = VideoReader.pictures

    def begin_only(self, first=0, last=None):
        return ((n, picture) for n, picture in decoded(self, first, last) if n < 4)

    monkeypatch.setattr(VideoReader, "pictures", begin_only)
    device, footage = gpu.open_device(), VideoReader(clip)
    find = PictureFinder(footage, device, None, MotionRequest())
    assert find(35) == PictureFinding(None, None, None, None, is_left_out=True)
    assert find(10).is_left_out and find(10).before == 3
    assert not find(2).is_left_out and find(2).after == 3
    clock = VideoSettings(begin="0.9").clock(footage, None)
    run = VideoBlur(footage, Blur("tap", device=device), None, clock=clock)
    with pytest.raises(InputError, match=r"from 0\.[0-9]* s on can be decoded"):
        next(run.pictures(Shutter(180), list(OutputFrames(footage, clock, Fraction(24)))))


def test_only_what_is_shown_stays_open(clip):
    viewer = opened(clip, flow="none")
    choices = viewer.stage.choices
    settled(viewer)
    video = choices.subject(viewer.state)
    frames = put(ALONE.opened(SAMPLE), method="tap", samples=4)
    viewer.state = frames.keeping()  # B, too, is of the frames
    settled(viewer)
    assert [*choices._clips.values()] == [choices.subject(frames)] != [video]
    viewer.state = put(ALONE, method="tap", samples=4)
    settled(viewer)
    assert not choices._clips
