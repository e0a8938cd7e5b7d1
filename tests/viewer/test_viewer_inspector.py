"""Numbers under the mouse, the histogram and arrows of motion."""

import time

import numpy as np
import pytest
from imgui_bundle import imgui

from viewer_hand import ALONE, SAMPLE, Hand, library, put
from wgmb import gpu
from wgmb.methods import METHODS
from wgmb.viewer import controls, offscreen
from wgmb.viewer.draw.inspected import Inspected
from wgmb.viewer.draw.renderer import Renderer
from wgmb.viewer.draw.request import Available, Request
from wgmb.viewer.panel import inspector, scopes
from wgmb.viewer.window import frame

SIZE = 320, 180


@pytest.fixture(scope="module")
def hand():
    made = Hand(put(ALONE, inspect=True), SIZE)
    made.picture()
    return made


def test_the_numbers_are_those_of_the_picture_and_of_its_passes(hand):
    drawn = hand.viewer._drawn
    under = drawn.under
    assert under.keys() == {"light", "depth", "motion"}
    np.testing.assert_array_equal(under["light"], hand.viewer.stage.download())
    at = 0.4, 0.6
    text = inspector.lines(hand.state, drawn.available, under, at, np.array([0.0, 0.5, 1.0]))
    x, y = int(0.4 * SIZE[0]), int(0.6 * SIZE[1])
    light = under["light"][y, x]
    assert text[1] == f"pixel    {x}, {y} of 320 x 180"
    assert text[2] == "linear   " + " ".join(f"{value:.4g}" for value in light)
    assert text[3] == "display  0 128 255"
    to_next = under["motion"][y, x, 2:]
    assert text[4].startswith(f"next     {to_next[0]:+.2f}, {to_next[1]:+.2f} px")
    assert text[6] == f"depth    {under['depth'][y, x, 0]:.4g}"


def test_it_tells_how_sure_gather_is_of_the_pixel():
    state = put(ALONE, method="gather", inspect=True)
    hand = Hand(state, (96, 54))
    hand.picture()
    under, available = hand.viewer._drawn.under, hand.viewer._drawn.available
    sure = under["confidence"]
    render, moment = library(put(state, look="confidence"), (96, 54))
    np.testing.assert_allclose(sure, render(*moment), atol=1e-3)
    assert sure[..., 0].min() < 0.9 < sure[..., 0].max()
    text = inspector.lines(state, available, under, (0.4, 0.6), None)
    values = sure[int(0.6 * 54), int(0.4 * 96)]
    names = ("accepted", "disocclusion", "residual", "left")
    want = [f"{name} {value:.2f}" for name, value in zip(names, values, strict=True)]
    assert text[-4:] == want
    hand.viewer.state = put(state, inspect=False, arrows=True)  # which need no second blur
    hand.picture()
    assert "confidence" not in hand.viewer._drawn.under


def test_the_displayed_value_is_what_is_on_the_screen(hand):
    picture = hand.viewer.screen.picture()
    for x, y in ((0, 0), (100, 50), (319, 179)):
        np.testing.assert_array_equal(hand.viewer.screen.values(x + 0.5, y + 0.5), picture[y, x])
    assert hand.viewer.screen.values(320, 0) is None


def test_the_mouse_over_the_picture_changes_the_text_and_i_takes_it_away(hand, monkeypatch):
    texts = []
    monkeypatch.setattr(inspector, "show", lambda text, *_: texts.append(text))
    for x in (30, 200):
        hand.submit("pointer_move", x=x, y=90, button=0, buttons=())
        hand.look()
    assert texts[-1] != texts[0] and "200, 90" in texts[-1][1]
    hand.submit("pointer_move", x=-5, y=90, button=0, buttons=())
    hand.look()
    assert len(texts[-1]) == 1
    count = len(texts)
    hand.press("i")
    assert len(texts) <= count + 1 and not hand.state.inspect
    hand.press("i")


def test_frames_on_disk_have_the_vectors_that_are_in_the_file():
    hand = Hand(put(ALONE.opened(SAMPLE), arrows=True, method="tap"), SIZE)
    hand.picture()
    under = hand.viewer._drawn.under
    subject = hand.viewer.stage.choices.subject(hand.state)
    frame = subject._frame(subject._now)
    np.testing.assert_array_equal(under["depth"][..., 0], frame.depth)
    assert np.abs(under["motion"]).max() > 1
    text = inspector.lines(hand.state, hand.viewer._drawn.available, under, (0.5, 0.5), None)
    assert text[1] == "layer    ViewLayer.Combined, depth ViewLayer.Depth.Z"


def available(methods, looks):
    return Available(list(methods), list(looks), [], [], {})


def test_it_says_which_method_and_why():
    state = put(ALONE, samples=None)
    assert (
        inspector.method_line(state, available(METHODS, ["result", "depth"]))
        == "method   tap, 16 samples"
    )
    flat = available(["tap", "tiles"], ["result", "velocity"])
    assert inspector.method_line(state, flat) == "method   tap, 16 samples (no depth)"


