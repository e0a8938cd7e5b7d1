"""Output frames that input frames share: each is blurred over its cell, and all are summed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import wgpu

from .. import gpu
from ..exposure import Cell
from ..frame import Frame
from ..gpu.textures import TexturePool
from ..gpu.timing import Clock
from ..gpu_frame.residency import padded
from ..gpu_frame.views import FrameInShot, FrameViews
from ..gpu_frame.weighted_sum import WeightedSum
from .blur import Blur

_AT_ONCE = 2  # pictures that are summed in one pass
Part = tuple[Cell, FrameInShot | Frame, Blur]
"""A cell, its frame as textures or as arrays, which are uploaded, and its blur."""


class ExposureSum:
    """Makes one picture of the cells of an exposure (see exposure.py), on the device of its Blurs.

    The frame of a cell without motion, or whose shutter is closed, counts as it is.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._images = TexturePool(device)
        self._sum = WeightedSum(device)

    def texture(
        self, size: tuple[int, int], parts: Iterable[Part], timing: Clock | None = None
    ) -> wgpu.GPUTexture:
        """The exposure of pictures of `size` (width, height): linear light, rgba32float.

        The next call overwrites it. `timing`: see `draw`.
        """
        output = self._images.texture("exposure", size, "rgba32float")
        self.draw(parts, output, timing)
        return output

    def alone(self, part: Part) -> wgpu.GPUTexture:
        """The same of a single part that is all of the exposure, as it is blurred.

        It may be the frame's own light, and pixels may not be finite.
        """
        cell, frame, blur = part
        size = (frame.frame if isinstance(frame, FrameInShot) else frame).size
        with gpu.reported(size):
            return self._picture("part 0", cell, frame, blur, None)

    def draw(
        self,
        parts: Iterable[Part],
        output: wgpu.GPUTexture,
        timing: Clock | None = None,
    ) -> None:
        """Submit the exposure into `output`, rgba32float of the pictures' size.

        `timing` takes the time of the blur's passes, and may end the work before a cell. A Blur
        keeps the shutter of its last cell.
        """
        waiting: list[tuple[float, wgpu.GPUTexture]] = []
        begun = False
        with gpu.reported((output.size[0], output.size[1])):
            for cell, frame, blur in parts:
                if timing is not None:
                    timing.check()
                name = f"part {len(waiting)}"
                waiting.append((cell.share, self._picture(name, cell, frame, blur, timing)))
                if len(waiting) == _AT_ONCE:
                    self._add(waiting, output, begun)
                    begun, waiting = True, []
            if waiting:
                self._add(waiting, output, begun)

    def _add(
        self, waiting: list[tuple[float, wgpu.GPUTexture]], output: wgpu.GPUTexture, onto: bool
    ) -> None:
        encoder = gpu.encoder(self._device, "exposure")
        shares = np.array([share for share, _ in waiting], np.float32)
        self._sum.encode(encoder, [texture for _, texture in waiting], shares, output, onto=onto)
        gpu.hand_in(self._device, encoder)

    def _picture(
        self,
        name: str,
        cell: Cell,
        frame: FrameInShot | Frame,
        blur: Blur,
        timing: Clock | None,
    ) -> wgpu.GPUTexture:
        sharp = frame.frame if isinstance(frame, FrameInShot) else frame
        if "motion" not in sharp.has or cell.shutter.degrees <= 0:
            return self._sharp(name, sharp)
        blur.shutter = cell.shutter
        view = self._images.view(name, sharp.size, blur.output)
        if isinstance(frame, Frame):
            blur.draw(frame, view, timing)
            return view.texture
        encoder = gpu.encoder(self._device, "cell")
        blur.encode(
            encoder,
            frame.frame,
            view,
            prev=frame.prev,
            next=frame.next,
            number=frame.number,
            timing=timing,
        )
        gpu.hand_in(self._device, encoder)
        return view.texture

    def _sharp(self, name: str, frame: FrameViews | Frame) -> wgpu.GPUTexture:
        if isinstance(frame, FrameViews):
            return frame.color.texture
        color = padded(frame.color, 4, 1)
        texel = "rgba16float" if color.dtype == np.float16 else "rgba32float"
        return self._images.upload(f"{name} sharp", color, texel).texture
