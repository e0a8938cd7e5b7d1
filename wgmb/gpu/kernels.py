"""Kernels: one compiled WGSL file each, its passes recorded by the names of its bindings.

A caller says what a pass reads and writes; the kernel makes the rest by its WGSL: uniforms from
their fields, buffers from arrays, stand-ins for None, and workgroups from a size. `Kernel.prepared`
is where every dispatch of wgmb passes through, as a `Pass` that can be recorded more than once.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import wgpu

from ..errors import ShaderError
from . import wgsl
from .bind_groups import BindGroups, Resource, constant, forget_constants, made_group, stand_in

Size = tuple[int, int]
BufferPart = dict[str, Any]
"""A part of a buffer: "buffer", "offset" and "size" [bytes], as wgpu takes it."""
Texels = Mapping[str, Any]
"""Formats by the aliases of a file, and resources by the names of its bindings."""
_MADE = wgpu.GPUTextureView, wgpu.GPUBuffer, wgpu.GPUSampler


@dataclass(frozen=True)
class FrameBindings:
    """Bindings shared by all passes of a frame: group 0 of every shader."""

    size: tuple[int, int]  # width, height [px]
    resources: dict[str, wgpu.GPUBuffer]  # by binding name
    window: tuple[int, int, int, int] = (0, 0, 0, 0)  # x, y in the display window, its size [px]
    groups: BindGroups | None = None  # where bind groups are kept; None: each is made anew

    def group(
        self,
        device: wgpu.GPUDevice,
        layout: wgpu.GPUBindGroupLayout,
        places: Mapping[str, int],
        resources: Mapping[str, Resource] | None = None,
    ) -> wgpu.GPUBindGroup:
        """The group of `layout` that binds resources, by default these, at the indices `places`."""
        every = self.resources if resources is None else resources
        make = made_group if self.groups is None else self.groups.group
        return make(device, layout, {index: every[name] for name, index in places.items()})

    @classmethod
    def of_size(
        cls, device: wgpu.GPUDevice, size: tuple[int, int], groups: BindGroups | None = None
    ) -> FrameBindings:
        """For passes that need no more of a frame than its size [px]."""
        frame = uniform(device, "common/frame.wgsl", "Frame", size=size)
        return cls(size, {"frame": frame}, groups=groups)


class SizeBindings:
    """Bindings for passes that need no more of a frame than its size; bind groups are kept.

    The bindings of a size are the same from call to call.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._groups = device, BindGroups()
        self._sizes: dict[tuple[int, int], FrameBindings] = {}

    def __call__(self, size: tuple[int, int]) -> FrameBindings:
        """Bindings of a frame of a size [px]."""
        if size not in self._sizes:
            self._sizes[size] = FrameBindings.of_size(self._device, size, self._groups)
        return self._sizes[size]


def uniform(device: wgpu.GPUDevice, file: str, struct: str, **values: Any) -> wgpu.GPUBuffer:
    """A struct of a file in `wgsl/` as a uniform buffer, with these values, the others 0."""
    return constant(device, struct, wgsl.filled(wgsl.load(file).dtype(struct), values))


@dataclass(frozen=True)
class Pass:
    """One dispatch and all that it binds: it may be recorded again, as long as these stay."""

    kernel: Kernel
    entry: str
    resources: Mapping[str, Resource]
    """By the names of the bindings, all groups together."""
    groups: tuple[wgpu.GPUBindGroup, ...]
    workgroups: Size | BufferPart
    """Their number across and down; or the part of a buffer that holds it."""

    def record(self, encoder: wgpu.GPUCommandEncoder | Recorder) -> None:
        """Record it."""
        if isinstance(encoder, Recorder):
            encoder.add(self)
            return
        pipeline = self.kernel.pipeline(self.entry)
        compute = encoder.begin_compute_pass(label=pipeline.label)
        compute.set_pipeline(pipeline)
        for index, group in enumerate(self.groups):
            compute.set_bind_group(index, group)
        if isinstance(self.workgroups, tuple):
            compute.dispatch_workgroups(*self.workgroups)
        else:
            compute.dispatch_workgroups_indirect(
                self.workgroups["buffer"], self.workgroups["offset"]
            )
        compute.end()


