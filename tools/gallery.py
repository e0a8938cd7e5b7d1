"""Make the gallery: python tools/gallery.py. Every picture and figure comes from the program.

Every method draws every scene; the page shows its picture of the first, its error map, and
the place of all scenes where it is worst, beside the truth.

python tools/gallery.py REPORT.json... instead puts tables of `wgmb compare --experiment` into
experiments.md, between <!-- TITLE OF THE TABLE --> and <!-- -->.
"""

import inspect
import json
import re
import sys
from pathlib import Path

import numpy as np
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
from wgmb.metrics import (
    FLIP_GAIN,
    METRICS,
    display,
    flip_colors,
)
from wgmb.settings import ShutterSettings

DOCS = Path(__file__).parent.parent / "docs"
SCENES = {"crossing:speed=3": 0.0, "fence:speed=6": 0.0, "wheel": 0.0, "torusphere": 16.0}
"""At these seconds."""
SIZE, DETAIL = (480, 270), (120, 68)  # [px], of pictures, of the worst place
REFERENCE, SAMPLES, RAYS = "distributed:512", 16, 4


def main() -> None:
    """Render, judge and write gallery.md with its pictures."""
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
    (DOCS / "laboratory" / "gallery.md").write_text(_page(found), encoding="utf-8")


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


def _page(found: Report) -> str:
    about = ", ".join(f"{k} {v}" for k, v in found.machine.items())
    sections = [_section(found, name) for name in METHODS]
    return (
        "# The methods, side by side\n\n"
        f"FLIP (lower is better) of every method on four built-in scenes of {SIZE[0]} x {SIZE[1]} "
        f"with {SAMPLES} samples. The truth is {REFERENCE.replace(':', ' with ')} rays per pixel. "
        "Times are those of the blur alone, on a CPU.[^made] `wgmb compare` makes such a page for "
        "your frames.\n\n" + _table(found) + "\nEach picture has four parts. Top: the method's "
        f"picture of the first scene, and its error ({FLIP_GAIN:g} times FLIP; black is no error). "
        "Bottom: the place of all scenes where the method is worst, and the truth there.\n\n"
        + "\n".join(sections)
        + f"\n[^made]: Made by `{found.command}`: {about}.\n"
    )


def _table(found: Report) -> str:
    """FLIP by method and scene, and the time of the first scene."""
    head = ["method", *(c.name for c in found.cases), "PSNR [dB], first", "ms", "times `tap`"]
    lines = [head, ["---"] * len(head)]
    for label in ("sharp", *METHODS):
        row, first = [f"`{label}`"], None
        for case in found.cases:
            entries = [e for e in found.of(case.name, label=label) if case.scene_frame.scene.bodies
                       or e.kind != "sharp"]  # fmt: skip
            row.append(f"{entries[0].measures['flip']:.4f}" if entries else "")
            first = first or next(iter(entries), None)
        row += [f"{first.measures['psnr']:.1f}", _time(first), _times_tap(found, first)]
        lines.append(row)
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _time(entry: Entry) -> str:
    return f"{1e3 * (entry.seconds - entry.frame_seconds):.1f}" if entry.seconds else ""


def _times_tap(found: Report, entry: Entry) -> str:
    """Time as a multiple of that of `tap` for the same scene."""
    tap = found.of(entry.case, label="tap", kind="samples")
    if not tap or not entry.seconds:
        return ""
    ratio = (entry.seconds - entry.frame_seconds) / (tap[0].seconds - tap[0].frame_seconds)
    return f"{ratio:.1f}"


def _section(found: Report, name: str) -> str:
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
    first, strong, artefacts = _words(METHODS[name])
    figures = ", ".join(
        f"{m.title} {entries[0].measures[k]:.{m.digits}f}" for k, m in METRICS.items()
    )
    return (
        f"## {name}\n\n{first}\n\n- Strong: {strong}\n- Artefacts: {artefacts}\n"
        f"- {entries[0].case}: {figures}\n\n"
        f"![{name}: picture, error, worst place ({entries[worst].case}), truth there]"
        f"(../images/gallery/{name}.jpg)\n"
    )


def _words(method: type) -> tuple[str, str, str]:
    """The first line of a method's docstring, and what it says of strength and artefacts."""
    text = " ".join(inspect.cleandoc(method.__doc__ or "").split())
    strong = re.search(r"Strong: (.*?)(?= Artefacts:|$)", text)
    artefacts = re.search(r"Artefacts: (.*)$", text)
    assert strong and artefacts, f"{method.__name__} does not say its strength and artefacts"
    return inspect.cleandoc(method.__doc__ or "").splitlines()[0], strong[1], artefacts[1]


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
