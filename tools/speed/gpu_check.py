"""Measure a GPU in one run of at most 7 minutes: a JSON file, and tables for the performance page.

    python tools/speed/gpu_check.py reference refs.npz      small results of this adapter
    python tools/speed/gpu_check.py check FOLDER [--refs refs.npz] [--seconds 420] [--quick]

The parts come in the order of their worth, and each is in FOLDER/check.json as soon as it is done.
Parts for which no time is left are named. `--refs`: results of another adapter, such as lavapipe's,
from which those of this one differ. `--quick` tries every part with tiny pictures.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import wgpu

import wgmb
from wgmb import gpu, interpreter
from wgmb.gpu import timing
from wgmb.gpu.textures import TexturePool
from wgmb.lab.bench import bench, copy_bandwidth, synthetic_frame
from wgmb.lab.calls import counted
from wgmb.lab.cases import Candidate
from wgmb.lab.results import machine
from wgmb.lab.video_bench import time_video
from wgmb.shutter import Shutter

METHODS = "tap", "gather", "gather:shading=off", "tiles", "reproject", "fusion"
FLOWS = "auto", "none", "search:draft", "search:fast", "dis", "search"
REFERENCE = 160, 90  # px
VISIBLE = 0.004  # difference from a reference that is counted
SAMPLES, IN_A_ROW = 16, 20
Size = tuple[int, int]


def frame_of(blur: wgmb.Blur, size: Size, smooth: bool = False) -> wgmb.Frame:
    """The bench's frame and its neighbours; `smooth`: the filters of all adapters agree on it."""
    base = synthetic_frame(*size)
    if smooth:
        y, x = np.mgrid[: size[1], : size[0]].astype(np.float32)
        waves = np.stack([np.sin(x / 7), np.sin(y / 5), np.sin((x + y) / 11), np.ones_like(x)], 2)
        base = replace(base, color=(0.5 + 0.5 * waves).astype(np.float32))
    if "neighbours" not in blur.method.uses:
        return base
    return base.between(replace(base, number=-1), replace(base, number=1))


def small_results(device: wgpu.GPUDevice) -> dict[str, np.ndarray]:
    """Small results of every method."""
    results = {}
    for method in METHODS:
        blur = Candidate.parse(method).blur(SAMPLES, Shutter(180), device)
        for kind in ("smooth", "noise"):
            results[f"{method}, {kind}"] = blur(frame_of(blur, REFERENCE, kind == "smooth"))
    return results


def of_device(device: wgpu.GPUDevice) -> dict[str, Any]:
    """The adapter, the versions, the commit, and the clock of the passes."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
    )
    return {
        **machine(device),
        "commit": commit.stdout.strip() or "not known",
        "clock": timing.clock(device).name,
        "features": sorted(device.adapter.features),
        "copy GB/s": copy_bandwidth(device),
    }


def of_waits(device: wgpu.GPUDevice, rounds: int) -> dict[str, float]:
    """Wall milliseconds of an empty submission, and of one whose end is waited for."""

    def typical(job: Callable[[], object]) -> float:
        return 1e3 * statistics.median(timing.alternate({"": job}, 4 * rounds)[""])

    return {
        "submit ms": typical(lambda: gpu.submit(device, device.create_command_encoder())),
        "wait ms": typical(lambda: timing.work(device, lambda encoder: None)),
    }


def of_method(device: wgpu.GPUDevice, method: str, size: Size, rounds: int) -> dict[str, Any]:
    """Figures of the bench; a frame of several in a row without a wait, and counts of the last."""
    run = bench(device, [Candidate.parse(method)], [size], [SAMPLES], rounds, 30.0)
    blur = Candidate.parse(method).blur(SAMPLES, Shutter(180), device)
    views = blur.upload(frame_of(blur, size))
    output = TexturePool(device).view("output", size, blur.output)

    def draw(encoder: wgpu.GPUCommandEncoder) -> None:
        blur.encode(encoder, output=output, **views)

    for _ in range(2):
        timing.work(device, draw)
    began = time.perf_counter()
    for _ in range(IN_A_ROW):
        encoder = device.create_command_encoder()
        draw(encoder)
        gpu.submit(device, encoder)
    with counted() as counts:
        timing.work(device, draw)
    took = 1e3 * (time.perf_counter() - began) / (IN_A_ROW + 1)
    return {**asdict(run.figures[0]), "in a row": took, "asked": dict(counts)}


def of_references(device: wgpu.GPUDevice, path: str) -> dict[str, Any]:
    """Differences of small results from those of another adapter."""
    apart = {}
    with np.load(path) as references:
        for name, image in small_results(device).items():
            difference = np.abs(image - references[name])
            largest, share = float(difference.max()), float((difference > VISIBLE).mean())
            apart[name] = {"largest": largest, f"share over {VISIBLE}": share}
    return apart


def parts_of(
    device: wgpu.GPUDevice, options: argparse.Namespace
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Every part by its name, the most useful first."""
    sizes: list[Size] = [(1920, 1080), (3840, 2160), (1280, 720)]
    rounds, pictures, limit = 9, 16, 25.0
    if options.quick:
        sizes, rounds, pictures, limit = [(64, 36)], 1, 1, 2.0
    yield "device", partial(of_device, device)
    yield "waits", partial(of_waits, device, rounds)
    for number, size in enumerate(sizes):
        for method in METHODS:
            name = f"{method}, {size[0]} x {size[1]}"
            yield name, partial(of_method, device, method, size, rounds)
        if number == 0:
            for flow in FLOWS:
                video = partial(time_video, device, flow, size, pictures, limit)
                yield f"video by {flow}", lambda video=video: asdict(video())
            if options.refs:
                yield "references", partial(of_references, device, options.refs)


