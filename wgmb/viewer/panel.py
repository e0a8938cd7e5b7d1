"""The panel beside the picture and the words on it (Dear ImGui): a State in, a State out."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui

from .. import scenes, shutter
from ..blur import METHODS
from ..errors import InputError
from ..numbering import frame_numbers
from ..pipeline import SAMPLES
from .controls import KEYS, MOUSE, Box
from .stage import REFERENCE_SAMPLES, Report, shutter_of
from .state import COMPARE, REFERENCE, TONES, State, command_line
from .subject import Option
from .theme import ACCENT, COLORS, DIM, INK, packed

WIDTH = 320.0  # of the panel [logical px]
_LABEL = 96.0  # of the words before a slider [logical px]
_TALL = 1000.0  # a window so high shows everything opened [logical px]


@dataclass
class Info:
    """What the panel tells, and what there is to choose from."""

    report: Report
    adapter: str
    methods: list[str]
    looks: list[str]
    rivals: list[str]
    options: dict[str, Option]
    frame_times: np.ndarray  # seconds, the last one last
    draw_times: np.ndarray
    passes: dict[str, float] = field(default_factory=dict)
    recording: str = ""
    export: str = ""
    message: str = ""
    finding: str = ""
    flicked: bool = False


class Panel:
    """Draws the panel; `places` says where its widgets are, `actions` what was asked for."""

    def __init__(self):
        self.places: dict[str, Box] = {}
        self.actions: list[tuple[str, str]] = []
        self.active = False
        self._files = {"settings": "wgmb.toml", "output": "wgmb.mp4"}

    def width(self, state: State, window: tuple[float, float]) -> float:
        """Of the panel [logical px]."""
        return min(WIDTH, 0.5 * window[0]) if state.panel else 0.0

    def draw(self, state: State, info: Info, window: tuple[float, float], area: Box) -> State:
        """One frame of it; the state as the sliders now stand."""
        self.places, self.actions = {}, []
        self._words(state, info, area)
        if state.help:
            self._help(area)
        width = self.width(state, window)
        if width:
            imgui.set_next_window_pos((window[0] - width, 0))
            imgui.set_next_window_size((width, window[1]))
            flags = imgui.WindowFlags_
            fixed = flags.no_title_bar | flags.no_resize | flags.no_move | flags.no_collapse
            imgui.begin("panel", None, fixed | flags.no_nav | flags.no_bring_to_front_on_focus)
            state = self._sections(state, info, window[1] >= _TALL)
            imgui.end()
        self.active = imgui.is_any_item_active()
        return state

    # ---- sections ------------------------------------------------------------------------

    def _sections(self, state: State, info: Info, tall: bool) -> State:
        self._header(state, info)
        state = self._transport(state)
        for title, section, opened in (
            ("Scene" if state.is_scene else "Frames", self._scene, True),
            ("Blur", self._blur, True),
            ("Shutter", self._shutter, True),
            ("View", self._view, True),
            ("Animation", self._animation, tall),
            ("Time", self._time, tall),
            ("Files", self._files_section, tall),
        ):
            imgui.set_next_item_open(opened, imgui.Cond_.once)
            imgui.spacing()
            opened = imgui.collapsing_header(title)
            self._keep(title)
            if opened:
                state = section(state, info)
        return state

    def _header(self, state: State, info: Info) -> None:
        size, full = info.report.size, info.report.full
        imgui.text("wgmb")
        share = size[0] / max(full[0], 1)
        times = info.frame_times
        text = f"{size[0]} x {size[1]}" + (f" ({share:.0%})" if share < 0.995 else "")
        if info.report.moving and len(times) > 2:
            text += f"   {1 / max(float(np.median(times[-12:])), 1e-4):.0f} fps"
        self._right(text)

    def _right(self, text: str) -> None:
        room = imgui.get_content_region_avail().x
        wide = imgui.calc_text_size(text).x
        imgui.same_line(imgui.get_cursor_pos_x() + room - wide)
        imgui.text_disabled(text)

    def _transport(self, state: State) -> State:
        first, last = state.span
        if self._button("Pause" if state.playing else "Play", 64, "play"):
            state = replace(state, playing=not state.playing)
        imgui.same_line()
        imgui.set_next_item_width(-1)
        form = "frame %.1f" if state.is_scene else "frame %.0f"
        changed, frame = imgui.slider_float("##frame", state.frame, first, max(last, first), form)
        self._keep("frame")
        return replace(state, frame=frame, playing=False) if changed else state

    def _scene(self, state: State, info: Info) -> State:
        names = list(scenes.SCENES) if state.is_scene else [state.source, *scenes.SCENES]
        label = "scene" if state.is_scene else "shown"
        chosen = self._combo(label, state.source, names, shown=_name(state.source))
        if chosen != state.source:
            return state.opened(chosen)
        if state.is_scene:
            known = inspect.signature(scenes.SCENES[state.source]).parameters
            defaults = {name: parameter.default for name, parameter in known.items()}
            for name, value in (defaults | dict(state.settings)).items():
                default = defaults[name]
                new = self._setting(name, value, default)
                if new != value:
                    state = state.with_setting(name, new)
            moved = state.unmoved() != state
            text = "{:.0f}, {:.0f} deg, x {:.2f}".format(*state.orbit, state.dolly)
            self._label("camera")
            imgui.align_text_to_frame_padding()
            imgui.text_disabled(text)
            if moved:
                imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - 46)
                if self._button("reset", 46):
                    state = state.unmoved()
        elif info.finding:
            imgui.push_text_wrap_pos(0)
            imgui.text_disabled(f"vectors: {info.finding}")
            imgui.pop_text_wrap_pos()
        return state

    def _animation(self, state: State, info: Info) -> State:
        state = replace(state, frames=self._text("frames", state.frames, state))
        state = self._slide(state, "fps", 1, 120, "%.0f", log=True)
        return self._slide(state, "speed", 0.02, 4, "x %.2f", log=True)

    def _setting(self, name: str, value, default):
        """A parameter of the scene as it now stands."""
        self._label(name)
        if isinstance(default, str):
            flag = imgui.InputTextFlags_.enter_returns_true
            changed, new = imgui.input_text(f"##set {name}", str(value), flag)
        elif isinstance(default, int):
            changed, new = imgui.slider_int(f"##set {name}", int(value), 1, max(4 * default, 10))
        else:
            most = max(4 * abs(default), 2.0)
            step = most / 300
            changed, new = imgui.drag_float(f"##set {name}", value, step, -most, most, "%.2f")
        self._keep(f"set {name}")
        return new if changed else value

    def _blur(self, state: State, info: Info) -> State:
        state = state.with_method(self._combo("method", state.method, info.methods))
        state = self._samples(state)
        chosen = dict(state.options)
        for name, option in info.options.items():
            if name == "show":
                continue  # looked at by View
            value: Any = chosen.get(name, option.default)
            if option.choices:
                word = self._combo(name, str(value), list(option.choices))
                if word != value:
                    state = state.with_option(name, word if word != option.default else None)
                continue
            changed, value = self._number(name, value, option.default)
            if changed:
                state = state.with_option(name, value if value != option.default else None)
        state = self._slide(state, "jitter", 0, 1, "%.2f")
        self._label("longest")
        limited, on = state.max_blur is not None, state.max_blur or 40.0
        _, limit = imgui.checkbox("##limited", limited)
        self._keep("limited")
        imgui.same_line()
        imgui.set_next_item_width(-1)
        imgui.begin_disabled(not limit)
        changed, most = imgui.slider_float("##max_blur", on, 1, 400, "%.0f px", _LOG)
        self._keep("max_blur")
        imgui.end_disabled()
        return replace(state, max_blur=(most if changed else on) if limit else None)

    def _number(self, name: str, value, default: bool | int | float) -> tuple[bool, object]:
        """Whether an option was changed, and to what."""
        self._label(name.replace("_", " "))
        if isinstance(default, bool):
            changed, value = imgui.checkbox(f"##{name}", bool(value))
        elif isinstance(default, int):
            changed, value = imgui.input_int(f"##{name}", int(value))
            value = max(value, 0)
        else:
            most = max(4 * default, 0.01)
            changed, value = imgui.slider_float(f"##{name}", float(value), 0, most, "%.3f")
        self._keep(name)
        return changed, value

    def _samples(self, state: State) -> State:
        auto = state.samples == "auto"
        own = getattr(METHODS[state.method], "samples", SAMPLES)
        self._label("samples")
        imgui.set_next_item_width(-64)
        imgui.begin_disabled(auto)
        now = state.samples if isinstance(state.samples, int) else own
        changed, number = imgui.slider_int("##samples", now, 1, 256, "auto" if auto else "%d", _LOG)
        self._keep("samples")
        imgui.end_disabled()
        imgui.same_line()
        toggled, auto = imgui.checkbox("auto", auto)
        self._keep("auto")
        if toggled:
            return replace(state, samples="auto" if auto else None)
        return replace(state, samples=max(number, 1)) if changed else state

    def _shutter(self, state: State, info: Info) -> State:
        self._label("angle")
        changed, angle = imgui.slider_float("##shutter", state.shutter, 0, 720, "%.0f deg")
        self._keep("shutter")
        if changed:
            state = replace(state, shutter=float(round(angle)))
        names = ["start", "centre", "end"]
        own = state.phase not in shutter.PHASES
        phase = self._combo("phase", state.phase if not own else "at", [*names, "at"])
        if phase == "at" and not own:
            return replace(state, phase="0")
        if phase != "at":
            state = replace(state, phase=phase)
        else:
            self._label("")
            now = float(state.phase)
            changed, middle = imgui.slider_float("##phase at", now, -1, 1, "%.2f frames")
            self._keep("phase at")
            state = replace(state, phase=f"{middle:.2f}") if changed else state
        curves = list(shutter.CURVES)
        curves += [] if state.curve in curves else [state.curve]
        state = replace(state, curve=self._combo("curve", state.curve, curves))
        rolling = self._combo("rolling", state.rolling or "off", ["off", *shutter.ROLLING])
        state = replace(state, rolling=None if rolling == "off" else rolling)
        if state.rolling:
            state = self._slide(state, "rolling_duration", 0, 2, "%.2f frames", label="over")
        self._curve(state)
        return state

    def _curve(self, state: State) -> None:
        """The shutter over time, the frames' instants as lines."""
        room = imgui.get_content_region_avail().x
        imgui.dummy((room, 48))
        self._keep("curve drawn")
        x, y, width, height = self.places["curve drawn"]
        ink = imgui.get_window_draw_list()
        ink.add_rect_filled((x, y), (x + width, y + height), packed(COLORS["frame_bg"]), 4)
        times, passed = shutter_of(state).integral(96)
        reach = max(1.0, 1.05 * float(np.abs(times).max()))
        for instant in range(-int(reach), int(reach) + 1):
            at = x + width * (0.5 + 0.5 * instant / reach)
            ink.add_line((at, y), (at, y + height), packed((1, 1, 1, 0.22 if not instant else 0.1)))
            if instant:
                room = 3 if instant < 0 else -21
                ink.add_text((at + room, y + 1), packed(DIM), f"{instant:+d}")
        if times[-1] <= times[0]:
            return
        weight = np.gradient(passed, times)
        tall = weight / max(float(weight.max()), 1e-9)
        xs = np.round(x + width * (0.5 + 0.5 * times / reach))
        ys = y + height - 3 - (height - 9) * tall
        base = y + height - 3
        for left, right, top in zip(xs[:-1], xs[1:], (ys[:-1] + ys[1:]) / 2, strict=True):
            ink.add_rect_filled((left, top), (right, base), packed((*ACCENT[:3], 0.25)))
        points = [(xs[0], base), *zip(xs, ys, strict=True), (xs[-1], base)]
        ink.add_polyline([ImVec2(*p) for p in points], packed(ACCENT), 1.5, 0)

    def _view(self, state: State, info: Info) -> State:
        state = replace(state, look=self._combo("look at", state.look, info.looks))
        if state.look == "depth":
            state = self._slide(state, "middle", 0.1, 100, "%.1f", log=True, label="middle grey")
        elif state.look == "velocity":
            self._label("full colour")
            height = max(info.report.full[1], 1)
            now = state.fastest * height
            changed, fast = imgui.slider_float("##fastest", now, 1, height, "%.0f px", _LOG)
            self._keep("fastest")
            state = replace(state, fastest=fast / height) if changed else state
        else:
            state = self._slide(state, "exposure", -8, 8, "%+.1f stops")
            state = replace(state, tone=self._combo("tone", state.tone, list(TONES)))
        return self._compare(state, info)

    def _compare(self, state: State, info: Info) -> State:
        if state.look == "error":
            state = self._gain(state)
            self._reference(info)
            return state
        state = replace(state, compare=self._combo("compare", state.compare, list(COMPARE)))
        if state.compare == "off":
            return state
        state = replace(state, against=self._combo("with", state.against, info.rivals))
        if state.compare == "difference":
            state = self._gain(state)
        if state.against == REFERENCE:
            self._reference(info)
        return state

    def _gain(self, state: State) -> State:
        return self._slide(state, "gain", 1, 64, "x %.0f", log=True)

    def _reference(self, info: Info) -> None:
        """How far it has come, and how far the picture is from it."""
        done, total = info.report.reference, REFERENCE_SAMPLES
        imgui.progress_bar(done / total, (-1, 6), "")
        measured = info.report.measured
        text = f"{done} rays a pixel"
        if measured:
            text = f"PSNR {measured.psnr:.1f} dB"
            if measured.flip and measured.flip.done():
                text += f"   FLIP {measured.flip.result():.3f}"
            text += f"   ({measured.rays} rays)"
        imgui.text(text)

    def _time(self, state: State, info: Info) -> State:
        imgui.push_text_wrap_pos(0)
        imgui.text_disabled(info.adapter)
        imgui.pop_text_wrap_pos()
        self._plot("frame", info.frame_times)
        self._plot("drawing", info.draw_times)
        for name, seconds in info.passes.items():
            imgui.text_disabled(name)
            self._right(f"{1e3 * seconds:.1f} ms")
        return state

    def _plot(self, name: str, seconds: np.ndarray) -> None:
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
        self._keep(f"{name} times")

    def _files_section(self, state: State, info: Info) -> State:
        self._file("settings")
        half = (imgui.get_content_region_avail().x - 8) / 2
        if self._button("Save settings", half):
            self.actions.append(("save", self._files["settings"]))
        imgui.same_line()
        if self._button("Load settings", half):
            self.actions.append(("load", self._files["settings"]))
        if self._button("Picture (s)", half, "screenshot"):
            self.actions.append(("screenshot", ""))
        imgui.same_line()
        if self._button("Stop (v)" if info.recording else "Record (v)", half, "record"):
            self.actions.append(("record", ""))
        imgui.spacing()
        self._file("output")
        command = command_line(state.command(self._files["output"]))
        imgui.push_text_wrap_pos(0)
        imgui.text_disabled(command)
        imgui.pop_text_wrap_pos()
        self._keep("command")
        if self._button("Copy", half):
            self.actions.append(("copy", command))
        imgui.same_line()
        if self._button("Export", half):
            self.actions.append(("export", self._files["output"]))
        if info.export:
            imgui.push_text_wrap_pos(0)
            imgui.text(info.export)
            imgui.pop_text_wrap_pos()
        return state

    def _file(self, name: str) -> None:
        self._label(name)
        _, self._files[name] = imgui.input_text(f"##{name}", self._files[name])
        self._keep(f"file {name}")

    # ---- on the picture ------------------------------------------------------------------

    def _words(self, state: State, info: Info, area: Box) -> None:
        x, y, width, height = area
        first, second = info.report.labels
        if state.compare == "flicker" and state.look != "error":
            self._tag(second if info.flicked else first, x + 12, y + 12)
        elif state.compare in ("wipe", "split") and state.look != "error":
            self._tag(first, x + 12, y + 12)
            left = x + width / 2 + 12 if state.compare == "split" else x + width - 12
            self._tag(second, left, y + 12, right=state.compare == "wipe")
        elif state.compare == "difference" and state.look != "error":
            self._tag(f"{first} - {second}, x {state.gain:.0f}", x + 12, y + 12)
        elif state.look != "result" or not state.panel:
            name = f"error of {first}, x {state.gain:.0f}" if state.look == "error" else first
            self._tag(name, x + 12, y + 12)
        if info.recording:
            self._tag(
                info.recording, x + width / 2, y + 12, middle=True, color=(0.95, 0.3, 0.25, 1)
            )
        if info.message:
            self._tag(info.message, x + width / 2, y + height - 40, middle=True)

    def explain(self, state: State, box: Box | None, info: Info) -> None:
        """Words beside the colours' key in `box` [logical px]."""
        if box is None:
            return
        x, y, width, height = box
        if state.look == "velocity":
            speed = state.fastest * info.report.full[1]
            self._tag(f"{speed:.0f} px per frame", x - 10, y + height - 24, right=True)
        elif state.look == "depth":
            self._tag("0", x, y - 26)
            self._tag(f"{state.middle:.1f}", x + width / 2, y - 26, middle=True)
            self._tag("far", x + width, y - 26, right=True)
        else:
            self._tag("0", x, y - 26)
            self._tag(f"{1 / state.gain:.2f}", x + width, y - 26, right=True)

    def _tag(self, text: str, x: float, y: float, *, right=False, middle=False, color=INK) -> None:
        size = imgui.calc_text_size(text)
        x -= size.x * (1.0 if right else 0.5 if middle else 0.0)
        ink = imgui.get_background_draw_list()
        ink.add_rect_filled((x - 7, y - 3), (x + size.x + 7, y + size.y + 3),
                            packed((0.05, 0.05, 0.06, 0.72)), 5)  # fmt: skip
        ink.add_text((x, y), packed(color), text)

    def _help(self, area: Box) -> None:
        x, y, width, height = area
        imgui.set_next_window_pos((x + width / 2, y + height / 2), pivot=(0.5, 0.5))
        imgui.set_next_window_bg_alpha(0.94)
        flags = imgui.WindowFlags_
        fixed = flags.no_title_bar | flags.always_auto_resize | flags.no_move | flags.no_nav
        imgui.begin("help", None, fixed | flags.no_inputs)
        for table in (MOUSE, KEYS):
            for name, what in table.items():
                imgui.text_colored(ACCENT, name)
                imgui.same_line(160)
                imgui.text(what)
            imgui.spacing()
        imgui.end()

    # ---- widgets -------------------------------------------------------------------------

    def _label(self, text: str) -> None:
        imgui.align_text_to_frame_padding()
        imgui.text(text)
        imgui.same_line(_LABEL)
        imgui.set_next_item_width(-1)

    def _keep(self, name: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self.places[name] = (low.x, low.y, high.x - low.x, high.y - low.y)

    def _button(self, text: str, width: float, name: str = "") -> bool:
        pressed = imgui.button(text, (width, 0))
        self._keep(name or text)
        return pressed

    def _combo(self, name: str, now: str, names: list[str], shown: str = "") -> str:
        self._label(name)
        start, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
        self.places[name] = (start.x, start.y, wide, imgui.get_frame_height())
        whole = imgui.ComboFlags_.height_largest
        opened = imgui.begin_combo(f"##{name}", shown or now, whole)
        if opened:
            for item in names:
                picked, _ = imgui.selectable(_name(item), item == now)
                self._keep(f"{name}: {item}")
                if picked:
                    now = item
            imgui.end_combo()
        return now

    def _slide(
        self, state: State, name: str, low, high, form: str, *, log=False, label=""
    ) -> State:
        self._label(label or name)
        flags = _LOG if log else 0
        changed, value = imgui.slider_float(
            f"##{name}", getattr(state, name), low, high, form, flags
        )
        self._keep(name)
        return replace(state, **{name: value}) if changed else state

    def _text(self, name: str, now: str, state: State) -> str:
        self._label(name)
        changed, text = imgui.input_text(f"##{name}", now, imgui.InputTextFlags_.enter_returns_true)
        self._keep(name)
        if not changed:
            return now
        try:
            frame_numbers(text)
        except InputError:
            return now
        return text


_LOG = int(imgui.SliderFlags_.logarithmic)


def _name(source: str) -> str:
    """A file's or scene's name; ImGui does not show what follows ##."""
    return re.sub("#+", "*", Path(source).name)
