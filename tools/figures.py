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
    Frame,
    Passes,
    Render,
    Shutter,
    Vectors,
    blur_pictures,
)
from wgmb.cli import app
from wgmb.lab.cases import SceneFrame
from wgmb.metrics import display
from wgmb.scene import builtin

SAMPLE = IMAGES.parent.parent / "sample" / "crossing.####.exr"
SIZE = 480, 270  # [px] of built-in scenes
CROSSING = (95, 75), (200, 160)  # corner and size of the part of the sample with most motion [px]
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


def five_settings() -> None:
    """Three values of the settings that matter most; holdout() has a fourth setting."""
    frame, shown = sample(), {}
    for degrees in (90, 180, 360):
        shown[f"--shutter {degrees}"] = blur_of(frame, shutter=degrees)
    save(grid(shown, 3), "five-shutter.jpg")
    shown = {f"--method {name}": blur_of(frame, name) for name in ("tap", "reproject", "gather")}
    save(grid(shown, 3), "five-method.jpg")
    shown = {}
    for samples in (4, 16, 64):
        shown[f"--samples {samples}"] = blur_of(frame, "tap", shutter=360, samples=samples)
    save(grid(shown, 3), "five-samples.jpg")
    shown = {"as filmed": levels(lamps()[2][..., :3] / 255.0)}
    for highlights in (1, 8):
        made = blur_pictures(lamps(), fps_in=24, fps=24, shutter=360, highlights=highlights)
        shown[f"--highlights {highlights}"] = levels(list(made)[2] / 255.0)
    save(grid(shown, 3), "five-highlights.jpg")


def blur_of(frame: Frame, method: str = "gather", **options) -> np.ndarray:
    """The part of the sample where bodies cross, blurred; twice as large."""
    return enlarged(levels(display(Blur(method, **options)(frame))), *CROSSING, 2)


def lamps() -> list[np.ndarray]:
    """Five 8-bit pictures of three lamps before a dim wall, which a camera pans across."""
    y, x = np.mgrid[:160, :200]
    bricks = np.random.default_rng(1).integers(30, 90, (40, 100))
    pictures = []
    for n in range(5):
        at = x + 12 * (n - 2)  # [px]
        wall = bricks[y // 4, (at + 40) // 4]
        picture = np.repeat(wall[..., None], 3, 2).astype(np.uint8)
        for row, column, radius in ((40, 130, 5), (85, 60, 3), (120, 150, 4)):
            picture[(at - column) ** 2 + (y - row) ** 2 <= radius**2] = 255
        pictures.append(picture.repeat(2, axis=0).repeat(2, axis=1))
    return pictures


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


FIGURES = (
    methods,
    shutters,
    holdout,
    five_settings,
    wrong_vectors,
    built_in,
    torusphere,
    drawn_by_commands,
)

if __name__ == "__main__":
    for figure in FIGURES:
        if not sys.argv[1:] or figure.__name__ in sys.argv[1:]:
            figure()
