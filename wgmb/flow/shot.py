"""Flow of the frames of a shot: every stage of a frame is made once, from those of its neighbours.

Inputs of a frame's stages, so that the result is a function of its number alone:

searched(n, coarsest): pictures n - 1, n, n + 1;
searched(n, level): mended(n, coarser), and searched(n - 1, coarser) and (n + 1, coarser), carried;
mended(n, level): searched(n - 1, level), (n, level) and (n + 1, level);
motion(n): mended(n, 0), or searched(n, 0) where the finest level has no sweeps.

A picture that is searched at a smaller size has its levels there, and its motion is raised.
With three levels, pictures n - 4 to n + 4 may have a say in the motion of frame n.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..errors import InputError
from ..gpu import wgsl
from .dominant import follow_most, settle
from .guide import finer, guide
from .homography import enlarged
from .lights import find_lights, follow_lights, move_lights
from .passes import STATES, Bindings, FlowPasses
from .pyramid import all_sizes, features, level_sizes
from .raising import raised, reduced
from .result import Motion, result
from .search import FullSearch
from .sweeps import SweptLevel, polish, sweep
from .views import BESIDE, Views, views_of

Load = Callable[[int], np.ndarray | wgpu.GPUTexture | None]


@dataclass(frozen=True)
class Effort:
    """Number of sweeps: on the coarsest level, on those between, and on the finest.

    `polish`: how often parts of a pixel are refined and noise is removed, on every level.
    `block`: pixels along those that share a first state. `aside`: price of moving otherwise than
    most, see sweep.wgsl. `led`: on how many levels the guide may lead, from the coarsest on.
    `longest`: the longer side [px] at which larger pictures are searched.
    """

    coarsest: int
    between: int
    finest: int
    polish: int
    block: int
    aside: float
    led: int
    longest: float = math.inf

    def searched_size(self, size: tuple[int, int]) -> tuple[int, int]:
        """Width, height at which a picture of a size is searched, in the same proportion."""
        by = min(1.0, self.longest / max(size))
        return max(1, round(by * size[0])), max(1, round(by * size[1]))

    def sweeps(self, level: int, levels: int) -> int:
        """Sweeps on a level; 0 is the finest."""
        if level == levels - 1:
            return self.coarsest
        return self.between if level else self.finest


EFFORTS = {
    "best": Effort(3, 2, 2, 2, block=2, aside=0.4, led=2),
    "fast": Effort(3, 2, 0, 1, block=4, aside=0.15, led=1),
    "draft": Effort(3, 2, 0, 1, block=4, aside=0.15, led=1, longest=440),
}
LARGEST = 4  # px across a light on the coarsest level: what is larger, the search finds
BEHIND = 2  # pictures that are kept before the frame asked for; after it, all that it looks at
KEPT = {
    "lights": 2,
    "most": 1,
    "guides": 1,
    "lead": 1,
    "searched": 1,
    "mended": 0,
    "motion": 2,
}  # frames around the one asked for


def checked(picture: np.ndarray, number: int) -> np.ndarray:
    """A picture as (height, width, 4) float32; InputError if it is none."""
    picture = np.asarray(picture)
    if picture.ndim != 3 or picture.shape[2] not in (3, 4) or 0 in picture.shape:
        raise InputError(f"frame {number} must be (height, width, 3 or 4), got {picture.shape}")
    if picture.dtype.kind != "f":
        raise InputError(f"frame {number} must be floating point, got {picture.dtype}")
    color = np.ones((*picture.shape[:2], 4), np.float32)
    color[..., : picture.shape[2]] = picture
    return color


class Shot:
    """Flow of successive frames between two cuts; made by `Flow.shot`.

    Frames that are asked for one after the other share their stages: each is searched once.
    """

    def __init__(self, passes: FlowPasses, load: Load, effort: Effort):
        self._passes, self._load, self._effort = passes, load, effort
        self._full_search = FullSearch(passes, effort.block)
        self._size: tuple[int, int] | None = None
        self._results: dict[tuple[str, int, int], Any] = {}

    def textures(self, number: int) -> Motion | None:
        """Motion and depth of a frame on the GPU, valid until others are asked for.

        None where the shot has no such frame.
        """
        if self._features(number) is None:
            return None
        made = self._once("motion", number, 0, self._motion)
        self._passes.submit()
        return made

    def __call__(self, number: int) -> tuple[np.ndarray, np.ndarray] | None:
        """(height, width, 4) to_prev, to_next [px] and (height, width) depth of a frame."""
        with gpu.reported():
            textures = self.textures(number)
            if textures is None:
                return None
            motion, depth = (self._passes.read(t) for t in (textures.motion, textures.depth))
            return motion, depth[..., 0]

    def _once(self, stage: str, number: int, level: int, make: Callable[[int, int], Any]) -> Any:
        key = stage, number, level
        if key not in self._results:
            self._results[key] = make(number, level)
        return self._results[key]

    def _features(self, number: int) -> list[wgpu.GPUTexture] | None:
        return self._once("pictures", number, 0, self._measured)

    def _measured(self, number: int, _: int) -> list[wgpu.GPUTexture] | None:
        self._passes.submit()  # they may read the picture before, whose place this one takes
        picture = self._load(number)
        if picture is None:
            return None
        if isinstance(picture, wgpu.GPUTexture):
            size = picture.size[0], picture.size[1]
        else:
            picture = checked(picture, number)
            size = picture.shape[1], picture.shape[0]
        if self._size not in (None, size):
            expected = "{} x {}".format(*self._size or size)
            raise InputError(f"frame {number} is {size[0]} x {size[1]}, others are {expected}")
        self._size = size
        if isinstance(picture, wgpu.GPUTexture):
            view = picture.create_view()
        else:
            view = self._passes.images.upload("picture", picture, "rgba32float")
        if self._sizes[0] != size:
            view, display = reduced(self._passes, view, size, self._sizes[0])
            self._results["display", number, 0] = display
        return features(self._passes, view, self._sizes[0])

    @property
    def _sizes(self) -> list[tuple[int, int]]:
        assert self._size is not None
        return level_sizes(self._effort.searched_size(self._size))

    def _views(self, number: int) -> Views | None:
        return views_of(number, lambda other: self._features(other) is not None)

    def _matched(self, views: Views, level: int) -> Bindings:
        """The bindings of match.wgsl for a frame on a level."""
        numbers = {views.here, views.near, views.near if views.far is None else views.far}
        levels = {n: self._features(n) or [] for n in numbers}
        return matched(self._passes, views, levels, level)

    def _searched(self, number: int, level: int) -> wgpu.GPUTexture:
        views, passes, size = self._views(number), self._passes, self._sizes[level]
        assert views is not None
        bound = self._matched(views, level)
        price = {"ASIDE_PRICE": self._effort.aside}
        swept = bound | {"constants": bound["constants"] | price}
        coarsest = len(self._sizes) - 1
        count = self._effort.sweeps(level, coarsest + 1)
        if level == coarsest:
            states, *some = self._full_search(size, bound)
            states, both = follow_most(passes, size, bound, views, states, *some)
            begun = SweptLevel(level, size, swept, [], both[0])
            states = sweep(passes, begun, states, count)
            self._results["most", number, level] = both
            states = self._led(views, level, states)
            return self._polished(states, size, bound) if level else states
        coarser = self._once("mended", number, level + 1, self._mended)
        states = self._grown(coarser, level)
        if level > coarsest - self._effort.led and len(views.neighbours) == 2:
            states = self._led(views, level, states)
        guesses = (
            [self._carried(other, views, level) for other in views.neighbours] if count else []
        )
        most = enlarged(self._results["most", number, coarsest][0], 2.0 ** (coarsest - level))
        leads = (self._results.get(("lead", number, k)) for k in range(level, coarsest + 1))
        lead = next(one for one in leads if one is not None)
        begun = SweptLevel(level, size, swept, guesses, most, lead)
        states = sweep(passes, begun, states, count)
        passes.give(*guesses)
        return self._polished(states, size, bound) if level else states

    def _led(self, views: Views, level: int, states: wgpu.GPUTexture) -> wgpu.GPUTexture:
        """The states, those of the guide where it leads."""
        number, size, bound = views.here, self._sizes[level], self._matched(views, level)
        guides = self._guides(number, level)
        coarser = self._results.get(("lead", number, level + 1))
        led = follow_guide(self._passes, size, bound, states, guides[0], guides[1:], coarser)
        states, self._results["lead", number, level] = led
        if level > len(self._sizes) - self._effort.led:
            self._results["guides", number, level] = guides
        else:
            self._passes.give(*guides)
        return states

    def _guides(self, number: int, level: int) -> list[wgpu.GPUTexture]:
        """The guide of a frame, and if it has two neighbours, theirs back to it."""
        own, most = self._views(number), self._results["most", number, len(self._sizes) - 1]
        assert own is not None
        views, mosts = [own], [most]
        if len(own.neighbours) == 2:
            views += [Views(other, number, None, BESIDE) for other in own.neighbours]
            mosts += [2 * (np.linalg.pinv(matrix),) for matrix in most]
        coarser = self._results.get(("guides", number, level + 1))
        sizes = all_sizes(self._sizes[0])[level:]
        guides = []
        for k, (view, matrices) in enumerate(zip(views, mosts, strict=True)):
            bound = [self._matched(view, level + further) for further in range(len(sizes))]
            if coarser:
                guides.append(finer(self._passes, sizes, bound, coarser[k]))
            else:
                guides.append(guide(self._passes, sizes, bound, matrices))
        return guides

    def _grown(self, states: wgpu.GPUTexture, level: int) -> wgpu.GPUTexture:
        output = self._passes.take(self._sizes[level], STATES)
        self._passes.run("grow.wgsl", "main", self._sizes[level], states=states, output=output)
        return output

    def _carried(self, other: int, views: Views, level: int) -> wgpu.GPUTexture:
        """The states of a neighbour, from the coarser level, as guesses in the frame itself."""
        theirs = self._views(other)
        assert theirs is not None
        states = self._grown(self._once("searched", other, level + 1, self._searched), level)
        turn = -views.leads_by(other)
        along = theirs.leads_by(views.here)
        size = self._sizes[level]
        output = carry(self._passes, size, self._matched(theirs, level), states, along, turn)
        self._passes.give(states)
        return output

    def _mended(self, number: int, level: int) -> wgpu.GPUTexture:
        views = self._views(number)
        assert views is not None
        neighbours = {}
        for other in views.neighbours:
            theirs = self._views(other)
            assert theirs is not None
            neighbours[other] = theirs, self._once("searched", other, level, self._searched)
        states = self._once("searched", number, level, self._searched)
        bound = self._matched(views, level)
        return mend(self._passes, self._sizes[level], bound, views, states, neighbours)

    def _motion(self, number: int, _: int) -> Motion:
        views = self._views(number)
        assert self._size is not None
        if views is None:
            states = self._passes.take(self._size, STATES)
            alone = Views(number, number, None, BESIDE)
            made = result(self._passes, self._size, alone, states)
            self._passes.give(states)
            return made
        is_swept = self._effort.sweeps(0, len(self._sizes)) > 0
        states = (self._mended if is_swept else self._searched)(number, 0)
        bound = self._matched(views, 0)
        states = move_lights(self._passes, self._sizes[0], bound, states, self._followed(views))
        states = self._polished(states, self._sizes[0], bound)
        states = settle(self._passes, self._sizes[0], bound, views, states)
        made = result(self._passes, self._sizes[0], views, states)
        if self._sizes[0] != self._size:
            made, states = self._raised(number, views, made, states)
        self._passes.give(states)
        self._forget(number)
        return made

    def _raised(
        self, number: int, views: Views, small: Motion, states: wgpu.GPUTexture
    ) -> tuple[Motion, wgpu.GPUTexture]:
        """Motion and states at the picture's own size; the search's textures are returned."""
        assert self._size is not None
        display, here = self._results["display", number, 0], (self._features(number) or [])[0]
        larger, depth = raised(self._passes, display, here, states, small.depth)
        self._passes.give(states, small.motion, small.depth)
        return result(self._passes, self._size, views, larger, depth), larger

    def _followed(self, views: Views) -> np.ndarray:
        """Small lights of a frame and their motion; none if no coarse level loses them."""
        here, near = (self._once("lights", n, 0, self._lights) for n in (views.here, views.near))
        far = np.zeros((0, 4))
        if views.far is not None:
            far = self._once("lights", views.far, 0, self._lights)
        return follow_lights(here, near, far, views.factor, max(self._sizes[0]))

    def _lights(self, number: int, _: int) -> np.ndarray:
        coarsest = len(self._sizes) - 1
        finest = (self._features(number) or [])[:1]
        if not coarsest or not finest:
            return np.zeros((0, 4))
        return find_lights(self._passes.read(finest[0]), LARGEST * 2**coarsest)

    def _polished(
        self, states: wgpu.GPUTexture, size: tuple[int, int], bound: Bindings
    ) -> wgpu.GPUTexture:
        """The states to parts of a pixel and without noise; the given ones are taken back."""
        passes, here = self._passes, bound["here"]
        stepped = passes.take(size, STATES)
        for _ in range(self._effort.polish):
            polish(passes, size, bound, states, stepped)
            passes.run("smooth.wgsl", "main", size, here=here, states=stepped, output=states)
        passes.give(stepped)
        return states

    def _forget(self, number: int) -> None:
        """Release data that the frames after and before this one will not need."""
        for key in list(self._results):
            stage, other, level = key
            if stage in ("pictures", "display"):
                far = not -BEHIND <= other - number <= 1 + len(self._sizes)
            else:
                far = abs(other - number) > KEPT[stage] + level
            if far:
                made = self._results.pop(key)
                textures = made if isinstance(made, list | tuple) else [made]
                if isinstance(made, Motion):
                    textures = [made.motion, made.depth]
                self._passes.give(*(t for t in textures if isinstance(t, wgpu.GPUTexture)))


# ---- the bindings of match.wgsl: a frame's features, and those of the frames it is compared with


FINEST_STRIDE, STRIDE = 1.0, 2.0  # between the samples of a patch [px]: finest level, coarser
MOST_SHADE = 0.08  # difference in grey that may be the light's, on coarser levels; 0 on the finest
FAR_PRICE = 0.03  # for being hidden in the near frame, if the far one is two frames away


def matched(
    passes: FlowPasses, views: Views, features: dict[int, list[wgpu.GPUTexture]], level: int
) -> Bindings:
    """Bindings by their names, and the override `VIEWS`; `features`: levels by frame number."""
    far = views.near if views.far is None else views.far
    view = passes.uniform(
        "match.wgsl",
        "View",
        far_factor=views.factor,
        far_price=FAR_PRICE if views.factor == BESIDE else 0.0,
        stride=STRIDE if level else FINEST_STRIDE,
        most_shade=MOST_SHADE if level else 0.0,
    )
    return {
        "constants": {"VIEWS": int(wgsl.load("flow/match.wgsl").constant(views.kind))},
        "view": view,
        "linear": passes.linear,
        "here": features[views.here][level],
        "near": features[views.near][level],
        "far": features[far][level],
    }


# ---- states of a frame carried along their flow into its neighbour, as guesses there ----------


def carry(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    along: float,
    turn: float,
) -> wgpu.GPUTexture:
    """States as seen from the neighbour; no motion where nothing lands.

    `matched`: the bindings of match.wgsl for the frame that the states are of. `along`: 1 if
    their flow leads to the neighbour, -1 if its continuation does. `turn`: -1 if the neighbour's
    own flow leads back, 1 if it leads on.
    """
    item = wgsl.load("flow/carry.wgsl").dtype("Landing").itemsize
    output = passes.take(size, STATES)
    own = {
        "carry": passes.uniform("carry.wgsl", "Carry", along=along, turn=turn),
        "states": states,
        "landings": passes.landings.at_least(item * size[0] * size[1]),
        "output": output,
    }
    for entry in ("clear", "claim", "settle", "fetch"):
        passes.run("carry.wgsl", entry, size, **own, **matched)
    return output


# ---- pixels that are not found again take over the state of the surface they belong to --------


def mend(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    views: Views,
    states: wgpu.GPUTexture,
    neighbours: dict[int, tuple[Views, wgpu.GPUTexture]],
) -> wgpu.GPUTexture:
    """States of a frame, those that lead astray replaced.

    `neighbours`: views and states of the frames directly beside it, by their numbers.
    """
    near_views, near = neighbours[views.near]
    sides = {"near": near_views.leads_by(views.here)}
    far = near
    if len(views.neighbours) == 2:
        far_views, far = neighbours[views.neighbours[1]]
        sides["far"] = far_views.leads_by(views.here)
    lost = passes.scratch(size, "r32uint", "lost")
    none = passes.scratch((1, 1), "r32uint", "none lost")
    output = passes.take(size, STATES)
    for entry, read, written in (("find_lost", none, lost), ("mend", lost, none)):
        passes.run(
            "mend.wgsl",
            entry,
            size,
            others=passes.uniform("mend.wgsl", "Others", **sides),
            states=states,
            near_states=near,
            far_states=far,
            lost=read,
            lost_out=written,
            output=output,
            **matched,
        )
    return output


# ---- the lead of the guide where the picture repeats or turns back ----------------------------


def follow_guide(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    guide: wgpu.GPUTexture,
    back: list[wgpu.GPUTexture],
    coarser: wgpu.GPUTexture | None = None,
) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture]:
    """States, those of the guide where it leads; and the lead, for the sweeps on finer levels.

    `guide`: displacements that guide.py found; `back`: the same of the near frame and of the far
    one, to this frame, if they are on different sides. `coarser`: the lead of the coarser level,
    if there is one, which holds where no other is found. The given states are taken back.
    """
    constants = matched["constants"] | {"IS_COARSEST": coarser is None}
    found = passes.scratch(size, "r32uint", "found")
    none = passes.scratch((1, 1), "r32uint", "none found")
    output, lead = passes.take(size, STATES), passes.take(size, STATES)
    for entry, read, written in (("find", none, found), ("follow", found, none)):
        passes.run(
            "repeats.wgsl",
            entry,
            size,
            states=states,
            guide=guide,
            found=read,
            found_out=written,
            output=output,
            lead=lead,
            coarser_lead=guide if coarser is None else coarser,
            near_back=back[0] if back else guide,
            far_back=back[-1] if back else guide,
            **matched | {"constants": constants},
        )
    passes.give(states)
    return output, lead
