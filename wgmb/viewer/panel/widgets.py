"""Widgets of the panel: a label and a control next to it (Dear ImGui)."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui

from ...errors import InputError
from ..controls import Box
from ..state.groups import HELP
from ..state.state import State

LOG = int(imgui.SliderFlags_.logarithmic)
_TOOLTIP = 320.0  # width of a setting's help [logical px]
_LABEL = 96.0  # of the words before a slider [logical px]


class Widgets:
    """Draws them; `places` says where each is, by name [logical px].

    `refused`: why a value that was typed is not taken, '' if all were.
    """

    def __init__(self):
        self.places: dict[str, Box] = {}
        self.refused = ""

    def keep(self, name: str) -> None:
        """The last item drawn is called so."""
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self.places[name] = (low.x, low.y, high.x - low.x, high.y - low.y)
        if name in HELP and imgui.is_item_hovered(imgui.HoveredFlags_.delay_normal):
            imgui.begin_tooltip()
            imgui.push_text_wrap_pos(_TOOLTIP)
            imgui.text(HELP[name])
            imgui.pop_text_wrap_pos()
            imgui.end_tooltip()

    def label(self, text: str) -> None:
        """The word; the next widget is beside it."""
        imgui.align_text_to_frame_padding()
        imgui.text(text)
        imgui.same_line(_LABEL)
        imgui.set_next_item_width(-1)

    def dim(self, text: str) -> None:
        """A remark, over several lines if need be."""
        imgui.push_text_wrap_pos(0)
        imgui.text_disabled(text)
        imgui.pop_text_wrap_pos()

    def right(self, text: str) -> None:
        """A remark at the end of the line."""
        room = imgui.get_content_region_avail().x
        wide = imgui.calc_text_size(text).x
        imgui.same_line(imgui.get_cursor_pos_x() + room - wide)
        imgui.text_disabled(text)

    def button(self, text: str, width: float, name: str = "") -> bool:
        """Draw a button; returns True if it was pressed."""
        pressed = imgui.button(text, (width, 0))
        self.keep(name or text)
        return pressed

    def combo(self, name: str, now: str, names: Sequence[str], text: str = "") -> str:
        """The one of `names` that is chosen."""
        self.label(name)
        start, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
        self.places[name] = (start.x, start.y, wide, imgui.get_frame_height())
        whole = imgui.ComboFlags_.height_largest
        room = wide - imgui.get_frame_height() - 2 * imgui.get_style().frame_padding.x
        text = shortened(text or now, lambda part: imgui.calc_text_size(part).x <= room)
        opened = imgui.begin_combo(f"##{name}", text, whole)
        if not opened:
            self.keep(name)
        if opened:
            for item in names:
                # What follows ## tells apart files of one name.
                picked, _ = imgui.selectable(f"{plain(item)}##{item}", item == now)
                self.keep(f"{name}: {item}")
                if picked:
                    now = item
            imgui.end_combo()
        return now

    def slide(
        self,
        state: State,
        name: str,
        low: float,
        high: float,
        form: str,
        *,
        log: bool = False,
        label: str = "",
    ) -> State:
        """The state with its field `name` as the slider stands."""
        now = getattr(state, name)
        changed, value = self.slider(name, now, low, high, form, log=log, label=label)
        return replace(state, **{name: value}) if changed else state

    def setting(
        self,
        state: State,
        name: str,
        low: float,
        high: float,
        form: str,
        *,
        log: bool = False,
        label: str = "",
    ) -> State:
        """The state with the option `name` of its settings as the slider stands."""
        now = state.setting(name)
        changed, value = self.slider(name, now, low, high, form, log=log, label=label)
        return state.with_settings(**{name: value}) if changed else state

    def slider(
        self,
        name: str,
        now: float,
        low: float,
        high: float,
        form: str,
        *,
        log: bool = True,
        label: str = "",
    ) -> tuple[bool, float]:
        """Draw a slider; returns whether it was moved, and its value."""
        self.label(label or name)
        changed, value = imgui.slider_float(f"##{name}", now, low, high, form, LOG if log else 0)
        self.keep(name)
        return changed, value

    def number(self, name: str, value: Any, default: bool | int | float) -> tuple[bool, object]:
        """Draw a control for a number; returns whether it was changed, and its value."""
        self.label(name.replace("_", " "))
        if isinstance(default, bool):
            changed, value = imgui.checkbox(f"##{name}", bool(value))
        elif isinstance(default, int):
            changed, value = imgui.input_int(f"##{name}", int(value))
            value = max(value, 0)
        else:
            most = max(4 * default, 0.01)
            changed, value = imgui.slider_float(f"##{name}", float(value), 0, most, "%.3f")
        self.keep(name)
        return changed, value

    def text(
        self, state: State, name: str, now: str, change: Callable[[str], State], label: str = ""
    ) -> State:
        """Words: the state that `change` makes of them once Enter is pressed.

        Where it raises InputError the state stays, and `refused` says why.
        """
        self.label(label or name)
        changed, text = imgui.input_text(f"##{name}", now, imgui.InputTextFlags_.enter_returns_true)
        self.keep(name)
        return self.tried(state, lambda: change(text.strip())) if changed else state

    def tried(self, state: State, change: Callable[[], State]) -> State:
        """The state that `change` makes; `refused` says why if there is none."""
        try:
            return change()
        except InputError as error:
            self.refused = str(error)
            return state

    def plot(self, name: str, seconds: np.ndarray) -> None:
        """Times as a line, the last one in words."""
        if not len(seconds):
            return
        values = np.ascontiguousarray(1e3 * seconds, np.float32)
        imgui.plot_lines(
            f"##{name} times",
            values,
            overlay_text=f"{name}  {float(values[-1]):.1f} ms",
            scale_min=0.0,
            scale_max=max(100.0, float(values.max())),
            graph_size=ImVec2(imgui.get_content_region_avail().x, 44),
        )
        self.keep(f"{name} times")


def shortened(text: str, fits: Callable[[str], bool]) -> str:
    """The text without as much of its middle as it takes to fit; the end tells files apart."""
    for left_out in range(len(text) - 2):
        kept = len(text) - left_out
        shorter = text if not left_out else f"{text[: kept - kept // 2]}..{text[-(kept // 2) :]}"
        if fits(shorter):
            return shorter
    return text


def plain(source: str) -> str:
    """A file's or scene's name; ImGui does not show what follows ##."""
    return re.sub("#+", "*", Path(source).name)
