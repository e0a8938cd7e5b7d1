"""`--highlights`: white that was cut off counts as many times white while it is blurred."""

import numpy as np
import pytest
from PIL import Image

import make_clips as clips
import make_frames as make
from wgmb import Clip, InputError, gpu
from wgmb.cli import app
from wgmb.color.coding import CodedPicture, Coding
from wgmb.color.highlights import Expansion
from wgmb.color.srgb import linear, to_display
from wgmb.gpu.textures import TexturePool
from wgmb.video.planes import Planes
from wgmb.video.read.reader import VideoReader

KNEE = 0.92
LAMPS = Expansion(8.0)


def slowly(rgb, times):
    """One pixel."""
    least = min(rgb)
    if least <= KNEE:
        return list(rgb)
    bent = least + (times - 1) * ((least - KNEE) / (1 - KNEE)) ** 2
    if least > 1:
        bent = times + (1 + 2 * (times - 1) / (1 - KNEE)) * (least - 1)
    return [c * bent / least for c in rgb]


def colors(count=400, channels=3, seed=3):
    """(20, 20, channels) light to white, premultiplied, with black, grey, white and one clear."""
    rng = np.random.default_rng(seed)
    rgba = rng.random((count, channels)).astype("f4") ** 0.3
    rgba[:4, :3] = [[0, 0, 0], [1, 1, 1], [1, 0, 0], [KNEE, KNEE, 0.1]]
    if channels == 4:
        rgba[:4, 3] = 1
        rgba[4, 3] = 0
        rgba[:, :3] *= rgba[:, 3:]
    return rgba.reshape(20, -1, channels)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("times", [1.0, 2.0, 8.0, 32.0])
def test_the_curve_is_its_twin_and_has_its_inverse(times, channels):
    light = colors(channels=channels)
    got = Expansion(times).expanded(light)
    for pixel, found in zip(light.reshape(-1, channels), got.reshape(-1, channels), strict=True):
        alpha = pixel[3] if channels == 4 else 1.0
        straight = pixel[:3] / alpha if alpha else pixel[:3]
        np.testing.assert_allclose(found[:3], alpha * np.array(slowly(straight, times)), 1e-4)
        assert channels == 3 or found[3] == alpha
    np.testing.assert_allclose(Expansion(times).compressed(got), light, atol=2e-6)
    assert got[0, 1, 0] == pytest.approx(times)


def test_the_curve_ascends_and_has_no_corner():
    grey = np.linspace(0, 1, 10_001, dtype="f8")
    assert LAMPS.compressed(LAMPS.expanded(np.ones((1, 1, 3), "f4")))[0, 0, 0] == 1
    light = LAMPS.expanded(np.repeat(grey[None, :, None], 3, 2))[0, :, 0].astype("f8")
    slope = np.diff(light) / np.diff(grey)
    assert slope.min() > 0.99 and np.abs(np.diff(slope)).max() < 0.5  # up to 176; f32 rounds
    np.testing.assert_array_equal(light[grey <= KNEE], grey[grey <= KNEE].astype("f4"))


def test_paint_is_no_light():
    """A colour that is cut off in one or two of its channels only."""
    paint = np.array([[[1, 0.9, 0.1], [1, 0.1, 0.1], [0.1, 1, 1]]], "f4")
    np.testing.assert_array_equal(LAMPS.expanded(paint), paint)
    np.testing.assert_array_equal(LAMPS.compressed(paint), paint)


def picture(channels):
    """Coded as R, G, B in 8 bits, over all values, with alpha perhaps."""
    rng = np.random.default_rng(1)
    planes = [rng.integers(0, 256, (16, 24)).astype("u1") for _ in range(channels)]
    planes[0][:4] = planes[1][:4] = 255
    coding = Coding("rgb", 8, (1, 1), channels == 4, True, 0, 13)
    return CodedPicture(tuple(planes), coding)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("times", [2.0, 8.0, 32.0])
