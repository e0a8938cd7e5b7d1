"""Memory does not grow with the frames, whatever method, variant or scene (see wgsl.md)."""

import ctypes
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wgmb import (
    Blur,
    Frame,
    Render,
    Shutter,
    gpu,
)
from wgmb.camera import Camera, Reprojections
from wgmb.color.coding import CodedPicture, Coding
from wgmb.methods import METHODS
from wgmb.observer import Observer
from wgmb.pipeline.exposure_sum import ExposureSum
from wgmb.scene import builtin
from wgmb.shots.reader import Picture, ShotReader
from wgmb.video.gpu_frames import VideoFrames
from wgmb.video.planes import Average
from wgmb.video.thumbnail import Thumbnail
from wgmb.viewer import State
from wgmb.viewer.draw.renderer import Renderer

MOST = 24  # KiB a frame
WARM, COUNT, ROUNDS = 8, 12, 6  # frames, frames a round; tables that have to grow do so in some
SIZE = 96, 54


class Allocated(ctypes.Structure):
    """Memory in use by glibc's mallinfo2, in bytes."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks",
                     "uordblks", "fordblks", "keepcost")
    ]  # fmt: skip


try:
    mallinfo2 = ctypes.CDLL(None).mallinfo2
    mallinfo2.restype = Allocated
except (AttributeError, OSError, TypeError):
    mallinfo2 = None


def in_use() -> float:
    """KiB that the process has allocated, or at least holds."""
    if mallinfo2:
        now = mallinfo2()
        return (now.uordblks + now.hblkhd) / 1024
    held = Path("/proc/self/statm")
    if not held.exists():
        pytest.skip("nothing tells how much memory is in use")
    return int(held.read_text().split()[1]) * 4


def growth(step) -> float:
    """KiB that a call of `step` leaves behind, in the round that leaves the least."""
    for _ in range(WARM):
        step()
    least = float("inf")
    for _ in range(ROUNDS):
        start = in_use()
        for _ in range(COUNT):
            step()
        least = min(least, (in_use() - start) / COUNT)
        if least <= MOST:
            break
    return least


@pytest.fixture
def fresh():
    """A device of its own: lavapipe decides at a shader's first dispatch what to do with it."""
    return gpu.choose_adapter().request_device_sync(required_features=["float32-filterable"])


def frame(**given) -> Frame:
    """A picture in front of which something moves."""
    width, height = SIZE
    color = np.random.default_rng(1).random((height, width, 3), "f4")
    depth, motion = np.full((height, width), 10, "f4"), np.zeros((height, width, 4), "f4")
    depth[10:40, 20:60], motion[10:40, 20:60] = 3, (-6, 1, 6, -1)
    if "camera" not in given:
        given["motion"] = motion
    return Frame(color, depth=depth, **given)


def camera() -> Reprojections:
    def at(x: float) -> Camera:
        view, lens = np.eye(4), np.diag([1.0, 1.6, -1.0, 0.0])
        view[0, 3], lens[2, 3], lens[3, 2] = -x, -0.1, -1
        return Camera(lens @ view, view)

    return Reprojections(at(0), at(-0.2), at(0.2))


def mask() -> np.ndarray:
    holdout = np.zeros(SIZE[::-1], "f4")
    holdout[5:30, 5:40] = 1
    return holdout


def blurring(method: str, confidence: bool = False, given=dict, **options):
    def make(device):
        blur, one = Blur(method, device=device, **options), frame(**given())
        one = one.between(one, one)
        return lambda: blur.with_confidence(one) if confidence else blur(one)

    return make


def rendering(scene: str, method: str, **options):
    def make(device):
        blur = Blur(method, device=device, **options)
        render, numbers = Render(builtin.make(scene), blur, size=(64, 36)), iter(range(10**6))
        return lambda: render(next(numbers) % 6 / 24)

    return make


def staging(look="result", **settings):
    def make(device):
        stage, numbers = Renderer(device), iter(range(10**6))
        shown = State(look=look).with_settings(antialias=1, samples=4, **settings)

        def step():
            number = next(numbers)
            moved = replace(shown, frame=float(number % 6))
            stage.update(moved, (0, 0, *SIZE), 0.02 * number, True, False)

        return step

    return make


