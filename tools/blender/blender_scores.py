"""Score the methods on Blender's scenes.

    python tools/blender/blender_scores.py [--hard] FOLDER/SCENE ...

Folders as blender_scenes.py makes them. Writes docs/laboratory/blender-scores.md, or with --hard
(scenes of light_scenes.py and hard_scenes.py) docs/laboratory/hard-scenes.md, and a picture per
scene. Scenes of the page that are not named keep their rows and pictures.
"""

import json
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from wgmb import (
    Blur,
    Clip,
    Frame,
    gpu,
    metrics,
)
from wgmb.io import exr
from wgmb.lab.results import machine

DOCS = Path(__file__).parents[2] / "docs"
SHUTTERS = {"050": 180, "100": 360}
METHODS = (("tap", 16), ("tiles", 35), ("reproject", 16), ("gather", 16), ("gather", 64))
STILL, FRAMES = "gather 16, shading off", "gather 16, shading frames"
SHARP, PEER, NOISE = "sharp", "Vector Blur", "noise"
SHOWN = "gather 16"
COLUMNS = (SHARP, PEER, *(f"{name} {samples}" for name, samples in METHODS), NOISE)
HARD_COLUMNS = (SHARP, PEER, "tap 16", "tiles 35", "reproject 16", STILL, FRAMES, SHOWN, NOISE)


def main(folders: list[Path], is_hard: bool) -> None:
    """Metric every scene at every shutter, and write the page."""
    device = gpu.open_device()
    columns = HARD_COLUMNS if is_hard else COLUMNS
    blurs = {f"{name} {n}": Blur(name, samples=n, device=device) for name, n in METHODS}
    for name, shading in ((STILL, "off"), (FRAMES, "frames")):
        blurs[name] = Blur("gather", samples=16, device=device, shading=shading)
    blurs = {name: blurs[name] for name in columns if name in blurs}
    file, page_of = ("hard-scenes.md", hard_page) if is_hard else ("blender-scores.md", page)
    path = DOCS / "laboratory" / file
    rows, sections = of_page(path.read_text("utf-8") if path.is_file() else "", columns)
    (DOCS / "images" / "blender").mkdir(exist_ok=True)
    for folder in folders:
        frame, lines = frame_of(folder), []
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
                k: f"{metrics.flip(*p):.4f} / {metrics.psnr(*p):.1f}" for k, p in pairs.items()
            }
            lines.append([f"{folder.name} {degrees}°", *(cells.get(k, "") for k in columns)])
            print("  ".join(lines[-1]), flush=True)
        rows[folder.name] = "".join(map(row, lines))
        errors_of = (STILL, SHOWN) if is_hard else (PEER, SHOWN)
        sections[folder.name] = section(folder, truth, made, errors_of)
    head = row(["scene", *columns]) + row(["---"] * (len(columns) + 1))
    table = head + "".join(rows.values())
    about = ", ".join(f"{k} {v}" for k, v in machine(device).items())
    kept = [name for name in rows if name not in {folder.name for folder in folders}]
    if kept:
        about += f"; {', '.join(kept)}: earlier"
    path.write_text(page_of(about, table, list(sections.values())), encoding="utf-8")


def row(cells: list[str]) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |\n"


def of_page(text: str, columns: tuple[str, ...]) -> tuple[dict[str, str], dict[str, str]]:
    """A page's rows and sections by scene; none if it has other columns."""
    if row(["scene", *columns]) not in text:
        return {}, {}
    rows: dict[str, str] = {}
    for line, name in re.findall(r"^(\| (\S+) \d+° \|.*\n)", text, re.M):
        rows[name] = rows.get(name, "") + line
    sections = re.findall(r"^(## (\S+)\n\n.+\n\n!\[.*\)\n)", text, re.M)
    return rows, {name: part for part, name in sections if name in rows}


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


def section(
    folder: Path, truth: np.ndarray, made: dict[str, np.ndarray], errors_of: tuple[str, str]
) -> str:
    """Pictures of a scene at the last shutter, and the errors of two results."""
    shown = [metrics.display(p[..., :3]) for p in (truth, made[SHOWN])]
    errors = [metrics.flip_colors(made[k], truth) for k in errors_of]
    strip = np.vstack([np.hstack(shown), np.hstack(errors)])
    levels = (255 * np.clip(strip, 0, 1) + 0.5).astype(np.uint8)
    path = DOCS / "images" / "blender" / f"{folder.name}.jpg"
    Image.fromarray(levels).save(path, quality=82, optimize=True)
    about = json.loads((folder / "camera.json").read_text())["doc"]
    return (
        f"## {folder.name}\n\n{about}\n\n![truth, gather, errors](../images/blender/{path.name})\n"
    )


