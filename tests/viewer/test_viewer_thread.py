"""Drawing beside the window: the same bits, and a window that goes on meanwhile."""

import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import wgpu

import make_clips as clips
from viewer_hand import ALONE, SAMPLE, SMALL, put
from wgmb import InputError, gpu
from wgmb.gpu.timing import WallClock
from wgmb.io import exr
from wgmb.scene import gbuffer
from wgmb.sequence.layers.vector_convention import ConventionFinder
from wgmb.viewer import offscreen
from wgmb.viewer.draw import draw_thread
from wgmb.viewer.draw.composer import NOTHING, Composer
from wgmb.viewer.draw.portions import DroppedError, Portions
from wgmb.viewer.draw.quality import Quality
from wgmb.viewer.draw.renderer import Renderer
from wgmb.viewer.draw.request import Request
from wgmb.viewer.panel import overlay
from wgmb.viewer.panel.sections import short_name
from wgmb.viewer.window import frame

STATE = put(ALONE, method="gather", samples=4, shading="off")
AREA = (0, 0, *SMALL)


@pytest.fixture
def viewer():
    made = offscreen(STATE, SMALL, threaded=True)
    yield made
    made.close()


def seen_until(viewer, done):
    """Frames of the window until `done`; it is never asked to wait."""
    for _ in range(3000):
        frame(viewer)
        if done():
            return
        time.sleep(0.01)
    raise AssertionError("never done")


def is_final(viewer):
    return viewer._is_answered and not viewer.stage.report.busy


class Gate:
    """Lets the thread draw once it is open."""

    def __init__(self, monkeypatch):
        self.opened, self.entered = threading.Event(), threading.Event()
        draw = Renderer.draw

        def held(renderer, request, now):
            self.entered.set()
            self.opened.wait(60)
            return draw(renderer, request, now)

        monkeypatch.setattr(Renderer, "draw", held)


def whole(state):
    """The final picture, drawn in one go."""
    renderer = Renderer(gpu.open_device())
    renderer.draw(Request(state, AREA, full=True), 0.0)
    return renderer.download()


def test_parts_give_the_same_bits_as_the_whole(viewer):
    seen_until(viewer, lambda: is_final(viewer))
    np.testing.assert_array_equal(viewer.stage.download(), whole(STATE))
    assert viewer.stage.report.preview == ""


def test_the_window_goes_on_while_something_is_drawn(monkeypatch):
    gate = Gate(monkeypatch)
    viewer = offscreen(STATE, SMALL, threaded=True)
    try:
        frame(viewer)
        assert gate.entered.wait(60)
        for _ in range(3):  # each of them returns
            frame(viewer)
        assert viewer._drawn is None
        gate.opened.set()
        seen_until(viewer, lambda: is_final(viewer))
        gate.opened.clear()
        gate.entered.clear()
        viewer.state = put(STATE, shutter=90.0)
        frame(viewer)
        assert gate.entered.wait(60)
        before = viewer.screen.picture()
        viewer.state = put(viewer.state, exposure=1.0)  # needs nothing of the thread
        frame(viewer)
        assert viewer.screen.picture().mean() > before.mean() + 0.02
        gate.opened.set()
    finally:
        gate.opened.set()
        viewer.close()


def test_words_over_a_picture_come_with_it(viewer, monkeypatch):
    opened, written, compose = threading.Event(), [], Composer.compose
    opened.set()

    def held(self, view):
        opened.wait(60)
        compose(self, view)

    monkeypatch.setattr(Composer, "compose", held)
    monkeypatch.setattr(overlay, "tag", lambda text, *_, **__: written.append(text))
    seen_until(viewer, lambda: is_final(viewer) and viewer.screen._is_current())
    opened.clear()
    viewer.state = put(STATE, look="depth")
    seen_until(viewer, lambda: is_final(viewer))
    written.clear()
    frame(viewer)
    assert "depth" not in written and "far" not in written
    opened.set()
    seen_until(viewer, lambda: {"depth", "far"} <= {*written})