@pytest.mark.usefixtures("as_without_a_gpu")
def test_a_preview_is_not_called_by_the_method_that_it_stands_for():
    state, can = put(ALONE, method="gather"), available(METHODS, ["result", "depth"])
    assert inspector.method_line(state, can, True) == "method   tap, a preview of gather"
    assert inspector.lines(state, can, {}, (0.5, 0.5), None, True)[0].startswith("method   tap")
    texts = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inspector, "show", lambda text, *_: texts.append(text[0]))
        state = put(ALONE, method="gather", samples=4, shading="off", inspect=True)
        hand = Hand(state, (96, 54))
        assert hand.viewer.stage.report.preview.startswith("preview by tap")
        hand.picture()
    assert "a preview of gather" in texts[0] and texts[-1] == "method   gather, 4 samples"


@pytest.mark.usefixtures("as_without_a_gpu")
def test_numbers_of_a_preview_are_there_while_the_picture_is_drawn(monkeypatch):
    texts = []
    monkeypatch.setattr(inspector, "show", lambda text, *_: texts.append(text))
    viewer = offscreen(put(ALONE, method="gather", samples=4), (320, 180), threaded=True)
    event = {"event_type": "pointer_move", "x": 30, "y": 90, "button": 0, "buttons": ()}
    viewer.canvas.submit_event(event)
    while not viewer._drawn:
        frame(viewer)
        time.sleep(0.01)
    viewer.state = put(viewer.state, inspect=True)  # once the preview is there
    frame(viewer)
    assert viewer._drawn.report.preview and {*viewer._drawn.under} == {"light"}
    assert texts[-1][0] == "method   tap, a preview of gather"
    assert texts[-1][2].startswith("linear   ") and "..." not in texts[-1]
    viewer.close()


def test_the_histogram_counts_pixels_by_stops():
    light = np.full((4, 8, 4), 0.25, np.float32)
    light[0] = 4.0
    light[1, :, :3] = np.inf
    light[2, :, :3] = 0.0
    shares = scopes.histogram(light)
    low, high = scopes.STOPS
    width = (high - low) / len(shares)
    want = {int((-2 - low) / width): 0.25, int((2 - low) / width): 0.25, 63: 0.25, 0: 0.25}
    assert {i: s for i, s in enumerate(shares) if s} == pytest.approx(want)


def test_numbers_do_not_wait_for_the_confidence_which_takes_as_long_as_the_picture():
    state = put(ALONE, method="gather", samples=4, shading="off", inspect=True)
    renderer = Renderer(gpu.open_device())
    seen = []
    for now in range(12):
        drawn = renderer.draw(Request(state, (0, 0, 96, 54)), float(now))
        seen.append(({*drawn.under}, drawn.report.busy))
        if not drawn.report.busy:
            break
    first = {"light", "depth", "motion"}
    assert seen[-3:] == [(set(), True), (first, True), (first | {"confidence"}, False)]


def test_its_window_is_large_enough_for_what_comes_late(monkeypatch):
    call, waits = Inspected.__call__, [None] * 6

    def late(*arguments):
        under = call(*arguments)
        if "confidence" in under and waits:
            waits.pop()
            arguments[-1].busy = True
            return {name: array for name, array in under.items() if name != "confidence"}
        return under

    monkeypatch.setattr(Inspected, "__call__", late)
    state = put(ALONE, method="gather", samples=4, shading="off", inspect=True)
    hand = Hand(state, (640, 480))
    viewer, wanted, heights = hand.viewer, [True], []
    viewer.canvas.request_draw = lambda: wanted.append(True)
    hand.submit("pointer_move", x=320, y=240, button=0, buttons=())
    while wanted:  # as a window is drawn: only if somebody asks for it
        wanted.clear()
        hand.look()
        heights.append(window_height(viewer))
    for _ in range(3):
        hand.look()
    assert window_height(viewer) == heights[-1] > heights[0]


def window_height(viewer):
    imgui.set_current_context(viewer._imgui.imgui_context)
    window = imgui.internal.find_window_by_name("inspector")
    return window.size.y if window else 0.0


@pytest.mark.parametrize("width", [60, 240, 1920])
def test_the_waveform_is_the_histogram_of_each_column(width):
    stops = np.linspace(-9.0, 5.9, 8)
    light = np.zeros((64, width, 3), np.float32)
    light[32:] = 2.0 ** stops[np.arange(width) * 8 // width][:, None]  # a ramp below black
    table = scopes.waveform(light)
    rows, columns = table.shape
    low, high = scopes.STOPS
    for step, column in enumerate(range(columns // 16, columns, columns // 8)):
        want = np.zeros(rows, np.float32)
        above = int((stops[step] - low) / (high - low) * rows)
        want[rows - 1], want[rows - 1 - above] = 0.5, 0.5
        np.testing.assert_allclose(table[:, column], want, atol=1e-6)


def test_arrows_lead_to_where_the_next_frame_has_the_pixel():
    motion = np.zeros((90, 160, 4), np.float32)
    motion[:, 80:] = 9, 9, 10, -4
    motion[:45, 80:] = np.nan
    found = inspector.arrows(motion, (0, 0, 320, 180), (40, 0, 280, 180))
    assert found and all(x >= 160 and y >= 90 for x, y, _, _ in found)
    assert all((to_x - x, to_y - y) == pytest.approx((20, -8)) for x, y, to_x, to_y in found)


def test_the_keys_are_toggles():
    layout = controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9))
    state = controls.key(controls.key(ALONE, layout, "i")[0], layout, "a")[0]
    assert state.inspect and state.arrows and state.picture == ALONE.picture
