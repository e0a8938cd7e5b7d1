"""The device: choosing an adapter, opening it, submitting work to it.

Nothing else in the project submits: an error inside a submission would end the process instead
of raising, so `submit` is the only place that does.
"""

from __future__ import annotations

import ctypes
import os
import re
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import wgpu
from wgpu.backends.wgpu_native.extras import set_instance_extras

from ..errors import DeviceError, GpuMemoryError, InputError
from .kernels import forget_kernels

SOFTWARE = "CPU"  # adapter_type of lavapipe, SwiftShader, WARP
_PREFERENCE = ("DiscreteGPU", "IntegratedGPU", "VirtualGPU", "Unknown", SOFTWARE)


def adapters() -> list[wgpu.GPUAdapter]:
    """Every adapter wgpu finds, OpenGL last, the fastest kind first.

    OpenGL is left out where this thread draws into a window with it: wgpu's own use of it would end
    the process.
    """
    if _draws_with_opengl():
        with suppress(RuntimeError):  # wgpu has been used already, and it is too late
            set_instance_extras(backends=["Vulkan", "Metal", "DX12"])
    listed = wgpu.gpu.enumerate_adapters_sync()

    def rank(adapter: wgpu.GPUAdapter) -> tuple[bool, int]:
        kind = adapter.info["adapter_type"]
        return _is_opengl(adapter), _PREFERENCE.index(kind) if kind in _PREFERENCE else 3

    return sorted(listed, key=rank)


def _draws_with_opengl() -> bool:
    """Return True if an OpenGL context of X is current in this thread."""
    for name in ("libGLX.so.0", "libGL.so.1"):
        try:
            library = ctypes.CDLL(name, mode=getattr(os, "RTLD_NOLOAD", 0))
            current = library.glXGetCurrentContext
        except (OSError, AttributeError):  # not loaded, so nobody uses it
            continue
        current.restype = ctypes.c_void_p
        if current():
            return True
    return False


def choose_adapter(name: str | None = None) -> wgpu.GPUAdapter:
    """The adapter whose number in `adapters()` or part of whose summary is `name`.

    Without a name, `WGMB_ADAPTER` is asked, then the fastest kind is taken. OpenGL is
    refused unless `name` asks for it ("opengl" is enough): it lacks features and precision.
    """
    name = name or os.environ.get("WGMB_ADAPTER") or ""
    listed = adapters()
    listing = "; ".join(f"{i}: {a.summary}" for i, a in enumerate(listed)) or "none at all"
    if name.isdigit():
        if int(name) >= len(listed):
            raise DeviceError(f"no adapter number {name}; found {listing}")
        return listed[int(name)]
    matching = [a for a in listed if name.lower() in a.summary.lower()]
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
            "(Debian, Ubuntu: mesa-vulkan-drivers) or select OpenGL with `device='opengl'`"
        )
    return matching[0]


def _is_opengl(adapter: wgpu.GPUAdapter) -> bool:
    return adapter.info["backend_type"].startswith("OpenGL")


def open_device(name: str | None = None) -> wgpu.GPUDevice:
    """Return the device of the chosen adapter with all its features, the same one every time.

    If the last one was lost, a new one is opened.
    """
    claim()
    name = name or os.environ.get("WGMB_ADAPTER") or ""
    try:
        _device(name).create_buffer(size=4, usage=wgpu.BufferUsage.COPY_DST)
    except wgpu.GPUError:
        _device.cache_clear()
        forget_kernels()
    return _device(name)


def second_device(device: wgpu.GPUDevice) -> wgpu.GPUDevice:
    """A new device on the adapter of another one: for a thread whose work that one must not await.

    Nothing is shared between the two.
    """
    claim()
    return _opened(choose_adapter(device.adapter.summary))


def borrow_device(device: wgpu.GPUDevice) -> wgpu.GPUDevice:
    """As `second_device`, but one that was given back, with all that is compiled for it, if there
    is one.
    """
    idle = _idle.setdefault(device.adapter.summary, [])
    while idle:
        other = idle.pop()
        with suppress(wgpu.GPUError):  # it was lost
            other.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_DST)
            return other
    return second_device(device)


