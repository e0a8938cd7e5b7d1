"""The quickest method in the stead of the one that is set: at first, and while something plays."""

from itertools import pairwise

import pytest

from viewer_hand import ALONE, SMALL, put
from wgmb import gpu
from wgmb.viewer.draw.adaptive import Pace
from wgmb.viewer.draw.detail import HALF, StandIn
from wgmb.viewer.draw.renderer import Renderer
from wgmb.viewer.draw.request import Request

FULL = 960 * 540
FEWEST = round(FULL * Pace.SCALES[HALF] ** 2)
TARGET = 1 / 24
STATE = put(ALONE, method="gather", samples=4, shading="off")
AREA = (0, 0, *SMALL)


def played(stand_in, pace, quickest, own, frames=400, unchanged=0.004):
    """For every frame whether the quickest method stood in, and the seconds that it took.

    `quickest` and `own`: seconds of a whole picture.
    """
    frames_of = []
    for number in range(frames):
        needed = stand_in.is_needed
        level = max((pace if needed else stand_in.pace).level, 1)
        pixels = FULL * pace.quality(level, 1)[0] ** 2
        uneven = 1 + 0.1 * (number % 3 - 1)
        drawing = (quickest if needed else own) * pixels / FULL * uneven
        took = unchanged + drawing
        if needed:
            pace.observe(took, drawing, 1)
        stand_in.is_kept(took, drawing, 1, round(pixels), FEWEST)
        frames_of.append((needed, took))
    return frames_of


@pytest.mark.fast
def test_a_method_that_keeps_the_rate_is_played_itself_at_half_the_width_or_more():
    stand_in, pace = StandIn(TARGET), Pace(HALF, TARGET)
    stand_in.begin(("gather",))
    stand_in.observe_still(2.0, FULL)  # with its compiling
    stand_in.observe_still(0.08, FULL)
    frames = played(stand_in, pace, 0.02, 0.08)
    assert not any(needed for needed, _ in frames[20:])
    assert all(took < 1.2 * TARGET for _, took in frames[20:])
    assert stand_in.pace.level < HALF  # finer, as far as the time allows


@pytest.mark.fast
def test_one_that_is_too_slow_is_not_even_tried_where_its_still_image_took_long():
    stand_in, pace = StandIn(TARGET), Pace(HALF, TARGET)
    stand_in.begin(("gather",))
    stand_in.observe_still(1.0, FULL)
    assert all(needed for needed, _ in played(stand_in, pace, 0.05, 1.0))


@pytest.mark.fast
def test_one_that_proves_too_slow_is_tried_ever_later():
    stand_in, pace = StandIn(TARGET), Pace(HALF, TARGET)
    stand_in.begin(("gather",))
    stand_in.observe_still(0.02, FULL)  # which was true of a machine that is busy now
    needed = [n for n, _ in played(stand_in, pace, 0.02, 0.5)]
    assert not all(needed) and all(needed[20:])
    stand_in.begin(("tiles",))  # nothing is known of it: the quickest one must take a quarter
    assert all(n for n, _ in played(stand_in, pace, 0.05, 0.2))
    tried = [n for n, _ in played(stand_in, pace, 0.003, 0.5, frames=1000)]
    begun = [i for i, (a, b) in enumerate(pairwise(tried)) if a and not b]
    assert len(begun) == 1  # its frames have told what it takes


@pytest.mark.fast
def test_one_slow_frame_does_not_end_it():
    stand_in, pace = StandIn(TARGET), Pace(HALF, TARGET)
    stand_in.begin(("gather",))
    stand_in.observe_still(0.08, FULL)
    played(stand_in, pace, 0.02, 0.08, frames=50)
    assert stand_in.is_kept(0.12, 0.1, 1, FEWEST, FEWEST) and not stand_in.is_needed
    assert not stand_in.is_kept(0.2, 0.18, 1, FEWEST, FEWEST) and stand_in.is_needed


