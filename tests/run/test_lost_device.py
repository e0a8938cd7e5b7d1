"""A device that is lost in any kind of run: a DeviceError, exit 3, and nothing half written."""

import contextlib
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from wgpu.backends.wgpu_native import GPUQueue

import make_clips as clips
import make_frames as make
import wgmb
from wgmb import DeviceError
from wgmb.cli.exit_codes import NO_DEVICE
from wgmb.gpu import device as devices
from wgmb.gpu import kernels

RUNS = {
    "frames": ("blur", "shot.####.exr", "-o", "o.####.exr"),
    "another rate": ("blur", "shot.####.exr", "-o", "o.####.exr", "--fps-in", "24", "--fps", "30"),
    "a video of frames": ("blur", "shot.####.exr", "-o", "o.mp4"),
    "frames without vectors": ("blur", "plain.####.exr", "-o", "o.####.exr", "--flow", "search"),
    "a video": ("blur", "in.mp4", "-o", "o.mp4", "--fps", "12"),
    "a video, searched": ("blur", "in.mp4", "-o", "o.mp4", "--flow", "search"),
    "a video, averaged": ("blur", "in.mp4", "-o", "o.mp4", "--flow", "none", "--fps", "5"),
    "a preview": ("blur", "in.mp4", "-o", "o.mp4", "--try", "1"),
    "vectors": ("vectors", "shot.####.exr", "-o", "o.####.exr", "--as", "nuke"),
    "perceived frames": ("perceive", "shot.####.exr", "-o", "o.####.png", "--fps", "24"),
    "a perceived video": ("perceive", "in.mp4", "-o", "o.mp4"),
    "a scene": ("render", "crossing", "-o", "o.####.exr", "--frames", "1-3", "--size", "64x48"),
    "a comparison": (
        "compare",
        "crossing",
        "-o",
        "report.html",
        "--methods",
        "tap",
        "--size",
        "64x48",
    ),
    "a pipe into a video": ("blur", "pipe.y4m", "-o", "o.mp4", "--flow", "none", "--fps", "12"),
    "a pipe, searched": ("blur", "pipe.y4m", "-o", "o.mp4", "--flow", "search"),
    "timing": ("bench", "--size", "64x48", "--methods", "tap", "--rounds", "1"),
}


@pytest.fixture
def loses_after(monkeypatch):
    """A function that has a device of its own destroyed once it has submitted so many times."""
    submit = GPUQueue.submit
    left = [0]

    def counted(queue, buffers):
        submit(queue, buffers)
        left[0] -= 1
        if left[0] == 0:
            queue._device.destroy()

    def begin(count):
        devices._device.cache_clear()  # those that other tests hold stay as they are
        left[0] = count
        monkeypatch.setattr(GPUQueue, "submit", counted)

    yield begin
    devices._device.cache_clear()
    kernels.forget_kernels()


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """Rendered frames, frames without vectors, videos."""
    folder = tmp_path_factory.mktemp("inputs")
    make.write_sequence(folder, range(1, 8))
    for number in range(1, 8):
        make.write_exr(folder / f"plain.{number:04}.exr", make.frame(number, None))
    clips.write(folder / "in.mp4")
    clips.write(folder / "pipe.y4m", codec="rawvideo", kind="yuv4mpegpipe")
    return folder


@pytest.fixture
def pool():
    with ThreadPoolExecutor() as pool:
        yield pool


def piped(path: Path, data: bytes, pool: ThreadPoolExecutor) -> Path:
    """A named pipe at `path` which gives `data`."""

    def write() -> None:
        with contextlib.suppress(BrokenPipeError):  # the run ended before it had read all
            path.write_bytes(data)

    os.mkfifo(path)
    pool.submit(write)
    return path


@pytest.mark.parametrize("kind", RUNS)
@pytest.mark.parametrize("count", [1, 3, 6])
def test_a_lost_device_ends_a_run_in_one_line(
    inputs, tmp_path, capsys, monkeypatch, loses_after, pool, kind, count
):
    monkeypatch.chdir(tmp_path)
    words = [
        str(inputs / w) if (inputs / w.replace("####", "0001")).exists() else w for w in RUNS[kind]
    ]
    if "pipe.y4m" in RUNS[kind]:
        words[1] = str(piped(tmp_path / "pipe.y4m", Path(words[1]).read_bytes(), pool))
    loses_after(count)
    code, _, err = make.inside(capsys, *words)
    assert code == NO_DEVICE, err
    assert "lost" in err and "Traceback" not in err
    assert [path for path in tmp_path.rglob("*") if ".part" in path.name] == []


@pytest.mark.parametrize("count", [1, 3, 6])
def test_a_lost_device_leaves_whole_pictures_in_a_pipe(
    inputs, tmp_path, capsys, loses_after, pool, count
):
    read, out = (inputs / "pipe.y4m").read_bytes(), tmp_path / "out.y4m"
    os.mkfifo(out)
    written = pool.submit(out.read_bytes)
    source = piped(tmp_path / "in.y4m", read, pool)
    loses_after(count)
    code, _, err = make.inside(capsys, "blur", source, "-o", out, "--flow", "none")
    assert code == NO_DEVICE and "lost" in err and "Traceback" not in err, err
    pictures = written.result().split(b"FRAME\n")[1:]
    whole = len(read.split(b"FRAME\n")[1])
    assert len(pictures) < 12 and {len(picture) for picture in pictures} <= {whole}


@pytest.mark.parametrize("count", [1, 3])
def test_a_lost_device_is_an_error_of_the_library_too(loses_after, count):
    pictures = [make.picture(n)[..., :3] for n in range(6)]
    loses_after(count)
    with pytest.raises(DeviceError, match="lost"):
        list(wgmb.blur_pictures(iter(pictures), fps_in=24, fps=12))
    devices._device.cache_clear()
    loses_after(count)
    with pytest.raises(DeviceError, match="lost"):
        for number in range(3):
            wgmb.Flow(quality="draft").shot(dict(enumerate(pictures)).get)(number + 1)


def test_the_next_call_opens_a_new_device(loses_after):
    loses_after(1)
    color, motion = make.picture(1), np.concatenate(make.motion(1), axis=2)
    with pytest.raises(DeviceError):
        for _ in range(3):
            wgmb.blur(color, motion=motion)
    loses_after(-1)
    assert np.isfinite(wgmb.blur(color, motion=motion)).all()
