"""`wgmb.blur_pictures`: the same as a video's file, from any iterable, with the caller's errors."""

import itertools
import tracemalloc
from fractions import Fraction

import av
import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb import InputError
from wgmb.color.srgb import linear
from wgmb.run.video import VideoRequest
from wgmb.settings import OutputSettings, ShutterSettings
from wgmb.settings.video import VideoSettings
from wgmb.video.exposures import VideoBlur

SIZE = 96, 64  # width, height


@pytest.fixture(scope="module")
def device():
    return wgmb.gpu.open_device()


def picture(n, kind=np.uint8):
    """A textured square over a textured background; another pair from 8 on; 4 is a flash."""
    width, height = SIZE
    y, x = np.mgrid[:height, :width].astype(np.float32)
    shot = 40.0 if n >= 8 else 0.0
    at = 20 + 4.0 * n
    inside = (abs(x - at) < 12) & (abs(y - 32) < 14)
    tone = np.where(
        inside[..., None], make.texture(x - at, y, 5.0 + shot), make.texture(x, y, shot)
    )
    tone = tone * (0.4 if n >= 8 else 1.0) if n != 4 else tone * 0 + 0.98
    most = 1 if np.dtype(kind).kind == "f" else np.iinfo(kind).max
    return (np.clip(tone, 0, 1) * most).round().astype(kind) if most > 1 else tone.astype(kind)


def pictures(count=14, kind=np.uint8):
    return [picture(n, kind) for n in range(count)]


def write_video(path, rate):
    """The same pictures in a file that keeps every sample."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=rate)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "bgr0"
        stream.codec_context.color_trc = 13
        for array in pictures():
            frame = av.VideoFrame.from_ndarray(array, format="rgb24").reformat(format="bgr0")
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    return path


@pytest.mark.covers(1)
@pytest.mark.parametrize("fps_in, fps", [(24, "24"), (24, "60"), (24, "6"), (60, "24")])
@pytest.mark.parametrize("flow", ["none", "dis", pytest.param("search", marks=pytest.mark.full)])
def test_pictures_are_those_of_the_file(tmp_path, device, flow, fps_in, fps):
    video = write_video(tmp_path / "a.avi", fps_in)
    settings = VideoSettings(flow=flow, flow_quality="fast")
    run = VideoRequest(video=settings, shutter=ShutterSettings(shutter=180)).open(device)
    plan = run.plan(video, OutputSettings(output="x.mkv", fps=fps))
    coding = plan.reader.coding
    assert (coding.model, coding.bits, coding.transfer) == ("rgb", 8, 13)
    blur = VideoBlur(plan.reader, run.blur, run.motion, clock=plan.clock)
    shutter, wanted = run.request.shutter.make(), plan.wanted
    exposed = blur.of(blur.pictures(shutter, wanted), shutter, wanted)
    want = [exposure.coded(coding).planes for _, exposure in exposed]
    got = wgmb.blur_pictures(
        iter(pictures()), fps_in=fps_in, fps=fps, flow=flow, flow_quality="fast", device=device
    )
    assert got.count(14) == len(want)
    for ours, planes in itertools.zip_longest(got, want):
        np.testing.assert_array_equal(ours, np.stack(planes, axis=2))
    assert got.cuts == blur.shots.cuts == [8]
    assert got.flashes == blur.shots.flashes == [4]
    assert got.read == 14


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float16, np.float32, np.float64])
def test_results_are_like_the_pictures_and_still_ones_come_back(device, kind):
    still = [picture(1, kind)] * 3
    for array in wgmb.blur_pictures(still, flow="dis", device=device):
        assert array.dtype == kind and array.flags.c_contiguous
        off = 0 if np.dtype(kind).kind == "u" else 1e-3 if kind == np.float16 else 4e-6
        np.testing.assert_allclose(array, still[0], atol=off)


@pytest.mark.parametrize("flow", ["none", "dis"])
def test_linear_floats_are_not_rounded_and_may_exceed_white(device, flow):
    bright = [(linear(picture(n, np.float32)) * 50 + 1e-5 * n).astype("f4") for n in range(4)]
    still = wgmb.blur_pictures([bright[0]] * 3, transfer="linear", flow=flow, device=device)
    for array in still:
        np.testing.assert_array_equal(array, bright[0])
    (mean,) = wgmb.blur_pictures(bright[:2], transfer="linear", flow="none", fps_in=2, fps=1,
                                 shutter=360, phase="start", device=device)  # fmt: skip
    a, b = (array.astype(float) for array in bright[:2])
    share = np.sum((mean - a) * (b - a)) / np.sum((b - a) ** 2)
    assert 0.2 < share < 0.8
    np.testing.assert_allclose(mean, a + share * (b - a), rtol=4e-6)


def test_alpha_is_straight_and_kept(device):
    alpha = np.linspace(40, 255, SIZE[0]).astype(np.uint8) * np.ones((SIZE[1], 1), np.uint8)
    rgba = [np.dstack([picture(1), alpha])] * 3
    for kind in (np.uint8, np.float32):
        given = [array.astype(kind) / (255 if kind == np.float32 else 1) for array in rgba]
        given = [array.astype(kind) for array in given]
        for array in wgmb.blur_pictures(given, flow="dis", device=device):
            np.testing.assert_allclose(array, given[0], atol=1 if kind == np.uint8 else 1e-5)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_pictures_are_no_exception(device, count):
    given = pictures(count)
    assert len(list(wgmb.blur_pictures(given, device=device, flow="dis"))) == count
    more = wgmb.blur_pictures(given, fps_in=10, fps=25, device=device, flow="dis")
    assert len(list(more)) == more.count(count) == [0, 3, 5][count]


class Tensor:
    """The protocol by which another library's tensor shows itself."""

    def __init__(self, array, where=1):
        self.array, self.where = array, where

    def __dlpack__(self, **how):
        return self.array.__dlpack__(**how)

    def __dlpack_device__(self):
        return self.where, 0


