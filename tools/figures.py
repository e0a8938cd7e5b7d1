"""Make the documentation's other pictures: python tools/figures.py [NAME ...]

Every one comes from the program; NAME is that of a function below.
"""

from __future__ import annotations

import sys

import numpy as np
from PIL import Image

from pictures import IMAGES, enlarged, grid, levels, save
from wgmb import (
    Blur,
    Clip,
    Passes,
    Render,
    Shutter,
    Vectors,
)
from wgmb.cli import app
from wgmb.lab.cases import SceneFrame
from wgmb.metrics import display
from wgmb.scene import builtin

SAMPLE = IMAGES.parent.parent / "sample" / "crossing.####.exr"
SIZE = 480, 270  # [px] of built-in scenes
REFERENCE = 256  # rays a pixel


def sample(**passes):
    """Frame 10 of sample/ with its neighbours."""
    clip = Clip(SAMPLE, passes=Passes(**passes))
    return clip.with_neighbours(clip.source(10))


def methods() -> None:
    """The same place of a scene by every method that takes rendered frames."""
    scene_frame = SceneFrame(builtin.make("crossing", speed=3), size=SIZE, antialias=4)
    frame = scene_frame.frame(Blur("tap").device)
    sheet = {"sharp": frame.color}
    sheet |= {name: Blur(name)(frame) for name in ("tap", "tiles", "fusion", "reproject", "gather")}
    sheet["accumulate, 16"] = scene_frame.render(Blur("accumulate"))(0.0)
    sheet["reference"] = scene_frame.render(Blur("distributed", samples=REFERENCE))(0.0)
    window = (180, 75), (130, 110)
    shown = {k: enlarged(levels(display(p)), *window, 2) for k, p in sheet.items()}
    save(grid(shown, 4), "methods.jpg")


def shutters() -> None:
    """A wheel at several shutters, ray traced."""
    scene, blur = builtin.make("wheel"), Blur("distributed", samples=REFERENCE)
    sheet = {}
    for label, shutter in {
        "90 degrees": Shutter(90),
        "180 degrees": Shutter(180),
        "360 degrees": Shutter(360),
        "360 degrees, triangle": Shutter(360, curve="triangle"),
        "720 degrees, cosine": Shutter(720, curve="cosine"),
        "45 degrees, rolling down": Shutter(45, rolling="down", rolling_duration=1.0),
    }.items():
        blur.shutter = shutter
        picture = Render(scene, blur, size=SIZE)(0.0)
        sheet[label] = enlarged(levels(display(picture)), (60, 60), (200, 180), 2)
    save(grid(sheet, 3), "shutters.jpg")


def holdout() -> None:
    """The helmet of the sample, blurred with the rest and held out."""
    blur = Blur("gather")
    sheet = {
        "everything blurs": display(blur(sample())),
        "--holdout IndexOB=9": display(blur(sample(holdout="IndexOB=9"))),
    }
    save(grid(sheet, 2), "holdout.jpg")


def wrong_vectors() -> None:
    """Right vectors, and three ways to misread them."""
    blur = Blur("gather")
    sheet = {}
    for label, vectors in {
        "right": Vectors("blender"),
        "x flipped": Vectors("blender", flip="x"),
        "y flipped": Vectors("blender", flip="y"),
        "three times too long": Vectors("blender", scale=3),
    }.items():
        sheet[label] = display(blur(sample(vectors=vectors)))
    save(grid(sheet, 2), "wrong-vectors.jpg")


def built_in() -> None:
    """Every built-in scene."""
    sheet = {}
    for name in builtin.SCENES:
        scene = builtin.make(name)
        if scene.has_volumes:
            blur = Blur("volume", shutter=Shutter(288, curve="cosine"))
        else:
            blur = Blur("gather")
        time = 7.5 if name == "torusphere" else 0.0
        sheet[name] = display(Render(scene, blur, size=(320, 180))(time))
    save(grid(sheet, 3), "scenes.jpg")


def torusphere() -> None:
    """A moment of the animation, by the method that was made for it."""
    scene = builtin.make("torusphere", cam_x=-0.6, cam_y=0.3)
    shutter = Shutter(288, curve="cosine")
    picture = Render(scene, Blur("volume", shutter=shutter), size=(800, 450))(7.5)
    save(levels(display(picture)), "torusphere.jpg")


def drawn_by_commands() -> None:
    """Drawings of `wgmb info`, `shutter` and `perceive`."""
    motion = IMAGES / "motion.png"
    lines = [
        ["info", str(SAMPLE), "--frames", "10", "-o", str(motion)],
        ["shutter", "--curve", "cosine", "-o", str(IMAGES / "shutter-cosine.svg")],
        ["perceive", "--report", "-o", str(IMAGES / "perception.svg"), "--fps", "60"],
    ]
    for line in lines:
        assert app.main([*line, "--overwrite"]) == 0
    shown = np.asarray(Image.open(motion), np.float32)[..., :3] / 255
    save(levels(shown), "motion.png")


FIGURES = (methods, shutters, holdout, wrong_vectors, built_in, torusphere, drawn_by_commands)

if __name__ == "__main__":
    for figure in FIGURES:
        if not sys.argv[1:] or figure.__name__ in sys.argv[1:]:
            figure()
