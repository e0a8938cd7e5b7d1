"""Stored planes of videos to linear light and back, on the GPU: matrix, range, transfer, alpha."""

from __future__ import annotations

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import FLOAT, CodedPicture, Coding
from ...color.highlights import Expansion
from ...gpu.textures import KeptViews, TexturePool
from ..changing_light import LightChanges
from .average import Average, averages
from .matrices import from_samples
from .packed import Packed, places_of
from .uniforms import curve_of, reading, writing

_HALF_BITS = 12  # of samples that come back exactly from light as half floats

__all__ = ["Average", "Planes", "averages", "check"]


def check(coding: Coding) -> None:
    """InputError where a picture's matrix or transfer is not known here."""
    curve_of(coding)
    from_samples(coding)


class Planes:
    """Converts pictures on one device; keeps its textures from picture to picture.

    `expansion`: of light that is decoded, taken back where it is encoded.
    """

    def __init__(self, device: wgpu.GPUDevice, expansion: Expansion = Expansion()):  # noqa: B008
        self.expansion = expansion
        self.device, self._images, self._packed = device, TexturePool(device), Packed(device)
        self._frame, self._views = gpu.SizeBindings(device), KeptViews()
        self._none = LightChanges.none(device)

    def texel(self, coding: Coding) -> str:
        """Of a picture's light: 16 bits and floats need more than half floats hold."""
        return gpu.texel(self.device, 4) if coding.bits > _HALF_BITS else "rgba16float"

    def draw(self, picture: CodedPicture, output: wgpu.GPUTexture) -> None:
        """Submit a picture's way into `output`, of its size and a format as for `decode`."""
        encoder = gpu.encoder(self.device, "decode")
        self.decode(encoder, picture, self._views.of(output))
        gpu.hand_in(self.device, encoder)

    def decode(
        self, encoder: wgpu.GPUCommandEncoder, picture: CodedPicture, output: wgpu.GPUTextureView
    ) -> None:
        """Upload a picture and record its way into `output`, rgba16float or rgba32float."""
        coding = picture.coding
        check(coding)
        if coding.bits == FLOAT:
            return self._decode_floats(encoder, picture, output)
        deep = "r16uint" if coding.bits > 8 else "r8uint"
        views = [
            self._images.upload(f"plane {i}", plane, deep) for i, plane in enumerate(picture.planes)
        ]
        alpha = views.pop() if coding.alpha else None
        kernel = gpu.kernel(
            self.device,
            "video/planes/decode.wgsl",
            {"Output": output.texture.format},
            CURVE=curve_of(coding),
            HIGHLIGHTS=self.expansion.white,
            GREY=coding.model == "grey",
            ALPHA=coding.alpha,
        )
        kernel.run(
            encoder,
            "main",
            self._frame(picture.size),
            code=reading(self.device, coding),
            plane0=views[0],
            plane1=views[1 % len(views)],
            plane2=views[2 % len(views)],
            plane3=alpha or views[0],
            output=output,
        )

    def _decode_floats(
        self, encoder: wgpu.GPUCommandEncoder, picture: CodedPicture, output: wgpu.GPUTextureView
    ) -> None:
        kernel = gpu.kernel(
            self.device,
            "video/planes/decode_floats.wgsl",
            {"Output": output.texture.format},
            CURVE=curve_of(picture.coding),
            HIGHLIGHTS=self.expansion.white,
            ALPHA=picture.coding.alpha,
        )
        signals = self._images.upload("signals", picture.planes[0], "rgba32float")
        frame = self._frame(picture.size)
        kernel.run(encoder, "main", frame, signals=signals, output=output)

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        light: wgpu.GPUTextureView,
        coding: Coding,
        changes: LightChanges | None = None,
    ) -> CodedPicture:
        """Record the way of a picture's light to its planes, submit all, and return them.

        `changes`: of the light, which are added. Pixels that are not finite count as black.
        """
        check(coding)
        size = light.size[0], light.size[1]
        changes = changes or self._none
        given = {
            "code": writing(self.device, coding),
            "light": light,
            **changes.bindings(),
        }
        constants = {
            "CURVE": curve_of(coding),
            "HIGHLIGHTS": self.expansion.white,
            "ALPHA": coding.alpha,
            "STEP": changes.step,
        }
        texels = {"light": gpu.stored(light), **changes.texels()}
        if coding.bits == FLOAT:
            samples = self._images.texture("samples", size, "rgba32float")
            gpu.kernel(self.device, "video/planes/encode.wgsl", texels, **constants).run(
                encoder,
                "main",
                self._frame(size),
                output=self._images.view_of(samples),
                **given,
            )
            return CodedPicture((self._images.download(encoder, samples),), coding)
        places = places_of(size, coding)
        kernel = gpu.kernel(
            self.device,
            "video/planes/pack.wgsl",
            texels,
            BITS=16 if coding.bits > 8 else 8,
            STEP_X=max(place.step[0] for place in places),
            STEP_Y=max(place.step[1] for place in places),
            **constants,
        )
        data = np.zeros((), kernel.source.dtype("Planes"))
        data["most"] = 2**coding.bits - 1
        for place in places:
            data["places"][place.component, :3] = place.words, place.size[1], place.first
        coarse = places[1 % len(places)]
        kernel.run(
            encoder,
            "main",
            self._frame((coarse.words, coarse.size[1])),
            planes=data,
            packed=self._packed.buffer(places),
            **given,
        )
        return self._packed.read(encoder, places, coding)

    def compress(
        self,
        encoder: wgpu.GPUCommandEncoder,
        light: wgpu.GPUTextureView,
        output: wgpu.GPUTextureView,
    ) -> None:
        """Record the way of expanded light into `output`, rgba32float, as it was."""
        size = light.size[0], light.size[1]
        kernel = gpu.kernel(
            self.device,
            "video/planes/compress.wgsl",
            {"Output": "rgba32float"},
            HIGHLIGHTS=self.expansion.white,
        )
        frame = self._frame(size)
        kernel.run(encoder, "main", frame, light=light, output=output)
