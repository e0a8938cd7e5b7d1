"""The panel's sections: the subject, its blur and its display."""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui

from ...color.highlights import MOST
from ...color.ocio import installed
from ...color.spaces import Display
from ...methods import METHODS
from ...pipeline.arguments import SAMPLES
from ...scene import builtin
from ...settings.color import ColorSettings
from ...shutter import CURVES, PHASES, ROLLING
from ..state.groups import DEFAULTS
from ..state.state import (
    BOTH_EYES,
    COMPARE,
    FLOWS,
    QUALITIES,
    REFERENCE,
    TONES,
    State,
)
from ..state.video_time import SOURCE, at_rate, check, in_frames, rate
from .info import Info
from .theme import (
    ACCENT,
    COLORS,
    DIM,
    packed,
)
from .widgets import LOG, Widgets, plain

# ---- what is seen ---------------------------------------------------------------------------


def scene(ui: Widgets, state: State, info: Info) -> State:
    """Another scene, its parameters, its camera; of frames on disk what was found out, of videos
    where motion comes from.
    """
    names = [*info.recent, *builtin.SCENES]
    if state.source not in names:
        names = [state.source, *names]
    label = "scene" if state.is_scene else "shown"
    chosen = ui.combo(label, state.source, names, text=plain(state.source))
    if chosen != state.source:
        return ui.tried(state, lambda: state.opened(chosen, state.input.max_mb))
    if not state.is_scene:
        if info.available.finding:
            ui.dim(info.available.finding)
        return video(ui, state, info) if state.is_video else state
    known = inspect.signature(builtin.SCENES[state.source]).parameters
    defaults = {name: parameter.default for name, parameter in known.items()}
    said = state.scene.parameters()
    for name, default in defaults.items():
        value = type(default)(said.get(name, default))
        new = _parameter(ui, name, value, default)
        if new != value:
            state = state.with_parameter(name, new)
    ui.label("camera")
    imgui.align_text_to_frame_padding()
    imgui.text_disabled(
        "{:.0f}, {:.0f} deg, x {:.2f}".format(*state.scene.orbit, state.scene.dolly)
    )
    if state.unmoved() != state:
        imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - 46)
        if ui.button("reset", 46):
            state = state.unmoved()
    return state


def _parameter(ui: Widgets, name: str, value: Any, default: Any):
    """A parameter of the scene as it now stands."""
    ui.label(name)
    if isinstance(default, str):
        flag = imgui.InputTextFlags_.enter_returns_true
        changed, new = imgui.input_text(f"##set {name}", str(value), flag)
    elif isinstance(default, int):
        changed, new = imgui.slider_int(f"##set {name}", int(value), 1, max(4 * default, 10))
    else:
        most = max(4 * abs(default), 2.0)
        step = most / 300
        changed, new = imgui.drag_float(f"##set {name}", value, step, -most, most, "%.2f")
    ui.keep(f"set {name}")
    return new if changed else value


def animation(ui: Widgets, state: State, info: Info) -> State:
    """Frames, frame rate and playback speed."""
    state = ui.text(state, "frames", state.frames, lambda text: in_frames(state, text))
    if not state.is_video:
        state = ui.slide(state, "fps", 1, 120, "%.0f", log=True)
    return ui.slide(state, "speed", 0.02, 4, "x %.2f", log=True, label="playback")


AUTO = "auto"
"""As a method: the one that suits the motion of a video."""


# ---- how it is blurred ----------------------------------------------------------------------


def blur(ui: Widgets, state: State, info: Info) -> State:
    """The method and its options."""
    state = _method(ui, state, info)
    state = _samples(ui, state)
    for name, option in info.available.options.items():
        if name == "show":
            continue  # looked at by view
        own = state.setting(name)
        now = option.default if own == DEFAULTS[name] else own
        if option.choices:
            new = ui.combo(name, str(now), option.choices)
            changed = new != now
        else:
            changed, new = ui.number(name, now, option.default)
        if changed:
            new = DEFAULTS[name] if new == option.default else new
            state = state.with_settings(**{name: new})
    state = ui.setting(state, "jitter", 0, 1, "%.2f")
    ui.label("max blur")
    limited, on = state.blur.max_blur is not None, state.blur.max_blur or 40.0
    _, limit = imgui.checkbox("##limited", limited)
    ui.keep("limited")
    imgui.same_line()
    imgui.set_next_item_width(-1)
    imgui.begin_disabled(not limit)
    changed, most = imgui.slider_float("##max_blur", on, 1, 400, "%.0f px", LOG)
    ui.keep("max_blur")
    imgui.end_disabled()
    return state.with_settings(max_blur=(most if changed else on) if limit else None)


