"""Images become the picture on the screen: placed, compared, exposed, with a key to colours."""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import TexturePool
from ..state.state import State
from .frame_status import FrameStatus
from .place import Box, key_box, overlap, whole

BLIT = "viewer/draw/blit.wgsl"
_COMPOSE = "viewer/draw/compose.wgsl"
_COMPOSED: list[dict[str, Any]] = [{"buffer": {"type": "uniform"}}] + 2 * [
    {"texture": {"sample_type": "unfilterable-float"}}
]
_MOST_TAPS = 4  # texels a side that are averaged for one pixel
_KEPT = 12  # pipelines: each takes 3 MiB without a GPU, and there are over a thousand
_BAND = 1 << 17  # pixels that are drawn at once where the window's own drawing must get in between


@dataclass(frozen=True)
class Image:
    """An image on one side of the screen: a texture, or an array (height, width, 4) of halves."""

    texture: wgpu.GPUTexture | None
    kind: str  # COLOR, DEPTH, MOTION, DISPLAY
    stamp: tuple[Any, ...]  # changes with what is in it
    array: np.ndarray | None = field(default=None, compare=False, repr=False)

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height; None of one that is black."""
        if self.array is not None:
            return self.array.shape[1], self.array.shape[0]
        return None if self.texture is None else (self.texture.size[0], self.texture.size[1])


NOTHING = Image(None, "COLOR", ())
"""An image that is black."""


@dataclass(frozen=True)
class View:
    """All that goes on a canvas of `size` [px], but for the panel."""

    state: State
    images: tuple[Image, Image]
    place: Box
    """Of the whole picture [px]."""
    area: Box
    """Free for it [px]."""
    size: tuple[int, int]
    ratio: float
    """Pixels for one of the panel's."""
    report: FrameStatus
    """Of the images: the text over them."""
    flicked: bool = False
    """The first image is that of the second side."""

    @property
    def key(self) -> Box | None:
        """The box of the first image's colour key [px], or None if it needs none."""
        kind = self.images[0].kind
        return key_box(self.state, kind, self.place, self.area, self.ratio)

    @property
    def mode(self) -> str:
        """The constant of compose.wgsl for the comparison; none before there is a second image."""
        if self.images[1] == NOTHING:
            return "ONE"
        names = {"off": "ONE", "flicker": "ONE", "pair": "SPLIT", "red-cyan": "RED_CYAN"}
        return names.get(self.state.mode, self.state.mode.upper())

    @property
    def stamp(self) -> tuple[Any, ...]:
        """All that the picture depends on."""
        state, box = self.state, (self.place, self.area, self.size, self.ratio)
        return (self.images, *box, self.mode, state.exposure, state.tone, state.gain,
                state.middle, state.fastest, state.wipe, state.look)  # fmt: skip


class Composer:
    """Draws a View into `texture`, in display values.

    `format` of the texture. `in_bands`: by parts, between which others can draw.
    """

    def __init__(self, device: wgpu.GPUDevice, format: str, in_bands: bool = False):
        self.device, self._images, self._format = device, TexturePool(device), format
        self._none = self._images.view("none", (1, 1), "rgba16float")
        self._pipelines: OrderedDict[tuple[Any, ...], Any] = OrderedDict()
        self._uploaded: dict[str, tuple[Any, ...]] = {}
        self._texture: wgpu.GPUTexture | None = None
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._in_bands = in_bands
        self._composed: tuple[Any, ...] = ()
        self._visible: Box = (0, 0, 1, 1)
        self.seconds = 0.0  # that the last composing took

    def compose(self, view: View) -> None:
        """Draw it, unless it was drawn last."""
        stamp = view.stamp
        if stamp == self._composed:
            return
        started = time.perf_counter()
        self._visible = overlap(view.place, view.area)
        target, (width, height) = self._sized(view.size), view.size
        textures = [
            self._view_of(side, image) for side, image in zip("ab", view.images, strict=True)
        ]
        uniform = self.device.create_buffer_with_data(
            label="view", data=_uniform(view), usage=wgpu.BufferUsage.UNIFORM
        )
        pipeline = self._pipeline(tuple(_constants(view).items()))
        rows = max(_BAND // width, 1) if self._in_bands else height
        for top in range(0, height, rows):
            band = 0, top, width, min(rows, height - top)
            resources = [{"buffer": uniform}, *textures]
            draw(self.device, pipeline, 1, resources, target, band)
            self.device.queue.read_buffer(self._token)  # waits
        self._composed, self.seconds = stamp, time.perf_counter() - started

    @property
    def texture(self) -> wgpu.GPUTexture:
        """The picture that was composed last."""
        return self._texture or self._sized((1, 1))

    def download(self) -> np.ndarray:
        """(height, width, 4) of the composed picture."""
        encoder = self.device.create_command_encoder(label="download")
        return self._images.download(encoder, self.texture)

    def picture(self) -> np.ndarray:
        """(height, width, 3) display values 0..1 of the picture, the panel not in it."""
        return visible(self.download(), self._visible, self._format)

    def values(self, x: float, y: float) -> np.ndarray | None:
        """(3,) display values 0..1 of the composed picture at a place [px]; None outside it."""
        texture = self.texture
        if not (0 <= x < texture.size[0] and 0 <= y < texture.size[1]):
            return None
        place = {"texture": texture, "origin": (int(x), int(y), 0)}
        layout = {"bytes_per_row": 8, "rows_per_image": 1}
        texel: Any = self.device.queue.read_texture(place, layout, (1, 1, 1))
        return np.frombuffer(texel, np.float16)[:3].astype(np.float32)

    def _view_of(self, side: str, image: Image) -> wgpu.GPUTextureView:
        if image.array is None:
            return image.texture.create_view() if image.texture else self._none
        if self._uploaded.get(side) != (image.stamp, image.size):
            self._images.upload(side, image.array, "rgba16float")
            self._uploaded[side] = image.stamp, image.size
        height, width = image.array.shape[:2]
        return self._images.view(side, (width, height), "rgba16float")

    def _sized(self, size: tuple[int, int]) -> wgpu.GPUTexture:
        """The texture; pools of textures have those that compute shaders write."""
        if self._texture is None or self._texture.size[:2] != size:
            usage = wgpu.TextureUsage
            self._texture = self.device.create_texture(
                label="picture",
                size=(*size, 1),
                format=self._format,
                usage=usage.RENDER_ATTACHMENT | usage.TEXTURE_BINDING | usage.COPY_SRC,
            )
        return self._texture

    def _pipeline(self, constants: tuple[tuple[str, float], ...]):
        if constants not in self._pipelines:
            while len(self._pipelines) >= _KEPT:
                self._pipelines.popitem(last=False)
            layouts = [_layout(self.device, []), _layout(self.device, _COMPOSED)]
            layout = self.device.create_pipeline_layout(bind_group_layouts=layouts)
            made = pipeline(self.device, _COMPOSE, self._format, layout, dict(constants))
            self._pipelines[constants] = made
        self._pipelines.move_to_end(constants)
        return self._pipelines[constants]


def visible(texels: np.ndarray, box: Box, format: str) -> np.ndarray:
    """(height, width, 3) display values 0..1 in a box of texels; their `format`."""
    x, y, width, height = (round(value) for value in box)
    channels = slice(2, None, -1) if format.startswith("bgra") else slice(3)
    part = texels[y : y + height, x : x + width, channels].astype(np.float32)
    return part / 255 if texels.dtype == np.uint8 else part


def draw(
    device: wgpu.GPUDevice,
    pipeline: Any,
    group: int,
    resources: list[Any],
    target: wgpu.GPUTexture,
    band: tuple[int, int, int, int],
) -> None:
    """One pass of a rasterizer over a band of `target`; its bindings, in order."""
    encoder = device.create_command_encoder(label="view")
    load = "clear" if band == (0, 0, *target.size[:2]) else "load"
    attachment = {"view": target.create_view(), "load_op": load, "store_op": "store"}
    pass_ = encoder.begin_render_pass(color_attachments=[attachment])
    pass_.set_pipeline(pipeline)
    pass_.set_scissor_rect(*band)
    bound = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(group),
        entries=[{"binding": i, "resource": r} for i, r in enumerate(resources)],
    )
    pass_.set_bind_group(group, bound)
    pass_.draw(3)
    pass_.end()
    gpu.submit(device, encoder)


