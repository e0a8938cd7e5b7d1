"""Motion of pictures without vectors, searched on the GPU."""

from __future__ import annotations

import numpy as np
import wgpu

from .. import gpu
from ..errors import InputError, did_you_mean
from .passes import FlowPasses
from .pyramid import level_sizes
from .shot import EFFORTS, Load, Shot


class Flow:
    """Motion from successive pictures alone: large, hidden on one side, turning and zooming.

    For each pixel one sloped displacement is searched that explains the frame before and the frame
    after, one of which may hide it: a full search on the coarsest level, then sweeps (Barnes et
    al., "PatchMatch", 2009; planes: Bleyer, Rhemann and Rother, "PatchMatch Stereo", 2011) on ever
    finer ones. Pixels that are not found again move as the surface they belong to.

    `quality`: "best", "fast", which ends at half the size, or "draft", which searches pictures of
    at most 440 px along the longer side. `device`: your own wgpu device, the name of an adapter, or
    None for the best one.
    """

    def __init__(self, *, quality: str = "best", device: wgpu.GPUDevice | str | None = None):
        if quality not in EFFORTS:
            known = ", ".join(EFFORTS)
            hint = did_you_mean(quality, EFFORTS)
            raise InputError(f"no flow quality {quality!r}; available: {known}{hint}")
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        self._effort = EFFORTS[quality]

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion may depend on: one more for every level."""
        return 1 + len(level_sizes(self._effort.searched_size(size)))

    def shot(self, load: Load, depth: bool = True) -> Shot:
        """Flow of the frames of a shot.

        `load(number)`: the picture (height, width, 3 or 4), linear, as an array, or as a texture of
        this device that is read at once; None before the shot's first frame and after its last.
        The motion of a frame depends on its number and on `load`, and on nothing that was asked
        for before.
        """
        return Shot(FlowPasses(self.device), load, self._effort)

    def __call__(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Motion (height, width, 4) to_prev, to_next [px] of `here`, and its depth.

        Pictures are (height, width, 3 or 4) float, linear. `prev` or `next` is None at the ends of
        a shot. Depth (height, width) is an order only: smaller is nearer.
        """
        pictures = {-1: prev, 0: here, 1: next}
        found = self.shot(pictures.get)(0)
        if found is None:
            raise InputError("here must be a picture, got None")
        return found
