"""Motion that leads elsewhere and back from pixel to pixel, and is made smooth there."""

from __future__ import annotations

import wgpu

from .. import gpu
from ..gpu.textures import KeptViews, TexturePool

KEPT = 3  # motions: of a picture and its neighbours
_FOLDER = "video/ragged"


class RaggedMotion:
    """Smooths motions of pictures on a device where they are ragged.

    A search that finds nothing has a random motion at every pixel, and a blur would bring single
    pixels from there: specks. These motions are replaced by the mean of those around. An edge, at
    which motion changes once, stays as it is, and so does a line that is thin but straight.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._frame, self._views = gpu.SizeBindings(device), KeptViews()

    def __call__(
        self,
        index: int,
        motion: wgpu.GPUTexture,
        depth: wgpu.GPUTexture | None,
    ) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture | None]:
        """Motion to_prev, to_next [px] (rgba32float) and depth (r32float) of picture `index`.

        They are valid until those of `index` + KEPT are asked for.
        """
        size, place = (motion.size[0], motion.size[1]), index % KEPT
        images, frame = self._images, self._frame(size)
        measured = images.view("measured", size, "rgba32float")
        none = images.view("no depth", (1, 1), "r32float")
        made = images.texture(f"motion {place}", size, "rgba32float")
        made_depth = images.texture(f"depth {place}", (1, 1) if depth is None else size, "r32float")
        ways = self._views.of(motion)
        encoder = gpu.encoder(self._device, "ragged motion")
        measure = gpu.kernel(self._device, f"{_FOLDER}/measure.wgsl")
        measure.run(encoder, "main", frame, motion=ways, output=measured)
        gpu.kernel(self._device, f"{_FOLDER}/smooth.wgsl").run(
            encoder,
            "main",
            frame,
            motion=ways,
            depth=none if depth is None else self._views.of(depth),
            measured=measured,
            motion_out=images.view_of(made),
            depth_out=images.view_of(made_depth),
        )
        gpu.hand_in(self._device, encoder)
        return made, None if depth is None else made_depth
