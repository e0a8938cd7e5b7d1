"""`wgmb compare`: score methods against a ground truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ... import gpu
from ...errors import InputError, check_choice
from ...lab.cases import Candidate, Case, SceneFrame, clip_case, make_scene, scene_case
from ...lab.compare import Laboratory, crossings
from ...lab.papers.experiments import EXPERIMENTS
from ...lab.report import write
from ...lab.results import Report, machine
from ...methods import METHODS
from ...metrics import check_flip
from ...scene.scene import Scene
from ...settings import ShutterSettings, size_of
from ...settings.color import option_name
from ...settings.groups import changed
from ...shutter import Shutter
from ..console import Console
from ..help import MAIN
from ..options import Adapter, InputOptions, Inputs, Quiet, ShutterOptions, Shutters
from ..pages import command_line, pages_of, whole_numbers


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """Candidates and timing."""

    methods: str | None = None
    "NAME[:SAMPLES][:OPTION=VALUE]..., separated by commas; all by default."
    reference: str = "distributed:1024"
    "Method and samples that render the ground truth of scenes."
    samples: int = 16
    "Samples per pixel of every method in the comparison at equal samples."
    ladder: str = "4,8,16,32,64"
    "Sample counts for the error curves, separated by commas."
    budget: float | None = None
    "Milliseconds per frame in the comparison at equal time; default: the slowest image method's."
    shutters: str | None = None
    "Several shutter angles in degrees, such as 90,180,360, instead of --shutter."
    rounds: int = 3
    "Number of timing rounds; the fastest counts."

    def candidates(self) -> list[Candidate]:
        """Return the candidates."""
        return [Candidate.parse(text) for text in (self.methods or ",".join(METHODS)).split(",")]

    def steps(self) -> list[int]:
        """Numbers of samples."""
        return whole_numbers("ladder", self.ladder)

    def budgets(self) -> Callable[[Report, Case], list[float]] | None:
        """Return a function that gives the time budgets [s], or None without --budget."""
        if self.budget is None:
            return None
        if not self.budget > 0:
            raise InputError(f"--budget must be over 0 ms, got {self.budget}")
        seconds = self.budget / 1e3
        return lambda report, case: [seconds]

    def labelled_shutters(
        self, shutter: ShutterSettings, scene: Scene | None = None
    ) -> dict[str, Shutter]:
        """Return the shutters by label; unset fields are taken from the scene."""
        settled = shutter.resolved(scene, 24 if scene is not None else None)
        try:
            degrees = [float(d) for d in (self.shutters or str(settled.shutter)).split(",")]
        except ValueError:
            raise InputError(f"--shutters must be like 90,180, got {self.shutters!r}") from None
        return {f"{d:g}°": replace(settled, shutter=d).make() for d in degrees}


@dataclass(frozen=True, kw_only=True)
class SceneFrameSettings:
    """The frame of built-in scenes."""

    size: str = "480x270"
    "Image size for scenes."
    time: float = 0.0
    "Time of the scenes in seconds."
    antialias: int = 3
    "Antialiasing of the scenes' sharp frames: rays per pixel side."


Comparison = Annotated[CompareSettings, Parameter(name="*", group=MAIN)]
SceneFrames = Annotated[SceneFrameSettings, Parameter(name="*", group=MAIN)]

_OF_FILES = {one.name for one in fields(InputOptions)} | {"peer"}
_OF_METHODS = {one.name for one in fields(CompareSettings)} - {"rounds", "samples"}
_OF_SHUTTER = {one.name for one in fields(ShutterOptions)}
_REFUSED = {
    "scenes": _OF_FILES,
    "rendered frames": {"size", "time", "antialias", "reference"},
    "experiments": {"time", "antialias", *_OF_FILES, *_OF_METHODS, *_OF_SHUTTER},
}
"""Options that a kind of comparison does not use."""


def compare(
    *scene: str,
    output: Annotated[Path, Parameter(alias="-o")],
    comparison: Comparison = CompareSettings(),
    shutter: Shutters = ShutterOptions(),
    input: Inputs = InputOptions(),
    frame: SceneFrames = SceneFrameSettings(),
    truth: Annotated[list[Path] | None, Parameter(consume_multiple=True)] = None,
    inputs: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    peer: tuple[str, ...] = (),
    experiment: str | None = None,
    adapter: Adapter = None,
    overwrite: bool = False,
    quiet: Quiet = False,
) -> int:
    """Score and time methods against a ground truth; write an HTML, JSON and CSV report.

    Example: wgmb compare crossing fence:speed=5 --methods tap,reproject -o report.html

    Example: wgmb compare --truth t.exr --inputs 'shot.####.exr' --frames 2 -o report.html

    Parameters
    ----------
    scene
        Built-in scenes, NAME[:PARAMETER=VALUE]...
    output
        Report file, .html; JSON and CSV files are written next to it.
    truth
        Ground truth of the blurred frame: one file, or two rendered with half the samples and
        different seeds, whose mean is the truth and whose difference gives the noise floor.
    inputs
        Rendered frames: a pattern, of which --frames names the frame of the truth, or the files of
        the frame before, this one and the next.
    peer
        NAME=FILE: the frame as blurred by another program; may be repeated.
    experiment
        Repeat a paper's experiment instead: taylor, chen or rosado.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    overwrite
        Replace existing files.
    quiet
        Print errors only.
    """
    pages = pages_of(output)
    for file in pages:
        if file.exists() and not overwrite:
            raise InputError(f"{file} exists; --overwrite replaces it")
    if (truth is None) != (not inputs) or bool(scene) + bool(inputs) + bool(experiment) != 1:
        raise InputError("pass either scenes, --truth with --inputs, or --experiment")
    kind = "experiments" if experiment else "scenes" if scene else "rendered frames"
    given = [name for group in (comparison, shutter, input, frame) for name in changed(group)]
    for name in [*given, *(["peer"] if peer else [])]:
        if name in _REFUSED[kind]:
            raise InputError(f"{option_name(name)} is not for {kind}")
    check_flip()  # before a reference is rendered for minutes
    device = gpu.open_device(adapter)
    tell = Console(quiet).say_running
    lab = Laboratory(device, rounds=comparison.rounds, tell=tell)
    report = Report("", command_line(), machine(device), comparison.samples)
    wanted, candidates = size_of(frame.size), comparison.candidates()
    steps, budgets = comparison.steps(), comparison.budgets()
    if experiment:
        check_choice("--experiment", experiment, EXPERIMENTS)
        report.title = f"{experiment.capitalize()}'s experiment"
        EXPERIMENTS[experiment](lab, report, wanted)
        write(report, output)
        tell(f"-> {output}")
        return 0
    reference = Candidate.parse(comparison.reference)
    baselines = {name: Path(file) for name, _, file in (p.partition("=") for p in peer)}
    cases: list[Callable[[], Case]] = []
    for name, made in map(make_scene, scene):
        scene_frame = SceneFrame(made, frame.time, wanted, antialias=frame.antialias)
        for degrees, exposed in comparison.labelled_shutters(shutter, made).items():
            cases.append(partial(scene_case, f"{name}, {degrees}", exposed, reference,
                                 scene_frame, device, tell))  # fmt: skip
    if truth is not None and inputs:
        name = truth[0].parent.name or truth[0].stem
        for degrees, exposed in comparison.labelled_shutters(shutter).items():
            cases.append(partial(clip_case, f"{name}, {degrees}", exposed, inputs, truth,
                                 baselines, input.open))  # fmt: skip
    able = (
        candidates if comparison.methods or scene else [c for c in candidates if not c.needs_scene]
    )
    for make in cases:
        case = make()
        lab.compare(report, case, able, steps, budgets)
        if crossing_table := crossings(report, case):
            report.tables.append(crossing_table)
    report.title = "Motion blur compared: " + ", ".join(c.name for c in report.cases)
    files = (file for name in inputs or () for file in input.open(name).dependencies.every())
    write(report, output, [*(truth or ()), *baselines.values(), *files])
    tell(f"-> {output}")
    return 0