def _method(ui: Widgets, state: State, info: Info) -> State:
    """The method; of a video also "auto", which leaves it to the motion, as `wgmb blur` does."""
    methods = info.available.methods
    if not state.is_video:
        return state.with_method(ui.combo("method", state.method, methods))
    name = AUTO if state.is_method_suited else state.method
    chosen = ui.combo("method", name, [AUTO, *methods])
    if chosen == name:
        return state
    return state.suited_by(state.method) if chosen == AUTO else state.with_method(chosen)


def _samples(ui: Widgets, state: State) -> State:
    samples, auto = state.blur.samples, state.suited_blur.samples == "auto"
    own = getattr(METHODS[state.method], "samples", SAMPLES)
    ui.label("samples")
    imgui.set_next_item_width(-64)
    imgui.begin_disabled(auto)
    now = samples if isinstance(samples, int) else own
    changed, number = imgui.slider_int("##samples", now, 1, 256, "auto" if auto else "%d", LOG)
    ui.keep("samples")
    imgui.end_disabled()
    imgui.same_line()
    toggled, auto = imgui.checkbox("auto", auto)
    ui.keep("auto")
    if toggled:
        return state.with_settings(samples="auto" if auto else own if state.is_video else None)
    return state.with_settings(samples=max(number, 1)) if changed else state


def shutter(ui: Widgets, state: State, info: Info) -> State:
    """Shutter angle, phase and curve."""
    ui.label("angle")
    now = state.shutter.degrees
    changed, angle = imgui.slider_float("##shutter", now, 0, 720, "%.0f deg")
    ui.keep("shutter")
    if changed:
        state = state.with_settings(shutter=float(round(angle)))
    when = state.shutter
    names = ["start", "centre", "end"]
    own = when.phase not in PHASES
    phase = ui.combo("phase", when.phase if not own else "at", [*names, "at"])
    if phase == "at" and not own:
        return state.with_settings(phase="0")
    if phase != "at":
        state = state.with_settings(phase=phase)
    else:
        ui.label("")
        now = float(when.phase)
        changed, middle = imgui.slider_float("##phase at", now, -1, 1, "%.2f frames")
        ui.keep("phase at")
        state = state.with_settings(phase=f"{middle:.2f}") if changed else state
    curve = when.curve or "box"
    curves = [*CURVES, *([] if curve in CURVES else [curve])]
    state = state.with_settings(curve=ui.combo("curve", curve, curves))
    rolling = ui.combo("rolling", when.rolling or "off", ["off", *ROLLING])
    state = state.with_settings(rolling=None if rolling == "off" else rolling)
    if rolling != "off":
        state = ui.setting(state, "rolling_duration", 0, 2, "%.2f frames", label="duration")
    _curve(ui, state)
    return state


def _curve(ui: Widgets, state: State) -> None:
    """The shutter over time, the frames' instants as lines."""
    room = imgui.get_content_region_avail().x
    imgui.dummy((room, 48))
    ui.keep("curve drawn")
    x, y, width, height = ui.places["curve drawn"]
    ink = imgui.get_window_draw_list()
    ink.add_rect_filled((x, y), (x + width, y + height), packed(COLORS["frame_bg"]), 4)
    times, passed = state.shutter.make().integral(96)
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


# ---- how it is shown ------------------------------------------------------------------------


def view(ui: Widgets, state: State, info: Info) -> State:
    """View, comparison and exposure."""
    state = replace(state, look=ui.combo("look at", state.look, info.available.looks))
    if info.available.eyes:
        state = replace(state, eyes=ui.combo("eyes", state.eyes, info.available.eyes))
    if state.look == "depth":
        state = ui.slide(state, "middle", 0.1, 100, "%.1f", log=True, label="middle grey")
    elif state.look == "velocity":
        ui.label("max speed")
        height = max(info.report.full[1], 1)
        now = state.fastest * height
        changed, fast = imgui.slider_float("##fastest", now, 1, height, "%.0f px", LOG)
        ui.keep("fastest")
        state = replace(state, fastest=fast / height) if changed else state
    else:
        state = _eye(ui, state) if state.eye else state
        state = ui.slide(state, "exposure", -8, 8, "%+.1f stops")
        state = _colors(ui, state, info.available.display)
    return _compare(ui, state, info)


