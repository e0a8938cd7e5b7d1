"""Three-frame reconstruction: what is visible at every pixel and every time of the exposure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from ...errors import InputError
from ...gpu.textures import TexturePool
from ..options import MethodOptions
from .active_tiles import ActiveTiles
from .layers import Layers
from .search import Search
from .tile_motions import TileMotions

_STORED = 6  # storage textures of one pass: edge flags, both layers, their matte


class Gather:
    """Search, for every pixel and time, the samples of up to three frames that are there.

    Fixed-point iterative warping (Bowles et al., "Iterative Image Warping", 2012) of the frame and
    its neighbours (Yang et al., "Image-Based Bidirectional Scene Reprojection", 2011) along curved
    trajectories. It starts from the pixel's own motion and from the few candidate motions that
    reach its tile (after the tile maxima of McGuire et al. 2012 and Guertin et al. 2014).
    Silhouettes are separated into two layers before, foreground and background, so that mixed
    pixels move as what they are made of; their coverage is that of alpha in front of what is
    transparent, else that of filtered vectors. The nearest sample is visible, the frame's own
    unless a neighbouring frame's is clearly nearer; where no frame shows what is there, a tap
    follows the pixel's own trajectory.
    `show`: "confidence" gives, instead of colour, the share of times at which a sample was
    accepted, the share that neighbouring frames gave, the mean residual [px] and the share of
    times whose path left the picture, as r, g, b, a.

    Strong: the closest to the truth. What is hidden appears, blur goes over silhouettes.
    Artefacts: shading is that of one frame; what all three frames hide is guessed from its
    surroundings; what comes from more than 256 px away by a sample's time may be missed; costs
    7 to 26 times as much as taps.
    """

    name = "gather"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours"})
    adaptive = True
    most_in_software = 512  # loops end there after 65,535 turns, all of a pixel together
    confidence = ("accepted", "disocclusion", "residual", "left")

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """What is shown."""

        show: Annotated[
            Literal["color", "confidence"], "the blurred picture, or how sure it is"
        ] = "color"

    def __init__(self, device, options: Options, *, output="rgba32float"):
        limit = "max-storage-textures-per-shader-stage"
        if device.limits[limit] < _STORED:
            raise InputError(
                f"gather writes {_STORED} textures in a pass, this device allows "
                f"{device.limits[limit]}: request it with required_limits={{{limit!r}: {_STORED}}}"
            )
        images, confidence = TexturePool(device), options.show == "confidence"
        self._tiles = ActiveTiles(device)
        self._layers = Layers(device, images, self._tiles)
        self._motions = TileMotions(device, images)
        self._search = Search(device, images, confidence=confidence, output=output)

    def encode(self, encoder, inputs, output):
        """Record layers and tile motions of every frame, then the search."""
        size, frames = inputs.bindings.size, inputs.frames
        slots = self._layers.slots(size, frames)
        worklists = self._tiles.encode(encoder, inputs)
        for i, (frame, slot) in enumerate(zip(frames, slots, strict=True)):
            self._layers.encode(encoder, inputs, frame, slot, worklists)
            surface = self._layers.views(slot)["front_surface"]
            self._motions.encode(encoder, inputs, i, surface, worklists)
        candidates = self._motions.candidates(size, len(frames))
        textures = self._layers.textures
        self._search.encode(encoder, inputs, slots, textures, candidates, worklists, output)
