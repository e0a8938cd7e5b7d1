"""Pictures as an OpenColorIO display shows them: on the GPU, or by the CPU where that fails."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from ...color.spaces import ColorSpace, Display
from ...errors import DeviceError, InputError
from ...gpu.textures import TexturePool
from ...settings.color import ColorSettings
from ..state.state import State
from .composer import Image
from .ocio_shader import OUTPUT, OcioShader


class DisplayCache:
    """The displayed picture, kept until the picture or its display changes."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._opened: tuple[ColorSettings | None, Display | None] = None, None
        self._compiled: dict[tuple[Display, ColorSpace], OcioShader | None] = {}
        self._converted: dict[str, tuple[tuple[Any, ...], Image]] = {}

    def display(self, state: State) -> Display | None:
        """The display that the state asks for; None: sRGB. InputError if there is none such."""
        if self._opened[0] != state.color:
            self._opened = state.color, state.color.open()
            self._compiled.clear()
        return self._opened[1]

    def image(
        self, slot: str, image: Image, display: Display, space: ColorSpace, exposure: float
    ) -> Image:
        """The display values of `image`, which is linear light in `space` over black.

        `slot`: on which side it is; `exposure`: a factor of the light.
        """
        key = image.stamp, display, space, exposure
        if self._converted.get(slot, (None,))[0] != key:
            assert image.texture is not None
            texture = self._images.texture(slot, image.texture.size[:2], OUTPUT)
            self._draw(image.texture, texture, display, space, exposure)
            self._converted[slot] = key, Image(texture, "DISPLAY", key)
        return self._converted[slot][1]

    def _draw(
        self,
        light: wgpu.GPUTexture,
        texture: wgpu.GPUTexture,
        display: Display,
        space: ColorSpace,
        exposure: float,
    ) -> None:
        space.check_linear()
        if (display, space) not in self._compiled:
            try:
                self._compiled[display, space] = OcioShader(self._device, display, space)
            except (DeviceError, InputError):  # the same picture, only slower
                self._compiled[display, space] = None
        if (compiled := self._compiled[display, space]) is not None:
            compiled.show(light, exposure, texture)
            return
        encoder = self._device.create_command_encoder(label="download")
        rgba = self._images.download(encoder, light).astype(np.float32)
        rgba[..., :3] *= np.float32(exposure)
        shown = display.shown(rgba, space, over_black=True)
        opaque = np.ones((*shown.shape[:2], 1), np.float32)
        self._images.upload(texture.label, np.concatenate([shown, opaque], axis=2), OUTPUT)