def test_shaders_are_their_twin(times, channels):
    device, coded = gpu.open_device(None), picture(channels)
    planes, images = Planes(device, Expansion(times)), TexturePool(device)
    encoder = device.create_command_encoder()
    light = images.texture("light", coded.size, "rgba32float")
    planes.decode(encoder, coded, light.create_view())
    got = images.download(encoder, light)
    want = linear(np.stack(coded.planes[:3], 2) / np.float32(255))
    if channels == 4:
        alpha = coded.planes[3][..., None] / np.float32(255)
        want = np.concatenate([want * alpha, alpha], 2)
    want = np.minimum(want, 1)
    np.testing.assert_allclose(
        got[..., :channels], Expansion(times).expanded(want), rtol=2e-3, atol=2e-5
    )
    encoder = device.create_command_encoder()
    compressed = images.texture("compressed", coded.size, "rgba32float")
    planes.compress(encoder, light.create_view(), compressed.create_view())
    plain = images.download(encoder, compressed)
    np.testing.assert_allclose(plain[..., :channels], want, atol=2e-5)
    back = planes.encode(device.create_command_encoder(), light.create_view(), coded.coding)
    clear = coded.planes[3] == 0 if channels == 4 else np.zeros((16, 24), bool)
    for before, after in zip(coded.planes, back.planes, strict=True):
        np.testing.assert_array_equal(before[~clear], after[~clear])


@pytest.mark.parametrize("times", [8.0, 32.0])
def test_samples_above_white_come_back(times):
    """Y'CbCr holds them; 16-bit floats hold what they become."""
    device, coding = gpu.open_device(None), Coding(bits=10, steps=(1, 1))
    luma, blue, red = np.meshgrid([700, 940, 1019], [400, 512, 1019], [400, 512, 1019])
    coded = CodedPicture(tuple(p.reshape(3, 9).astype("u2") for p in (luma, blue, red)), coding)
    planes, images = Planes(device, Expansion(times)), TexturePool(device)
    encoder, light = device.create_command_encoder(), images.texture("light", (9, 3), "rgba32float")
    planes.decode(encoder, coded, light.create_view())
    plain = images.texture("plain", (9, 3), "rgba32float")
    Planes(device).decode(encoder, coded, plain.create_view())
    got = images.download(encoder, light)
    want = images.download(device.create_command_encoder(), plain)
    want = np.array([slowly(pixel, times) for pixel in want[..., :3].reshape(-1, 3).astype("f8")])
    np.testing.assert_allclose(got[..., :3].reshape(-1, 3), want, rtol=2e-3, atol=1e-4)
    assert np.isfinite(got.astype("f2")).all()
    back = planes.encode(device.create_command_encoder(), light.create_view(), coding)
    for before, after in zip(coded.planes, back.planes, strict=True):
        assert np.abs(before.astype(int) - after).max() <= 1


def run(capsys, *words, code=0):
    got = app.main([str(w) for w in words])
    text = capsys.readouterr().err
    assert got == code, text
    return text


def lamp(n):
    """(64, 96) signal of a white square that moves 12 px a frame over dark, textured ground."""
    y, x = np.mgrid[:64, :96].astype("f4")
    ground = 0.1 + 0.2 * make.texture(x, y)[..., 1]
    return np.where((abs(x - 18 - 12 * n) < 6) & (abs(y - 32) < 8), 1.0, ground)


def video(path, signals):
    def frames():
        for signal in signals:
            chroma = np.full((32, 48), 128, "u1")
            yield clips.frame([(16 + 219 * signal).round().astype("u1"), chroma, chroma], "yuv420p")

    times = [clips.Fraction(n, 24) for n in range(len(signals))]
    return clips.write(path, list(frames()), times, codec="ffv1")


def lumas(path):
    return [coded.planes[0].astype(int) for _, coded in VideoReader(path)]


@pytest.mark.parametrize("flow", ["none", "dis"])
def test_a_still_video_stays_as_it_is(tmp_path, capsys, flow):
    source, out = video(tmp_path / "a.mkv", [lamp(2)] * 6), tmp_path / "b.mkv"
    words = ["--codec", "ffv1", "--fps", 12, "--flow", flow, "--highlights", 8, "-q"]
    run(capsys, "blur", source, "-o", out, *words)
    for got in lumas(out):
        assert np.abs(got - lumas(source)[0]).max() <= 1


