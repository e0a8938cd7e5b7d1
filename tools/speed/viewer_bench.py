"""The time until the viewer shows a changed setting, and how long its panel stands still.

    xvfb-run -s '-screen 0 1920x1080x24' python tools/speed/viewer_bench.py [--inline]
        [--size WxH] [SUBJECT ...]

SUBJECT: scene, frames (1920 x 1080, with depth), video (1280 x 720). For each the window is opened
and the shutter set anew, with the mouse at rest and moving: then the panel is drawn 24 times a
second. Printed are the seconds to the first image and to the final one, how long a frame of the
panel was waited for at most, in 99 % and in 50 % of all frames but the one that opens the window,
and how many processes were ready to run in that minute (the load). `--inline` draws in the
window's own thread, as with a GPU. `--size`: of the window, 1280x720 by default.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rendercanvas.glfw import RenderCanvas

from wgmb import Blur, Frame, Render
from wgmb.io import exr
from wgmb.scene import builtin
from wgmb.settings.scene import size_of
from wgmb.viewer import State, Viewer
from wgmb.viewer.window import open_devices, short_turns

_EVERY = 1 / 24  # seconds from one frame of the panel to the next, at best


def main() -> int:
    """Print a line for each subject and step."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("subjects", nargs="*", default=["scene", "frames", "video"])
    parser.add_argument("--inline", action="store_true")
    parser.add_argument("--size", default="1280x720")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, short_turns():
        for name in given.subjects:
            measure(name, source_of(name, Path(folder)), size_of(given.size), not given.inline)
    return 0


def source_of(name: str, folder: Path) -> str:
    """The scene, or files made for it."""
    if name == "scene":
        return "crossing"
    if name == "frames":
        return frames(folder)
    return video(folder)


def frames(folder: Path) -> str:
    """Three frames of 1920 x 1080 with vectors and depth; their pattern."""
    render = Render(builtin.make("crossing"), Blur("tap"), size=(1920, 1080), antialias=1)
    for number in range(3):
        frame: Frame = render.frame(number / 24, number)
        rgba = np.ascontiguousarray(frame.color[..., :4])
        motion = np.zeros((*rgba.shape[:2], 4), np.float32)
        motion[:] = 12.0, 0.0, 12.0, 0.0
        layers: dict[str, np.ndarray] = {
            f"Vector.{c}": motion[..., i] for i, c in enumerate("XYZW")
        }
        made = exr.new(rgba)
        assert frame.depth is not None
        made.parts[0].channels.update(layers | {"Depth.Z": frame.depth})
        (folder / f"a.{number:04d}.exr").write_bytes(exr.encode(made))
    return str(folder / "a.####.exr")


def video(folder: Path) -> str:
    """A video of 1280 x 720, one second long."""
    import av

    path = folder / "a.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("h264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 1280, 720, "yuv420p"
        rng = np.random.default_rng(0)
        wall = rng.integers(0, 255, (90, 200, 3), np.uint8).repeat(8, 0).repeat(8, 1)
        for number in range(24):
            picture = np.ascontiguousarray(wall[:, 12 * number : 12 * number + 1280])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    return str(path)


def measure(name: str, source: str, size: tuple[int, int], threaded: bool) -> None:
    """Open a source, then change the shutter, then another method."""
    canvas = RenderCanvas(title="wgmb", size=size, update_mode="manual", vsync=False)
    state, news = State().opened(source), []
    devices = open_devices() if threaded else {}
    viewer = Viewer(canvas, state, **devices, call_soon=news.append)
    steps = (
        ("opened", lambda: state, False),
        ("shutter", lambda: viewer.state.with_settings(shutter=90.0), False),
        ("shutter, mouse moves", lambda: viewer.state.with_settings(shutter=270.0), True),
        ("tap, mouse moves", lambda: viewer.state.with_method("tap"), True),
    )
    for step, change, moves in steps:
        viewer.state = change()
        first, final, gaps = watched(viewer, news, moves)
        gaps = gaps[1:] if step == "opened" else gaps
        most, nearly, half = (1e3 * np.percentile(gaps, share) for share in (100, 99, 50))
        still = f"{most:5.0f} ms, in 99 % {nearly:5.0f}, in 50 % {half:4.0f}"
        sys.stdout.write(
            f"{name:7} {step:21} first {first:5.2f} s  final {final:6.2f} s  a frame took {still}"
            f"  load {os.getloadavg()[0]:.1f}\n"
        )
        sys.stdout.flush()
    viewer.close()
    canvas.close()


def watched(viewer: Viewer, news: list, moves: bool) -> tuple[float, float, list[float]]:
    """Seconds to the first image of the viewer's state and to the final one, and of frames.

    `moves`: the panel is drawn at a steady rate, else only when there is something new. A frame
    takes as long as an event has to wait for it.
    """
    wanted, started, first, took = viewer.state.picture, time.perf_counter(), 0.0, []
    due = started
    while True:
        before = max(due, started)
        viewer.canvas._process_events()
        news.clear()
        viewer.canvas.force_draw()
        if viewer.failed is not None:
            raise viewer.failed
        now = time.perf_counter()
        took.append(now - before)
        drawn = viewer._drawn
        if drawn is not None and drawn.request.state.picture == wanted:
            first = first or now - started
            if not drawn.report.busy and viewer._is_answered:
                return first, now - started, took
        due = max(due + _EVERY, now)
        time.sleep(due - now)
        while viewer.is_threaded and not (moves or news):
            time.sleep(0.005)
        due = time.perf_counter() if not moves else due


if __name__ == "__main__":
    sys.exit(main())
