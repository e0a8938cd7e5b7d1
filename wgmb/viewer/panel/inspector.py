"""The inspector: numbers under the mouse, scopes, and motion as arrows over the picture."""

from __future__ import annotations

import math

import numpy as np
from imgui_bundle import imgui

from ...methods import METHODS
from ...pipeline.arguments import SAMPLES
from ..capabilities import QUICKEST
from ..controls import Box
from ..draw.place import overlap
from ..draw.request import Available
from ..state.state import State
from .scopes import Scopes
from .theme import ACCENT, packed

_STEP = 40.0  # from one arrow to the next [logical px]
_SHORTEST = 0.5  # motion that has an arrow [px]
_VALUES = 96.0  # where they begin, beside their names [logical px]
_NARROWEST = 260.0  # so wide it is at least [logical px]
_HEAD = 5.0  # of an arrow [logical px]


def texel_at(array: np.ndarray, u: float, v: float) -> np.ndarray:
    """The texel of an image (height, width, channels) at a place, 0 to 1 across and down."""
    height, width = array.shape[:2]
    return array[min(int(v * height), height - 1), min(int(u * width), width - 1)]


def lines(
    state: State,
    available: Available,
    under: dict[str, np.ndarray],
    at: tuple[float, float],
    display: np.ndarray | None,
    is_preview: bool = False,
) -> list[str]:
    """The text for a place `at`, 0 to 1 across and down; `display`: values on the screen there.

    `is_preview`: the quickest method stands for the one that is set.
    """
    found = [method_line(state, available, is_preview)]
    if available.layers:
        found.append("layer    " + ", depth ".join(available.layers.values()))
    light = under.get("light")
    if light is None:
        return [*found, "..."]
    height, width = light.shape[:2]
    x, y = int(at[0] * width), int(at[1] * height)
    found.append(f"pixel    {x}, {y} of {width} x {height}")
    found.append("linear   " + " ".join(f"{value:.4g}" for value in texel_at(light, *at)))
    if display is not None:
        found.append("display  " + " ".join(f"{255 * value:.0f}" for value in display))
    if "motion" in under:
        before, after = np.split(texel_at(under["motion"], *at)[:4], 2)
        speed = math.hypot(*map(float, after))
        found.append(f"next     {after[0]:+.2f}, {after[1]:+.2f} px ({speed:.1f})")
        found.append(f"previous {before[0]:+.2f}, {before[1]:+.2f} px")
    if "depth" in under:
        found.append(f"depth    {float(texel_at(under['depth'], *at).flat[0]):.4g}")
    if "confidence" in under:
        names, sure = METHODS[state.method].confidence, texel_at(under["confidence"], *at)
        found += [f"{name} {value:.2f}" for name, value in zip(names, sure, strict=True)]
    return found


def method_line(state: State, available: Available, is_preview: bool = False) -> str:
    """The method and its samples; why it is not gather, where that cannot be had."""
    if is_preview and state.method != QUICKEST:
        return f"method   {QUICKEST}, a preview of {state.method}"
    samples = state.suited_blur.samples or getattr(METHODS[state.method], "samples", SAMPLES)
    text = f"method   {state.method}, {samples} samples"
    if "gather" in available.methods or not available.methods:
        return text
    lacks = "no depth" if "depth" not in available.looks else "no pictures of instants"
    return f"{text} ({lacks})"


def arrows(motion: np.ndarray, place: Box, area: Box) -> list[tuple[float, ...]]:
    """Arrows (x, y, x, y) [logical px] from a grid of pixels to where the next frame has them.

    `motion`: (height, width, 4) [px]; `place` of the whole picture, `area` that is seen of it.
    """
    height, width = motion.shape[:2]
    found = []
    left, top, wide, high = overlap(place, area)
    for y in np.arange(top + _STEP / 2, top + high, _STEP):
        for x in np.arange(left + _STEP / 2, left + wide, _STEP):
            dx, dy = texel_at(motion, (x - place[0]) / place[2], (y - place[1]) / place[3])[2:4]
            if math.isfinite(dx + dy) and math.hypot(dx, dy) >= _SHORTEST:
                end = x + dx * place[2] / width, y + dy * place[3] / height
                found.append((float(x), float(y), float(end[0]), float(end[1])))
    return found


def draw_arrows(motion: np.ndarray, place: Box, area: Box) -> None:
    """The arrows over the picture."""
    ink, color = imgui.get_background_draw_list(), packed(ACCENT)
    ink.push_clip_rect((area[0], area[1]), (area[0] + area[2], area[1] + area[3]))
    for x, y, to_x, to_y in arrows(motion, place, area):
        ink.add_line((x, y), (to_x, to_y), color, 1.2)
        turn = math.atan2(to_y - y, to_x - x)
        for side in (2.6, -2.6):
            corner = to_x + _HEAD * math.cos(turn + side), to_y + _HEAD * math.sin(turn + side)
            ink.add_line((to_x, to_y), corner, color, 1.2)
    ink.pop_clip_rect()


def show(text: list[str], scopes: Scopes, area: Box) -> None:
    """The text and the scopes in a corner of the picture."""
    x, y, width, height = area
    imgui.set_next_window_pos((x + 12, y + height - 12), pivot=(0.0, 1.0))
    imgui.set_next_window_bg_alpha(0.92)
    flags = imgui.WindowFlags_
    fixed = flags.no_title_bar | flags.always_auto_resize | flags.no_move | flags.no_nav
    imgui.begin("inspector", None, fixed | flags.no_inputs | flags.no_focus_on_appearing)
    for line in text:
        name, _, value = line.partition(" ")
        imgui.text(name)
        imgui.same_line(_VALUES)
        imgui.push_text_wrap_pos(max(width - 36, _NARROWEST))
        imgui.text(value.strip())
        imgui.pop_text_wrap_pos()
    scopes.show()
    imgui.end()
