"""Kernels of flow that have a closed form, one pixel at a time."""

import numpy as np

from wgmb.color.srgb import srgb

LUMA = np.array([0.299, 0.587, 0.114])


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


def moved(state, dx, dy):
    out = np.array(state, float)
    out[:2] += out[4] * dx + out[5] * dy, out[6] * dx + out[7] * dy
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
