"""VapourSynth: the pictures of blur_pictures, in any order and from many threads."""

import importlib
import os
import random
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from importlib.util import find_spec

import numpy as np
import pytest

import fake_vapoursynth
import make_clips
import make_frames
import wgmb
from wgmb.run.video import blur_video
from wgmb.video.read.reader import VideoReader

REAL = find_spec("vapoursynth") is not None  # it has wheels for Python 3.12 and newer
SIZE, COUNT = (64, 48), 12


@pytest.fixture(
    scope="module",
    params=["stand-in", pytest.param("real", marks=pytest.mark.skipif(
        not REAL, reason="VapourSynth is not installed: it has no wheel for this Python"))],
)  # fmt: skip
def hosted(request):
    """The module of vapoursynth, and wgmb's for it."""
    kept = {name: sys.modules.pop(name, None) for name in NAMES}
    if request.param == "stand-in":
        sys.modules["vapoursynth"] = fake_vapoursynth
    yield (
        sys.modules.get("vapoursynth") or importlib.import_module("vapoursynth"),
        (importlib.import_module("wgmb.hosts.vapoursynth")),
    )
    for name, module in kept.items():
        sys.modules.pop(name, None)
        if module is not None:
            sys.modules[name] = module


NAMES = "vapoursynth", "wgmb.hosts.vapoursynth"


@pytest.fixture(scope="module")
def device():
    return wgmb.gpu.open_device()


def picture(n):
    """A texture that moves; another one from 7 on."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].astype(np.float32)
    tone = make_frames.texture(x - 3.0 * n, y, 50.0 if n >= 7 else 0.0)
    return (np.clip(tone, 0, 1) * 255).round().astype(np.uint8)


def clip_of(vs, form, planes, props=None, rate=Fraction(24), count=COUNT):
    """A clip whose frame n has the arrays of planes(n)."""

    def made(n, f):
        frame = f.copy()
        for i, plane in enumerate(planes(n)):
            np.copyto(np.asarray(frame[i]), plane)
        for name, value in (props or {}).items():
            frame.props[name] = value
        return frame

    base = vs.core.std.BlankClip(
        width=SIZE[0], height=SIZE[1], format=form, length=count,
        fpsnum=rate.numerator, fpsden=rate.denominator,
    )  # fmt: skip
    return base.std.ModifyFrame(base, made)


def planes_of(frame):
    return [np.array(frame[i]) for i in range(frame.format.num_planes)]


@pytest.mark.covers(1)
@pytest.mark.parametrize("flow", ["none", "dis", pytest.param("search", marks=pytest.mark.full)])
def test_frames_in_any_order_from_many_threads_are_those_of_blur_pictures(hosted, device, flow):
    vs, host = hosted
    long = 40  # far more than is kept and read before

    def rgb(n):
        return np.moveaxis(picture(n % COUNT), 2, 0)

    settings = {"flow": flow, "flow_quality": "fast", "cuts": "only:7,31", "device": device}
    clip = clip_of(vs, vs.RGB24, rgb, count=long)
    want = list(wgmb.blur_pictures(
        (picture(n % COUNT) for n in range(long)), fps_in=24, fps=60, **settings
    ))  # fmt: skip
    blurred = host.blur(clip, shutter=180, fps=60, **settings)
    assert (blurred.num_frames, blurred.fps) == (len(want), 60)
    order = [99, 0, 40, *random.Random(1).sample(range(100), 9), 41, 39]
    with ThreadPoolExecutor(4) as pool:
        for n, frame in zip(order, pool.map(blurred.get_frame, order), strict=True):
            np.testing.assert_array_equal(np.stack(planes_of(frame), 2), want[n], f"frame {n}")
    ahead = host.blur(clip, shutter=180, fps=60, **settings)
    for n, frame in enumerate(ahead.frames(close=True)):
        np.testing.assert_array_equal(np.stack(planes_of(frame), 2), want[n], f"frame {n}")


def test_a_lost_device_is_told_in_one_line(hosted, device):
    vs, host = hosted
    own = wgmb.gpu.second_device(device)
    clip = clip_of(vs, vs.RGB24, lambda n: np.moveaxis(picture(n), 2, 0))
    blurred = host.blur(clip, shutter=180, flow="none", device=own)
    own.destroy()
    # VapourSynth itself puts the traceback of a function before its error.
    line = r"(^|\nwgmb\.errors\.DeviceError: )the GPU device was lost: .*$"
    with pytest.raises(vs.Error, match=line):
        blurred.get_frame(1)


def test_yuv_of_10_bits_is_that_of_the_file(hosted, device, tmp_path):
    vs, host = hosted
    tags = (1, 9, 16, 9)
    made = [make_clips.planes(n // 6, bits=10) for n in range(COUNT)]
    frames = [make_clips.frame(planes, "yuv420p10le") for planes in made]
    make_clips.write(tmp_path / "a.mkv", frames, codec="ffv1", pixels="yuv420p10le", tags=tags)
    blur_video(tmp_path / "a.mkv", tmp_path / "b.mkv", codec="ffv1", fps=25, device=device)
    props = {"_Matrix": 9, "_Transfer": 16, "_Primaries": 9, "_Range": 0}
    clip = clip_of(vs, vs.YUV420P10, lambda n: made[n], props)
    blurred = host.blur(clip, fps=25, device=device)
    file = VideoReader(tmp_path / "b.mkv")
    assert blurred.num_frames == len(file)
    for n, want in file:
        for ours, plane in zip(planes_of(blurred.get_frame(n)), want.planes, strict=True):
            np.testing.assert_array_equal(ours, plane)


@pytest.mark.parametrize("props, full", [
    ({}, False), ({"_Range": 1}, True), ({"_Range": 0}, False),
    ({"_ColorRange": 0}, True), ({"_ColorRange": 1}, False),
])  # fmt: skip
def test_both_forms_of_the_range_are_read(hosted, props, full):
    vs, host = hosted
    if hosted[0] is not fake_vapoursynth and "_ColorRange" in props:
        pytest.skip("this VapourSynth has the other form")
    clip = clip_of(vs, vs.YUV420P8, lambda n: make_clips.planes(n), {"_Matrix": 1, **props})
    coding = host.coding_of(clip.get_frame(0))
    assert (coding.full_range, coding.matrix, coding.steps) == (full, 1, (2, 2))


def test_grey_and_floats_come_back(hosted, device):
    vs, host = hosted
    grey = clip_of(vs, vs.GRAY8, lambda n: [picture(0)[..., 0]])
    bright = np.moveaxis(picture(0) / np.float32(50), 2, 0)
    floats = clip_of(vs, vs.RGBS, lambda n: bright, {"_Transfer": 8})
    for clip in (grey, floats):
        blurred = host.blur(clip, flow="dis", device=device)
        for ours, want in zip(planes_of(blurred.get_frame(3)), planes_of(clip.get_frame(3)),
                              strict=True):  # fmt: skip
            np.testing.assert_array_equal(ours, want)


def test_frames_have_the_properties_of_their_time(hosted, device):
    vs, host = hosted
    base = clip_of(vs, vs.RGB24, lambda n: np.moveaxis(picture(n), 2, 0))

    def numbered(n, f):
        frame = f.copy()
        frame.props["Shot"] = n
        return frame

    blurred = host.blur(base.std.ModifyFrame(base, numbered), fps=48, flow="none", device=device)
    props = blurred.get_frame(9).props
    assert (props["Shot"], props["_DurationNum"], props["_DurationDen"]) == (4, 1, 48)


def test_what_does_not_fit_is_one_line(hosted, device):
    vs, host = hosted
    clip = clip_of(vs, vs.RGB24, lambda n: np.moveaxis(picture(n), 2, 0))
    loose = vs.core.std.BlankClip(
        width=64, height=48, format=vs.RGB24, length=3, fpsnum=0, fpsden=1
    )
    deep = vs.core.std.BlankClip(
        width=64, height=48, format=vs.YUV444PS, length=3, fpsnum=24, fpsden=1
    )
    for bad, settings, said in (
        (loose, {}, "wgmb: the clip has no constant rate; `std.AssumeFPS` sets one"),
        (deep, {}, "wgmb: YUV444PS is not taken: float pictures are RGBS or RGBH"),
        (clip, {"fps": 0}, "wgmb: `fps` must be"),
        (clip, {"shuter": 9}, "wgmb: unknown setting 'shuter'"),
        (clip, {"flow": "best"}, "wgmb: "),
    ):
        with pytest.raises(vs.Error, match=said) as error:
            host.blur(bad, device=device, **settings)
        assert "\n" not in str(error.value)


def test_a_missing_vapoursynth_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "vapoursynth", None)
    monkeypatch.delitem(sys.modules, "wgmb.hosts.vapoursynth", raising=False)
    with pytest.raises(wgmb.InputError, match=r"wgmb\.hosts\.vapoursynth: VapourSynth is not "):
        importlib.import_module("wgmb.hosts.vapoursynth")


SCRIPT = """
import vapoursynth as vs
import numpy as np
from wgmb.hosts.vapoursynth import blur
from wgmb.video.read.reader import VideoReader
pictures = [planes for _, planes in VideoReader("a.mkv")]
def made(n, f):
    frame = f.copy()
    for i, plane in enumerate(pictures[n].planes):
        np.copyto(np.asarray(frame[i]), plane)
    frame.props.update(_Matrix=1, _Transfer=1, _Primaries=1, _Range=0)
    return frame