class Recorder:
    """Takes the place of a command encoder, and passes as they are."""

    def add(self, one: Pass) -> None:
        """Record a pass."""
        raise NotImplementedError


class Kernel:
    """All entry points of one WGSL file, sharing the same bind groups.

    `kernel.run(encoder, "main", bindings, color=..., output=...)` binds by the names used in the
    shader; a missing or unknown name is an error before any GPU work.
    """

    def __init__(
        self,
        device: wgpu.GPUDevice,
        source: wgsl.WgslSource,
        constants: dict[str, float] | None = None,
    ):
        self.device, self.source, self.constants = device, source, constants or {}
        self.bindings = {b.name: b for b in source.bindings()}
        self.workgroup = source.integer("WG_X"), source.integer("WG_Y")
        try:
            self._module = _module(device, source.name, source.text)
        except wgpu.GPUError as error:
            if "device is lost" in str(error):  # no fault of the shader, see device.translated
                raise
            raise ShaderError(_located(str(error), source)) from None
        self._names = {b.name for b in self.bindings.values() if b.group > 0}
        self.groups = range(1 + max((b.group for b in self.bindings.values()), default=-1))
        self.layouts = [self._group_layout(group) for group in self.groups]
        self._layout = device.create_pipeline_layout(bind_group_layouts=self.layouts)
        self._structs = {
            b.name: source.dtype(b.type) for b in self.bindings.values() if b.space == "uniform"
        }
        self._pipelines: dict[str, wgpu.GPUComputePipeline] = {}
        self.places = [
            {b.name: b.index for b in self.bindings.values() if b.group == group}
            for group in self.groups
        ]

    def _group_layout(self, group: int) -> wgpu.GPUBindGroupLayout:
        """The layout of a group; kernels share that of the frame, and with it their groups."""
        own = [b for b in self.bindings.values() if b.group == group]
        entries = [_layout_entry(b, self.source) for b in own]
        if group == 0:
            return _frame_layout(self.device, json.dumps(entries))
        label = f"{self.source.name}:{group}"
        return self.device.create_bind_group_layout(label=label, entries=entries)

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

    def bands(self, size: Size, most: int) -> Iterator[tuple[int, Size]]:
        """An image of `size` as bands of whole rows, of about `most` pixels each.

        Yields the first row of each [px], and the size of a dispatch over it. Without a GPU, a
        dispatch is not interrupted, and takes seconds for a large image.
        """
        (width, height), edge = size, self.workgroup[1]
        rows = max(most // (width * edge), 1) * edge
        for top in range(0, height, rows):
            yield top, (width, min(rows, height - top))

    def run(
        self,
        encoder: wgpu.GPUCommandEncoder | Recorder,
        entry: str,
        bindings: FrameBindings,
        over: Size | BufferPart | None = None,
        /,
        **resources: Any,
    ) -> None:
        """Record one dispatch: group 0 from `bindings`, group 1 from `resources`.

        `over`: invocations across and down, by default those of the image; or the part of a buffer
        that holds how many workgroups there are. A uniform may be the fields of its struct, as a
        mapping or a dataclass: those that are not named are 0, as are the last elements of a vector
        or an array that is given fewer. A storage buffer may be an array. None: a black texture of
        one pixel, or a buffer of zeros, that the pass does not use.
        """
        self.prepared(entry, bindings, over, **resources).record(encoder)

    def prepared(
        self,
        entry: str,
        bindings: FrameBindings,
        over: Size | BufferPart | None = None,
        /,
        **resources: Any,
    ) -> Pass:
        """The same as a Pass, not recorded yet."""
        if resources.keys() != self._names:
            wanted, got = sorted(self._names), sorted(resources)
            raise ShaderError(f"{self.source.name} binds {wanted}, got {got}")
        every: dict[str, Resource] = dict(bindings.resources)
        for name, value in resources.items():
            every[name] = value if isinstance(value, _MADE) else self._resource(name, value)
        groups = tuple(
            bindings.group(self.device, layout, places, every)
            for layout, places in zip(self.layouts, self.places, strict=True)
        )
        if over is None or isinstance(over, tuple):
            across, down = over or bindings.size
            edges = self.workgroup
            over = -(-across // edges[0]), -(-down // edges[1])
        return Pass(self, entry, every, groups, over)

    def _resource(self, name: str, value: Any) -> Resource:
        """The resource that stands for a value."""
        binding = self.bindings[name]
        if binding.space == "uniform":
            return constant(self.device, name, self._struct(name, {} if value is None else value))
        if value is None:
            return stand_in(self.device, name, binding.space, binding.type)
        if isinstance(value, np.ndarray) and binding.space.startswith("storage"):
            return constant(self.device, name, value, wgpu.BufferUsage.STORAGE)
        if isinstance(value, Mapping) and "buffer" in value:
            return value
        raise ShaderError(f"{self.source.name}: cannot bind {type(value).__name__} as {name}")

    def _struct(self, name: str, value: Any) -> np.ndarray:
        """The struct of a uniform from its fields, or as it is."""
        dtype = self._structs[name]
        if isinstance(value, np.ndarray):
            if value.dtype != dtype.base or value.nbytes != dtype.itemsize:
                raise ShaderError(f"{self.source.name}: {name} is {dtype}, got {value.dtype}")
            return value
        fields = vars(value) if is_dataclass(value) else value
        if not isinstance(fields, Mapping) or not fields.keys() <= set(dtype.names or ()):
            wanted = list(dtype.names or ())
            got = sorted(fields) if isinstance(fields, Mapping) else fields
            raise ShaderError(f"{self.source.name}: {name} has the fields {wanted}, got {got}")
        return wgsl.filled(dtype, fields)


@lru_cache(maxsize=128)
def _module(device: wgpu.GPUDevice, name: str, text: str) -> wgpu.GPUShaderModule:
    return device.create_shader_module(code=text, label=name)


@lru_cache(maxsize=64)
def _frame_layout(device: wgpu.GPUDevice, entries: str) -> wgpu.GPUBindGroupLayout:
    return device.create_bind_group_layout(label="frame", entries=json.loads(entries))


@lru_cache(maxsize=256)
def _kernel(
    device: wgpu.GPUDevice,
    file: str,
    texels: tuple[tuple[str, str], ...],
    constants: tuple[tuple[str, float], ...],
) -> Kernel:
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
    device: wgpu.GPUDevice,
    file: str | Path,
    texels: Texels | None = None,
    **constants: float,
) -> Kernel:
    """The compiled kernel of `wgsl/<file>`, kept for the next time it is asked for.

    `file`: also the absolute path of a shader elsewhere, which may include those of wgsl/ too.

    `texels`: the storage texel formats (`Output`); also the resources to bind, as the format of a
    texture that is "stored as given" is that of its binding. `constants`: the overrides.
    """
    formats = []
    if texels:
        flexible = wgsl.load(str(file)).flexible()
        for name, texel in sorted(texels.items()):
            if isinstance(texel, str):
                formats.append((name, texel))
            elif name in flexible:
                formats.append((name, stored(texel)))
    return _kernel(device, str(file), tuple(formats), tuple(sorted(constants.items())))


def stored(view: wgpu.GPUTextureView | None) -> str:
    """Texel format as which shaders may read the texture of `view` from storage, for `texels`.

    "given": it cannot be, as a caller's own texture need not be made for it.
    """
    if view is None:
        return "given"
    texture = view.texture
    storable = bool(texture.usage & wgpu.TextureUsage.STORAGE_BINDING)
    return texture.format if storable and texture.mip_level_count == 1 else "given"


def forget_kernels() -> None:
    """Let go of all compiled kernels, and of constants: their device is lost."""
    _kernel.cache_clear()
    _module.cache_clear()
    _frame_layout.cache_clear()
    forget_constants()


def _located(message: str, source: wgsl.WgslSource) -> str:
    """The compiler's message with lines of the joined text turned into file:line."""
    return re.sub(r"wgsl:(\d+):(\d+)", lambda m: f"{source.where(int(m[1]))}:{m[2]}", message)


def _layout_entry(b: wgsl.Binding, source: wgsl.WgslSource) -> dict[str, Any]:
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
