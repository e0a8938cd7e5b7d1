"""The window: events in, pictures out; the same on a desktop (glfw) and offscreen (tests)."""

from __future__ import annotations

import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, TypedDict, Unpack

import glfw
import numpy as np
import wgpu
from imgui_bundle import imgui
from rendercanvas import BaseRenderCanvas
from rendercanvas.offscreen import OffscreenRenderCanvas
from wgpu.utils.imgui import ImguiRenderer

from .. import gpu
from ..allocator import bound_free_memory
from ..errors import DeviceError, InputError
from . import controls
from .actions import Actions
from .draw.composer import NOTHING, View
from .draw.draw_thread import DrawThread
from .draw.frame_status import FrameStatus
from .draw.place import fit
from .draw.renderer import Renderer
from .draw.request import Drawn, Request
from .draw.screen import Screen, ScreenThread
from .panel import inspector, overlay
from .panel.info import Info
from .panel.panel import Panel
from .panel.scopes import Scopes
from .panel.theme import style
from .scaled_canvas import SIZES, ScaledCanvas
from .state.recent import RecentFiles, default_path
from .state.state import COMPARE, State
from .x_connection import display_watch

TITLE = "wgmb"
_AFTER_WHEEL = 0.3  # seconds for which turning the wheel counts as moving
_REPEAT = 0.4, 0.05  # seconds until a held arrow key repeats, and from one time to the next
_FLICKER = 0.5  # seconds an image is shown
_AFTER_EVENT = 3  # frames: ImGui hides what appears for its first one
_MESSAGE = 4.0  # seconds a message stays
_WAIT = 0.03  # seconds between frames that only wait for a video's motion
_TIMES = 90  # frames in the plots
_RATE = 60  # frames of the window in a second, at most
_RATE_BESIDE = 30  # without a GPU, where each takes 10 ms from what is drawn beside it
_TURN = 0.0005  # seconds that a thread may keep the window's waiting for the interpreter
_HANDLED = ("pointer_down", "pointer_up", "pointer_move", "wheel", "key_down", "key_up")
_SEEN = (*_HANDLED, "pointer_enter", "pointer_leave", "char", "resize")


class ViewerKeywords(TypedDict, total=False):
    """Keywords of a Viewer, all that are of use without a window."""

    device: wgpu.GPUDevice | None
    drawing_device: wgpu.GPUDevice | None
    threaded: bool
    interface: float
    clock: Callable[[], float]


