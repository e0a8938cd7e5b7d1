"""Score the methods on Blender's scenes: python tools/blender_scores.py FOLDER/SCENE ...

Folders as tools/blender_scenes.py makes them. Writes
docs/laboratory/blender-scores.md and a picture per scene.
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from wgmb import Blur, Clip, Frame, exr, gpu, measure
from wgmb.findings import machine

DOCS = Path(__file__).parent.parent / "docs"
SHUTTERS = {"050": 180, "100": 360}
METHODS = (("tap", 16), ("tiles", 35), ("reproject", 16), ("gather", 16), ("gather", 64))
SHARP, PEER, NOISE = "sharp", "Vector Blur", "noise"
SHOWN = "gather 16"
COLUMNS = (SHARP, PEER, *(f"{name} {samples}" for name, samples in METHODS), NOISE)


def main(folders: list[Path]) -> None:
    """Judge every scene at every shutter, and write the page."""
    device = gpu.open_device()
    blurs = {f"{name} {n}": Blur(name, samples=n, device=device) for name, n in METHODS}
    lines, sections = [["scene", *COLUMNS], ["---"] * (len(COLUMNS) + 1)], []
    (DOCS / "images" / "blender").mkdir(exist_ok=True)
    for folder in folders:
        frame = frame_of(folder)
        for text, degrees in SHUTTERS.items():
            truth = picture(folder / f"truth_{text}.exr")
            made = {SHARP: frame.color, PEER: picture(folder / f"blender_vecblur_{text}.exr")}
            for name, blur in blurs.items():
                blur.shutter = degrees
                made[name] = blur(frame)
            pairs = {name: (got, truth) for name, got in made.items()}
            halves = [folder / f"truth_{text}.{half}.exr" for half in "ab"]
            if all(half.is_file() for half in halves):
                pairs[NOISE] = picture(halves[0]), picture(halves[1])
            cells = {
                k: f"{measure.flip(*p):.4f} / {measure.psnr(*p):.1f}" for k, p in pairs.items()
            }
            lines.append([f"{folder.name} {degrees}°", *(cells.get(k, "") for k in COLUMNS)])
            print("  ".join(lines[-1]), flush=True)
        sections.append(section(folder, truth, made))
    table = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    (DOCS / "laboratory" / "blender-scores.md").write_text(
        page(device, table, sections), encoding="utf-8"
    )


def frame_of(folder: Path) -> Frame:
    """Frame 10 with its neighbours."""
    with tempfile.TemporaryDirectory() as links:
        for number, name in ((9, "prev"), (10, "curr"), (11, "next")):
            (Path(links) / f"f.{number:04d}.exr").symlink_to(folder / f"{name}.exr")
        clip = Clip(Path(links) / "f.####.exr")
        return clip.with_neighbours(clip.source(10))


def picture(path: Path) -> np.ndarray:
    """(height, width, 3) linear light."""
    channels = exr.read(path).channels()
    return np.dstack([channels[c].astype(np.float32) for c in "RGB"])


def section(folder: Path, truth: np.ndarray, made: dict[str, np.ndarray]) -> str:
    """What a scene shows, at the last shutter."""
    shown = [measure.display(p[..., :3]) for p in (truth, made[SHOWN])]
    errors = [measure.flip_colors(made[k], truth) for k in (PEER, SHOWN)]
    strip = np.vstack([np.hstack(shown), np.hstack(errors)])
    levels = (255 * np.clip(strip, 0, 1) + 0.5).astype(np.uint8)
    path = DOCS / "images" / "blender" / f"{folder.name}.jpg"
    Image.fromarray(levels).save(path, quality=82, optimize=True)
    about = json.loads((folder / "camera.json").read_text())["doc"]
    return (
        f"## {folder.name}\n\n{about}\n\n![truth, gather, errors](../images/blender/{path.name})\n"
    )


def page(device, table: str, sections: list[str]) -> str:
    """The text of docs/laboratory/blender-scores.md."""
    about = ", ".join(f"{k} {v}" for k, v in machine(device).items())
    return (
        "# Against a path tracer's own motion blur\n\n"
        "Made by hand: `python tools/blender_scenes.py FOLDER` renders the scenes with Cycles "
        "(`pip install bpy==4.5.15 OpenEXR` in an environment of its own, Python 3.11), "
        f"`python tools/blender_scores.py FOLDER/*` scores them ({about}). "
        "`python tools/blender_scenes.py FOLDER FILE.glb` makes a scene of an animated glTF file. "
        "FLIP (lower is better) / PSNR on the display [dB] of 640 x 360 pixels; box shutters "
        f"centred on the frame. `{PEER}`: the node of Blender's compositor, 64 samples. "
        f"`{NOISE}`: one half of the truth's samples against the other, twice the truth's own "
        "error.\n\n"
        + table
        + "\nWhat is left of gather's error: shadows and shading that move over a surface, of "
        "which no vector tells (runner, propeller, cesium_man's shadow); places hidden in all "
        "three frames (c_crossing); a silhouette that turns under its own outline (milk_truck's "
        "tyres at their arches); paths that bend more than three positions can tell (flag: a wave "
        "turns by up to 75° a frame; cesium_man: the file's straight keys leave the parabola "
        "through three frames by up to a pixel).\n"
        "\nThe glTF models are Cesium Man and Cesium Milk Truck, (c) Cesium, from CesiumJS 1.10 "
        "(Apache 2.0; also among Khronos's glTF sample assets, CC-BY 4.0 with trademark "
        "limitations). Their files of glTF 0.9 were made 2.0 by gltf-pipeline, and each file's "
        "animations of one channel joined to one. The files are not part of this project.\n"
        "\nPictures, at 360°: the truth, gather with 16 samples; below, "
        f"{measure.FLIP_GAIN:g} times FLIP of {PEER} and of gather.\n\n" + "\n".join(sections)
    )


if __name__ == "__main__":
    main([Path(text).resolve() for text in sys.argv[1:]])
