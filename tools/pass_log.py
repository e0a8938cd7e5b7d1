"""Print every pass that some runs record, for the proof that a change of Python changes no pass.

python tools/pass_log.py FOLDER [RUN ...]    FOLDER holds the inputs, which are made once

A line each: file and entry point, constants, workgroups, and what is bound to each index of each
group: of a uniform, and of any buffer that Python filled, the checksum of its content; of others
and of textures the name and the size. "-" is what may stand for none: textures of 1 x 1, and
buffers of up to 256 bytes. Clears and copies have lines too. Two logs compare with `diff`.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import io
import shlex
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import wgpu
from wgpu.backends.wgpu_native import _api

from wgmb.gpu import Tapes

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tools"))
RUNS = {method: f"render crossing -o r.exr --time 0.5 --size 96x54 --method {method}"
        for method in ("tap", "tiles", "gather", "fusion", "reproject", "accumulate",
                       "distributed")}  # fmt: skip
RUNS |= {
    "volume": "render torusphere -o r.png --size 96x54 --method volume",
    "spiric": "render spiric -o r.png --size 96x54 --method volume",
    "five": "blur sample -o r.#.exr --frames 10 --method tap --path five --samples auto",
    "published": "render crossing -o r.exr --time 0.5 --size 96x54 --method reproject "
    "--variant published --depth-test --facing",
    "lines": "blur sample -o r.#.exr --frames 10 --method reproject --variant published "
    "--splat line",
    "depth": "blur sample -o r.#.exr --frames 9-11 --method gather",
    "confidence": "blur sample -o r.#.exr --frames 10 --method gather --confidence --reach 2",
    "shadows": "blur sample -o r.#.exr --frames 10 --method gather --shading frames",
    "edges": "blur sample -o r.#.exr --frames 10 --method gather --where edges --max-blur 12",
    "mask": "blur sample -o r.#.exr --frames 10 --method fusion --holdout ViewLayer.IndexOB=1",
    "lit": "render crossing -o lit.#.exr --sharp --passes --frames 0-2 --size 96x54",
    "passes": "blur lit.#.exr -o r.#.exr --frames 1 --method gather",
    "video": "blur clip8.mp4 -o r.mp4 --end 0.25",
    "perceived": "perceive sample -o r.#.png --fps 24 --frames 9-10",
}
SMALL = 256  # bytes
_LINES: list[str] = []


def watch(kind: type, name: str, seen: Callable[..., Any]) -> None:
    """Call `seen` with the result and the arguments of every call of a wgpu method."""
    method = getattr(kind, name)

    @wraps(method)
    def called(*args: Any, **options: Any) -> Any:
        result = method(*args, **options)
        seen(result, *args, **options)
        return result

    setattr(kind, name, called)


def checksum(data: Any) -> str:
    """A short checksum of bytes or of an array."""
    return hashlib.sha256(memoryview(data).cast("B")).hexdigest()[:12]


def watch_all() -> None:
    """Write a line for every pass, clear and copy that wgpu records from now on."""

    def made(buffer, _device, *, data, **_options):
        buffer.content = checksum(data)

    def written(_none, _queue, buffer, _offset, data, *_rest):
        buffer.content = checksum(data)

    def compiled(pipeline, _device, *, compute, label="", **_options):
        constants = {name: float(value) for name, value in compute.get("constants", {}).items()}
        pipeline.told = f"{label} {sorted(constants.items())}"

    def grouped(group, _device, *, entries, **_options):
        things = sorted(entries, key=lambda entry: entry["binding"])
        group.bound = [entry["resource"] for entry in things]

    def set_pipeline(_none, encoder, pipeline):
        encoder.pipeline_told = getattr(pipeline, "told", pipeline.label)

    def set_group(_none, encoder, index, group, *_rest):
        encoder.__dict__.setdefault("bound", {})[index] = group

    def dispatched(_none, encoder, *counts):
        where = [named(n) if isinstance(n, wgpu.GPUBuffer) else str(n) for n in counts]
        groups = encoder.__dict__.get("bound", {})
        bound = [f"[{' '.join(map(named, groups[i].bound))}]" for i in sorted(groups)]
        _LINES.append(f"{encoder.pipeline_told} ({', '.join(where)}) {' '.join(bound)}")

    def cleared(_none, _encoder, buffer, *span):
        _LINES.append(f"clear {named(buffer)} {span}")

    def copied(_none, _encoder, source, to, size):
        both = (f"{one['texture'].label}{one.get('origin', '')}" for one in (source, to))
        _LINES.append(f"copy {' to '.join(both)} {tuple(size)}")

    def recorded(_tapes, encoder, _bindings, _key, _views, record):
        record(encoder)  # as it would be without a tape, which calls no method of wgpu
        return encoder

    Tapes.play = recorded
    watch(wgpu.GPUDevice, "create_buffer_with_data", made)
    watch(_api.GPUQueue, "write_buffer", written)
    watch(_api.GPUDevice, "create_compute_pipeline", compiled)
    watch(_api.GPUDevice, "create_bind_group", grouped)
    watch(_api.GPUComputePassEncoder, "set_pipeline", set_pipeline)
    watch(_api.GPUBindingCommandsMixin, "set_bind_group", set_group)
    watch(_api.GPUComputePassEncoder, "dispatch_workgroups", dispatched)
    watch(_api.GPUComputePassEncoder, "dispatch_workgroups_indirect", dispatched)
    watch(_api.GPUCommandEncoder, "clear_buffer", cleared)
    watch(_api.GPUCommandEncoder, "copy_texture_to_texture", copied)


def named(resource: Any) -> str:
    """A resource as a word of a line."""
    if isinstance(resource, wgpu.GPUSampler):
        return "sampler"
    if isinstance(resource, dict | wgpu.GPUBuffer):
        part = resource if isinstance(resource, dict) else {"buffer": resource, "offset": 0}
        buffer, size = part["buffer"], part.get("size", part["buffer"].size)
        if content := getattr(buffer, "content", ""):
            return content
        return "-" if buffer.size <= SMALL else f"{buffer.label}:{part['offset']}+{size}"
    texture = resource.texture
    if texture.size == (1, 1, 1):
        return "-"
    return f"{texture.label}:{texture.format}:{'x'.join(map(str, resource.size))}".replace(" ", "_")


def main() -> int:
    """See the top of this file."""
    import same_results

    from wgmb.cli import app

    folder = Path(sys.argv[1]).resolve()
    if not folder.exists():
        same_results.make_inputs(folder)
    watch_all()
    importlib.import_module(
        "wgmb.render"
    )._BUSY = 1e9  # samples in portions that do not depend on the time
    with contextlib.chdir(folder):
        for name in sys.argv[2:] or [*RUNS, "viewer"]:
            _LINES.clear()
            words = [same_results.SAMPLE if word == "sample" else word
                     for word in shlex.split(RUNS.get(name, ""))]  # fmt: skip
            text = io.StringIO()
            with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
                code = app.main([*words, "--overwrite"]) if words else viewed()
            sys.stdout.write(f"== {name}: exit {code}, {len(_LINES)} lines\n")
            sys.stdout.writelines(f"{line}\n" for line in _LINES)
            if code:
                sys.stderr.write(text.getvalue())
    return 0


def viewed() -> int:
    """Draw a scene in the viewer, and wait for its final image."""
    from wgmb.viewer import State, offscreen
    from wgmb.viewer.window import frame

    settings = {"method": "gather", "antialias": 1, "samples": 4}
    viewer = offscreen(State().with_settings(**settings), (160, 90), 1.0, clock=lambda: 100.0)
    for _ in range(40):
        frame(viewer)
    return 0


if __name__ == "__main__":
    sys.exit(main())
