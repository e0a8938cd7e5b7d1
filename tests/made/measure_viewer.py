"""Frames per second of the viewer while the camera is dragged: the median, and the slowest tenth.

    python tests/measure_viewer.py [--window] [SCENE:METHOD[:LOOK] ...]

In a window of 1280 x 720 without its panel, so that the picture is as large; offscreen, or
with --window a real one, which needs a display (such as `xvfb-run`).
"""

import sys
import time

import numpy as np

from wgmb.viewer import State, Viewer, offscreen
from wgmb.viewer.window import frame

SIZE = (1280, 720)
WARM, SECONDS = 3.0, 6.0
WANTED = 10.0  # frames per second


def moves(count: int):
    """A drag to and fro over the window, one move a frame."""
    yield {"event_type": "pointer_down", "x": 640, "y": 360, "button": 1, "buttons": (1,)}
    for i in range(count):
        x, y = 640 + 200 * np.sin(i / 15), 360 + 60 * np.sin(i / 11)
        yield {"event_type": "pointer_move", "x": x, "y": y, "button": 0, "buttons": (1,)}


def dragged(viewer: Viewer, draw) -> np.ndarray:
    """Seconds of every frame after the warm-up."""
    took, started = [], time.perf_counter()
    for event in moves(10_000):
        viewer.canvas.submit_event({"modifiers": (), **event})
        before = time.perf_counter()
        draw()
        now = time.perf_counter()
        if now - started > WARM:
            took.append(now - before)
        if now - started > WARM + SECONDS:
            return np.array(took)
    raise AssertionError("too quick to measure")


def measure(window: bool, scene: str, method: str, look: str = "result") -> float:
    """Prints the figures of one scene and method; the median of frames per second."""
    state = State(source=scene, look=look, panel=False).with_settings(method=method)
    if window:
        from rendercanvas.glfw import RenderCanvas

        canvas = RenderCanvas(title="wgmb", size=SIZE, update_mode="manual", vsync=False)
        viewer = Viewer(canvas, state)

        def draw():
            canvas._process_events()
            canvas.force_draw()
            if viewer.failed:
                raise viewer.failed
    else:
        viewer = offscreen(state, SIZE)

        def draw():
            frame(viewer)

    took = dragged(viewer, draw)
    report = viewer.stage.report
    median, slow = 1 / np.median(took), 1 / np.percentile(took, 90)
    width, height = report.size
    sys.stdout.write(
        f"{scene:12} {method:12} {look:10} {median:6.1f} fps, slowest tenth under {slow:5.1f} fps, "
        f"drawn at {width} x {height}, view {1e3 * viewer.screen.seconds:.1f} ms\n"
    )
    sys.stdout.flush()
    viewer.canvas.close()
    return float(median)


def main() -> int:
    """0 if every pair is quick enough."""
    words = sys.argv[1:]
    pairs = [w.split(":") for w in words if w != "--window"] or [["crossing", "tap"]]
    found = [measure("--window" in words, *pair) for pair in pairs]
    return int(min(found) < WANTED)


if __name__ == "__main__":
    sys.exit(main())
