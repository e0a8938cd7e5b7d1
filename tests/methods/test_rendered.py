"""Methods that blur pictures, on scenes: how far they are from the reference, and through files."""

from functools import cache

import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb import Shutter
from wgmb.scene import builtin

SIZE = (96, 54)
LATE = Shutter(360, "start")  # open only after the instant: motion the wrong way round is seen
LOSS = 0.1  # [dB] under what was measured that may be the device's; more is a worse picture
SETTINGS = {
    "translation": {"speed": 6},
    "scaling": {"dolly": 12},
    "rotation": {"roll": 3},
    "zoom": {"dolly": 0, "zoom": 4},
    "yaw": {"roll": 0, "yaw": 2},
    "crossing": {},
    "bounce": {},
    "wheel": {"speed": 12},
    "fence": {},
}
BUILT_IN = {"zoom": "scaling", "yaw": "rotation"}


@cache
def rendered(name, method, samples, shutter=LATE, antialias=3, size=SIZE, **options):
    scene = builtin.make(BUILT_IN.get(name, name), **SETTINGS[name])
    blur = wgmb.Blur(method, samples=samples, shutter=shutter, **options)
    return wgmb.Render(scene, blur, size=size, antialias=antialias)(0.0)[..., :3].astype(float)


def reference(name):
    """Of other noise than `rendered` has, and little of it: twice the rays agree to 55 dB."""
    return rendered(name, "distributed", 256, seed=1)


def psnr(got, want):
    """Of sRGB [dB]."""
    a, b = (
        np.where(x < 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
        for x in (np.clip(got, 0, 1), np.clip(want, 0, 1))
    )
    return -10 * np.log10(np.mean((a - b) ** 2))


@pytest.mark.parametrize(
    "name, tap, reproject",
    [("translation", 34.74, 37.31), ("scaling", 29.88, 34.69), ("rotation", 35.02, 37.37),
     ("zoom", 38.12, 37.95), ("yaw", 31.00, 40.52)],
)  # fmt: skip
def test_a_moving_camera_blurs_as_the_reference_does(name, tap, reproject):
    """PSNR as measured [dB]; the sharp picture has 20 to 25, one blurred backwards less."""
    truth = reference(name)
    sharp = psnr(rendered(name, "tap", 1, Shutter(0)), truth)
    for method, measured in (("tap", tap), ("reproject", reproject)):
        got = psnr(rendered(name, method, 32), truth)
        assert got > measured - LOSS
        assert got > sharp + 7
        assert psnr(rendered(name, method, 32, Shutter(360, "end")), truth) < sharp


@pytest.mark.parametrize(
    "name, tap, reproject",
    [
        ("crossing", 33.83, 37.53),
        ("bounce", 34.85, 39.04),
        ("wheel", 31.59, 35.36),
        ("fence", 26.47, 31.43),
    ],
)
def test_moving_bodies_blur_as_the_reference_does(name, tap, reproject):
    """PSNR as measured [dB]; reproject is well above the sharp picture, and above tap."""
    truth = reference(name)
    sharp = psnr(rendered(name, "tap", 1, Shutter(0)), truth)
    for method, measured in (("tap", tap), ("reproject", reproject)):
        got = psnr(rendered(name, method, 32), truth)
        assert got > measured - LOSS
        assert got > sharp + (5 if method == "reproject" else 1)
        assert psnr(rendered(name, method, 32, Shutter(360, "end")), truth) < got - 2.5


@pytest.mark.parametrize("name", ["translation", "scaling"])
def test_few_rays_do_more_when_they_are_reprojected(name):
    """Taylor's finding, for 4 rays a pixel of every frame; a neighbour's rays are that frame's.

    Translation, scaling [dB]: reprojected 35.5, 35.1, distributed 32.5, 31.5; blended pictures
    of one ray 32.5, 33.8, or one of four. More rays turn it round: 27 distributed have 42.5, 41.8.
    """
    truth = reference(name)
    reprojected = psnr(rendered(name, "reproject", 32, antialias=2), truth)
    assert reprojected > psnr(rendered(name, "distributed", 4), truth) + 2
    assert reprojected > psnr(rendered(name, "accumulate", 4, antialias=1), truth) + 0.8
    assert reprojected > psnr(rendered(name, "accumulate", 1, antialias=2), truth) + 2
    assert reprojected < psnr(rendered(name, "distributed", 27), truth)


@pytest.mark.parametrize("method", ["tap", "reproject"])
def test_nothing_moves_before_a_camera_that_stands_still(method):
    scene = builtin.make("translation", speed=0)
    render = wgmb.Render(scene, wgmb.Blur(method, shutter=720), size=SIZE)
    assert np.array_equal(render(0.2), render.frame(0.2).color)


def test_nor_in_the_published_form():
    """But for its sums of fixed point numbers."""
    scene = builtin.make("translation", speed=0)
    render = wgmb.Render(scene, wgmb.Blur("reproject", variant="published"), size=SIZE)
    np.testing.assert_allclose(render(0.2), render.frame(0.2).color, atol=1e-4)


@pytest.mark.covers(0)
@pytest.mark.parametrize("method", ["tap", "reproject", "gather"])
@pytest.mark.parametrize("name", ["crossing", "fence"])
def test_rendering_passes_and_blurring_them_is_rendering_with_blur(tmp_path, capsys, name, method):
    """Colour and motion go through half floats in between: 2.4e-4 measured."""
    scene = [name, "--frames", "2-4", "--size", "64x36"]
    look = ["--method", method, "--shutter", "200", "--phase", "0.1"]
    for arguments in (
        ["render", *scene, "--sharp", "--passes", "-o", tmp_path / "sharp.####.exr"],
        ["blur", tmp_path / "sharp.####.exr", *look, "-o", tmp_path / "blurred.####.exr"],
        ["render", *scene, *look, "-o", tmp_path / "at_once.####.exr"],
    ):
        assert make.inside(capsys, *arguments)[0] == 0
    files = [tmp_path / f"{kind}.0003.exr" for kind in ("blurred", "at_once", "sharp")]
    blurred, at_once, sharp = (make.plain_read(f) for f in files)
    for channel in "RGB":
        assert np.abs(blurred[channel] - sharp[channel]).max() > 0.05
        off = np.abs(blurred[channel].astype(float) - at_once[channel])
        assert off.max() < 2e-3


def test_passes_hold_what_the_frame_holds(tmp_path, capsys):
    path = tmp_path / "passes.exr"
    make.inside(
        capsys, "render", "crossing", "--size", "48x27", "--time", 0.1, "--passes", "-o", path
    )
    got = make.plain_read(path)
    render = wgmb.Render(builtin.make("crossing"), wgmb.Blur("gather"), size=(48, 27))
    frame = render.frame(0.1)
    assert np.array_equal(got["Z"], frame.depth)
    assert np.array_equal(got["object_id.X"], frame.object_id)
    motion = render.blur.motion(frame)
    for i, channel in enumerate(("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")):
        np.testing.assert_allclose(got[channel], motion[..., i], rtol=1e-3, atol=1e-3)
    for i, axis in enumerate("XYZ"):
        np.testing.assert_allclose(got[f"normal.{axis}"], frame.normal[..., i], atol=1e-3)
    picture = render(0.1)
    for i, channel in enumerate("RGBA"):
        np.testing.assert_allclose(got[channel], picture[..., i], rtol=1e-3, atol=1e-3)
