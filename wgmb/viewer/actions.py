"""Actions of keys and buttons: files, videos, exports, full screen."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import glfw
import numpy as np
from imgui_bundle import imgui

from .. import interpreter
from ..color.srgb import linear
from ..errors import Error, InputError
from ..io import exr, leftovers, stills
from ..io.atomic import mode_of, temporary_name, write_file
from ..io.record import KEY
from ..video.write.frames import FrameVideo
from .draw.draw_thread import DrawThread
from .draw.renderer import Renderer
from .draw.screen import Screen, ScreenThread
from .scaled_canvas import ScaledCanvas
from .state.dropped import source_of
from .state.state import State
from .state.video_time import rate


class Actions:
    """Runs actions and tracks those in progress; failures are shown as messages."""

    def __init__(
        self,
        canvas: ScaledCanvas,
        stage: Renderer | DrawThread,
        screen: Screen | ScreenThread,
        say: Callable[[str], None],
        quit: Callable[[], None],
    ):
        self._window = getattr(canvas, "_window", None)  # of glfw, where there is one
        self._stage, self._screen, self._say, self._quit = stage, screen, say, quit
        self._video: FrameVideo | None = None
        self._windowed: tuple[int, int, int, int] | None = None
        self.export: tuple[subprocess.Popen[str], str] | None = None
        self.export_message = ""

    @property
    def recording(self) -> bool:
        """True while a video is being recorded."""
        return self._video is not None

    def do(self, action: str, argument: str, state: State) -> State:
        """Do it; the state afterwards, which only "open" and "load" change."""
        actions = {
            "quit": self._quit,
            "save": lambda: self._save(Path(argument), state),
            "open": lambda: self._open(argument.split("\0"), state),
            "load": lambda: self._load(Path(argument)),
            "screenshot": lambda: self._screenshot(state),
            "record": lambda: self._record(state),
            "say": lambda: self._say(argument),
            "copy": lambda: self._copy(argument),
            "export": lambda: self._start_export(argument, state),
            "fullscreen": self._fullscreen,
        }
        try:
            return actions[action]() or state
        except (Error, OSError) as error:
            self._say(str(error))
            return state

    def _save(self, path: Path, state: State) -> None:
        write_file(path, state.toml().encode(), mode=mode_of(path.parent, state.files))
        self._say(f"saved {path}")

    def _open(self, paths: list[str], state: State) -> State:
        """The state with dropped files: frames, a video, or saved settings."""
        if len(paths) == 1 and paths[0].lower().endswith(".toml"):
            return self._load(Path(paths[0]))
        source = source_of(paths)
        opened = state.opened(source)
        self._say(f"opened {Path(source).name}")
        return opened

    def _load(self, path: Path) -> State:
        state = State.read(path)
        self._say(f"loaded {path}")
        return state

    def _displayed(self) -> np.ndarray:
        """The picture as it is on the screen, but in linear light, as files are written."""
        return linear(np.clip(self._screen.picture(), 0, 1))

    def _screenshot(self, state: State) -> None:
        path, settings = _free(".png", ".exr"), state.toml()
        mode = mode_of(path.parent, state.files)
        write_file(path, stills.encode(self._displayed(), ".png", 8, settings), mode=mode)
        linear = self._stage.download()
        rgba = np.ones((*linear.shape[:2], 4), np.float32)
        rgba[..., : linear.shape[2]] = linear
        whole = path.with_suffix(".exr")
        made = exr.new(rgba, self._stage.chromaticities | {KEY: settings})
        write_file(whole, exr.encode(made), mode=mode)
        self._say(f"saved {path.name} and {whole.name}")

    def _record(self, state: State) -> None:
        if self._video is None:
            path = _free(".mp4")
            text = f"wgmb {state.toml()}"
            self._video = FrameVideo(path, temporary_name(path), rate(state), text)
            self._video.mode = mode_of(path.parent, state.files)
            return
        self.close()

    def add_frame(self) -> None:
        """Add the displayed image to the video, if one is being recorded."""
        if self._video is not None:
            self._video.add(self._displayed())

    def close(self) -> None:
        """End running work: a video is finished, an export goes on by itself."""
        if self._video is not None:
            video, self._video = self._video, None
            video.close()
            self._say(f"saved {video.path.name}")

    def _copy(self, text: str) -> None:
        imgui.set_clipboard_text(text)
        if self._window is not None:
            glfw.set_clipboard_string(self._window, text)
        self._say("copied")

    def _start_export(self, output: str, state: State) -> None:
        words = state.command(output)
        child = subprocess.Popen(
            interpreter.command("-m", "wgmb", *words, "--quiet"),
            env=interpreter.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        leftovers.add("export", lambda: _end(child))
        self.export, self.export_message = (child, output), f"exporting {output} ..."

    def poll_export(self) -> None:
        """Notice that an export has ended, and how."""
        if self.export is None or self.export[0].poll() is None:
            return
        (child, output), self.export = self.export, None
        leftovers.forget("export")
        said = (child.communicate()[1] or "").strip().splitlines()
        self.export_message = f"exported {output}" if child.returncode == 0 else " ".join(said[-1:])

    def _fullscreen(self) -> None:
        window = self._window
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


def _end(child: subprocess.Popen[str]) -> None:
    """Have an export leave nothing behind, and end."""
    child.terminate()
    child.wait()


def _free(*suffixes: str) -> Path:
    """The first of wgmb-001, wgmb-002, ... that is not there yet, here, with any of these."""
    for number in range(1, 10_000):
        path = Path(f"wgmb-{number:03d}{suffixes[0]}")
        if not any(path.with_suffix(suffix).exists() for suffix in suffixes):
            return path
    raise InputError("no free file name: wgmb-001 to wgmb-9999 all exist")


def _monitor_of(window: tuple[int, int, int, int]):
    """The monitor on which the window's middle is, or the first."""
    x, y = window[0] + window[2] // 2, window[1] + window[3] // 2
    monitors = glfw.get_monitors()
    for monitor in monitors:
        left, top, width, height = glfw.get_monitor_workarea(monitor)
        if left <= x < left + width and top <= y < top + height:
            return monitor
    return monitors[0] if monitors else None
