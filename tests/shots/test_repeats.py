"""Repeated pictures are found under the noise of a codec, and real motion is none."""

import av
import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from wgmb.shots.cadence import at_own_times
from wgmb.shots.reader import Picture, ShotReader
from wgmb.video.read.reader import VideoReader
from wgmb.video.scan import scan_video
from wgmb.video.thumbnail import Thumbnail, change, is_cut

pytestmark = pytest.mark.fast

WIDTH, HEIGHT = 320, 180
RNG = np.random.default_rng(4)


def texture(width, low=30, high=120):
    """A smooth ground."""
    few = RNG.integers(low, high, (HEIGHT // 6, width // 6, 3), dtype=np.uint8)
    return np.asarray(Image.fromarray(few).resize((width, HEIGHT), Image.Resampling.BICUBIC))


CRF = [24, *(pytest.param(crf, marks=pytest.mark.full) for crf in (18, 30))]
GROUND = texture(WIDTH)
WIDE = texture(3 * WIDTH, 30, 220)


def square(x, size=70):
    """A yellow square before the ground, at a place between pixels."""
    across, down = np.arange(WIDTH)[None], np.arange(HEIGHT)[:, None]
    left, top = np.minimum(across - x + 1, x + size - across), np.minimum(down - 9, 80 - down)
    alpha = (np.clip(left, 0, 1) * np.clip(top, 0, 1))[..., None]
    return (GROUND * (1 - alpha) + np.array((240, 230, 60)) * alpha).astype(np.uint8)


def with_timer(number):
    """The square every second picture, and digits that count in each."""
    image = Image.fromarray(square(10 + 5 * (number // 2 * 2)))
    text, font = f"0:{number / 60:06.3f}", ImageFont.load_default(size=16)
    ImageDraw.Draw(image).text((200, 8), text, fill=(255, 255, 255), font=font)
    return np.asarray(image)


def pointer(x, y):
    """A small pointer on a white desk."""
    desk = np.full((360, 640, 3), 235, np.uint8)
    desk[40:330, 60:580] = 255
    desk[round(y) : round(y) + 12, round(x) : round(x) + 12] = 20
    return desk


def encoded(path, images, crf):
    """A video in H.264 with its noise."""
    with av.open(str(path), "w") as out:
        options = {"crf": str(crf), "preset": "veryfast"}
        stream = out.add_stream("libx264", rate=30, options=options)
        stream.height, stream.width = images[0].shape[:2]
        for image in images:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), "rgb24")
            out.mux(stream.encode(frame.reformat(format="yuv420p")))
        out.mux(stream.encode(None))
    return VideoReader(path)


def doubles(reader):
    """The numbers of the pictures that are found to be repeated."""
    times = [float(time) for time in reader.times]
    pictures = (Picture(times[n], Thumbnail(coded), n) for n, coded in reader)
    shots = ShotReader(pictures, is_cut=is_cut, change=change)
    for time in times:
        shots.at(time)
    return shots.doubles


@pytest.mark.parametrize("crf", CRF)
@pytest.mark.parametrize(
    ("images", "first"),
    [
        ([square(10 + 5 * (n * 4 // 5)) for n in range(50)], lambda n: n % 5 != 1),
        ([square(10 + 5 * (n // 2 * 2)) for n in range(30)], lambda n: n % 2 == 0),
        ([square(10 + 5 * (n // 3 * 3)) for n in range(30)], lambda n: n % 3 == 0),
        ([square(10 + 5 * (n // 5 * 5)) for n in range(40)], lambda n: n % 5 == 0),
        ([square(10 + 5 * (2 * n // 5)) for n in range(40)],
         lambda n: n == 0 or 2 * n // 5 != 2 * (n - 1) // 5),
        ([with_timer(n) for n in range(30)], lambda n: n % 2 == 0),
        ([WIDE[:, 3 * (n // 2 * 2) :][:, :WIDTH] for n in range(30)], lambda n: n % 2 == 0),
    ],
    ids=["24 in 30", "twos", "threes", "fives", "24 in 60", "timer", "camera on twos"],
)  # fmt: skip
def test_repeats_under_a_codecs_noise_are_all_found(tmp_path, images, first, crf):
    reader = encoded(tmp_path / "a.mp4", images, crf)
    assert doubles(reader) == [n for n in range(len(images)) if not first(n)]


def blinking(number):
    """A slow camera, and a stroboscope that lights every third picture."""
    image = WIDE[:, number:][:, :WIDTH]
    return (
        np.clip(image.astype(int) * 2 + 60, 0, 255).astype(np.uint8) if number % 3 == 0 else image
    )


@pytest.mark.parametrize("crf", CRF)
@pytest.mark.parametrize(
    "images",
    [
        [pointer(100 + 2 * n, 120 + n) for n in range(40)],
        [pointer(100 + 20 * n, 120) for n in range(20)],
        [pointer(100 + 25 * np.sin(n / 3), 120 + n) for n in range(40)],
        [WIDE[:, 2 * n :][:, :WIDTH] for n in range(30)],
        [WIDE[:, int(300 + 200 * np.sin(n * 0.3)) :][:, :WIDTH] for n in range(40)],
        [square(10 + 0.2 * n * n) for n in range(2, 30)],
        [blinking(n) for n in range(30)],
        [square(10 + 5 * n) if n < 15 else WIDE[:, 2 * n :][:, :WIDTH] for n in range(30)],
    ],
    ids=["slow pointer", "fast pointer", "pointer to and fro", "camera", "camera to and fro",
         "speeds up", "stroboscope", "a cut to what is slower"],
)  # fmt: skip
def test_real_motion_is_no_repeat(tmp_path, images, crf):
    assert doubles(encoded(tmp_path / "a.mp4", images, crf)) == []


def test_a_slow_fade_keeps_its_brightness(tmp_path):
    """Pictures that a codec itself repeats may be left out; steps of brightness may not."""
    images = [(GROUND * (0.35 + 0.3 * n / 60)).astype(np.uint8) for n in range(60)]
    reader = encoded(tmp_path / "a.mp4", images, 20)
    levels = [float(coded.planes[0].mean()) for _, coded in reader]
    left = set(doubles(reader))
    kept = [n for n in range(60) if n not in left]
    filled = np.interp(range(60), kept, [levels[n] for n in kept])
    assert np.abs(filled - levels).max() < 0.5
    assert len(left) < 10


def own_times(numbers, rate=30.0):
    """The times of pictures that are left of a file, counted in its intervals."""
    pictures = [Picture(number / rate, None, number) for number in numbers]
    return rate * np.array([picture.time for picture in at_own_times(iter(pictures))])


@pytest.mark.parametrize("ratio", [(4, 5), (2, 5), (5, 6), (3, 5), (3, 4), (2, 3)])
@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_cadence_gets_even_times(ratio, phase):
    """Film of 24 in 30 and in 60, 25 in 30, 30 in 50, 18 in 24, 20 in 30."""
    shown, of = ratio
    places = [n for n in range(60 * of // shown) if n * shown // of != (n - 1) * shown // of]
    numbers = np.array(places[phase:])
    times = own_times(numbers)
    np.testing.assert_allclose(np.diff(times), of / shown, rtol=1e-9)
    assert np.abs(times - numbers).max() < 1 and abs((times - numbers).mean()) < 0.05


@pytest.mark.parametrize(
    "numbers",
    [
        range(40),
        range(0, 80, 2),
        [n for n in range(60) if n not in (7, 19, 22, 41)],
        [n for n in range(60) if n not in (9, 39)],
        [*range(30), *range(30, 90, 2)],
        [0, 2, 3, 4, 5, 7, 8, 9],
    ],
    ids=["none", "twos", "lost ones", "two lost ones", "another rate", "too few"],
)
def test_without_a_cadence_times_stay(numbers):
    np.testing.assert_allclose(own_times(numbers), list(numbers), rtol=1e-9)


def test_times_ascend_where_a_cadence_breaks():
    """An edit of film of 24 in 30: a picture is shown for three places, or for two in a row."""
    for at in range(40, 46):
        numbers = [n if n < at else n + 2 for n in range(90) if n % 5 != 1]
        times = own_times(numbers)
        gaps = np.diff(times)
        assert gaps.min() > 0.4 and np.abs(times - numbers).max() < 1
        assert (np.abs(gaps - 1.25) > 1e-6).sum() <= 2


def test_uneven_times_of_a_file_stay():
    numbers = [n for n in range(60) if n % 5 != 1]
    uneven = [n + 0.4 * (n % 3) for n in numbers]
    pictures = [Picture(t, None, n) for t, n in zip(uneven, numbers, strict=True)]
    assert [picture.time for picture in at_own_times(iter(pictures))] == uneven


def test_what_is_seen_of_a_change():
    """A copy has little noise; something small that moves is none, nor another size."""
    rng = np.random.default_rng(0)
    one = rng.integers(40, 200, (90, 160, 3), dtype=np.uint8)
    noisy = one + (rng.random(one.shape) < 0.05).astype(np.uint8)
    part = one.copy()
    part[20:26, 20:26] = part[20:26, 20:26] * 0.8
    smaller = one[:40]

    def found(*images):
        from wgmb.color.coding import CodedPicture, Coding

        coding = Coding("rgb", 8, (1, 1), full_range=True, transfer=13)
        coded = [CodedPicture(tuple(np.moveaxis(image, 2, 0)), coding) for image in images]
        pictures = (Picture(float(n), Thumbnail(c), n) for n, c in enumerate(coded))
        shots = ShotReader(pictures, change=change)
        shots.read_beyond(9.0)
        return shots.doubles

    assert found(one, one, noisy) == [1, 2]
    assert found(one, part) == [] and found(one, smaller) == []


def test_a_scan_lists_them(tmp_path):
    reader = encoded(tmp_path / "a.mp4", [square(10 + 5 * (n // 2 * 2)) for n in range(12)], 22)
    lines = dict(scan_video(reader, lambda *_: None))
    assert lines["repeated"] == "6: pictures 1-11x2"