def test_lamps_of_a_video_streak_brighter_by_the_exact_average(tmp_path, capsys):
    """Planes and frames of it, averaged: each as the mean of expanded light, compressed."""
    source = video(tmp_path / "a.mkv", [lamp(n) for n in range(6)])
    words = ["--fps", 8, "--shutter", 360, "--flow", "none", "--cuts", "only:0", "-q"]
    for times in (1, 8):
        more = ["--highlights", times]
        run(capsys, "blur", source, "-o", tmp_path / f"{times}.mkv", "--codec", "ffv1", *words,
            *more)  # fmt: skip
        run(capsys, "blur", source, "-o", tmp_path / f"{times}.#.png", *words, *more)
    light = linear((np.stack(lumas(source)[2:5]) - 16) / np.float32(219))
    light = [LAMPS.expanded(np.repeat(one[..., None], 3, 2)) for one in light]
    want = to_display(LAMPS.compressed(np.mean(light, 0)), 8)[..., 0].astype(int)
    with Image.open(tmp_path / "8.2.png") as image:
        assert np.abs(np.asarray(image)[..., 0] - want).max() <= 1
    planes = lumas(tmp_path / "8.mkv")[1]
    assert np.abs((planes - 16) * 255 / 219 - want).max() <= 1.5
    assert planes.max() > lumas(tmp_path / "1.mkv")[1].max() + 30


def test_lamps_of_pictures_streak_brighter_and_the_rest_stays(tmp_path, capsys):
    for n in range(1, 4):
        shown = np.repeat((255 * lamp(n)).round().astype("u1")[..., None], 3, 2)
        Image.fromarray(shown).save(tmp_path / f"a.{n}.png")
    words = ["blur", tmp_path / "a.#.png", "--frames", 2, "--flow", "dis", "--shutter", 360]
    made = {}
    for times in (1, 8):
        out = tmp_path / f"{times}.#.png"
        run(capsys, *words, "-o", out, "--highlights", times)
        with Image.open(tmp_path / f"{times}.2.png") as image:
            made[times] = np.asarray(image).astype(int)
    still = np.s_[:10]
    with Image.open(tmp_path / "a.2.png") as image:
        assert np.abs(np.asarray(image) - made[8])[still].max() <= 1
    # Beside the lamp, light falls by the neighbours' share of the exposure at most, a quarter.
    assert (made[8] - made[1])[24:40].max() > 30 and (made[8] - made[1]).min() >= -8
    again = run(capsys, *words, "-o", tmp_path / "8.#.png", "--highlights", 8, "--resume")
    assert "1 already done" in again
    assert "1 already done" not in run(
        capsys, *words, "-o", tmp_path / "8.#.png", "--highlights", 4, "--resume"
    )


@pytest.mark.parametrize("times", ["0.5", "33", "nan", "-8"])
def test_numbers_that_make_no_sense_are_one_line(tmp_path, capsys, times):
    source = video(tmp_path / "a.mkv", [lamp(0)] * 2)
    for n in (1, 2):
        Image.fromarray(np.zeros((8, 8, 3), "u1")).save(tmp_path / f"a.{n}.png")
    for given, out in ((source, "b.mkv"), (tmp_path / "a.#.png", "b.#.png")):
        words = ["-o", tmp_path / out, "--flow", "dis", f"--highlights={times}", "-q"]
        text = run(capsys, "blur", given, *words, code=2)
        assert "--highlights must be 1 to 32 times white" in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == ["a.1.png", "a.2.png", "a.mkv"]


def test_light_above_white_is_refused(tmp_path, capsys):
    make.write_exr(tmp_path / "a.1.exr", make.frame(1))
    words = ["-o", tmp_path / "b.1.exr", "--highlights", 8]
    text = run(capsys, "blur", tmp_path / "a.1.exr", *words, code=2)
    assert "--highlights is for pictures clipped at white" in text and text.count("\n") == 1
    pq = clips.write(tmp_path / "a.mp4", tags=(1, 9, 16, 9))
    words = ["-o", tmp_path / "b.mp4", "--flow", "none", "--highlights", 8, "-q"]
    text = run(capsys, "blur", pq, *words, code=2)
    assert "--highlights is for videos clipped at white, not for HDR" in text
    assert make.names_in(tmp_path) == ["a.1.exr", "a.mp4"]
    with pytest.raises(InputError, match=r"up to 1\.5 times white"):
        LAMPS.expanded(np.full((2, 2, 3), 1.5, "f4"))
    with pytest.raises(InputError, match="1 to 32"):
        Clip(tmp_path / "a.1.exr").expand_highlights(0.1)
