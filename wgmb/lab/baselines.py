"""Baselines of the benchmark: the tap blur in numba, the article's shader."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import cache, partial

import numpy as np
import wgpu
from numpy.typing import NDArray

from .. import gpu
from ..frame import Frame
from ..gpu.textures import TexturePool
from ..gpu.timing import alternate
from ..pipeline.blur import Blur
from ..render import Render
from ..scene import builtin
from ..shutter import Shutter

# Milliseconds by iTime [s] of the article's own fragment shader of the torusphere, 640 x 360,
# software OpenGL (Mesa 22.3) on two cores; another machine's figures are another matter.
ARTICLE = {31.0: 13.7, 20.5: 20.2, 16.0: 22.7, 12.0: 24.9, 7.5: 27.7, 0.0: 35.0}


def article_blur(device: wgpu.GPUDevice) -> Blur:
    """The blur of the article's scene."""
    return Blur("volume", device=device, shutter=Shutter(720, curve="cosine"))


def bench_torusphere(
    blur: Blur, width: int, height: int, rounds: int = 9
) -> dict[float, tuple[float, ...]]:
    """By iTime [s]: milliseconds a frame, of those recording it, and of all cores' work.

    Published density, the shutter that the scene is made for. Medians; all times take turns.
    """
    device = blur.device
    token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
    scene = builtin.make("torusphere", density="published")
    render = Render(scene, blur, size=(width, height), fps=60)
    output = TexturePool(device).texture("output", (width, height), blur.output)
    work: dict[float, list[float]] = {t: [] for t in ARTICLE}
    recording: dict[float, list[float]] = {t: [] for t in ARTICLE}

    def frame(t: float) -> None:
        cores, started = time.process_time(), time.perf_counter()
        on_gpu = render.on_gpu(t)
        encoder = device.create_command_encoder()
        blur.encode_scene(encoder, on_gpu, output.create_view())
        recording[t].append(time.perf_counter() - started)
        gpu.submit(device, encoder)
        device.queue.read_buffer(token)
        work[t].append(time.process_time() - cores)

    seconds = alternate({str(t): partial(frame, t) for t in ARTICLE}, rounds)
    return {
        t: tuple(1e3 * statistics.median(s) for s in (seconds[str(t)], recording[t], work[t]))
        for t in ARTICLE
    }


def numba_tap(frame: Frame, samples: int) -> Callable[[], object] | None:
    """The tap blur as one would write it for the CPU: curved paths, bilinear, all cores."""
    if (tap := _compiled()) is None:
        return None
    times = -(((np.arange(samples) + 0.5) / samples - 0.5) * 0.5).astype(np.float32)
    out = np.empty_like(frame.color)
    motion = frame.motion
    assert motion is not None
    tap(frame.color[:1], motion[:1], times, out[:1])  # compiles
    return lambda: tap(frame.color, motion, times, out)


@cache
def _compiled():
    """It, compiled; None without numba."""
    try:
        from numba import njit, prange  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None

    @njit(parallel=True, fastmath=True)
    def tap(
        color: NDArray[np.float32],
        motion: NDArray[np.float32],
        times: NDArray[np.float32],
        out: NDArray[np.float32],
    ):  # pragma: no cover - compiled
        height, width = color.shape[:2]
        zero, one, half = np.float32(0), np.float32(1), np.float32(0.5)
        right, bottom = np.float32(width - 1), np.float32(height - 1)
        share = one / np.float32(times.size)
        for y in prange(height):
            for x in range(width):
                ax = (motion[y, x, 2] - motion[y, x, 0]) * half
                bx = (motion[y, x, 2] + motion[y, x, 0]) * half
                ay = (motion[y, x, 3] - motion[y, x, 1]) * half
                by = (motion[y, x, 3] + motion[y, x, 1]) * half
                r, g, b, a = zero, zero, zero, zero
                for k in range(times.size):
                    t = times[k]
                    u = min(max(np.float32(x) + (ax + bx * t) * t, zero), right)
                    v = min(max(np.float32(y) + (ay + by * t) * t, zero), bottom)
                    i, j = int(u), int(v)
                    i1, j1 = min(i + 1, width - 1), min(j + 1, height - 1)
                    u -= np.float32(i)
                    v -= np.float32(j)
                    w00, w10, w01, w11 = (one - u) * (one - v), u * (one - v), (one - u) * v, u * v
                    p, q, s, t1 = color[j, i], color[j, i1], color[j1, i], color[j1, i1]
                    r += p[0] * w00 + q[0] * w10 + s[0] * w01 + t1[0] * w11
                    g += p[1] * w00 + q[1] * w10 + s[1] * w01 + t1[1] * w11
                    b += p[2] * w00 + q[2] * w10 + s[2] * w01 + t1[2] * w11
                    a += p[3] * w00 + q[3] * w10 + s[3] * w01 + t1[3] * w11
                out[y, x, 0] = r * share
                out[y, x, 1] = g * share
                out[y, x, 2] = b * share
                out[y, x, 3] = a * share

    return tap
