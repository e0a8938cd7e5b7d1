"""The passes of one frame, recorded by their files; left out where no light changes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import NamedTuple

import numpy as np
import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import TexturePool

FOLDER = "methods/gather/shading"
_GATES = int(wgsl.load(f"{FOLDER}/gate.wgsl").constant("GATES"))
_HALVED = int(wgsl.load(f"{FOLDER}/active.wgsl").constant("HALVED"))
GATES_SIZE = 4 * 3 * _GATES  # bytes


@dataclass(frozen=True)
class Stage:
    """Records passes over `bindings.size` into `encoder`.

    `name`: of the kind of light; `pulled`, `resting`: see Kind. `gates`: workgroups of passes by
    their sizes; none: all run. `change_flags`: see Added. `lists`: of tiles in which light is
    "doubtful" and "changing", of those "near" these, and of the "whole" image; empty if light
    changes nowhere. `begun`: names of sparse textures that are clear of the frame before.
    """

    device: wgpu.GPUDevice
    images: TexturePool
    encoder: wgpu.GPUCommandEncoder
    bindings: gpu.FrameBindings
    name: str
    pulled: bool
    resting: bool
    gates: dict[tuple[int, int], dict]
    change_flags: wgpu.GPUBuffer
    lists: Mapping[str, wgpu.GPUBuffer]
    begun: set[str] = field(default_factory=set)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.bindings.size

    def texture(self, name: str, format: str, size: tuple[int, int] | None = None):
        """The view of a texture of this name; kinds of light share it, one after the other."""
        return self.images.view(f"shading {name}", size or self.size, format)

    def none(self, format: str) -> wgpu.GPUTextureView:
        """Bound where a pass reads nothing; black."""
        return self.images.view(f"none {format}", (1, 1), format)

    def unused(self, format: str) -> wgpu.GPUTextureView:
        """Bound where a pass writes nothing."""
        return self.images.view(f"spare {format}", (1, 1), format)

    def sparse(self, name: str, format: str, size: tuple[int, int] | None = None):
        """The same, for passes over lists of tiles: 0 in all others."""
        size = size or self.size
        view = self.texture(name, format, size)
        blank = self.texture(f"blank {format} {size}", format, size)
        if name not in self.begun:
            self.encoder.copy_texture_to_texture(
                {"texture": blank.texture}, {"texture": view.texture}, (*size, 1)
            )
            self.begun.add(name)
        return view

    def run(
        self,
        file: str,
        entry: str = "main",
        *,
        size: tuple[int, int] | None = None,
        over: str | None = None,
        halved: bool = False,
        constants: dict[str, float] | None = None,
        **resources,
    ) -> None:
        """Record one entry point over `size` invocations, over a list of tiles, or over the image.

        `halved`: over the tiles of an image of half the frame's size or less. The textures of
        another size than the frame's come with their own.
        """
        path, given = f"{FOLDER}/{file}.wgsl", dict(constants or {})
        takes = _takes(path)
        if takes.kind:
            given["PULLED"] = self.pulled
        if takes.resting:
            given["RESTING"] = self.resting
        texels = {name: gpu.stored(resources[name]) for name in takes.textures}
        kernel = gpu.kernel(self.device, path, texels, **given)
        size = size or self.size
        gate = self.gates.get(size) if self.gates else None
        if over:
            gate = {"buffer": self.lists[over], "offset": 4 * _HALVED if halved else 0, "size": 12}
        if takes.listed:
            resources["listed"] = self.lists[over or "whole"]
        if takes.flags:
            resources["found"] = self.change_flags
        if self.gates and gate is None:
            raise KeyError(f"no gate for passes of {size}")
        kernel.run(self.encoder, entry, replace(self.bindings, size=size), gate, **resources)

    def uniform(self, file: str, struct: str, **values) -> wgpu.GPUBuffer:
        """The struct of a file with these values, the others 0."""
        return gpu.uniform(self.device, f"{FOLDER}/{file}.wgsl", struct, **values)

    def gated(self, sizes: list[tuple[int, int]], gates: wgpu.GPUBuffer) -> Stage:
        """The same, whose passes of these sizes run only if `change_flags` says so; `gates` holds
        how many workgroups they take.
        """
        assert len(sizes) <= _GATES
        counts = np.zeros((_GATES, 4), np.uint32)
        counts[: len(sizes), :2] = sizes
        self.run("gate", size=(1, 1), sizes=self.uniform("gate", "Sizes", counts=counts),
                 gates=gates)  # fmt: skip
        each = {
            size: {"buffer": gates, "offset": 12 * i, "size": 12} for i, size in enumerate(sizes)
        }
        return replace(self, gates=each)


class _Takes(NamedTuple):
    """Bindings and constants of a file: kinds of light, list of tiles, flags, textures as given."""

    kind: bool
    resting: bool
    listed: bool
    flags: bool
    textures: tuple[str, ...]


@cache
def _takes(path: str) -> _Takes:
    text = wgsl.load(path).text
    textures = tuple(re.findall(r"var (\w+): .*// stored as given", text))
    pulled, resting = (f"override {name}" in text for name in ("PULLED", "RESTING"))
    return _Takes(pulled, resting, "> listed:" in text, "> found:" in text, textures)