def _colors(ui: Widgets, state: State, display: Display | None) -> State:
    """Controls of the display: a config's display, view and look, or a tone and sRGB."""
    if installed():
        now = state.color.ocio or ("$OCIO" if display else "off")
        names = dict.fromkeys((now, "off", "builtin", "studio"))
        config = ui.combo("ocio", now, list(names), text=plain(now))
        if config != now:
            return replace(state, color=ColorSettings(ocio=config))
    if display is None:
        return replace(state, tone=ui.combo("tone", state.tone, TONES))
    config = display.config
    screen = ui.combo("display", display.display, config.displays)
    if screen != display.display:
        return state.with_settings(display=screen, view_transform=None)
    view = ui.combo("view", display.view, config.views(screen))
    if view != display.view:
        state = state.with_settings(view_transform=view)
    looks = config.looks
    if looks:
        own = "of the view"
        look = ui.combo("look", display.look or own, [own, *looks])
        if look != (display.look or own):
            state = state.with_settings(look=None if look == own else look)
    return state


def _eye(ui: Widgets, state: State) -> State:
    """Parameters of the cone cell."""
    state = ui.slide(state, "cone_rate", 20, 200, "%.0f / s", log=True, label="decay")
    state = ui.slide(state, "cone_peak", 0, 0.2, "%.3f s", label="peak")
    if state.eye:
        ui.dim(f"uses the last {state.eye.frames_needed(state.fps)} frames at {state.fps:g} fps")
    return state


def _compare(ui: Widgets, state: State, info: Info) -> State:
    if state.mode == "error":
        state = _gain(ui, state)
        _reference(info)
        return state
    if state.mode in BOTH_EYES:
        return state
    state = replace(state, compare=ui.combo("compare", state.compare, COMPARE))
    half = (imgui.get_content_region_avail().x - 8) / 2
    if ui.button("Keep as B (b)", half, "keep"):
        state = state.keeping()
    imgui.same_line()
    imgui.begin_disabled(state.kept is None)
    if ui.button("Exchange (x)", half, "exchange"):
        state = state.swapped()
    imgui.end_disabled()
    if state.compare == "off":
        return state
    state = replace(state, against=ui.combo("with", state.against, info.available.rivals))
    if state.compare == "difference":
        state = _gain(ui, state)
    if state.against == REFERENCE:
        _reference(info)
    return state


def _gain(ui: Widgets, state: State) -> State:
    return ui.slide(state, "gain", 1, 64, "x %.0f", log=True)


def _reference(info: Info) -> None:
    """Progress of the reference, and the image's difference from it."""
    done, total = info.report.reference
    imgui.progress_bar(done / total, (-1, 6), "")
    measured = info.report.measured
    text = f"{done} rays per pixel"
    if measured:
        text = f"PSNR {measured.psnr:.1f} dB"
        if measured.flip and measured.flip.done():
            text += f"   FLIP {measured.flip.result():.3f}"
        text += f"   ({measured.samples} rays)"
    imgui.text(text)


# ---- how long it takes ----------------------------------------------------------------------


def times(ui: Widgets, state: State, info: Info) -> State:
    """The window's frames, the drawing in them, and every pass."""
    ui.dim(info.adapter)
    ui.plot("frame", info.frame_times)
    ui.plot("drawing", info.draw_times)
    for name, seconds in info.passes.items():
        imgui.text_disabled(short_name(name))
        ui.right(f"{1e3 * seconds:.1f} ms")
    return state


def short_name(of_pass: str) -> str:
    """The name of a pass without its shader's folders, so that its time has room beside it."""
    return of_pass.rpartition("/")[2].replace(".wgsl:", " ")


# ---- the panel's section of a video: its output's rate, speed and part, and its motion --------


def video(ui: Widgets, state: State, info: Info) -> State:
    """Rate, speed and part of the output, repeats, highlights, and motion."""
    said = SOURCE if state.own_times else f"{float(rate(state)):.5g}"
    state = ui.text(state, "fps", said, lambda text: at_rate(state, text))
    state = ui.text(state, "output speed", state.video.speed, lambda text: at_pace(state, text))
    settings = state.video
    state = ui.text(
        state, "begin", settings.begin or "", lambda text: in_part(state, "begin", text)
    )
    state = ui.text(state, "end", settings.end or "", lambda text: in_part(state, "end", text))
    fills = ui.combo("duplicates", settings.duplicates, ("keep", "fill"))
    if fills != settings.duplicates:
        state = state.with_video(duplicates=fills)
    changed, times = ui.slider("highlights", settings.highlights, 1, MOST, "x %.1f")
    if changed:
        state = state.with_video(highlights=round(times, 1))
    return state.with_settings(
        flow=ui.combo("flow", settings.flow, FLOWS),
        flow_quality=ui.combo("flow quality", settings.flow_quality, QUALITIES),
    )


def at_pace(state: State, text: str) -> State:
    """The same at another speed of the output."""
    check(state.with_settings(speed=text))
    return state.with_video(speed=text)


def in_part(state: State, name: str, text: str) -> State:
    """The same with another `begin` or `end`; "" for the video's own."""
    return state.with_video(**{name: text or None})