def page(about: str, table: str, sections: list[str]) -> str:
    """The text of docs/laboratory/blender-scores.md."""
    return (
        "# Against a path tracer's own motion blur\n\n"
        "Cycles renders the scenes, sharp and with its own motion blur, which is the truth; wgmb "
        "and Blender's compositor blur the sharp frames. Each cell shows FLIP (lower is better) / "
        "PSNR on the display in dB (higher is better), for 640 x 360 pixels and box shutters "
        "centred on the frame.[^made] "
        f"`{PEER}` is the node of Blender's compositor with 64 samples. `{NOISE}` compares one "
        "half of the truth's samples with the other; it is twice the truth's own error.\n\n"
        + table
        + "\n## The remaining error of gather\n\n"
        "* Shadows and shading that move over a surface, which no vector describes (runner, "
        "propeller, the shadow of cesium_man); clear ones on what rests are followed "
        "(c_crossing).\n"
        "* Surfaces that all three frames hide: they are filled smoothly, without texture "
        "(c_crossing).\n"
        "* A silhouette that turns under its own outline (milk_truck's tyres at their arches).\n"
        "* Paths that bend more than five positions can describe (the far cloth of flag turns by "
        "75° per frame).\n"
        "\n## Make your own\n\n"
        "```sh\npython tools/blender/blender_scenes.py FOLDER\n"
        "python tools/blender/blender_scenes.py FOLDER FILE.glb\n"
        "python tools/blender/blender_scores.py FOLDER/*\n```\n\n"
        "The first two render the scenes above, and a scene of an animated glTF file. They need a "
        "separate environment (Python 3.11, `pip install bpy==4.5.15 OpenEXR`). The third "
        "writes this page.\n\n"
        "The glTF models are Cesium Man and Cesium Milk Truck, (c) Cesium, from CesiumJS 1.10 "
        "(Apache 2.0; also among Khronos's glTF sample assets, CC-BY 4.0 with trademark "
        "limitations). Their files of glTF 0.9 were converted to 2.0 by gltf-pipeline, and the "
        "animations of each file's channels were joined into one. The files are not part of this "
        "project.\n\n"
        "In the pictures below, at 360°: the truth and gather with 16 samples; below them, "
        f"{metrics.FLIP_GAIN:g} times FLIP of {PEER} and of gather.\n\n"
        + "\n".join(sections)
        + f"\n[^made]: {about}.\n"
    )


HARD_NOTES = """
## Results

* `shadows`, `shadows_pan`, `reflections`: with passes of light, `gather` follows the light that
  moves over the ground. At 360° it halves the FLIP of `shadows`, and gains 7 dB. The checkered box
  in the mirror of `reflections` moves by more than its own pattern and stays too sharp.
* `slant`: no shadow moves, and the search for one costs nothing, nor does it in `car`. `glass`
  gains 0.0003 FLIP at 180° and 0.0020 at 360°; `reflections` gains 0.6 dB at 180°, FLIP is the
  same.
* `--shading frames`, without the passes, gains most of this in `shadows`, a third to a half of it
  in `beginner`, and loses in `reflections`.
* `beginner`: `gather` is ahead of all others. The passes gain 3.0 dB at 180°, 4.8 dB at 360°. What
  remains lies where a shadow touches its body.

## Where gather loses

* `grass` at 180°: `gather` is no better than `reproject`. The blades are thinner than a pixel:
  nearly every pixel is a silhouette, its one depth and one vector stand for several blades, and
  `gather` separates none of them there.
* `swarm`: small balls that overtake one another hide each other in all three frames.
* `fireworks`: the vector of a spark narrower than a pixel is filtered with the resting wall's, so
  its streak is too short, with any number of samples. Depth and vectors of transparent veils are
  those of the veil alone.
* `glass`: refractions and mirror images do not move like their surface; only reflections are
  followed.
"""


def hard_page(about: str, table: str, sections: list[str]) -> str:
    """The text of docs/laboratory/hard-scenes.md."""
    return (
        "# Hard scenes\n\n"
        "These scenes have light that moves over surfaces, or subjects on which `gather` was "
        "never tuned: grass, glass, a swarm, a car, glowing light, and the first scene that "
        "everybody makes. Cycles rendered them, sharp and with its own motion blur, 320 x 180 "
        "pixels, few samples (sharp frames 128, `slant` 24, from `grass` on 64; truths 320, "
        "`grass` 256, from `glass` on 192); scored as on [the page of the other "
        "scenes](blender-scores.md): FLIP / PSNR on the display in dB, "
        "box shutters centred on the frame.[^made] "
        f"`{PEER}` is the node of Blender's compositor with 64 samples, `tiles` the filter of "
        f"Guertin et al. `{SHOWN}` uses the passes of light of all scenes. `{NOISE}` compares one "
        "half of the truth's samples with the other; it is twice the truth's own error.\n\n"
        + table
        + HARD_NOTES
        + "\n## Make your own\n\n"
        "```sh\n"
        "python tools/blender/blender_scenes.py FOLDER shadows shadows_pan reflections slant\n"
        "python tools/blender/blender_scenes.py FOLDER grass glass swarm car fireworks beginner\n"
        "python tools/blender/blender_scores.py --hard FOLDER/*\n```\n\n"
        "In the pictures below, at 360°: the truth and gather with 16 samples; below them, "
        f"{metrics.FLIP_GAIN:g} times FLIP of gather with `--shading off` and of gather.\n\n"
        + "\n".join(sections)
        + f"\n[^made]: {about}.\n"
    )


if __name__ == "__main__":
    named = [text for text in sys.argv[1:] if text != "--hard"]
    main([Path(text).resolve() for text in named], "--hard" in sys.argv)