base = vs.core.std.BlankClip(
    width=64, height=48, format=vs.YUV420P8, length=12, fpsnum=24, fpsden=1
)
blur(base.std.ModifyFrame(base, made), shutter=180, fps=60, flow="dis").set_output()
"""


@pytest.mark.skipif(not REAL, reason="VapourSynth is not installed")
def test_vspipe_gives_the_bytes_of_the_command_line(tmp_path):
    vspipe = shutil.which("vspipe", path=str(sys.executable).rpartition("/")[0])
    if not vspipe or subprocess.run([vspipe, "--version"], capture_output=True).returncode:
        pytest.skip("vspipe does not run here: `vapoursynth config` sets it up")
    make_clips.write(tmp_path / "a.mkv", codec="ffv1", tags=(1, 1, 1, 1))
    (tmp_path / "a.vpy").write_text(SCRIPT)
    paths = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    how = {"cwd": tmp_path, "capture_output": True, "env": paths}
    ours = subprocess.run([vspipe, "-c", "y4m", "a.vpy", "-"], **how)
    line = [
        sys.executable,
        "-m",
        "wgmb",
        "blur",
        "a.mkv",
        "-o",
        "-",
        "--fps",
        "60",
        "--flow",
        "dis",
    ]
    want = subprocess.run(line, **how)
    assert (ours.returncode, want.returncode) == (0, 0)
    assert ours.stdout.split(b"\n", 1)[1] == want.stdout.split(b"\n", 1)[1] != b""
