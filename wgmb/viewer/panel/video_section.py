"""The panel's section of a video: its output's rate, speed and part, and its motion."""

from __future__ import annotations

from ...color.highlights import MOST
from ..state.state import FLOWS, QUALITIES, State
from ..state.video_time import SOURCE, at_rate, check, rate
from .info import Info
from .widgets import Widgets


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
