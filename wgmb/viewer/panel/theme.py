"""Style of the panel: dark, flat, one accent colour, a readable font (Dear ImGui)."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import ImVec2, imgui

_FONT = 15.0

INK = (0.90, 0.91, 0.93, 1.0)
DIM = (0.56, 0.58, 0.62, 1.0)
ACCENT = (0.98, 0.70, 0.28, 1.0)
COLORS = {
    "text": INK,
    "text_disabled": DIM,
    "window_bg": (0.105, 0.110, 0.122, 1.0),
    "popup_bg": (0.135, 0.140, 0.155, 1.0),
    "border": (0.22, 0.23, 0.25, 1.0),
    "frame_bg": (0.165, 0.172, 0.190, 1.0),
    "frame_bg_hovered": (0.21, 0.22, 0.245, 1.0),
    "frame_bg_active": (0.24, 0.25, 0.28, 1.0),
    "slider_grab": (0.38, 0.39, 0.43, 1.0),
    "slider_grab_active": (0.60, 0.43, 0.17, 1.0),
    "check_mark": ACCENT,
    "button": (0.20, 0.21, 0.235, 1.0),
    "button_hovered": (0.27, 0.28, 0.31, 1.0),
    "button_active": (0.34, 0.35, 0.39, 1.0),
    "header": (0.145, 0.150, 0.166, 1.0),
    "header_hovered": (0.19, 0.20, 0.22, 1.0),
    "header_active": (0.22, 0.23, 0.26, 1.0),
    "plot_lines": ACCENT,
    "plot_histogram": ACCENT,
    "scrollbar_bg": (0.0, 0.0, 0.0, 0.0),
    "scrollbar_grab": (0.25, 0.26, 0.29, 1.0),
}


def style() -> None:
    """Dress the current ImGui context."""
    look = imgui.get_style()
    for name, color in COLORS.items():
        look.set_color_(getattr(imgui.Col_, name), imgui.ImVec4(*color))
    look.window_padding, look.frame_padding = ImVec2(14, 10), ImVec2(8, 3)
    look.item_spacing, look.item_inner_spacing = ImVec2(8, 4), ImVec2(6, 4)
    look.frame_rounding = look.grab_rounding = look.popup_rounding = 4
    look.scrollbar_size, look.scrollbar_rounding, look.grab_min_size = 9, 4, 12
    look.window_border_size, look.popup_border_size, look.window_rounding = 0, 1, 0
    font = Path(imgui_bundle.__file__).parent / "assets/fonts/Roboto/Roboto-Regular.ttf"
    if font.is_file():
        imgui.get_io().fonts.add_font_from_file_ttf(str(font), _FONT)


def packed(color: tuple[float, float, float, float]) -> int:
    """A colour as draw lists take it."""
    return imgui.color_convert_float4_to_u32(imgui.ImVec4(*color))
