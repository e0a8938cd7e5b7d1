"""The Python interface: clear refusals, reuse, and a place in somebody else's frame."""

import subprocess
import sys

import numpy as np
import pytest
import wgpu

import wgmb
from wgmb import (
    Camera,
    InputError,
    Reprojections,
    gpu,
)
from wgmb.gpu.textures import TexturePool
from wgmb.gpu_frame.views import FrameViews

STILL = Reprojections(*[Camera(np.array([[1, 0, 0, 0], [0, 1.3, 0, 0], [0, 0, -1.02, -0.2],
                                         [0, 0, -1, 0]]))] * 3)  # fmt: skip


def motion(x=6.0, y=2.0, size=(48, 64)):
    return np.full((*size, 2), (x, y), "f4")


@pytest.mark.parametrize(
    "change, words",
    [
        ({"color": np.zeros((48, 64, 3), "u1")}, "color must be floating point, got uint8"),
        ({"color": np.zeros((48, 64, 3), "c8")}, "color must be floating point, got complex64"),
        ({"color": np.ma.zeros((48, 64, 3), "f4")}, "color must not be a masked array"),
        ({"depth": np.zeros((48, 64), np.longdouble)}, "depth must be float16, float32 or float64"),
        ({"to_next": np.ma.zeros((48, 64, 2), "f4")}, "to_next must not be a masked array"),
        (
            {
                "object_id": np.ma.zeros((48, 64), "u4"),
                "camera": STILL,
                "depth": np.ones((48, 64), "f4"),
            },
            "object_id must not be a masked array",
        ),
        ({"color": np.zeros((48, 64), "f4")}, r"color must be \(height, width, 3 or 4\)"),
        ({"color": np.zeros((0, 64, 3), "f4")}, "color must have at least one pixel, got 64 x 0"),
        (
            {"color": np.broadcast_to(np.float32(1), (200_000, 200_000, 3))},
            "color must be at most 32768 pixels a side, got 200000 x 200000",
        ),
        ({"to_next": motion(size=(47, 64))}, r"to_next must be \(48, 64, 2\) like color, got \(47"),
        ({"to_prev": np.zeros((48, 64), "f4")}, r"to_prev must be \(48, 64, 2\)"),
        ({"motion": np.zeros((48, 64, 4), "f4")}, "either motion or to_next/to_prev"),
        ({"holdout": np.zeros((48, 64), int)}, "holdout must be floating point"),
        ({"scale": np.zeros((64, 48), "f4")}, r"scale must be \(48, 64\)"),
        ({"object_id": np.zeros((48, 64), "u4")}, "object_id needs a camera"),
        ({"samples": 0}, "`samples` must be 1 to 4096 or auto, got 0"),
        ({"samples": 4097}, "samples"),
        ({"samples": 2.5}, "samples"),
        ({"samples": "many"}, "`samples` must be 1 to 4096 or auto, got 'many'"),
        ({"jitter": 1.5}, "`jitter` must be 0 to 1"),
        ({"jitter": float("nan")}, "jitter"),
        ({"max_blur": -1.0}, "max_blur"),
        ({"method": "magic"}, "unknown method 'magic'; available: tap"),
        (
            {"method": "tap", "magic": 1},
            "method 'tap' has no option magic; it has path, variant, shutter, curve",
        ),
        ({"shuter": 90}, "no option shuter; it has .*; did you mean 'shutter'?"),
        (
            {"method": "tap", "seed": 1},
            "method 'tap' has no option seed, but distributed; it has path, variant",
        ),
        ({"shutter": "180"}, "`shutter` must be 0 to 36000 degrees, got '180'"),
        ({"to_next": None}, "method 'tiles' needs motion: to_next, or depth and a camera"),
        ({"method": "tap", "path": "bent"}, "path must be one of curved, straight"),
        ({"variant": "old"}, "variant must be one of"),
        ({"output": "rgba8unorm"}, "output must be one of"),
        ({"shutter": -1}, "`shutter` must be 0 to"),
        ({"method": "distributed"}, "method 'distributed' draws built-in scenes; for frames: tap"),
    ],
)
def test_what_does_not_fit_is_named(noise, change, words):
    with pytest.raises(InputError, match=words):
        wgmb.blur(**({"color": noise, "to_next": motion()} | change))


def test_a_picture_too_large_for_the_adapter_is_refused(device):
    most = device.limits["max-texture-dimension-2d"]
    color = np.zeros((1, most + 1, 3), "f2")
    with pytest.raises(InputError, match=f"{most + 1} x 1"):
        wgmb.blur(color, np.zeros((1, most + 1, 2), "f4"))


