"""Flow of light over surfaces between two pictures, both ways, and how far it is trusted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ....gpu import wgsl
from .changes import View
from .stage import FOLDER, Size, Stage

COARSE = 3  # first level whose patches are all searched, at all of their pixels
COARSEST = 20  # px along the longer side of the coarsest level, at least
SPREAD, GUARD = 5.0, 4.0  # [px] sigma of the fill, and of where motion has to explain the change


@dataclass(frozen=True)
class LightFlow:
    """Flow from the frame to a neighbour and back [px], with trust; for shadows, their findings."""

    ahead: View
    back: View


def level_sizes(size: Size) -> list[Size]:
    """Width, height of every level of a pyramid, the frame's own first."""
    sizes = [size]
    while max(sizes[-1]) >= 2 * COARSEST:
        sizes.append((-(-sizes[-1][0] // 2), -(-sizes[-1][1] // 2)))
    return sizes


def patch_grid(size: Size) -> Size:
    """Patches across and down a level, as patches_along() of flow.wgsl."""
    source = wgsl.load(f"{FOLDER}/flow.wgsl")
    patch, stride = map(source.integer, ("PATCH", "STRIDE"))
    across, down = (max(n - patch + stride - 1, 0) // stride + 1 for n in size)
    return across, down


def flow_size(size: Size) -> Size:
    """The size of the flow of a coarse level, as write_flow() of flow.wgsl."""
    every = wgsl.load(f"{FOLDER}/flow.wgsl").integer("EVERY")
    return -(-size[0] // every), -(-size[1] // every)


def grids(size: Size) -> list[Size]:
    """The sizes of all passes: of levels, of their patches and of their flow."""
    sizes = level_sizes(size)
    return list(dict.fromkeys([*sizes, *map(patch_grid, sizes), *map(flow_size, sizes[1:])]))


@dataclass(frozen=True)
class Level:
    """A level of a pyramid: with its gradients, and in squares of pixels: see pyramid.wgsl."""

    gradients: View
    squares: View


def pyramid(stage: Stage, name: str, source: View) -> list[Level]:
    """All levels of the picture of `source`; of shadows, where light rests there are none."""
    format, first = "rgba16float", stage.texture if stage.pulled else stage.sparse
    levels = [Level(*(first(f"level 0 {kind}{name}", format) for kind in ("", "squares ")))]
    over = "whole" if stage.pulled else "near"
    stage.run("pyramid", "begin", over=over, source=source, level=levels[0].gradients,
              squares=levels[0].squares)  # fmt: skip
    for i, size in enumerate(level_sizes(stage.size)[1:], 1):
        names = (f"level {i} {kind}{name}" for kind in ("", "squares "))
        level = Level(*(stage.texture(name, format, size) for name in names))
        stage.run("pyramid", "halve", size=size, source=levels[-1].gradients,
                  level=level.gradients, squares=level.squares)  # fmt: skip
        levels.append(level)
    return levels


def planes(stage: Stage, depth: View) -> View:
    """The tangent plane of the surface at every pixel, of the frame itself."""
    result = stage.sparse("planes", "rgba32float")
    _accept(stage, "find_planes", depth=depth, weighted=result)
    return result


def flows(
    stage: Stage,
    pictures: Mapping[int, tuple[View, list[Level]]],
    changed: Mapping[int, View],
    surfaces: Mapping[str, View],
    by_color: bool,
) -> dict[int, LightFlow]:
    """Flow to each neighbour, by its offset; `pictures`: values and their pyramids, 0 of the frame.

    `changed`: changes of light to each neighbour. `surfaces`: "depth", "planes" and "motion" of the
    frame itself, over whose surfaces all move. `by_color`: the light is the picture itself.
    """
    searched = {side: _flow(stage, side, pictures[0], pictures[side], surfaces) for side in changed}
    if stage.pulled:
        return searched
    values = {side: view for side, (view, _) in pictures.items()}
    ahead = _extrapolated(stage, searched, values, changed, surfaces, by_color)
    return {side: LightFlow(ahead[side], way.back) for side, way in searched.items()}


def _extrapolated(
    stage: Stage,
    searched: Mapping[int, LightFlow],
    values: Mapping[int, View],
    changed: Mapping[int, View],
    surfaces: Mapping[str, View],
    by_color: bool,
) -> dict[int, View]:
    """Flow to each neighbour, not as searched where the other one or a body explains more."""
    cells = grid_of_cells(stage.size)
    nearest, others, bodies = (
        stage.sparse(name, "rgba16float", cells)
        for name in ("nearest bodies", "other bodies", "bodies")
    )

    def run(entry: str, side: int, **bindings: Any) -> None:
        way, other = searched[side], searched.get(-side)
        of_side: dict[str, Any] = {
            "values": values[0], "values_there": values[side], "values_other": values.get(-side),
            "change": changed[side], "flow": way.ahead, "flow_back": way.back,
            "flow_other": other and other.ahead, "bodies": bodies, "side": {"next": side > 0},
        }  # fmt: skip
        unused = dict.fromkeys(
            ("others", "around", "around_other", "flow_out", "bodies_out", "others_out", "weighted")
        )
        constants: dict[str, float] = {"COLORS": by_color}
        bindings = {**unused, **of_side, **surfaces, **bindings}
        stage.run("extrapolate", entry, over="near", constants=constants, **bindings)

    # Where a body hides a shadow, no flow is found: the shadow shares the motion of a body near it.
    one = next(iter(searched))
    run("find_bodies", one, halved=True, bodies=None, bodies_out=nearest, others_out=others)
    found: dict[str, Any] = {"halved": True, "bodies": nearest, "others": others}
    differs = {side: stage.sparse(f"bodies {side}", "rgba32float", cells) for side in searched}
    for side in searched:
        run("compare_bodies", side, **found, weighted=differs[side])
    run("choose_body", one, **found, around=differs[one], around_other=differs.get(-one),
        bodies_out=bodies)  # fmt: skip
    # Pixels choose among that, the flow to the other neighbour turned round, and their own.
    around, result = {}, {}
    weighted = stage.sparse("weighted", "rgba32float")
    for side in searched:
        run("explain", side, weighted=weighted)
        around[side] = stage.sparse(f"explained {side}", "rgba32float", half_size(stage.size))
        blurred(stage, weighted, GUARD, around[side])
    near = stage.sparse("around", "rgba32float", half_size(stage.size))
    for side in searched:
        chosen = stage.sparse("chosen", "rgba16float")
        run("choose", side, around=around[side], around_other=around.get(-side),
            flow_out=chosen)  # fmt: skip
        run("weigh", side, flow=chosen, weighted=weighted)
        blurred(stage, weighted, SPREAD, near)
        result[side] = stage.sparse(f"settled {side}", "rgba16float")
        run("settle", side, flow=chosen, around=near, flow_out=result[side])
    return result


def grid_of_cells(size: Size) -> Size:
    """The cells of extrapolate.wgsl across and down."""
    side = wgsl.load(f"{FOLDER}/extrapolate.wgsl").integer("CELL")
    return -(-size[0] // side), -(-size[1] // side)


def _flow(
    stage: Stage, side: int, here: tuple[View, list[Level]], neighbour: tuple[View, list[Level]],
    surfaces: Mapping[str, View],
) -> LightFlow:  # fmt: skip
    """Flow to the neighbour at the offset `side`; `here`, `neighbour`: values and their pyramid."""
    raw = {
        True: _search(stage, "ahead", here[1], neighbour[1]),
        False: _search(stage, "back", neighbour[1], here[1]),
    }
    given = {
        ahead: {"values": own[0], "values_there": other[0], "depth": surfaces["depth"],
                "planes": surfaces["planes"]}
        for ahead, own, other in ((True, here, neighbour), (False, neighbour, here))
    }  # fmt: skip
    names = {True: f"ahead {side}", False: f"back {side}"}
    filled = {
        ahead: _filled(stage, names[ahead], raw[ahead], raw[not ahead], given[ahead])
        for ahead in (True, False)
    }
    trusted = {}
    for ahead in (True, False):
        trusted[ahead] = stage.sparse(f"flow {names[ahead]}", "rgba16float")
        _accept(stage, "trust", flow=filled[ahead], flow_back=filled[not ahead],
                flow_out=trusted[ahead], **given[ahead])  # fmt: skip
    return LightFlow(trusted[True], trusted[False])


def blurred(stage: Stage, source: View, sigma: float, output: View) -> None:
    """A Gaussian of `sigma` [px], at half the size."""
    half = stage.sparse("half blurred", "rgba32float", half_size(stage.size))
    given: dict[str, Any] = {"over": "near", "halved": True, "constants": {"SIGMA": sigma}}
    stage.run("blur", "across", source=source, output=half, **given)
    stage.run("blur", "down", source=half, output=output, **given)


def half_size(size: Size) -> Size:
    """As that of light.wgsl: a pixel stands for 2 x 2."""
    return -(-size[0] // 2), -(-size[1] // 2)


def _filled(stage: Stage, name: str, flow: View, back: View, bindings: dict[str, Any]) -> View:
    """Flow in which untrusted places take that of their surroundings; `bindings`: all others."""
    result = stage.sparse(f"filled {name}", "rgba16float")
    weighted = stage.sparse("weighted", "rgba32float")
    around = stage.sparse("around", "rgba32float", half_size(stage.size))
    bindings = bindings | {"flow": flow, "flow_back": back}
    _accept(stage, "weigh", weighted=weighted, **bindings)
    blurred(stage, weighted, SPREAD, around)
    _accept(stage, "fill", around=around, known=weighted, flow_out=result, **bindings)
    return result


def _accept(stage: Stage, entry: str, **bindings: Any) -> None:
    """Record an entry point of accept.wgsl, which does not use all of them."""
    names = ("flow", "flow_back", "values", "values_there", "around", "known", "planes",
             "flow_out", "weighted")  # fmt: skip
    unused: dict[str, Any] = dict.fromkeys(names)
    stage.run("accept", entry, over="near", **unused | bindings)


def _search(stage: Stage, name: str, here: list[Level], other: list[Level]) -> View:
    """Flow by itself, from the coarsest level to the finest."""
    coarse: View | None = None
    sizes = level_sizes(stage.size)
    for i in reversed(range(len(sizes))):
        grid = patch_grid(sizes[i])
        first, second = (stage.texture(f"patches {i} {k}", "rgba32float", grid) for k in "ab")
        finest, name_of_flow = i == 0, f"level flow {i} {name}"
        if finest:
            found = stage.sparse(name_of_flow, "rgba16float")
        else:
            found = stage.texture(name_of_flow, "rgba16float", flow_size(sizes[i]))
        constants = {"IS_COARSE": i >= COARSE}
        passes: list[tuple[str, Size | None, View | None, View | None, View | None]]
        passes = [("search", grid, None, first, None)]
        if finest:  # from flow that was propagated on the coarser level
            passes += [("write_finest", None, first, None, found)]
        else:
            passes += [("propagate", grid, first, second, None),
                       ("write_flow", flow_size(sizes[i]), second, None, found)]  # fmt: skip
        for entry, size, patches, patches_out, flow_out in passes:
            stage.run(
                "flow", entry, size=size, over=None if size else "near", constants=constants,
                here=here[i].gradients, there=other[i].squares, coarse=coarse, patches=patches,
                patches_out=patches_out, flow_out=flow_out,
            )  # fmt: skip
        coarse = found
    assert coarse is not None, "an image has a level"
    return coarse
