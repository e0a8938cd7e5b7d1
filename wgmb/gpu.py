"""The thin layer over wgpu: choosing a device, one Kernel per shader file.

Nothing else in the project touches the queue: `submit` is the only place that does,
because an error inside it would end the process instead of raising.
"""

from __future__ import annotations

import os
import re
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, lru_cache

import wgpu

from . import shader
from .errors import DeviceError, GpuMemoryError, InputError, ShaderError

SOFTWARE = "CPU"  # adapter_type of lavapipe, SwiftShader, WARP
_PREFERENCE = ("DiscreteGPU", "IntegratedGPU", "VirtualGPU", "Unknown", SOFTWARE)

# ---- device ---------------------------------------------------------------------------------


def adapters() -> list[wgpu.GPUAdapter]:
    """Every adapter wgpu finds, OpenGL last, the fastest kind first."""
    if not os.environ.get("XDG_RUNTIME_DIR"):  # Mesa complains on stderr without one
        os.environ["XDG_RUNTIME_DIR"] = tempfile.gettempdir()
    found = wgpu.gpu.enumerate_adapters_sync()

    def rank(adapter: wgpu.GPUAdapter) -> tuple[bool, int]:
        kind = adapter.info["adapter_type"]
        return _is_opengl(adapter), _PREFERENCE.index(kind) if kind in _PREFERENCE else 3

    return sorted(found, key=rank)


def choose_adapter(name: str | None = None) -> wgpu.GPUAdapter:
    """The adapter whose number in `adapters()` or part of whose summary is `name`.

    Without a name, `WGMB_ADAPTER` is asked, then the fastest kind is taken. OpenGL is
    refused unless `name` asks for it ("opengl" is enough): it lacks features and precision.
    """
    name = name or os.environ.get("WGMB_ADAPTER") or ""
    found = adapters()
    listing = "; ".join(f"{i}: {a.summary}" for i, a in enumerate(found)) or "none at all"
    if name.isdigit():
        if int(name) >= len(found):
            raise DeviceError(f"no adapter number {name}; found {listing}")
        return found[int(name)]
    matching = [a for a in found if name.lower() in a.summary.lower()]
    if not matching:
        hint = "" if name else "; install a Vulkan driver (Debian, Ubuntu: mesa-vulkan-drivers)"
        raise DeviceError(
            f"no adapter matches {name!r}; found {listing}{hint}"
            if name
            else f"no GPU adapter; found {listing}{hint}"
        )
    if _is_opengl(matching[0]) and "opengl" not in name.lower():
        raise DeviceError(
            f"only OpenGL adapters found ({listing}); install a Vulkan driver "
            "(Debian, Ubuntu: mesa-vulkan-drivers) or ask for it with --adapter opengl"
        )
    return matching[0]


def _is_opengl(adapter: wgpu.GPUAdapter) -> bool:
    return adapter.info["backend_type"].startswith("OpenGL")


def open_device(name: str | None = None) -> wgpu.GPUDevice:
    """A device of the chosen adapter with all it can do; the same one every time.

    A new one where the last one was lost.
    """
    claim()
    name = name or os.environ.get("WGMB_ADAPTER") or ""
    try:
        _device(name).create_buffer(size=4, usage=wgpu.BufferUsage.COPY_DST)
    except wgpu.GPUError:
        _device.cache_clear()
        _kernel.cache_clear()
    return _device(name)


@cache
def _device(name: str) -> wgpu.GPUDevice:
    adapter = choose_adapter(name)
    wanted = ("float32-filterable", "timestamp-query")
    limits = ("max-texture-dimension-2d", "max-buffer-size", "max-storage-buffer-binding-size")
    try:
        return adapter.request_device_sync(
            label="wgmb",
            required_features=[f for f in wanted if f in adapter.features],
            required_limits={k: adapter.limits[k] for k in limits},
        )
    except (RuntimeError, wgpu.GPUError) as error:
        raise DeviceError(f"{adapter.summary}: no device: {error}") from None


def check_size(device: wgpu.GPUDevice, width: int, height: int) -> None:
    """Refuse an image that the device cannot hold as one texture."""
    most = device.limits["max-texture-dimension-2d"]
    if not (0 < width <= most and 0 < height <= most):
        raise InputError(f"image is {width} x {height}, the adapter takes 1 to {most} a side")


def texel(device: wgpu.GPUDevice, channels: int) -> str:
    """Format of a float texture that a linear sampler may read: f32, or f16 where it must be."""
    bits = 32 if "float32-filterable" in device.features else 16
    return {1: f"r{bits}float", 2: f"rg{bits}float", 4: f"rgba{bits}float"}[channels]


_process: int | None = None  # the one that has a device


