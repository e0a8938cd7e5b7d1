"""Light that moves over surfaces, a stage at a time: the slow and obvious form of wgsl/.../shading.

Arrays are (height, width[, channels]); an image position is x, y [px], of a pixel's middle n + 0.5.
"""

import numpy as np

NO_DEPTH = 2.0**33
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
PATCH, STRIDE, STEPS = 12, 4, 8


def shifted(a, dx, dy):
    """The values dx, dy pixels further on; edges repeat."""
    y = np.clip(np.arange(a.shape[0]) + dy, 0, a.shape[0] - 1)
    x = np.clip(np.arange(a.shape[1]) + dx, 0, a.shape[1] - 1)
    return a[y][:, x]


def sampled(a, x, y):
    """Bilinear, edges repeat."""
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    u, v = x - 0.5 - left, y - 0.5 - top
    total = 0.0
    for j in (0, 1):
        for i in (0, 1):
            row = np.clip(top + j, 0, a.shape[0] - 1).astype(int)
            column = np.clip(left + i, 0, a.shape[1] - 1).astype(int)
            share = (u if i else 1 - u) * (v if j else 1 - v)
            total = total + a[row, column] * (share[..., None] if a.ndim == 3 else share)
    return total


def centres(size):
    """x, y of all pixels' middles; `size`: height, width."""
    y, x = np.mgrid[: size[0], : size[1]]
    return x + 0.5, y + 0.5


def dark(pulled):
    return 0.05 if pulled else 0.02


