"""Work in portions: every pass is submitted alone, and between two the work may be dropped.

The passes are the same, in the same order, so that the picture has the same bits.
"""

from __future__ import annotations

from collections.abc import Callable

import wgpu

from ...gpu.timing import WallClock


class DroppedError(Exception):
    """Nobody wants what was being drawn any more."""


class Portions(WallClock):
    """A clock of passes that raises DroppedError after one once `wanted` returns False."""

    def __init__(self, device: wgpu.GPUDevice, wanted: Callable[[], bool]):
        super().__init__(device)
        self._wanted = wanted

    def take(self, label: str, encoder) -> None:
        """Submit the one pass in `encoder`, and time it."""
        self._took.append(self._run(encoder))
        self.labels.append(label)
        if not self._wanted():
            self.read()
            raise DroppedError