def seeing(device):
    viewer, picture = Observer(24.0, device=device), np.ones((*SIZE[::-1], 3), "f4")

    def step():
        viewer.present(picture)
        viewer.perceived()

    return step


def cameras() -> dict:
    return {"camera": camera()}


SCENES = [name for name in METHODS if "scene" in METHODS[name].needs and name != "volume"]
IMAGES = [name for name in METHODS if "scene" not in METHODS[name].needs]
PARTS = {name: blurring(name) for name in IMAGES}
PARTS |= {f"render {name}": rendering("crossing", name, samples=8) for name in SCENES}
PARTS |= {
    "auto": blurring("gather", samples="auto"),
    "one sample": blurring("gather", samples=1),
    "confidence": blurring("gather", True),
    "masked": blurring("gather", given=lambda: {"holdout": mask()}),
    "tap, published": blurring("tap", variant="published", jitter=1),
    "tiles, published": blurring("tiles", variant="published", samples="auto"),
    "fusion, published": blurring("fusion", variant="published", weights="published"),
    "rolling": blurring("tap", shutter=Shutter(90, curve="cosine", rolling="down"), max_blur=5),
    "camera": blurring("reproject", given=cameras),
    "published": blurring("reproject", variant="published", samples=20),
    "published, camera": blurring("reproject", given=cameras, variant="published", samples=5),
    "depth test": blurring("reproject", variant="published", depth_test=True, samples=5),
    "line": blurring("reproject", given=cameras, variant="published", splat="line", samples=5),
    "facing": blurring("reproject", given=cameras, variant="published", facing=True, samples=5),
    "render tap": rendering("crossing", "tap"),
    "render gather": rendering("crossing", "gather"),
    "render rings": rendering("torusphere", "tap"),
    "render volume": rendering("torusphere", "volume"),
    "render figure": rendering("disk", "volume"),
    "perceive": seeing,
    "viewer": staging(),
    "viewer, gather": staging(method="gather"),
    "viewer, depth": staging(look="depth"),
    "viewer, perceived": staging(look="perceived"),
    "viewer, error": staging(look="error"),
}


USUAL = {"gather", "tap", "viewer"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in USUAL else pytest.mark.full) for name in PARTS],
)
def test_memory_does_not_grow_with_frames(fresh, name):
    assert growth(PARTS[name](fresh)) <= MOST


def test_exposures_of_cells_leave_nothing_behind():
    """Also where shutters, shares and numbers of cells change from one to the next."""
    blur = Blur("tap", samples=4)
    shots = ShotReader(Picture(n / 144, _coded(n), n) for n in range(10_000))
    views, exposer, number = VideoFrames(shots, blur, _Sideways()), ExposureSum(blur.device), 0

    def step():
        nonlocal number
        cells = shots.cells(number / 60, 1 / 60, Shutter(180))
        exposer.texture(SIZE, ((cell, views.in_shot(cell.index), blur) for cell in cells))
        number += 1

    assert growth(step) <= MOST


def test_averages_of_planes_leave_nothing_behind():
    average, number = Average(gpu.open_device(None)), 0
    pictures = [_coded(n).coded for n in range(10)]

    def step():
        nonlocal number
        number += 1
        count = 2 + number % 3
        weights = np.random.default_rng(number).random(count)
        average(pictures[number % 6 :][:count], weights, Coding())

    assert growth(step) <= MOST


def _coded(number: int) -> Thumbnail:
    width, height = SIZE
    luma = np.random.default_rng(number % 7).integers(40, 200, (height, width), np.uint8)
    chroma = np.full((height // 2, width // 2), 128, np.uint8)
    return Thumbnail(CodedPicture((luma, chroma, chroma), Coding()))


class _Sideways:
    """All moves by the same."""

    def reach(self, size):
        return 1

    def shot(self, load, depth=True):
        width, height = SIZE
        motion = np.full((height, width, 4), (-3, 0, 3, 0), np.float32)
        return lambda number: (motion, np.ones((height, width), np.float32))
