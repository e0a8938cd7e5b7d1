"""Stored planes of videos to linear light and back, on the GPU: matrix, range, transfer, alpha."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import numpy as np
import wgpu

from .. import gpu
from ..coding import CodedPicture, Coding
from ..errors import InputError
from ..gpu import wgsl
from ..gpu.textures import TexturePool
from .matrices import from_samples, to_samples

_CURVES = {4: 4, 5: 5, 8: 8, 13: 13, 16: 16, 18: 18, 1: 13, 6: 13, 11: 13, 14: 13, 15: 13}
"""The transfers of H.273 that are known, and the curve of wgsl/common/transfer.wgsl for each."""


def check(coding: Coding) -> None:
    """InputError where a picture's matrix or transfer is not known here."""
    if coding.transfer not in _CURVES:
        known = ", ".join(map(str, sorted(_CURVES)))
        raise InputError(f"transfer {coding.transfer} of H.273 is not known; these are: {known}")
    from_samples(coding)


class Planes:
    """Converts pictures on one device; keeps its textures from picture to picture."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)

    def decode(
        self, encoder: wgpu.GPUCommandEncoder, picture: CodedPicture, output: wgpu.GPUTextureView
    ) -> None:
        """Upload a picture and record its way into `output`, rgba16float or rgba32float."""
        coding = picture.coding
        check(coding)
        deep = "r16uint" if coding.bits > 8 else "r8uint"
        views = [
            self._images.upload(f"plane {i}", plane, deep) for i, plane in enumerate(picture.planes)
        ]
        alpha = views.pop() if coding.alpha else None
        kernel = gpu.kernel(
            self._device,
            "planes/decode.wgsl",
            {"Output": output.texture.format},
            CURVE=_CURVES[coding.transfer],
            GREY=coding.model == "grey",
            ALPHA=coding.alpha,
        )
        kernel.run(
            encoder,
            "main",
            self._bindings(picture.size),
            code=self._code(from_samples(coding), 1 / (2**coding.bits - 1), coding),
            plane0=views[0],
            plane1=views[1 % len(views)],
            plane2=views[2 % len(views)],
            plane3=alpha or views[0],
            output=output,
        )

    def encode(
        self, encoder: wgpu.GPUCommandEncoder, light: wgpu.GPUTextureView, coding: Coding
    ) -> CodedPicture:
        """Record the way of a picture's light to its planes, submit all, and return them."""
        check(coding)
        size = light.size[0], light.size[1]
        samples = self._images.texture("samples", size, "rgba32float")
        kernel = gpu.kernel(
            self._device,
            "planes/encode.wgsl",
            {"Output": "rgba32float"},
            CURVE=_CURVES[coding.transfer],
            ALPHA=coding.alpha,
        )
        kernel.run(
            encoder,
            "main",
            self._bindings(size),
            code=self._code(to_samples(coding), 2**coding.bits - 1, coding),
            light=light,
            output=samples.create_view(),
        )
        packed = [
            self._pack(encoder, samples, component, step, coding)
            for component, step in _components(coding)
        ]
        return CodedPicture(tuple(self._read(encoder, packed, coding)), coding)

    def _pack(
        self,
        encoder: wgpu.GPUCommandEncoder,
        samples: wgpu.GPUTexture,
        component: int,
        step: tuple[int, int],
        coding: Coding,
    ) -> tuple[wgpu.GPUBuffer, tuple[int, int]]:
        """Record a plane's bytes; returns their buffer, and the plane's width and height."""
        bits = 16 if coding.bits > 8 else 8
        kernel = gpu.kernel(self._device, "planes/pack.wgsl", COMPONENT=component, BITS=bits)
        width, height = (-(-n // s) for n, s in zip(samples.size[:2], step, strict=True))
        words = -(-width * bits // 32)
        data = np.zeros((), kernel.source.dtype("Plane"))
        data["size"], data["step"] = (width, height), step
        data["words"], data["most"] = words, 2**coding.bits - 1
        usage = wgpu.BufferUsage
        packed = self._device.create_buffer(
            label="packed", size=4 * words * height, usage=usage.STORAGE | usage.COPY_SRC
        )
        kernel.run(
            encoder,
            "main",
            self._bindings((words, height)),
            plane=self._device.create_buffer_with_data(data=data, usage=usage.UNIFORM),
            samples=samples.create_view(),
            packed=packed,
        )
        return packed, (width, height)

    def _read(
        self,
        encoder: wgpu.GPUCommandEncoder,
        packed: list[tuple[wgpu.GPUBuffer, tuple[int, int]]],
        coding: Coding,
    ) -> list[np.ndarray]:
        """Submit, and return the planes."""
        usage = wgpu.BufferUsage
        total = sum(buffer.size for buffer, _ in packed)
        staging = self._device.create_buffer(
            label="planes", size=total, usage=usage.COPY_DST | usage.MAP_READ
        )
        at = 0
        for buffer, _ in packed:
            encoder.copy_buffer_to_buffer(buffer, 0, staging, at, buffer.size)
            at += buffer.size
        gpu.submit(self._device, encoder)
        staging.map_sync(wgpu.MapMode.READ)
        everything = np.asarray(staging.read_mapped()).view(np.uint8)
        staging.unmap()
        kind, planes, at = np.dtype("<u2" if coding.bits > 8 else "u1"), [], 0
        for buffer, (width, height) in packed:
            rows = everything[at : at + buffer.size].view(kind).reshape(height, -1)
            planes.append(np.ascontiguousarray(rows[:, :width]))
            at += buffer.size
        return planes

    def _bindings(self, size: tuple[int, int]) -> gpu.FrameBindings:
        data = np.zeros((), wgsl.load("common/frame.wgsl").dtype("Frame"))
        data["size"] = size
        frame = self._device.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.UNIFORM)
        return gpu.FrameBindings(size, {"frame": frame})

    def _code(self, rows: np.ndarray, alpha: float, coding: Coding) -> wgpu.GPUBuffer:
        data = np.zeros((), wgsl.load("planes/code.wgsl").dtype("Code"))
        data["x"], data["y"], data["z"] = rows
        data["alpha"], data["step"] = alpha, coding.steps
        return self._device.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.UNIFORM)


def _components(coding: Coding) -> list[tuple[int, tuple[int, int]]]:
    """Of every plane the component of the samples, and the pixels to one of its samples."""
    colors = {"grey": [(0, (1, 1))], "rgb": [(i, (1, 1)) for i in range(3)]}
    chroma = [(1, coding.steps), (2, coding.steps)]
    planes = colors.get(coding.model, [(0, (1, 1)), *chroma])
    return [*planes, (3, (1, 1))] if coding.alpha else planes
