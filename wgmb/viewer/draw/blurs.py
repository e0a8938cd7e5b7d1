"""The compiled methods that a State asks for, kept for the next time."""

from __future__ import annotations

from collections import OrderedDict
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import wgpu

from ... import gpu
from ...errors import InputError
from ...methods import METHODS
from ...pipeline.arguments import SAMPLES
from ...pipeline.blur import Blur
from ...settings import BlurSettings
from ...shutter import Shutter
from ..capabilities import Choices
from ..state.state import REFERENCE, State
from .adaptive import QUICK, Pace
from .portions import DroppedError

REFERENCE_SAMPLES = 1024
_KEPT = 6  # Blurs at most: of two images the quick one, the full one and its confidence
_MEMORY = 1 << 30  # bytes of them all, if that is more than the last two take
_IN_SOFTWARE = 1 << 28  # the same without a GPU, where wgpu gives no memory back to the system
_PIXEL = 240  # bytes that the largest, `gather`, takes for a pixel


@dataclass
class _Kept:
    blur: Blur
    bytes: int = 0
    """For the largest picture so far."""


class Blurs:
    """Makes Blurs, and keeps the last ones, as far as memory allows.

    `level` of the `pace` says how quick those are that are to be quick.
    """

    def __init__(self, device: wgpu.GPUDevice, choices: Choices, pace: Pace):
        self._device, self._choices, self._pace = device, choices, pace
        self._blurs: OrderedDict[tuple[Any, ...], _Kept] = OrderedDict()
        in_software = device.adapter_info["adapter_type"] == gpu.SOFTWARE
        self._most = _IN_SOFTWARE if in_software else _MEMORY

    def __call__(
        self,
        slot: str,
        name: str,
        state: State,
        size: tuple[int, int],
        quick: int | None,
        stand_in: str | None = None,
    ) -> Blur:
        """The Blur for `name` (a look, a method or the reference) in a slot, at a size [px].

        `quick`: the level of detail while something moves, 0 the finest; None: in full.
        `stand_in`: the method that is used instead.
        """
        settings, shutter = state.suited_blur, state.shutter.make()
        if name == REFERENCE:
            method = self._choices.reference(state)
            settings = _plain(settings, method, REFERENCE_SAMPLES)
            shutter = state.eye.shutter(state.fps) if state.eye else shutter
        elif name in self._choices.shows(state):
            settings = state.with_settings(show=name).suited_blur
        elif name == "sharp":
            settings, shutter = _plain(settings, "volume", settings.samples), Shutter(0)
        elif name not in ("result", "perceived", state.method):
            settings = state.with_method(name).suited_blur
        if stand_in is not None:
            settings = state.with_method(stand_in).suited_blur
        method = settings.method or ""
        if method not in (allowed := self._choices.methods(state)):
            raise InputError(f"method {method!r} is not available here; use {', '.join(allowed)}")
        if quick is not None:
            settings = self._quick(settings, quick)
        return self._kept_blur(slot, name, settings, shutter, size)

    def at_edges(self, slot: str, name: str, state: State, size: tuple[int, int]) -> Blur | None:
        """The Blur of pictures with edges of motion; None for options of another method."""
        try:
            return self._kept_blur(slot, name, state.blur.for_edges(), state.shutter.make(), size)
        except InputError:
            return None

    def _kept_blur(
        self, slot: str, name: str, settings: BlurSettings, shutter: Shutter, size: tuple[int, int]
    ) -> Blur:
        """The Blur of these settings, kept for the next time."""
        kept = slot, name == "perceived"  # each has the sums of a picture of its own
        key = kept, settings
        held = self._blurs.pop(key, None)
        size_in_memory = max(_PIXEL * size[0] * size[1], held.bytes if held else 0)
        self._make_room(size_in_memory)
        held = held or _Kept(settings.make(shutter, self._device))
        held.bytes = size_in_memory
        self._blurs[key] = held
        if held.blur.shutter != shutter:
            held.blur.shutter = shutter
        return held.blur

    def _make_room(self, coming: int) -> None:
        """Let go of those that were used longest ago, of all but one if need be."""

        def lacks_room() -> bool:
            held = sum(kept.bytes for kept in self._blurs.values())
            return len(self._blurs) >= _KEPT or held + coming > self._most

        while len(self._blurs) > 1 and lacks_room():
            self._blurs.popitem(last=False)

    @contextmanager
    def kept_if_done(self, *blurs: Blur | None):
        """Forget the Blurs if their drawing is dropped: their data of a frame are incomplete."""
        try:
            yield
        except DroppedError:
            for key in [key for key, held in self._blurs.items() if held.blur in blurs]:
                del self._blurs[key]
            raise

    def _quick(self, settings: BlurSettings, level: int) -> BlurSettings:
        """The same with fewer samples, and beyond the finest level with quick options."""
        method = METHODS[settings.method or ""]
        count = settings.samples if isinstance(settings.samples, int) else SAMPLES
        traced = "progress" in method.uses
        fewer = min(count, QUICK) if traced else self._pace.samples(level, count)
        if fewer < count:
            settings = replace(settings, samples=fewer)
        return replace(settings, **getattr(method, "quick", {})) if level else settings


def _plain(settings: BlurSettings, method: str | None, samples: int | str | None) -> BlurSettings:
    """The same with another method, all of whose options are as by default."""
    some = {"samples": samples, "jitter": settings.jitter, "max_blur": settings.max_blur}
    return BlurSettings(method=method, **some)  # pyright: ignore[reportArgumentType]
