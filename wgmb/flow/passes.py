"""Common parts of the passes of flow: group 0, textures, and submission of each pass by itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..gpu.textures import ScratchBuffer, TexturePool

_USAGE = wgpu.TextureUsage
AT_ONCE = 1 << 15  # invocations of a submission without a GPU, where a pass is banded
Bindings = dict[str, Any]  # resources by the names in a shader, and `constants`
STATES, FEATURES = ("rgba32float", 2), ("rgba8unorm", 2)  # format, layers


class FlowPasses:
    """Runs passes, and lends textures that may be given back for the next frame's.

    Passes are gathered until `submit`, which is due before others write what they read, and before
    others read what they write. Without a GPU every pass is submitted by itself, the long ones in
    bands: a frame takes seconds there, and a submission cannot be interrupted.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self.device, self.images = device, TexturePool(device)
        self._in_software = device.adapter_info["adapter_type"] == gpu.SOFTWARE
        self.linear = device.create_sampler(mag_filter="linear", min_filter="linear")
        self.landings, self.costs = (ScratchBuffer(device) for _ in range(2))
        self._gathered: gpu.Tape | None = None
        self._free: dict[tuple[tuple[int, int], tuple[str, int]], list[wgpu.GPUTexture]] = {}
        self._frame = gpu.SizeBindings(device)
        self._lent: set[int] = set()  # uids of textures that stay
        self._views: dict[tuple[int, str], wgpu.GPUTextureView] = {}  # of these

    def run(
        self,
        file: str,
        entry: str,
        size: tuple[int, int],
        *,
        grid: tuple[int, int] | None = None,
        constants: dict[str, float] | None = None,
        **resources: wgpu.GPUTexture | wgpu.GPUTextureView | wgpu.GPUBuffer,
    ) -> None:
        """Run one entry point of `wgsl/flow/<file>` for a frame of `size`.

        `grid`: how many invocations it takes, across and down, if not one for every pixel.
        """
        kernel = gpu.kernel(self.device, f"flow/{file}", None, **(constants or {}))
        bound = {name: self._bound(kernel, name, value) for name, value in resources.items()}
        width, height = grid or size
        for first, rows in self._bands(kernel, width, height):
            if "band" in kernel.bindings:
                whole = -(-height // kernel.workgroup[1])
                bound["band"] = self.uniform("band.wgsl", "Band", first=first, rows=whole)
            part = replace(self._frame(size), size=(width, rows * kernel.workgroup[1]))
            if self._gathered is None:
                self._gathered = gpu.Tape(part)
            kernel.run(self._gathered, entry, part, **bound)
            if self._in_software:
                self.submit()

    def submit(self) -> None:
        """Submit the passes that are gathered."""
        if self._gathered is not None:
            gpu.hand_in(self.device, self._recorded())

    def read(self, texture: wgpu.GPUTexture) -> np.ndarray:
        """(height, width, channels) contents of a texture after all passes, which are submitted."""
        return self.images.download(self._recorded(), texture)

    def _recorded(self) -> wgpu.GPUCommandEncoder:
        """An encoder with the passes that are gathered; none are afterwards."""
        encoder = gpu.encoder(self.device, "flow")
        gathered, self._gathered = self._gathered, None
        if gathered is not None:
            gathered.play(encoder)
        return encoder

    def _bands(self, kernel: gpu.Kernel, width: int, height: int) -> Iterator[tuple[int, int]]:
        """The first row of workgroups, and how many, of every submission of a pass."""
        across, down = kernel.workgroup
        whole = -(-height // down)
        most = whole
        if "band" in kernel.bindings and self._in_software:
            most = max(1, AT_ONCE // (-(-width // across) * across * down))
        for first in range(0, whole, most):
            yield first, min(most, whole - first)

    def uniform(self, file: str, struct: str, **values: Any) -> wgpu.GPUBuffer:
        """The struct of `wgsl/flow/<file>` with these values, the others 0."""
        return gpu.uniform(self.device, f"flow/{file}", struct, **values)

    def take(self, size: tuple[int, int], kind: tuple[str, int]) -> wgpu.GPUTexture:
        """A texture of a format and so many layers; its contents are undefined."""
        if free := self._free.get((size, kind)):
            return free.pop(0)  # in turns, so that the same passes have the same textures again
        gpu.check_size(self.device, *size)
        usage = _USAGE.TEXTURE_BINDING | _USAGE.STORAGE_BINDING | _USAGE.COPY_SRC | _USAGE.COPY_DST
        made = self.device.create_texture(
            label=f"flow {kind[0]}", size=(*size, kind[1]), format=kind[0], usage=usage
        )
        self._lent.add(made.uid)
        return made

    def give(self, *textures: wgpu.GPUTexture) -> None:
        """Take back textures that no later pass reads."""
        for texture in textures:
            width, height, layers = texture.size
            kind = texture.format, layers
            self._free.setdefault(((width, height), kind), []).append(texture)

    def scratch(self, size: tuple[int, int], format: str, name: str) -> wgpu.GPUTexture:
        """A texture for one stage; the next one that asks for this name and size gets the same."""
        texture = self.images.texture(f"{name} {size[0]} x {size[1]}", size, format)
        self._lent.add(texture.uid)
        return texture

    def _bound(self, kernel: gpu.Kernel, name: str, value: Any) -> Any:
        if not isinstance(value, wgpu.GPUTexture):
            return value
        array = "_2d_array" in kernel.bindings[name].type if name in kernel.bindings else False
        dimension = "2d-array" if array else "2d"
        view = self._views.get((value.uid, dimension))
        if view is None:
            view = value.create_view(dimension=dimension)
            if value.uid in self._lent:
                self._views[value.uid, dimension] = view
        return view
