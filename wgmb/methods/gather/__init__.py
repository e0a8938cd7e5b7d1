"""Three-frame reconstruction of the visible surface at every pixel and sample time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import wgpu

from ...gpu import wgsl
from ...gpu.textures import TexturePool, Word
from ..contract import Inputs, View
from ..options import MethodOptions, Range
from ..tap import Tap
from .layers.layers import Layers
from .light_inputs import PASSES, Shading, kinds_of
from .search import Search
from .shading import FOLLOWED, LightTimes, MovingLight
from .tiles.active_tiles import ActiveTiles
from .tiles.scatter import Scatter
from .tiles.tile_motions import TileMotions


class Gather:
    """Find the surface visible at every pixel and sample time by searching three frames or five.

    Fixed-point iterative warping (Bowles et al., "Iterative Image Warping", 2012) of the frame and
    its neighbours (Yang et al., "Image-Based Bidirectional Scene Reprojection", 2011) along
    trajectories through five positions, as the neighbours' own vectors lead on. It starts from the
    pixel's own motion and from the few candidate motions that reach its tile (after the tile maxima
    of McGuire et al. 2012 and Guertin et al. 2014). Silhouettes are first separated into a
    foreground and a background layer, so that each part of a mixed pixel follows its own motion;
    coverage is alpha in front of transparent pixels, else that of filtered vectors, else that of
    colours. The nearest sample is visible, the frame's own unless a neighbouring frame's is clearly
    nearer; surfaces that all frames hide are filled from the surfaces around and behind.
    `show`: "confidence" gives, instead of colour, the share of times at which a sample was
    accepted and its light followed, the share that neighbouring frames gave (backgrounds included),
    the mean residual [px] and the share that came over the picture's border, in no frame, as r, g,
    b, a.

    `shading`: light that moves over surfaces, as shadows and reflections do, is followed too, where
    the passes of light of the frame and of a neighbour separate it from the surfaces (see
    Frame.diffuse_light). "auto": by these, if the frame has them, else clear shadows on static
    surfaces, by their colours; "passes": by the passes, and an InputError if it has none;
    "frames": shadows by the colours alone everywhere, which is less sure; "off": shading stays that
    of the frame.

    `where`: "edges" searches only the tiles of 16 px in or near which motion changes by over 4 px
    within the exposure; the others, in which nothing can be hidden, are tapped, at a fraction of
    the cost.

    `reach`: frames to search on either side. 2: those beyond the neighbours show what the
    frame and both neighbours hide; it takes half as long again, and more memory.

    Strong: the closest to the truth. Reveals hidden surfaces, blurs across silhouettes.
    Artefacts: without passes of light, shading is that of one frame, but for clear shadows on
    static surfaces; surfaces hidden in all frames are filled from their surroundings; those that
    move more than 256 px by a sample's time may be missed; costs 7 to 30 times as much as taps, and
    several times that where light moves.
    """

    name = "gather"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours", *PASSES})
    adaptive = True
    quick: ClassVar = {"shading": "off"}
    most_in_software = 512  # loops end there after 65,535 turns, all of a pixel together
    steps = FOLLOWED
    bend = float(wgsl.load("common/path.wgsl").constant("MOST_BEND"))
    confidence = ("accepted", "disocclusion", "residual", "left")

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """Output of the method."""

        show: Annotated[
            Literal["color", "confidence"], "the blurred image, or confidence layers"
        ] = "color"
        shading: Annotated[
            Shading,
            "moving shadows and reflections: auto follows them by the passes of light, or, without "
            "passes, follows clear shadows on static surfaces; passes requires the passes; frames "
            "follows shadows by the colours; off leaves them as in the frame",
        ] = "auto"
        where: Annotated[
            Literal["everywhere", "edges"],
            "search everywhere, or where motion changes by over 4 px within the exposure, and tap "
            "elsewhere (edges)",
        ] = "everywhere"
        reach: Annotated[
            int,
            Range(1, 2),
            "frames to search on either side: 1, or 2 for those beyond the neighbours too",
        ] = 1

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        images, confidence = TexturePool(device), options.show == "confidence"
        self._shading: Shading = options.shading
        self.reach = options.reach
        if self._shading in ("off", "frames"):
            self.uses = frozenset({"neighbours"})
        self._light = MovingLight(device, confidence=confidence)
        at_edges = options.where == "edges" and not confidence
        self._taps = Tap(device, Tap.Options(), output=output) if at_edges else None
        self._tiles = ActiveTiles(device, at_edges)
        self._layers = Layers(device, images, 2 * options.reach + 1)
        self._motions, self._scatter = TileMotions(device, images), Scatter(device)
        self._search = Search(device, images, confidence=confidence, output=output)

    @property
    def finds(self) -> tuple[Word, ...]:
        """Of the steps of light, see `Method`."""
        return self._light.finds

    def repeats(self, inputs: Inputs) -> bool:
        """See `Method`."""
        return True

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record layers and tile motions of every frame, then the search."""
        size, frames = inputs.bindings.size, inputs.frames
        # Taps fill the whole picture where only edges of motion are searched, which come over them.
        if self._taps is not None:
            self._taps.encode(encoder, inputs, output)
        worklists = self._tiles.encode(encoder, inputs)
        self._layers.encode(encoder, inputs, worklists)
        # Where searches start: from few motions a tile, and in crowded tiles from scattered pixels.
        candidates = self._motions.candidates(size, len(frames))
        scattered = self._scatter.scattered(encoder, inputs)
        for i in range(len(frames)):
            own, surface = (self._layers.front_surface(k) for k in (0, i))
            tiles = self._scatter.tiles(encoder, size)
            self._motions.encode(encoder, inputs, i, surface, worklists, tiles)
            self._scatter.encode(encoder, inputs, i, (own, surface), candidates, tiles, scattered)
        textures = self._layers.textures
        added, self._light.finds = None, ()
        if kinds := kinds_of(inputs, self._shading):
            opens, closes = inputs.exposed
            times = LightTimes.within(opens, closes, inputs.samples)
            weight, steps = inputs.frame.weight, inputs.steps or self.steps
            added = self._light.encode(encoder, inputs.bindings, kinds, times, weight, steps)
        starts = candidates, scattered
        if self._taps is not None:
            worklists = {name: one for name, one in worklists.items() if name != "static"}
        self._search.encode(encoder, inputs, textures, starts, worklists, output, added)