def test_a_blur_is_used_again_for_other_sizes(noise):
    blur = wgmb.Blur("tap")
    for picture in (noise, noise[:30, :41], noise[:30, :41, :3], noise):
        frame = wgmb.Frame(picture, motion(size=picture.shape[:2]))
        assert np.array_equal(blur(frame), wgmb.blur(picture, frame.to_next))


def test_the_shutter_is_changed_between_frames(noise):
    blur = wgmb.Blur("tap", shutter=0)
    assert np.array_equal(blur(noise, motion()), noise)
    blur.shutter = wgmb.Shutter(360, curve="cosine")
    want = wgmb.blur(noise, motion(), shutter=wgmb.Shutter(360, curve="cosine"))
    assert np.array_equal(blur(noise, motion()), want)


def test_two_blurs_do_not_disturb_each_other(noise):
    a, b = wgmb.Blur("tap", samples=3), wgmb.Blur("tap", samples=40, shutter=360)
    first = a(noise, motion()), b(noise, motion())
    second = b(noise, motion()), a(noise, motion())
    assert np.array_equal(first[0], second[1])
    assert np.array_equal(first[1], second[0])


def own_device():
    """Somebody else's device, without any feature that wgmb would have asked for."""
    return gpu.choose_adapter().request_device_sync()


@pytest.mark.parametrize("output", ["rgba32float", "rgba16float"])
def test_encode_in_your_own_frame_is_the_same_as_arrays(noise, output):
    device = own_device()
    images = TexturePool(device)
    rgba = np.concatenate([noise, np.ones_like(noise[..., :1])], axis=2).astype("f2")
    texture = images.texture("mine", (64, 48), output)
    blur = wgmb.Blur("tap", device=device, output=output)
    encoder = device.create_command_encoder()
    frame = FrameViews(
        color=images.upload("color", rgba, "rgba16float"),
        to_next=images.upload("velocity", motion().astype("f2"), "rg16float"),
    )
    blur.encode(encoder, frame, texture.create_view())
    got = images.download(encoder, texture)
    want = wgmb.blur(rgba, motion())
    np.testing.assert_allclose(got, want, atol=1e-6 if output == "rgba32float" else 1e-3)


def test_a_device_that_cannot_filter_f32_does_with_f16(noise):
    color, holdout = noise.copy(), np.zeros(noise.shape[:2], "f4")
    color[10, 12] = np.nan
    holdout[20:30, 20:30] = 1
    got = wgmb.blur(color, motion(), holdout=holdout, device=own_device())
    want = wgmb.blur(color, motion(), holdout=holdout)
    np.testing.assert_allclose(got, want, atol=2e-3)


def test_work_is_recorded_but_not_submitted(noise, monkeypatch):
    blur = wgmb.Blur("tap")
    images = TexturePool(blur.device)
    output = images.texture("o", (64, 48), "rgba32float").create_view()
    color = images.upload("c", np.ones((48, 64, 4), "f4"), "rgba32float")
    to_next = images.upload("v", motion(), "rg32float")
    monkeypatch.setattr(type(blur.device.queue), "submit", lambda *_: pytest.fail("submitted"))
    frame = FrameViews(color=color, to_next=to_next)
    blur.encode(blur.device.create_command_encoder(), frame, output)


def script(code: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )


def test_importing_touches_no_gpu_and_no_environment():
    done = script(
        "import os, wgpu\n"
        "def no(*a, **k): raise SystemExit('asked for an adapter')\n"
        "wgpu.gpu.enumerate_adapters_sync = wgpu.gpu.request_adapter_sync = no\n"
        "before = dict(os.environ)\n"
        "import wgmb, wgmb.cli.app\n"
        "assert dict(os.environ) == before\n"
        "print('fine')\n"
    )
    assert done.stdout == "fine\n", done.stderr


def test_what_is_public_is_what_is_there():
    names = {n for n in dir(wgmb) if not n.startswith("_")}
    modules = {n for n in names if f"wgmb.{n}" in sys.modules}
    assert set(wgmb.__all__) - {"__version__"} == names - modules


def test_a_passes_time_is_told_by_its_name(noise):
    """Software adapters' clocks lie, so only the names are looked at here."""
    from wgmb.gpu.timing import TimestampClock

    blur = wgmb.Blur("tap")
    timing = TimestampClock(blur.device)
    images = TexturePool(blur.device)
    encoder = blur.device.create_command_encoder()
    frame = FrameViews(
        color=images.upload("c", np.ones((48, 64, 4), "f4"), "rgba32float"),
        to_next=images.upload("v", motion(), "rg32float"),
    )
    output = images.texture("o", (64, 48), "rgba32float").create_view()
    blur.encode(encoder, frame, output, timing=timing)
    gpu.submit(blur.device, encoder)
    assert set(timing.read()) == {"gpu_frame/velocity.wgsl:main", "methods/tap.wgsl:main"}
    assert TimestampClock.usable(blur.device) == (blur.device.adapter_info["adapter_type"] != "CPU")


