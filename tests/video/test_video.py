"""Videos: at the rate asked for, written as the frames come, and what a GIF can hold."""

import errno
from fractions import Fraction

import av
import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from PIL import Image

import make_frames as make
from wgmb import InputError
from wgmb.color.srgb import to_display
from wgmb.output.output import Output
from wgmb.video.write.encoders import Encoding, chosen
from wgmb.video.write.frames import FrameVideo

SETTINGS = "{}"


def written(path, frames, fps) -> FrameVideo:
    video = FrameVideo(path, path.with_name("part"), Fraction(fps), SETTINGS)
    for rgb in frames:
        video.add(rgb)
    video.close()
    return video


def plain(count: int):
    """Frames of one colour each, unlike their neighbours."""
    return [np.full((12, 16, 3), 0.2 + 0.3 * (n % 3), "f4") for n in range(count)]


def delays(path) -> list[int]:
    """Of every frame of a GIF [1/100 s]."""
    with Image.open(path) as image:
        found = []
        for n in range(image.n_frames):
            image.seek(n)
            found.append(image.info["duration"] // 10)
        return found


@pytest.mark.parametrize("fps", ["24", "25", "30", "50", "24000/1001", "29.97", "7", "0.4"])
def test_a_gif_has_the_rate_it_is_given(tmp_path, fps):
    written(tmp_path / "v.gif", plain(25), fps)
    got, exact = delays(tmp_path / "v.gif"), 100 / Fraction(fps)
    assert len(got) == 25
    shown = np.cumsum([0, *got])  # when every frame begins, and the last one ends
    for n, begins in enumerate(shown):
        assert abs(begins - n * exact) <= 1
    assert max(got) - min(got) <= 1


@pytest.mark.parametrize(
    ("suffix", "fps", "said"),
    [(".gif", "50.1", "50"), (".gif", "1000", "50"), (".gif", "0.001", "1/600"),
     (".mp4", "1e-9", "1/1000"), (".webm", "0.0009", "1/1000")],
)  # fmt: skip
def test_a_rate_that_a_video_cannot_have_is_refused_before_any_work(tmp_path, suffix, fps, said):
    with pytest.raises(InputError, match=rf"{suffix}.*{said}.*frames per second"):
        Output(tmp_path / f"v{suffix}", numbers=[1, 2], fps=Fraction(fps))
    assert make.names_in(tmp_path) == []


def test_a_gif_goes_to_the_disk_as_its_frames_come(tmp_path):
    rng = np.random.default_rng(0)
    video = FrameVideo(tmp_path / "v.gif", tmp_path / "part", Fraction(24), SETTINGS)
    sizes = [0]
    for _ in range(2):
        for _ in range(16):
            video.add((rng.integers(0, 6, (120, 160, 3)) / 5).astype("f4"))
        sizes.append((tmp_path / "part").stat().st_size)
    assert all(size > 200_000 for size in np.diff(sizes))
    video.abandon()
    assert make.names_in(tmp_path) == []


def test_a_gif_has_colours_of_its_own_in_every_frame_and_dithers(tmp_path):
    """In the mean of 4 x 4 pixels, as eyes see them, it is nearer than without dithering."""
    y, x = np.mgrid[:90, :160] / 160
    frames = [np.stack([x, y, 0 * x + 0.3 * n], 2).astype("f4") for n in range(3)]
    written(tmp_path / "v.gif", frames, 24)
    with Image.open(tmp_path / "v.gif") as image:
        for n, rgb in enumerate(frames):
            image.seek(n)
            shown, want = image.convert("RGB"), Image.fromarray(to_display(rgb, 8))
            assert len(shown.getcolors(1 << 16)) > 200
            flat = want.quantize(256, dither=Image.Dither.NONE).convert("RGB")
            assert apart(shown, want) < 0.7 * apart(flat, want)


def test_a_gif_shows_a_picture_whose_palette_was_there_before(tmp_path):
    """FFmpeg compared indices with those of the picture before, which had another palette."""
    colors = [(0, 0, 1), (1, 1, 0), (0, 0, 1), (1, 1, 0)]
    written(tmp_path / "v.gif", [np.full((12, 16, 3), color, "f4") for color in colors], 10)
    with Image.open(tmp_path / "v.gif") as image:
        for n, color in enumerate(colors):
            image.seek(n)
            shown = np.asarray(image.convert("RGB"), int)
            assert np.abs(shown - np.array(color) * 255).max() <= 2


def apart(got: Image.Image, want: Image.Image) -> float:
    difference = np.asarray(got, "f4") - np.asarray(want, "f4")
    return float(np.abs(sliding_window_view(difference, (4, 4), (0, 1)).mean((-1, -2))).mean())


def test_a_gif_may_stand_still(tmp_path):
    written(tmp_path / "v.gif", [plain(1)[0]] * 5, 24)
    assert sum(delays(tmp_path / "v.gif")) == 21
    assert len(delays(tmp_path / "v.gif")) == 5


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv", ".webm"])
@pytest.mark.parametrize("fps", ["0.333333333333", "999.999999999", "23.976"])
def test_rates_of_many_digits_are_taken(tmp_path, suffix, fps):
    path = tmp_path / f"v{suffix}"
    written(path, plain(3), fps)
    with av.open(str(path)) as container:
        assert container.streams.video[0].average_rate == pytest.approx(Fraction(fps), rel=1e-5)
        assert len(list(container.decode(video=0))) == 3


def test_an_error_names_the_video_and_keeps_its_number(tmp_path):
    path = tmp_path / "v.mp4"
    video = FrameVideo(path, tmp_path / "folder" / "v.part", Fraction(24), SETTINGS)
    with pytest.raises(OSError, match=r"v\.mp4: No such file") as error:
        video.add(plain(1)[0])
        video.close()
    assert error.value.errno == errno.ENOENT
    assert "part" not in str(error.value)


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_the_same_pictures_give_the_same_bytes_on_any_processor(tmp_path, codec, monkeypatch):
    """x264 took other algorithms by what it took the processor for: 1 of 5 runs had other bytes."""
    path = tmp_path / "v.mkv"
    encoding = chosen(path, codec)
    rng, y = np.random.default_rng(5), np.mgrid[:96, :160][0] / 96
    scene = [
        np.stack([y * n / 3, y, 1 - y], 2) + rng.normal(0, 0.1, (96, 160, 3)) for n in range(3)
    ]
    made, own = [], Encoding.options
    for more in ("", ":asm=0"):
        monkeypatch.setattr(
            Encoding,
            "options",
            lambda self, *given, more=more: {
                k: v + more * k.endswith("-params") for k, v in own(self, *given).items()
            },
        )
        video = FrameVideo(path, tmp_path / "part", Fraction(24), SETTINGS, encoding=encoding)
        for picture in scene:
            video.add(np.clip(picture, 0, 1).astype("f4"))
        video.close()
        with av.open(str(path)) as file:
            made.append([frame.to_ndarray() for frame in file.decode(video=0)])
    assert len(made[0]) == 3
    assert all(np.array_equal(a, b) for a, b in zip(*made, strict=True))
