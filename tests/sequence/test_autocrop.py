"""Frames cropped to what is in them give the same pictures as whole ones."""

import json
from pathlib import Path

import numpy as np
import pytest

import wgmb
from wgmb import Blur, Clip, Shutter
from wgmb.cli.app import main as command
from wgmb.extent import EVERYWHERE
from wgmb.io import exr, stills
from wgmb.output.output import Output
from wgmb.run.sequence import blur_sequence
from wgmb.sequence import data_windows
from wgmb.sequence.clip import Passes
from wgmb.sequence.layers.vectors import Vectors

DISPLAY = (0, 0, 319, 179)
WIDE = (-40, -30, 359, 209)  # with overscan
SPEED, START, RADIUS = (19.3, 6.1), (95.0, 70.0), 21.0
SHUTTERS = [Shutter(90), Shutter(180, "start"), Shutter(360, -0.3), Shutter(180, rolling="down")]
IMAGE_METHODS = sorted(m for m, c in wgmb.METHODS.items() if "scene" not in c.needs)
EMPTY = {"Z": np.inf}


def ball(number, window=DISPLAY, start=START, kind=np.float32):
    """Channels of a textured ball over nothing in frame `number`, and what of `window` it fills."""
    left, top, right, bottom = window
    y, x = np.mgrid[top : bottom + 1, left : right + 1] + 0.5
    x, y = x - start[0] - SPEED[0] * number, y - start[1] - SPEED[1] * number
    far = np.hypot(x, y)
    alpha = np.clip(RADIUS - far + 0.5, 0, 1)
    tone = 0.5 + 0.5 * np.sin(0.4 * x) * np.cos(0.31 * y)
    inside = alpha > 0
    planes = {"R": alpha * tone, "G": alpha * (1 - tone), "B": alpha * 0.3, "A": alpha}
    planes |= {"forward.u": inside * SPEED[0], "forward.v": inside * -SPEED[1]}
    planes |= {"backward.u": inside * -SPEED[0], "backward.v": inside * SPEED[1]}
    planes = {name: plane.astype(kind) for name, plane in planes.items()}
    planes["Z"] = np.where(inside, 9 - 0.02 * (RADIUS - far), np.inf).astype(np.float32)
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    if not len(rows):
        return planes, None
    return planes, (
        left + int(columns[0]), top + int(rows[0]), left + int(columns[-1]), top + int(rows[-1]),
    )  # fmt: skip


def cropped(planes, window, onto):
    return {
        name: data_windows.laid(plane, window, onto, (False,) * 4, EMPTY.get(name, 0))
        for name, plane in planes.items()
    }


def write(path, planes, window, display=DISPLAY):
    part = exr.Part("", planes, {}, window, display)
    Path(path).write_bytes(exr.encode(exr.Exr(Path(path), [part])))


def sequence(folder, slack, window=DISPLAY, numbers=range(1, 5), **more):
    """Frames cropped to the ball and `slack(number)` pixels around it; None: whole ones."""
    folder.mkdir()
    for number in numbers:
        planes, filled = ball(number, window, **more)
        onto = window
        if slack is not None:
            by = slack(number)
            filled = filled or (window[0], window[1], window[0], window[1])  # as writers have it
            grown = (filled[0] - by, filled[1] - by, filled[2] + by, filled[3] + by)
            onto = data_windows.common(grown, window)
        write(folder / f"a.{number:04d}.exr", cropped(planes, window, onto), onto)
    return str(folder / "a.####.exr")


def blurred(pattern, folder, method, shutter=180, frames=None, window="grow", **more):
    """{number: the part that was written} of a run over all of it."""
    clip, blur = Clip(pattern, frames=frames, **more), Blur(method, shutter=shutter, samples=8)
    output = Output(folder / "b.####.exr", numbers=clip.numbers, window=window)
    report = blur_sequence(clip, blur, output)
    assert not report.failed
    return {n: exr.read(folder / f"b.{n:04d}.exr").parts[0] for n in report.done}


def rgba(part, onto=DISPLAY):
    """The written picture, in the window `onto`."""
    picture = np.stack([part.channels[c] for c in "RGBA"], axis=2)
    return data_windows.laid(picture, part.data_window, onto, (False,) * 4)


def slack(number):
    return (0, 7, 30, 1)[number % 4]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return sequence(tmp_path_factory.mktemp("whole") / "in", None)


