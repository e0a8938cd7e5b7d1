"""Kernels: one compiled WGSL file each, its passes recorded by the names of its bindings."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import wgpu

from ..errors import ShaderError
from . import wgsl
from .bind_groups import BindGroups, constant, forget_constants, made_group


@dataclass(frozen=True)
class FrameBindings:
    """Bindings shared by all passes of a frame: group 0 of every shader."""

    size: tuple[int, int]  # width, height [px]
    resources: dict[str, wgpu.GPUBuffer]  # by binding name
    window: tuple[int, int, int, int] = (0, 0, 0, 0)  # x, y in the display window, its size [px]
    groups: BindGroups | None = None  # where bind groups are kept; None: each is made anew

    @classmethod
    def of_size(cls, device: wgpu.GPUDevice, size: tuple[int, int]) -> FrameBindings:
        """For passes that need no more of a frame than its size [px]."""
        return cls(size, {"frame": uniform(device, "common/frame.wgsl", "Frame", size=size)})


def uniform(device: wgpu.GPUDevice, file: str, struct: str, **values: Any) -> wgpu.GPUBuffer:
    """A struct of a file in `wgsl/` as a uniform buffer, with these values, the others 0."""
    data = np.zeros((), wgsl.load(file).dtype(struct))
    for name, value in values.items():
        data[name] = value
    return constant(device, struct, data)


class Kernel:
    """All entry points of one WGSL file, sharing the same bind groups.

    `kernel.run(encoder, "main", given, color=..., output=...)` binds by the names
    used in the shader; a missing or unknown name is an error before any GPU work.
    """

    def __init__(
        self,
        device: wgpu.GPUDevice,
        source: wgsl.WgslSource,
        constants: dict[str, float] | None = None,
    ):
        self.device, self.source, self.constants = device, source, constants or {}
        self.bindings = {b.name: b for b in source.bindings()}
        self.workgroup = int(source.constant("WG_X")), int(source.constant("WG_Y"))
        try:
            self._module = _module(device, source.name, source.text)
        except wgpu.GPUError as error:
            raise ShaderError(_located(str(error), source)) from None
        self._names = {b.name for b in self.bindings.values() if b.group > 0}
        self.groups = range(1 + max((b.group for b in self.bindings.values()), default=-1))
        self.layouts = [
            device.create_bind_group_layout(
                label=f"{source.name}:{group}",
                entries=[
                    _layout_entry(b, source) for b in self.bindings.values() if b.group == group
                ],
            )
            for group in self.groups
        ]
        self._layout = device.create_pipeline_layout(bind_group_layouts=self.layouts)
        self._pipelines: dict[str, wgpu.GPUComputePipeline] = {}
        self._places = [
            {b.name: b.index for b in self.bindings.values() if b.group == group}
            for group in self.groups
        ]

    def pipeline(self, entry: str) -> wgpu.GPUComputePipeline:
        """The compiled pass of an entry point, made when it is first asked for.

        On lavapipe, each takes 1 MB and 10 ms.
        """
        if entry not in self._pipelines:
            self._pipelines[entry] = self.device.create_compute_pipeline(
                label=f"{self.source.name}:{entry}",
                layout=self._layout,
                compute={
                    "module": self._module,
                    "entry_point": entry,
                    "constants": self.constants,
                },
            )
        return self._pipelines[entry]

    def bands(self, bindings: FrameBindings, most: int) -> Iterator[tuple[int, FrameBindings]]:
        """The image as bands of whole rows, of about `most` pixels each.

        Yields the first row of each [px], and what a dispatch over it is run with. Without a GPU,
        a dispatch is not interrupted, and takes seconds for a large image.
        """
        (width, height), edge = bindings.size, self.workgroup[1]
        rows = max(most // (width * edge), 1) * edge
        for top in range(0, height, rows):
            yield top, replace(bindings, size=(width, min(rows, height - top)))

    def run(
        self,
        encoder,
        entry: str,
        bindings: FrameBindings,
        groups: dict | None = None,
        /,
        **resources,
    ) -> None:
        """Record one dispatch over the image: group 0 from `bindings`, group 1 from `resources`.

        `groups`: the part of a buffer that holds how many workgroups it takes instead.
        """
        if resources.keys() != self._names:
            wanted, got = sorted(self._names), sorted(resources)
            raise ShaderError(f"{self.source.name} binds {wanted}, got {got}")
        every = bindings.resources | resources
        make = made_group if bindings.groups is None else bindings.groups.group
        pipeline = self.pipeline(entry)
        compute = encoder.begin_compute_pass(label=pipeline.label)
        compute.set_pipeline(pipeline)
        for group, layout in zip(self.groups, self.layouts, strict=True):
            bound = {index: every[name] for name, index in self._places[group].items()}
            compute.set_bind_group(group, make(self.device, layout, bound))
        if groups:
            compute.dispatch_workgroups_indirect(groups["buffer"], groups["offset"])
        else:
            compute.dispatch_workgroups(
                *(-(-n // edge) for n, edge in zip(bindings.size, self.workgroup, strict=True))
            )
        compute.end()


@lru_cache(maxsize=128)
def _module(device: wgpu.GPUDevice, name: str, text: str) -> wgpu.GPUShaderModule:
    return device.create_shader_module(code=text, label=name)


@lru_cache(maxsize=256)
def _kernel(device, file: str, texels: tuple, constants: tuple) -> Kernel:
    source = wgsl.load(file).with_texels(**dict(texels))
    if reads_storage(device):
        source = source.reading_storage(device.limits["max-storage-textures-per-shader-stage"])
    return Kernel(device, source, dict(constants))


def reads_storage(device: wgpu.GPUDevice) -> bool:
    """Return True for lavapipe, which reads storage textures in half the time of others.

    Not all browsers let shaders read them.
    """
    info = device.adapter_info
    return info["vendor"] == "llvmpipe" and info["backend_type"] == "Vulkan"


def kernel(
    device, file: str | Path, texels: dict[str, str] | None = None, **constants: float
) -> Kernel:
    """The compiled kernel of `wgsl/<file>`, kept for the next time it is asked for.

    `file`: also the absolute path of a shader elsewhere, which may include those of wgsl/ too.

    `texels` are the storage texel formats (`Output`), `constants` the overrides.
    """
    formats = tuple(sorted((texels or {}).items()))
    return _kernel(device, str(file), formats, tuple(sorted(constants.items())))


def stored(view: wgpu.GPUTextureView) -> str:
    """Texel format as which shaders may read the texture of `view` from storage, for `texels`.

    "given": it cannot be, as a caller's own texture need not be made for it.
    """
    texture = view.texture
    storable = bool(texture.usage & wgpu.TextureUsage.STORAGE_BINDING)
    return texture.format if storable and texture.mip_level_count == 1 else "given"


def forget_kernels() -> None:
    """Let go of all compiled kernels, and of constants: their device is lost."""
    _kernel.cache_clear()
    _module.cache_clear()
    forget_constants()


def _located(message: str, source: wgsl.WgslSource) -> str:
    """The compiler's message with lines of the joined text turned into file:line."""
    return re.sub(r"wgsl:(\d+):(\d+)", lambda m: f"{source.where(int(m[1]))}:{m[2]}", message)


