"""Three-frame reconstruction: one pixel, one time, one frame, one seed at a time."""

import itertools
from dataclasses import dataclass

import numpy as np

from twins.five_positions import NO_DEPTH, bend, depth_ratio, moved, valid
from twins.relight import gains
from twins.tap import bilinear

TILE, MOTIONS, BLOCK, SLICES = 16, 4, 4, 16
CROWDED, CROWDED_SHARE = 3.1, 0.34


@dataclass
class Layers:
    """A frame whose silhouettes are separated; arrays of (height, width[, channels])."""

    offset: float
    color: list  # front, premultiplied by coverage, and back
    trajectory: list  # velocity, half acceleration, third term, 1 where it has a kink
    depth: list  # of a neighbour, as it is in the frame itself; back: 0 where there is none
    coverage: np.ndarray
    inferred: np.ndarray  # the back layer was not seen
    by_color: np.ndarray  # of two layers, whose coverage colours may have told
    edgeless: np.ndarray  # no edge that is separated in the 3 x 3
    smooth: np.ndarray  # no edge that is seen while the shutter is open
    single: np.ndarray  # of one layer
    unsplit: np.ndarray  # the path of the pixel's own vectors
    unsplit_depth: np.ndarray


@dataclass
class Sample:
    """A sample that may be visible at a pixel at a time."""

    depth: float = np.inf  # it competes with
    true_depth: float = np.inf
    residual: float = np.inf
    at: np.ndarray | tuple = (np.nan, np.nan)
    frame: int = -1
    back: bool = False
    pixel: tuple = ()


