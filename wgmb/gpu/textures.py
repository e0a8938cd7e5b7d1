"""Images on the GPU: textures kept from frame to frame, arrays up and down."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import wgpu

from ..errors import InputError
from .commands import before_writing, submit
from .device import SOFTWARE, check_size

_BAND = 4 << 20  # bytes written at once: five times faster at 4K than all at once
_READBACK = 16 << 20  # bytes read back at once: a buffer takes memory beside the texture;
_READBACK_IN_SOFTWARE = 4 << 20  # without a GPU, where less at once is as quick
_HALF_MAX = 65504.0  # largest finite f16
_USAGE = wgpu.TextureUsage
_NUMPY = {"32float": "<f4", "16float": "<f2", "32uint": "<u4", "16uint": "<u2"}
_NUMPY |= {"8uint": "u1", "8unorm": "u1"}
_STORABLE = ("rgba16float", "rgba32float", "r32float", "r32uint", "rg32uint", "rgba32uint")
Word = tuple[wgpu.GPUBuffer, int]
"""A word of a buffer that can be copied, by its offset [bytes]."""
_CHANNELS = {"r": 1, "rg": 2, "rgba": 4, "bgra": 4}


def numpy_of(format: str) -> tuple[np.dtype, int]:
    """Numpy type and number of channels of a texture format such as `rgba16float`."""
    letters = re.split(r"\d", format)[0]
    return np.dtype(_NUMPY[format[len(letters) :]]), _CHANNELS[letters]


def write(device: wgpu.GPUDevice, texture: wgpu.GPUTexture, image: np.ndarray) -> None:
    """Put an array (height, width[, channels]) into the texture's first corner, as its type.

    The last band goes with the next submission.
    """
    kind, channels = numpy_of(texture.format)
    height, width = image.shape[:2]
    row = width * channels * kind.itemsize
    band = max(1, _BAND // row)
    before_writing(device)
    for top in range(0, height, band):
        if top:
            submit(device)  # written data stays in memory until a submission
        rows = _of_kind(image[top : top + band], kind)
        device.queue.write_texture(
            {"texture": texture, "origin": (0, top, 0)},
            rows,
            {"bytes_per_row": row},
            (width, len(rows), 1),
        )


def _of_kind(rows: np.ndarray, kind: np.dtype) -> np.ndarray:
    """Rows of an image in one piece, as another type; only infinity becomes infinite halves."""
    if kind == np.float16 and rows.dtype != np.float16:
        rows = np.where(np.isinf(rows), rows, np.clip(rows, -_HALF_MAX, _HALF_MAX))
    with np.errstate(over="ignore"):  # what f32 cannot hold is infinite, and counted as bad
        return np.ascontiguousarray(rows, kind)


def copy_middle(
    encoder: wgpu.GPUCommandEncoder, wide: wgpu.GPUTexture, output: wgpu.GPUTexture
) -> None:
    """Record a copy of the middle columns of a texture, which is as high as `output`, into it."""
    width, height, _ = output.size
    left = (wide.size[0] - width) // 2
    encoder.copy_texture_to_texture(
        {"texture": wide, "origin": (left, 0, 0)}, {"texture": output}, (width, height, 1)
    )


class ScratchBuffer:
    """A storage buffer that is only remade when it has to grow."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device: wgpu.GPUDevice = device
        self._buffer: wgpu.GPUBuffer | None = None

    def at_least(self, size: int) -> wgpu.GPUBuffer:
        """The buffer, of `size` bytes or more; its contents are undefined."""
        most = self._device.limits["max-storage-buffer-binding-size"]
        if size > most:
            raise InputError(f"the image needs a buffer of {size} bytes, the adapter allows {most}")
        if self._buffer is None or self._buffer.size < size:
            self._buffer = self._device.create_buffer(
                label="scratch",
                size=size,
                usage=wgpu.BufferUsage.STORAGE
                | wgpu.BufferUsage.COPY_DST
                | wgpu.BufferUsage.COPY_SRC
                | wgpu.BufferUsage.INDIRECT,
            )
        return self._buffer


class KeptViews:
    """Views of other owners' textures: for each label, the view of its last texture."""

    def __init__(self) -> None:
        self._views: dict[str, wgpu.GPUTextureView] = {}

    def of(self, texture: wgpu.GPUTexture) -> wgpu.GPUTextureView:
        """A view of a texture, the same one for as long as no other one has its label."""
        view = self._views.get(texture.label)
        if view is None or view.texture is not texture:
            view = self._views[texture.label] = texture.create_view()
        return view


