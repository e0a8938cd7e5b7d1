"""Images go on the screen: placed, compared, exposed, with a key to their colours."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import TexturePool
from ..state.state import BOTH_EYES, State

_WHEEL, _KEY_HEIGHT, _KEY_WIDTH, _MARGIN = 96, 8, 180, 16  # logical pixels
_COMPOSE, _BLIT = "viewer/draw/compose.wgsl", "viewer/draw/blit.wgsl"
_COMPOSED: list[dict] = [{"buffer": {"type": "uniform"}}] + 2 * [
    {"texture": {"sample_type": "unfilterable-float"}}
]
_PICTURE = "rgba16float"
_MOST_TAPS = 4  # texels a side that are averaged for one pixel

Box = tuple[float, float, float, float]  # x, y, width, height [px]


@dataclass(frozen=True)
class Image:
    """An image on one side of the screen."""

    texture: wgpu.GPUTexture | None
    kind: str  # COLOR, DEPTH, MOTION, DISPLAY
    stamp: tuple  # changes with what is in the texture


NOTHING = Image(None, "COLOR", ())
"""An image that is black."""


class Screen:
    """Composes images into `picture`, in display values, and paints that on a canvas."""

    def __init__(self, device: wgpu.GPUDevice, format: str):
        self.device, self._images = device, TexturePool(device)
        self._none = self._images.view("none", (1, 1), "rgba32float")
        self._blit = self._pipeline(_BLIT, format, "auto", {})
        self._composers: dict[tuple, Any] = {}
        self._composition: wgpu.GPUTexture | None = None
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._composed: tuple = ()
        self._size: tuple[int, int] = (1, 1)
        self._visible: Box = (0, 0, 1, 1)
        self.seconds = 0.0  # that the last composing took

    def compose(
        self,
        state: State,
        images: tuple[Image, Image],
        place: Box,
        area: Box,
        size: tuple[int, int],
        ratio: float,
    ) -> None:
        """Draw what goes on a canvas of `size` [px], if it is not what was drawn last.

        `place` of the whole picture, `area` that is free for it [px]; `ratio`: pixels for one
        of the panel's.
        """
        mode = _mode(state)
        shown = (images, place, area, size, ratio, mode, state.exposure, state.tone, state.gain,
                 state.middle, state.fastest, state.wipe, state.look)  # fmt: skip
        if shown == self._composed:
            return
        self._composed, self._size, self._visible = shown, size, overlap(place, area)
        started = time.perf_counter()
        first, second = images
        source = wgsl.load(_COMPOSE)
        constants = {
            "FIRST": source.constant(first.kind),
            "SECOND": source.constant(second.kind),
            "COMPARE": source.constant(mode),
            "TONE": source.constant(state.tone.upper()),
            "TAPS": _taps(images, whole(place), mode),
        }
        data = np.zeros((), source.dtype("View"))
        data["area"], data["place"] = area, place
        data["line"], data["thick"] = place[0] + state.wipe * place[2], ratio
        data["exposure"], data["gain"] = 2.0**state.exposure, state.gain
        data["middle"], data["fastest"] = state.middle, state.fastest
        if (key := key_box(state, first.kind, place, area, ratio)) is not None:
            data["wheel" if first.kind == "MOTION" else "key"] = key
        uniform = wgpu.BufferUsage.UNIFORM
        view = self.device.create_buffer_with_data(label="view", data=data, usage=uniform)
        textures = [
            image.texture.create_view() if image.texture else self._none for image in images
        ]
        pipeline = self._composer(tuple(constants.items()))
        self._draw(pipeline, 1, [{"buffer": view}, *textures], self._picture())
        self.device.queue.read_buffer(self._token)  # waits
        self.seconds = time.perf_counter() - started

    def paint(self, target: wgpu.GPUTexture) -> None:
        """Put what was composed on the canvas's texture."""
        self._draw(self._blit, 0, [self._picture().create_view()], target)

    def _draw(self, pipeline, group: int, resources: list, target: wgpu.GPUTexture) -> None:
        """One pass of a rasterizer over all of `target`; what it binds, in order."""
        encoder = self.device.create_command_encoder(label="view")
        attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store"}
        pass_ = encoder.begin_render_pass(color_attachments=[attachment])
        pass_.set_pipeline(pipeline)
        bound = self.device.create_bind_group(
            layout=pipeline.get_bind_group_layout(group),
            entries=[{"binding": i, "resource": r} for i, r in enumerate(resources)],
        )
        pass_.set_bind_group(group, bound)
        pass_.draw(3)
        pass_.end()
        gpu.submit(self.device, encoder)

    def picture(self) -> np.ndarray:
        """(height, width, 3) display values 0..1 of what was composed, the panel not in it."""
        encoder = self.device.create_command_encoder(label="download")
        x, y, w, h = (round(v) for v in self._visible)
        canvas = self._images.download(encoder, self._picture())[..., :3].astype(np.float32)
        return canvas[y : y + h, x : x + w]

    def values(self, x: float, y: float) -> np.ndarray | None:
        """(3,) display values 0..1 of what was composed at a place [px]; None outside it."""
        if not (0 <= x < self._size[0] and 0 <= y < self._size[1]):
            return None
        place = {"texture": self._picture(), "origin": (int(x), int(y), 0)}
        layout = {"bytes_per_row": 8, "rows_per_image": 1}
        texel: Any = self.device.queue.read_texture(place, layout, (1, 1, 1))
        return np.frombuffer(texel, np.float16)[:3].astype(np.float32)

    def _picture(self) -> wgpu.GPUTexture:
        """The composition; pools of textures have those that compute shaders write."""
        if self._composition is None or self._composition.size[:2] != self._size:
            usage = wgpu.TextureUsage
            self._composition = self.device.create_texture(
                label="picture",
                size=(self._size[0], self._size[1], 1),
                format=_PICTURE,
                usage=usage.RENDER_ATTACHMENT | usage.TEXTURE_BINDING | usage.COPY_SRC,
            )
        return self._composition

    def _composer(self, constants: tuple[tuple[str, float], ...]):
        if constants not in self._composers:
            layouts = [self._layout([]), self._layout(_COMPOSED)]
            layout = self.device.create_pipeline_layout(bind_group_layouts=layouts)
            self._composers[constants] = self._pipeline(_COMPOSE, _PICTURE, layout, dict(constants))
        return self._composers[constants]

    def _layout(self, entries: list[dict]):
        stage = wgpu.ShaderStage.FRAGMENT
        numbered = [{"binding": i, "visibility": stage} | e for i, e in enumerate(entries)]
        return self.device.create_bind_group_layout(entries=numbered)

    def _pipeline(self, file: str, format: str, layout: Any, constants: dict[str, float]):
        """A pass over all pixels: the fragment shader of a file."""
        modules = [
            self.device.create_shader_module(code=wgsl.load(name).text) for name in (_BLIT, file)
        ]
        return self.device.create_render_pipeline(
            label=file,
            layout=layout,
            vertex={"module": modules[0], "entry_point": "corner"},
            primitive={"topology": "triangle-list"},
            fragment={
                "module": modules[1],
                "entry_point": "texel",
                "targets": [{"format": format}],
                "constants": constants,
            },
        )