def give_back(device: wgpu.GPUDevice) -> None:
    """Keep a borrowed device, which nothing uses any more, for the next one who borrows."""
    _idle.setdefault(device.adapter.summary, []).append(device)


_idle: dict[str, list[wgpu.GPUDevice]] = {}


@cache
def _device(name: str) -> wgpu.GPUDevice:
    return _opened(choose_adapter(name))


def _opened(adapter: wgpu.GPUAdapter) -> wgpu.GPUDevice:
    wanted = ("float32-filterable", "timestamp-query")
    limits = ("max-texture-dimension-2d", "max-buffer-size", "max-storage-buffer-binding-size")
    try:
        return adapter.request_device_sync(
            label="wgmb",
            required_features=[f for f in wanted if f in adapter.features],
            required_limits={k: adapter.limits[k] for k in limits},
        )
    except (RuntimeError, wgpu.GPUError) as error:
        raise DeviceError(f"{adapter.summary}: cannot open the device: {error}") from None


def check_size(device: wgpu.GPUDevice, width: int, height: int) -> None:
    """Refuse an image that the device cannot hold as one texture."""
    most = device.limits["max-texture-dimension-2d"]
    if not (0 < width <= most and 0 < height <= most):
        raise InputError(f"image is {width} x {height}, the adapter allows 1 to {most} per side")


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
            'that is spawned (multiprocessing.get_context("spawn")), or forked earlier'
        )
    _process = os.getpid()
    quicken_wgpu()


@contextmanager
def reported(size: tuple[int, int] | None = None):
    """Raise wgpu errors as wgmb errors (`translated`); every run and public call passes here."""
    try:
        yield
    except (wgpu.GPUError, AttributeError) as error:
        if (ours := translated(error, size)) is error:
            raise
        raise ours from None


def translated(error: Exception, size: tuple[int, int] | None = None) -> Exception:
    """The wgmb error that a wgpu error stands for; others as they are.

    GpuMemoryError names the `size` of the image that was worked on. DeviceError: the device was
    lost; the next `open_device` makes a new one.
    """
    text = " ".join(str(error).split())
    if isinstance(error, AttributeError) and _is_of_wgpu(error):
        text = "Parent device is lost"
    elif not isinstance(error, wgpu.GPUError):
        return error
    if "memory" in text.lower() or isinstance(error, wgpu.GPUOutOfMemoryError):
        needed = "{} x {} pixels".format(*size) if size else "this"
        return GpuMemoryError(f"too little GPU memory for {needed}")
    if "lost" not in text.lower():
        return error
    _device.cache_clear()
    forget_kernels()
    return DeviceError(f"the GPU device was lost: {text}")


def _is_of_wgpu(error: Exception) -> bool:
    """True if wgpu itself raised an error: it lets go of parts of a device that is destroyed."""
    at = error.__traceback__
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    return at is not None and at.tb_frame.f_globals.get("__name__", "").startswith("wgpu.")


# ---- wgpu's C types, parsed in a fiftieth of the time -----------------------------------------
# cffi parses the name of a C type the first time it is used, together with one line for every type
# of the whole header: 16 ms each time, nearly a second until a first frame is blurred. The parser
# asks only whether a word is a type, so the types that occur in the text are enough.


_TYPE = "typedef "


@cache
def quicken_wgpu() -> None:
    """Do this for wgpu; where it cannot be loaded, it says so itself once it is used."""
    with suppress(ImportError, OSError, RuntimeError):
        from wgpu.backends.wgpu_native import ffi

        quicken(ffi)


def quicken(ffi: Any) -> None:
    """Let a `cffi.FFI` parse every text with the types that occur in it alone.

    A cffi that is built in another way is left as it is.
    """
    parser: Any = getattr(ffi, "_parser", None)
    if not isinstance(getattr(parser, "_declarations", None), dict):
        return
    parse = getattr(parser, "_parse", None)
    if parse is None:
        return

    def parse_with_few(text: str) -> Any:  # cffi holds the lock of `ffi`
        whole = parser._declarations
        names = {_TYPE + word for word in re.findall(r"\w+", text)}
        parser._declarations = {name: whole[name] for name in names & whole.keys()}
        try:
            return parse(text)
        finally:
            parser._declarations = whole

    parser._parse = parse_with_few