def claim() -> None:
    """Note that this process has a device.

    DeviceError where it was forked from one that has: GPU drivers do not survive a fork.
    """
    global _process
    if _process not in (None, os.getpid()):
        raise DeviceError(
            "this process was forked from one that has a GPU device; GPU work needs a process "
            'that is spawned, or forked before (multiprocessing.get_context("spawn"))'
        )
    _process = os.getpid()


@contextmanager
def reported(size: tuple[int, int]):
    """Turn what wgpu raises while it works on a picture of `size` into errors of ours.

    GpuMemoryError names the size. DeviceError: the device was lost; the next `open_device`
    makes a new one.
    """
    try:
        yield
    except wgpu.GPUError as error:
        text = " ".join(str(error).split())
        if "memory" in text.lower() or isinstance(error, wgpu.GPUOutOfMemoryError):
            width, height = size
            raise GpuMemoryError(f"too little GPU memory for {width} x {height} pixels") from None
        if "lost" in text.lower():
            _device.cache_clear()
            _kernel.cache_clear()
            raise DeviceError(f"the GPU device was lost: {text}") from None
        raise


def submit(device: wgpu.GPUDevice, *encoders: wgpu.GPUCommandEncoder) -> None:
    """Run what was recorded. The one place that submits."""
    claim()
    device.queue.submit([encoder.finish() for encoder in encoders])


# ---- kernels --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Given:
    """What every pass of a frame is given: group 0 of its shader."""

    size: tuple[int, int]  # width, height [px]
    resources: dict[str, wgpu.GPUBuffer]  # by binding name


class Kernel:
    """All entry points of one WGSL file, sharing the same bind groups.

    `kernel.run(encoder, "main", given, color=..., output=...)` binds by the names
    used in the shader; a missing or unknown name is an error before any GPU work.
    """

    def __init__(
        self,
        device: wgpu.GPUDevice,
        source: shader.Source,
        constants: dict[str, float] | None = None,
    ):
        self.device, self.source = device, source
        self.bindings = {b.name: b for b in source.bindings()}
        self.workgroup = int(source.constant("WG_X")), int(source.constant("WG_Y"))
        try:
            module = device.create_shader_module(code=source.text, label=source.name)
        except wgpu.GPUError as error:
            raise ShaderError(_located(str(error), source)) from None
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
        layout = device.create_pipeline_layout(bind_group_layouts=self.layouts)
        self.pipelines = {
            name: device.create_compute_pipeline(
                label=f"{source.name}:{name}",
                layout=layout,
                compute={"module": module, "entry_point": name, "constants": constants or {}},
            )
            for name in source.entry_points()
        }

    def run(self, encoder, entry: str, given: Given, groups: dict | None = None, /, **own) -> None:
        """Record one dispatch over the image: group 0 from `given`, group 1 from `own`.

        `groups`: the part of a buffer that holds how many workgroups it takes instead.
        """
        wanted = {name for name, b in self.bindings.items() if b.group > 0}
        if own.keys() != wanted:
            raise ShaderError(f"{self.source.name} binds {sorted(wanted)}, got {sorted(own)}")
        resources = given.resources | own
        compute = encoder.begin_compute_pass(label=f"{self.source.name}:{entry}")
        compute.set_pipeline(self.pipelines[entry])
        for group, layout in zip(self.groups, self.layouts, strict=True):
            entries = [
                {"binding": b.index, "resource": _resource(resources[name])}
                for name, b in self.bindings.items()
                if b.group == group
            ]
            bound = self.device.create_bind_group(layout=layout, entries=entries)
            compute.set_bind_group(group, bound)
        if groups:
            compute.dispatch_workgroups_indirect(groups["buffer"], groups["offset"])
        else:
            compute.dispatch_workgroups(
                *(-(-n // edge) for n, edge in zip(given.size, self.workgroup, strict=True))
            )
        compute.end()


@lru_cache(maxsize=256)
def _kernel(device, file: str, texels: tuple, constants: tuple) -> Kernel:
    return Kernel(device, shader.load(file).with_texels(**dict(texels)), dict(constants))


def kernel(device, file: str, texels: dict[str, str] | None = None, **constants: float) -> Kernel:
    """The compiled kernel of `wgsl/<file>`, kept for the next time it is asked for.

    `texels` are the storage texel formats (`Output`), `constants` the overrides.
    """
    formats = tuple(sorted((texels or {}).items()))
    return _kernel(device, file, formats, tuple(sorted(constants.items())))


def _located(message: str, source: shader.Source) -> str:
    """The compiler's message with lines of the joined text turned into file:line."""
    return re.sub(r"wgsl:(\d+):(\d+)", lambda m: f"{source.where(int(m[1]))}:{m[2]}", message)


def _resource(given):
    if isinstance(given, wgpu.GPUBuffer):
        return {"buffer": given, "offset": 0, "size": given.size}
    return given


def _layout_entry(b: shader.Binding, source: shader.Source) -> dict:
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
