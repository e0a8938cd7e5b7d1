"""Light of videos as a display with the primaries of Rec. 709 shows it: wide gamut, HLG."""

from __future__ import annotations

from typing import Any

import wgpu

from ... import gpu
from ...color.coding import HLG, Coding
from ...color.primaries import (
    H273,
    REC709,
    conversion,
    luminance,
)
from ...gpu.textures import TexturePool
from .composer import Image

_TEXEL = "rgba32float"


class VideoLight:
    """The display light of a video's picture, kept as long as the picture stays."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._converted: dict[str, tuple[tuple[Any, ...], Image]] = {}

    def image(self, slot: str, image: Image, coding: Coding) -> Image:
        """`image` as linear Rec. 709 light of a display; `slot`: on which side it is.

        Light of the scene (HLG) is shown as on a display of 1,000 cd/m2. Colours that Rec. 709
        does not have are left negative.
        """
        primaries = primaries_of(coding)
        if primaries == REC709 and coding.transfer != HLG:
            return image
        key = image.stamp, coding
        if self._converted.get(slot, (None,))[0] != key:
            assert image.texture is not None
            texture = self._images.texture(slot, image.texture.size[:2], _TEXEL)
            self._convert(image.texture, texture, primaries, coding.transfer == HLG)
            self._converted[slot] = key, Image(texture, "COLOR", key)
        return self._converted[slot][1]

    def _convert(
        self,
        light: wgpu.GPUTexture,
        output: wgpu.GPUTexture,
        primaries: tuple[float, ...],
        of_scene: bool,
    ) -> None:
        size = output.size[0], output.size[1]
        kernel = gpu.kernel(
            self._device, "viewer/draw/video_light.wgsl", {"Output": _TEXEL}, HLG=of_scene
        )
        red, green, blue = conversion(primaries, REC709)
        onto = {"red": red, "green": green, "blue": blue, "luminance": luminance(primaries)}
        encoder = self._device.create_command_encoder(label="video light")
        kernel.run(
            encoder,
            "main",
            gpu.FrameBindings.of_size(self._device, size),
            onto=onto,
            light=light.create_view(),
            output=output.create_view(),
        )
        gpu.submit(self._device, encoder)


def primaries_of(coding: Coding) -> tuple[float, ...]:
    """The chromaticities of a video's primaries; Rec. 709 where they are not known here."""
    return H273.get(coding.primaries, REC709)
