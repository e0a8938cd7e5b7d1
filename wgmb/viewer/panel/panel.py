"""The panel beside the picture: a State in, a State out (Dear ImGui)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import imgui

from ..controls import Box
from ..state.state import State
from ..state.words import for_shell
from . import overlay, sections
from .info import Info
from .widgets import Widgets

WIDTH = 320.0  # of the panel [logical px]
_HIGH, _TALL = 830.0, 1000.0  # windows so high show more opened, and all [logical px]


class Panel:
    """Draws the panel; `places` says where its widgets are, `actions` lists the requests."""

    def __init__(self):
        self._ui = Widgets()
        self.actions: list[tuple[str, str]] = []
        self.active = False
        self._files = {"settings": "wgmb.toml", "output": "wgmb.mp4"}

    @property
    def places(self) -> dict[str, Box]:
        """Positions of the widgets in the last frame, by name [logical px]."""
        return self._ui.places

    def width(self, state: State, window: tuple[float, float]) -> float:
        """Of the panel [logical px]."""
        return min(WIDTH, 0.5 * window[0]) if state.panel else 0.0

    def draw(self, state: State, info: Info, window: tuple[float, float], area: Box) -> State:
        """One frame of it; the state as the sliders now stand.

        `area`: the picture's [logical px].
        """
        self._ui.places, self._ui.refused, self.actions = {}, "", []
        overlay.tell(info.recording, info.message, area)
        if state.help:
            overlay.give_help(area)
        width = self.width(state, window)
        if width:
            imgui.set_next_window_pos((window[0] - width, 0))
            imgui.set_next_window_size((width, window[1]))
            flags = imgui.WindowFlags_
            fixed = flags.no_title_bar | flags.no_resize | flags.no_move | flags.no_collapse
            imgui.begin("panel", None, fixed | flags.no_nav | flags.no_bring_to_front_on_focus)
            state = self._sections(state, info, window[1])
            imgui.end()
        if self._ui.refused:
            self.actions.append(("say", self._ui.refused))
        self.active = imgui.is_any_item_active()
        return state

    def _sections(self, state: State, info: Info, height: float) -> State:
        self._header(info)
        state = self._transport(state, info)
        for title, section, opened in (
            (_subject(state), sections.scene, True),
            ("Blur", sections.blur, True),
            ("Shutter", sections.shutter, True),
            ("View", sections.view, True),
            ("Animation", sections.animation, height >= _HIGH),
            ("Time", sections.times, height >= _TALL),
            ("Files", self._files_section, height >= _TALL),
        ):
            imgui.set_next_item_open(opened, imgui.Cond_.once)
            imgui.spacing()
            opened = imgui.collapsing_header(title)
            self._ui.keep(title)
            if opened:
                state = section(self._ui, state, info)
        return state

    def _header(self, info: Info) -> None:
        size, full = info.report.size, info.report.full
        imgui.text("wgmb")
        imgui.same_line()
        imgui.text_disabled("h: help")
        share = size[0] / max(full[0], 1)
        times = info.frame_times
        text = f"{size[0]} x {size[1]}" + (f" ({share:.0%})" if share < 0.995 else "")
        if info.report.moving and len(times) > 2:
            text += f"   {1 / max(float(np.median(times[-12:])), 1e-4):.0f} fps"
        self._ui.right(text)

    def _transport(self, state: State, info: Info) -> State:
        first, last = state.span
        if self._ui.button("Pause" if state.playing else "Play", 64, "play"):
            state = replace(state, playing=not state.playing)
        imgui.same_line()
        imgui.set_next_item_width(-1)
        if state.is_scene:
            changed, frame = imgui.slider_float("##frame", state.frame, first, last, "frame %.1f")
        else:
            changed, frame = imgui.slider_int("##frame", state.number, first, last, "frame %d")
        self._ui.keep("frame")
        state = replace(state, frame=float(frame), playing=False) if changed else state
        self._bar(state, info)
        if state.is_video:
            self._ui.dim(info.frame)
        return state

    def _bar(self, state: State, info: Info) -> None:
        """Saving the picture, recording, and the command line, at once."""
        third = (imgui.get_content_region_avail().x - 16) / 3
        if self._ui.button("Picture (s)", third, "screenshot"):
            self.actions.append(("screenshot", ""))
        imgui.same_line()
        if self._ui.button("Stop (v)" if info.recording else "Record (v)", third, "record"):
            self.actions.append(("record", ""))
        imgui.same_line()
        if self._ui.button("Command", third, "copy command"):
            self.actions.append(("copy", commands(state, self._files["output"])))

    def _files_section(self, ui: Widgets, state: State, info: Info) -> State:
        self._file("settings")
        half = (imgui.get_content_region_avail().x - 8) / 2
        if ui.button("Save settings", half):
            self.actions.append(("save", self._files["settings"]))
        imgui.same_line()
        if ui.button("Load settings", half):
            self.actions.append(("load", self._files["settings"]))
        self._file("output")
        command = commands(state, self._files["output"])
        ui.dim(command)
        ui.keep("command")
        if ui.button("Copy", half):
            self.actions.append(("copy", command))
        imgui.same_line()
        if ui.button("Export", half):
            self.actions.append(("export", self._files["output"]))
        if info.export:
            imgui.push_text_wrap_pos(0)
            imgui.text(info.export)
            imgui.pop_text_wrap_pos()
        return state

    def _file(self, name: str) -> None:
        self._ui.label(name)
        _, self._files[name] = imgui.input_text(f"##{name}", self._files[name])
        self._ui.keep(f"file {name}")


def _subject(state: State) -> str:
    """Name of the view, as the title of its section."""
    return "Scene" if state.is_scene else "Video" if state.is_video else "Frames"


def commands(state: State, output: str) -> str:
    """The line that makes the video; with settings B, if they are compared with, a second one."""
    lines = [for_shell(state.command(output))]
    if state.is_compared_with_kept:
        other = Path(output)
        named = str(other.with_stem(f"{other.stem}-b"))
        lines.append(for_shell(state.as_kept.command(named)))
    return "\n".join(lines)