class Viewer:
    """The viewer on a canvas: state, event handling and drawing.

    `interface`: size of the panel and its text. `threaded`: pictures are drawn in a thread with
    `drawing_device` and composed in another one, and the window never waits for them; the threads
    have the window drawn by `call_soon`, of the canvas's loop. `recent`: files that can be opened
    again, and where those that are shown are noted. `has_display`: False once nothing can be
    shown on it any more. `failed` holds the exception that ended the viewer, if one did.
    """

    def __init__(
        self,
        canvas: BaseRenderCanvas,
        state: State,
        *,
        device: wgpu.GPUDevice | None = None,
        drawing_device: wgpu.GPUDevice | None = None,
        threaded: bool = False,
        interface: float = 1.0,
        recent: RecentFiles | None = None,
        call_soon: Callable[[Callable[[], None]], object] | None = None,
        has_display: Callable[[], bool] = lambda: True,
        clock: Callable[[], float] = time.perf_counter,
    ):
        scaled: Any = ScaledCanvas(canvas, interface)  # has all that the canvas has
        self.canvas = scaled
        self.state = state.settled()  # loads what reads ranges of frames, before one waits for it
        self.clock = clock
        self.device = device or gpu.open_device()
        self._context = scaled.get_wgpu_context()
        # Plain formats: the picture and ImGui's colours are display values already.
        format = self._context.get_preferred_format(self.device.adapter).removesuffix("-srgb")
        usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_DST
        self._context.configure(device=self.device, format=format, usage=usage)
        self.stage: Renderer | DrawThread
        self.screen: Screen | ScreenThread
        if threaded:
            other = drawing_device or gpu.second_device(self.device)
            self.stage = DrawThread(other, self._on_news)
            self.screen = ScreenThread(self.device, format, self._on_news)
        else:
            self.stage, self.screen = Renderer(self.device), Screen(self.device, format)
        self.panel = Panel()
        self.actions = Actions(scaled, self.stage, self.screen, self.say, self._quit)
        self.failed: BaseException | None = None
        self.message = ("", 0.0)  # and until when it is shown
        self._recent = recent
        self._has_display = has_display
        self._good = self._requested = state  # drawn without an error, and requested last
        self._call_soon = call_soon
        self._drawn: Drawn | None = None
        self._is_answered = False  # the last request, which is what is on the screen
        self._imgui = ImguiRenderer(self.device, scaled)
        style()
        self._imgui.set_gui(self._noted_gui)
        self._gui_error: Exception | None = None
        self._held: tuple[str, float, float] | None = None  # by the mouse, and where
        self._key: tuple[str, float] | None = None  # an arrow that is down, and when it is due
        self._repeating = False
        self._wheel_until = 0.0
        self._due = 0  # frames still to be drawn because of an event
        self._now = self._last = clock()
        self._frame_times: deque[float] = deque(maxlen=_TIMES)
        self._draw_times: deque[float] = deque(maxlen=_TIMES)
        self._passes: dict[str, float] = {}
        self._timed = ("", "")
        self._info: Info | None = None
        self._sliding = False
        self._mouse = -1.0, -1.0
        self._scopes = Scopes(self.device, self._imgui.backend)
        self._inspected = 0  # lines of the inspector
        # Before ImGui's handlers, which keep to themselves what they take.
        scaled.add_event_handler(self._guarded(self._on_any), *_SEEN, order=-201)
        scaled.add_event_handler(self._guarded(self._on_event), *_HANDLED, order=-200)
        scaled.request_draw(self._draw_unless_failed)

    # ---- events --------------------------------------------------------------------------

    def _guarded(self, function: Callable[..., None]):
        """Errors end the viewer; left alone, rendercanvas logs them and goes on."""

        def guarded(*arguments: Any):
            if self.failed is not None:
                return
            try:
                function(*arguments)
            except wgpu.DrawCancelled:
                raise
            except Exception as error:
                self.failed = gpu.translated(error)
                self._quit()

        return guarded

    def _quit(self) -> None:
        """Close the window, after the drawing in progress: it is presented on the window."""
        close = self.canvas.close
        close() if self._call_soon is None else self._call_soon(close)

    @property
    def is_threaded(self) -> bool:
        """True if pictures are drawn in a thread of their own."""
        return isinstance(self.stage, DrawThread)

    def close(self) -> None:
        """End all work beside the window: a video is finished, an export goes on by itself."""
        self.actions.close()
        self.stage.close()
        self.screen.close()

    def dropped(self, paths: Sequence[str]) -> None:
        """Open files and folders that were dropped onto the window."""
        self.do("open", "\0".join(paths))
        self.canvas.request_draw()

    def _resize_interface(self, factor: float) -> None:
        low, high = SIZES
        self.canvas.scale = min(max(self.canvas.scale * factor, low), high)
        self.say(f"interface {self.canvas.scale:.0%}")

    def _on_any(self, event: dict[str, Any]) -> None:
        self._due = _AFTER_EVENT
        self.canvas.request_draw()

    def _on_event(self, event: dict[str, Any]) -> None:
        kind = event["event_type"]
        if "x" in event:
            self._mouse = event["x"], event["y"]
        if kind == "key_down":
            if not self._imgui.backend.io.want_text_input:
                self._on_key(event["key"])
        elif kind == "key_up":
            if self._key and event["key"] == self._key[0]:
                self._key, self._repeating = None, False
        elif kind == "pointer_up":
            self._held = None
        else:
            self._on_pointer(kind, event)

    def _on_pointer(self, kind: str, event: dict[str, Any]) -> None:
        x, y, layout = event["x"], event["y"], self._layout()
        free = not (self._imgui.backend.io.want_capture_mouse and self._over_popup())
        if kind == "pointer_down":
            name = controls.grip(self.state, layout, x, y, event["button"], event["modifiers"])
            self._held = (name, x, y) if name and free else None
        elif kind == "pointer_move" and self._held:
            name, from_x, from_y = self._held
            self.state = controls.drag(self.state, layout, name, x - from_x, y - from_y)
            self._held = name, x, y
        elif kind == "wheel" and free:
            moved = controls.wheel(self.state, layout, x, y, event["dx"], event["dy"])
            if moved != self.state:
                self.state, self._wheel_until = moved, self.clock() + _AFTER_WHEEL

    def _over_popup(self) -> bool:
        imgui.set_current_context(self._imgui.imgui_context)
        any_popup = imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level
        return imgui.is_popup_open("", any_popup)

    def _on_key(self, name: str) -> None:
        arrow = name.startswith("Arrow")
        self._key, self._repeating = (name, self.clock() + _REPEAT[0]) if arrow else None, False
        self.state, action = controls.key(self.state, self._layout(), name)
        if action in controls.SIZES:
            self._resize_interface(controls.SIZES[action])
        elif action:
            self.do(action)

    def _repeat_key(self) -> None:
        """GLFW's canvas tells of a key only once, however long it is down."""
        if self._key and self._now >= self._key[1]:
            self.state, _ = controls.key(self.state, self._layout(), self._key[0])
            self._key, self._repeating = (self._key[0], self._now + _REPEAT[1]), True

    def _area(self) -> controls.Box:
        width, height = self.canvas.get_logical_size()
        return 0.0, 0.0, max(width - self.panel.width(self.state, (width, height)), 1.0), height

    def _layout(self) -> controls.WindowLayout:
        ratio, info = self.canvas.get_pixel_ratio(), self._info
        x, y, width, height = (v / ratio for v in self._place())
        place = x, y, width, height
        if info is None:
            return controls.WindowLayout(self._area(), place)
        can = info.available
        words = tuple(can.methods), tuple(can.looks), COMPARE, tuple(can.eyes)
        return controls.WindowLayout(self._area(), place, *words)

    def _place(self) -> controls.Box:
        """The place of the whole image on the canvas [px]."""
        shape = self._drawn.report.shape if self._drawn else (1, 1)
        return fit(shape, self._area_px(), self.state)

    def _area_px(self) -> controls.Box:
        ratio = self.canvas.get_pixel_ratio()
        x, y, width, height = (round(v * ratio) for v in self._area())
        return x, y, width, height

    # ---- drawing -------------------------------------------------------------------------

    def _on_news(self) -> None:
        """A thread has drawn something; called there."""
        if self._call_soon is not None:
            self._call_soon(self.canvas.request_draw)

    def _draw_unless_failed(self) -> None:
        """Draw a frame; one that cannot be drawn is not presented either.

        Where the window cannot be drawn to just now, as it is covered, it is tried again.
        """
        try:
            self._guarded(self._draw)()
        except wgpu.DrawCancelled:
            self.canvas.request_draw()
            raise
        if self.failed is not None:
            raise wgpu.DrawCancelled

    def _draw(self) -> None:
        started = time.perf_counter()
        self._now, before = self.clock(), self._last
        self._last, recording = self._now, self.actions.recording
        self._repeat_key()
        state = self.state
        if recording and self._is_answered:
            state = controls.played(state, 1 / state.fps)
        elif state.playing and not recording:
            state = controls.played(state, min(self._now - before, 0.5))
        try:
            self._prepare(state)
        except (InputError, OSError) as error:
            self.say(str(error))
            if self.state == self._good:
                raise
            self._prepare(replace(self._good, playing=False))
        drawn, state, ratio = self._drawn, self.state, self.canvas.get_pixel_ratio()
        width, height = self.canvas.get_physical_size()
        images = drawn.sides(self._flicked()) if drawn else (NOTHING, NOTHING)
        area = self._area_px() if drawn else (0, 0, 0, 0)
        # The panel is over the rest, but for the part of a pixel that rounding leaves.
        free = min(width, area[2] + 1) if drawn else width
        size = max(round(free), 1), max(height, 1)
        report, flicked = (drawn.report if drawn else FrameStatus()), self._flicked()
        self.screen.show(View(state, images, self._place(), area, size, ratio, report, flicked))
        if not self._has_display():  # wgpu would panic
            raise wgpu.DrawCancelled
        self.screen.paint(self._context.get_current_texture())
        if drawn:
            self._note_times(drawn.report)
        try:
            self._imgui.render()
        except RuntimeError:  # ImGui's own, of a panel that was left half drawn
            raise self._gui_error or RuntimeError("the panel cannot be drawn") from None
        if self._is_answered:
            self.actions.add_frame()
        for action, what in self.panel.actions:
            self.do(action, what)
        self.actions.poll_export()
        seconds = time.perf_counter() - started
        self.stage.finished(seconds, state.scene.antialias)
        if drawn is None:
            return
        report = drawn.report
        if report.changed or state.playing:
            took = self._now - before if report.moving else 0
            self._frame_times.append(max(seconds, took))
            self._draw_times.append(report.seconds["draw"])
        if isinstance(self.stage, DrawThread):
            self._ask_for_more(False)  # news come by themselves
            return
        if report.waiting and not (report.changed or report.moving):
            time.sleep(_WAIT)  # the work is not here
        self._ask_for_more(report.busy)

    def _note_times(self, report: FrameStatus) -> None:
        if report.labels != self._timed:  # what is not drawn any more is forgotten
            self._timed, self._passes = report.labels, {}
        self._passes |= report.seconds | report.passes | {"view": self.screen.seconds}

    def _prepare(self, state: State) -> None:
        """Draw the screen; return the state that was shown, as far as it is possible."""
        full = self.actions.recording
        changes = state.picture != self._good.picture
        self._sliding = self.panel.active and (self._sliding or changes)
        moving = (
            state.playing
            or self._repeating
            or (self._held is not None and self._held[0] != "wipe")
            or self._now < self._wheel_until
            or self._sliding
        )
        request = Request(state, self._area_px(), moving and not full, full)
        self.state = state
        self._drawn = drawn = self.stage.draw(request, self._now)
        self._is_answered = drawn is not None and drawn.request == request
        if drawn is None:
            self._requested = state
            return
        self.state = possible = drawn.corrected(state)
        if possible.method != state.method and not state.is_method_suited:
            self.say(f"method {state.method!r} is not available here")
        report = drawn.report
        if self._recent is not None and not drawn.state.is_scene:
            self._recent.add(drawn.state.source)
        self._info = Info(
            report=report,
            adapter=self.device.adapter.summary,
            available=drawn.available,
            frame_times=np.array(self._frame_times),
            draw_times=np.array(self._draw_times),
            passes={k: v for k, v in self._passes.items() if k != "draw"},
            recording="recording" if full else "",
            export=self.actions.export_message,
            recent=self._recent.sources if self._recent else [],
            message=self.message[0] if self._now < self.message[1] else report.waiting,
        )
        self._good, self._requested = drawn.state, self.state

    def _flicked(self) -> bool:
        return self.state.mode == "flicker" and int(self._now / _FLICKER) % 2 == 1

    def _noted_gui(self) -> None:
        """Draw the panel; an error is kept, which ImGui would hide behind its own."""
        try:
            self._gui()
        except Exception as error:
            self._gui_error = error
            raise

    def _gui(self) -> None:
        if self._info is None or self._drawn is None:
            overlay.tag(f"opening {self.state.source} ...", 16, 16)
            return
        size, area = self.canvas.get_logical_size(), self._area()
        info, painted = self._info, self.screen.painted
        if painted is not None:
            overlay.describe(painted, area)
            info = replace(info, frame=painted.report.frame)
        if self.state.inspect or self.state.arrows:
            self._inspect(self._drawn)
        self.state = self.panel.draw(self.state, info, size, area)

    def _inspect(self, drawn: Drawn) -> None:
        """Draw arrows, and the numbers under the mouse."""
        area, layout, under = self._area(), self._layout(), drawn.under
        if self.state.arrows and "motion" in under:
            inspector.draw_arrows(under["motion"], layout.place, area)
        if not self.state.inspect:
            return
        (x, y), (left, top, width, height) = self._mouse, layout.place
        u, v = (x - left) / width, (y - top) / height
        preview = bool(drawn.report.preview)
        text = [inspector.method_line(drawn.state, drawn.available, preview)]
        if 0 <= u < 1 and 0 <= v < 1 and controls.is_inside(area, x, y):
            ratio = self.canvas.get_pixel_ratio()
            display = self.screen.values(x * ratio, y * ratio)
            at = u, v
            text = inspector.lines(drawn.state, drawn.available, under, at, display, preview)
        is_shown = not (preview or drawn.report.moving)  # else the scopes would take too long
        light = under.get("light") if is_shown else None
        if self._scopes.look_at(light) or len(text) != self._inspected:
            self._due = _AFTER_EVENT  # its window becomes larger with the next frame
        self._inspected = len(text)
        inspector.show(text, self._scopes, area)

    def _ask_for_more(self, busy: bool) -> None:
        waiting = self._now < self.message[1] or self.actions.export is not None
        self._due -= 1
        if (
            busy
            or waiting
            or self._due > 0
            or self.state != self._requested
            or self.state.playing
            or self.actions.recording
            or self.panel.active
            or self._key is not None
            or self._now < self._wheel_until
            or self.state.mode == "flicker"
        ):
            self.canvas.request_draw()

    def say(self, text: str) -> None:
        """Show a message for a while."""
        self.message = text, self.clock() + _MESSAGE

    def do(self, action: str, argument: str = "") -> None:
        """Run the action of a key or a button."""
        self.state = self.actions.do(action, argument, self.state)


