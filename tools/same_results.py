"""Record what fixed inputs give, and compare it after a change that must change nothing.

python tools/same_results.py record FOLDER    run every command; files, messages and exit codes
python tools/same_results.py record FOLDER mp4      the same of commands with a word, beside others
python tools/same_results.py compare FOLDER   the same again; exit code 1 and a list if any differ
python tools/same_results.py compare FOLDER "blur clip8" perceive   only commands with these words

The folder holds the inputs, which are made once, and record.json. Times and speeds in messages, and
the name of the folder, are left out.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
SAMPLE = "sample/crossing.####.exr"
METHODS = {
    "tap": ["", "--path five", "--path straight", "--variant published", "--jitter 1 --samples 4"],
    "tiles": ["", "--show tiles", "--variant published"],
    "gather": ["", "--reach 2", "--shading off", "--shading frames", "--show confidence"],
    "fusion": ["", "--weights published", "--tau 0.5 --alpha-front 0.5", "--variant published"],
    "reproject": ["", "--variant published --facing --depth-test", "--show count",
                  "--variant published --splat line"],
    "accumulate": [""], "nonsense": [""],
}  # fmt: skip
SHUTTERS = ["--shutter 360 --curve triangle", "--phase start --rolling down", "--max-blur 6"]
SHOTS = [
    "blur sample -o o.#.png --bits 16 -v", "blur sample -o o.mp4 --fps 2", "blur sample -o o.gif",
    "blur sample -o o.#.exr --layers picture --compression piz --window keep",
    "blur sample -o o.#.exr --confidence", "blur sample -o o.#.exr --resume",
    "blur sample -o o.#.exr --frames 10 --holdout Nothing", "blur sample -o o.#.exr --frames 1-3",
    "blur sample -o o.#.png --ocio builtin", "blur sample -o o.#.exr --fps-in 24 --fps 12",
    "blur sample -o o.#.exr --vectors none --flow dis", "blur sample -o o.#.exr --cuts only:10",
    "blur stereo/s.####.exr -o o.#.exr", "blur stereo/s.####.exr -o %V.#.exr --view left",
    "blur cropped/c.####.exr -o o.#.exr", "blur cropped/c.####.exr -o o.#.png --outside edge",
    "blur plain/p.####.png -o o.#.png", "blur missing.####.exr -o o.#.exr", "blur sample",
    "vectors sample -o v.#.exr --as nuke", "vectors plain/p.####.png -o v.#.exr --as blender",
    "info sample", "info stereo/s.####.exr", "info cropped/c.####.exr -o m.png", "info clip8.mp4",
    "info clip10.mkv", "perceive sample -o o.#.png --fps 24", "perceive clip8.mp4 -o o.mp4",
    "perceive crossing -o o.#.png --frames 0-2 --size 64x36", "perceive --help",
]  # fmt: skip
VIDEOS = [
    "blur clip8.mp4 -o o.mp4 --shutter 180 --fps 12", "blur clip8.mp4 -o o.mkv --flow search",
    "blur clip10.mkv -o o.mkv --codec ffv1", "blur clip10.mkv -o o.mp4 --codec h265 --speed 0.5",
    "blur clip8.mp4 -o o.webm --flow none --fps 6", "blur clip8.mp4 -o o.#.png --method gather",
    "blur clip8.mp4 -o o.#.exr --begin 0.1 --end 0.4", "blur clip8.mp4 -o o.gif --fps 5",
    "blur clip8.mp4 -o o.mov --codec prores --highlights 4 --cuts 6", "blur clip8.mp4 -o x/o.txt",
    "blur clip8.mp4 clip10.mkv -o out/ --fps 30", "blur clip8.mp4 -o o.mp4 --resume",
    "blur clip8.mp4 -o o.mkv --holdout static",
    "blur clip8.mp4 -o o.mp4 --cuts none --pitch follow",
]  # fmt: skip
SCENES = [
    "render crossing -o r.#.exr --frames 3-5 --size 96x54 --passes",
    "render crossing -o r.png --size 96x54 --time 0.5 --method distributed --samples 8",
    "render torusphere -o r.png --size 96x54 --method volume", "render wheel -o r.mp4 --frames 0-3 "
    "--size 96x54 --method reproject", "render fence -o r.exr --size 96x54 --method gather -v",
    "render crossing -o r.png --sharp --size 96x54 --set speed=3", "render nothing -o r.png",
    "render crossing -o r.#.exr --frames 0-2 --size 64x36 --resume",
    "shutter --curve cosine -o s.svg",
    "job sample -o j.#.exr --job j.json --shutter 270", "blur --job j.json --frames 9",
    "blur --job j.json --frames 10", "blur --job j.json --frames 11", "--help",
    "job clip8.mp4 -o k.mp4 --job k.json", "job plain/p.####.png -o l.#.exr --job l.json",
    "blur --job l.json", "blur sample -o saved.#.exr --config saved.toml -v", "blur --help",
    "compare crossing --methods tap,gather --size 64x36 --samples 4 -o report",
]  # fmt: skip
REPEATED = "--resume"
VARYING = [
    (r"\d+(\.\d+)? ?(s|ms|fps|GB/s|frames/s|MB)\b", "#"), (r"\b\d+:\d\d(:\d\d)?\b", "#"),
    (r"-?\d+(\.\d+)?e-\d+", "#"),
]  # fmt: skip


def commands() -> list[str]:
    """Every command; sample stands for the pattern of the sample's frames."""
    every = [f"blur sample -o m.#.exr --method {method} {more}".strip()
             for method, options in METHODS.items() for more in options]  # fmt: skip
    every += [f"blur sample -o m.#.exr {more}" for more in SHUTTERS]
    return every + SHOTS + VIDEOS + SCENES


