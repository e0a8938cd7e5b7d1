"""Commands of a thread, in encoders of their own or gathered in one, and their submission."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, cast

import wgpu

from .device import claim


class Gathering:
    """Stands for the encoder of all that a thread gathers; after a submission, for a new one."""

    def __init__(self, device: wgpu.GPUDevice):
        self.device = device
        self._encoder: wgpu.GPUCommandEncoder | None = None

    def __getattr__(self, name: str) -> Any:
        if self._encoder is None:
            self._encoder = self.device.create_command_encoder(label="gathered")
        return getattr(self._encoder, name)

    def taken(self) -> list[wgpu.GPUCommandEncoder]:
        """Take the encoder of the commands so far; nothing if there are none."""
        encoder, self._encoder = self._encoder, None
        return [] if encoder is None else [encoder]


_of_thread: ContextVar[Gathering | None] = ContextVar("gathering", default=None)


def _gathering(device: wgpu.GPUDevice) -> Gathering | None:
    """The gathering of this thread, if it is for this device."""
    gathering = _of_thread.get()
    return gathering if gathering is not None and gathering.device is device else None


@contextmanager
def gathered(device: wgpu.GPUDevice) -> Generator[None, None, None]:
    """Gather what this thread records for a device into one `encoder`, and submit it at the end.

    Before the CPU reads or writes, it is submitted, too (`submit`, `before_writing`).
    """
    if _of_thread.get() is not None:
        yield  # the outer gathering takes these commands, too
        return
    before = _of_thread.set(Gathering(device))
    try:
        yield
        before_writing(device)
    except BaseException:
        with suppress(wgpu.GPUError):  # others count on these commands, unless the device is lost
            before_writing(device)
        raise
    finally:
        _of_thread.reset(before)


def encoder(device: wgpu.GPUDevice, label: str) -> wgpu.GPUCommandEncoder:
    """An encoder for commands to hand in: the common one where a thread gathers its commands."""
    gathering = _gathering(device)
    if gathering is None:
        return device.create_command_encoder(label=label)
    return cast(wgpu.GPUCommandEncoder, gathering)


def hand_in(device: wgpu.GPUDevice, encoder: wgpu.GPUCommandEncoder) -> None:
    """Submit the commands of an encoder: now, or with all others of a gathering."""
    if encoder is not _gathering(device):
        submit(device, encoder)


def before_writing(device: wgpu.GPUDevice) -> None:
    """Submit the gathered commands, if any: they may read memory that the CPU writes next."""
    gathering = _gathering(device)
    if gathering is not None and (encoders := gathering.taken()):
        submit(device, *encoders)


def submit(device: wgpu.GPUDevice, *encoders: wgpu.GPUCommandEncoder) -> None:
    """Submit the gathered commands, and then these encoders. The one place that submits."""
    claim()
    gathering = _gathering(device)
    if gathering is not None:
        others = (one for one in encoders if one is not gathering)
        encoders = *gathering.taken(), *others
    device.queue.submit([encoder.finish() for encoder in encoders])
