"""Compare all methods: python tools/gallery.py. Every picture and figure comes from the program.

Every method draws every scene. The table is a part of docs/laboratory/scores.md; the picture on the
page of a method shows the first scene, its error map, and the place of all scenes where it is
worst, beside the truth.

python tools/gallery.py REPORT.json... instead puts tables of `wgmb compare --experiment` into
experiments.md, between <!-- TITLE OF THE TABLE --> and <!-- -->.
"""

import json
import re
import sys
from pathlib import Path

import numpy as np
import scores_page
from PIL import Image

from wgmb import METHODS, gpu
from wgmb.lab.cases import (
    Candidate,
    SceneFrame,
    make_scene,
    scene_case,
)
from wgmb.lab.compare import Laboratory
from wgmb.lab.results import Entry, Report, machine
from wgmb.metrics import display, flip_colors
from wgmb.settings import ShutterSettings

DOCS = Path(__file__).parent.parent / "docs"
SCENES = {"crossing:speed=3": 0.0, "fence:speed=6": 0.0, "wheel": 0.0, "torusphere": 16.0}
"""At these seconds."""
SIZE, DETAIL = (480, 270), (120, 68)  # [px], of pictures, of the worst place
REFERENCE, SAMPLES, RAYS = "distributed:512", 16, 4


def main() -> None:
    """Render, judge, and write the table and the pictures."""
    device = gpu.open_device()
    lab = Laboratory(device, tell=lambda text: print(text, file=sys.stderr))
    found = Report("Gallery", "python tools/gallery.py", machine(device), SAMPLES)
    candidates = [Candidate(name) for name in METHODS]
    for text, time in SCENES.items():
        name, scene = make_scene(text)
        exposure, scene_frame = (
            ShutterSettings().resolved(scene).make(),
            SceneFrame(scene, time, SIZE, antialias=RAYS),
        )
        case = scene_case(name, exposure, Candidate.parse(REFERENCE), scene_frame, device, lab.tell)
        # Image methods have nothing to start from where there are volumes alone.
        able = candidates if scene.bodies else [c for c in candidates if c.needs_scene]
        lab.compare(found, case, able, (SAMPLES,), budgets=lambda *_: [])
    (DOCS / "images" / "gallery").mkdir(parents=True, exist_ok=True)
    for name in METHODS:
        _draw(found, name)
    scores_page.write("side by side", _text(found))


def fill(text: str, reports: list[dict]) -> str:
    """The text with the tables of the reports at the places that bear their titles."""
    tables = {table["title"]: table for report in reports for table in report["tables"]}

    def filled(place: re.Match) -> str:
        if (table := tables.get(place[1])) is None:
            return place[0]
        lines = [table["columns"], ["---"] * len(table["columns"]), *table["rows"]]
        cells = [["-" if cell is None else str(cell) for cell in line] for line in lines]
        drawn = "".join(f"| {' | '.join(line)} |\n" for line in cells)
        return f"<!-- {place[1]} -->\n{drawn}<!-- -->"

    return re.sub(r"<!-- (.+?) -->\n(?:\|.*\n)*<!-- -->", filled, text)


def _text(found: Report) -> str:
    about = ", ".join(f"{k} {v}" for k, v in found.machine.items())
    return (
        f"FLIP of every method on four built-in scenes of {SIZE[0]} x {SIZE[1]} with {SAMPLES} "
        f"samples. The truth is {REFERENCE.replace(':', ' with ')} rays per pixel. Times are "
        "of the blur alone, on a CPU. The page of each method shows its error and its worst "
        "place.\n\n" + _table(found) + f"\nMade with {about}.\n"
    )


def _table(found: Report) -> str:
    """FLIP by method and scene, and the time of the first scene."""
    head = ["method", *(c.name for c in found.cases), "PSNR [dB], first", "ms", "times `tap`"]
    lines = [head]
    for label in ("sharp", *METHODS):
        row, first = [f"`{label}`"], None
        for case in found.cases:
            entries = [e for e in found.of(case.name, label=label) if case.scene_frame.scene.bodies
                       or e.kind != "sharp"]  # fmt: skip
            row.append(f"{entries[0].measures['flip']:.4f}" if entries else "")
            first = first or next(iter(entries), None)
        row += [f"{first.measures['psnr']:.1f}", _time(first), _times_tap(found, first)]
        lines.append(row)
    return scores_page.table(lines)


def _time(entry: Entry) -> str:
    return f"{1e3 * (entry.seconds - entry.frame_seconds):.1f}" if entry.seconds else ""


def _times_tap(found: Report, entry: Entry) -> str:
    """Time as a multiple of that of `tap` for the same scene."""
    tap = found.of(entry.case, label="tap", kind="samples")
    if not tap or not entry.seconds:
        return ""
    ratio = (entry.seconds - entry.frame_seconds) / (tap[0].seconds - tap[0].frame_seconds)
    return f"{ratio:.1f}"


def _draw(found: Report, name: str) -> None:
    """Write the picture of a method."""
    entries = [e for e in found.entries if e.label == name]
    cases = {c.name: c for c in found.cases}
    picture = DOCS / "images" / "gallery" / f"{name}.jpg"
    errors = [flip_colors(e.picture, cases[e.case].truth) for e in entries]
    worst, corner = max(
        ((i, *_worst(error)) for i, error in enumerate(errors)), key=lambda place: place[1]
    )[::2]
    shown = [display(entries[0].picture), errors[0]]
    shown += [_detail(display(p), corner)
              for p in (entries[worst].picture, cases[entries[worst].case].truth)]  # fmt: skip
    strip = np.vstack([np.hstack(shown[:2]), np.hstack(shown[2:])])
    levels = (255 * np.clip(strip, 0, 1) + 0.5).astype(np.uint8)
    Image.fromarray(levels).save(picture, quality=82, optimize=True)


def _worst(error: np.ndarray) -> tuple[float, tuple[int, int]]:
    """The mean error of the worst window of DETAIL, and its upper left corner (x, y)."""
    width, height = DETAIL
    sums = np.pad(error.mean(axis=2), ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    window = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width]
    window += sums[:-height, :-width]
    y, x = np.unravel_index(np.argmax(window), window.shape)
    return float(window[y, x]) / (width * height), (int(x), int(y))


def _detail(shown: np.ndarray, corner: tuple[int, int]) -> np.ndarray:
    """The window enlarged to a whole picture's size, pixels as squares."""
    (x, y), (width, height) = corner, DETAIL
    levels = (255 * np.clip(shown[y : y + height, x : x + width], 0, 1) + 0.5).astype(np.uint8)
    return np.asarray(Image.fromarray(levels).resize(SIZE, Image.Resampling.NEAREST)) / 255


if __name__ == "__main__":
    if reports := [json.loads(Path(name).read_text("utf-8")) for name in sys.argv[1:]]:
        page = DOCS / "laboratory" / "experiments.md"
        page.write_text(fill(page.read_text("utf-8"), reports), encoding="utf-8")
    else:
        main()
