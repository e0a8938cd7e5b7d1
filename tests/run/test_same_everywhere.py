"""The same pictures have the same blur, to the bit, whatever they come in."""

import io
import os
import subprocess
import sys
from dataclasses import replace

import av
import numpy as np
import pytest
from PIL import Image

import wgmb
from wgmb.run.job import settle
from wgmb.run.request import BlurRequest
from wgmb.settings import OutputSettings

COUNT, SIZE, RATE = 8, (128, 96), 24


def pictures():
    """A square of 24 px that moves 12 px a picture over ground that pans slowly."""
    rng = np.random.default_rng(3)
    ground, body = (
        np.kron(rng.integers(40, 220, (40, 60, 3)), np.ones((4, 4, 1))).astype(np.uint8),
        np.kron(rng.integers(0, 256, (6, 6, 3)), np.ones((4, 4, 1))).astype(np.uint8),
    )
    made = []
    for n in range(COUNT):
        one = ground[10 + n : 10 + n + SIZE[1], 20 + 2 * n : 20 + 2 * n + SIZE[0]].copy()
        one[36:60, 8 + 12 * n : 32 + 12 * n] = body
        made.append(one)
    return made


def coded(file, made):
    """Pictures as a video without loss."""
    with av.open(file, "w", format="matroska") as container:
        stream = container.add_stream("ffv1", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "bgr0"
        for picture in made:
            frame = av.VideoFrame.from_ndarray(picture, "rgb24").reformat(format="bgr0")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def decoded(file):
    with av.open(file) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def of_video(tmp_path_factory):
    """The blur of the pictures as a video: what all others must give."""
    folder = tmp_path_factory.mktemp("video")
    coded(folder / "a.mkv", pictures())
    wgmb.blur_video(folder / "a.mkv", folder / "b.mkv", codec="ffv1")
    made = decoded(folder / "b.mkv")
    assert len(made) == COUNT and np.abs(np.subtract(made[3], pictures()[3], dtype=float)).max() > 9
    return made


def request(folder, **more):
    for number, picture in enumerate(pictures(), 1):
        Image.fromarray(picture).save(folder / f"a.{number}.png")
    output = OutputSettings(output=str(folder / "b.#.png"))
    return BlurRequest(pattern=str(folder / "a.#.png"), output=output, **more)


def blurred(folder, numbers=range(1, COUNT + 1)):
    return [np.asarray(Image.open(folder / f"b.{n}.png")) for n in numbers]


def test_files_have_the_blur_of_a_video(tmp_path, of_video):
    report = settle(request(tmp_path)).run()()
    assert not report.failed
    np.testing.assert_array_equal(blurred(tmp_path), of_video)


@pytest.mark.parametrize("parts", [[(6, 5), (1,), (8, 2)], [(4,)]])
def test_parts_in_any_order_have_it_too(tmp_path, of_video, parts):
    job = settle(request(tmp_path))
    for part in parts:
        report = job.run(numbers=list(part))()
        assert not report.failed
        for number, one in zip(part, blurred(tmp_path, part), strict=True):
            np.testing.assert_array_equal(one, of_video[number - 1])


def test_arrays_have_it_too(of_video):
    np.testing.assert_array_equal(list(wgmb.blur_pictures(pictures())), of_video)


def test_pipes_have_it_too(tmp_path, of_video):
    coded(tmp_path / "a.mkv", pictures())
    line = [sys.executable, "-m", "wgmb", "blur", "-", "-o", "-", "--codec", "ffv1"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    given = (tmp_path / "a.mkv").read_bytes()
    ran = subprocess.run(line, input=given, capture_output=True, timeout=300, env=environment)
    assert ran.returncode == 0, ran.stderr.decode()
    np.testing.assert_array_equal(decoded(io.BytesIO(ran.stdout)), of_video)


def test_another_rate_is_made_alike(tmp_path):
    coded(tmp_path / "a.mkv", pictures())
    wgmb.blur_video(tmp_path / "a.mkv", tmp_path / "b.mkv", codec="ffv1", fps=16)
    want = decoded(tmp_path / "b.mkv")
    asked = request(tmp_path, fps_in="24")
    asked = replace(asked, output=replace(asked.output, fps="16"))
    assert not settle(asked).run()().failed
    np.testing.assert_array_equal(blurred(tmp_path, range(1, len(want) + 1)), want)
