"""Draw the documentation's diagrams as SVG: python tools/drawings.py"""

from __future__ import annotations

from html import escape

import numpy as np

from pictures import IMAGES
from wgmb import Shutter

BLUE, RED, GREEN, GREY = "#1f6fb4", "#d1495b", "#3a8f5c", "#8a8f98"
INK, PAPER, FAINT = "#23272e", "#ffffff", "#e3e6ea"


class Drawing:
    """Shapes on a white sheet of `width` x `height`."""

    def __init__(self, width: int, height: int):
        self.width, self.height, self._parts = width, height, []

    def add(self, tag: str, content: str = "", **attributes) -> None:
        """One element; `_` in names of attributes stands for `-`."""
        given = " ".join(f'{k.replace("_", "-")}="{_number(v)}"' for k, v in attributes.items())
        self._parts.append(f"<{tag} {given}>{content}</{tag}>")

    def text(self, x, y, words: str, *, anchor="middle", size=13, color=INK, weight="normal"):
        """A line of text whose baseline is at y."""
        self.add("text", escape(words), x=x, y=y, text_anchor=anchor, font_size=size,
                 fill=color, font_weight=weight)  # fmt: skip

    def box(self, x, y, width, height, words="", *, fill=PAPER, stroke=GREY, color=INK, size=13):
        """A rounded box around lines of text."""
        self.add("rect", x=x, y=y, width=width, height=height, rx=5, fill=fill, stroke=stroke)
        lines = words.split("\n") if words else []
        for i, line in enumerate(lines):
            below = y + height / 2 + (i - (len(lines) - 1) / 2) * (size + 4) + 0.36 * size
            self.text(x + width / 2, below, line, size=size, color=color)

    def line(self, *points, color=GREY, width=1.5, dash="", arrow=False):
        """Straight pieces through points, with an arrow at their end."""
        way = " ".join(f"{_number(float(x))},{_number(float(y))}" for x, y in points)
        more = {"stroke_dasharray": dash} if dash else {}
        if arrow:
            more["marker_end"] = f"url(#{color[1:]})"
        self.add("polyline", points=way, fill="none", stroke=color, stroke_width=width, **more)

    def dot(self, x, y, radius=4, color=INK):
        """A filled circle."""
        self.add("circle", cx=x, cy=y, r=radius, fill=color)

    def save(self, name: str) -> None:
        """Write docs/images/NAME.svg."""
        heads = "".join(
            f'<marker id="{c[1:]}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
            f'markerHeight="7" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="{c}"/></marker>'
            for c in (BLUE, RED, GREEN, GREY, INK)
        )
        text = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
            f'width="{self.width}" height="{self.height}" font-family="sans-serif">'
            f'<defs>{heads}</defs><rect width="100%" height="100%" rx="6" fill="{PAPER}"/>'
            + "\n".join(self._parts)
            + "</svg>\n"
        )
        (IMAGES / f"{name}.svg").write_text(text, encoding="utf-8")


def _number(value) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def displacement() -> None:
    """The parabola through three places, and samples on it."""
    d = Drawing(640, 250)
    here, prev, nxt = np.array([330.0, 150.0]), np.array([-210.0, 40.0]), np.array([190.0, -90.0])
    velocity, half = 0.5 * (nxt - prev), 0.5 * (nxt + prev)

    def at(t: float) -> tuple[float, float]:
        return tuple(here + velocity * t + half * t * t)

    d.line(*(at(t) for t in np.linspace(-1, 1, 41)), color=FAINT, width=8)
    for end, color, words in ((prev, RED, "to_prev"), (nxt, BLUE, "to_next")):
        tip = here + end
        d.line(tuple(here), tuple(here + 0.97 * end), color=color, width=2, arrow=True)
        middle = here + 0.5 * end
        d.text(middle[0], middle[1] + (26 if color == RED else 30), words, color=color)
        d.dot(*tip, radius=5, color=color)
    for t in np.linspace(-0.25, 0.25, 8, endpoint=False) + 0.25 / 8:
        d.dot(*at(float(t)), radius=3, color=GREEN)
    d.dot(*here, radius=6)
    (x, y), (left, low), (right, high) = here, here + prev, here + nxt
    d.text(x, y + 34, "pixel, t = 0")
    d.text(left, low - 14, "its content at t = -1", color=RED)
    d.text(right, high - 14, "its content at t = 1", color=BLUE)
    d.text(x - 70, y - 34, "sample times", color=GREEN)
    d.line((30, 30), (90, 30), arrow=True)
    d.line((30, 30), (30, 90), arrow=True)
    d.text(100, 34, "x", anchor="start")
    d.text(30, 108, "y")
    d.save("displacement")


def exposures() -> None:
    """Exposures about three frames, by phase."""
    d = Drawing(640, 236)
    left, step = 150, 150
    for row, phase in enumerate(("start", "centre", "end")):
        y = 50 + 52 * row
        opens, closes = Shutter(180, phase=phase).span
        d.text(20, y + 16, f"--phase {phase}", anchor="start")
        for k in (0, 1, 2):
            x = left + step * (k + 0.5)
            d.add("rect", x=x + step * opens, y=y, width=step * (closes - opens), height=24,
                  fill="#cfe0f1", stroke=BLUE)  # fmt: skip
    for k, words in enumerate(("frame 9", "frame 10", "frame 11")):
        x = left + step * (k + 0.5)
        d.line((x, 40), (x, 204), color=INK, dash="3 3", width=1)
        d.text(x, 30, words)
        d.text(x, 222, str(k - 1), size=12)
    d.text(20, 222, "time of frame 10", anchor="start", size=12)
    d.save("exposures")