def _layout_entry(b: wgsl.Binding, source: wgsl.WgslSource) -> dict:
    entry = {"binding": b.index, "visibility": wgpu.ShaderStage.COMPUTE}
    if b.space == "uniform":
        size = source.dtype(b.type).itemsize
        return entry | {"buffer": {"type": "uniform", "min_binding_size": size}}
    if b.space.startswith("storage"):
        kind = "storage" if "read_write" in b.space else "read-only-storage"
        return entry | {"buffer": {"type": kind}}
    dimension = {"view_dimension": "2d-array" if "_2d_array" in b.type else "2d"}
    if m := re.fullmatch(r"texture_storage_2d(?:_array)?<(\w+),\s*(\w+)>", b.type):
        access = {"write": "write-only", "read": "read-only"}[m[2]]
        return entry | {"storage_texture": {"format": m[1], "access": access} | dimension}
    if b.type == "sampler":
        return entry | {"sampler": {"type": "filtering"}}
    if b.type in ("texture_2d<f32>", "texture_2d_array<f32>"):
        sampled = re.search(rf"textureSample\w*\(\s*{b.name}\b", source.text)
        kind = {"sample_type": "float" if sampled else "unfilterable-float"}
        return entry | {"texture": kind | dimension}
    if b.type in ("texture_2d<u32>", "texture_2d_array<u32>"):
        return entry | {"texture": {"sample_type": "uint"} | dimension}
    raise ShaderError(f"{source.name}: cannot bind {b.name}: {b.type}")