def gather(frames, times):
    """Mean over `times`; frames: (offset, color, motion, depth), the frame itself first."""
    at = {f[0]: f for f in frames}
    span = times[0] - (times[1] - times[0]) / 2, times[-1] + (times[1] - times[0]) / 2
    longest = max(-span[0], span[1])
    duration = (span[1] - span[0]) / len(times)
    layers = [
        separate(*f, longest, prev=at.get(f[0] - 1), next=at.get(f[0] + 1)) for f in frames[1:]
    ]
    far = [layer for layer in layers if abs(layer.offset) > 1]
    unlit = separate(*frames[0], longest, prev=at.get(-1), next=at.get(1))
    for layer in layers:
        if abs(layer.offset) == 1:
            offset, color, motion, depth = at[layer.offset]
            gain = gains(unlit, layer, frames[0][1].astype(float), color.astype(float), span)
            layer.color[0][..., :3] *= gain
            at[offset] = (
                offset,
                np.concatenate([color[..., :3] * gain, color[..., 3:]], -1),
                motion,
                depth,
            )
    layers.insert(0, separate(*frames[0], longest, prev=at.get(-1), next=at.get(1), far=far))
    tiles = [tile_candidates(f, span) for f in layers]
    for frame, its_tiles in zip(layers[: len(layers) - len(far)], tiles, strict=False):
        scatter(frame, its_tiles, span, min(SLICES, len(times)), own=layers[0])
    height, width = frames[0][1].shape[:2]
    own = frames[0][1].astype(float)
    out = own.copy()
    for y in range(height):
        for x in range(width):
            here = [t[y // TILE][x // TILE] for t in tiles]
            if max(tile["longest"] for tile in here[: len(layers) - len(far)]) >= 0.01:
                edge = width_of(layers, here, span, len(times))
                seen = [
                    instant(layers, here, (x, y), t, own, (n, len(times), duration), edge)
                    for n, t in enumerate(times)
                ]
                if any(one is None for one in seen):
                    filled = hidden(layers[0], x, y, own)
                    seen = [filled if one is None else one for one in seen]
                out[y, x] = np.maximum(np.mean(seen, axis=0), 0)
    return out


# ---- silhouettes ----------------------------------------------------------------------------


def around(height, width, y, x, radius):
    """Pixels of the square around one, as far as they are in the picture."""
    for j in range(max(0, y - radius), min(height, y + radius + 1)):
        for i in range(max(0, x - radius), min(width, x + radius + 1)):
            yield j, i


def separate(offset, color, motion, depth, longest, prev=None, next=None, far=()):
    """Separate pixels that show two surfaces into a front layer and what is behind it.

    `longest`: time from the instant of the frame that is blurred, at which it is exposed. `prev`,
    `next`: the frames around, as those of `gather`; `far`: Layers of those beyond.
    """
    height, width = depth.shape
    color, motion = color.astype(float), motion.astype(float)
    z = valid(depth)
    edges, shows_third, slow, fast, mixed = np.zeros((5, height, width), bool)
    for y in range(height):
        for x in range(width):
            near = list(around(height, width, y, x, 1))
            depths = [z[p] for p in near]
            apart = np.sqrt(max(np.sum((motion[p] - motion[y, x]) ** 2) for p in near))
            beyond = (1.05**2 - 1) * min(1, max(0.1, 4 / max(apart, 1e-6)))
            edges[y, x] = apart > 0.5 and max(depths) > (1 + beyond) * min(depths)
            edges[y, x] &= apart * longest >= 0.85 or not is_ramp(motion, (y, x))
            k = 1.05**2
            shows_third[y, x] = edges[y, x] and any(
                min(depths) * k < d < max(depths) / k for d in depths
            )
            slow[y, x] = apart * longest < (8 if edges[y, x] and is_wide(z, (y, x), near) else 0.5)
            fast[y, x] = edges[y, x] and apart > 2
            mixed[y, x] = fast[y, x] and is_mixed(motion, z, (y, x), near)
    told_by_color = unfiltered(fast, mixed)
    seen = edges & ~(slow & told_by_color)
    separated = seen & ~in_crowd(shows_third)
    bends, ratios = np.zeros((height, width, 3)), np.ones((height, width))
    for y in range(height):
        for x in range(width):
            bends[y, x] = bend(motion[y, x], z[y, x], y, x, prev, next)
            ratios[y, x] = depth_ratio(offset, motion[y, x], z[y, x], y, x, prev, next)
    own = np.concatenate([motion, bends], axis=-1)
    found = [color.copy(), own.copy(), z * ratios, np.ones((height, width))]
    back = [np.zeros_like(color), own.copy(), np.zeros((height, width))]
    inferred = np.zeros((height, width), bool)
    for y, x in np.argwhere(separated):
        told = bends, ratios, told_by_color[y, x]
        parts = separate_pixel(color, motion, z, edges, y, x, told, (prev, next), far)
        if parts:
            for array, value in zip([*found, *back, inferred], parts, strict=True):
                array[y, x] = value
    edgeless, smooth = np.ones((2, height, width), bool)
    for y in range(height):
        for x in range(width):
            near = list(around(height, width, y, x, 1))
            edgeless[y, x] = not any(separated[p] for p in near)
            smooth[y, x] = not any(seen[p] for p in near)
    paths = [trajectories(found[1]), trajectories(back[1])]
    depths = [found[2], back[2]]
    return Layers(offset, [found[0], back[0]], paths, depths, found[3], inferred,
                  separated & told_by_color, edgeless, smooth,
                  ~separated, trajectories(own), z * ratios)  # fmt: skip


def is_ramp(motion, at):
    """True if motions change by 0.6 as much in the two pixels before, and after, as beside it."""
    height, width = motion.shape[:2]
    for way in ((0, 1), (1, 0)):
        places = (np.array(at) + k * np.array(way) for k in (-3, -1, 1, 3))
        m = [motion[tuple(np.clip(p, 0, (height - 1, width - 1)))] for p in places]
        before, change, after = np.diff(m, axis=0)
        if change @ change > 0.25 and min(before @ change, after @ change) > 0.6 * change @ change:
            return True
    return False


def is_wide(z, at, near):
    """True if 3 x 3 pixels are all in front, not farther than two pixels from an edge."""
    y, x = at
    z, between = np.pad(z, 2, mode="edge"), middle(z, near)
    return any(
        (z[j : j + 3, i : i + 3] < between).all() for j in range(y, y + 3) for i in range(x, x + 3)
    )


def middle(z, near):
    """A depth between the nearest and the farthest of these pixels."""
    nearest, farthest = min(z[p] for p in near), max(z[p] for p in near)
    return 1.5 * nearest if farthest >= NO_DEPTH else np.sqrt(nearest * farthest)


def is_mixed(motion, z, at, near):
    """True if motions on the pixel's own side of an edge differ by over a fifth of those across."""
    between = middle(z, near)
    off = {p: np.linalg.norm(motion[p] - motion[at]) for p in near}
    sides = [[off[p] for p in near if (z[p] < between) == side] for side in (True, False)]
    same, other = sides if z[at] < between else sides[::-1]
    return max(same) > 0.2 * max(other, default=0)


def around_tiles(size):
    """Every tile, and the 7 x 7 tiles around it."""
    for top in range(0, size[0], TILE):
        for left in range(0, size[1], TILE):
            low = max(top - 3 * TILE, 0), max(left - 3 * TILE, 0)
            yield (
                np.s_[top : top + TILE, left : left + TILE],
                np.s_[low[0] : top + 4 * TILE, low[1] : left + 4 * TILE],
            )


def in_crowd(shows_third):
    """True where over a fifth of the pixels in the tiles around show three surfaces."""
    out = np.zeros_like(shows_third)
    for tile, there in around_tiles(out.shape):
        out[tile] = shows_third[there].mean() > 0.2
    return out


def unfiltered(fast, mixed):
    """True where less than three tenths of the fast edges in the tiles around are mixed.

    In the precision of the shader: 54 of 180 are exactly as many.
    """
    out = np.zeros_like(fast)
    for tile, there in around_tiles(out.shape):
        out[tile] = mixed[there].sum() < np.float32(0.3) * np.float32(fast[there].sum())
    return out


def trajectories(motion):
    """Velocity of 14 bits; half acceleration in halves; third term in steps; 1 if it has a kink."""
    velocity = ((motion[..., 2:4] - motion[..., :2]) / 2).astype("f4")
    velocity = ((velocity.view("u4") + 512) & 0xFFFFFC00).astype("u4").view("f4").astype(float)
    half_acceleration = (motion[..., 2:4] + motion[..., :2]) / 2
    third = np.clip(np.round(motion[..., 4:6] * 32), -511, 511) / 32
    half_acceleration = half_acceleration.astype("f2").astype(float)
    return np.concatenate([velocity, half_acceleration, third, motion[..., 6:]], axis=-1)


def seen_background(around_it, motion, z, y, x):
    """Mean colour of the background that moves so as frames around show it, or None."""
    found = []
    for frame, step, back in zip(
        around_it, (motion[:2], motion[2:]), (np.s_[2:], np.s_[:2]), strict=True
    ):
        place = np.array([x, y]) + 0.5 + step
        if (
            frame is None
            or (place < 0.5).any()
            or (place > np.array(frame[3].shape[::-1]) - 0.5).any()
        ):
            continue
        j, i = int(place[1]), int(place[0])
        near = [frame[3][p] for p in around(*frame[3].shape, j, i, 1)]
        as_deep = all(d > 0 and 1 / 1.1 < valid(d) / z < 1.1 for d in near)
        if as_deep and np.hypot(*(frame[2][j, i][back].astype(float) + step)) < 1:
            found.append(bilinear(frame[1].astype(float), *place))
    return np.mean(found, axis=0) if found else None


def far_background(far, motion, z, y, x):
    """The same of frames beyond the neighbours: Layers."""
    found = []
    for frame in far:
        u, height, width = frame.offset, *frame.edgeless.shape
        path = np.concatenate([(motion[2:] - motion[:2]) / 2, (motion[2:] + motion[:2]) / 2])
        step, half_way = (path[:2] * t + path[2:] * t * t for t in (u, u / 2))
        place = np.array([x, y]) + 0.5 + step
        if (place < 0.5).any() or (place > np.array([width, height]) - 0.5).any():
            continue
        at = int(place[1]), int(place[0])
        off = moved(frame.trajectory[0][at], -np.sign(u)) + step - half_way
        as_deep = frame.smooth[at] and 1 / 1.1 < frame.depth[0][at] / z < 1.1
        if as_deep and np.hypot(*off) < 1:
            found.append(bilinear(frame.color[0], *place))
    return np.mean(found, axis=0) if found else None


def separate_pixel(color, motion, z, edges, y, x, told_around, around_it, far):
    """Front colour, path, depth, coverage; back colour, path, depth; whether it is inferred.

    Paths are a motion and a bend, that of the nearest pixel that shows this surface alone, as is
    the ratio of depths to those in the frame itself; vectors that are not filtered are those of the
    nearest pixel. `told_around`: bends and ratios of all pixels, whether vectors are not filtered.
    """
    height, width = z.shape
    inner = list(around(height, width, y, x, 1))
    between = middle(z, inner)
    outer = list(around(height, width, y, x, 2))
    nearer = [p for p in outer if z[p] < between]
    # The corners are too far away for a background.
    farther = [(j, i) for j, i in outer if z[j, i] >= between and abs((j - y) * (i - x)) < 4]
    # What is behind is as deep as the pixel itself, or as the nearest background beside it.
    beside = [(j, i) for j, i in inner if abs(j - y) + abs(i - x) == 1]
    behind_z = min(
        [z[p] for p in [(y, x)] if z[p] >= between] or [z[p] for p in beside if z[p] >= between],
        default=None,
    )
    if behind_z:
        farther = [p for p in farther if max(z[p], behind_z) <= 1.1 * min(z[p], behind_z)]
    front = [p for p in nearer if not edges[p]]
    thin = not front
    front = front or nearer
    back = [p for p in farther if not edges[p]] or farther
    if not front or not back:
        return None

    def mean(array, pixels):
        shares = [1 / (1 + ((j - y) ** 2 + (i - x) ** 2) ** 2) for j, i in pixels]
        return np.average([array[p] for p in pixels], axis=0, weights=shares)

    behind, before = mean(motion, back), mean(motion, front)
    if thin:
        shown = [p for p in inner if z[p] < between]
        purest = max(shown, key=lambda p: np.sum((motion[p] - behind) ** 2))
        before = motion[purest]
    way = before - behind
    off = motion[y, x] - behind
    off = off - np.clip(off @ way / max(way @ way, 1e-9), 0, 1) * way
    if way @ way < 0.25 or off @ off > way @ way / 16 + 0.25:  # one surface, or a third
        return None

    def nearest_pure(pixels):
        pure = [(j, i) for j, i in pixels if not edges[j, i]] or [(y, x)]
        return min(pure, key=lambda p: (p[0] - y) ** 2 + (p[1] - x) ** 2)

    if not thin and outline_rests(
        z, (y, x), nearest_pure(nearer), between, behind, before, around_it
    ):
        place = nearest_pure(farther)
        path = np.concatenate([behind, told_around[0][place]])
        front_depth = mean(z, front) * told_around[1][place]
        return color[y, x], path, front_depth, 1.0, 0 * color[y, x], path, 0.0, False

    back_depth = mean(z, back)
    seen = seen_background(around_it, behind, back_depth, y, x)
    if seen is None:
        seen = far_background(far, behind, back_depth, y, x)
    back_color = mean(color, back) if seen is None else seen
    coverage = np.clip((motion[y, x] - behind) @ way / (way @ way), 0, 1)
    has_alpha = color.shape[2] == 4
    opaque = 1.0 if thin or not has_alpha else mean(color, front)[3]
    clear = mean(color, back)[3] if has_alpha else 1.0
    shares = [(motion[p] - behind) @ way / (way @ way) for p in inner]
    is_guess = False
    bends, ratios, is_exact = told_around
    if opaque - clear > 0.5:
        coverage = np.clip((color[y, x, 3] - clear) / (opaque - clear), 0, 1)
    elif is_exact or not any(0.1 < share < 0.9 for share in shares):
        at_middle = float(z[y, x] < between) if is_exact else coverage
        apart, bent = np.linalg.norm(way), np.linalg.norm(way[:2] + way[2:])
        beyond = 0.4 if not is_exact and apart >= 16 and bent < 0.1 * apart else 0
        coverage, told = coverage_by_color(
            color[y, x], mean(color, front), back_color, at_middle, beyond
        )
        is_guess = not told and at_middle < 0.5
        if is_guess:
            coverage = np.clip(coverage, 0, front_around(z < between, y, x))
        elif not told:
            coverage = at_middle
    coverage = np.round(511 * coverage) / 511
    whole = coverage > 0.98
    front_place = purest if thin and not whole else nearest_pure(nearer)
    back_place = nearest_pure(farther)
    before = motion[y, x] if whole else before
    if is_exact:
        before = motion[min(nearer, key=lambda p: (p[0] - y) ** 2 + (p[1] - x) ** 2)]
        behind = motion[y, x] if z[y, x] >= between else behind
    if coverage < 1 - 0.98:
        back_depth = (z[y, x] if z[y, x] >= between else back_depth) * ratios[back_place]
        own = np.concatenate([motion[y, x], bends[back_place]])
        front_depth = mean(z, front) * ratios[front_place]
        before = np.concatenate([before, bends[front_place]])
        return 0.0, before, front_depth, 0.0, color[y, x], own, back_depth, False
    coverage = 1.0 if whole else coverage
    rest = color[y, x] - (1 - coverage) * back_color
    brightest = np.max([color[p] for p in [*front, (y, x)]], axis=0)
    most = 2.0 if thin else 1.2
    front_color = np.maximum(
        rest if seen is not None else np.minimum(rest, most * coverage * brightest), 0
    )
    if not whole:
        back_color = back_color + (rest - front_color) / (1 - coverage)
    if is_guess:
        front_color, back_color = coverage * color[y, x], color[y, x]
    front_path = np.concatenate([before, bends[front_place]])
    behind = np.concatenate([behind, bends[back_place]])
    front_depth = z[y, x] if whole and z[y, x] < between else mean(z, front)
    front_depth, back_depth = front_depth * ratios[front_place], back_depth * ratios[back_place]
    return front_color, front_path, front_depth, coverage, back_color, behind, back_depth, True


def outline_rests(z, at, front_at, between, behind, before, around_it):
    """True if an outline and what is behind it rest, while the surface in front moves."""

    def changes(vectors):
        """Pixels of the 5 x 5 whose side in a neighbour, where the vectors lead, is another."""
        found = 0
        size = np.array(z.shape)
        for j, i in itertools.product(range(-2, 3), repeat=2):
            px = np.array((at[0] + j, at[1] + i))
            is_front = z[tuple(np.clip(px, 0, size - 1))] < between
            for frame, step in zip(around_it, (vectors[1::-1], vectors[:1:-1]), strict=True):
                if frame is not None:
                    there = np.clip(px + np.round(step).astype(int), 0, size - 1)
                    found += (valid(frame[3][tuple(there)]) < between) != is_front
        return found

    def is_in_front(step):
        there = np.array(front_at) + np.round(0.5 * step).astype(int)
        return z[tuple(np.clip(there, 0, np.array(z.shape) - 1))] < between

    back_rests = behind @ behind < 0.25
    moves = changes(np.zeros(4)) == 0 and changes(before) > 0
    return back_rests and moves and (is_in_front(before[1::-1]) or is_in_front(before[:1:-1]))


def coverage_by_color(own, front, back, at_middle, beyond):
    """Place of a colour between two others, on the side of one half that the pixel's middle is.

    Or up to `beyond` that on the other side.

    And whether it is near the line between them; else the farther off, the less it is.
    """
    way, off = (front - back)[:3], (own - back)[:3]
    share = off @ way / max(way @ way, 1e-12)
    rest = off - share * way
    if way @ way <= 0.05**2 or rest @ rest >= way @ way / 16:
        return off @ way / max(way @ way + rest @ rest, 1e-12), False
    low, high = (0.5 - beyond, 1) if at_middle >= 0.5 else (0, 0.5 + beyond)
    return np.clip(share, low, high), True


def front_around(is_front, y, x):
    """The share of a pixel that is front if the pixels around are, evenly softened."""
    near = np.pad(is_front, 1, mode="edge")[y : y + 3, x : x + 3]
    return (near * np.outer((1, 2, 1), (1, 2, 1))).sum() / 16


# ---- tiles ----------------------------------------------------------------------------------


def parabola(paths, longest):
    """Parabolas near the paths until the time `longest`; of a kink, one of alike lengths."""
    closer = np.where(paths[..., 6:] > 0, 1.25 / max(longest, 0.01), 1.0) * paths[..., 2:4]
    straighter = paths[..., :2] + (min(0.75 * longest**2, 1) - 1) * paths[..., 4:6]
    rest = np.zeros((*paths.shape[:-1], 3))
    return np.concatenate([straighter, closer, rest], axis=-1)


def trajectory_distance(a, b, u):
    """Distance of a path, or of each of several, from another by the time `u`, before or after
    [px]."""
    return np.maximum(*(np.hypot(*moved(a - b, t).T) for t in (-u, u)))


def cluster(paths, u):
    """The longest, then always the one that is most unlike those chosen and standing still."""
    paths = parabola(np.reshape(paths, (-1, 7)), u)
    chosen, longest = [], 0.0
    for _ in range(MOTIONS):
        distances = np.min(
            [trajectory_distance(paths, c, u) for c in [np.zeros(7), *chosen]], axis=0
        )
        most = max(distances, default=0.0)
        longest = longest if chosen else most
        if most <= 0.5:
            break
        chosen.append(paths[int(np.argmax(distances))])
    return chosen, longest


def nearest_cluster(path, chosen, u):
    """Index of the chosen path, or None if it stands still rather."""
    all_ = list(chosen) + [np.zeros(7)] * (MOTIONS - len(chosen))
    best = int(np.argmin(trajectory_distance(np.array(all_), path, u)))
    return best if best < len(chosen) else None


def tile_candidates(frame, span):
    """Candidates of every tile: chosen paths, nearest first, with their times and depths."""
    height, width = frame.edgeless.shape
    u0, u1 = span[0] - frame.offset, span[1] - frame.offset
    u = max(abs(u0), abs(u1))
    rows, columns = -(-height // TILE), -(-width // TILE)
    own = {}
    for j in range(rows):
        for i in range(columns):
            box = np.s_[j * TILE : (j + 1) * TILE, i * TILE : (i + 1) * TILE]
            paths = parabola(frame.trajectory[0][box].reshape(-1, 7), u)
            z = frame.depth[0][box].ravel()
            chosen, longest = cluster(paths, u)
            depths = [np.inf] * len(chosen)
            for path, depth in zip(paths, z, strict=True):
                k = nearest_cluster(path, chosen, u)
                if k is not None:
                    depths[k] = min(depths[k], depth)
            own[j, i] = {"paths": chosen, "depths": depths, "longest": longest,
                         "edges": not frame.edgeless[box].all()}  # fmt: skip

    def sweep_interval(path, off):
        """From when to when a tile that moves along the path touches the one `off` away."""
        bend = np.hypot(*path[2:4]) * ((u1 - u0) ** 2 / 4 + 0.4)
        steps = np.linspace(0, 1, 2001)
        at = moved(path, u0) + steps[:, None] * (moved(path, u1) - moved(path, u0)) - off
        touching = steps[(np.abs(at) <= TILE + bend).all(axis=1)]
        return u0 + (u1 - u0) * touching[[0, -1]] if len(touching) else None

    def sweep_overlaps(tile, off):
        places = [np.zeros(2)] + [moved(p, t) for p in tile["paths"] for t in (u0, u1)]
        low, high = np.min(places, axis=0), np.max(places, axis=0)
        return (off + TILE + 2 > low).all() and (off - TILE - 2 < high).all()

    out = []
    for j in range(rows):
        out.append([])
        for i in range(columns):
            offs = {k: np.array([i - k[1], j - k[0]]) * TILE for k in own}
            met = [k for k in own if sweep_overlaps(own[k], offs[k])]
            candidates = [
                (path, z, sweep_interval(path, offs[k]), k)
                for k in met
                for path, z in zip(own[k]["paths"], own[k]["depths"], strict=True)
            ]
            candidates = [entry for entry in candidates if entry[2] is not None]
            chosen, _ = cluster([path for path, *_ in candidates], u)
            listed = np.array([np.zeros(7), *chosen])
            missed = [min(trajectory_distance(listed, path, u)) for path, *_ in candidates]
            reach = trajectory_distance(chosen[0], np.zeros(7), u) if chosen else 0.0
            depths = [np.inf] * len(chosen)
            times = [[np.inf, -np.inf] for _ in chosen]
            for path, z, (t_enter, t_exit), _ in candidates:
                k = nearest_cluster(path, chosen, u)
                if k is not None:
                    depths[k] = min(depths[k], z)
                    times[k] = [min(times[k][0], t_enter), max(times[k][1], t_exit)]
            order = np.argsort(depths, kind="stable")
            out[-1].append({
                "paths": [chosen[k] for k in order],
                "depths": [depths[k] for k in order],
                "times": [times[k] for k in order],
                "edges": any(own[k]["edges"] for k in met),
                "longest": max((own[k]["longest"] for k in met), default=0.0),
                "crowded": abs(frame.offset) <= 1
                and max(missed, default=0.0) > max(CROWDED, CROWDED_SHARE * reach),
                "missed": {key for (*_, key), far in zip(candidates, missed, strict=True)
                           if far > CROWDED},
                "scattered": {},
            })  # fmt: skip
    return out


def scatter(frame, tiles, span, slices, own):
    """Put the nearest pixel that is in a block at a slice of the exposure into its crowded tile.

    `tiles` get "scattered": by slice and block, the depth, rounded down to 1/64, and the pixel.
    Of 2 x 2 pixels the nearest stands for all. Of a neighbour, only what `own`, the frame itself,
    hides.
    """
    height, width = frame.edgeless.shape
    paths = frame.trajectory[0]
    moves = (np.abs(paths[..., :2]) + np.abs(paths[..., 2:4]) > 1).any(axis=-1)
    crowded = [tile["missed"] for row in tiles for tile in row if tile["crowded"]]
    sources = set().union(*crowded)
    exact = frame.depth[0].astype("f4")
    depths = (exact.view("u4") + np.uint32(256) >> 17 << 17).view("f4")
    quads = [
        min(((y, x) for y in (j, min(j + 1, height - 1)) for x in (i, min(i + 1, width - 1))),
            key=lambda at: depths[at])
        for j in range(0, height, 2) for i in range(0, width, 2)
    ]  # fmt: skip
    for k in range(slices):
        u = span[0] + (span[1] - span[0]) * (k + 0.5) / slices - frame.offset
        for y, x in (at for at in quads if moves[at] and (at[0] // TILE, at[1] // TILE) in sources):
            to = np.array([x, y]) + 0.5 + moved(paths[y, x], u)
            here = np.array([x, y]) + 0.5 + moved(paths[y, x], -frame.offset)
            shown = (here >= 0).all() and (here < (width, height)).all()
            nearer = shown and own.depth[0][int(here[1]), int(here[0])] * 1.05 < exact[y, x]
            if (to < 0).any() or (to >= (width, height)).any() or (frame.offset and not nearer):
                continue
            i, j = to.astype(int)
            tile, block = tiles[j // TILE][i // TILE], (k, j // BLOCK, i // BLOCK)
            new = depths[y, x], y, x
            if tile["crowded"] and new < tile["scattered"].get(block, (np.inf,)):
                tile["scattered"][block] = new


# ---- search ---------------------------------------------------------------------------------


def instant(layers, tiles, pixel, t, color, sample, edge):
    """The samples at the pixel at time `t`: edge, the edge behind it, the opaque one.

    `sample`: its number, how many there are, and for how long each stands. None: something that
    all frames hide.
    """
    (x, y), (n, samples, duration) = pixel, sample
    slice_ = (2 * n + 1) * min(SLICES, samples) // (2 * samples)
    (opaque, front_edge, back_edge), miss = resolve_visibility(layers, tiles, x, y, t, slice_)
    shown = []
    if is_before(front_edge, opaque):
        shown.append(front_edge)
        if is_behind(back_edge, front_edge) and is_before(back_edge, opaque):
            shown.append(back_edge)
    if np.isfinite(opaque.depth):
        shown.append(opaque)
    clear, sum_ = 1.0, 0.0
    for s in shown:
        got, cover = fetch(layers[s.frame], s, edge, (t, duration))
        sum_ = sum_ + clear * got
        clear *= 1 - cover
    if clear < 0.5:
        return sum_ / (1 - clear)
    at = np.array([x + 0.5, y + 0.5]) - moved(layers[0].trajectory[0][y, x], t)
    size = np.array(color.shape[1::-1])
    is_inside = (at >= 0).all() and (at < size).all()
    if is_inside and miss > 8:
        return None
    if is_inside:  # its surface goes on behind something nearer
        z = layers[0].depth[0]
        if z[int(at[1]), int(at[0])] * 1.05 < z[y, x]:
            return color[y, x]
    return bilinear(color, *(at if is_inside else at_border(at, size, n)))


def at_border(at, size, n):
    """The place at the border that stands for one beyond it, for sample `n` of the exposure."""
    nearest = np.clip(at, 0.5, size - 0.5)
    beyond = np.abs(at - nearest)
    along = np.array([0.0, 1.0] if beyond[0] > beyond[1] else [1.0, 0.0])
    return nearest + max(beyond) / 2 * (2 * ((0.618034 * n + 0.5) % 1) - 1) * along


def hidden(frame, x, y, color):
    """Mean of the nearest surfaces behind the pixel's own, in eight directions."""
    height, width = frame.edgeless.shape
    sum_, total = 0.0, 0.0
    for angle in np.arange(8) * np.pi / 4:
        for distance in 2 ** (np.arange(13) / 2):
            i = int(np.floor(x + 0.5 + distance * np.cos(angle)))
            j = int(np.floor(y + 0.5 + distance * np.sin(angle)))
            if not (0 <= i < width and 0 <= j < height):
                continue
            if frame.edgeless[j, i] and frame.depth[0][j, i] > 1.1 * frame.depth[0][y, x]:
                sum_ = sum_ + frame.color[0][j, i] / distance**0.5
                total += 1 / distance**0.5
                break
    return sum_ / total if total else color[y, x]


def resolve_visibility(layers, tiles, x, y, t, slice_):
    """The nearest opaque sample at the pixel at time `t`, the nearest two at silhouettes.

    And how far from the pixel the nearest of the searches along its own path ended [px].
    """
    centre = np.array([x + 0.5, y + 0.5])
    near = [f for f, frame in enumerate(layers) if abs(frame.offset) <= 1]
    far = list(range(len(near), len(layers)))
    order = [0, 2, 1] if len(near) == 3 and t > 0 else near
    far = far[::-1] if t > 0 else far
    seen, misses = [Sample(), Sample(), Sample()], []

    def search_layer(f, back, seed=None, nearest=0.0, first=None):
        """One search from a seed, whose depth is at least `nearest`; where it led, and how deep."""
        frame, u = layers[f], t - layers[f].offset
        if seed is None:  # along the path of the pixel's place; behind it too
            seed = moved(frame.trajectory[int(back and f > 0)][y, x], u)
        d, residual, pixel = iterate_fixed_point(
            frame.trajectory[int(back)], frame.depth[int(back)], centre, seed, u, nearest, first
        )
        at, size = centre - d, np.array(frame.edgeless.shape[::-1])
        most = 0.5 if f else 1.0
        is_there = pixel is not None and residual <= most and (at >= 0).all() and (at < size).all()
        if first is None and not back and f not in far:
            misses.append(residual)
        z = frame.depth[int(back)][pixel] if is_there else 0.0
        if is_there and not is_again(d, z, first) and z > 0:
            weight = (1.1 if f else 1.0) * (1.2 if back and frame.inferred[pixel] else 1.0)
            found = Sample(z * weight, z, residual, at, f, back, pixel)
            is_opaque = back or frame.edgeless[pixel]
            same = abs(t) < 0.0625 and z < seen[1].true_depth * 1.3
            again = f > 0 and (not is_opaque or same) and seen[1].frame == 0
            covered = f > 0 and is_covered(layers[0], x, y, found.true_depth, t)
            if not covered and (not (f in far or again) or is_hidden(layers[0], frame, found)):
                record(seen, found, is_opaque)
        if not is_there:
            return np.full(2, np.inf), np.inf
        return d, z if frame.edgeless[pixel] else 0.0

    def search_front(f):
        tile, u = tiles[f], t - layers[f].offset
        own = search_layer(f, False)
        z, *pixel = tile["scattered"].get((slice_, y // BLOCK, x // BLOCK), (np.inf,))
        if z * (1.1 if f else 1.0) < seen[0].depth:
            search_layer(f, False, moved(layers[f].trajectory[0][tuple(pixel)], u), z, own)
        for path, z, when in zip(tile["paths"], tile["depths"], tile["times"], strict=True):
            if z * (1.1 if f else 1.0) < seen[0].depth and when[0] <= u <= when[1]:
                search_layer(f, False, moved(path, u), z, own)

    def inferred():
        own_back = (seen[0].frame, seen[0].back) == (0, True)
        return np.isinf(seen[0].depth) or (own_back and layers[0].inferred[seen[0].pixel])

    search_front(0)
    hidden = np.isinf(seen[0].depth)
    behind = hidden and any(tiles[f]["edges"] for f in near)
    if behind:
        search_layer(0, True)
    if len(order) > 1 and ((hidden and not is_complement(layers[0], seen[0], t)) or abs(t) > 0.25):
        search_front(order[1])
        if len(order) > 2 and inferred():
            search_front(order[2])
        for f in far:
            if np.isinf(seen[0].depth):
                search_front(f)
        for f in order[1:]:
            if behind and inferred() and (np.isinf(seen[0].depth) or np.isinf(seen[1].depth)):
                search_layer(f, True)
    return seen, min(misses)


def is_complement(own, found, t):
    """True if a back of the frame itself makes up a colour with a front of uncertain coverage.

    Until the time `t` that front has moved by less than 2 px.
    """
    if (found.frame, found.back) != (0, True):
        return False
    p = nearest(own, found.at)
    return own.by_color[p] and np.hypot(*moved(own.trajectory[0][p], t)) < 2


def is_hidden(own, frame, found):
    """True if a frame hides a sample of another at its own instant, or does not hold its place."""
    height, width = own.edgeless.shape
    here = found.at + moved(frame.trajectory[0][nearest(frame, found.at)], -frame.offset)
    if not (0 <= here[0] < width and 0 <= here[1] < height):
        return True
    return own.depth[0][int(here[1]), int(here[0])] * 1.05 < found.true_depth


def is_covered(own, x, y, z, t):
    """True if the last own surface of a pixel, before the depth z, goes on behind another."""
    layer = int(own.depth[1][y, x] > 0)
    step = moved(own.trajectory[layer][y, x], t)
    i, j = np.floor(np.array([x, y]) + 0.5 - step).astype(int)
    is_inside = 0 <= i < own.depth[0].shape[1] and 0 <= j < own.depth[0].shape[0]
    if not is_inside or abs(t) >= 0.25 or np.hypot(*step) >= 5:
        return False
    return own.depth[0][j, i] * 1.3 < own.depth[layer][y, x] < z / 1.3


def is_again(d, z, first):
    """True if it is where the first search led, and not clearly nearer than what that found."""
    return first is not None and (np.abs(d - first[0]) < 0.75).all() and z * 1.05 >= first[1]


def iterate_fixed_point(paths, depth, centre, seed, u, nearest, first):
    """Fixed point of d = displacement(centre - d) from a seed on: d, the last step, pixel."""
    height, width = paths.shape[:2]
    d, steps = seed, 6 if first is None else 4
    residual, pixel, before = np.inf, None, 0j
    if is_again(d, nearest, first):
        return d, residual, pixel
    for n in range(steps):
        q = centre - d
        if not (0 <= q[0] < width and 0 <= q[1] < height):
            return d, np.inf, None
        pixel = int(q[1]), int(q[0])
        step = moved(paths[pixel], u)
        back = np.inf if first is None else 0.75 * np.hypot(*(d - first[0]))
        way = complex(*(step - d))
        residual, d = abs(way), step
        if residual < 0.5 or residual > back:  # there, or astray
            break
        if is_again(d, depth[pixel], first):
            break
        if (
            n < steps - 1
            and 0.5 < abs(way) / max(abs(before), 1e-6) < 2.2
            and abs(before - way) > abs(before) / 4
        ):
            rest = way**2 / (before - way)  # of a geometric series
            d, before = d + np.array([rest.real, rest.imag]), 0j
        else:
            before = way
    return d, residual, pixel


def record(seen, new, is_opaque):
    """Keep what is nearest."""
    opaque, front_edge, back_edge = seen
    if is_opaque:
        if new.depth < opaque.depth:
            seen[0] = new
        return
    if new.depth < front_edge.depth:
        seen[1:] = [new, front_edge if is_behind(front_edge, new) else back_edge]
    elif new.depth < back_edge.depth and is_behind(new, front_edge):
        seen[2] = new


def is_behind(new, old):
    """True if it is another surface; neighbouring frames show the same one again."""
    return new.depth >= old.depth * 1.05 * (1.0 if new.frame == old.frame else 1.1)


def is_before(edge, opaque):
    """True if an edge is of another surface, before the opaque sample."""
    apart = np.hypot(*np.subtract(edge.at, opaque.at)) > 2 and edge.frame == opaque.frame
    return edge.depth < opaque.depth / (1.0 if apart else 1.05)


def width_of(layers, tiles, span, samples):
    """The width of edges between two texels: half the motion from sample to sample."""
    near = [f for f, layer in enumerate(layers) if abs(layer.offset) <= 1]
    lengths = [tiles[f]["longest"] / max(abs(t - layers[f].offset) for t in span) for f in near]
    return np.clip(0.5 * (span[1] - span[0]) * max(lengths) / samples, 0.667, 1)


def fetch(frame, s, edge, stratum):
    """Mean colour and coverage of a sample over the `stratum`: a time, and how long it lasts."""
    (t, duration), k = stratum, int(s.back)
    path, u = frame.trajectory[k][nearest(frame, s.at)], t - frame.offset
    way = moved(path, u + duration / 2) - moved(path, u - duration / 2)
    if not s.back and frame.edgeless[s.pixel]:
        return passing(frame, s, way), 1.0
    length = np.hypot(*way)
    off = min(np.sqrt(max(length**2 / 12 - edge**2 / 2, 0)), 0.5)
    places = [s.at + sign * off * way / max(length, 1e-6) for sign in (1, -1)]
    *color, cover = np.mean([np.append(*texels(frame, s, at, edge)) for at in places], axis=0)
    color = np.array(color)
    if s.back and cover > 1e-4:
        return color / cover, 1.0
    return color, cover


def passing(frame, s, way):
    """Colour of a smooth surface; on a long way, of two places, as far as they show it."""
    z, seen = frame.depth[0][nearest(frame, s.at)], []
    for side in (-0.25, 0.25) if np.hypot(*way) > 1.5 else (0,):
        at = s.at + side * way
        p = nearest(frame, at)
        if not (frame.edgeless[p] and z / 1.3 < frame.depth[0][p] < 1.3 * z):
            at = s.at
        smooth = frame.offset == 0 and frame.smooth[nearest(frame, at)]
        seen.append((cubic if smooth else bilinear)(frame.color[0], *at))
    return np.mean(seen, axis=0)


def nearest(frame, at):
    """The pixel of a frame nearest to a place."""
    height, width = frame.edgeless.shape
    i, j = np.clip(at, 0, (width - 1, height - 1)).astype(int)
    return j, i


def texels(frame, s, at, edge):
    """Colour and coverage at a place of a sample, from the texels of its own surface."""
    height, width = frame.edgeless.shape
    corner = np.floor(at - 0.5).astype(int)
    color, cover = np.zeros_like(frame.color[0][0, 0]), 0.0
    for dj in (0, 1):
        for di in (0, 1):
            i, j = corner[0] + di, corner[1] + dj
            line = 1 - np.abs(at - 0.5 - (i, j))
            share = np.prod(np.clip((line - 0.5) / edge + 0.5, 0, 1))
            p = min(max(j, 0), height - 1), min(max(i, 0), width - 1)
            z, behind = frame.depth[0][p], frame.depth[1][p] > 0
            if s.back and behind:
                color, cover = color + share * frame.color[1][p], cover + share
            elif s.true_depth / 1.3 <= z <= 1.3 * s.true_depth:
                color = color + share * frame.color[0][p]
                cover += share * (1.0 if s.back else frame.coverage[p])
    return color, cover


def cubic(image, x, y):
    """Catmull-Rom: the line between texels, bent by the second differences of the nearest one.

    Slopes are at most twice the lesser of the two texels.
    """

    def slope(a, b):
        most = 4 * np.minimum(np.abs(a), np.abs(b))
        return np.clip(b - a, -most, most)

    height, width = image.shape[:2]
    i, j = int(np.clip(x, 0, width - 1)), int(np.clip(y, 0, height - 1))
    left, right = image[j, max(i - 1, 0)], image[j, min(i + 1, width - 1)]
    above, below = image[max(j - 1, 0), i], image[min(j + 1, height - 1), i]
    here = image[j, i]
    across = slope(here, right) - slope(left, here)
    down = slope(here, below) - slope(above, here)
    f, g = (x - 0.5) % 1, (y - 0.5) % 1
    line = bilinear(image, x, y)
    return line - (f * (1 - f) * across + g * (1 - g) * down) / 2