def plain(depth, motion):
    """True at pixels that show one surface."""
    depth = np.where(np.isfinite(depth) & (depth > 0), np.minimum(depth, NO_DEPTH), NO_DEPTH)
    near = [shifted(depth, i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    moved = [((shifted(motion, i, j) - motion) ** 2).sum(2) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    low, high = np.min(near, 0), np.max(near, 0)
    return ~((high > low * 1.05**2) | ((high > low * 1.01) & (np.max(moved, 0) > 1)))


def cubic(a, x, y):
    """Catmull and Rom's interpolation."""
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    u, v = x - 0.5 - left, y - 0.5 - top
    total = 0.0
    for j in range(4):
        for i in range(4):
            row = np.clip(top + j - 1, 0, a.shape[0] - 1).astype(int)
            column = np.clip(left + i - 1, 0, a.shape[1] - 1).astype(int)
            total = total + a[row, column] * (_weight(u, i) * _weight(v, j))[..., None]
    return np.maximum(total, 0)


def _weight(u, i):
    return (
        ((-0.5 * u + 1) * u - 0.5) * u,
        (1.5 * u - 2.5) * u * u + 1,
        ((-1.5 * u + 2) * u + 0.5) * u,
        (0.5 * u - 0.5) * u * u,
    )[i]


def reduced(frame, scale):
    """The frame with a pixel for every square: its mean light, depth and motion of the nearest."""
    squares = {}
    for name, array in frame.items():
        rows, columns = (np.arange(-(-n // scale) * scale) for n in array.shape[:2])
        whole = array[np.minimum(rows, array.shape[0] - 1)][
            :, np.minimum(columns, array.shape[1] - 1)
        ]
        parts = whole.reshape(len(rows) // scale, scale, len(columns) // scale, scale, -1)
        parts = np.swapaxes(parts, 1, 2)
        squares[name] = parts.reshape(*parts.shape[:2], scale * scale, -1)
    nearest = np.argmin(squares["depth"], axis=2)[:, :, None]
    depth, motion = (
        np.take_along_axis(squares[n], nearest, 2)[:, :, 0] for n in ("depth", "motion")
    )
    return {"light": squares["light"].mean(2), "depth": depth[..., 0], "motion": motion / scale}


def measure(here, there, side, pulled=False, resting=False):
    """log(light there) - log(light here), and whether it is seen; frames: light, depth, motion."""
    way = here["motion"][..., 2:] if side > 0 else here["motion"][..., :2]
    back_there = there["motion"][..., :2] if side > 0 else there["motion"][..., 2:]
    height, width = here["depth"].shape
    x, y = centres((height, width))
    x, y = x + way[..., 0], y + way[..., 1]
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    row = np.clip(np.floor(y), 0, height - 1).astype(int)
    column = np.clip(np.floor(x), 0, width - 1).astype(int)
    back = way + sampled(back_there, x, y)
    a, b = here["depth"], there["depth"][row, column]
    seen = inside & (np.maximum(a, b) < 1.15 * np.minimum(a, b)) & ((back**2).sum(2) < 1)
    whole = [plain(f["depth"], f["motion"]) for f in (here, there)]
    whole = [np.min([shifted(w, i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)], 0) for w in whole]
    seen &= whole[0] & whole[1][row, column]
    if resting:
        seen &= np.all([np.abs(frame["motion"]) < 0.05 for frame in (here, there)], axis=(0, 3))
    e = dark(pulled)
    change = np.log(cubic(there["light"], x, y) + e) - np.log(here["light"] + e)
    return np.where(seen[..., None], change, 0), seen


def gauss(a, sigma, radius):
    """A Gaussian over a square of pixels; edges repeat."""
    total, weights = 0.0, 0.0
    for j in range(-radius, radius + 1):
        for i in range(-radius, radius + 1):
            weight = np.exp(-0.5 * (i * i + j * j) / sigma**2)
            total, weights = total + weight * shifted(a, i, j), weights + weight
    return total / weights


def limited(change, seen, light, albedo, pulled=False):
    """The changes that count."""
    if not pulled:
        mask = seen.astype(float)
        spread = gauss(change * mask[..., None], 0.5, 1)
        share = gauss(mask, 0.5, 1)
        change = np.where(seen[..., None], spread / np.maximum(share, 1e-6)[..., None], 0)
    brighter = np.maximum(light, (light + dark(pulled)) * np.exp(change) - dark(pulled))
    shown = np.minimum(albedo.mean(2) * brighter.mean(2) / 0.02, 1)
    peak = np.abs(gauss(change @ LUMINANCE, 1, 3)) * shown
    peak = np.max([shifted(peak, i, j) for j in range(-2, 3) for i in range(-2, 3)], 0)
    gain = gauss(np.clip((peak - 0.1) / 0.1, 0, 1), 1, 3) * seen
    return np.clip(change * gain[..., None], -4, 4)


def creases(depth):
    """True where a surface turns."""
    found = np.zeros(depth.shape, bool)
    for by in ((1, 0), (0, 1)):
        around = np.array([shifted(depth, -by[0], -by[1]), depth, shifted(depth, *by)])
        same = around.max(0) < 1.06**2 * around.min(0)
        turn = np.abs(depth / around[0] + depth / around[2] - 2)
        found |= same & (turn > max(2 / depth.shape[1], 0.004))
    return found


def without_noise(level, depth):
    """The mean of 3 x 3 pixels of the same surface, but for the brightest one."""
    near = [(i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    z = np.array([shifted(depth, *by) for by in near])
    same = (np.maximum(z, depth) < 1.06 * np.minimum(z, depth))[..., None]
    around = np.array([shifted(level, *by) for by in near])
    count = np.sum(same, 0)
    rest = np.sum(np.where(same, around, 0), 0) - np.max(np.where(same, around, -np.inf), 0)
    return np.where(count > 1, rest / np.maximum(count - 1, 1), level)


def closed(light, depth, before, after, steps):
    """The brightest light around on the same surface, as a logarithm."""
    sends = ~creases(depth)
    state = without_noise(np.log(light + 0.02), depth) + np.maximum(0, np.maximum(before, after))
    for sign in (1, -1):
        for _ in range(steps):
            most = sign * state
            for by in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                z = shifted(depth, *by)
                same = np.maximum(z, depth) < 1.06 * np.minimum(z, depth)
                same &= shifted(sends, *by)
                near = sign * shifted(state, *by)
                most = np.where(same[..., None], np.maximum(most, near), most)
            state = sign * most
    return state


def values(light, before, after, bright, change, pulled=False):
    """Darkness, or levels of light, of a frame; and how much of it."""
    level = np.log(light + dark(pulled))
    most = np.maximum(0, np.maximum(before, after))
    if pulled:
        median = before + after - most - np.minimum(0, np.minimum(before, after))
        return np.dstack([level + change, np.abs(median - change).max(2)])
    darkness = 1 - np.exp(change - np.maximum(most, bright - level))
    return np.dstack([darkness, np.maximum(darkness @ LUMINANCE, 0)])


def first_level(found, pulled=False):
    """Brightness and its gradient."""
    return _level(0.2 * (found[..., :3] @ LUMINANCE) if pulled else np.exp(-found[..., 3]) - 1)


def next_level(level):
    """The same at half the size."""
    height, width = level.shape[:2]
    y, x = np.mgrid[-1 : (height + 1) // 2 + 1, -1 : (width + 1) // 2 + 1]
    a, b = np.clip(2 * y, 0, height - 1), np.clip(2 * x, 0, width - 1)
    below, right = np.minimum(a + 1, height - 1), np.minimum(b + 1, width - 1)
    v = level[..., 0]
    wide = (v[a, b] + v[a, right] + v[below, b] + v[below, right]) / 4
    middle = wide[1:-1, 1:-1]
    across, down = wide[1:-1, 2:] - wide[1:-1, :-2], wide[2:, 1:-1] - wide[:-2, 1:-1]
    return np.dstack([middle, across / 2, down / 2])


def squares(level):
    """Brightness of 2 x 2 pixels from each one on."""
    v = level[..., 0]
    return np.dstack([shifted(v, i, j) for j in (0, 1) for i in (0, 1)])


def _level(v):
    across, down = shifted(v, 1, 0) - shifted(v, -1, 0), shifted(v, 0, 1) - shifted(v, 0, -1)
    return np.dstack([v, across / 2, down / 2])


class Patch:
    """A patch of a level, which is looked for in another one."""

    def __init__(self, here, there, index, apart=1):
        """`apart`: from one of its pixels that is compared to the next."""
        height, width = here.shape[:2]
        self.x, self.y = (
            max(min(STRIDE * i, n - PATCH), 0) for i, n in zip(index, (width, height), strict=True)
        )
        rows = np.minimum(self.y + np.arange(0, PATCH, apart), height - 1)
        columns = np.minimum(self.x + np.arange(0, PATCH, apart), width - 1)
        self.px, self.py = np.meshgrid(columns + 0.5, rows + 0.5)
        block = here[rows][:, columns]
        self.own, self.gradient, self.there = block[..., 0], block[..., 1:3], there[..., 0]
        gx, gy = self.gradient[..., 0], self.gradient[..., 1]
        m = np.array([[(gx * gx).sum(), (gx * gy).sum()], [(gx * gy).sum(), (gy * gy).sum()]])
        self.is_flat = np.trace(m) < 1e-5 * self.own.size
        self.inverse = np.linalg.inv(m + (0.001 * np.trace(m) + 1e-9) * np.eye(2))

    def compare(self, flow):
        """The squared difference without means, and the step that makes it less."""
        d = sampled(self.there, self.px + flow[0], self.py + flow[1]) - self.own
        d = d - d.mean()
        force = (self.gradient * d[..., None]).sum((0, 1))
        return (d * d).sum(), -self.inverse @ force

    def best(self, flows):
        """The best of several starts, and where it leads."""
        tried = [(np.asarray(flow), *self.compare(flow)) for flow in flows]
        flow, cost, step = min(tried, key=lambda one: one[1])
        start = flow
        for _ in range(STEPS):
            new = flow + step
            if np.hypot(*step) < 0.02 or np.hypot(*(new - start)) > PATCH:
                break
            found, after = self.compare(new)
            if found >= cost:
                break
            flow, cost, step = new, found, after
        return flow, cost


def blurred(a, sigma):
    """A Gaussian at half the size, along one axis and then the other.

    Of every 2 x 2 pixels one is read, another one from step to step.
    """
    height, width = a.shape[:2]
    y, x = np.arange(0, height, 2), np.arange(0, width, 2)
    reach = int(np.ceil(1.5 * sigma))
    weights = {k: np.exp(-2 * k * k / sigma**2) for k in range(-reach, reach + 1)}
    across, down = 0.0, 0.0
    for k, weight in weights.items():
        turn = abs(k) % 2, abs(k) // 2 % 2
        rows = np.clip(y + turn[1], 0, height - 1) if k else y
        columns = np.clip(x + 2 * k + turn[0], 0, width - 1)
        across = across + weight * a[rows][:, columns]
    for k, weight in weights.items():
        down = down + weight * shifted(across, 0, k)
    return down / sum(weights.values()) ** 2


def doubled(half, size):
    """Between the pixels of an image of half the size; `size`: height, width."""
    x, y = centres(size)
    return sampled(half, x / 2, y / 2)


def slopes(inverse):
    """Changes per pixel in x and y, to the sides where they are less."""
    found = []
    for by in ((2, 0), (0, 2)):
        ahead = shifted(inverse, *by) - inverse
        behind = inverse - shifted(inverse, -by[0], -by[1])
        found.append(np.where(np.abs(ahead) < np.abs(behind), ahead, behind) / 2)
    return found


def on_one_surface(flow, depth, at=None):
    """True where the flow leads to a pixel near the tangent plane, and the way back too.

    `at`: rows and columns of the pixels, of which `flow` is; all by default.
    """
    height, width = depth.shape
    inverse = 1 / depth
    across, down = slopes(inverse)
    y, x = at = tuple(np.mgrid[:height, :width]) if at is None else at
    i, j = (np.floor(n + 0.5 + flow[..., k]).astype(int) for k, n in enumerate((x, y)))
    there = np.clip(j, 0, height - 1), np.clip(i, 0, width - 1)
    most = 1.02 + 0.5 * np.hypot(i - x, j - y) / width
    expected = (
        (inverse[at] + (i - x) * across[at] + (j - y) * down[at], inverse[there]),
        (inverse[there] - (i - x) * across[there] - (j - y) * down[there], inverse[at]),
    )
    return np.all([np.maximum(a, b) < most * np.minimum(a, b) for a, b in expected], axis=0)


def trust(flow, back, own, other, depth):
    """Trust in the flow; own, other: the amount of what moves in either frame."""
    stays = on_one_surface(flow, depth)
    x, y = centres(own.shape)
    x, y = x + flow[..., 0], y + flow[..., 1]
    astray = np.hypot(*np.moveaxis(flow + sampled(back, x, y), 2, 0))
    unlike = np.abs(sampled(other, x, y) - own)
    length = np.hypot(flow[..., 0], flow[..., 1])
    return (
        stays
        * np.clip(2 - astray / (12 + 0.1 * length), 0, 1)
        * np.clip(2 - unlike / (0.2 + 0.5 * own), 0, 1)
    )


def filled(flow, trusted, own):
    """Flow in which that around it stands for what is not trusted."""
    weight = trusted * np.minimum(own / 0.1, 1)
    around = blurred(np.dstack([flow * weight[..., None], weight]), 5.0)
    around = doubled(around, own.shape)
    share = around[..., 2]
    keep = (trusted * np.minimum(share / 0.05, 1))[..., None]
    mean = around[..., :2] / np.maximum(share, 1e-4)[..., None]
    return np.where(share[..., None] > 0.01, mean * (1 - keep) + flow * keep, flow)


def bodies(depth, motion):
    """The motions of two bodies before cells of 4 x 4 pixels, relative to what is there.

    Those of the nearest body, and of the nearest one that moves otherwise.
    """
    height, width = depth.shape
    found = np.zeros((2, -(-height // 4), -(-width // 4), 4))

    def longest(both):
        return max(np.hypot(*both[:2]), np.hypot(*both[2:]))

    for j, i in np.ndindex(*found.shape[1:3]):
        y, x = _middle(j, i, depth.shape)
        nearest, other = found[:, j, i]
        for ring in range(8):
            least, before, reach = depth[y, x] / 1.02, nearest.copy(), 3 * 1.6**ring
            for angle in 2 * np.pi * np.arange(12) / 12:
                apart, past = (
                    motion[_place(y, x, far, angle, depth.shape)] - motion[y, x]
                    for far in (reach, reach + 2)
                )
                z = depth[_place(y, x, reach, angle, depth.shape)]
                alike = longest(past - apart) <= 0.5 + 0.05 * np.linalg.norm(apart)
                if longest(apart) <= 1 or not alike or z >= least:
                    continue
                if not before.any():
                    least, nearest[:] = z, apart
                elif longest(apart - before) > 0.5 * np.linalg.norm(before):
                    least, other[:] = z, apart
            if other.any():
                break
    return found


def _middle(row, column, size):
    """The pixel that stands for a cell."""
    return min(4 * row + 2, size[0] - 1), min(4 * column + 2, size[1] - 1)


def _place(y, x, far, angle, size):
    row, column = y + round(far * np.sin(angle)), x + round(far * np.cos(angle))
    return min(max(row, 0), size[0] - 1), min(max(column, 0), size[1] - 1)


def motions_of(found):
    """Motions that the shadow in a cell may have: of each body, and less of it."""
    return np.stack([share * one for one in found for share in (1, 0.88)])


def compared(motions, own, other, depth, seen, side, known):
    """Differences around each cell with each of its motions, at 5 x 5 places, if one is dark."""
    rows, columns = np.mgrid[: motions.shape[1], : motions.shape[2]]
    y, x = (
        np.minimum(4 * n + 2, size - 1) for n, size in zip((rows, columns), own.shape, strict=True)
    )
    ways = motions[..., 2:] if side > 0 else motions[..., :2]
    out, dark_ = np.zeros((*y.shape, len(motions))), np.zeros(y.shape, bool)
    for b, a in np.ndindex(5, 5):
        place = (
            np.clip(y + 5 * (b - 2), 0, own.shape[0] - 1),
            np.clip(x + 5 * (a - 2), 0, own.shape[1] - 1),
        )
        dark_ |= np.maximum(own, other)[place] > 0.1
        to = np.dstack([place[1] - x, place[0] - y])
        same = on_one_surface(to, depth, (y, x))
        for n, way in enumerate(ways):
            differs = differs_by(way, -way, own, other, depth, seen, 0.3, known, place)
            out[..., n] += np.where(same & motions[n].any(axis=2), differs, 0)
    return np.where(dark_[..., None], out, 0)


def chosen_body(motions, differs):
    """The motion with which the least differs, from both neighbours together."""
    best, least = motions[0], differs[..., 0]
    for k in range(1, len(motions)):
        better = motions[k].any(axis=2) & (differs[..., k] < 0.95 * least)
        best = np.where(better[..., None], motions[k], best)
        least = np.where(better, differs[..., k], least)
    return best


def body_at(found, side, size):
    """That of a pixel's cell, to the neighbour on `side`; `size`: height, width."""
    way = found[..., 2:] if side > 0 else found[..., :2]
    return np.repeat(np.repeat(way, 4, 0), 4, 1)[: size[0], : size[1]]


def stays(own, other, seen):
    """Differences without motion; where the neighbour does not show the surface, all that is."""
    return np.where(seen, np.abs(other - own), own)


def differs_by(to, was, own, other, depth, seen, hidden, known, at=None):
    """Differences of the frame from the neighbour at x + to, and of that from the frame at x + was.

    Where one of them is not seen, that without motion; where a body hides it, the share `hidden` of
    that. `seen`: where the neighbour shows the surface; `known`: near changes of light. `at`: see
    on_one_surface.
    """
    rows, columns = at = tuple(np.mgrid[: own.shape[0], : own.shape[1]]) if at is None else at
    still = stays(own, other, seen)[at]
    total = 0.0
    for way, image, mine, shown in ((to, other, own, None), (was, own, other, seen[at])):
        x, y = columns + 0.5 + way[..., 0], rows + 0.5 + way[..., 1]
        landing = nearest(x, y, own.shape)
        same = on_one_surface(way, depth, at)
        compares = same & (seen[landing] if shown is None else shown)
        before = known[landing] & (depth[at] > 1.02 * depth[landing])
        unseen = still * np.where(same | before, hidden, 1)
        total = total + np.where(compares, np.abs(sampled(image, x, y) - mine[at]), unseen)
    return total


def explained(flow, back, own, other, flow_other, body, depth, seen, known, alone=0.0):
    """Differences with the flow, without, with the other neighbour's and the body's; half size.

    `flow_other`: with its trust. `alone`: by how much the frame alone is bright, where that counts.
    """
    x, y = centres(own.shape)
    unsure = np.where(seen, 1, 0.3)
    with_ = differs_by(flow, back, own, other, depth, seen, unsure, known)
    still = unsure * stays(own, other, seen)
    way, trusted = flow_other[..., :2], flow_other[..., 2]
    was = way
    for _ in range(2):
        was = way[nearest(x + was[..., 0], y + was[..., 1], own.shape)]
    turned = differs_by(-way, was, own, other, depth, seen, 0, known)
    turned = with_ * (1 - trusted) + turned * trusted
    as_body = differs_by(body, -body, own, other, depth, seen, 0.3, known)
    as_body = np.where(body.any(axis=2), as_body, with_)
    more = 4 * alone
    return blurred(np.dstack([with_ + more, 2 * still, turned + more, as_body + more]), 4.0)


def nearest(x, y, size):
    """Rows and columns of the pixels at these places of an image; `size`: height, width."""
    height, width = size
    rows, columns = (np.floor(n).astype(int) for n in (y, x))
    return np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)


def chosen(flow, flow_other, body, around, around_other, resting=False):
    """The flow that explains most, its trust, and how much it explains; around: see explained.

    Trust is less than 0 where the flow is not searched.
    """

    def share(found, still):
        missed = 0.45 if resting else 0.85
        return np.clip((missed - found / np.maximum(still, 1e-4)) / 0.25, 0, 1)

    around, around_other = (doubled(a, flow.shape[:2]) for a in (around, around_other))
    with_, still, turned, as_body = np.moveaxis(around, 2, 0)
    best = np.dstack([flow[..., :3], share(with_, still)])
    other = share(turned, still) * share(around_other[..., 0], around_other[..., 1])
    better = (flow_other[..., 2] * other > best[..., 2] * best[..., 3]) & (turned < 0.75 * with_)
    best = np.where(better[..., None], np.dstack([-flow_other[..., :3], other]), best)
    with_, still, _, as_body = np.moveaxis(around + around_other, 2, 0)
    explains = share(as_body, still)
    better = body.any(axis=2) & (as_body < 0.83 * with_)
    better &= explains > np.maximum(flow[..., 2] * share(with_, still), 0.5)
    minus = np.full(explains.shape, -1.0)
    return np.where(better[..., None], np.dstack([body, minus, explains]), best)


def settled(found, own, other, depth, seen, resting=False):
    """The same, with flow that is not searched in the place of what explains nothing around it.

    Where it leads has to look as what is there. How much it explains is less than 0 there.
    """
    weight = np.maximum(-found[..., 2], 0) * found[..., 3] * np.minimum(own / 0.1, 1)
    around = doubled(
        blurred(np.dstack([found[..., :2] * weight[..., None], weight]), 5.0), own.shape
    )
    trusted, explains, share = np.abs(found[..., 2]), found[..., 3], around[..., 2]
    way = around[..., :2] / np.maximum(share, 1e-4)[..., None]
    x, y = centres(own.shape)
    x, y = x + way[..., 0], y + way[..., 1]
    is_there = on_one_surface(way, depth) & seen[nearest(x, y, own.shape)]
    differs = np.abs(sampled(other, x, y) - own)
    fits = np.where(is_there, 1 - np.minimum(differs / 0.3, 1), 1)
    keep = np.where(found[..., 2] < 0, 0, np.maximum(trusted * explains, 1 - fits))[..., None]
    flow = way * (1 - keep)
    flow = flow + found[..., :2] * keep
    trust = 1 - keep[..., 0] + trusted * keep[..., 0]
    told = np.maximum(explains, fits * np.minimum(share / 0.05, 1)) if resting else explains
    filled = np.dstack([flow, trust, told])
    own = np.dstack([found[..., :2], trusted, explains])
    known = share > 0.01
    result = np.where(known[..., None], filled, own)
    result[..., 3] *= np.where((found[..., 2] >= 0) & ~known, 1, -1)
    return result


def pushed(found, flow, trusted, along):
    """Darkness times weight, and weight, where they are after a share of the way."""
    height, width = found.shape[:2]
    out = np.zeros((height, width, 4))
    for y in range(height):
        for x in range(width):
            weight = trusted[y, x] * min(found[y, x, 3] / 0.1, 1)
            at = x + along * flow[y, x, 0], y + along * flow[y, x, 1]
            left, top = int(np.floor(at[0])), int(np.floor(at[1]))
            u, v = at[0] - left, at[1] - top
            for j in (0, 1):
                for i in (0, 1):
                    share = (u if i else 1 - u) * (v if j else 1 - v)
                    if 0 <= left + i < width and 0 <= top + j < height:
                        value = np.append(found[y, x, :3], 1)
                        out[top + j, left + i] += weight * share * np.clip(value, 0, 1)
    return out


def smooth(x, half):
    """A step from 0.5 - half to 0.5 + half."""
    u = np.clip((x - 0.5 + half) / (2 * half), 0, 1)
    return u * u * (3 - 2 * u)


def from_pushed(a, b, own, other, trusts, explains, time, resting=False):
    """The change of the logarithm of light, from what came from here (a) and from there (b).

    `explains`: how much the flow explains, less than 0 where it is not searched: there, and where
    surfaces rest, what covers a part of a pixel is spread over up to four times this part.

    Beside it, the share of the darkness of both frames (own, other: with how much) that is trusted.
    """
    amounts = own[..., 3], other[..., 3]
    own, other = own[..., :3], other[..., :3]
    most = np.where(resting | (explains < 0), 4, 1)[..., None]
    a, b = (one * np.clip(1 / np.maximum(one[..., 3:], 0.01), 1, most) for one in (a, b))
    explains = np.abs(explains)
    late = smooth(time, 0.3)
    n = (1 - late) * np.minimum(a[..., 3], 1) + late * np.minimum(b[..., 3], 1)
    mean = sum(
        share * one[..., :3] / np.maximum(one[..., 3:], 1)
        for share, one in ((1 - late, a), (late, b))
    )
    there = np.minimum(np.maximum(a[..., 3], b[..., 3]), 1)
    moved = mean * (there / np.maximum(n, 0.05))[..., None]
    late = smooth(time, 0.2)
    rests = (1 - late) * (1 - trusts[0])[..., None] * own + late * (1 - trusts[1])[
        ..., None
    ] * other
    dark_ = np.log(np.maximum(1 - moved - rests, 0.005)) - np.log(np.maximum(1 - own, 0.005))
    trusted = sum(t * n for t, n in zip(trusts, amounts, strict=True))
    return explains[..., None] * dark_, explains * trusted / np.maximum(sum(amounts), 1e-3)


def pulled(own, other, flows, trusts, time):
    """The change of the logarithm of light that has come along both flows, and how sure it is."""
    x, y = centres(own.shape[:2])
    places = []
    for (flow, trusted), part in zip(
        zip(flows, trusts, strict=True), (time, 1 - time), strict=True
    ):
        by = flow
        for _ in range(3):
            by = sampled(flow, x - part * by[..., 0], y - part * by[..., 1])
        at = x - part * by[..., 0], y - part * by[..., 1]
        places.append((at, sampled(trusted, *at)))
    late = smooth(time, 0.4)
    shares = (1 - late) * places[0][1], late * places[1][1]
    come = sum(
        share[..., None] * (sampled(level, *at) - own)
        for share, level, (at, _) in zip(shares, (own, other), places, strict=True)
    )
    total = shares[0] + shares[1]
    trusted = np.minimum(total / 0.3, 1)
    return come * (trusted / np.maximum(total, 1e-3))[..., None], trusted


def clamped(change, before, after, hidden, own):
    """No more than a frame showed around; where one `hidden` there does not show it, no light.

    `own`: the darkness of the frame. There small changes are noise.
    """
    low, high = np.minimum(0, np.minimum(before, after)), np.maximum(0, np.maximum(before, after))
    near = [(i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    low = np.min([shifted(low, *by) for by in near], 0)
    high = np.max([shifted(high, *by) for by in near], 0)
    hidden = np.any([shifted(hidden, *by) for by in near], 0)
    result = np.clip(change, low, high)
    free = np.clip(change, -3, -np.log(np.maximum(1 - own[..., :3], 0.005)))
    u = np.clip((np.abs(free).max(2) - 0.1) / 0.2, 0, 1) * hidden
    u = (u * u * (3 - 2 * u))[..., None]
    return result * (1 - u) + free * u


def carried(own, flow, last):
    """Tiles of 16 x 16 pixels that shadows come to with the motion of a body; own: how dark."""
    height, width = own.shape
    tiles = np.zeros((-(-height // 16), -(-width // 16)), bool)
    for y, x in np.ndindex(height // 2, width // 2):
        way = last * flow[2 * y, 2 * x, :2]
        if flow[2 * y, 2 * x, 3] < 0 and own[2 * y, 2 * x] > 0.3 and np.hypot(*way) > 0.5:
            for share in (0, 1 / 3, 2 / 3, 1):
                i, j = 2 * x + 0.5 + share * way[0], 2 * y + 0.5 + share * way[1]
                if 0 <= i < width and 0 <= j < height:
                    tiles[int(j // 16), int(i // 16)] = True
    return tiles


def sure(own, other, flows, trusted, pulled=False):
    """Return the trust in light: the share of change that flow explains, times that in flow."""

    def levels(found):
        return found[..., :3] if pulled else np.log(np.maximum(1 - found[..., :3], 0.005))

    def unlike(a, b):
        return np.abs(levels(a) - levels(b)).max(2)

    x, y = centres(own.shape[:2])
    ahead, back = ((x + flow[..., 0], y + flow[..., 1]) for flow in flows)
    missed = np.maximum(
        unlike(sampled(other, *ahead), own),
        unlike(sampled(own, *back), other),
    )
    differs = unlike(own, other)
    explains = 1 - np.minimum(missed / np.maximum(differs, 0.1), 1)
    return 1 - np.minimum(differs / 0.1, 1) * (1 - trusted * explains)


def added(change, light, albedo, pulled=False):
    """The addition to the colour."""
    return albedo * (light + dark(pulled)) * (np.exp(change) - 1)
