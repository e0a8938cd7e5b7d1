"""Display in a notebook: short texts, PNGs of the pixels, drawings, tables."""

import io
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from types import SimpleNamespace

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb.color.srgb import srgb

LONGEST = 500  # characters


def decoded(png: bytes) -> np.ndarray:
    return iio.imread(io.BytesIO(png)).astype(float)


@pytest.fixture(scope="module")
def color():
    return np.random.default_rng(1).random((27, 33, 3), np.float32) * 1.5


@pytest.mark.fast
@pytest.mark.parametrize("kind", ["f2", "f4", "f8"])
def test_a_png_has_the_srgb_of_the_pixels(color, kind):
    want = 255 * srgb(color)
    for png in (wgmb.show(color.astype(kind)).png, wgmb.Frame(color.astype(kind))._repr_png_()):
        assert np.abs(decoded(png) - want).max() <= 1


@pytest.mark.fast
def test_exposure_is_in_stops_and_leaves_alpha_alone(color):
    alpha = np.linspace(0.25, 1, 33, dtype=np.float32)[None, :, None] + 0 * color[..., :1]
    rgba = np.concatenate([color * alpha, alpha], axis=2)
    got = decoded(wgmb.show(rgba, exposure=-1).png)
    assert np.abs(got[..., :3] - 255 * srgb(color / 2)).max() <= 1
    assert np.abs(got[..., 3:] - 255 * alpha).max() <= 1


@pytest.mark.fast
def test_grey_is_grey_and_what_is_not_finite_is_black_or_white():
    grey = np.array([[0.5, np.nan, np.inf, -np.inf]], np.float32)
    got = decoded(wgmb.show(grey).png)
    assert (got[..., 0] == got[..., 1]).all()
    assert (got[..., 0] == got[..., 2]).all()
    assert got[0, :, 0].tolist() == [188, 0, 255, 0]


@pytest.mark.fast
@pytest.mark.parametrize("shape", [(4, 961), (3, 2000), (1, 5000), (1200, 1000)])
def test_what_is_too_wide_is_shown_as_means_of_blocks(shape):
    wide = np.random.default_rng(2).random((*shape, 3), np.float32)
    got = decoded(wgmb.show(wide).png)
    step = -(-shape[1] // 960)
    assert got.shape[1] <= 960
    if shape[0] >= step:
        x, y = got.shape[1] - 1, got.shape[0] - 1
        block = wide[y * step : (y + 1) * step, x * step : (x + 1) * step].mean(axis=(0, 1))
        assert np.abs(got[y, x] - 255 * srgb(block)).max() <= 1


@pytest.mark.fast
@pytest.mark.parametrize(
    ("image", "told"),
    [
        (np.zeros((3, 3), np.uint8), "floating point, got uint8"),
        (np.zeros((3, 3, 2)), r"got \(3, 3, 2\)"),
        (np.zeros((0, 3, 3)), r"got \(0, 3, 3\)"),
        (np.zeros(3), r"got \(3,\)"),
    ],
)
def test_other_arrays_are_refused(image, told):
    with pytest.raises(wgmb.InputError, match=told):
        wgmb.show(image)


@pytest.mark.fast
def test_a_frame_is_told_in_one_short_line(color):
    depth = np.ones((27, 33), np.float16)
    frame = wgmb.Frame(color, np.zeros((27, 33, 2), "f4"), depth=depth, number=7)
    near = frame.between(frame, None)
    assert repr(near) == "Frame(33 x 27, color rgb f32, to_next, depth, prev, number 7)"


@pytest.mark.fast
def test_a_clip_is_told_without_reading_it(tmp_path):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    clip = wgmb.Clip(pattern)
    (tmp_path / "shot.0002.exr").write_bytes(b"damaged")
    assert repr(clip) == f'Clip("{pattern}", frames 1-3)'
    plain = wgmb.Clip(pattern, frames="1", passes=wgmb.Passes(vectors=wgmb.Vectors("nuke")))
    assert repr(plain) == f'Clip("{pattern}", frame 1, nuke vectors)'
    make.write_sequence(tmp_path, (1, 2, 3))
    assert clip.has
    assert repr(clip) == f'Clip("{pattern}", frames 1-3, blender vectors)'


@pytest.mark.fast
def test_long_clips_and_reports_stay_short():
    clip = wgmb.Clip.__new__(wgmb.Clip)
    clip.pattern, clip.numbers = "x" * 4000, list(range(0, 90000, 3))
    clip.passes, clip._finder = wgmb.Passes(), SimpleNamespace(known=None)
    report = wgmb.BatchReport(list(range(0, 9000, 2)), stopped="y" * 4000)
    report.failed = dict.fromkeys(range(1, 9000, 2), "why" * 99)
    for told in (clip, report):
        assert len(repr(told)) < LONGEST
    assert len(report._repr_html_()) < 20_000


class Rows(HTMLParser):
    """The text of every row of a table."""

    def __init__(self, text: str):
        super().__init__()
        self.rows: list[list[str]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])

    def handle_data(self, data):
        self.rows[-1].append(data)


@pytest.mark.fast
def test_a_report_is_a_table():
    report = wgmb.BatchReport([1, 2, 4], [3], {5: "a <damaged> file"}, bad={2: {"depth": 6}})
    assert repr(report) == "BatchReport(3 done, 1 already there, 1 failed)"
    assert Rows(report._repr_html_()).rows == [
        ["done", "1-2,4"], ["already there", "3"], ["frame 5 failed", "a <damaged> file"],
        ["frame 2: pixels that are not finite", "6 of depth"],
    ]  # fmt: skip
    assert Rows(wgmb.BatchReport()._repr_html_()).rows == [["done", "nothing"]]


@pytest.mark.fast
@pytest.mark.parametrize("curve", ["box", "cosine", lambda x: x])
def test_a_shutter_draws_its_curve(curve):
    shutter = wgmb.Shutter(720, curve=curve)
    drawing = ET.fromstring(shutter._repr_svg_())
    (line,) = drawing.iter("{http://www.w3.org/2000/svg}polyline")
    points = np.array([p.split(",") for p in line.get("points").split()], float)
    weight = shutter.weight(np.linspace(-1.5, 1.5, len(points)))
    rise = points[:, 1].max() - points[:, 1]
    assert np.allclose(rise / rise.max(), weight / weight.max(), atol=0.01)


def test_a_blur_is_told_in_one_short_line(device):
    name = device.adapter_info["device"]
    blur = wgmb.Blur("tap", shutter=wgmb.Shutter(720, curve="cosine"), samples="auto")
    assert repr(blur) == f'Blur("tap", shutter 720 cosine, auto samples, {name})'
    assert repr(wgmb.Blur("gather")) == f'Blur("gather", shutter 180, 16 samples, {name})'