def test_tensors_are_taken_and_come_back(device, monkeypatch):
    monkeypatch.setattr(f"{__name__}.from_dlpack", Tensor, raising=False)
    given = pictures(3)
    got = list(wgmb.blur_pictures(map(Tensor, given), flow="dis", device=device))
    want = wgmb.blur_pictures(given, flow="dis", device=device)
    for tensor, array in zip(got, want, strict=True):
        assert isinstance(tensor, Tensor)
        np.testing.assert_array_equal(tensor.array, array)


@pytest.mark.parametrize("bad, said", [
    (np.zeros((64, 90, 3), np.uint8), r"picture 2 must be 96 x 64 .* got 90 x 64"),
    (np.zeros((64, 96, 4), np.uint8), r"picture 2 .* got 96 x 64 with 4 channels"),
    (np.zeros((64, 96, 3), np.uint16), r"picture 2 .* 3 channels of uint8 .* of uint16"),
    (np.zeros((64, 96, 3), np.int64), r"picture 2 must be uint8, .* got int64"),
    (np.zeros((64, 96), np.uint8), r"picture 2 must be \(height, width, 3 or 4\), got \(64, 96\)"),
    (Tensor(np.zeros((64, 96, 3), np.uint8), where=2), r"picture 2 is on a GPU; .*`\.cpu\(\)`"),
])  # fmt: skip
def test_pictures_that_do_not_fit_are_named(device, bad, said):
    with pytest.raises(InputError, match=said) as error:
        list(wgmb.blur_pictures([*pictures(2), bad], device=device, flow="dis"))
    assert "\n" not in str(error.value)


def test_the_size_of_a_picture_is_checked_before_its_values(device):
    huge = np.broadcast_to(np.float32(1), (40_000, 50_000, 3))
    with pytest.raises(InputError, match=r"picture 0 must be at most 32768 .* got 50000 x 40000"):
        next(wgmb.blur_pictures([huge], device=device))
    with pytest.raises(InputError, match="holdout must be at most 32768"):
        wgmb.blur_pictures([], holdout=huge[..., 0], device=device)


@pytest.mark.parametrize("bad", [None, 5, "in.mp4", b"x"])
def test_what_holds_no_pictures_is_refused_at_once(device, bad):
    with pytest.raises(InputError, match=r"^pictures must be"):
        wgmb.blur_pictures(bad, device=device)


def test_what_is_not_finite_is_named(device):
    bad = picture(1, np.float32)
    bad[3, 4] = np.nan
    with pytest.raises(InputError, match="picture 1 must be finite"):
        list(wgmb.blur_pictures([picture(0, np.float32), bad], device=device))