def clear(device: wgpu.GPUDevice, target: wgpu.GPUTexture) -> None:
    """Make a texture black."""
    encoder = device.create_command_encoder(label="clear")
    attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store"}
    encoder.begin_render_pass(color_attachments=[attachment]).end()
    gpu.submit(device, encoder)


def pipeline(
    device: wgpu.GPUDevice, file: str, format: str, layout: Any, constants: dict[str, float]
):
    """A pass over all pixels: the fragment shader of a file."""
    modules = [device.create_shader_module(code=wgsl.load(name).text) for name in (BLIT, file)]
    return device.create_render_pipeline(
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


def _layout(device: wgpu.GPUDevice, entries: list[dict[str, Any]]):
    stage = wgpu.ShaderStage.FRAGMENT
    numbered = [{"binding": i, "visibility": stage} | e for i, e in enumerate(entries)]
    return device.create_bind_group_layout(entries=numbered)


def _constants(view: View) -> dict[str, float]:
    """Constants of the pipeline: drivers without a GPU evaluate every branch that they do not
    decide. Those that make no difference to the view are not told apart.
    """
    source, mode = wgsl.load(_COMPOSE), view.mode
    first, second = (image.kind for image in view.images)
    seen = {first} if mode == "ONE" else {first, second}
    taps = _taps(view.images, whole(view.place), mode) if seen & {"COLOR", "DISPLAY"} else 1
    return {
        "FIRST": source.constant(first),
        "SECOND": source.constant("COLOR" if mode == "ONE" else second),
        "COMPARE": source.constant(mode),
        "TONE": source.constant(view.state.tone.upper() if "COLOR" in seen else "CLIP"),
        "TAPS": taps,
    }


def _uniform(view: View) -> np.ndarray:
    state, place, first = view.state, view.place, view.images[0]
    data = np.zeros((), wgsl.load(_COMPOSE).dtype("View"))
    data["area"], data["place"] = view.area, place
    data["line"], data["thick"] = place[0] + state.wipe * place[2], view.ratio
    data["exposure"], data["gain"] = 2.0**state.exposure, state.gain
    data["middle"], data["fastest"] = state.middle, state.fastest
    if (key := view.key) is not None:
        data["wheel" if first.kind == "MOTION" else "key"] = key
    return data


def _taps(images: tuple[Image, Image], place: tuple[int, int], mode: str) -> int:
    """Texels a side for a pixel of the screen; 0 where they are the same."""
    seen = images[:1] if mode == "ONE" else images
    sizes = [image.size for image in seen if image.size]
    if mode != "SPLIT" and all(size == place for size in sizes):
        return 0
    widest = max((size[0] for size in sizes), default=1) * (2 if mode == "SPLIT" else 1)
    return max(1, min(_MOST_TAPS, round(widest / place[0])))