def table(results: dict[str, Any]) -> str:
    """The figures of methods and of videos as Markdown."""
    columns = {"record": "recording", "gpu": "GPU", "wall": "frame", "in a row": "in a row",
               "call": "arrays in, array out"}  # fmt: skip
    lines = [f"| ms | {' | '.join(columns.values())} | passes |", "|---" * 7 + "|"]
    for name, one in results.items():
        if "in a row" in one:
            cells = [f"{one[column]:.2f}" for column in columns]
            lines.append(f"| {name} | {' | '.join(cells)} | {one['asked']['passes']} |")
    kinds = "passes", "submits", "waits", "groups", "buffers", "textures"
    lines += ["", f"| | pictures a second | thread ms | {' | '.join(kinds)} |", "|---" * 9 + "|"]
    for name, one in results.items():
        if "rate" in one:
            counts = [f"{one['counts'][kind]:.1f}" for kind in kinds]
            lines.append(f"| {name} | {one['rate']:.1f} | {one['thread']:.1f} | "
                         f"{' | '.join(counts)} |")  # fmt: skip
    return "\n".join(lines)


def check(options: argparse.Namespace) -> int:
    """Run all parts for which there is time; 1 if one failed."""
    began, folder = time.perf_counter(), Path(options.path)
    folder.mkdir(parents=True, exist_ok=True)
    results: dict[str, Any] = {}
    left, faults = [], {}
    for name, part in parts_of(gpu.open_device(), options):
        if time.perf_counter() - began > options.seconds:
            left.append(name)
        else:
            try:
                results[name] = part()
            except Exception as error:  # one part takes nothing from the others
                faults[name] = f"{type(error).__name__}: {error}"
        spent = time.perf_counter() - began
        sys.stderr.write(f"{spent:6.1f} s  {name}  {faults.get(name, '')}\n")
        whole = {"left out": left, "failed": faults, **results}
        (folder / "check.json").write_text(json.dumps(whole, indent=1), "utf-8")
    about = results.get("device", {})
    sys.stdout.write(
        f"{about.get('adapter')}, commit {about.get('commit')}\n\n{table(results)}\n\n"
    )
    sys.stdout.write(f"Left out: {', '.join(left) or 'nothing'}. Failed: "
                     f"{', '.join(faults) or 'nothing'}.\n")  # fmt: skip
    return bool(faults)


def main(words: list[str] | None = None) -> int:
    """See the top of this file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("what", choices=("reference", "check"))
    parser.add_argument("path")
    parser.add_argument("--refs")
    parser.add_argument("--seconds", type=float, default=420)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args(words)
    interpreter.name_runtime_folder()
    if options.what == "check":
        return check(options)
    results = small_results(gpu.open_device())
    np.savez_compressed(options.path, allow_pickle=False, **results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
