"""Flow between two pictures of what moves over surfaces, both ways, and how far it is trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import wgpu

from ....gpu import wgsl
from .changes import View
from .stage import FOLDER, Stage

COARSEST = 20  # px along the longer side of the coarsest level, at least
SPREAD, GUARD = 5.0, 4.0  # [px] sigma of the fill, and of where motion has to explain the change


@dataclass(frozen=True)
class LightFlow:
    """Flow from the frame to a neighbour and back [px], with trust; and what it explains."""

    ahead: View
    back: View
    explained: View


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width, height of every level of a pyramid, the frame's own first."""
    sizes = [size]
    while max(sizes[-1]) >= 2 * COARSEST:
        sizes.append((-(-sizes[-1][0] // 2), -(-sizes[-1][1] // 2)))
    return sizes


def patch_grid(size: tuple[int, int]) -> tuple[int, int]:
    """Patches across and down a level, as patches_along() of flow.wgsl."""
    source = wgsl.load(f"{FOLDER}/flow.wgsl")
    patch, stride = (int(source.constant(name)) for name in ("PATCH", "STRIDE"))
    across, down = (max(n - patch + stride - 1, 0) // stride + 1 for n in size)
    return across, down


def grids(size: tuple[int, int]) -> list[tuple[int, int]]:
    """The sizes of all passes: of levels and of patches."""
    sizes = level_sizes(size)
    return list(dict.fromkeys([*sizes, *map(patch_grid, sizes)]))


def pyramid(stage: Stage, name: str, source: View) -> list[View]:
    """All levels of the picture of `source`."""
    levels: list[View] = []
    for i, size in enumerate(level_sizes(stage.size)):
        level = stage.texture(f"level {i} {name}", "rgba16float", size)
        stage.run("pyramid", "halve" if i else "begin", size=size,
                  source=levels[-1] if i else source, level=level)  # fmt: skip
        levels.append(level)
    return levels


def flow(
    stage: Stage, side: int, here: tuple[View, list[View]], neighbour: tuple[View, list[View]],
    depth: View, linear: wgpu.GPUSampler,
) -> LightFlow:  # fmt: skip
    """Flow to the neighbour at the offset `side`; `here`, `neighbour`: values and their pyramid.

    `depth`: of the frame itself, over whose surfaces both move.
    """
    raw = {
        True: _search(stage, "ahead", here[1], neighbour[1], linear),
        False: _search(stage, "back", neighbour[1], here[1], linear),
    }
    given = {
        ahead: {"values": own[0], "values_there": other[0], "depth": depth, "linear": linear}
        for ahead, own, other in ((True, here, neighbour), (False, neighbour, here))
    }
    names = {True: f"ahead {side}", False: f"back {side}"}
    filled = {
        ahead: _filled(stage, names[ahead], raw[ahead], raw[not ahead], given[ahead])
        for ahead in (True, False)
    }
    trusted = {}
    for ahead in (True, False):
        trusted[ahead] = stage.texture(f"flow {names[ahead]}", "rgba16float")
        stage.run(
            "accept", "trust", flow=filled[ahead], flow_back=filled[not ahead],
            around=stage.none("rgba32float"), flow_out=trusted[ahead],
            weighted=stage.texture("weighted", "rgba32float"), **given[ahead],
        )  # fmt: skip
    explained = stage.texture(f"explained {side}", "rgba32float")
    if not stage.pulled:
        differences = stage.texture("weighted", "rgba32float")
        stage.run(
            "explain", flow=trusted[True], flow_back=trusted[False], values=here[0],
            values_there=neighbour[0], linear=linear, differences=differences,
        )  # fmt: skip
        blurred(stage, differences, GUARD, explained)
    return LightFlow(trusted[True], trusted[False], explained)


def blurred(stage: Stage, source: View, sigma: float, output: View) -> None:
    """A Gaussian of `sigma` [px]."""
    half = stage.texture("half blurred", "rgba32float")
    given: dict[str, Any] = {"constants": {"SIGMA": sigma}, "found": stage.change_flags}
    stage.run("blur", "across", source=source, output=half, **given)
    stage.run("blur", "down", source=half, output=output, **given)


def _filled(stage: Stage, name: str, flow: View, back: View, bindings: dict[str, Any]) -> View:
    """Flow in which that around it stands for what is not trusted; `bindings`: all others."""
    known, result = (stage.texture(n, "rgba16float") for n in ("known", f"filled {name}"))
    weighted, around = (stage.texture(n, "rgba32float") for n in ("weighted", "around"))
    bindings = bindings | {"flow_back": back}
    stage.run("accept", "trust", flow=flow, around=stage.none("rgba32float"), flow_out=known,
              weighted=weighted, **bindings)  # fmt: skip
    blurred(stage, weighted, SPREAD, around)
    stage.run("accept", "fill", flow=known, around=around, flow_out=result, weighted=weighted,
              **bindings)  # fmt: skip
    return result


def _search(stage: Stage, name: str, here: list[View], other: list[View], linear) -> View:
    """Flow by itself, from the coarsest level to the finest."""
    coarse = stage.none("rgba16float")
    sizes = level_sizes(stage.size)
    for i in reversed(range(len(sizes))):
        grid = patch_grid(sizes[i])
        first, second = (stage.texture(f"patches {i} {k}", "rgba32float", grid) for k in "ab")
        found = stage.texture(f"level flow {i} {name}", "rgba16float", sizes[i])
        no_patches, no_flow = stage.unused("rgba32float"), stage.unused("rgba16float")
        for entry, size, patches, patches_out, flow_out in (
            ("search", grid, stage.none("rgba32float"), first, no_flow),
            ("propagate", grid, first, second, no_flow),
            ("propagate", grid, second, first, no_flow),
            ("write_flow", sizes[i], first, no_patches, found),
        ):
            if entry == "propagate" and i == 0:
                continue  # patches of the coarser level were
            stage.run(
                "flow", entry, size=size, constants={"FINEST": i == 0}, here=here[i],
                there=other[i], coarse=coarse, patches=patches, linear=linear,
                patches_out=patches_out, flow_out=flow_out, changes=stage.change_flags,
            )  # fmt: skip
        coarse = found
    return coarse
