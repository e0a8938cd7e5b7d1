"""Panoramas of 360 degrees: a body over the seam is as right as one in the middle."""

from dataclasses import replace

import numpy as np
import pytest

import wgmb
from make_frames import add_attributes, write_exr
from wgmb.flow.dis import Dis
from wgmb.pipeline import panorama
from wgmb.sequence import panorama_signs
from wgmb.sequence.layers.passes import Passes

WIDTH, HEIGHT = 256, 128
SPEED = 24.0  # px per frame interval, to the right


def _around(x, y, seed):
    """A texture that goes on around the panorama."""
    turn = 2 * np.pi * x / WIDTH
    waves = [np.sin(9 * turn + seed + c) * np.cos(0.31 * y + 5 * turn + c) for c in (0.0, 1.3, 2.9)]
    return (0.5 + 0.4 * np.stack(waves, axis=-1)).astype(np.float32)


def _picture(number, centre, textured=True):
    """A disc of 20 px that passes `centre` in frame 10; its mask."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    across = (x - centre - SPEED * (number - 10) + WIDTH / 2) % WIDTH - WIDTH / 2
    disc = across**2 + (y - 64) ** 2 < 400
    ground = _around(x - centre, y, 0.0) if textured else np.full((HEIGHT, WIDTH, 3), 0.2, "f4")
    return np.where(disc[..., None], _around(8 * across, y, 2.0), ground), disc


def _write(folder, centre, textured=True, attributes=None):
    """Frames 9 to 11 as a renderer writes them: motion across the seam is nearly the width."""
    for number in (9, 10, 11):
        rgb, disc = _picture(number, centre, textured)
        x = np.mgrid[:HEIGHT, :WIDTH][1]
        ahead = np.where(disc, (x + SPEED) % WIDTH - x, 0).astype(np.float32)
        back = np.where(disc, (x - SPEED) % WIDTH - x, 0).astype(np.float32)
        none = np.zeros((HEIGHT, WIDTH), np.float32)
        vectors = {"X": back, "Y": none, "Z": -ahead, "W": none}
        channels = {f"V.Combined.{c}": rgb[..., i] for i, c in enumerate("RGB")}
        channels |= {f"V.Vector.{c}": plane for c, plane in vectors.items()}
        channels["V.Depth.Z"] = np.where(disc, 5, 10).astype(np.float32)
        path = write_exr(folder / f"s.{number:04}.exr", channels)
        add_attributes(path, attributes or {})
    return folder / "s.####.exr"


def _blurred(pattern, method, **passes):
    """Frame 10, and its notes."""
    clip = wgmb.Clip(pattern, passes=Passes(**passes), frames="10")
    (frame,) = wgmb.blurred(clip, wgmb.Blur(method, shutter=180, samples=16))
    assert not frame.failed
    return frame.views[0].displayed, clip.notes


def _differ(picture, reference):
    return float(np.abs(picture - reference).max())


@pytest.mark.parametrize("method", ["tap", "tiles", "fusion", "reproject", "gather"])
def test_a_body_over_the_seam_is_as_right_as_one_in_the_middle(tmp_path, method):
    for name in ("middle", "seam", "flat"):
        (tmp_path / name).mkdir()
    middle, _ = _blurred(_write(tmp_path / "middle", 128), method)
    seam, notes = _blurred(pattern := _write(tmp_path / "seam", 0), method)
    assert any("panorama" in note for note in notes)
    turned = np.roll(seam, 128, axis=1)
    truth = np.mean([_picture(10 + t, 128)[0] for t in (np.arange(64) + 0.5) / 128 - 0.25], axis=0)
    error = [np.sqrt(np.mean((p - truth) ** 2)) for p in (middle, turned)]
    assert error[1] < 1.05 * error[0], error
    flat, _ = _blurred(pattern, method, wrap="off")
    assert np.sqrt(np.mean((np.roll(flat, 128, axis=1) - truth) ** 2)) > 1.5 * error[1]


@pytest.mark.parametrize("method", ["tap", "gather"])
def test_arrays_go_around_as_files_do(tmp_path, method):
    """A frame of a Clip, and one of arrays as a renderer writes them: `wrap="on"`."""
    pattern = _write(tmp_path, 0)
    expected, _ = _blurred(pattern, method)
    clip = wgmb.Clip(pattern)
    blur = wgmb.Blur(method, shutter=180, samples=16)
    for _ in range(2):  # the second time with what was kept
        np.testing.assert_array_equal(blur(clip[10]), expected)
    flat = wgmb.Clip(pattern, passes=Passes(wrap="off"))[10]
    sides = {side: replace(getattr(flat, side), wrap="on") for side in ("prev", "next")}
    passes = {name: array for name, array in flat.arrays.items() if name != "color"}
    more = {"samples": 16, "method": method, **sides, **passes}
    np.testing.assert_array_equal(wgmb.blur(flat.color, wrap="on", **more), expected)
    assert _differ(wgmb.blur(flat.color, **more), expected) > 0.1


def test_what_is_no_whole_panorama_is_refused():
    color = np.zeros((8, 16, 3), np.float32)
    with pytest.raises(wgmb.InputError, match=r"`wrap`.*off"):
        wgmb.Frame(color, wrap="auto")
    part = wgmb.Frame(color, np.zeros((8, 16, 2), "f4"), window=(0, 0, 32, 16), wrap="on")
    with pytest.raises(wgmb.InputError, match="needs the whole panorama"):
        wgmb.Blur("tap")(part)


@pytest.mark.parametrize("shift", [0, -15, 20])
def test_motion_that_is_searched_crosses_the_seam(tmp_path, shift):
    """The share of the disc whose motion is found to both sides, to a tenth of its speed."""
    right = []
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    for name, centre, wrap in (("middle", 128, "on"), ("seam", 0, "auto"), ("off", 0, "off")):
        centre = (centre + shift) % WIDTH
        (tmp_path / name).mkdir()
        for number in (9, 10, 11):
            rgb, disc = _picture(number, centre)
            across = (x - centre - SPEED * (number - 10) + WIDTH / 2) % WIDTH - WIDTH / 2
            spots = np.sin(0.004 * across**2 + 0.3 * y) * np.cos(0.2 * across - 0.003 * y**2)
            rgb = np.where(disc[..., None], 0.5 + 0.45 * spots[..., None], 0.3 * rgb)
            channels = {c: rgb[..., i].astype("f4") for i, c in enumerate("RGB")}
            write_exr(tmp_path / name / f"s.{number:04}.exr", channels)
        clip = wgmb.Clip(tmp_path / name / "s.####.exr", passes=Passes(wrap=wrap))
        clip.move_by(Dis("best"))
        motion = clip.frame(clip.source(10)).motion
        off = np.abs(motion[..., ::2] - (-SPEED, SPEED)).max(axis=2)
        right.append(float((off[_picture(10, centre)[1]] < SPEED / 10).mean()))
    assert right[1] > 0.99 * right[0] > 0.95 and right[2] < 0.9, right


@pytest.mark.fast
def test_a_panorama_is_found_by_its_attribute_its_edges_or_its_vectors(tmp_path):
    for name, given in {
        "attribute": {"centre": 90, "textured": False, "attributes": {"envmap": ("envmap", b"\0")}},
        "edges": {"centre": 90},
        "vectors": {"centre": 0, "textured": False},
        "neither": {"centre": 90, "textured": False},
    }.items():
        (tmp_path / name).mkdir()
        clip = wgmb.Clip(_write(tmp_path / name, **given), frames="10")
        frame = clip.frame(clip.source(10))
        assert any("panorama" in note for note in clip.notes) == (name != "neither"), name
        assert np.abs(frame.motion).max() == SPEED


@pytest.mark.fast
def test_a_flat_picture_of_twice_its_height_is_no_panorama():
    rng = np.random.default_rng(0)
    texture = rng.random((64, 160, 3), np.float32)
    assert not panorama_signs.joins(np.cumsum(texture, axis=1)[:, :128] / 128)
    around = np.cumsum(texture[:, :128] - texture[:, :128].mean(axis=1, keepdims=True), axis=1)
    assert panorama_signs.joins(0.5 + 0.02 * around)
    assert not panorama_signs.joins(np.full((64, 128, 3), 0.5, np.float32))


@pytest.mark.fast
def test_a_part_of_a_panorama_is_refused_where_it_is_asked_for(tmp_path):
    rgb, _ = _picture(10, 90)
    channels = {c: rgb[:, :100, i] for i, c in enumerate("RGB")}
    write_exr(tmp_path / "s.exr", channels, display=(0, 0, 255, 127))
    clip = wgmb.Clip(tmp_path / "s.exr", passes=Passes(wrap="on"))
    with pytest.raises(wgmb.InputError, match="whole panorama"):
        clip.frame(clip.source(clip.numbers[0]))


@pytest.mark.fast
def test_infinite_vectors_make_no_panorama():
    motion = np.full((8, 16, 4), 3, np.float32)
    motion[0, :2], motion[1] = np.inf, np.nan
    assert not panorama.crosses(motion)
    motion[2, 3, 2] = -9
    assert panorama.crosses(motion)
