"""The thin layer over wgpu: devices, kernels, textures, timing. It is independent of blur."""

from .bind_groups import BindGroups, constant
from .commands import Gathering, before_writing, encoder, gathered, hand_in, submit
from .device import (
    SOFTWARE,
    adapters,
    borrow_device,
    check_size,
    choose_adapter,
    claim,
    give_back,
    open_device,
    reported,
    second_device,
    texel,
    translated,
)
from .kernels import BufferPart, FrameBindings, Kernel, Pass, SizeBindings, kernel, stored, uniform
from .priority import lower_priority, yielding
from .tape import Tape, Tapes

__all__ = [
    "SOFTWARE",
    "BindGroups",
    "BufferPart",
    "FrameBindings",
    "Gathering",
    "Kernel",
    "Pass",
    "SizeBindings",
    "Tape",
    "Tapes",
    "adapters",
    "before_writing",
    "borrow_device",
    "check_size",
    "choose_adapter",
    "claim",
    "constant",
    "encoder",
    "gathered",
    "give_back",
    "hand_in",
    "kernel",
    "lower_priority",
    "open_device",
    "reported",
    "second_device",
    "stored",
    "submit",
    "texel",
    "translated",
    "uniform",
    "yielding",
]
