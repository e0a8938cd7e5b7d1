"""Make the pictures of docs/engineers/gather-in-depth.md: python tools/gather_figures.py [NAME ...]

NAME is that of a function in FIGURES. Pictures are read back from the GPU after `gather` has
blurred a frame, or are drawn by it; textures are found by the labels that the method gives them.
"""

from __future__ import annotations

import sys

import numpy as np
import wgpu
from PIL import Image, ImageDraw

from pictures import IMAGES, enlarged, grid, levels, save
from wgmb import (
    Blur,
    Clip,
    Frame,
    Render,
    Shutter,
)
from wgmb.charts import Chart, svg
from wgmb.color.srgb import motion_picture
from wgmb.gpu import wgsl
from wgmb.gpu.textures import numpy_of
from wgmb.metrics import display
from wgmb.scene import builtin

SAMPLE = IMAGES.parent.parent / "sample" / "crossing.####.exr"
SIZE = 480, 270  # [px] of built-in scenes
CROP = (214, 40), (46, 28)  # upper left corner, size: the edge of the head before the wall
ZOOM = 8
_ROOM = 1 << 20  # bytes of the lists of a small picture, and more
SPEED = 60  # [px] speed of the moving strip in the drawing of the search


class Layers:
    """The layers that `gather` left on the GPU."""

    def __init__(self, blur: Blur):
        """Of a Blur that has not been used yet."""
        self._device, self._images = blur.device, blur.method._layers._images
        usage = wgpu.BufferUsage
        kinds = usage.STORAGE | usage.INDIRECT | usage.COPY_DST | usage.COPY_SRC
        self._lists = blur.device.create_buffer(size=_ROOM, usage=kinds)
        blur.method._tiles._lists._buffer = self._lists  # one that can be read back

    def read(self, label: str, layer: int) -> np.ndarray:
        """(height, width, channels) of one layer of a texture."""
        texture = self._images._textures[label]
        (width, height, _), (kind, channels) = texture.size, numpy_of(texture.format)
        data = self._device.queue.read_texture(
            {"texture": texture, "origin": (0, 0, layer)},
            {"bytes_per_row": width * channels * kind.itemsize, "rows_per_image": height},
            (width, height, 1),
        )
        return np.frombuffer(data, kind).reshape(height, width, channels)

    def live(self, size: tuple[int, int]) -> np.ndarray:
        """(rows, columns) of tiles: whether anything moves in them or may move into them."""
        source = wgsl.load("methods/gather/tiles/active_tiles.wgsl")
        across, down = tiles_of(size)
        words = -(-(across * down + int(source.constant("CELLS_WORD"))) // 64) * 64
        data = self._device.queue.read_buffer(self._lists)
        flags = np.frombuffer(data, np.uint32)[int(source.constant("TILE_FLAGS")) * words :]
        return flags[: across * down].reshape(down, across) > 0


def tile() -> int:
    """Side of a tile [px]."""
    return int(wgsl.load("methods/gather/surface.wgsl").constant("TILE"))


def tiles_of(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles across and down."""
    return -(-size[0] // tile()), -(-size[1] // tile())


def sample() -> None:
    """Everything that is read back after one frame of sample/ was blurred."""
    clip = Clip(SAMPLE)
    frame = clip.with_neighbours(clip.source(10))
    blur = Blur("gather", samples=16)
    layers = Layers(blur)
    blur(frame)
    inputs(frame)
    silhouettes(frame, layers)
    classified(frame, layers)
    confidence(blur, frame)


def rendered(name: str, **settings: float) -> Frame:
    """The first frame of a built-in scene, with its neighbours."""
    render = Render(builtin.make(name, **settings), Blur("tap"), size=SIZE, antialias=4)
    before, here, after = (render.frame(k / 24, k + 1) for k in (-1, 0, 1))
    return here.between(before, after)


def inputs(frame: Frame) -> None:
    """The three frames, and what is known of the middle one."""
    assert frame.prev and frame.next and frame.motion is not None and frame.depth is not None
    fastest = float(np.percentile(np.hypot(frame.motion[..., 2], frame.motion[..., 3]), 99))
    near, far = frame.depth.min(), frame.depth.max()
    sheet = {
        "frame 9": display(frame.prev.color),
        "frame 10": display(frame.color),
        "frame 11": display(frame.next.color),
        "to_prev of frame 10": motion_picture(frame.motion[..., :2], fastest) ** 0.6,
        "to_next of frame 10": motion_picture(frame.motion[..., 2:], fastest) ** 0.6,
        "depth of frame 10": 1 - 0.85 * (frame.depth - near) / (far - near),
    }
    save(grid(sheet, 3), "gather/inputs.jpg")


def tiles() -> None:
    """The tiles that need work, and the motions that may reach each of them."""
    frame, blur = rendered("crossing", speed=1.5), Blur("gather")
    layers = Layers(blur)
    blur(frame)
    live = layers.live(SIZE)
    active(frame, live)
    motions(frame, live, layers)


def drawing_on(shown: np.ndarray) -> Image.Image:
    """Display values as an image of twice the size, to be drawn on."""
    size = 2 * shown.shape[1], 2 * shown.shape[0]
    return Image.fromarray(levels(shown)).resize(size, Image.Resampling.LANCZOS)


def active(frame: Frame, live: np.ndarray) -> None:
    """The tiles that need work; all others are copied."""
    shown = display(frame.color)
    dark = 0.2 + 0.3 * shown.mean(axis=2, keepdims=True)
    image = drawing_on(np.where(pixels_of(live, SIZE)[..., None], shown, dark))
    draw = ImageDraw.Draw(image)
    for y, x in np.argwhere(live):
        box = (2 * tile() * x, 2 * tile() * y, 2 * tile() * (x + 1), 2 * tile() * (y + 1))
        draw.rectangle(box, outline=(255, 196, 60))
    save(np.asarray(image), "gather/active.jpg")


def pixels_of(cells: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A value per tile as one per pixel."""
    side = tile()
    return cells.repeat(side, 0).repeat(side, 1)[: size[1], : size[0]]


def silhouettes(frame: Frame, layers: Layers) -> None:
    """One edge as it was rendered, and its two layers."""
    place = 0
    near, far = layers.read("layer colors", 2 * place), layers.read("layer colors", 2 * place + 1)
    matte, source = layers.read("mattes", place)[..., 0], wgsl.load("methods/gather/surface.wgsl")
    split = (matte & int(source.constant("HAS_BACK"))) != 0
    grey = np.full_like(near[..., :3], 0.5)
    coverage = (matte & int(source.constant("WHOLE"))) / source.constant("WHOLE")
    over = display(near) + (1 - coverage[..., None]) * grey
    behind = np.where(split[..., None], display(far), 0.5)
    sheet = {
        "as rendered": display(frame.color),
        "coverage": np.where(split, coverage, 1.0),
        "front layer": np.where(split[..., None], over, display(frame.color)),
        "back layer": behind,
    }
    save(grid({k: enlarged(levels(p), *CROP, ZOOM) for k, p in sheet.items()}, 2),
         "gather/layers.png")  # fmt: skip


def motions(frame: Frame, live: np.ndarray, layers: Layers) -> None:
    """The motions that may reach every tile, as streaks of the exposure through its middle."""
    header = layers.read("tile candidates", 0).view("f4")
    velocities = layers.read("tile candidates", 3).view("f2")  # of the first motion, of the second
    left, top, across, down, scale = 12, 3, 12, 8, 5  # tiles, pixels of the drawing per pixel
    corner, size = (tile() * left, tile() * top), (tile() * across, tile() * down)
    grey = levels(0.45 + 0.55 * display(frame.color).mean(axis=2))
    image = Image.fromarray(enlarged(grey, corner, size, scale))
    draw = ImageDraw.Draw(image)
    colors = ((208, 62, 60), (34, 92, 180), (26, 130, 66), (150, 80, 170))
    side = scale * tile()
    for y, x in np.ndindex(down, across):
        draw.rectangle(
            (side * x, side * y, side * (x + 1), side * (y + 1)), outline=(190, 190, 190)
        )
    for y, x in np.argwhere(live[top : top + down, left : left + across]):
        for k in range(int(header[y + top, x + left, 0])):
            way = scale * velocities[y + top, x + left, 2 * k : 2 * k + 2].astype(float)
            middle = side * (np.array([x, y]) + 0.5)
            start, end = (middle + t * way for t in (-0.25, 0.25))
            draw.line([tuple(start), tuple(end)], fill=colors[k], width=3)
            draw.ellipse((*(end - 5), *(end + 5)), fill=colors[k])
    save(np.asarray(image), "gather/motions.jpg")


def classified(frame: Frame, layers: Layers) -> None:
    """For every block, the share of the sample times at which one search is enough."""
    bits = layers.read("single-layer mask", 0)[..., 0]
    share = np.array([[int(word).bit_count() for word in row] for row in bits]) / 16
    side = int(wgsl.load("methods/gather/search/search.wgsl").constant("BLOCK"))
    share = share.repeat(side, 0).repeat(side, 1)[: frame.size[1], : frame.size[0]]
    live = pixels_of(layers.live(frame.size), frame.size)
    low, high = np.array([0.85, 0.25, 0.15]), np.array([0.2, 0.5, 0.85])
    color = low + share[..., None] * (high - low)
    grey = display(frame.color).mean(axis=2, keepdims=True)
    shown = np.where(live[..., None], 0.35 * grey + 0.65 * color, 0.3 + 0.4 * grey)
    save(np.asarray(drawing_on(shown)), "gather/classified.jpg")


def fixed_point() -> None:
    """The search along one row: a strip that moves right before a slow background."""
    u, x = 0.5, 100.0
    d = np.linspace(0, 50, 501)

    def displaced(q):
        """Displacement of what was at `q`: the strip is faster at its right end."""
        return np.where((q > 58) & (q < 94), u * (SPEED + 0.8 * (q - 77)), 3.0)

    def steps(start: float, count: int):
        """The way of the search as a line: over to the curve, then to the diagonal."""
        points, at = [(start, start)], start
        for _ in range(count):
            there = float(displaced(x - at))
            points += [(at, there), (there, there)]
            at = there
        return tuple(np.array(points).T)

    lines = {
        "D(x - d, u)": (d, displaced(x - d)),
        "d": (d, d),
        "from 20": steps(20, 6),
        "from 0": steps(0.0, 2),
    }
    chart = Chart("fixed points of d = D(x - d, u)", "d [px]", "displacement [px]", lines)
    (IMAGES / "gather" / "fixed_point.svg").write_text(svg(chart), encoding="utf-8")


def instants() -> None:
    """Pictures at single times of the exposure, and their mean."""
    frame, window = rendered("crossing", speed=1.5), ((180, 75), (130, 100))
    still, sheet = Blur("gather", samples=1), {}
    for t in (-0.25, -0.125, 0.0, 0.125, 0.25):
        still.shutter = Shutter(0, phase=t)
        sheet[f"t = {t:+.3f}"] = still(frame)
    sheet["mean of 16 times"] = Blur("gather")(frame)
    shown = {k: enlarged(levels(display(p)), *window, 3) for k, p in sheet.items()}
    save(grid(shown, 3), "gather/instants.jpg")


def confidence(blur: Blur, frame: Frame) -> None:
    """The four planes."""
    _, planes = blur.with_confidence(frame)
    gains = {"accepted": 1.0, "disocclusion": 1.0, "residual": 2.0, "left": 1.0}
    shown = {}
    for name, gain in gains.items():
        label = name if gain == 1 else f"{name} [px], times {gain:g}"
        shown[label] = gain * planes[name]
    save(grid(shown, 2), "gather/confidence.png")


def neighbours() -> None:
    """A fence that passes fast: what the frames beside it are good for."""
    frame, gather = rendered("fence", speed=6), Blur("gather")
    reference = Render(builtin.make("fence", speed=6), Blur("distributed", samples=512), size=SIZE)
    sheet = {
        "tap": Blur("tap")(frame),
        "gather, this frame alone": gather(frame.between(None, None)),
        "gather, three frames": gather(frame),
        "reference": reference(0.0),
    }
    window = (180, 110), (150, 100)
    shown = {k: enlarged(levels(display(p)), *window, 3) for k, p in sheet.items()}
    save(grid(shown, 2), "gather/neighbours.jpg")


def five_frames() -> None:
    """Three bars that stand as far apart as they move in a frame; see test_reach.py."""
    height, width, step, color = 40, 112, 12, (0.9, 0.8, 0.1)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    tones = (
        np.sin(0.9 * x + 0.37 * y + c) * np.cos(0.53 * y - 0.29 * x + c) for c in (0, 1.3, 2.9)
    )
    wall = 0.5 + 0.4 * np.stack([*tones], axis=2)

    def shot(t: float) -> Frame:
        there = np.zeros((height, width), bool)
        for bar in (-step, 0, step):
            there |= np.abs(x + 0.5 - width / 2 - bar - step * t) < 4
        motion = there[..., None] * np.array([-step, 0, step, 0], np.float32)
        depth = np.where(there, 4, 9).astype(np.float32)
        return Frame(np.where(there[..., None], color, wall), motion=motion, depth=depth)

    made = {k: shot(k) for k in range(-2, 3)}
    near = made[-1].between(made[-2], None), made[1].between(None, made[2])
    blurs = {f"gather, {n} frames": Blur("gather", shutter=360, reach=r)
             for n, r in (("three", 1), ("five", 2))}  # fmt: skip
    times = Shutter(360).sample_times(16)
    sheet = {"truth": np.mean([shot(float(t)).color for t in times], axis=0)}
    sheet |= {name: blur(made[0].between(*near)) for name, blur in blurs.items()}
    shown = {k: enlarged(levels(display(p)), (28, 4), (56, 32), 6) for k, p in sheet.items()}
    save(grid(shown, 3), "gather/five_frames.jpg")


FIGURES = (sample, fixed_point, tiles, instants, neighbours, five_frames)

if __name__ == "__main__":
    for figure in FIGURES:
        if not sys.argv[1:] or figure.__name__ in sys.argv[1:]:
            figure()