@pytest.fixture(scope="module")
def autocropped(tmp_path_factory):
    return sequence(tmp_path_factory.mktemp("crop") / "in", slack)


@pytest.mark.covers(1)
@pytest.mark.parametrize("shutter", SHUTTERS, ids=str)
@pytest.mark.parametrize("method", IMAGE_METHODS)
def test_cropped_frames_give_the_same_picture(
    whole, autocropped, tmp_path, method, shutter, mixing
):
    want = blurred(whole, tmp_path / "want", method, shutter)
    got = blurred(autocropped, tmp_path / "got", method, shutter)
    for number in want:
        assert want[number].data_window == DISPLAY
        np.testing.assert_allclose(rgba(got[number]), rgba(want[number]), atol=5e-5 + mixing)


def test_a_window_grows_to_the_last_pixel_that_is_not_empty(autocropped, tmp_path):
    before = exr.read(autocropped.replace("####", "0003")).parts[0].data_window
    for method in ("gather", "reproject", "tiles"):
        got = blurred(autocropped, tmp_path / method, method, 360)[3]
        picture = rgba(got, got.data_window)
        filled = (picture != 0).any(axis=2)
        left, top, right, bottom = got.data_window
        assert left < before[0] and right > before[2]
        ends = (filled[:, 0], left == before[0]), (filled[0], top == before[1])
        ends += (filled[:, -1], right == before[2]), (filled[-1], bottom == before[3])
        assert all(row.any() or kept for row, kept in ends)


def test_kept_windows_cut_the_streak_off(autocropped, tmp_path):
    want = blurred(autocropped, tmp_path / "grown", "gather", 360)
    got = blurred(autocropped, tmp_path / "kept", "gather", 360, window="keep")
    for number in want:
        source = exr.read(autocropped.replace("####", f"{number:04d}")).parts[0]
        assert got[number].data_window == source.data_window
        onto = source.data_window
        np.testing.assert_array_equal(rgba(got[number], onto), rgba(want[number], onto))


def test_other_channels_are_padded_and_nothing_else(autocropped, tmp_path):
    got = blurred(autocropped, tmp_path / "b", "gather", 360)[2]
    source = exr.read(autocropped.replace("####", "0002")).parts[0]
    for name in ("Z", "forward.u", "backward.v"):
        inner = data_windows.laid(
            got.channels[name], got.data_window, source.data_window, (False,) * 4
        )
        np.testing.assert_array_equal(inner, source.channels[name])
        outer = np.where(np.isfinite(got.channels[name]), got.channels[name], 0)
        inner = np.where(np.isfinite(inner), inner, 0)
        assert np.count_nonzero(outer) == np.count_nonzero(inner)


def test_half_floats_differ_in_the_last_bits_of_few_pixels(tmp_path):
    whole = sequence(tmp_path / "w", None, kind=np.float16)
    crop = sequence(tmp_path / "c", slack, kind=np.float16)
    for method in IMAGE_METHODS:
        want = blurred(whole, tmp_path / f"want {method}", method, frames="2")[2]
        got = blurred(crop, tmp_path / f"got {method}", method, frames="2")[2]
        a, b = rgba(want), rgba(got)
        assert a.dtype == b.dtype == np.float16
        ulps = np.abs(a.view(np.int16).astype(int) - b.view(np.int16))
        assert ulps.max() <= 4 and (ulps > 0).any(axis=2).mean() < 0.01


@pytest.mark.full
@pytest.mark.parametrize("method", IMAGE_METHODS)
def test_a_picture_that_leaves_the_display_goes_on_in_the_overscan(tmp_path, method):
    """A ball that crosses the right border; windows reach beyond it."""
    at = (262.0, 40.0)
    want = blurred(sequence(tmp_path / "w", None, WIDE, start=at), tmp_path / "x", method, 360)
    got = blurred(sequence(tmp_path / "c", slack, WIDE, start=at), tmp_path / "y", method, 360)
    for number in want:
        window = got[number].data_window
        assert window[2] > DISPLAY[2] or number == 1
        np.testing.assert_allclose(rgba(got[number]), rgba(want[number]), atol=5e-5)


def test_frames_with_nothing_in_them_take_part(tmp_path):
    """They are 1 x 1 pixels, or a window outside the display."""
    pattern = sequence(tmp_path / "in", slack)
    for number, window in ((1, (0, 0, 0, 0)), (4, (-900, -900, -890, -895))):
        planes, _ = ball(99, window)
        write(pattern.replace("####", f"{number:04d}"), planes, window)
    got = blurred(pattern, tmp_path / "out", "gather")
    assert got[1].data_window == (0, 0, 0, 0) and got[4].data_window == (-900, -900, -890, -895)
    assert (got[2].channels["A"] > 0.9).any()