@pytest.mark.usefixtures("as_without_a_gpu")
def test_playing_shows_the_method_that_is_set_once_it_is_quick_enough():
    for target, wanted in ((60.0, False), (1e-9, True)):
        renderer = Renderer(gpu.open_device(), target=target)
        for number in range(4):
            renderer.draw(Request(STATE, AREA), float(number))
        for number in range(9):
            state = put(STATE, frame=1 + 0.3 * number)
            drawn = renderer.draw(Request(state, AREA, moving=True), 10.0 + number)
            renderer.finished(0.01, 1)
        assert bool(drawn.report.preview) == wanted
        assert drawn.report.size[0] >= SMALL[0] // 2 or wanted
    paused = Request(state, AREA)
    for number in range(4):
        drawn = renderer.draw(paused, 20.0 + number)
    assert drawn.report.preview == "" and drawn.report.size == SMALL


@pytest.mark.usefixtures("as_without_a_gpu")
def test_first_comes_a_whole_picture_by_the_quickest_method_and_it_says_so():
    renderer = Renderer(gpu.open_device())
    seen = []
    for now in range(4):
        report = renderer.draw(Request(STATE, AREA), float(now)).report
        seen.append((report.preview, report.size, report.busy))
    assert seen[0][0] == "preview by tap at 50%" and seen[0][2]
    assert seen[1] == ("preview by tap", SMALL, True)  # in full, before what may take long
    assert seen[2:] == [("", SMALL, False)] * 2
    widths = [size[0] for _, size, _ in seen]
    assert widths == sorted(widths)  # it never jumps back


@pytest.mark.usefixtures("as_without_a_gpu")
def test_a_quick_picture_does_not_wait_for_a_slow_one_that_it_is_compared_with():
    renderer = Renderer(gpu.open_device())
    kept = put(STATE, shutter=90.0).keeping()
    state = put(kept.with_method("tap"), compare="flicker")
    seen = []
    for now in range(8):
        drawn = renderer.draw(Request(state, AREA), float(now))
        slots = renderer._slots["first"], renderer._slots["second"]
        widths = [slot.texture.size[0] for slot in slots]
        seen.append((*widths, slots[1].is_preview, drawn.report.busy))
        assert {*drawn.images} == {"first", "second"}
        if not drawn.report.busy:
            break
    whole, half = SMALL[0], SMALL[0] // 2
    assert seen[0] == (half, half, True, True)  # both at once, the slow one by `tap`
    assert seen[1] == (whole, whole, True, True)  # then in full, before what may take long
    assert seen[-1] == (whole, whole, False, False)
    for widths in ([one[0] for one in seen], [one[1] for one in seen]):
        assert widths == sorted(widths)  # it never jumps back


@pytest.mark.usefixtures("as_without_a_gpu")
def test_a_preview_tells_its_size_and_for_which_of_two_images_it_stands():
    renderer = Renderer(gpu.open_device())
    renderer.detail.pace.level = len(Pace.SCALES) - 1
    state = put(STATE, shutter=90.0).keeping().with_method("tap")
    seen = []
    for now in range(8):
        report = renderer.draw(Request(state, AREA), float(now)).report
        second = renderer._slots["second"]
        seen.append((report.size[0], second.texture.size[0], report.preview))
        if not report.busy:
            break
    small, whole = 2 * (SMALL[0] // 5,), 2 * (SMALL[0],)
    in_full = *whole, "preview by tap for B: gather"
    assert seen[0] == (*small, "preview by tap at 20% for B: gather")
    assert seen[1:-1] == [in_full] * 2 and seen[-1] == (*whole, "")


@pytest.mark.usefixtures("as_without_a_gpu")
def test_two_previews_whose_difference_says_nothing_yet_are_named():
    state = put(STATE.keeping().with_method("tiles"), compare="difference")
    report = Renderer(gpu.open_device()).draw(Request(state, AREA), 0.0).report
    assert report.preview == "preview by tap at 50% for both"
