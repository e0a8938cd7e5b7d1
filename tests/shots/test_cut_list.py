"""Cuts that are known beforehand: numbers, edit decision lists and timelines give the same ones."""

import re
import sys

import numpy as np
import opentimelineio as otio
import pytest

import make_frames as make
from wgmb import Clip, InputError
from wgmb.extras import install_command
from wgmb.shots.cut_list import CutList

pytestmark = pytest.mark.fast

SHOTS = ((0, 3), (3, 5), (8, 2))  # first frame and number of frames, at 24 per second


def timecode(frame: int, fps: int = 24, mark: str = ":", start: int = 3600) -> str:
    seconds, frames = divmod(frame + start * fps, fps)
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}{mark}{frames:02}"


def event(number, first, frames, kind="C", track="V", **how) -> str:
    """A line of an edit decision list."""
    source = (timecode(100, **how), timecode(100 + frames, **how))
    record = (timecode(first, **how), timecode(first + frames, **how))
    return f"{number:03}  REEL{number} {track:5} {kind:8} {' '.join((*source, *record))} \n"


def edl(path, lines, title="TITLE:   edit\nFCM: NON-DROP FRAME\n"):
    path.write_text(title + "".join(lines))
    return str(path)


def shots(path, **how) -> str:
    return edl(path, [event(i, *shot, **how) for i, shot in enumerate(SHOTS, 1)])


def moment(frames, rate=24):
    return otio.opentime.RationalTime(frames, rate)


def clip(frames, rate=24, enabled=True):
    media = otio.opentime.TimeRange(moment(100, rate), moment(frames, rate))
    made = otio.schema.Clip(source_range=media)
    made.enabled = enabled
    return made


def gap(frames):
    return otio.schema.Gap(duration=moment(frames))


def timeline(path, *tracks, kind=otio.schema.TrackKind.Video) -> str:
    made = otio.schema.Timeline()
    for children in tracks:
        made.tracks.append(otio.schema.Track(children=list(children), kind=kind))
    otio.adapters.write_to_file(made, str(path))
    return str(path)


# ---- the same edit in three forms -----------------------------------------------------------


@pytest.mark.parametrize("first", [1, 101, -3])
def test_a_list_an_edl_and_a_timeline_give_the_same_cuts(tmp_path, first):
    want = {first + 3, first + 8}
    listed = ",".join(map(str, sorted(want)))
    told = (
        listed,
        shots(tmp_path / "cut.edl"),
        shots(tmp_path / "b.edl", fps=25) + "@25",
        timeline(tmp_path / "cut.otio", [clip(frames) for _, frames in SHOTS]),
    )
    for text in told:
        for given, is_search in ((text, True), (f"only:{text}", False)):
            cuts = CutList(given)
            assert cuts.frames(first) == want
            assert cuts.is_search == is_search
    assert CutList("").frames(first) == set()


def test_an_edit_begins_with_the_clips_first_frame(tmp_path):
    pattern = make.write_sequence(tmp_path, range(101, 111))
    found = Clip(pattern, frames="104-110", cuts=shots(tmp_path / "cut.edl"))
    frame = found.frame(found.source(104)).motion  # the first of its shot
    np.testing.assert_array_equal(frame[..., :2], -frame[..., 2:])
    assert found.cuts == {104}
    assert not found.stray_cuts


# ---- edit decision lists --------------------------------------------------------------------


def test_dissolves_wipes_gaps_and_comments_are_understood(tmp_path):
    lines = [
        event(1, 0, 9),
        "* FROM CLIP NAME:  clip_A\n",
        event(2, 9, 0),
        event(2, 9, 10, "D    010"),
        "* BLEND, DISSOLVE\n",
        event(3, 19, 0),
        event(3, 19, 5, "W001 010"),
        "M2   REEL3       047.6                01:00:06:00 \n",
        event(4, 30, 5),  # six frames of nothing before it
        event(5, 30, 5, track="A2"),
        event(6, 31, 90, track="AA"),
        event(7, 35, 5, track="AA/V"),
        event(8, 40, 5, track="B"),
    ]
    assert CutList(edl(tmp_path / "a.edl", lines)).frames(0) == {9, 19, 24, 30, 35, 40}


def test_lines_may_end_in_any_way_and_begin_with_a_mark(tmp_path):
    path = tmp_path / "A.EDL"
    text = "".join(event(i, *shot) for i, shot in enumerate(SHOTS, 1))
    path.write_bytes(("\ufeffTITLE: Zoë\n" + text).replace("\n", "\r\n").encode())
    assert CutList(str(path)).frames(0) == {3, 8}
    path.write_bytes(b"TITLE: Zo\xeb\n" + text.encode())
    assert CutList(str(path)).frames(0) == {3, 8}


@pytest.mark.parametrize(
    ("rate", "nominal"), [("23.976", 24), ("24000/1001", 24), ("29.97", 30), ("60", 60)]
)
def test_timecode_counts_whole_frames(tmp_path, rate, nominal):
    text = edl(
        tmp_path / "a.edl", [event(1, 0, nominal, fps=nominal), event(2, nominal, 5, fps=nominal)]
    )
    assert CutList(f"{text}@{rate}").frames(0) == {nominal}


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["FCM: DROP FRAME\n", event(1, 0, 5), event(2, 5, 5)], "drop frame"),
        ([event(1, 0, 5, mark=";"), event(2, 5, 5, mark=";")], "drop frame"),
        ([event(1, 0, 5, fps=30), event(2, 25, 5, fps=30)], r"01:00:00:25 .* 24 .*a\.edl@25"),
        ([event(1, 0, 5, track="A")], "no video events"),
        (["nothing\n"], "no video events"),
        ([], "no video events"),
    ],
)
def test_an_edl_that_cannot_be_understood_is_one_line_that_names_it(tmp_path, lines, says):
    text = edl(tmp_path / "a.edl", lines, title="")
    with pytest.raises(InputError, match=says) as error:
        CutList(text).frames(0)
    assert text in str(error.value)
    assert "\n" not in str(error.value)


