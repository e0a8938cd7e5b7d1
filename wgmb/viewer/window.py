"""The window: events in, pictures out; the same on a desktop (glfw) and offscreen (tests)."""

from __future__ import annotations

import subprocess
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import glfw
import numpy as np
import wgpu
from imgui_bundle import imgui
from rendercanvas.offscreen import OffscreenRenderCanvas
from wgpu.utils.imgui import ImguiRenderer

from .. import exr, gpu, shader, stills
from ..errors import DeviceError, Error, InputError
from ..output import SETTINGS, replace_file, temporary_name
from ..video import Video
from . import controls
from .panel import Info, Panel
from .stage import Stage, picture_key
from .state import COMPARE, State
from .theme import style

TITLE = "wgmb"
_AFTER_WHEEL = 0.3  # seconds for which turning the wheel counts as moving
_FLICKER = 0.5  # seconds an image is shown
_MESSAGE = 4.0  # seconds a message stays
_TIMES = 90  # frames in the plots
_HANDLED = ("pointer_down", "pointer_up", "pointer_move", "wheel", "key_down")
_SEEN = (*_HANDLED, "pointer_enter", "pointer_leave", "key_up", "char", "resize")


class Viewer:
    """A canvas, what it shows, and what its events do.

    `failed` holds the exception that ended it, if one did.
    """

    def __init__(
        self,
        canvas,
        state: State,
        *,
        device: wgpu.GPUDevice | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ):
        self.canvas, self.state, self.clock = canvas, state, clock
        self.device = device or gpu.open_device()
        self.stage, self.panel = Stage(self.device), Panel()
        self.failed: BaseException | None = None
        self._good = state
        self._context = canvas.get_wgpu_context()
        # Plain formats: the picture and ImGui's colours are display values already.
        format = self._context.get_preferred_format(self.device.adapter).removesuffix("-srgb")
        self._context.configure(device=self.device, format=format)
        self._blit = self._blitter(format)
        self._imgui = ImguiRenderer(self.device, canvas)
        style()
        self._imgui.set_gui(self._gui)
        self._held: tuple[str, float, float] | None = None
        self._wheel_until = 0.0
        self._now = self._last = clock()
        self._frame_times: deque[float] = deque(maxlen=_TIMES)
        self._draw_times: deque[float] = deque(maxlen=_TIMES)
        self._passes: dict[str, float] = {}
        self._message = ("", 0.0)
        self._video: Video | None = None
        self._export: tuple[subprocess.Popen, str] | None = None
        self._export_said = ""
        self._windowed: tuple[int, int, int, int] | None = None
        self._info: Info | None = None
        self._sliding = False
        # Before ImGui's handlers, which keep to themselves what they take.
        canvas.add_event_handler(self._guarded(self._on_any), *_SEEN, order=-201)
        canvas.add_event_handler(self._guarded(self._on_event), *_HANDLED, order=-200)
        canvas.request_draw(self._guarded(self._draw))

    # ---- events --------------------------------------------------------------------------

    def _guarded(self, function):
        """Errors end the viewer; left alone, rendercanvas logs them and goes on."""

        def guarded(*given):
            if self.failed is not None:
                return
            try:
                function(*given)
            except Exception as error:
                self.failed = _told(error)
                self.canvas.close()

        return guarded

    def _on_any(self, event: dict) -> None:
        self.canvas.request_draw()

    def _on_event(self, event: dict) -> None:
        kind = event["event_type"]
        io = self._imgui.backend.io
        if kind == "key_down":
            if not io.want_text_input:
                self._on_key(event["key"])
            return
        if kind == "pointer_up":
            self._held = None
            return
        x, y, layout = event["x"], event["y"], self._layout()
        if kind == "pointer_down":
            free = not (io.want_capture_mouse and self._over_popup())
            name = controls.grip(self.state, layout, x, y, event["button"], event["modifiers"])
            self._held = (name, x, y) if name and free else None
        elif kind == "pointer_move" and self._held:
            name, from_x, from_y = self._held
            self.state = controls.drag(self.state, layout, name, x - from_x, y - from_y)
            self._held = name, x, y
        elif kind == "wheel" and not (io.want_capture_mouse and self._over_popup()):
            moved = controls.wheel(self.state, layout, x, y, event["dx"], event["dy"])
            if moved != self.state:
                self.state, self._wheel_until = moved, self.clock() + _AFTER_WHEEL

    def _over_popup(self) -> bool:
        imgui.set_current_context(self._imgui.imgui_context)
        any_popup = imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level
        return imgui.is_popup_open("", any_popup)

    def _on_key(self, name: str) -> None:
        self.state, action = controls.key(self.state, self._layout(), name)
        if action:
            self.do(action)

    def _area(self) -> controls.Box:
        width, height = self.canvas.get_logical_size()
        return 0.0, 0.0, max(width - self.panel.width(self.state, (width, height)), 1.0), height

    def _layout(self) -> controls.Layout:
        ratio = self.canvas.get_pixel_ratio()
        x, y, width, height = self.stage.report.place
        place = (x / ratio, y / ratio, width / ratio, height / ratio)
        info = self._info
        return controls.Layout(
            self._area(),
            place,
            tuple(info.methods) if info else (),
            tuple(info.looks) if info else (),
            COMPARE,
        )

    # ---- drawing -------------------------------------------------------------------------

    def _draw(self) -> None:
        started = time.perf_counter()
        self._now, before = self.clock(), self._last
        self._last = self._now
        state = self.state
        if state.playing or self._video:
            step = 1 / state.fps if self._video else min(self._now - before, 0.5)
            state = controls.played(state, step)
        try:
            possible = self.stage.possible(state)
            if possible.method != state.method:
                self.say(f"method {state.method!r} cannot be used here")
            self.state = state = possible
            self._prepare(state)
            self._good = state
        except (InputError, OSError) as error:
            self.say(str(error))
            if self.state == self._good:
                raise
            self.state = state = replace(self._good, playing=False)
            self._prepare(state)
        report = self.stage.report
        ratio = self.canvas.get_pixel_ratio()
        flicked = self._flicked()
        picture = self.stage.compose(state, self._canvas_size(), ratio, flicked)
        self._paint(picture)
        self._passes |= report.seconds | report.passes
        self._imgui.render()
        if self._video:
            self._video.add(self._shown())
        for action, what in self.panel.actions:
            self.do(action, what)
        self._poll_export()
        seconds = time.perf_counter() - started
        self.stage.finished(seconds, state.rays)
        if report.changed or state.playing:
            self._frame_times.append(max(seconds, self._now - before if report.moving else 0))
            self._draw_times.append(report.seconds["draw"])
        self._ask_for_more(report.busy)

    def _prepare(self, state: State) -> None:
        changes = picture_key(state) != picture_key(self._good)
        self._sliding = self.panel.active and (self._sliding or changes)
        ratio = self.canvas.get_pixel_ratio()
        area = tuple(round(v * ratio) for v in self._area())
        moving = (
            state.playing
            or (self._held is not None and self._held[0] != "wipe")
            or self._now < self._wheel_until
            or self._sliding
        )
        full = self._video is not None
        report = self.stage.update(state, area, self._now, moving and not full, full)
        subject = self.stage.subject(state)
        self._info = Info(
            report=report,
            adapter=self.device.adapter.summary,
            methods=self.stage.methods(state),
            looks=self.stage.looks(state),
            rivals=self.stage.rivals(state),
            options=self.stage.options(state.method),
            frame_times=np.array(self._frame_times),
            draw_times=np.array(self._draw_times),
            passes={k: v for k, v in self._passes.items() if k != "draw"},
            recording="recording" if self._video else "",
            export=self._export_said,
            message=self._message[0] if self._now < self._message[1] else "",
            finding=getattr(subject, "finding", ""),
            flicked=self._flicked(),
        )

    def _canvas_size(self) -> tuple[int, int]:
        width, height = self.canvas.get_physical_size()
        return max(width, 1), max(height, 1)

    def _flicked(self) -> bool:
        return self.state.compare == "flicker" and int(self._now / _FLICKER) % 2 == 1

    def _gui(self) -> None:
        assert self._info is not None
        size, ratio = self.canvas.get_logical_size(), self.canvas.get_pixel_ratio()
        key = self.stage.key_box(self.state, ratio)
        logical = None if key is None else tuple(v / ratio for v in key)
        self.panel.explain(self.state, logical, self._info)
        self.state = self.panel.draw(self.state, self._info, size, self._area())

    def _ask_for_more(self, busy: bool) -> None:
        waiting = self._now < self._message[1] or self._export is not None
        changed = self.state != self._good
        if (
            busy
            or changed
            or self.state.playing
            or self._video
            or self.panel.active
            or (self._now < self._wheel_until or self.state.compare == "flicker" or waiting)
        ):
            self.canvas.request_draw()

    def _blitter(self, format: str):
        module = self.device.create_shader_module(code=shader.load("blit.wgsl").text)
        return self.device.create_render_pipeline(
            label="blit.wgsl",
            layout="auto",
            vertex={"module": module, "entry_point": "corner"},
            primitive={"topology": "triangle-list"},
            fragment={"module": module, "entry_point": "texel", "targets": [{"format": format}]},
        )

    def _paint(self, picture: wgpu.GPUTexture) -> None:
        encoder = self.device.create_command_encoder(label="blit")
        target = self._context.get_current_texture().create_view()
        attachment = {"view": target, "load_op": "clear", "store_op": "store"}
        pass_ = encoder.begin_render_pass(color_attachments=[attachment])
        pass_.set_pipeline(self._blit)
        bound = self.device.create_bind_group(
            layout=self._blit.get_bind_group_layout(0),
            entries=[{"binding": 0, "resource": picture.create_view()}],
        )
        pass_.set_bind_group(0, bound)
        pass_.draw(3)
        pass_.end()
        gpu.submit(self.device, encoder)

    # ---- what is asked for ---------------------------------------------------------------

    def say(self, text: str) -> None:
        """Show a message for a while."""
        self._message = text, self.clock() + _MESSAGE

    def do(self, action: str, what: str = "") -> None:
        """What a key or a button asks for; what cannot be done is said."""
        actions = {
            "quit": lambda: self.canvas.close(),
            "save": lambda: self._save(Path(what)),
            "load": lambda: self._load(Path(what)),
            "screenshot": self._screenshot,
            "record": self._record,
            "copy": lambda: self._copy(what),
            "export": lambda: self._start_export(what),
            "fullscreen": self._fullscreen,
        }
        try:
            actions[action]()
        except (Error, OSError, UnicodeDecodeError) as error:
            self.say(str(error))

    def _save(self, path: Path) -> None:
        replace_file(path, self.state.toml().encode())
        self.say(f"saved {path}")

    def _load(self, path: Path) -> None:
        self.state = State.of_toml(path.read_text(encoding="utf-8"))
        self.say(f"loaded {path}")

    def _shown(self) -> np.ndarray:
        """The picture as it is on the screen, but in linear light, as files are written."""
        return stills.linear(np.clip(self.stage.picture(), 0, 1))

    def _screenshot(self) -> None:
        path, settings = _free(".png", ".exr"), self.state.toml()
        replace_file(path, stills.encode(self._shown(), ".png", 8, settings))
        linear = self.stage.download()
        rgba = np.ones((*linear.shape[:2], 4), np.float32)
        rgba[..., : linear.shape[2]] = linear
        whole = path.with_suffix(".exr")
        replace_file(whole, exr.encode(exr.new(rgba, {SETTINGS: settings})))
        self.say(f"saved {path.name} and {whole.name}")

    def _record(self) -> None:
        if self._video is None:
            path, rate = _free(".mp4"), Fraction(self.state.fps).limit_denominator(1001)
            self._video = Video(path, temporary_name(path), rate, self.state.toml())
            return
        video, self._video = self._video, None
        video.close()
        self.say(f"saved {video.path.name}")

    def _copy(self, text: str) -> None:
        imgui.set_clipboard_text(text)
        if (window := getattr(self.canvas, "_window", None)) is not None:
            glfw.set_clipboard_string(window, text)
        self.say("copied")

    def _start_export(self, output: str) -> None:
        words = self.state.command(output)
        child = subprocess.Popen(
            [sys.executable, "-m", "wgmb", *words, "--quiet"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._export, self._export_said = (child, output), f"making {output} ..."

    def _poll_export(self) -> None:
        if self._export is None or self._export[0].poll() is None:
            return
        (child, output), self._export = self._export, None
        said = (child.communicate()[1] or "").strip().splitlines()
        self._export_said = f"made {output}" if child.returncode == 0 else " ".join(said[-1:])

    def _fullscreen(self) -> None:
        window = getattr(self.canvas, "_window", None)
        if window is None:
            return
        if self._windowed:
            glfw.set_window_monitor(window, None, *self._windowed, glfw.DONT_CARE)  # pyright: ignore
            self._windowed = None
            return
        self._windowed = (*glfw.get_window_pos(window), *glfw.get_window_size(window))
        monitor = _monitor_of(self._windowed)
        if monitor is not None:
            mode = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(window, monitor, 0, 0, *mode.size, mode.refresh_rate)

    def close(self) -> None:
        """Let go of what is under way: a video is finished, an export goes on by itself."""
        if self._video is not None:
            video, self._video = self._video, None
            video.close()


def offscreen(
    state: State, size: tuple[int, int] = (1280, 720), ratio: float = 1.0, **given
) -> Viewer:
    """A Viewer without a window: `canvas.submit_event` in, `frame` out."""
    canvas = OffscreenRenderCanvas(size=size, pixel_ratio=ratio)
    return Viewer(canvas, state, **given)


def frame(viewer: Viewer) -> np.ndarray:
    """Events that were submitted, then one frame of an offscreen viewer: (h, w, 4) uint8."""
    viewer.canvas._process_events()
    image = viewer.canvas.draw()
    if viewer.failed is not None:
        raise viewer.failed
    return np.asarray(image)


def view(state: State, *, adapter: str | None = None, size: tuple[int, int] = (1280, 720)) -> None:
    """Open a window and stay until it is closed; what went wrong in it is raised."""
    device = gpu.open_device(adapter)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # GLFW's remarks; what it returns says the same
        if not glfw.init():
            raise DeviceError(
                "no display: set DISPLAY, or start one with `xvfb-run -s '-screen 0 1280x720x24'`; "
                "`wgmb render` and `wgmb blur` need none"
            )
    from rendercanvas.glfw import RenderCanvas, loop  # only now: without a display it aborts

    canvas = RenderCanvas(title=TITLE, size=size, update_mode="ondemand", max_fps=60)
    viewer = Viewer(canvas, state, device=device)
    loop.run()
    viewer.close()
    if viewer.failed is not None:
        raise viewer.failed


def _free(*suffixes: str) -> Path:
    """The first of wgmb-001, wgmb-002, ... that is not there yet, here, with any of these."""
    for number in range(1, 10_000):
        path = Path(f"wgmb-{number:03d}{suffixes[0]}")
        if not any(path.with_suffix(suffix).exists() for suffix in suffixes):
            return path
    raise InputError("wgmb-001 to wgmb-9999 are all there")


def _monitor_of(window: tuple[int, int, int, int]):
    """The monitor on which the window's middle is, or the first."""
    x, y = window[0] + window[2] // 2, window[1] + window[3] // 2
    monitors = glfw.get_monitors()
    for monitor in monitors:
        left, top, width, height = glfw.get_monitor_workarea(monitor)
        if left <= x < left + width and top <= y < top + height:
            return monitor
    return monitors[0] if monitors else None


def _told(error: Exception) -> Exception:
    """The same error, or one of ours for a GPU that is gone."""
    if isinstance(error, wgpu.GPUError) and "lost" in str(error).lower():
        return DeviceError(f"the GPU was lost: {error}")
    return error