def offscreen(
    state: State,
    size: tuple[int, int] = (1280, 720),
    ratio: float = 1.0,
    **options: Unpack[ViewerKeywords],
) -> Viewer:
    """A Viewer without a window: `canvas.submit_event` in, `frame` out."""
    canvas = OffscreenRenderCanvas(size=size, pixel_ratio=ratio)
    return Viewer(canvas, state, **options)


def frame(viewer: Viewer) -> np.ndarray:
    """Events that were submitted, then one frame of an offscreen viewer: (h, w, 4) uint8."""
    viewer.canvas._process_events()
    image = viewer.canvas.draw()
    if viewer.failed is not None:
        raise viewer.failed
    return np.asarray(image)


def open_devices(adapter: str | None = None) -> dict[str, Any]:
    """The devices that a Viewer needs: without a GPU, one for the window and one beside it."""
    with gpu.yielding():
        device = gpu.open_device(adapter)
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return {"device": device}
    # The window's is the second one: its threads keep their priority.
    return {"device": gpu.second_device(device), "drawing_device": device, "threaded": True}


def view(
    state: State,
    *,
    adapter: str | None = None,
    size: tuple[int, int] = (1280, 720),
    interface: float = 1.0,
) -> None:
    """Open a window and return when it is closed; errors in it are raised.

    Bounds the memory that glibc's allocator keeps for itself in this process.

    `interface`: size of the panel and its text, times that of the system.
    """
    low, high = SIZES
    if not low <= interface <= high:
        raise InputError(f"`interface` must be {low:g} to {high:g}, got {interface:g}")
    bound_free_memory()
    devices = open_devices(adapter)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # GLFW's remarks; what it returns says the same
        if not glfw.init():
            raise DeviceError(
                "no display: set DISPLAY, or start one with `xvfb-run -s '-screen 0 1280x720x24'`; "
                "`wgmb render` and `wgmb blur` need none"
            )
    from rendercanvas.glfw import RenderCanvas, loop  # only now: without a display it aborts

    class Window(RenderCanvas):
        """A window whose surface is released before it closes."""

        def close(self) -> None:
            _forget_locals(viewer.failed)
            viewer.canvas.release_surface()
            super().close()

    rate = _RATE_BESIDE if devices.get("threaded") else _RATE
    canvas = Window(title=TITLE, size=size, update_mode="ondemand", max_fps=rate)

    def soon(call: Callable[[], None]) -> None:
        with suppress(AttributeError, RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(call)

    recent = RecentFiles(default_path())
    with_loop: dict[str, Any] = {"call_soon": soon, "has_display": display_watch()}
    viewer = Viewer(canvas, state, **devices, **with_loop, interface=interface, recent=recent)
    window: Any = canvas._window
    drop: Any = lambda _, paths: viewer.dropped(paths)  # noqa: E731
    glfw.set_drop_callback(window, drop)
    with short_turns():
        loop.run()
    viewer.close()
    if viewer.failed is not None:
        raise viewer.failed


@contextmanager
def short_turns() -> Iterator[None]:
    """Let threads take short turns in the interpreter.

    The window's thread waits for a turn after each of a hundred calls of wgpu in a frame, while
    others compute in Python.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def _forget_locals(error: BaseException | None) -> None:
    """Clear the variables of an error's callers that have ended: the canvas's hold its surface."""
    frame = error.__traceback__.tb_frame if error and error.__traceback__ else None
    while frame := frame and frame.f_back:
        with suppress(RuntimeError):  # it has not ended
            frame.clear()