def test_a_chunk_gives_the_same_bytes_as_the_whole_run(autocropped, tmp_path):
    for method in ("gather", "tiles"):
        blurred(autocropped, tmp_path / f"all {method}", method)
        blurred(autocropped, tmp_path / f"some {method}", method, frames="3")
        name = "b.0003.exr"
        one, other = ((tmp_path / f"{run} {method}" / name).read_bytes() for run in ("all", "some"))
        assert one == other


def test_a_camera_and_its_display_window(tmp_path, mixing):
    """Motion from depth and a camera; the ball's surroundings turn with it."""
    pattern = {k: sequence(tmp_path / k, c, numbers=range(1, 4)) for k, c in
               (("whole", None), ("crop", slack))}  # fmt: skip
    frames = {}
    for number in range(5):
        world = np.eye(4)
        world[0, 3] = -0.2 * number
        lens = np.diag([2, 2 * 320 / 180, -1.0, 0])
        lens[2, 3], lens[3, 2] = -0.2, -1
        frames[str(number)] = {"camera_matrix_world": world.tolist(), "projection": lens.tolist()}
    (tmp_path / "camera.json").write_text(json.dumps({"frames": frames}))
    passes = Passes(camera=tmp_path / "camera.json", vectors=Vectors("none"))
    for method in ("tap", "tiles", "gather", "reproject"):
        want = blurred(pattern["whole"], tmp_path / f"w {method}", method, 300, passes=passes)
        got = blurred(pattern["crop"], tmp_path / f"c {method}", method, 300, passes=passes)
        for number in want:
            np.testing.assert_allclose(rgba(got[number]), rgba(want[number]), atol=5e-5 + mixing)


def region(folder, alpha):
    """Frames of which one region was rendered: it ends within the display, the picture does not."""
    folder.mkdir()
    window = (100, 60, 219, 139)
    y, x = np.mgrid[window[1] : window[3] + 1, window[0] : window[2] + 1]
    for number in range(1, 4):
        tone = 0.5 + 0.4 * np.sin(0.2 * (x - 8 * number)) * np.cos(0.15 * y)
        planes = {c: tone.astype("f4") for c in "RGB"}
        planes |= {"A": np.ones_like(planes["R"])} if alpha else {}
        planes |= {"forward.u": np.full(x.shape, 8, "f4"), "forward.v": np.zeros(x.shape, "f4")}
        planes["Z"] = np.full(x.shape, 5, "f4")
        write(folder / f"a.{number:04d}.exr", planes, window)
    return str(folder / "a.####.exr"), window


@pytest.mark.parametrize("alpha", [True, False])
def test_beyond_a_rendered_region_the_picture_is_unknown_and_not_empty(tmp_path, alpha):
    pattern, window = region(tmp_path / "in", alpha)
    passes = {rule: Passes(outside=rule) for rule in ("auto", "edge", "nothing")}
    got = {rule: blurred(pattern, tmp_path / rule, "tap", frames="2", passes=p)[2]
           for rule, p in passes.items()}  # fmt: skip
    assert got["auto"].data_window == got["edge"].data_window == window
    np.testing.assert_array_equal(got["auto"].channels["R"], got["edge"].channels["R"])
    inner = data_windows.laid(got["nothing"].channels["G"], got["nothing"].data_window, window)
    assert inner[:, 0].mean() < 0.9 * got["auto"].channels["G"][:, 0].mean()
    if alpha:
        assert got["auto"].channels["A"].min() > 0.999


def test_a_side_that_cuts_through_the_picture_is_told_once(tmp_path):
    pattern, _ = region(tmp_path / "in", True)
    clip = Clip(pattern)
    for number in clip.numbers:
        clip.placed(clip.source(number), Blur("gather").extent, True)
    (told,) = [note for note in clip.notes if "data window" in note]
    assert "left, top, right, bottom" in told


