"""Speed of videos: pictures in, blurred pictures out, without files."""

from __future__ import annotations

import statistics
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np
import wgpu

from ..errors import check_choice
from ..run.pictures import blur_pictures
from ..settings.recipes import FlowName, FlowQuality, recipe_of
from .bench_figures import VideoFigure
from .calls import KINDS, counted

WARM = 8  # pictures before the timed ones: compiled, and every ring of textures has had a turn
_STEP = 5  # px that the ground moves from picture to picture
_SIDE = 16  # px, of its tiles


def flow_settings(text: str, device: wgpu.GPUDevice) -> dict[str, Any]:
    """Settings of a source of motion, written NAME[:QUALITY]; InputError if there is none such."""
    flow, _, quality = text.partition(":")
    check_choice("`flow`", flow, get_args(FlowName))
    if quality:
        check_choice("`flow_quality`", quality, get_args(FlowQuality))
    settings: dict[str, Any] = {"flow": flow, "flow_quality": quality or "best"}
    recipe_of(**dict(zip(("flow", "quality"), settings.values(), strict=True)), device=device)
    return settings


def synthetic_pictures(size: tuple[int, int], count: int) -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) uint8: coloured tiles that move, and a square that crosses."""
    (width, height), rng = size, np.random.default_rng(3)
    shape = height // _SIDE + 1, (width + _STEP * count) // _SIDE + 1, 3
    cells = rng.integers(0, 256, shape, np.uint8)
    ground = np.repeat(np.repeat(cells, _SIDE, 0), _SIDE, 1)
    side = max(1, height // 5)
    for n in range(count):
        picture = ground[:height, _STEP * n : _STEP * n + width].copy()
        left, top = (7 * n) % width, height // 3
        picture[top : top + side, left : left + side] = 220, 40, 30
        yield picture


def time_video(
    device: wgpu.GPUDevice, flow: str, size: tuple[int, int], pictures: int, limit: float
) -> VideoFigure:
    """Time so many pictures of the default settings at 180 degrees, after WARM others.

    After half of `limit` seconds the next picture is timed, whichever it is; after all of it no
    further one is, but at least one.
    """
    settings, count = flow_settings(flow, device), WARM + pictures
    source = synthetic_pictures(size, count)
    run = blur_pictures(source, fps_in=24, shutter=180, device=device, **settings)
    walls: list[float] = []
    threads: list[float] = []
    calls: Counter[str] = Counter()
    began = time.perf_counter()
    try:
        for n in range(count):
            wall, thread = time.perf_counter(), time.thread_time()
            with counted() as counts:
                next(run)
            spent = time.perf_counter() - began
            if n >= WARM or n == count - 1 or spent > limit / 2:
                walls.append(time.perf_counter() - wall)
                threads.append(time.thread_time() - thread)
                calls.update(counts)
            if walls and spent > limit:
                break
    finally:
        run.close()
    many = len(walls)
    return VideoFigure(
        flow,
        *size,
        how=run.how,
        pictures=many,
        rate=many / sum(walls),
        thread=1e3 * statistics.mean(threads),
        counts={kind: calls[kind] / many for kind in KINDS},
    )
