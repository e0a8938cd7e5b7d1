"""A device that is lost in any kind of run: a DeviceError, exit 3, and nothing half written."""

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
    return folder


@pytest.mark.parametrize("kind", RUNS)
@pytest.mark.parametrize("count", [1, 3, 6])
def test_a_lost_device_ends_a_run_in_one_line(
    inputs, tmp_path, capsys, monkeypatch, loses_after, kind, count
):
    monkeypatch.chdir(tmp_path)
    words = [
        str(inputs / w) if (inputs / w.replace("####", "0001")).exists() else w for w in RUNS[kind]
    ]
    loses_after(count)
    code, _, err = make.inside(capsys, *words)
    assert code == NO_DEVICE, err
    assert "lost" in err and "Traceback" not in err
    assert [path for path in tmp_path.rglob("*") if ".part" in path.name] == []


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