def test_pictures_for_people_hold_the_display_window(autocropped, tmp_path):
    clip, blur = Clip(autocropped, frames="2"), Blur("tap", samples=8)
    blur_sequence(clip, blur, Output(tmp_path / "b.####.png", numbers=[2]))
    picture = stills.read(tmp_path / "b.0002.png")
    assert picture.shape == (180, 320, 4)
    want = rgba(blurred(autocropped, tmp_path / "exr", "tap", frames="2")[2])
    np.testing.assert_allclose(picture[..., 3], want[..., 3], atol=0.003)
    wide = sequence(tmp_path / "wide", None, WIDE, numbers=[1])
    clip = Clip(wide)
    blur_sequence(clip, blur, Output(tmp_path / "w.####.png", numbers=[1]))
    assert stills.read(tmp_path / "w.0001.png").shape == (180, 320, 4)


@pytest.mark.parametrize("size", ["display", "window"])
def test_masks_from_files_are_of_the_display_or_of_the_window(autocropped, tmp_path, size):
    source = Clip(autocropped).source(2)
    y, x = np.mgrid[:180, :320]
    mask = ((x + y) % 50 < 20).astype("f4")
    own = data_windows.laid(mask, DISPLAY, source.data_window)
    shown = mask if size == "display" else own
    (tmp_path / "mask.png").write_bytes(stills.encode(np.stack([shown] * 3, 2), ".png", 8, ""))
    clip = Clip(autocropped, passes=Passes(holdout=str(tmp_path / "mask.png")))
    got = clip.frame(clip.source(2)).holdout
    np.testing.assert_allclose(got, own, atol=1e-6)


def test_a_window_far_away_fails_its_frame_and_takes_no_memory(tmp_path):
    pattern = sequence(tmp_path / "in", slack, numbers=range(1, 6))
    far = (300_000_000, 0, 300_000_039, 39)
    planes, _ = ball(0, (0, 0, 39, 39), start=(20.0, 20.0))
    write(pattern.replace("####", "0003"), planes, far)
    clip = Clip(pattern)
    assert "nuke" in clip.finding
    output = Output(tmp_path / "o.####.exr", numbers=clip.numbers)
    report = blur_sequence(clip, Blur("gather"), output)
    assert set(report.done) >= {1, 5} and all("canvas" in why for why in report.failed.values())


def test_overscan_that_goes_on_is_not_told_as_a_region(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    y, x = np.mgrid[WIDE[1] : WIDE[3] + 1, WIDE[0] : WIDE[2] + 1]
    for number in (1, 2):
        tone = (0.5 + 0.4 * np.sin(0.2 * (x - 8 * number)) * np.cos(0.15 * y)).astype("f4")
        planes = dict.fromkeys("RGB", tone) | {"A": np.ones_like(tone), "Z": 5 * np.ones_like(tone)}
        planes |= {"forward.u": np.full_like(tone, 8), "forward.v": np.zeros_like(tone)}
        write(folder / f"a.{number:04d}.exr", planes, WIDE)
    got = blurred(str(folder / "a.####.exr"), tmp_path / "out", "gather")
    assert got[1].data_window == WIDE
    clip = Clip(str(folder / "a.####.exr"))
    clip.placed(clip.source(1), Blur("gather").extent, True)
    assert not [note for note in clip.notes if "data window" in note]


def test_a_neighbour_with_another_display_window_is_not_used(tmp_path):
    pattern = sequence(tmp_path / "in", slack, numbers=range(1, 4))
    planes, _ = ball(3)
    write(pattern.replace("####", "0003"), planes, DISPLAY, display=(0, 0, 399, 179))
    clip = Clip(pattern)
    frame = clip.with_neighbours(clip.source(2), extent=Blur("gather").extent)
    assert frame.prev is not None and frame.next is None
    assert clip.sizes[3] == (400, 180)


def test_the_viewer_and_perceive_show_all_of_the_display(autocropped, tmp_path):
    clip = Clip(autocropped)
    frame = clip.with_neighbours(clip.source(2), extent=EVERYWHERE)
    assert frame.size == (320, 180) and frame.window == (0, 0, 320, 180)
    words = ["perceive", autocropped, "-o", str(tmp_path / "p.####.exr"), "--fps", "60", "-q"]
    assert command(words) == 0
    for number in clip.numbers:
        part = exr.read(tmp_path / f"p.{number:04d}.exr").parts[0]
        assert part.display_window == DISPLAY
        own = exr.read(autocropped.replace("####", f"{number:04d}")).parts[0]
        assert data_windows.common(part.data_window, own.data_window) == own.data_window
        if number == 4:  # what was there before is still seen
            assert part.data_window[0] < own.data_window[0]
