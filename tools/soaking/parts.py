"""All that may draw a frame, by name: every method and variant, rendered scenes, the viewer.

`make(name)` gives a function that draws frame `number` and returns it. They use the GPU: only
in a process of its own (processes.apart).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from wgmb import (
    Blur,
    Frame,
    Observer,
    Render,
    viewer,
)
from wgmb.scene import builtin
from wgmb.viewer.window import frame as viewed

Step = Callable[[int], np.ndarray]
SIZE = 96, 54  # [px]
_MANY = 8  # samples


def make(name: str) -> Step:
    """The part of that name, ready to draw."""
    return PARTS[name]()


def frame(number: int, size: tuple[int, int] = SIZE, seed: int = 1) -> Frame:
    """A frame of noise that moves, with depth and normals."""
    width, height = size
    rng = np.random.default_rng([seed, number])
    normal = np.zeros((height, width, 3), np.float32)
    normal[..., 2] = 1
    return Frame(
        rng.random((height, width, 4), np.float32),
        motion=rng.normal(0, 3, (height, width, 4)).astype(np.float32),
        depth=rng.uniform(1, 9, (height, width)).astype(np.float32),
        normal=normal,
        number=number,
    )


def neighbourly(numbers: range, **options: Any) -> list[Frame]:
    """Frames that know their neighbours."""
    each = [frame(n, **options).locked() for n in numbers]
    last = len(each) - 1
    return [one.between(each[max(i - 1, 0)], each[min(i + 1, last)]) for i, one in enumerate(each)]


def _image(method: str, **options: Any) -> Callable[[], Step]:
    def begin() -> Step:
        blur, frames = Blur(method, samples=_MANY, **options), neighbourly(range(4))  # pyright: ignore[reportArgumentType, reportCallIssue]
        return lambda number: blur(frames[number % len(frames)])

    return begin


def _unlocked(method: str) -> Callable[[], Step]:
    """Arrays that may change: uploaded for every frame."""

    def begin() -> Step:
        blur, one = Blur(method, samples=_MANY), frame(1)  # pyright: ignore[reportArgumentType, reportCallIssue]
        return lambda number: blur(replace(one, number=number))

    return begin


def _confidence() -> Step:
    blur, frames = Blur("gather", samples=_MANY), neighbourly(range(4))
    return lambda number: blur.with_confidence(frames[number % len(frames)])[1]["accepted"]


def _scene(scene: str, method: str) -> Callable[[], Step]:
    def begin() -> Step:
        blur = Blur(method, samples=_MANY)  # pyright: ignore[reportArgumentType, reportCallIssue]
        render = Render(builtin.make(scene), blur, size=SIZE, antialias=2)
        return lambda number: render(number % 24 / 24, number)  # what suits a moment is compiled

    return begin


def _perceived() -> Step:
    blur, eye, frames = Blur("tap", samples=_MANY), Observer(24.0), neighbourly(range(4))

    def step(number: int) -> np.ndarray:
        eye.present(blur(frames[number % len(frames)]))
        return eye.perceived()

    return step


def _viewer(method: str, **state: Any) -> Callable[[], Step]:
    """The viewer without a window, playing a scene; its clock goes on with every frame."""

    def begin() -> Step:
        now = [0.0]
        settings = {"method": method, "samples": _MANY, "antialias": 1}
        shown = viewer.State(playing=True, **state).with_settings(**settings)
        window = viewer.offscreen(shown, (480, 270), clock=lambda: now[0])

        def step(number: int) -> np.ndarray:
            now[0] += 1 / 24
            return viewed(window)

        return step

    return begin


PARTS: dict[str, Callable[[], Step]] = {
    "tap": _image("tap"),
    "tap, published": _image("tap", variant="published"),
    "tiles": _image("tiles"),
    "tiles, published": _image("tiles", variant="published"),
    "fusion": _image("fusion"),
    "fusion, published": _image("fusion", weights="published"),
    "gather": _image("gather"),
    "gather, arrays": _unlocked("gather"),
    "gather with confidence": _confidence,
    "reproject": _image("reproject"),
    "reproject, published": _image("reproject", variant="published"),
    "volume": _scene("torusphere", "volume"),
    "render tap": _scene("crossing", "tap"),
    "render gather": _scene("crossing", "gather"),
    "render accumulate": _scene("crossing", "accumulate"),
    "render distributed": _scene("crossing", "distributed"),
    "viewer tap": _viewer("tap"),
    "viewer gather": _viewer("gather"),
    "viewer, perceived": _viewer("tap", look="perceived"),
    "perceive": _perceived,
}
