"""Reconstruction from one frame: taps weighted by visibility."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import wgpu

from .. import gpu
from ..extent import Spread
from ..gpu.textures import ScratchBuffer, TexturePool
from .contract import Inputs, View
from .options import MethodOptions

LONGEST = (40, 9)  # blur to either side, and tile: so many pixels, or the height over this


def edge_of(height: int) -> int:
    """Edge of a tile [px] in pictures of this height [px]."""
    return max(LONGEST[0], height // LONGEST[1])


class Tiles:
    """Taps along the fastest motion of the tiles around, and along the pixel's own.

    The filter of Guertin, McGuire and Nowrouzezahrai, "A Fast and Stable Feature-Aware Motion
    Blur Filter" (2014): tile maximum, neighbour maximum, and three weights per tap by motion and
    depth (after McGuire et al. 2012). Times are the shutter's, so that any curve and phase
    holds; a streak reaches at most a tile to either side: 40 px, or a ninth of the height.
    `variant`: "even" divides every weight by its value under uniform motion, so that there a
    streak is as even as the exposure; "published" takes them as printed, which makes streaks
    brightest in their middle. Without depth, a pixel follows its own path, but has the colour of a
    surface that moves farther at the times at which that one passes; published: everything is
    equally near. `show`: "tiles" gives the motion that each tile follows: hue is its direction,
    full brightness a whole tile.

    Strong: one frame is enough, fast, soft at silhouettes. Artefacts: where two motions meet
    only one of them is followed, hidden surfaces are guessed from neighbouring pixels.
    """

    name = "tiles"
    needs = frozenset({"color", "motion"})
    uses = frozenset({"depth"})
    spread: Spread = "around"
    adaptive = True

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """Tap weights and output."""

        variant: Annotated[
            Literal["even", "published"],
            "weights divided by those under uniform motion, or as printed",
        ] = "even"
        show: Annotated[
            Literal["color", "tiles"], "the blurred image, or the motion followed by each tile"
        ] = "color"

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        self._device, self._output, self._options = device, output, options
        self._images = TexturePool(device)
        self._row_max, self._tile_max, self._neighbor_max = (
            ScratchBuffer(device) for _ in range(3)
        )

    @staticmethod
    def margin(height: int) -> int:
        """A tile is looked up as far as a quarter of its edge away, so that no seams show."""
        return -(-edge_of(height) // 4)

    def repeats(self, inputs: Inputs) -> bool:
        """See `Method`."""
        return True

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record three passes over the tiles between two over the picture."""
        kernel = gpu.kernel(
            self._device,
            "methods/tiles.wgsl",
            {"Output": self._output},
            BOX_SHUTTER=inputs.even,
            ADAPTIVE=inputs.auto,
            WEIGHTED=inputs.frame.weight is not None,
            PUBLISHED=self._options.variant == "published",
            HAS_DEPTH=inputs.frame.depth is not None,
            TILES=self._options.show == "tiles",
        )
        velocity = gpu.kernel(
            self._device, "methods/tiles_velocity.wgsl", HAS_DEPTH=inputs.frame.depth is not None
        )
        # Tiles are those of the display window, so that a crop has the same ones.
        width, height = inputs.bindings.size
        left, top, _, display_height = inputs.bindings.window
        edge = edge_of(display_height)
        first = left // edge, top // edge
        count = -(-(left + width) // edge) - first[0], -(-(top + height) // edge) - first[1]
        # Taps read velocity and depth many times, so both are in one texture.
        velocity_depth = self._images.view("velocity, depth", (width, height), "rgba32float")
        velocity.run(
            encoder,
            "main",
            inputs.bindings,
            motion=inputs.frame.motion,
            depth=inputs.frame.depth,
            velocity_depth=velocity_depth,
        )
        own = {
            "tiles": {"count": count, "first": first, "edge": edge},
            "color": inputs.frame.color,
            "motion": inputs.frame.motion,
            "velocity_depth": velocity_depth,
            "weight": inputs.frame.weight,
            "linear": inputs.linear,
            "row_max": self._row_max.at_least(16 * count[0] * height),
            "tile_max": self._tile_max.at_least(16 * count[0] * count[1]),
            "neighbor_max": self._neighbor_max.at_least(16 * count[0] * count[1]),
            "output": output,
        }
        # The fastest motion of each tile, by rows first, and of the tiles around it; then the taps.
        grids = {
            "find_row_max": (count[0], height),
            "find_tile_max": count,
            "find_neighbor_max": count,
            "main": (width, height),
        }
        for entry, grid in grids.items():
            kernel.run(encoder, entry, inputs.bindings, grid, **own)