def test_opengl_is_refused_unless_asked_for(monkeypatch):
    found = [a for a in gpu.adapters() if a.info["backend_type"].startswith("OpenGL")]
    monkeypatch.setattr(gpu.device, "adapters", lambda: found)
    with pytest.raises(wgmb.DeviceError, match=r"mesa-vulkan-drivers|no GPU adapter"):
        gpu.choose_adapter()
    if found:
        assert gpu.choose_adapter("opengl") is found[0]


def test_an_unknown_adapter_is_named_with_those_there_are():
    with pytest.raises(wgmb.DeviceError, match=r"'voodoo'; found 0: "):
        gpu.choose_adapter("voodoo")
    with pytest.raises(wgmb.DeviceError, match="no adapter number 99"):
        gpu.choose_adapter("99")


def test_an_adapter_is_chosen_by_the_environment(monkeypatch):
    monkeypatch.setenv("WGMB_ADAPTER", gpu.adapters()[0].summary[:6])
    assert gpu.choose_adapter().summary == gpu.adapters()[0].summary
    assert isinstance(gpu.choose_adapter(), wgpu.GPUAdapter)


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4"])
def test_object_ids_of_every_integer_type_are_taken(noise, kind):
    ids = np.zeros((48, 64), kind)
    depth = np.full((48, 64), 5, "f4")
    out = wgmb.blur(noise, depth=depth, camera=STILL, object_id=ids)
    assert np.array_equal(out, noise)


def test_the_device_is_the_same_one_every_time():
    assert gpu.open_device() is gpu.open_device(None)


@pytest.mark.parametrize(
    "inputs, words",
    [
        ({"camera": STILL}, "needs depth"),
        ({"motion": (64, 48), "to_next": (64, 48)}, "either motion or to_next"),
        ({"motion": (64, 47)}, "motion is 64 x 47, the image 64 x 48"),
        ({"to_next": (64, 48), "holdout": (32, 48)}, "holdout is 32 x 48"),
        ({"to_next": (64, 48), "output": (65, 48)}, "output is 65 x 48"),
        ({"to_next": (63, 48), "color": (64, 48)}, "to_next is 63 x 48"),
    ],
)
def test_encode_refuses_what_does_not_fit_together(inputs, words):
    blur = wgmb.Blur("tap")
    images, encoder = TexturePool(blur.device), blur.device.create_command_encoder()
    inputs = {"color": (64, 48), "output": (64, 48), **inputs}
    views = {
        name: images.view(name, size, "rgba32float") if isinstance(size, tuple) else size
        for name, size in inputs.items()
    }
    with pytest.raises(InputError, match=words):
        output = views.pop("output")
        blur.encode(encoder, FrameViews(**views), output)


@pytest.mark.parametrize("shutter", ["abc", None])
def test_a_shutter_that_is_no_number_is_named(shutter):
    with pytest.raises(InputError, match="shutter"):
        wgmb.Blur("tap", shutter=shutter)


def test_a_picture_of_many_bands_comes_back_as_it_was(device):
    """More than 4 MiB are written piece by piece."""
    images = TexturePool(device)
    picture = np.arange(700 * 500 * 4, dtype="f4").reshape(700, 500, 4)
    images.upload("big", picture, "rgba32float")
    got = images.download(
        device.create_command_encoder(), images.texture("big", (500, 700), "rgba32float")
    )
    assert np.array_equal(got, picture)


def test_f16_textures_take_the_greatest_number_they_have(device):
    images = TexturePool(device)
    picture = np.full((2, 2, 4), (1e5, -1e5, np.inf, 1.0), "f4")
    images.upload("half", picture, "rgba16float")
    got = images.download(
        device.create_command_encoder(), images.texture("half", (2, 2), "rgba16float")
    )
    np.testing.assert_array_equal(got[0, 0], np.array([65504, -65504, np.inf, 1], "f2"))


def test_a_curve_stands_beside_degrees():
    blur = wgmb.Blur("tap", shutter=360, curve="cosine")
    assert blur.shutter == wgmb.Shutter(360, curve="cosine")
    assert wgmb.Blur("tap", curve=np.ones_like).shutter.curve is np.ones_like
    with pytest.raises(InputError, match="`curve` is for degrees; a Shutter has its own"):
        wgmb.Blur("tap", shutter=wgmb.Shutter(90), curve="box")