def fit(shape: tuple[float, float], area: Box, state: State) -> Box:
    """Return the box of an image of that shape: fitted and centred in the area, then zoomed."""
    x, y, width, height = area
    scale = min(width / shape[0], height / shape[1]) * state.zoom
    w, h = shape[0] * scale, shape[1] * scale
    left = x + width / 2 - w * state.center[0]
    top = y + height / 2 - h * state.center[1]
    return round(left), round(top), max(round(w), 1), max(round(h), 1)


def key_box(state: State, kind: str, place: Box, area: Box, ratio: float) -> Box | None:
    """Return the box of the first image's colour key [px], or None if it needs none."""
    if state.mode in ("split", "difference", *BOTH_EYES):
        return None
    x, y, width, height = overlap(place, area)
    margin = _MARGIN * ratio
    if kind == "MOTION":
        edge = min(_WHEEL * ratio, 0.3 * min(width, height))
        return x + width - edge - margin, y + height - edge - margin, edge, edge
    if kind == "DEPTH" or state.mode == "error":
        long, high = min(_KEY_WIDTH * ratio, 0.4 * width), _KEY_HEIGHT * ratio
        return x + margin, y + height - high - margin, long, high
    return None


def whole(place: Box) -> tuple[int, int]:
    """Width and height in whole pixels."""
    return max(round(place[2]), 1), max(round(place[3]), 1)


def overlap(a: Box, b: Box) -> Box:
    """Return the intersection of two boxes."""
    left, top = max(a[0], b[0]), max(a[1], b[1])
    right, bottom = min(a[0] + a[2], b[0] + b[2]), min(a[1] + a[3], b[1] + b[3])
    return left, top, max(right - left, 0), max(bottom - top, 0)


def _mode(state: State) -> str:
    names = {"off": "ONE", "flicker": "ONE", "pair": "SPLIT", "red-cyan": "RED_CYAN"}
    return names.get(state.mode, state.mode.upper())


def _taps(images: tuple[Image, Image], place: tuple[int, int], mode: str) -> int:
    """Texels a side for a pixel of the screen; 0 where they are the same."""
    seen = images[:1] if mode == "ONE" else images
    sizes = [image.texture.size[:2] for image in seen if image.texture]
    if mode != "SPLIT" and all(size == place for size in sizes):
        return 0
    widest = max((size[0] for size in sizes), default=1) * (2 if mode == "SPLIT" else 1)
    return max(1, min(_MOST_TAPS, round(widest / place[0])))
