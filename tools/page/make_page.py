"""Make the page for browsers: one file that draws live, without a request to any network.

    python tools/page/make_page.py [--media] [OUTPUT]

The parts are in docs/page/; shaders, constants and recorded passes come from Python. The same
parts give the same bytes. OUTPUT is build/page/page.html by default, from where `./run docs` takes
it; it is not kept in git. `--media` first renders docs/page/media/ anew: the video and the images
that the page shows where there is no WebGPU. Those are committed.
"""

from __future__ import annotations

import argparse
import base64
import gzip
import json
import re
import sys
from pathlib import Path
from typing import Any

import page_export
import page_recording

ROOT = Path(__file__).parents[2]
PARTS = ROOT / "docs" / "page"
MEDIA = PARTS / "media"
OUTPUT = ROOT / "build" / "page" / "page.html"
MAIN = "main.js"
MOST = 2_000_000
"""Bytes of the page, at most."""

BEGIN, SECONDS, FADE, FPS = 17.0, 9, 1.0, 24
"""Of the video: where it begins, how long it is, and how long its end fades into its beginning."""
CAMERA = {"cam_x": 0.3, "cam_y": -0.2}
UNPACKED = """export async function unpacked(name) {
  const bytes = Uint8Array.from(atob(PACKED[name]), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return JSON.parse(await new Response(stream).text());
}
"""


def page() -> str:
    """The text of the page."""
    media = {path.stem: data_url(path) for path in sorted(MEDIA.iterdir())}
    recordings = page_recording.recordings()
    shaders = sorted({*page_export.page_files(), *_replayed(recordings)})
    packed = {"exported": pack(page_export.exported(*shaders)), "recordings": pack(recordings)}
    made = {
        "packed.js": (
            f"const PACKED = {json.dumps(packed)};\n"
            f"export const MEDIA = {json.dumps({'video': media['video']})};\n{UNPACKED}"
        )
    }
    return filled((PARTS / "page.html").read_text("utf-8"), {
        "STYLE": (PARTS / "style.css").read_text("utf-8").strip(),
        "SCRIPT": joined(MAIN, made).strip(),
        "POSTER": media["poster"],
        "BEFORE": media["before"],
        "AFTER": media["after"],
    })  # fmt: skip


def _replayed(recordings: dict[str, Any]) -> set[str]:
    """The shaders that recordings run."""
    runs = [recordings["once"], *recordings["choices"].values()]
    return {row["kernel"]["file"] for run in runs for row in run["passes"] if "kernel" in row}


def filled(text: str, places: dict[str, str]) -> str:
    """`text` with each place /*NAME*/ filled, once."""
    found = re.findall(r"/\*([A-Z]+)\*/", text)
    if sorted(found) != sorted(places):
        raise ValueError(f"the page has the places {found}, there is something for {[*places]}")
    return re.sub(r"/\*([A-Z]+)\*/", lambda m: places[m[1]], text)


def pack(value: object) -> str:
    """JSON, compressed, as text."""
    text = json.dumps(value, separators=(",", ":"), sort_keys=True, allow_nan=False)
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def data_url(path: Path) -> str:
    """A file as an address that holds it."""
    kind = {".mp4": "video/mp4", ".jpg": "image/jpeg"}[path.suffix]
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"


def joined(main: str, made: dict[str, str]) -> str:
    """ES modules as one: every module but `main` becomes a function that gives its exports.

    `made`: modules that are no files.
    """
    order: list[str] = []
    texts: dict[str, str] = {}

    def visit(name: str, asker: str) -> None:
        if name in order:
            return
        if name in texts:
            raise ValueError(f"{asker} and {name} import one another")
        text = made[name] if name in made else (PARTS / name).read_text("utf-8")
        texts[name] = text
        for needed in re.findall(r"^import .*? from '\./(.+?)';$", text, re.M | re.S):
            visit(needed, name)
        order.append(name)

    visit(main, main)
    return "\n".join(_module(name, texts[name], name == main) for name in order)


def _module(name: str, text: str, is_main: bool) -> str:
    text = re.sub(
        r"^import (\{.*?\}) from '\./(.+?)';$",
        lambda m: f"const {m[1].replace(' as ', ': ')} = {_variable(m[2])};",
        text,
        flags=re.M | re.S,
    )
    if is_main:
        return f"// ---- {name}\n{text}"
    exports = re.findall(r"^export (?:async )?(?:function|class|const) (\w+)", text, re.M)
    text = re.sub(r"^export (?=(?:async )?(?:function|class|const) \w)", "", text, flags=re.M)
    if left := re.findall(r"^(?:import|export)\b.*", text, re.M):
        raise ValueError(f"{name}: cannot join {left[0]!r}")
    return (
        f"// ---- {name}\nconst {_variable(name)} = (() => {{\n{text}"
        f"return {{ {', '.join(exports)} }};\n}})();\n"
    )


def _variable(name: str) -> str:
    return "module_" + re.sub(r"\W", "_", name.removesuffix(".js"))


def make_media() -> None:
    """Render what the page shows where there is no WebGPU."""
    import numpy as np

    from wgmb import Blur, Render, Shutter
    from wgmb.color.srgb import to_display
    from wgmb.scene import make

    MEDIA.mkdir(exist_ok=True)
    shutter = Shutter(720, curve="cosine")

    def torusphere(size: tuple[int, int], times: list[float]) -> list[np.ndarray]:
        scene = make("torusphere", **CAMERA)
        render = Render(scene, Blur("volume", shutter=shutter), size=size, fps=FPS)
        return [to_display(render(time)[..., :3].astype(np.float32), 8) for time in times]

    _write_jpg("poster", torusphere((1280, 720), [BEGIN])[0], 70)
    times = [BEGIN + n / FPS for n in range(round((SECONDS + FADE) * FPS))]
    frames, fade = [f.astype(np.float32) for f in torusphere((768, 432), times)], round(FADE * FPS)
    for n in range(fade):
        share = (n + 0.5) / fade
        frames[n] = frames[n] * share + frames[len(frames) - fade + n] * (1 - share)
    _write_video([np.round(f).astype(np.uint8) for f in frames[:-fade]])

    size, time = page_recording.SIZE, page_recording.TIME
    for name, degrees in (("before", 0), ("after", 360)):
        blur = Blur("gather", shutter=Shutter(degrees), samples=32)
        render = Render(make(page_recording.SCENE), blur, size=size, antialias=page_recording.RAYS)
        _write_jpg(name, to_display(render(time)[..., :3].astype(np.float32), 8), 85)


def _write_jpg(name: str, picture, quality: int) -> None:
    from PIL import Image

    Image.fromarray(picture).save(
        MEDIA / f"{name}.jpg", quality=quality, optimize=True, progressive=True
    )


def _write_video(frames: list) -> None:
    import av

    with av.open(str(MEDIA / "video.mp4"), "w", options={"movflags": "+faststart"}) as file:
        stream = file.add_stream("libx264", rate=FPS)
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "25", "preset": "veryslow", "threads": "1", "tune": "film"}
        for frame in frames:
            file.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        file.mux(stream.encode(None))


def main() -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--media", action="store_true", help="render docs/page/media anew, first")
    parser.add_argument("output", nargs="?", type=Path)
    options = parser.parse_args()
    if options.media:
        make_media()
    data = page().encode()
    if len(data) > MOST:
        sys.exit(f"the page has {len(data):,} bytes, {MOST:,} are allowed")
    output = options.output or OUTPUT
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(data)
    sys.stderr.write(f"{output}: {len(data):,} bytes\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
