"""The guide of flow, one pixel at a time."""

import numpy as np

from .flow import at, whole_cost


def descended(matcher, starts, reach):
    """Displacements (height, width, 4) to both frames; `starts(x, y)`: those to search around."""
    out = np.zeros((matcher.height, matcher.width, 4))
    around = [(u, v) for v in range(-reach, reach + 1) for u in range(-reach, reach + 1)]
    for y in range(matcher.height):
        for x in range(matcher.width):
            for k, other in ((0, matcher.near), (2, matcher.far)):
                least = 4.0
                for start in starts(x, y):
                    for u, v in around:
                        way = np.round(start[k : k + 2]).astype(int) + np.array([u, v])
                        cost = whole_cost(matcher, other, x, y, *way) + 0.02 * (abs(u) + abs(v))
                        if cost < least - 1e-6:
                            least, out[y, x, k : k + 2] = cost, way
    return out


def from_coarser(ways):
    """The displacements to search around, from those of the coarser level."""

    def starts(x, y):
        beside = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)]
        return [2 * np.round(at(ways, x // 2 + i, y // 2 + j)) for i, j in beside]

    return starts


def median(ways):
    """Of 3 x 3 displacements, the one that is nearest to all of them."""
    out = np.zeros_like(ways)
    for y, x in np.ndindex(ways.shape[:2]):
        near = np.array([at(ways, x + i, y + j) for j in (-1, 0, 1) for i in (-1, 0, 1)])
        apart = np.abs(near[:, None] - near).sum(axis=1)
        for k in (0, 2):
            out[y, x, k : k + 2] = near[apart[:, k : k + 2].sum(axis=1).argmin(), k : k + 2]
    return out


def state_of(matcher, ways):
    """The displacements of a pixel as a state."""
    bend = ways[2:] - matcher.factor * ways[:2] if matcher.factor < 0 else np.zeros(2)
    return np.array([*ways[:2], *bend, 0, 0, 0, 0])


def ways_of(matcher, state):
    """The displacements of a state; to the near frame alone if the far one is on the same side."""
    to_far = matcher.factor * state[:2] + state[2:4]
    return np.concatenate([state[:2], to_far if matcher.factor < 0 else np.zeros(2)])


def own_cost(matcher, x, y, by):
    around = [(i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    near = np.round(by).astype(int) + np.array(around)
    return min(whole_cost(matcher, matcher.here, x, y, *way) for way in near)


def missed(way, back, x, y):
    """Way to a pixel of another frame and back by the guide there; 99 out of the picture."""
    i, j = round(x + way[0]), round(y + way[1])
    is_inside = 0 <= i < back.shape[1] and 0 <= j < back.shape[0]
    return np.abs(way + back[j, i, :2]).max() if is_inside else 99


def is_repeat(matcher, x, y, other, own, guided):
    """True if the patch repeats after the difference, and the state matches better."""
    by = own - guided
    cost, guided_cost = (
        whole_cost(matcher, other, x, y, *np.round(way).astype(int)) for way in (own, guided)
    )
    is_alike = own_cost(matcher, x, y, by) < 0.4 * own_cost(matcher, x, y, 0.5 * by)
    return is_alike and cost < guided_cost


def is_hidden(matcher, x, y, other, own, guided):
    """True if a side seems hidden where the guide matches."""
    cost, guided_cost = (
        whole_cost(matcher, other, x, y, *np.round(way).astype(int)) for way in (own, guided)
    )
    return 0.3 < cost < 2 and guided_cost < cost - 0.15


def found(matcher, states, guide, backs, seeks_repeats=True):
    """(height, width, 3): differs by a repeat, seems hidden on one side, may turn back there.

    `guide`: displacements; `backs`: those of the near frame and of the far one, to this one.
    """
    out = np.zeros((*states.shape[:2], 3), bool)
    frames = (matcher.near, matcher.far)[: 2 if matcher.factor < 0 else 1]
    for y, x in np.ndindex(states.shape[:2]):
        own, guided = ways_of(matcher, states[y, x]).reshape(2, 2), guide[y, x].reshape(2, 2)
        by = np.abs(own - guided).max(axis=1)
        for k, other in enumerate(frames):
            if seeks_repeats and by.max() > 2:
                out[y, x, 0] |= is_repeat(matcher, x, y, other, own[k], guided[k])
        if len(frames) == 2 and by.min() <= 2 and 1.5 < by.max() <= 0.05 * max(states.shape[:2]):
            ways = zip(guided, backs, strict=True)
            out[y, x, 2] = max(missed(way, back, x, y) for way, back in ways) <= 3
            k = by.argmax()
            hides = is_hidden(matcher, x, y, frames[k], own[k], guided[k])
            out[y, x, 1] = out[y, x, 2] and hides
    return out


def followed(matcher, states, guide, marks, coarser=None):
    """States, those of the guide where it leads, and (height, width, 5) the lead.

    `coarser`: the lead of the coarser level.
    """
    height, width = states.shape[:2]
    out, lead = states.copy(), np.zeros((height, width, 5))
    lead[..., :4] = guide
    for y, x in np.ndindex(height, width):
        rows = [j for j in range(y - 24, y + 25, 3) if 0 <= j < height]
        columns = [i for i in range(x - 24, x + 25, 3) if 0 <= i < width]
        shares = marks[rows][:, columns].mean(axis=(0, 1))
        repeats = shares[0] > 0.08
        apart = np.abs(ways_of(matcher, states[y, x]) - guide[y, x]).max()
        turns = shares[1] > 0.1 and marks[y, x, 2]
        lead[y, x, 4] = repeats or turns
        if turns or (repeats and apart > 2):
            out[y, x] = state_of(matcher, guide[y, x])
        if coarser is not None and not lead[y, x, 4]:
            lead[y, x] = [2, 2, 2, 2, 1] * coarser[y // 2, x // 2]
    return out, lead


def astray(matcher, state, lead, factor):
    """By how much a state differs from where the guide leads, on a level `factor` as fine [px]."""
    by = np.abs(factor * lead - ways_of(matcher, state)).reshape(2, 2).max(axis=1)
    counted = np.clip(by - factor, 0, 2 * factor)
    return counted.mean() if matcher.factor < 0 else counted[0]