def make_inputs(folder: Path) -> None:
    """Stereo, cropped and plain frames, and two videos with sound."""
    sys.path.insert(0, str(ROOT / "tests" / "made"))
    import imageio.v3 as iio
    import numpy as np

    import make_clips
    import make_frames as make
    import make_stereo

    shutil.copytree(ROOT / "sample", folder / "sample", ignore=shutil.ignore_patterns("*[!r]"))
    for name in ("stereo", "cropped", "plain"):
        (folder / name).mkdir(parents=True)
    for n in range(1, 4):
        make.write_parts(folder / "stereo" / f"s.{n:04d}.exr", make_stereo.single_part(n))
        box = (8, 6, 8 + make.WIDTH - 1, 6 + make.HEIGHT - 1)
        make.write_exr(folder / "cropped" / f"c.{n:04d}.exr", make.frame(n), data=box,
                       display=(0, 0, 95, 71))  # fmt: skip
        coded = (make.picture(n)[..., :3] ** (1 / 2.2) * 255).astype(np.uint8)
        iio.imwrite(folder / "plain" / f"p.{n:04d}.png", coded)

    def pictures(bits: int, count: int = 12):
        kind, scale = (np.uint8, 1) if bits == 8 else (np.uint16, 4)
        for n in range(count):
            luma = np.kron(make.picture(n)[..., 1], np.ones((2, 2))) * 200 * scale
            grey = np.full((luma.shape[0] // 2, luma.shape[1] // 2), 128 * scale)
            yield make_clips.frame(
                [plane.astype(kind) for plane in (luma, grey, grey)],
                "yuv420p" if bits == 8 else "yuv420p10le",
            )

    make_clips.write(folder / "clip8.mp4", pictures(8), tone=0.5)
    make_clips.write(folder / "clip10.mkv", pictures(10), pixels="yuv420p10le", codec="ffv1")
    (folder / "saved.toml").write_text(
        '[blur]\nmethod = "tap"\nsamples = 8\nshutter = 270.0\ncurve = "triangle"\n'
    )


def run(line: str, folder: Path) -> dict:
    """The results of a command: its exit code, messages, and each file that it made or changed."""
    from wgmb.cli import app

    before = _files(folder)
    words = [SAMPLE if word == "sample" else word for word in shlex.split(line)]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = app.main(words)
        except SystemExit as error:
            code = error.code
    after = _files(folder)
    return {
        "code": code,
        "out": _still(out.getvalue(), folder),
        "err": _still(err.getvalue(), folder),
        "files": {name: after[name] for name in after if before.get(name) != after[name]},
    }


def _files(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(_content(path)).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix not in (".html", ".csv", ".svg")  # which hold times
        and path.name not in ("report.json", "record.json")
    }  # fmt: skip


def _content(path: Path) -> bytes:
    """Its bytes; of a Matroska file, which has random numbers in it, what FFmpeg reads.

    A checksum over those numbers is left out too.
    """
    if path.suffix not in (".mkv", ".webm"):
        return path.read_bytes()
    import av

    with av.open(str(path)) as file:
        tags = [file.metadata, *(stream.metadata for stream in file.streams)]
        packets = [(p.stream_index, p.pts, p.duration, bytes(p)) for p in file.demux()]
    return re.sub(r'"seal": "[^"]*"', "", repr((tags, packets))).encode()


def _still(text: str, folder: Path) -> str:
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    for pattern, mark in VARYING:
        text = re.sub(pattern, mark, text)
    return text


def record(folder: Path, words: list[str]) -> dict[str, dict]:
    """Run all commands in copies of the inputs, several in one folder where they follow.

    `words`: only commands that hold one of them; all if there are none.
    """
    os.environ["COLUMNS"] = "100"
    if not (folder / "inputs").exists():
        make_inputs(folder / "inputs")
    work = folder / "work"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(folder / "inputs", work)
    results = {}
    every = [line for line in commands() if not words or any(word in line for word in words)]
    for number, line in enumerate(every):
        sys.stderr.write(f"{number + 1}/{len(every)} {line}\n")
        if not line.startswith("blur --job"):
            for path in _made(work, folder / "inputs"):
                path.unlink()
        results[line] = run(line, work)
        if REPEATED in line:
            results[f"{line} (again)"] = run(line, work)
    return results


def _made(work: Path, inputs: Path) -> list[Path]:
    return [
        path for path in work.rglob("*")
        if path.is_file() and not (inputs / path.relative_to(work)).exists()
    ]  # fmt: skip


def main() -> int:
    """See the top of this file."""
    what, folder = sys.argv[1], Path(sys.argv[2]).resolve()
    kept = folder / "record.json"
    found = record(folder, sys.argv[3:])
    known = json.loads(kept.read_text("utf-8")) if kept.exists() else {}
    if what == "record":
        kept.write_text(json.dumps(known | found, indent=1), "utf-8")
        return 0
    faults = 0
    for line in found.keys() | (set() if sys.argv[3:] else known.keys()):
        for part in ("code", "out", "err", "files"):
            was, now = (one.get(line, {}).get(part) for one in (known, found))
            if was != now:
                faults += 1
                sys.stdout.write(f"{line}: {part}\n  before: {was}\n  now:    {now}\n")
    sys.stdout.write(f"{len(found)} commands, {faults} differences\n")
    return faults > 0


if __name__ == "__main__":
    sys.exit(main())