@pytest.mark.usefixtures("as_without_a_gpu")
def test_frames_are_first_shown_as_they_are_before_their_vectors_are_tested(monkeypatch):
    tested, finding = [], ConventionFinder.finding
    watched = property(lambda self: tested.append(self) or finding.__get__(self))
    monkeypatch.setattr(ConventionFinder, "finding", watched)
    renderer = Renderer(gpu.open_device())
    state = put(ALONE.opened(SAMPLE), method="gather", samples=4, shading="off")
    first = renderer.draw(Request(state, AREA), 0.0)
    assert not tested and first.state == state == first.corrected(state)
    assert first.report.waiting == "sharp: testing the vectors" and first.report.busy
    file = exr.read(Path(SAMPLE.replace("####", f"{int(state.frame):04d}"))).parts[0]
    sharp = renderer.download()
    for i, channel in enumerate("RGB"):
        plane = next(v for k, v in file.channels.items() if k.rpartition(".")[2] == channel)
        np.testing.assert_array_equal(sharp[..., i], plane.astype(np.float32))
    second = renderer.draw(Request(state, AREA), 1.0)
    assert tested and "vectors: " in second.available.finding and not second.report.waiting
    for now in range(2, 9):
        report = renderer.draw(Request(state, AREA), float(now)).report
    assert not report.busy and report.preview == ""
    np.testing.assert_array_equal(renderer.download(), whole(state))


@pytest.mark.usefixtures("as_without_a_gpu")
def test_a_look_and_a_comparison_at_once_are_shown_one_after_the_other(viewer):
    seen_until(viewer, lambda: is_final(viewer))
    viewer.state = put(STATE, look="depth", compare="wipe", against="tiles")
    seen_until(viewer, lambda: is_final(viewer))
    first, second = viewer._drawn.sides(False)
    assert first.kind == "DEPTH" and second.kind == "COLOR" and second.array.any()


def test_an_image_is_not_measured_against_the_reference_of_another_size(monkeypatch):
    monkeypatch.setattr(Quality, "ENOUGH", 1)
    renderer = Renderer(gpu.open_device())
    state = put(STATE.with_method("tap"), look="error")
    for now in range(60):
        report = renderer.draw(Request(state, AREA), float(now)).report
        if report.measured:
            break
    assert report.measured
    larger = Request(state, (0, 0, 2 * SMALL[0], 2 * SMALL[1]))
    reports = [renderer.draw(larger, float(now)).report for now in range(60, 64)]
    assert reports[-1].size == (2 * SMALL[0], 2 * SMALL[1])


def test_a_side_that_is_not_drawn_yet_does_not_flicker(viewer):
    seen_until(viewer, lambda: is_final(viewer))
    first, second = viewer._drawn.sides(True)
    assert first is viewer._drawn.images["first"] and second is NOTHING


def test_work_that_nobody_wants_is_dropped_between_two_passes_and_leaves_nothing_behind():
    device = gpu.open_device()
    left = [10**9]

    def wanted():
        left[0] -= 1
        return left[0] > 0

    renderer = Renderer(device, Portions(device, wanted))
    full = Request(STATE, AREA, full=True)
    for passes in (1, 5, 12):
        left[0] = passes
        with pytest.raises(DroppedError):
            renderer.draw(full, 0.0)
        assert left[0] == 0
    left[0] = 10**9
    renderer.draw(full, 0.0)
    np.testing.assert_array_equal(renderer.download(), whole(STATE))


@pytest.mark.usefixtures("as_without_a_gpu")
def test_every_pass_has_its_time_although_the_first_one_found_the_queue_busy(monkeypatch):
    run = WallClock._run
    monkeypatch.setattr(WallClock, "_run", lambda self, encoder: 9.0 + run(self, encoder))
    portions = Portions(gpu.open_device(), lambda: True)
    monkeypatch.undo()
    report = Renderer(portions.device, portions).draw(Request(STATE, AREA, full=True), 0.0).report
    assert len(report.passes) > 20 and all(seconds > 0 for seconds in report.passes.values())
    assert sum(report.passes.values()) < report.seconds["draw"]
    names = {short_name(name) for name in report.passes}
    assert {"resolve main", "gbuffer main"} <= names and max(map(len, names)) < 36


def test_the_first_preview_is_dropped_after_any_band_of_a_scene(monkeypatch):
    device, passes = gpu.open_device(), []
    portions = Portions(device, lambda: len(passes) < 2)
    take = portions.take
    monkeypatch.setattr(portions, "take", lambda *given: passes.append(given[0]) or take(*given))
    monkeypatch.setattr(gbuffer, "_BAND", 1 << 12)
    renderer = Renderer(device, portions)
    with pytest.raises(DroppedError):
        renderer.draw(Request(STATE, AREA), 0.0)
    assert passes == ["scene/gbuffer.wgsl:main"] * 2
    passes.clear()
    assert renderer.draw(Request(STATE, AREA, moving=True), 0.0).report.changed  # is not dropped


