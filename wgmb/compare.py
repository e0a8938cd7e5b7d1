"""Methods x scenes x shutters against a truth: numbers, pictures, equal samples, equal time.

A Case is one picture to be made: a frame (rendered here from a scene, or read from files) and
its truth. A Contender is a method with its options. `compare` lets every contender make every
case with several numbers of samples, judges (measure.py) and times it; the Report of it is
written as a page, JSON and CSV by report.py.
"""

from __future__ import annotations

import ast
import inspect
import platform
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import wgpu

from . import __version__, scenes, timing
from .blur import METHODS
from .errors import InputError
from .frame import Frame
from .images import Images
from .measure import MEASURES, measure
from .numbering import frame_range
from .pipeline import MOST_SAMPLES, Blur
from .render import Render
from .scene import Scene
from .sequence import Clip
from .shutter import Shutter

LADDER = (4, 8, 16, 32, 64)
_LONG = 1.0  # seconds; what takes longer is timed once
_NEAR = 0.15  # how far a time may be from its budget
_FARTHER = 8  # times the most samples that were timed, tried at once

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Contender:
    """A method with its options, as the command line writes it: `tap`, `reproject:form=published`.

    `samples`: its own number at equal samples, `tap:32`; None takes everyone's. `name`: what
    tables call it, if not by method and options. `given`: what it is given of a case's frame.
    """

    method: str
    options: tuple[tuple[str, Any], ...] = ()
    samples: int | None = None
    name: str = ""
    given: Callable[[Frame], Frame] = lambda frame: frame

    @classmethod
    def parse(cls, text: str) -> Contender:
        """NAME[:SAMPLES][:OPTION=VALUE]...; the error says which method is unknown."""
        name, *more = text.split(":")
        if name not in METHODS:
            raise InputError(f"unknown method {name!r}, one of {', '.join(METHODS)}")
        samples, options = None, []
        for part in more:
            key, equals, value = part.partition("=")
            if equals:
                options.append((key, _value(value)))
            elif part.isdigit():
                samples = int(part)
            else:
                raise InputError(f"a method is NAME:SAMPLES:OPTION=VALUE, got {text!r}")
        return cls(name, tuple(options), samples)

    @property
    def label(self) -> str:
        """How tables call it."""
        return self.name or ", ".join([self.method, *(f"{k} {v}" for k, v in self.options)])

    @property
    def needs_scene(self) -> bool:
        """Whether it makes its picture from a scene instead of rendered frames."""
        return "scene" in METHODS[self.method].needs

    def blur(self, samples: int, shutter: Shutter, device) -> Blur:
        """Compiled for one number of samples."""
        return Blur(
            self.method, shutter=shutter, samples=samples, device=device, **dict(self.options)
        )


def _value(text: str):
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


@dataclass(frozen=True)
class Staged:
    """A scene at one moment, for the methods that need one."""

    scene: Scene
    time: float = 0.0
    size: tuple[int, int] = (480, 270)
    fps: float = 24.0
    rays: int = 3

    def render(self, blur: Blur) -> Render:
        """The scene through a method."""
        return Render(self.scene, blur, size=self.size, fps=self.fps, rays=self.rays)

    def frame(self, device) -> Frame:
        """The sharp frame with its neighbours, as image methods are given it from files."""
        render = self.render(Blur("tap", device=device))
        before, here, after = (render.frame(self.time + k / self.fps, k + 1) for k in (-1, 0, 1))
        return replace(here, prev=before, next=after)


@dataclass(frozen=True)
class Case:
    """One picture to be made: from what, and what it should look like."""

    name: str
    frame: Frame
    shutter: Shutter
    truth: np.ndarray
    """(height, width, 3 or 4) linear."""
    about: str
    """What the truth is."""
    staged: Staged | None = None
    peers: dict[str, np.ndarray] = field(default_factory=dict)
    """Pictures of other programs, by name."""
    floor: dict[str, float] | None = None
    """What every judge says of a perfect picture, if the truth's noise is known."""


