"""The passes of one frame, recorded by their files; left out where no light changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import TexturePool
from ...contract import View

FOLDER = "methods/gather/shading"
_GATES = wgsl.load(f"{FOLDER}/gate.wgsl").integer("GATES")
_HALVED = wgsl.load(f"{FOLDER}/active.wgsl").integer("HALVED")
GATES_SIZE = 4 * 3 * _GATES  # bytes
Size = tuple[int, int]


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
    change_flags: wgpu.GPUBuffer
    lists: Mapping[str, wgpu.GPUBuffer]
    begun: set[str]
    gates: Mapping[Size, gpu.BufferPart] = field(default_factory=dict)

    @property
    def size(self) -> Size:
        """Width and height [px]."""
        return self.bindings.size

    def texture(self, name: str, format: str, size: Size | None = None) -> View:
        """The view of a texture of this name; kinds of light share it, one after the other."""
        return self.images.view(f"shading {name}", size or self.size, format)

    def sparse(self, name: str, format: str, size: Size | None = None) -> View:
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
        size: Size | None = None,
        over: str | None = None,
        halved: bool = False,
        constants: Mapping[str, float] | None = None,
        **resources: Any,
    ) -> None:
        """Record one entry point over `size` invocations, over a list of tiles, or over the image.

        `halved`: over the tiles of an image of half the frame's size or less. The textures of
        another size than the frame's come with their own. The resources of the stage for all passes
        (its lists, flags and kind of light) are bound where a file declares them.
        """
        path = f"{FOLDER}/{file}.wgsl"
        source = wgsl.load(path)
        of_kind = {"PULLED": self.pulled, "RESTING": self.resting}
        values = {name: of_kind[name] for name in of_kind.keys() & source.overrides()}
        shared = {"listed": self.lists.get(over or "whole"), "found": self.change_flags}
        resources |= {name: shared[name] for name in shared.keys() & source.names()}
        kernel = gpu.kernel(self.device, path, resources, **values, **(constants or {}))
        where = size or self.size
        if over:
            offset = 4 * _HALVED if halved else 0
            where = {"buffer": self.lists[over], "offset": offset, "size": 12}
        elif self.gates:
            where = self.gates[where]
        kernel.run(self.encoder, entry, self.bindings, where, **resources)

    def gated(self, sizes: Sequence[Size], gates: wgpu.GPUBuffer) -> Stage:
        """The same, whose passes of these sizes run only if `change_flags` says so; `gates` holds
        how many workgroups they take.
        """
        assert len(sizes) <= _GATES
        counts = [(*size, 0, 0) for size in sizes]
        self.run("gate", size=(1, 1), sizes={"counts": counts}, gates=gates)
        each = {
            size: {"buffer": gates, "offset": 12 * i, "size": 12} for i, size in enumerate(sizes)
        }
        return replace(self, gates=each)