class TexturePool:
    """Textures kept from frame to frame under a name, remade when size or format changes."""

    def __init__(self, device: wgpu.GPUDevice):
        self.device = device
        self._textures: dict[str, wgpu.GPUTexture] = {}
        # By the texture's name, and by the view's options.
        self._views: dict[str, dict[tuple[object, ...], wgpu.GPUTextureView]] = {}
        self._staging: wgpu.GPUBuffer | None = None
        in_software = device.adapter_info["adapter_type"] == SOFTWARE
        self._at_once = _READBACK_IN_SOFTWARE if in_software else _READBACK

    def texture(
        self, name: str, size: tuple[int, int], format: str, layers: int = 1
    ) -> wgpu.GPUTexture:
        """The texture called `name`; its contents are whatever was last put there."""
        kept = self._textures.get(name)
        if kept is None or kept.size != (*size, layers) or kept.format != format:
            check_size(self.device, *size)
            usage = _USAGE.TEXTURE_BINDING | _USAGE.COPY_DST | _USAGE.COPY_SRC
            if format in _STORABLE:
                usage |= _USAGE.STORAGE_BINDING
            kept = self.device.create_texture(
                label=name, size=(*size, layers), format=format, usage=usage
            )
            self._textures[name] = kept
            self._views[name] = {}
        return kept

    def view(self, name: str, size: tuple[int, int], format: str) -> wgpu.GPUTextureView:
        """A view of the texture called `name`, the same one for as long as the texture stays."""
        return self.view_of(self.texture(name, size, format))

    def view_of(self, texture: wgpu.GPUTexture, **options: Any) -> wgpu.GPUTextureView:
        """A view of a texture of this pool; `options` as for create_view."""
        views, key = self._views[texture.label], tuple(options.items())
        if key not in views:
            views[key] = texture.create_view(**options)
        return views[key]

    def layer(self, texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
        """One layer of an array texture of this pool, as a texture of its own."""
        return self.view_of(texture, dimension="2d", base_array_layer=index, array_layer_count=1)

    def upload(self, name: str, image: np.ndarray, format: str) -> wgpu.GPUTextureView:
        """Put `image` (height, width[, channels]) into the texture called `name`."""
        height, width = image.shape[:2]
        texture = self.texture(name, (width, height), format)
        write(self.device, texture, image)
        return self.view_of(texture)

    def download(self, encoder: wgpu.GPUCommandEncoder, texture: wgpu.GPUTexture) -> np.ndarray:
        """Submit `encoder` and return `texture` as a new (height, width, channels) array."""
        return self.download_with(encoder, texture, ())[0]

    def download_with(
        self, encoder: wgpu.GPUCommandEncoder, texture: wgpu.GPUTexture, words: Sequence[Word]
    ) -> tuple[np.ndarray, tuple[int, ...]]:
        """The same, and words of buffers, with one wait for all."""
        width, height, _ = texture.size
        kind, channels = numpy_of(texture.format)
        row = width * channels * kind.itemsize
        pitch = -(-row // 256) * 256  # rows in a buffer start at multiples of 256 bytes
        picture = np.empty((height, width, channels), kind)
        band = max(1, min(height, self._at_once // pitch))
        size = pitch * band + 4 * len(words)
        if self._staging is None or self._staging.size != size:
            usage = wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.MAP_READ
            self._staging = self.device.create_buffer(label="readback", size=size, usage=usage)
        for k, (buffer, offset) in enumerate(words):
            encoder.copy_buffer_to_buffer(buffer, offset, self._staging, pitch * band + 4 * k, 4)
        told = ()
        for top in range(0, height, band):
            rows = min(band, height - top)
            if top:
                encoder = self.device.create_command_encoder(label="readback")
            encoder.copy_texture_to_buffer(
                {"texture": texture, "origin": (0, top, 0)},
                {"buffer": self._staging, "bytes_per_row": pitch, "rows_per_image": rows},
                (width, rows, 1),
            )
            submit(self.device, encoder)
            self._staging.map_sync(wgpu.MapMode.READ)
            try:
                data = np.asarray(self._staging.read_mapped(copy=False)).view(np.uint8)
                told = tuple(data[pitch * band :].view(np.uint32).tolist())
                data = data[: pitch * rows].reshape(rows, pitch)[:, :row]
                picture[top : top + rows] = data.view(kind).reshape(rows, width, channels)
            finally:
                self._staging.unmap()
        return picture, told
