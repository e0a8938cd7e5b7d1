"""The command line: blender -b shot.blend -c wgmb --frames 1-100."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import bpy

from . import job
from .process import lent
from .settings import LIGHT, METHODS, wanted_of
from .wanted import ERRORS, Report, Wanted
from .wgmb_worker.problem import NoAdapterError, ProblemError, plain

_DONE, _FAILED, _USAGE, _NO_ADAPTER, _INTERRUPTED = 0, 1, 2, 3, 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="blender -b FILE.blend -c wgmb",
        description="Render sharp frames and blur them into the scene's output.",
        epilog="example: blender -b shot.blend -c wgmb --frames 1-100 --use-rendered. Exit codes: "
        "0 done, 1 some frames failed, 2 wrong usage or settings, 3 no GPU adapter.",
    )
    parser.add_argument(
        "--frames", metavar="1-100", help="frames to blur; by default those of the scene"
    )
    parser.add_argument("--method", choices=[name for name, *_ in METHODS])
    parser.add_argument("--samples", metavar="N", help="a number, or auto")
    parser.add_argument(
        "--light", choices=[name.lower() for name, *_ in LIGHT], help="follow moving shadows"
    )
    parser.add_argument("--device", metavar="NAME", help="part of the name of a GPU")
    parser.add_argument("--scene", metavar="NAME", help="by default the active scene")
    parser.add_argument(
        "--sharp", metavar="PATH", help="where the sharp frames lie; by default as in the panel"
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument(
        "--use-rendered", action="store_true", help="blur sharp frames that are there"
    )
    only.add_argument(
        "--render-only", action="store_true", help="render sharp frames and blur none"
    )
    return parser


def command(words: Sequence[str]) -> int:
    """Run with these words; returns the exit code."""
    try:
        given = _parser().parse_args(list(words))
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else _USAGE
    report = Report()
    try:
        scene = _scene(given.scene)
        wanted = _wanted(scene, given)
        last = ""
        for share, text in job.steps(scene, wanted, report):
            line = f"wgmb: {share:.0%} {text}"
            if line != last:
                print(line, flush=True)
            last = line
    except KeyboardInterrupt:
        print("wgmb: interrupted", file=sys.stderr)
        return _INTERRUPTED
    except ERRORS as error:
        _tell(report)
        print(f"wgmb: {plain(error)}", file=sys.stderr, flush=True)
        if isinstance(error, NoAdapterError):
            return _NO_ADAPTER
        return _FAILED if report.done or report.failed else _USAGE
    _tell(report)
    return _FAILED if report.failed else _DONE


def _tell(report: Report) -> None:
    for line in report.lines:
        is_failure = line in report.failed.values()
        print(f"wgmb: {line}", file=sys.stderr if is_failure else sys.stdout, flush=True)


def _scene(name: str | None) -> bpy.types.Scene:
    if name is None:
        return bpy.context.scene
    if name not in bpy.data.scenes:
        raise ProblemError(f"there is no scene {name!r}")
    return bpy.data.scenes[name]


def _wanted(scene: bpy.types.Scene, given: argparse.Namespace) -> Wanted:
    wanted = wanted_of(scene)
    samples = given.samples or wanted.samples
    if isinstance(samples, str) and samples != "auto":
        if not samples.isdigit() or samples == "0":
            raise ProblemError(f"--samples must be 1 or more, or auto, got {samples!r}")
        samples = int(samples)
    return replace(
        wanted,
        method=given.method or wanted.method,
        samples=samples,
        light=(given.light or wanted.light).upper(),
        frames=_frames(given.frames),
        device=given.device or wanted.device,
        sharp=given.sharp or wanted.sharp,
        is_rendering=not given.use_rendered,
        is_blurring=not given.render_only,
    )


def _frames(text: str | None) -> tuple[int, ...] | None:
    if not text:
        return None
    with lent() as process:
        return tuple(process.ask("frames", text=text).result())


_registered: list[object] = []


def register() -> None:
    """Make `-c wgmb` known."""
    _registered.append(bpy.utils.register_cli_command("wgmb", command))


def unregister() -> None:
    """Forget it."""
    while _registered:
        bpy.utils.unregister_cli_command(_registered.pop())