def scene_case(
    name: str, shutter: Shutter, reference: Contender, staged: Staged, device, tell: Tell
) -> Case:
    """A case whose truth is rendered by `reference`, such as distributed:1024.

    One that takes a seed renders it as two halves with seeds of their own.
    """
    if not reference.needs_scene:
        wanted = ", ".join(m for m in METHODS if "scene" in METHODS[m].needs)
        raise InputError(f"the reference must be one of {wanted}, got {reference.method!r}")
    samples = reference.samples or 1024
    tell(f"{name}: reference, {reference.label} {samples}")
    started = time.perf_counter()
    pictures = [
        staged.render(part.blur(part.samples or samples, shutter, device))(staged.time)
        for part in _halves(reference, samples) or [reference]
    ]
    took = time.perf_counter() - started
    about = f"{reference.label}, {samples} samples a pixel, {took:.1f} s"
    case = Case(name, staged.frame(device), shutter, pictures[0], about, staged)
    return case if len(pictures) == 1 else _of_halves(case, pictures)


def _halves(reference: Contender, samples: int) -> list[Contender]:
    """The reference as two with half the samples; none where it has no noise, or one sample."""
    known = inspect.signature(METHODS[reference.method]).parameters
    if "seed" not in known or samples < 2:
        return []
    options = dict(reference.options)
    seed = options.get("seed", known["seed"].default)
    # Neither has the seed of a contender that nobody gave one, which would share its rays.
    return [
        replace(reference, options=tuple((options | {"seed": s}).items()), samples=n)
        for s, n in ((2 * seed + 1, samples - samples // 2), (2 * seed + 2, samples // 2))
    ]


def _of_halves(case: Case, halves: Sequence[np.ndarray]) -> Case:
    """The case with the mean of two independent halves as its truth, and with its noise floor.

    The mean has half the variance of one half, and so has the difference between them: a half
    is as far from the mean as a perfect picture is, in the root of the mean square.
    """
    if halves[0].shape != halves[1].shape:
        sizes = " and ".join(f"{h.shape[1]} x {h.shape[0]}" for h in halves)
        raise InputError(f"two halves of the truth must be of one size, got {sizes}")
    truth = np.mean(halves, axis=0)
    found = [measure(half, truth) for half in halves]
    floor = {name: float(np.mean([f[name] for f in found])) for name in found[0]}
    return replace(case, truth=truth, floor=floor)


def clip_case(
    name: str, shutter: Shutter, inputs: Sequence[str], number: int | None,
    truth: Sequence[Path], peers: dict[str, Path], open_clip: Callable[[str], Clip] = Clip,
) -> Case:  # fmt: skip
    """A case of rendered frames on disk.

    `inputs`: a pattern, with the `number` of its frame, or the file of one frame, or the files
    of the frames before, here and after. `truth`: one file, or two independent halves of it.
    """
    if len(truth) not in (1, 2):
        raise InputError(f"truth must be one file or two halves of it, got {len(truth)}")
    if len(inputs) == 3:
        before, here, after = (
            clip.frame(clip.source(clip.numbers[0])) for clip in map(open_clip, inputs)
        )
        frame = replace(here, prev=before, next=after)
    elif len(inputs) == 1:
        clip = open_clip(inputs[0])
        if number is None and len(clip.numbers) > 1:
            raise InputError(f"{inputs[0]} has frames {frame_range(clip.numbers)}: choose --frame")
        wanted = clip.numbers[0] if number is None else number
        if wanted not in clip.numbers:
            raise InputError(f"{inputs[0]} has no frame {wanted}")
        frame = clip.with_neighbours(clip.source(wanted))
    else:
        raise InputError(f"inputs must be a pattern, one file or three, got {len(inputs)}")
    pictures = {k: _read(path) for k, path in peers.items()}
    truths = [_read(path) for path in truth]
    if len(truths) == 1:
        about = f"{truth[0].name}; one picture, so that its noise is not known"
        return Case(name, frame, shutter, truths[0], about, peers=pictures)
    about = f"mean of {truth[0].name} and {truth[1].name}"
    return _of_halves(Case(name, frame, shutter, truths[0], about, peers=pictures), truths)


def _read(path: Path) -> np.ndarray:
    clip = Clip(path)
    return clip.source(clip.numbers[0]).rgba


def make_scene(text: str) -> tuple[str, Scene]:
    """NAME[:SETTING=VALUE]... -> a name for tables, and the scene."""
    name, *more = text.split(":")
    pairs = [part.partition("=") for part in more]
    if wrong := [part[0] for part in pairs if not part[1]]:
        raise InputError(f"a scene is NAME:SETTING=VALUE, got {wrong[0]!r}")
    settings = {key: value for key, _, value in pairs}
    return ", ".join([name, *(f"{k} {v}" for k, v in settings.items())]), scenes.make(
        name, **settings
    )


@dataclass(frozen=True)
class Entry:
    """One picture of a case, judged and timed."""

    case: str
    label: str
    kind: str
    """"sharp", "peer", "floor" (of the truth's noise), "samples" (one step of the ladder) or
    "time" (all that fits a budget)."""
    measures: dict[str, float]
    samples: int | None = None
    seconds: float | None = None
    """From rendered frames, or from the scene, to the picture on the GPU."""
    frame_seconds: float = 0.0
    """Of them, rendering one sharp frame of the scene."""
    budget: float | None = None
    """Seconds it was to fit, of kind "time"."""
    traced: bool = False
    """Whether its method makes pictures from a scene instead of rendered frames."""
    shown: bool = False
    """Whether `picture` is to be seen on the page."""
    picture: np.ndarray | None = None


@dataclass(frozen=True)
class Table:
    """Further findings: numbers or texts."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    note: str = ""


@dataclass(frozen=True)
class Plot:
    """Curves by name, each a list of (x, y)."""

    title: str
    x: str
    y: str
    curves: dict[str, list[tuple[float, float]]]
    log: bool = True
    """Whether x is logarithmic."""
    floor: float | None = None
    """What y is for a perfect picture, if the truth has noise."""


@dataclass
class Report:
    """All that a run found out; report.py writes it down."""

    title: str
    command: str
    machine: dict[str, str]
    samples: int
    cases: list[Case] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plots: list[Plot] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def of(self, case: str, **wanted) -> list[Entry]:
        """The entries of a case whose fields are as `wanted`."""
        return [
            e
            for e in self.entries
            if e.case == case and all(getattr(e, k) == v for k, v in wanted.items())
        ]


def machine(device: wgpu.GPUDevice) -> dict[str, str]:
    """What the figures depend on, by name."""
    return {
        "adapter": device.adapter.summary,
        "wgmb": __version__,
        "wgpu": wgpu.__version__,
        "numpy": np.__version__,
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "made": time.strftime("%Y-%m-%d"),
    }


class Laboratory:
    """What every experiment shares: the device, how often to time, who is told."""

    def __init__(self, device: wgpu.GPUDevice, *, rounds: int = 3, tell: Tell | None = None):
        if rounds < 1:
            raise InputError(f"rounds must be 1 or more, got {rounds}")
        self.device, self.rounds, self.tell = device, rounds, tell or (lambda text: None)
        self._images, self.clock = Images(device), timing.clock(device)

    def compare(
        self,
        report: Report,
        case: Case,
        contenders: Iterable[Contender],
        ladder: Iterable[int] = LADDER,
        budgets: Callable[[Report, Case], list[float]] | None = None,
    ) -> None:
        """Add a case and all its entries to the report.

        `ladder`: numbers of samples. `budgets` tells the times [s] that everyone is to fit, after
        the ladder; by default that of the slowest method of pictures at equal samples.
        """
        report.cases.append(case)
        for kind, pictures in (("sharp", {"sharp": case.frame.color}), ("peer", case.peers)):
            for label, picture in pictures.items():
                found = measure(picture, case.truth)
                report.entries.append(
                    Entry(case.name, label, kind, found, shown=True, picture=picture)
                )
        if case.floor is not None:
            found = ", ".join(f"{MEASURES[m].title} {case.floor[m]:.{MEASURES[m].digits}f}"
                              for m in ("flip", "psnr"))  # fmt: skip
            self.tell(f"{case.name}: noise floor of the truth: {found}")
            report.entries.append(Entry(case.name, "noise floor", "floor", case.floor))
        able = self._able(report, case, contenders)
        frame_seconds = self.frame_seconds(case)
        known: dict[Contender, list[tuple[int, float]]] = {c: [] for c in able}
        for samples in sorted({*ladder, report.samples}):
            equal = samples == report.samples
            jobs = {c: c.samples or samples if equal else samples for c in able}
            found = self._judge(case, jobs, "samples", frame_seconds, shown=equal)
            report.entries += found
            for c, entry in zip(able, found, strict=True):
                known[c].append((jobs[c], entry.seconds or 0.0))
        for budget in (budgets or _slowest_of_pictures)(report, case):
            jobs = {c: self._fitting(case, c, known[c], budget, frame_seconds) for c in able}
            report.entries += self._judge(
                case, jobs, "time", frame_seconds, shown=True, budget=budget
            )

    def _able(self, report: Report, case: Case, contenders) -> list[Contender]:
        """Those that can make this case; the report says why others cannot."""
        able = []
        for c in contenders:
            try:
                if c.needs_scene and case.staged is None:
                    raise InputError("needs a scene")
                self.picture(case, c.blur(1, case.shutter, self.device), c)
            except InputError as error:
                report.notes.append(f"{case.name}: {c.label} left out: {error}")
            else:
                able.append(c)
        if not able:
            raise InputError(report.notes[-1] if report.notes else "no methods to compare")
        return able

    def _judge(
        self,
        case: Case,
        jobs: dict[Contender, int],
        kind: str,
        frame_seconds: float,
        *,
        shown: bool,
        budget: float | None = None,
    ) -> list[Entry]:
        """Every contender's picture with its number of samples, judged, and timed in turns."""
        found, timed = [], []
        for c, samples in jobs.items():
            self.tell(f"{case.name}: {c.label}, {samples} samples")
            blur = c.blur(samples, case.shutter, self.device)
            picture = self.picture(case, blur, c)
            judged = measure(picture, case.truth)
            found.append(
                Entry(case.name, c.label, kind, judged, samples, budget=budget, shown=shown,
                      traced=c.needs_scene, picture=picture if shown else None)
            )  # fmt: skip
            timed.append(self.timer(case, blur, c))
        seconds = self.least(timed)
        frames = [0.0 if c.needs_scene else frame_seconds for c in jobs]
        return [
            replace(entry, seconds=s + f, frame_seconds=f)
            for entry, s, f in zip(found, seconds, frames, strict=True)
        ]

    def _fitting(self, case: Case, c: Contender, known, budget: float, frame_seconds: float) -> int:
        """The samples that take about `budget` seconds: guessed, tried, and corrected twice."""
        known = list(known)
        for _ in range(3):
            samples = _guess(known, budget)
            timer = self.timer(case, c.blur(samples, case.shutter, self.device), c)
            timer()  # compiles
            seconds = self.least([timer])[0] + (0.0 if c.needs_scene else frame_seconds)
            if abs(seconds / budget - 1) < _NEAR or samples in (1, MOST_SAMPLES):
                break
            known.append((samples, seconds))
        return samples

    def picture(self, case: Case, blur: Blur, contender: Contender) -> np.ndarray:
        """The case through a method: (height, width, 3 or 4) linear."""
        if "scene" in blur.method.needs:
            assert case.staged is not None
            return case.staged.render(blur)(case.staged.time)
        return blur(contender.given(case.frame))

    def timer(self, case: Case, blur: Blur, contender: Contender) -> Callable[[], float]:
        """A function that does the case's work once and returns its seconds."""
        if "scene" in blur.method.needs:
            assert case.staged is not None
            render, moment = case.staged.render(blur), case.staged.time

            def draw() -> float:
                started = time.perf_counter()
                render(moment)
                return time.perf_counter() - started

            return draw
        record = self._recorder(case, blur, contender)
        return lambda: timing.work(blur.device, record)

    def _recorder(self, case: Case, blur: Blur, contender: Contender) -> Callable[..., None]:
        """A function that records the blur of the case's frame, which is uploaded now."""
        views = blur.upload(contender.given(case.frame))
        output = self._images.view("timed", case.frame.size, blur.output)
        return partial(blur.encode, output=output, **views)

    def passes(
        self, case: Case, jobs: dict[Contender, Blur]
    ) -> dict[Contender, dict[str, tuple[int, float]]]:
        """How often every pass of methods of pictures runs, and the median seconds of all of them.

        All take turns in `rounds` rounds, after one for warmth.
        """
        records = {c: self._recorder(case, blur, c) for c, blur in jobs.items()}
        runs, counts = {c: [] for c in jobs}, {}
        for _ in range(1 + self.rounds):
            for c, record in records.items():
                timing.work(self.device, partial(record, timing=self.clock))
                runs[c].append(self.clock.read())
                counts[c] = self.clock.counts
        return {
            c: {label: (counts[c][label], s) for label, s in timing.medians(found[1:]).items()}
            for c, found in runs.items()
        }

    def least(self, jobs: Sequence[Callable[[], float]]) -> list[float]:
        """The least seconds of every job in `rounds` rounds; all take turns."""
        least = [np.inf] * len(jobs)
        for _ in range(self.rounds):
            for i, job in enumerate(jobs):
                if least[i] == np.inf or least[i] < _LONG:
                    least[i] = min(least[i], job())
        return least

    def frame_seconds(self, case: Case) -> float:
        """What one sharp frame of the scene takes; every frame of a film is rendered once."""
        if case.staged is None:
            return 0.0
        one = Contender("accumulate")
        blur = one.blur(1, Shutter(0), self.device)
        timer = self.timer(case, blur, one)
        timer()  # compiles
        return self.least([timer])[0]


def _slowest_of_pictures(report: Report, case: Case) -> list[float]:
    entries = [e for e in report.of(case.name, kind="samples", shown=True) if e.seconds]
    pictures = [e for e in entries if not e.traced] or entries
    return [max(e.seconds or 0.0 for e in pictures)]


def _guess(known: list[tuple[int, float]], budget: float) -> int:
    """Samples for `budget` seconds between the times that are known, or in line with them.

    Other work makes times too long, never too short: a time that is longer than that of more
    samples does not count.
    """
    counts, times = np.array(sorted(known), float).T
    likely = times == np.minimum.accumulate(times[::-1])[::-1]
    counts, times = counts[likely], times[likely]
    if budget < times[0]:
        wanted = counts[0] * budget / times[0]
    elif budget < times[-1]:
        wanted = np.interp(budget, times, counts)
    else:
        slope = (times[-1] - times[0]) / max(counts[-1] - counts[0], 1)
        slope = max(slope, times[-1] / counts[-1] / 100)
        wanted = min(counts[-1] + (budget - times[-1]) / slope, _FARTHER * counts[-1])
    return int(np.clip(round(wanted), 1, MOST_SAMPLES))


def crossings(report: Report, case: Case, judge: str = "flip") -> Table | None:
    """When methods that trace a scene become as good as each method of pictures.

    Read off the error-against-time curves; `judge` must be one for which less is better.
    """
    curves: dict[str, list[tuple[float, float]]] = {}
    tracing = []
    for e in report.of(case.name, kind="samples"):
        curves.setdefault(e.label, []).append((e.seconds or 0.0, e.measures[judge]))
        if e.traced and e.label not in tracing:
            tracing.append(e.label)
    others = [k for k in curves if k not in tracing]
    if not tracing or not others:
        return None
    rows = []
    for name in others:
        seconds, error = min(curves[name], key=lambda point: point[1])
        row: list[object] = [name, _ms(seconds), round(error, 4)]
        for other in tracing:
            row += _reaches(sorted(curves[other]), error, seconds)
        rows.append(row)
    columns = ["method", "its best after [ms]", MEASURES[judge].title]
    for other in tracing:
        columns += [f"{other} as good after [ms]", "times as long"]
    return Table(
        f"{case.name}: when tracing the scene becomes as good",
        columns,
        rows,
        "Read off the curves; > is beyond the last point, < before the first.",
    )


def _reaches(curve: list[tuple[float, float]], error: float, seconds: float) -> list[object]:
    times, errors = np.array(curve).T
    best = np.minimum.accumulate(errors)
    if best[-1] > error:
        return [f"> {_ms(times[-1])}", f"> {times[-1] / seconds:.1f}"]
    if best[0] <= error:
        return [f"< {_ms(times[0])}", f"< {times[0] / seconds:.1f}"]
    at = float(np.exp(np.interp(-error, -best, np.log(times))))
    return [_ms(at), round(at / seconds, 1)]


def _ms(seconds: float) -> float:
    return round(1e3 * float(seconds), 1)
