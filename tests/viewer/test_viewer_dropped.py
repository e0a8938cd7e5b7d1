"""Files dropped onto the window, the size of the interface, and help where the mouse rests."""

import os
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from viewer_hand import ALONE, PLAIN, SAMPLE, SIZE, SMALL, Hand
from wgmb import InputError
from wgmb.viewer import controls, offscreen
from wgmb.viewer.state.dropped import pattern_of, source_of
from wgmb.viewer.state.groups import DEFAULTS, GROUP_OF, HELP
from wgmb.viewer.state.recent import RecentFiles
from wgmb.viewer.window import frame

FRAMES = sorted(Path(SAMPLE).parent.glob("crossing.*.exr"))


@pytest.fixture
def folder(tmp_path):
    """Two sequences, one of them longer, a still, and what is neither."""
    for name in ("a.001", "a.002", "b.1", "b.2", "b.3", "still"):
        iio.imwrite(tmp_path / f"{name}.png", np.zeros((4, 6, 3), np.uint8))
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


@pytest.mark.parametrize(
    ("dropped", "source"),
    [
        (["a.001.png"], "a.###.png"),
        (["a.002.png", "a.001.png"], "a.###.png"),
        (["still.png"], "still.png"),
        (["still.png", "b.1.png", "b.2.png"], "b.#.png"),
        (["."], "b.#.png"),
        (["notes.txt", "b.2.png"], "b.#.png"),
    ],
)
def test_what_is_dropped_is_the_sequence_that_it_is_of(folder, dropped, source):
    found = source_of([folder / name for name in dropped])
    assert Path(found) == folder / source


def test_what_is_neither_frames_nor_a_video_is_named(folder):
    (folder / "empty").mkdir()
    with pytest.raises(InputError, match=r"neither frames .*: empty"):
        source_of([folder / "empty"])


def test_only_the_last_number_of_a_name_is_left_open():
    assert pattern_of(Path("/x/shot2_v03.0107.exr")) == "/x/shot2_v03.####.exr"


def test_files_settings_and_nonsense_are_dropped_onto_the_window(tmp_path):
    viewer = offscreen(ALONE, SMALL)
    viewer.dropped([str(FRAMES[0])])
    assert viewer.state.source == SAMPLE and not viewer.state.is_scene
    viewer.dropped([str(tmp_path)])
    assert "neither frames" in viewer.message[0] and viewer.state.source == SAMPLE
    (tmp_path / "s.toml").write_text(ALONE.with_settings(samples=9).toml())
    viewer.dropped([str(tmp_path / "s.toml")])
    assert viewer.state.source == "crossing" and viewer.state.blur.samples == 9


def test_the_interface_has_a_size_of_its_own(tmp_path):
    plain = offscreen(ALONE, (1280, 720))
    large = offscreen(ALONE, (1280, 720), interface=2.0)
    for viewer in (plain, large):
        viewer.state = viewer.state.with_settings(antialias=1)
        viewer.state = controls.key(viewer.state, viewer._layout(), "Tab")[0]
        frame(viewer)
    assert plain.panel.places["play"][2] == large.panel.places["play"][2]  # in its own pixels
    assert plain._area_px()[2] == 1280 - 320 and large._area_px()[2] == 1280 - 640
    x, y, width, height = large.panel.places["play"]
    middle = {"x": 2 * (x + width / 2), "y": 2 * (y + height / 2)}
    for kind in ("pointer_move", "pointer_down", "pointer_up"):
        event = {"event_type": kind, "button": 1, "buttons": (1,), "modifiers": (), **middle}
        large.canvas.submit_event(event)
        frame(large)
    assert large.state.playing
    large._on_key("-")
    assert large.canvas.scale == pytest.approx(1.6) and "160%" in large.message[0]


def test_exposure_goes_in_steps_by_keys():
    layout = controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9))
    state = ALONE
    for key, exposure in (("]", 0.5), ("]", 1.0), ("[", 0.5), ("0", 0.0)):
        state = controls.key(state, layout, key)[0]
        assert state.exposure == exposure


def test_every_option_has_help_and_the_command_is_a_button():
    assert HELP.keys() >= GROUP_OF.keys() and all(HELP[name] for name in GROUP_OF)
    assert HELP.keys() <= DEFAULTS.keys()
    hand = Hand(size=(SIZE[0], 720))
    for name in ("screenshot", "record", "copy command"):
        _, y, _, height = hand.viewer.panel.places[name]
        assert y + height < 200
    hand.touch("copy command")
    assert hand.viewer.message[0] == "copied"


def test_files_that_were_shown_can_be_opened_again(tmp_path, folder):
    kept = tmp_path / "state/wgmb/recent.json"
    hand = Hand(PLAIN)
    hand.viewer._recent = RecentFiles(kept)
    hand.viewer.dropped([str(FRAMES[0])])
    hand.look_until(lambda: kept.exists())
    still = folder / "still.png"
    hand.viewer.dropped([str(still)])
    hand.look_until(lambda: hand.viewer._recent.sources[0] == str(still))
    again = RecentFiles(kept)
    assert again.sources == [str(still), os.path.abspath(SAMPLE)]
    hand.choose("shown", os.path.abspath(SAMPLE))
    assert hand.state.source == os.path.abspath(SAMPLE)
    still.unlink()
    hand.look(1.0)
    hand.choose("shown", str(still))  # which is there no more
    assert hand.state.source == os.path.abspath(SAMPLE) and "still.png" in hand.viewer.message[0]
    for _ in range(2):
        for number in range(10):
            again.add(str(tmp_path / f"{number}.mp4"))
    assert len(again.sources) == 8 and again.sources[0].endswith("9.mp4")


@pytest.mark.parametrize("text", ["", "[1, 2]", '{"a": 1}', "[", "\x00"])
def test_a_list_of_files_that_is_damaged_is_an_empty_one(tmp_path, text):
    (tmp_path / "recent.json").write_text(text)
    recent = RecentFiles(tmp_path / "recent.json")
    assert recent.sources == []
    recent.add("a.mp4")
    assert RecentFiles(tmp_path / "recent.json").sources == [os.path.abspath("a.mp4")]


def test_a_list_that_cannot_be_written_stops_nothing(tmp_path):
    (tmp_path / "file").write_text("")
    recent = RecentFiles(tmp_path / "file" / "recent.json")
    recent.add("a.mp4")
    assert recent.sources == [os.path.abspath("a.mp4")]
