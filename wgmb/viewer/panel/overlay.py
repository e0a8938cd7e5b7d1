"""Text over the image: labels, colour key, messages, help."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from ..controls import KEYS, MOUSE, Box
from ..draw.composer import View
from .scopes import STOPS
from .theme import ACCENT, INK, packed

_RED = (0.95, 0.3, 0.25, 1.0)
_HELP_WIDTH, _HELP_MARGIN = 540.0, 28.0  # of the help, around its lines [logical px]
_BEHIND = (0.05, 0.05, 0.06, 0.72)


def describe(view: View, area: Box) -> None:
    """Label a view on the canvas, in an area [logical px]."""
    (x, y, width, _), report = area, view.report
    _name_images(view, x, y + 12, width)
    if view.key is not None:
        left, top, wide, high = (v / view.ratio for v in view.key)
        _explain(view, (left, top, wide, high))
    for n, remark in enumerate(filter(None, (report.preview, *report.drafts))):
        tag(remark, x + 12, y + 40 + 28 * n)


def _name_images(view: View, x: float, y: float, width: float) -> None:
    """Label the images in an area `width` wide from `x`, `y` [logical px]."""
    state, (first, second) = view.state, view.report.labels
    left, right = x + 12, x + width - 12
    mode = state.mode if first != second else "off"  # of a comparison, one image is there so far
    if mode == "error":
        tag(f"error of {first}, x {state.gain:.0f}", left, y)
    elif mode == "flicker":
        tag(second if view.flicked else first, left, y)
    elif mode == "wipe":
        tag(first, left, y)
        tag(second, right, y, right=True)
    elif mode in ("split", "pair"):
        tag(first, left, y)
        tag(second, x + width / 2 + 12, y)
    elif mode == "red-cyan":
        tag(f"red: {first}; cyan: {second}", left, y)
    elif mode == "difference":
        tag(f"{first} - {second}, x {state.gain:.0f}", left, y)
    elif state.look != "result" or not state.panel:
        tag(first, left, y)


def _explain(view: View, box: Box) -> None:
    """Words beside the colours' key in `box` [logical px]."""
    state, (x, y, wide, high) = view.state, box
    if state.look == "velocity":
        speed = state.fastest * view.report.full[1]
        tag(f"{speed:.0f} px per frame", x - 10, y + high - 24, right=True)
        return
    if state.look != "depth" and state.mode != "error":  # false colours
        low, high = STOPS
        tag(f"{low}", x, y - 26)
        tag("0", x - low / (high - low) * wide, y - 26, middle=True)
        tag(f"+{high} stops", x + wide, y - 26, right=True)
        return
    tag("0", x, y - 26)
    if state.look == "depth":
        tag(f"{state.middle:.1f}", x + wide / 2, y - 26, middle=True)
        tag("far", x + wide, y - 26, right=True)
    else:
        tag(f"{1 / state.gain:.2f}", x + wide, y - 26, right=True)


def tell(recording: str, message: str, area: Box) -> None:
    """Show the recording state and the message."""
    x, y, width, height = area
    if recording:
        tag(recording, x + width / 2, y + 12, middle=True, color=_RED)
    if message:
        tag(message, x + width / 2, y + height - 40, middle=True)


def tag(
    text: str,
    x: float,
    y: float,
    *,
    right: bool = False,
    middle: bool = False,
    color: tuple[float, float, float, float] = INK,
) -> None:
    """`text` from `x` on, before it, or about it."""
    size = imgui.calc_text_size(text)
    x -= size.x * (1.0 if right else 0.5 if middle else 0.0)
    ink = imgui.get_background_draw_list()
    ink.add_rect_filled((x - 7, y - 3), (x + size.x + 7, y + size.y + 3), packed(_BEHIND), 5)
    ink.add_text((x, y), packed(color), text)


def give_help(area: Box) -> None:
    """All that the mouse and the keys do."""
    x, y, width, height = area
    lines = len(MOUSE) + len(KEYS) + 2
    size = min((height - _HELP_MARGIN) / (lines * imgui.get_text_line_height_with_spacing()), 1.0)
    middle = max(x + width / 2, size * _HELP_WIDTH / 2)  # over the panel where there is no room
    imgui.set_next_window_pos((middle, y + height / 2), pivot=(0.5, 0.5))
    imgui.set_next_window_bg_alpha(1.0)
    flags = imgui.WindowFlags_
    fixed = flags.no_title_bar | flags.always_auto_resize | flags.no_move | flags.no_nav
    imgui.push_font(None, size * imgui.get_style().font_size_base)  # pyright: ignore[reportArgumentType]
    spacing = imgui.get_style().item_spacing
    imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(spacing.x, size * spacing.y))
    imgui.begin("help", None, fixed | flags.no_inputs)
    for table in (MOUSE, KEYS):
        for name, what in table.items():
            imgui.text_colored(ACCENT, name)
            imgui.same_line(160 * size)
            imgui.text(what)
        imgui.spacing()
    imgui.end()
    imgui.pop_style_var()
    imgui.pop_font()
