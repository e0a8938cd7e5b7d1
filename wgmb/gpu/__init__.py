"""The thin layer over wgpu: devices, kernels, textures, timing. It is independent of blur."""

from .device import (
    SOFTWARE,
    adapters,
    check_size,
    choose_adapter,
    claim,
    open_device,
    reported,
    second_device,
    submit,
    texel,
)
from .kernels import FrameBindings, Kernel, kernel

__all__ = [
    "SOFTWARE",
    "FrameBindings",
    "Kernel",
    "adapters",
    "check_size",
    "choose_adapter",
    "claim",
    "kernel",
    "open_device",
    "reported",
    "second_device",
    "submit",
    "texel",
]
