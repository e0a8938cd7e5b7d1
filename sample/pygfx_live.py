"""Boxes that turn and fly, with motion blur, live in a window: `python sample/pygfx_live.py`.

Needs the extra pygfx and a window library: `./run setup pygfx view`. Space switches the blur.
"""

import sys

import numpy as np
import pygfx
import pylinalg
from rendercanvas.auto import RenderCanvas, loop

from wgmb.hosts.pygfx import MotionBlurPass


def main(method: str = "tiles", frames: int | None = None) -> np.ndarray | None:
    """Open the window, or draw so many `frames` offscreen and return the last picture."""
    canvas = RenderCanvas(
        size=(960, 540), title=f"wgmb: {method}", update_mode="continuous", max_fps=60
    )
    renderer = pygfx.WgpuRenderer(canvas)
    scene, boxes = make_scene()
    camera = pygfx.PerspectiveCamera(50, 16 / 9, depth_range=(0.1, 100))
    blur = MotionBlurPass(camera, method, renderer=renderer, scene=scene, shutter=270)
    renderer.effect_passes = (*renderer.effect_passes, blur)
    time = 0.0

    def draw() -> None:
        nonlocal time
        time += 0.5
        camera.local.position = (np.sin(0.03 * time), 0.5 * np.sin(0.05 * time), 3)
        for i, box in enumerate(boxes):
            box.local.rotation = pylinalg.quat_from_euler((0.07 * i * time / 9, 0.2 * time, 0))
            box.local.x = 7 * np.sin(0.06 * time + i)
        renderer.render(scene, camera)

    def switch(event: dict) -> None:
        if event["key"] == " ":
            blur.enabled = not blur.enabled

    canvas.add_event_handler(switch, "key_down")
    canvas.request_draw(draw)
    if frames is None:
        loop.run()
        return None
    return [np.asarray(canvas.draw()) for _ in range(frames)][-1]  # type: ignore[attr-defined]


def make_scene() -> tuple[pygfx.Scene, list[pygfx.Mesh]]:
    """A scene, and the boxes in it that move."""
    scene, rng = pygfx.Scene(), np.random.default_rng(1)
    scene.add(pygfx.Background.from_color((0.3, 0.45, 0.7)))
    sun = pygfx.DirectionalLight()
    sun.local.position = (1, 2, 3)
    scene.add(pygfx.AmbientLight(), sun)
    boxes = []
    for _ in range(24):
        material = pygfx.MeshPhongMaterial(color=(*rng.random(3), 1), pick_write=True)
        box = pygfx.Mesh(pygfx.box_geometry(1, 1, 1), material)
        box.local.position = rng.uniform((-6, -3, -10), (6, 3, -3))
        boxes.append(box)
    scene.add(*boxes)
    return scene, boxes


if __name__ == "__main__":
    main(*sys.argv[1:2])
