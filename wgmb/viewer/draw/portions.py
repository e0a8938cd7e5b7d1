"""Work in portions: every pass is submitted alone, and the work may be dropped after each.

The passes are the same, in the same order, so that the picture has the same bits.
"""

from __future__ import annotations

from collections.abc import Callable

import wgpu

from ...gpu.timing import WallClock


class DroppedError(Exception):
    """The drawing in progress is not needed any more."""


class Portions(WallClock):
    """A clock of passes that raises DroppedError once `wanted` returns False."""

    def __init__(self, device: wgpu.GPUDevice, wanted: Callable[[], bool]):
        super().__init__(device)
        self._wanted = wanted
        self.empty = 0.0  # one was not measured before every pass; to submit it takes time too

    def take(self, label: str, encoder: wgpu.GPUCommandEncoder) -> None:
        """Submit the one pass in `encoder`, and time it."""
        self._took.append(self._run(encoder))
        self.labels.append(label)
        self.check()

    def check(self) -> None:
        """DroppedError if nobody wants the work any more."""
        if not self._wanted():
            self.read()
            raise DroppedError