@pytest.mark.parametrize("settings, said", [
    ({"fps": 60}, "`fps` needs the rate of the pictures; set `fps_in`"),
    ({"fps_in": 0}, "`fps_in` must be 0.001 to 1000"),
    ({"transfer": "log"}, "transfer"),
    ({"shuter": 90}, "unknown setting 'shuter'.*shutter"),
    ({"flow": "best"}, "`flow` must be .* got 'best'"),
    ({"flow_quality": "bets"}, "`flow_quality` must be .* did you mean 'best'"),
    ({"fsp": 60}, "^unknown setting 'fsp'; did you mean 'fps'\\?$"),
    ({"angle": 90}, "^unknown setting 'angle'; did you mean 'shutter'\\?$"),
    ({"no_flow": True}, "^unknown setting 'no_flow'; did you mean flow='none'\\?$"),
    ({"log": 1}, "^unknown setting 'log'$"),
    ({"flow": "dis", "flow_quality": "draft"}, "`flow_quality` draft is for `flow` search"),
    ({"duplicates": "z"}, "`duplicates` must be"),
    ({"codec": "h264"}, "unknown setting 'codec'"),
    ({"holdout": np.zeros((64, 96)), "flow": "none"}, "`holdout` needs motion"),
    ({"holdout": np.zeros(3)}, r"`holdout` must be \(height, width\)"),
    ({"highlights": 4.0, "transfer": "linear"}, "not for HDR"),
])  # fmt: skip
def test_settings_that_do_not_fit_are_refused_at_once(device, settings, said):
    with pytest.raises(InputError, match=said):
        wgmb.blur_pictures(pictures(1), device=device, **settings)


@pytest.mark.parametrize("kind", [IndexError, LookupError, KeyError, ValueError, OSError])
def test_exceptions_of_the_caller_arrive_unchanged(device, kind):
    def source(good):
        yield from pictures(good)
        raise kind("mine")

    for good in (0, 3):
        with pytest.raises(kind) as error:
            list(wgmb.blur_pictures(source(good), device=device, flow="dis"))
        assert type(error.value) is kind and error.value.args == ("mine",)


def test_memory_that_is_filled_again_is_no_trap(device):
    buffer = np.empty((*SIZE[::-1], 3), np.uint8)

    def refilled():
        for array in pictures(6):
            buffer[:] = array
            yield buffer

    got = wgmb.blur_pictures(refilled(), device=device, flow="dis")
    for ours, want in zip(
        got, wgmb.blur_pictures(pictures(6), device=device, flow="dis"), strict=True
    ):
        np.testing.assert_array_equal(ours, want)


def test_pictures_are_read_as_far_as_is_needed_and_the_run_can_be_closed(device):
    run = wgmb.blur_pictures((picture(n % 4) for n in itertools.count()), device=device, flow="dis")
    for _ in range(3):
        next(run)
    assert run.read <= 12
    run.close()
    with pytest.raises(StopIteration):
        next(run)


@pytest.mark.full
def test_memory_does_not_grow(device):
    run = wgmb.blur_pictures((picture(n % 4) for n in range(2000)), device=device, flow="dis")
    for _ in itertools.islice(run, 50):
        pass
    tracemalloc.start()
    begun = tracemalloc.get_traced_memory()[0]
    for _ in run:
        pass
    assert tracemalloc.get_traced_memory()[0] - begun < 5e6
    tracemalloc.stop()


def test_a_rate_may_be_a_fraction(device):
    run = wgmb.blur_pictures(pictures(3), fps_in=Fraction(24000, 1001), fps="60000/1001",
                             device=device, flow="none")  # fmt: skip
    assert len(list(run)) == run.count(3) == 8


def test_a_holdout_stays_sharp(device):
    held = np.zeros(SIZE[::-1])
    held[:, 30:60] = 1
    given = pictures(4)
    run = wgmb.blur_pictures(given, holdout=held, device=device, flow="dis", shutter=360)
    for n, array in enumerate(run):
        np.testing.assert_allclose(array[:, 34:56], given[n][:, 34:56], atol=1)
        if n == 1:
            assert np.abs(array[:, :30] - given[n][:, :30].astype(float)).max() > 8
    with pytest.raises(InputError, match="holdout"):
        list(wgmb.blur_pictures(given, holdout=held[:10], device=device, flow="dis"))
