"""Score the methods on Blender's scenes.

    python tools/blender/blender_scores.py [--hard] FOLDER/SCENE ...

Folders as blender_scenes.py makes them. Writes a part of docs/laboratory/scores.md: Blender scenes,
or with --hard (scenes of light_scenes.py and hard_scenes.py) hard scenes, and a picture per
scene. Scenes of the page that are not named keep their rows and pictures.
"""

import json
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.append(str(Path(__file__).resolve().parents[1]))

import scores_page

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
    blurs = {f"{method} {n}": Blur(method, samples=n, device=device) for method, n in METHODS}
    for column, shading in ((STILL, "off"), (FRAMES, "frames")):
        blurs[column] = Blur("gather", samples=16, device=device, shading=shading)
    blurs = {column: blurs[column] for column in columns if column in blurs}
    name, text_of = ("hard scenes", hard_part) if is_hard else ("Blender scenes", part)
    rows, sections = of_page(scores_page.part(name), columns)
    (DOCS / "images" / "blender").mkdir(exist_ok=True)
    for folder in folders:
        frame, lines = frame_of(folder), []
        for text, degrees in SHUTTERS.items():
            truth = picture(folder / f"truth_{text}.exr")
            made = {SHARP: frame.color, PEER: picture(folder / f"blender_vecblur_{text}.exr")}
            for column, blur in blurs.items():
                blur.shutter = degrees
                made[column] = blur(frame)
            pairs = {column: (got, truth) for column, got in made.items()}
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
    kept = [scene for scene in rows if scene not in {folder.name for folder in folders}]
    if kept:
        about += f"; {', '.join(kept)}: earlier"
    scores_page.write(name, text_of(about, table, list(sections.values())))


def row(cells: list[str]) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |\n"


def of_page(text: str, columns: tuple[str, ...]) -> tuple[dict[str, str], dict[str, str]]:
    """The rows and sections of a part by scene; none if it has other columns."""
    if row(["scene", *columns]) not in text:
        return {}, {}
    rows: dict[str, str] = {}
    for line, name in re.findall(r"^(\| (\S+) \d+° \|.*\n)", text, re.M):
        rows[name] = rows.get(name, "") + line
    sections = re.findall(r"^(### (\S+)\n\n.+\n\n!\[.*\)\n)", text, re.M)
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
        f"### {folder.name}\n\n{about}\n\n![truth, gather, errors](../images/blender/{path.name})\n"
    )


def part(about: str, table: str, sections: list[str]) -> str:
    """The text on Blender scenes."""
    return (
        "Cycles renders the scenes, sharp and with its own motion blur, which is the truth; wgmb "
        "and Blender's compositor blur the sharp frames. 640 x 360 pixels. "
        f"`{PEER}` is the node of Blender's compositor with 64 samples. `{NOISE}` compares one "
        "half of the truth's samples with the other; it is twice the truth's own error.\n\n"
        + table
        + f"\nMade with {about}.\n\n"
        "In the pictures, at 360°: the truth and `gather` with 16 samples; below them, "
        f"{metrics.FLIP_GAIN:g} times FLIP of {PEER} and of `gather`.\n\n" + "\n".join(sections)
    )


def hard_part(about: str, table: str, sections: list[str]) -> str:
    """The text on hard scenes."""
    return (
        "These scenes have light that moves over surfaces, or subjects on which `gather` was "
        "never tuned: grass, glass, a swarm, a car, glowing light, and the first scene that "
        "everybody makes. Cycles rendered them, sharp and with its own motion blur: 320 x 180 "
        "pixels, few samples (sharp frames 128, `slant` 24, from `grass` on 64; truths 320, "
        "`grass` 256, from `glass` on 192). "
        f"`tiles` is the filter of Guertin et al., and `{SHOWN}` uses the passes of light.\n\n"
        + table
        + f"\nMade with {about}.\n\n"
        "In the pictures, at 360°: the truth and `gather` with 16 samples; below them, "
        f"{metrics.FLIP_GAIN:g} times FLIP of `gather` with `--shading off` and of `gather`.\n\n"
        + "\n".join(sections)
    )


if __name__ == "__main__":
    named = [text for text in sys.argv[1:] if text != "--hard"]
    main([Path(text).resolve() for text in named], "--hard" in sys.argv)
