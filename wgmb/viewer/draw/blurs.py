"""The compiled methods that a State asks for, kept for the next time."""

from __future__ import annotations

from typing import Any

import wgpu

from ...errors import InputError
from ...methods import METHODS
from ...pipeline.arguments import SAMPLES
from ...pipeline.blur import Blur
from ...settings import ShutterSettings
from ...shutter import Shutter
from ..capabilities import Choices
from ..state.state import REFERENCE, State
from .adaptive import QUICK, Pace

REFERENCE_SAMPLES = 1024
_KEPT = 12


class Blurs:
    """Makes Blurs; `level` of the `pace` says how quick those are that are to be quick."""

    def __init__(self, device: wgpu.GPUDevice, choices: Choices, pace: Pace):
        self._device, self._choices, self._pace = device, choices, pace
        self._made: dict[tuple, Blur] = {}

    def __call__(self, slot: str, name: str, state: State, quick: int | None) -> Blur:
        """The Blur for `name` (a look, a method or the reference) in a slot.

        `quick`: the level of detail while something moves, 0 the finest; None: in full.
        """
        options: dict[str, Any] = dict(state.options)
        method, samples, shutter = state.method, state.sampling, shutter_of(state)
        if name == REFERENCE:
            options, method, samples = {}, self._choices.reference(state), REFERENCE_SAMPLES
            shutter = state.eye.shutter(state.fps) if state.eye else shutter
        elif name in self._choices.shows(state):
            options["show"] = name
        elif name == "sharp":
            options, method, shutter = {}, "volume", Shutter(0)
        elif name not in ("result", "perceived", state.method):
            options, method = {}, name
            samples = state.with_method(name).sampling
        if method not in (allowed := self._choices.methods(state)):
            raise InputError(f"method {method!r} is not available here; use {', '.join(allowed)}")
        if quick is not None:
            count = samples if isinstance(samples, int) else SAMPLES
            traced = "progress" in METHODS[method].uses
            fewer = min(count, QUICK) if traced else self._pace.samples(quick, count)
            samples = fewer if fewer < count else samples
        if quick:
            options |= getattr(METHODS[method], "quick", {})
        kept = slot, name == "perceived"  # each has the sums of a picture of its own
        key = (kept, method, samples, state.jitter, state.max_blur, *options.items())
        if key not in self._made:
            while len(self._made) >= _KEPT:
                del self._made[next(iter(self._made))]
            self._made[key] = Blur(
                method,  # pyright: ignore[reportArgumentType]
                samples=samples,  # pyright: ignore[reportArgumentType]
                jitter=state.jitter,
                max_blur=state.max_blur,
                device=self._device,
                **options,
            )
        blur = self._made[key] = self._made.pop(key)
        if blur.shutter != shutter:
            blur.shutter = shutter
        return blur


def shutter_of(state: State) -> Shutter:
    """The Shutter that the state describes."""
    return ShutterSettings(
        shutter=state.shutter,
        phase=state.phase,
        curve=state.curve,
        rolling=state.rolling,  # pyright: ignore[reportArgumentType]
        rolling_duration=state.rolling_duration,
    ).make()
