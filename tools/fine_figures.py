"""Make the fine scenes of docs/laboratory/scores.md: python tools/fine_figures.py

The scenes are those on which tests/methods/test_never_behind.py compares `gather` with the
simpler methods: fine structure, leaves, soft edges, and the first scene that everybody makes.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "made"))

import fine_scenes
import scores_page

from pictures import enlarged, grid, levels, save
from wgmb import Blur, gpu, metrics
from wgmb.lab.results import machine

METHODS = ("tap", "tiles", "reproject", "gather")
DEGREES, SHOWN = (90, 180, 360), 180
ABOUT = {
    "shaken": "A camera in a hand, 1.6 radians of phase per frame, before thin bars and a wall of "
    "bricks.",
    "foliage": "Leaves of 2 to 8 px flutter before a wall of bricks.",
    "beginner": "A ball and a cube pass over a floor, under a sun.",
    "wires": "Wires, about as thick as a pixel, slide before a wall of bricks.",
    "soft_disk": "A disk out of focus, with a rim of 10 px, before a detailed wall. Vectors are "
    "averaged over the lens, depth is one sample's.",
}
CROPS = {  # corner and size [px] of what is shown
    "shaken": ((40, 20), (80, 50)),
    "foliage": ((30, 20), (80, 50)),
    "beginner": ((22, 20), (80, 50)),
    "wires": ((40, 20), (80, 50)),
    "soft_disk": ((40, 20), (80, 50)),
}


def main() -> None:
    """Score every scene at every shutter, and write them into the page."""
    device = gpu.open_device()
    blurs = {name: Blur(name, samples=16, device=device) for name in METHODS}
    lines, sections = [["scene", "sharp", *METHODS]], []
    for name in fine_scenes.NAMES:
        frame = fine_scenes.sharp(name)
        for degrees in DEGREES:
            truth = fine_scenes.truth(name, degrees)
            made = {"sharp": frame.color[..., :3]}
            for method, blur in blurs.items():
                blur.shutter = degrees
                made[method] = blur(frame)[..., :3]
            lines.append([f"{name} {degrees}°", *(cell(got, truth) for got in made.values())])
            print("  ".join(lines[-1]), flush=True)
            if degrees == SHOWN:
                sections.append(section(name, truth, made))
    scores_page.write("fine scenes", text(device, lines, sections))


def cell(got: np.ndarray, truth: np.ndarray) -> str:
    """FLIP / PSNR [dB]."""
    return f"{metrics.flip(got, truth):.4f} / {metrics.psnr(got, truth):.2f}"


def section(name: str, truth: np.ndarray, made: dict[str, np.ndarray]) -> str:
    """A scene's picture: the truth, `gather` and the nearest other method, and their errors."""
    corner, size = CROPS[name]
    first = "gather"
    second = min(METHODS[:-1], key=lambda method: metrics.flip(made[method], truth))

    def part(shown: np.ndarray) -> np.ndarray:
        return enlarged(levels(shown), corner, size, 4)

    shown = {"truth": truth, first: made[first], second: made[second]}
    pictures = {what: part(metrics.display(p)) for what, p in shown.items()}
    pictures["the frame"] = part(metrics.display(made["sharp"]))
    for method in (first, second):
        error = metrics.flip_colors(made[method], truth)
        pictures[f"{metrics.FLIP_GAIN:g} x FLIP of {method}"] = part(error)
    save(grid(pictures, 3), f"fine/{name}.png")
    return (
        f"### {name}\n\n{ABOUT[name]}\n\n![truth, {first}, {second}, the frame, errors]"
        f"(../images/fine/{name}.png)\n"
    )


def text(device, lines: list[list[str]], sections: list[str]) -> str:
    """The text on fine scenes."""
    about = ", ".join(f"{k} {v}" for k, v in machine(device).items())
    return (
        "On these small scenes a simple method may be as good as a clever one. wgmb renders them "
        "at 160 x 90 pixels, with vectors that are not filtered at edges; the truth is "
        "`distributed` with 256 samples, of `soft_disk` the mean of 128 instants. All methods have "
        "16 samples.\n\n"
        + scores_page.table(lines)
        + f"\nMade with {about}.\n\nThe pictures are crops at {SHOWN}°, enlarged: the truth, "
        "`gather` and the method with the least FLIP of the others; below them, the frame and the "
        "errors.\n\n" + "\n".join(sections)
    )


if __name__ == "__main__":
    main()
