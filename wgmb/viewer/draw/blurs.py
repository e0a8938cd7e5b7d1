"""The compiled methods that a State asks for, kept for the next time."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace

import wgpu

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
_KEPT = 12


class Blurs:
    """Makes Blurs; `level` of the `pace` says how quick those are that are to be quick."""

    def __init__(self, device: wgpu.GPUDevice, choices: Choices, pace: Pace):
        self._device, self._choices, self._pace = device, choices, pace
        self._blurs: dict[tuple, Blur] = {}

    def __call__(
        self, slot: str, name: str, state: State, quick: int | None, stand_in: str | None = None
    ) -> Blur:
        """The Blur for `name` (a look, a method or the reference) in a slot.

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
        kept = slot, name == "perceived"  # each has the sums of a picture of its own
        key = kept, settings
        if key not in self._blurs:
            while len(self._blurs) >= _KEPT:
                del self._blurs[next(iter(self._blurs))]
            self._blurs[key] = settings.make(shutter, self._device)
        blur = self._blurs[key] = self._blurs.pop(key)
        if blur.shutter != shutter:
            blur.shutter = shutter
        return blur

    @contextmanager
    def kept_if_done(self, blur: Blur):
        """Forget the Blur if what it draws is dropped: what it keeps of a frame is not whole."""
        try:
            yield
        except DroppedError:
            self._blurs = {key: one for key, one in self._blurs.items() if one is not blur}
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
