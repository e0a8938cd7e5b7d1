"""Flow's kernels, one pixel and one candidate at a time."""

import math

import numpy as np

from wgmb.color.srgb import srgb

LUMA = np.array([0.299, 0.587, 0.114])
PATCH = [(j, i) for j in range(-2, 3) for i in range(-2, 3) if (i + j) % 2 == 0]
WEIGHTS = np.array([1, 1, 1, 1, 1, 0.25, 0.25])  # of the features, as they are stored


def at(image, x, y):
    """A pixel; outside, the nearest one."""
    height, width = image.shape[:2]
    return image[min(max(y, 0), height - 1), min(max(x, 0), width - 1)]


def halved(picture):
    height, width = (-(-n // 2) for n in picture.shape[:2])
    out = np.zeros((height, width, 3))
    for y in range(height):
        for x in range(width):
            out[y, x] = sum(at(picture, 2 * x + i, 2 * y + j) for i in (0, 1) for j in (0, 1)) / 4
    return out


def features(linear):
    """(height, width, 7) as stored: display colour, gradient and its direction, 0 to 1."""
    shown = srgb(linear).astype(float)
    luma = shown @ LUMA
    height, width = luma.shape
    gradient = np.zeros((height, width, 2))
    for y in range(height):
        for x in range(width):
            for k in (-1, 0, 1):
                share = 0.5 if k == 0 else 0.25
                gradient[y, x, 0] += share * (at(luma, x + 1, y + k) - at(luma, x - 1, y + k))
                gradient[y, x, 1] += share * (at(luma, x + k, y + 1) - at(luma, x + k, y - 1))
    square = (gradient**2).sum(axis=2)
    kernel = np.exp(-(np.arange(-8, 9) ** 2) / 8)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(square, [(8, 8) if i == axis else (0, 0) for i in (0, 1)], mode="edge")
        square = np.apply_along_axis(np.convolve, axis, padded, kernel, "valid")
    direction = 0.05 * gradient / (np.sqrt(square)[..., None] + 0.03)
    return np.clip(np.dstack([shown, gradient + 0.5, direction / 0.25 + 0.5]), 0, 1)


def likeness(a, b):
    d = np.abs(a[..., :3] - b[..., :3]).sum(axis=-1)
    return 1 / (1 + 300 * d * d) + 0.02


def bilinear(image, x, y):
    height, width = image.shape[:2]
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - i)[..., None], (y - j)[..., None]
    right, below = np.minimum(i + 1, width - 1), np.minimum(j + 1, height - 1)
    top = (1 - fx) * image[j, i] + fx * image[j, right]
    return (1 - fy) * top + fy * ((1 - fx) * image[below, i] + fx * image[below, right])


class Matcher:
    """Cost of states; they are u, v, e, f, and the four slopes."""

    def __init__(self, here, near, far, factor, stride, far_price=0.0):
        self.here, self.near, self.far = here, near, far
        self.factor, self.stride, self.far_price = factor, stride, far_price
        self.height, self.width = here.shape[:2]

    def difference(self, own, found):
        """Of features; on coarser levels, what all colours differ by alike counts less."""
        most = 0.08 if self.stride > 1 else 0.0
        grey = np.clip((own - found)[..., :3].mean(axis=-1, keepdims=True), -most, most)
        return np.abs(own - found - 0.75 * grey * [1, 1, 1, 0, 0, 0, 0]) @ WEIGHTS

    def side(self, other, x, y, flow, slope):
        goal = np.array([x, y]) + flow
        if not (0 <= goal[0] <= self.width - 1 and 0 <= goal[1] <= self.height - 1):
            return 2.0
        j, i = np.transpose(PATCH) * self.stride
        px, py = x + i, y + j
        inside = (px >= 0) & (py >= 0) & (px < self.width) & (py < self.height)
        own = self.here[np.where(inside, py, y), np.where(inside, px, x)]
        weight = np.where(inside, likeness(own, self.here[y, x]), 0)
        sx = goal[0] + i + slope[0] * i + slope[1] * j
        sy = goal[1] + j + slope[2] * i + slope[3] * j
        d = self.difference(own, bilinear(other, sx, sy))
        return float((weight * np.minimum(d, 0.6)).sum() / weight.sum())

    def cost(self, x, y, state):
        n = self.side(self.near, x, y, state[:2], state[4:])
        if self.far is None:
            return n
        way = self.factor * state[:2] + state[2:4]
        f = self.side(self.far, x, y, way, self.factor * state[4:])
        return min((n + f) / 2, min(n, f + self.far_price) + 0.03)

    def weights(self, x, y):
        """Offsets of the samples of a patch and their weights, which sum up to 1."""
        places = [(i * self.stride, j * self.stride) for j, i in PATCH]
        total = sum(_weight(self, x, y, i, j) for i, j in places)
        found = [(i, j, _weight(self, x, y, i, j) / total) for i, j in places]
        return [one for one in found if one[2] > 0]

    def price(self, state):
        bend_price = min(0.002 * np.abs(state[2:4]).sum(), 0.01)
        return 0.02 * np.abs(state[4:]).sum() + bend_price

    def energy(self, x, y, state, states, most_apart, most, aside_price):
        """With what differs from the 8 neighbours, and from where the homography `most` leads."""
        total = weights = 0.0
        for j in (-1, 0, 1):
            for i in (-1, 0, 1):
                if (i or j) and 0 <= x + i < self.width and 0 <= y + j < self.height:
                    near = moved(states[y + j, x + i], -i, -j)
                    d = np.abs(near[:4] - state[:4]) @ [1, 1, 0.5, 0.5]
                    weight = likeness(self.here[y + j, x + i], self.here[y, x])
                    total, weights = total + weight * min(d, most_apart), weights + weight
        goal = most @ [x + 0.5, y + 0.5, 1]
        aside = np.abs(goal[:2] / goal[2] - [x + 0.5, y + 0.5] - state[:2]).sum()
        square = sum(
            w * ((self.here[y + j, x + i][3:5] - 0.5) ** 2).sum() for i, j, w in self.weights(x, y)
        )
        aside *= aside_price * square / (square + 0.0009) / max(self.width, self.height)
        smooth = 0.08 * total / max(weights, 1e-6) + aside
        return smooth + self.price(state) + self.cost(x, y, state)


def moved(state, dx, dy):
    out = np.array(state, float)
    out[:2] += out[4] * dx + out[5] * dy, out[6] * dx + out[7] * dy
    return out


def propagated(matcher, states, x, y):
    """The pixel's own state, and those that it always tries, without the random ones."""
    tried = [states[y, x], np.zeros(8)]
    near = [(i * n, j * n) for n in (1, 3) for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    for i, j in near + [(i, j) for i in (-9, 9) for j in (-9, 9)]:
        if 0 <= x + i < matcher.width and 0 <= y + j < matcher.height:
            tried.append(moved(states[y + j, x + i], -i, -j))
    return [np.clip(state, [-np.inf] * 4 + [-0.6] * 4, [np.inf] * 4 + [0.6] * 4) for state in tried]


def fitted_plane(matcher, states, x, y):
    """The plane through the states around that are of like pixels and like the own one."""
    own = states[y, x]
    rows, sides, weights = [], [], []
    for j in range(-8, 9, 2):
        for i in range(-8, 9, 2):
            if 0 <= x + i < matcher.width and 0 <= y + j < matcher.height:
                other = states[y + j, x + i]
                apart = np.abs(other[:2] - moved(own, i, j)[:2]).sum()
                like = likeness(matcher.here[y + j, x + i], matcher.here[y, x])
                rows.append([1, i, j])
                sides.append(other[:4])
                weights.append(like / (1 + apart * apart))
    weights, rows, sides = np.array(weights), np.array(rows, float), np.array(sides)
    square = rows.T @ (weights[:, None] * rows)
    mean = square[0, 1:] / square[0, 0]
    centred = square[1:, 1:] - np.outer(mean, square[0, 1:]) + np.eye(2) * square[0, 0]
    product = rows.T @ (weights[:, None] * sides)
    flows = product[:, :2]
    slope = np.linalg.solve(centred, flows[1:] - np.outer(mean, flows[0])).T
    flow = flows[0] / square[0, 0] - slope @ mean
    return np.concatenate([flow, product[0, 2:] / square[0, 0], slope.ravel()])


def refined(matcher, states, x, y):
    """The pixel's own state, and those of its variations that are not random."""
    own, plane = states[y, x], fitted_plane(matcher, states, x, y)
    return [
        own,
        np.concatenate([own[:4], plane[4:]]),
        np.concatenate([plane[:2], own[2:4], plane[4:]]),
    ]


def inverse_step(matcher, other, x, y, flow, slope):
    """Motion of a patch by inverse search in one frame [px]; 0 if that is too far."""
    square, product = np.eye(2) * 1e-5, np.zeros(2)
    places = [(i * matcher.stride, j * matcher.stride) for j, i in PATCH]
    total = sum(_weight(matcher, x, y, i, j) for i, j in places)
    for i, j in places:
        weight = _weight(matcher, x, y, i, j) / total
        if weight == 0:
            continue
        own = matcher.here[y + j, x + i]
        goal_x = x + flow[0] + i + slope[0] * i + slope[1] * j
        goal_y = y + flow[1] + j + slope[2] * i + slope[3] * j
        found = bilinear(other, np.array(goal_x), np.array(goal_y))
        if np.abs(found - own) @ WEIGHTS < 0.6:
            gradient = (own[3:5] - 0.5) / 2
            square += weight * np.outer(gradient, gradient)
            product += weight * gradient * ((found - own)[:3] @ LUMA)
    step = -np.linalg.solve(square, product)
    return step if np.abs(step).max() < 2 else np.zeros(2)


def _weight(matcher, x, y, i, j):
    if not (0 <= x + i < matcher.width and 0 <= y + j < matcher.height):
        return 0.0
    return likeness(matcher.here[y + j, x + i], matcher.here[y, x])


def polished(matcher, states, x, y):
    """The pixel's own state, and with both displacements moved by a step of inverse search."""
    own = states[y, x]
    near = inverse_step(matcher, matcher.near, x, y, own[:2], own[4:])
    way = matcher.factor * own[:2] + own[2:4]
    far = inverse_step(matcher, matcher.far, x, y, way, matcher.factor * own[4:])
    return [own, own + np.concatenate([near, far - matcher.factor * near, np.zeros(4)])]


def whole_cost(matcher, other, x, y, u, v):
    """Mean difference of the full search's patch from another frame at a whole displacement."""
    height, width = matcher.height, matcher.width
    if not (0 <= x + u < width and 0 <= y + v < height):
        return 2.0
    total = weights = 0.0
    for j in (-3, -1, 1, 3):
        for i in (-3, -1, 1, 3):
            if 0 <= x + i < width and 0 <= y + j < height:
                own = matcher.here[y + j, x + i]
                weight = likeness(own, matcher.here[y, x])
                d = matcher.difference(own, at(other, x + u + i, y + v + j))
                total, weights = total + weight * min(d, 0.6), weights + weight
    return total / weights


def full_search(matcher, reach):
    """Flow and bend of every second pixel each way, the cheapest whole displacements, and (..., 4)
    those to the near frame and to the far one, each by itself.
    """
    height, width = matcher.height, matcher.width
    ways = [(u, v) for u in range(-reach, reach + 1) for v in range(-reach, reach + 1)]
    ways.sort(key=lambda way: np.abs(way).sum())
    length = np.array([2.5e-3 * np.abs(way).sum() for way in ways])
    out = np.zeros((-(-height // 2), -(-width // 2), 4))
    sides = np.zeros_like(out)
    for y in range(0, height, 2):
        for x in range(0, width, 2):
            n = np.array([whole_cost(matcher, matcher.near, x, y, u, v) for u, v in ways])
            f = np.array([whole_cost(matcher, matcher.far, x, y, -u, -v) for u, v in ways])
            both = np.minimum((n + f) / 2, np.minimum(n, f) + 0.03) + length
            best = [
                np.array(ways[np.argmin(cost.round(7))]) for cost in (both, n + length, f + length)
            ]
            sides[y // 2, x // 2] = [*best[1], *-best[2]]
            bend = best[1] - best[2]
            pair = np.array([*best[1], *bend, 0, 0, 0, 0])
            cost = (min(n + length) + min(f + length)) / 2 + matcher.price(pair) + 0.015
            out[y // 2, x // 2] = pair[:4] if cost < both.min() else (*best[0], 0, 0)
    return out, sides


def settled(matcher, states, to_near, to_far):
    """States that lead out of the picture, and those that much resemble the homographies of most
    of it and match no better, follow these.
    """
    out = states.copy()
    height, width = states.shape[:2]
    factor = matcher.factor

    def leaves(x, y, way):
        return not (0 <= x + way[0] <= width - 1 and 0 <= y + way[1] <= height - 1)

    def displaced(matrix, x, y):
        goal = matrix @ [x + 0.5, y + 0.5, 1]
        return goal[:2] / goal[2] - [x + 0.5, y + 0.5]

    for y in range(height):
        for x in range(width):
            near, far = states[y, x, :2], factor * states[y, x, :2] + states[y, x, 2:4]
            most_near, most_far = displaced(to_near, x, y), displaced(to_far, x, y)
            bend = most_far - factor * most_near
            slope = [
                displaced(to_near, x + i, y + j) - displaced(to_near, x - i, y - j)
                for i, j in ((0.5, 0), (0, 0.5))
            ]
            most = [*most_near, *bend, *np.array(slope).T.ravel()]
            if leaves(x, y, most_near) and leaves(x, y, most_far):
                if matcher.cost(x, y, states[y, x]) > 0.06:
                    out[y, x] = most
            elif leaves(x, y, near) and not leaves(x, y, far):
                if np.linalg.norm(far - most_far) < 1:
                    out[y, x, :4] = [*(far - bend) / factor, *bend]
            elif (
                leaves(x, y, far)
                and not leaves(x, y, near)
                and np.linalg.norm(near - most_near) < 1
            ):
                out[y, x, 2:4] = bend
            near, far = out[y, x, :2], factor * out[y, x, :2] + out[y, x, 2:4]
            apart = max(np.linalg.norm(near - most_near), np.linalg.norm(far - most_far))
            if (
                apart < 4
                and matcher.cost(x, y, np.array(most)) < matcher.cost(x, y, out[y, x]) + 0.01
            ):
                out[y, x] = most
    return out


def carried(matcher, states, along, turn):
    """States of a frame seen from its neighbour; the cheapest of those that land on a pixel."""
    out, least = np.zeros_like(states), np.full(states.shape[:2], np.inf)
    for y in range(matcher.height):
        for x in range(matcher.width):
            state = states[y, x]
            flow, slope, other = state[:2], state[4:], matcher.near
            if along < 0:
                flow = matcher.factor * flow + state[2:4]
                slope, other = matcher.factor * slope, matcher.far
            cost = matcher.side(other, x, y, flow, slope)
            left, top = math.floor(x + flow[0]), math.floor(y + flow[1])
            for j in (top, top + 1):
                for i in (left, left + 1):
                    if not (0 <= i < matcher.width and 0 <= j < matcher.height):
                        continue
                    if cost < least[j, i]:
                        least[j, i] = cost
                        out[j, i] = [*turn * flow, 0, 0, *turn * slope]
    return out


def lost(states, near, far, factor, near_side, far_side):
    """True at pixels that are found again in neither neighbour."""
    height, width = states.shape[:2]

    def missed(x, y, flow, other, side):
        gx, gy = x + flow[0], y + flow[1]
        if not (0 <= gx <= width - 1 and 0 <= gy <= height - 1):
            return True
        back = other[..., :2] if side > 0 else other[..., 2:4] - other[..., :2]
        return np.linalg.norm(flow + bilinear(back, np.array(gx), np.array(gy))) > 1.5

    out = np.zeros((height, width), bool)
    for y in range(height):
        for x in range(width):
            state = states[y, x]
            out[y, x] = missed(x, y, state[:2], near, near_side)
            if far is not None:
                way = factor * state[:2] + state[2:4]
                out[y, x] &= missed(x, y, way, far, far_side)
    return out


def mended(matcher, states, is_lost):
    """Lost pixels with the best state of the sound ones on rings around them."""
    out = states.copy()
    for y, x in np.argwhere(is_lost):
        best = 2.0
        for ring in range(9):
            radius = 2 * 1.5**ring
            for k in range(8):
                angle = 0.785398 * (k + 0.37 * radius)
                i, j = round(x + radius * math.cos(angle)), round(y + radius * math.sin(angle))
                inside = 0 <= i < matcher.width and 0 <= j < matcher.height
                if not inside or is_lost[j, i]:
                    continue
                state = moved(states[j, i], x - i, y - j)
                unlike = np.abs(matcher.here[j, i, :3] - matcher.here[y, x, :3]).sum()
                match = matcher.price(state) + matcher.cost(x, y, state)
                total = 0.2 * min(unlike, 0.5) + 0.001 * radius + min(match, 0.15)
                if total < best:
                    best, out[y, x] = total, state
    return out


def lit(matcher, states, lights):
    """Pixels of lights that lead to nothing alike take their light's motion if it does."""
    out = states.copy()
    for y in range(matcher.height):
        for x in range(matcher.width):
            own, light = states[y, x], None
            for one in lights:
                if (np.abs(np.array([x, y]) - one[:2]) < one[2:4] + 1.5).all():
                    light = np.concatenate([one[4:], np.zeros(4)])
            if light is None:
                continue
            way = matcher.factor * own[:2] + own[2:4]
            near = matcher.side(matcher.near, x, y, own[:2], own[4:])
            far = matcher.side(matcher.far, x, y, way, matcher.factor * own[4:])
            if matcher.cost(x, y, light) < min(near, far) - 0.1:
                out[y, x] = light
    return out


def grown(states, size):
    """States on the next finer level, of `size` (height, width)."""
    out = np.zeros((*size, 8))
    for y in range(size[0]):
        for x in range(size[1]):
            state = moved(states[y // 2, x // 2], x / 2 - 0.25 - x // 2, y / 2 - 0.25 - y // 2)
            out[y, x] = state * [2, 2, 2, 2, 1, 1, 1, 1]
    return out


def depth(motion, to_prev, to_next):
    """Depth from the distance of motion from two homographies, its median over 5 x 5 pixels."""
    height, width = motion.shape[:2]
    apart = np.zeros((height, width, 2))
    for y in range(height):
        for x in range(width):
            place = np.array([x + 0.5, y + 0.5, 1])
            for k, matrix in enumerate((to_prev, to_next)):
                goal = matrix @ place
                way = goal[:2] / goal[2] - place[:2]
                apart[y, x, k] = np.linalg.norm(motion[y, x, 2 * k : 2 * k + 2] - way)
    out = np.zeros((height, width))
    for y in range(height):
        for x in range(width):
            near = [at(apart, x + i, y + j) for j in range(-2, 3) for i in range(-2, 3)]
            out[y, x] = 1 / (1 + 0.005 * np.median(near, axis=0).max())
    return out


def reduced(picture, size):
    """A linear picture at a smaller `size` (height, width): means over the areas of its pixels."""
    height, width = picture.shape[:2]
    out = np.zeros((*size, 3))
    for y in range(size[0]):
        for x in range(size[1]):
            top, left = y * height / size[0], x * width / size[1]
            bottom, right = (y + 1) * height / size[0], (x + 1) * width / size[1]
            for j in range(height):
                for i in range(width):
                    down = max(0, min(j + 1, bottom) - max(j, top))
                    across = max(0, min(i + 1, right) - max(i, left))
                    out[y, x] += down * across * np.clip(picture[j, i], 0, 1)
            out[y, x] /= (bottom - top) * (right - left)
    return out


def raised(shown, small, states, depth):
    """States and depth at the size of `shown`: those of the likest of 3 x 3 small pixels."""
    height, width = shown.shape[:2]
    rows, columns = depth.shape
    by_y, by_x = height / rows, width / columns
    out, deep = np.zeros((height, width, 8)), np.zeros((height, width))
    for y in range(height):
        for x in range(width):
            at_y, at_x = (y + 0.5) / by_y - 0.5, (x + 0.5) / by_x - 0.5
            best = None
            for j in range(int(at_y + 0.5) - 1, int(at_y + 0.5) + 2):
                for i in range(int(at_x + 0.5) - 1, int(at_x + 0.5) + 2):
                    row, column = min(max(j, 0), rows - 1), min(max(i, 0), columns - 1)
                    unlike = np.abs(small[row, column] - shown[y, x]).sum()
                    unlike += 0.02 * (abs(row - at_y) + abs(column - at_x))
                    if best is None or unlike < best[0]:
                        best = unlike, row, column
            _, row, column = best
            state = moved(states[row, column], at_x - column, at_y - row)
            ratio = by_x / by_y
            out[y, x] = state * [by_x, by_y, by_x, by_y, 1, ratio, 1 / ratio, 1]
            deep[y, x] = depth[row, column]
    return out, deep