def test_no_pass_is_begun_any_more_once_its_kernel_is_compiled():
    portions = Portions(gpu.open_device(), lambda: False)
    with pytest.raises(DroppedError):
        portions.watch(None).begin_compute_pass(label="any")


def test_another_setting_drops_what_is_drawn_but_playing_does_not(viewer):
    stage = viewer.stage
    still, moving = Request(STATE, AREA), Request(STATE, AREA, moving=True)
    other = Request(put(STATE, shutter=90.0), AREA)
    seen_until(viewer, lambda: is_final(viewer))
    for drawing, now, want in ((still, other, False), (moving, other, True), (still, still, True)):
        stage._drawing, stage._wanted = drawing, now
        assert stage._is_wanted() == want
    shown = Request(put(STATE, exposure=2.0, wipe=0.1), AREA)
    stage._drawing, stage._wanted = still, shown
    assert stage._is_wanted()


def test_a_frame_that_cannot_be_shown_just_now_is_tried_again(viewer, monkeypatch):
    seen_until(viewer, lambda: is_final(viewer))
    texture, left = viewer._context.get_current_texture, [2]

    def covered():
        left[0] -= 1
        if left[0] >= 0:
            raise wgpu.DrawCancelled("Occluded")
        return texture()

    monkeypatch.setattr(viewer._context._context, "get_current_texture", covered)
    viewer.state = put(STATE, exposure=1.0)
    for _ in range(3):
        viewer.canvas.force_draw()
        assert viewer.failed is None
    assert left[0] < 0
    frame(viewer)


def test_what_goes_wrong_after_drawing_ends_the_viewer_too(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("broken")

    monkeypatch.setattr(draw_thread._Downloads, "answer", broken)
    viewer = offscreen(STATE, SMALL, threaded=True)
    with pytest.raises(ZeroDivisionError, match="broken"):
        seen_until(viewer, lambda: False)
    viewer.close()


def test_what_cannot_be_drawn_is_a_message_and_the_last_state_stays(viewer):
    seen_until(viewer, lambda: is_final(viewer))
    viewer.state = put(STATE, source="fence", set=("posts=900",))
    seen_until(viewer, lambda: "posts" in viewer.message[0])
    assert viewer.state == STATE


def test_a_state_that_cannot_be_drawn_at_first_ends_the_viewer():
    viewer = offscreen(put(STATE, set=("posts=1",)), SMALL, threaded=True)
    with pytest.raises(InputError, match="posts"):
        seen_until(viewer, lambda: False)
    viewer.close()


def test_a_video_is_opened_while_a_scene_is_still_on_the_screen(tmp_path, monkeypatch):
    video = clips.write(tmp_path / "a.mp4")
    viewer = offscreen(put(STATE, panel=True), (640, 360), threaded=True)
    try:
        seen_until(viewer, lambda: is_final(viewer))
        gate = Gate(monkeypatch)
        viewer.dropped([str(video)])
        for _ in range(2):  # the panel is about the video, the picture is still that of the scene
            frame(viewer)
        assert viewer.state.source == str(video) != viewer._drawn.state.source
        gate.opened.set()
        seen_until(viewer, lambda: viewer._drawn.state.source == str(video))
    finally:
        viewer.close()


def test_what_goes_wrong_in_the_panel_is_what_ends_the_viewer(viewer, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("broken")

    monkeypatch.setattr("wgmb.viewer.panel.overlay.tell", broken)
    with pytest.raises(ZeroDivisionError, match="broken"):
        seen_until(viewer, lambda: False)


@pytest.mark.full
def test_a_recording_has_every_frame_in_full(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    added = []
    seen_until(viewer, lambda: is_final(viewer))
    viewer.state = put(STATE, method="tap", frame=0.0)
    viewer.do("record")
    monkeypatch.setattr(viewer.actions._video, "add", lambda picture: added.append(picture))
    monkeypatch.setattr(viewer.actions._video, "close", lambda: None)
    seen_until(viewer, lambda: len(added) >= 3)
    steps = viewer.state.frame / viewer.state.speed  # one between two, perhaps one before them
    assert steps == pytest.approx(round(steps)) and len(added) - round(steps) in (0, 1)
    assert all(np.abs(a - b).mean() > 1e-3 for a, b in pairwise(added))


def test_the_thread_ends_with_the_window():
    viewer = offscreen(STATE, SMALL, threaded=True)
    frame(viewer)
    viewer.close()
    assert not viewer.stage._thread.is_alive() and not viewer.screen._thread.is_alive()