# ---- timelines ------------------------------------------------------------------------------


def test_gaps_transitions_nested_and_disabled_clips_of_all_video_tracks_count(tmp_path):
    nested = otio.schema.Track(children=[clip(4), clip(40)])
    nested.source_range = otio.opentime.TimeRange(moment(0), moment(10))
    cross = otio.schema.Transition(in_offset=moment(1), out_offset=moment(1))
    first = [gap(2), clip(5), cross, clip(5), gap(3), nested, clip(5)]
    second = [gap(10), clip(1), clip(1, enabled=False), clip(3)]
    text = timeline(tmp_path / "a.otio", first, second)
    assert CutList(text).frames(0) == {2, 7, 12, 15, 19, 25} | {10, 11}


def test_the_rate_is_the_timelines_or_the_one_given(tmp_path):
    text = timeline(tmp_path / "a.otio", [clip(50, 50), clip(25, 50)])
    assert CutList(text).frames(0) == {50}
    assert CutList(f"{text}@25").frames(0) == {25}


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not a readable"),
        (b"[]", "no clips on video"),
        (b'{"OTIO_SCHEMA":"Timeline.99"}', "not a readable"),
        (200_000 * b"[", "nested"),
        (b'{"OTIO_SCHEMA":"Clip.1"}', "no clips on video"),
        (b"\xff\xfe", "not a readable"),
    ],
)
def test_a_timeline_that_cannot_be_understood_is_one_line_that_names_it(tmp_path, content, says):
    path = tmp_path / "a.otio"
    path.write_bytes(content)
    with pytest.raises(InputError, match=says) as error:
        CutList(str(path)).frames(0)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_timeline_of_sounds_has_no_cuts(tmp_path):
    text = timeline(tmp_path / "a.otio", [clip(5)], kind=otio.schema.TrackKind.Audio)
    with pytest.raises(InputError, match="no clips on video tracks"):
        CutList(text).frames(0)


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    text = timeline(tmp_path / "a.otio", [clip(5), clip(5)])
    monkeypatch.setitem(sys.modules, "opentimelineio", None)
    with pytest.raises(InputError, match=re.escape(install_command("edit"))):
        CutList(text).frames(0)
    assert CutList(shots(tmp_path / "a.edl")).frames(0) == {3, 8}


# ---- what is wrong, and what changes nothing ------------------------------------------------


@pytest.mark.parametrize(
    ("cuts", "says"),
    [
        ("no.edl", r"no\.edl: no such file"),
        ("no.otio@24", r"no\.otio: no such file"),
        ("cut.xml", r"\.edl or \.otio"),
        ("cut.edl@x", "rate"),
        ("cut.edl@0", "rate"),
        ("cut.edl@1/0", "rate"),
        ("cut.edl@nan", "rate"),
        ("only:", "must name cuts"),
        ("only:x", "cuts 'x': must be whole numbers"),
        ("0.5", "cuts '0.5': must be whole"),
    ],
)
def test_senseless_cuts_are_one_line(tmp_path, monkeypatch, cuts, says):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=says):
        Clip(make.write_sequence(tmp_path, [1, 2]), cuts=cuts)


def test_cuts_that_no_frame_has_are_known(tmp_path):
    pattern = make.write_sequence(tmp_path, [1, 2, 3])
    assert Clip(pattern, cuts="2,4,5,9").stray_cuts == [5, 9]  # 4: after the last frame


@pytest.mark.parametrize("cuts", ["only:9", "only:3", "none"])
def test_no_cut_is_looked_for_where_all_are_known(tmp_path, cuts):
    """Two shots, as test_cuts.py has them; the second begins with frame 4."""
    pattern = make.write_sequence(tmp_path, [1, 2, 3])
    for n in (4, 5):
        channels = {k: v[::-1, ::-1].copy() for k, v in make.frame(n - 3).items()}
        make.write_exr(tmp_path / f"shot.{n:04d}.exr", channels)
    found = Clip(pattern, cuts=cuts)
    near = [found.with_neighbours(found.source(n)) for n in found.numbers]
    cut = cuts == "only:3"
    assert [f.next is not None for f in near] == [True, not cut, True, True, False]
    assert found.cuts == ({3} if cut else set())


def test_a_file_of_cuts_is_an_input(tmp_path):
    pattern = make.write_sequence(tmp_path, range(1, 11))
    text = shots(tmp_path / "cut.edl")
    found = Clip(pattern, cuts=f"only:{text}@24")
    assert tmp_path / "cut.edl" in found.dependencies.of(3)
    before = found.made_of(3, reach=0)
    edl(tmp_path / "cut.edl", [event(1, 0, 5), event(2, 5, 6)])
    assert Clip(pattern, cuts=f"only:{text}@24").made_of(3, reach=0) != before