def tiles() -> None:
    """One motion a pixel, the fastest of a tile, the fastest around it."""
    d = Drawing(720, 270)
    rng = np.random.default_rng(3)
    side, count = 60, 3
    motion = np.zeros((count, count, 2))
    motion[1, 0], motion[0, 2], motion[2, 1] = (46, -14), (14, 24), (28, 7)
    reach = [[(1, 0), (1, 0), (0, 2)], [(1, 0), (1, 0), (0, 2)], [(1, 0), (2, 1), (2, 1)]]
    titles = ("motion", "tile max", "neighbour max")
    for panel, title in enumerate(titles):
        left, top = 20 + panel * 240, 44
        d.text(left + side * count / 2, 28, title, weight="bold")
        for y, x in np.ndindex(count, count):
            d.add("rect", x=left + x * side, y=top + y * side, width=side, height=side,
                  fill=PAPER, stroke=FAINT)  # fmt: skip
            middle = np.array([left + (x + 0.5) * side, top + (y + 0.5) * side])
            if panel == 0:
                for _ in range(3):
                    at = middle + rng.uniform(-14, 14, 2)
                    way = motion[y, x] * rng.uniform(0.5, 1)
                    _stroke(d, at, way, GREY)
            else:
                source = (y, x) if panel == 1 else reach[y][x]
                color = BLUE if source == (1, 0) else GREEN if source == (2, 1) else RED
                _stroke(d, middle, motion[source], color)
    d.text(360, 256, "A tile follows the fastest motion of itself and its neighbours; a diagonal "
                     "one only if it comes this way.", size=12)  # fmt: skip
    d.save("tiles")


def _stroke(d: Drawing, middle, way, color: str) -> None:
    if np.hypot(*way) < 1:
        d.dot(*middle, radius=2, color=color)
        return
    d.line(tuple(middle - way / 2), tuple(middle + way / 2), color=color, width=2, arrow=True)


def reproject() -> None:
    """A row of samples in four time slices, with a depth test."""
    d = Drawing(680, 258)
    cell, left = 28, 190
    colors = [FAINT] * 14
    ball = {3: "#e58a97", 4: RED, 5: RED, 6: "#e58a97"}
    for row, t in enumerate((-0.19, -0.06, 0.06, 0.19)):
        y = 54 + 44 * row
        shift = round(14 * t)
        d.text(20, y + 19, f"slice {row}, t = {t:+.2f}", anchor="start")
        for x, color in enumerate(colors):
            d.add("rect", x=left + x * cell, y=y, width=cell, height=28, fill=color, stroke=PAPER)
        for x in ball:
            if not any(x == other + shift for other in ball):
                d.add("rect", x=left + x * cell, y=y, width=cell, height=28, fill="#fff4d6",
                      stroke="#c77f1a", stroke_dasharray="3 2")  # fmt: skip
        for x, color in ball.items():
            d.add("rect", x=left + (x + shift) * cell, y=y, width=cell, height=28, fill=color,
                  stroke=PAPER)  # fmt: skip
        start = left + 5 * cell
        if shift:
            d.line((start, y - 6), (start + shift * cell, y - 6), color=RED, arrow=True)
    d.text(left, 34, "one row of pixels", anchor="start", weight="bold")
    d.text(left, 244, "red: the moved object; dashed: what it leaves open, filled from the "
                      "neighbouring frames", anchor="start", size=12)  # fmt: skip
    d.save("reproject")


def flow() -> None:
    """From what a user has to what he gets."""
    d = Drawing(760, 330)
    sources = (
        ("frames on disk", "Clip", 40),
        ("arrays", "Frame", 104),
        ("wgpu textures", "Blur.encode", 168),
        ("a scene", "Render, G-buffer", 232),
    )
    for words, made, y in sources:
        d.box(16, y, 130, 46, f"{words}\n{made}", fill="#eef4fa", stroke=BLUE)
        d.line((146, y + 23), (186, y + 23), (186, 151), (210, 151), arrow=True)
    d.box(212, 122, 104, 58, "motion\nto_prev, to_next")
    d.line((316, 151), (340, 151), arrow=True)
    d.box(342, 122, 96, 58, "holdout\ntaken out")
    d.line((438, 151), (460, 151), arrow=True)
    d.box(462, 116, 96, 70, "one method", fill="#fdf0f1", stroke=RED)
    d.line((558, 151), (580, 151), arrow=True)
    d.box(582, 122, 74, 58, "holdout\nput back")
    d.line((656, 151), (676, 151), (676, 87), (688, 87), arrow=True)
    d.line((656, 151), (676, 151), (676, 215), (688, 215), arrow=True)
    d.box(690, 66, 58, 42, "array", fill="#eef7f1", stroke=GREEN)
    d.box(690, 194, 58, 42, "files", fill="#eef7f1", stroke=GREEN)
    d.box(440, 262, 140, 46, "Shutter\ntimes of the samples", fill="#eef4fa", stroke=BLUE)
    d.line((510, 262), (510, 188), arrow=True)
    d.box(440, 20, 140, 46, "neighbouring frames\ncolour, motion, depth", fill="#eef4fa",
          stroke=BLUE)  # fmt: skip
    d.line((510, 66), (510, 114), arrow=True)
    d.save("flow")
