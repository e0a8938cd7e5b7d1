"""Small lights, clipped at white: matched as a short list, because the coarse levels lose them."""

from __future__ import annotations

from functools import reduce

import numpy as np
import wgpu

from ..gpu import wgsl
from .passes import STATES, Bindings, FlowPasses

WHITE = 245  # of 255: the least of all colours of a light
LEAST = 3  # px across a light
APART = 2  # centres closer than this [px] are of one light
MOST_LIGHTS = 64  # of a frame; a picture with more has texture, not lights
REACH = 0.2  # of the longer side: the longest motion along an axis
UNEVEN, UNEVEN_SHARE = 3.0, 0.15  # most change of the motion [px], and of its length
NEARER = 0.1  # px of bend that a pixel of displacement counts as
UNLIKE = 0.25  # difference of sizes, as a share, besides 1 px
Ways = list[tuple[int, np.ndarray]]


def find_lights(values: np.ndarray, largest: int) -> np.ndarray:
    """(count, 4) centre x, y [px], width and height of the white spots up to `largest` pixels.

    `values`: (height, width, 3 or more) bytes. Empty if there are too many.
    """
    colors = (values[..., i] for i in range(min(values.shape[2], 3)))
    white = reduce(np.minimum, colors) >= WHITE  # many times as quick as the least along an axis
    if not white.any():
        return np.zeros((0, 4))
    columns: dict[int, list[tuple[float, int]]] = {}
    for x, y, high in _runs(white.T, largest):
        columns.setdefault(int(x), []).append((y, high))
    spots: list[tuple[float, float, int, int]] = []
    for y, x, wide in _runs(white, largest):
        for column in {int(x), int(np.ceil(x))}:
            for middle, high in columns.get(column, []):
                if abs(middle - y) <= 0.5:
                    spots.append((x, middle, wide, high))
    kept: list[tuple[float, float, int, int]] = []
    for spot in sorted(set(spots)):
        if all(max(abs(spot[0] - o[0]), abs(spot[1] - o[1])) > APART for o in kept):
            kept.append(spot)
    return np.array(kept if len(kept) <= MOST_LIGHTS else []).reshape(-1, 4)


def _runs(white: np.ndarray, largest: int) -> np.ndarray:
    """(count, 3) row, middle and length of the runs of white along rows."""
    steps = np.diff(np.pad(white, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begin = np.nonzero(steps == 1)
    _, end = np.nonzero(steps == -1)
    is_small = (end - begin >= LEAST) & (end - begin <= largest)
    return np.stack([row, (begin + end - 1) / 2, end - begin], axis=1)[is_small]


def follow_lights(
    here: np.ndarray, near: np.ndarray, far: np.ndarray, factor: float, longest: int
) -> np.ndarray:
    """(count, 8) of lights: centre, half width and height, flow to the near frame, and bend.

    `here`, `near`, `far`: their lights, as `find_lights` gives them; `factor`: the displacement to
    the far frame over that to the near one. Lights that are seen in all three and move evenly come
    first; the others are matched with those left in one of them, the nearest first.
    """
    pairs = []
    for n, light in enumerate(here):
        ahead, behind = (_ways(light, others, REACH * longest) for others in (near, far))
        for i, way in ahead:
            for j, back in behind:
                bend, length = back - factor * way, np.hypot(*way)
                if np.hypot(*bend) <= UNEVEN + UNEVEN_SHARE * length:
                    pairs.append((np.hypot(*bend) + NEARER * length, n, i, j, way, bend))
    found: dict[int, np.ndarray] = {}
    taken: tuple[set[int], set[int]] = set(), set()
    for _, n, i, j, way, bend in sorted(pairs, key=lambda pair: pair[:4]):
        if n not in found and i not in taken[0] and j not in taken[1]:
            found[n] = np.concatenate([here[n] * [1, 1, 0.5, 0.5], way, bend])
            taken[0].add(i)
            taken[1].add(j)
    single = [
        (np.hypot(*way), n, side, k, way / by)
        for side, (others, by) in enumerate(((near, 1.0), (far, factor)))
        for n, light in enumerate(here)
        for k, way in _ways(light, others, REACH * longest)
    ]
    for _, n, side, k, flow in sorted(single, key=lambda one: one[:4]):
        if n not in found and k not in taken[side]:
            found[n] = np.concatenate([here[n] * [1, 1, 0.5, 0.5], flow, [0, 0]])
            taken[side].add(k)
    return np.array(list(found.values()), np.float32).reshape(-1, 8)


def _ways(light: np.ndarray, others: np.ndarray, reach: float) -> Ways:
    """Numbers of the lights of another frame that may be the same, and the way to each [px]."""
    way = others[:, :2] - light[:2]
    alike = np.abs(others[:, 2:] - light[2:]) <= 1 + UNLIKE * light[2:]
    may = alike.all(axis=1) & (np.abs(way) <= reach).all(axis=1)
    return [(int(k), way[k]) for k in np.flatnonzero(may)]


def move_lights(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    lights: np.ndarray,
) -> wgpu.GPUTexture:
    """States in which the lights that the search missed move; the given ones are taken back.

    `lights`: the result of `follow_lights`; `matched`: the bindings of match.wgsl.
    """
    if not len(lights):
        return states
    data = np.zeros(len(lights), wgsl.load("flow/lights.wgsl").dtype("Light"))
    for k, name in enumerate(("at", "reach", "flow", "bend")):
        data[name] = lights[:, 2 * k : 2 * k + 2]
    buffer = passes.device.create_buffer_with_data(
        label="lights", data=data, usage=wgpu.BufferUsage.STORAGE
    )
    output = passes.take(size, STATES)
    passes.run("lights.wgsl", "main", size, lights=buffer, states=states, output=output, **matched)
    passes.give(states)
    return output
