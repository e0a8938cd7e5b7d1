"""Numbers behind the first image: its light, the passes that it is made from, its confidence."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import wgpu

from ...gpu.textures import TexturePool
from ...gpu.timing import Clock
from ..capabilities import Choices
from ..state.state import State
from .blurs import Blurs
from .frame_status import FrameStatus
from .slot import Slot

_SURE = "confidence"  # what gather shows of itself
_PASSES = {"depth": "depth", "motion": "velocity"}  # by the look that shows them


class Inspected:
    """The arrays of an image, kept as long as it stays."""

    def __init__(
        self, device: wgpu.GPUDevice, choices: Choices, blurs: Blurs, timing: Clock | None
    ):
        self._device, self._images, self._timing = device, TexturePool(device), timing
        self._choices, self._blurs = choices, blurs
        self._kept: tuple[tuple[Any, ...], dict[str, np.ndarray]] = ((), {})

    def __call__(
        self, state: State, looks: Collection[str], image: Slot, report: FrameStatus
    ) -> dict[str, np.ndarray]:
        """The arrays (height, width, channels) of a slot's image, by name.

        A new image is shown first, without them, and then without its confidence, which takes as
        long as the image; the report then says that there is more to do.
        """
        key = image.key, image.fine, image.done, state.inspect
        is_known = self._kept[0] == key
        if not is_known and report.changed:
            report.busy = True
            return {}
        lacks = state.inspect and state.look == "result" and _SURE in looks
        if not is_known:
            self._kept = key, self._arrays(state, looks, image)
            report.busy = lacks
        elif lacks and _SURE not in self._kept[1]:
            self._kept = key, self._kept[1] | {_SURE: self._confidence(state, image)}
        return self._kept[1]

    def _arrays(self, state: State, looks: Collection[str], image: Slot) -> dict[str, np.ndarray]:
        assert image.texture is not None
        arrays = {"light": self._array(image.texture)}
        subject = self._choices.subject(state)
        if any(look in looks for look in _PASSES.values()):
            subject.look_at(state, image.texture.size[:2], 1)
            for name, texture in subject.passes().items():
                if _PASSES.get(name) in looks:
                    arrays[name] = self._array(texture)
        return arrays

    def _confidence(self, state: State, image: Slot) -> np.ndarray:
        assert image.texture is not None
        size, antialias = image.texture.size[:2], image.fine[1]
        subject = self._choices.subject(state)
        subject.look_at(state, size, antialias)
        blur = self._blurs("first", _SURE, state, size, None)
        texture = self._images.texture(_SURE, size, blur.output)
        with self._blurs.kept_if_done(blur):
            subject.draw(blur, texture, (0, float("inf")), self._timing)
        return self._array(texture)

    def _array(self, texture: wgpu.GPUTexture) -> np.ndarray:
        encoder = self._device.create_command_encoder(label="inspected")
        return self._images.download(encoder, texture).astype(np.float32, copy=False)
