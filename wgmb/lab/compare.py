"""Compare methods with a ground truth, over scenes and shutters, at equal samples and time.

A Laboratory lets every candidate make every case (cases.py) with several numbers of samples,
judges (metrics.py) and times it; its results (results.py) are written as a page, JSON and CSV
by report.py.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import wgpu

from ..errors import InputError
from ..gpu import timing
from ..gpu.textures import TexturePool
from ..methods import METHODS
from ..metrics import METRICS, measure
from ..pipeline.arguments import MOST_SAMPLES, most_samples
from ..pipeline.blur import Blur
from ..shutter import Shutter
from .cases import Candidate, Case, Tell
from .results import Entry, Report, Table

LADDER = (4, 8, 16, 32, 64)
_LONG = 1.0  # seconds; what takes longer is timed once
_NEAR = 0.15  # how far a time may be from its budget
_FARTHER = 8  # times the most samples that were timed, tried at once


class Laboratory:
    """Shared setup of all experiments: device, number of timing rounds, progress messages."""

    def __init__(self, device: wgpu.GPUDevice, *, rounds: int = 3, tell: Tell | None = None):
        if rounds < 1:
            raise InputError(f"`rounds` must be 1 or more, got {rounds}")
        self.device, self.rounds, self.tell = device, rounds, tell or (lambda text: None)
        self._images, self.clock = TexturePool(device), timing.clock(device)

    def compare(
        self,
        report: Report,
        case: Case,
        candidates: Iterable[Candidate],
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
                    Entry(case.name, label, kind, found, on_page=True, picture=picture)
                )
        if case.floor is not None:
            found = ", ".join(f"{METRICS[m].title} {case.floor[m]:.{METRICS[m].digits}f}"
                              for m in ("flip", "psnr"))  # fmt: skip
            self.tell(f"{case.name}: noise floor of the truth: {found}")
            report.entries.append(Entry(case.name, "noise floor", "floor", case.floor))
        able = self._able(report, case, candidates)
        frame_seconds = self.frame_seconds(case)
        known: dict[Candidate, list[tuple[int, float]]] = {c: [] for c in able}
        for samples in sorted({*ladder, report.samples}):
            equal = samples == report.samples
            jobs = {c: c.samples or samples if equal else samples for c in able}
            found = self._judge(case, jobs, "samples", frame_seconds, on_page=equal)
            report.entries += found
            for c, entry in zip(able, found, strict=True):
                known[c].append((jobs[c], entry.seconds or 0.0))
        for budget in (budgets or _slowest_of_pictures)(report, case):
            jobs = {c: self._fitting(case, c, known[c], budget, frame_seconds) for c in able}
            report.entries += self._judge(
                case, jobs, "time", frame_seconds, on_page=True, budget=budget
            )

    def _able(self, report: Report, case: Case, candidates: Iterable[Candidate]) -> list[Candidate]:
        """Those that can make this case; the report says why others cannot."""
        able = []
        for c in candidates:
            try:
                if c.needs_scene and case.scene_frame is None:
                    raise InputError("needs a scene")
                self.picture(case, c.blur(1, case.shutter, self.device), c)
            except InputError as error:
                report.notes.append(f"{case.name}: {c.label} skipped: {error}")
            else:
                able.append(c)
        if not able:
            raise InputError(report.notes[-1] if report.notes else "no methods to compare")
        return able

    def _judge(
        self,
        case: Case,
        jobs: dict[Candidate, int],
        kind: str,
        frame_seconds: float,
        *,
        on_page: bool,
        budget: float | None = None,
    ) -> list[Entry]:
        """Every candidate's picture with its number of samples, judged, and timed in turns."""
        entries, timed = [], []
        for c, samples in jobs.items():
            self.tell(f"{case.name}: {c.label}, {samples} samples")
            blur = c.blur(samples, case.shutter, self.device)
            picture = self.picture(case, blur, c)
            judged = measure(picture, case.truth)
            entries.append(
                Entry(case.name, c.label, kind, judged, samples, budget=budget, on_page=on_page,
                      traced=c.needs_scene, picture=picture if on_page else None)
            )  # fmt: skip
            timed.append(self.timer(case, blur, c))
        seconds = self.least(timed)
        frames = [0.0 if c.needs_scene else frame_seconds for c in jobs]
        return [
            replace(entry, seconds=s + f, frame_seconds=f)
            for entry, s, f in zip(entries, seconds, frames, strict=True)
        ]

    def _fitting(
        self,
        case: Case,
        c: Candidate,
        known: Iterable[tuple[int, float]],
        budget: float,
        frame_seconds: float,
    ) -> int:
        """The samples that take about `budget` seconds: guessed, tried, and corrected twice."""
        known, most = list(known), most_samples(METHODS[c.method], self.device)
        samples = 1
        for _ in range(3):
            samples = _guess(known, budget, most)
            timer = self.timer(case, c.blur(samples, case.shutter, self.device), c)
            timer()  # compiles
            seconds = self.least([timer])[0] + (0.0 if c.needs_scene else frame_seconds)
            if abs(seconds / budget - 1) < _NEAR or samples in (1, most):
                break
            known.append((samples, seconds))
        return samples

    def picture(self, case: Case, blur: Blur, candidate: Candidate) -> np.ndarray:
        """The case through a method: (height, width, 3 or 4) linear."""
        if "scene" in blur.method.needs:
            assert case.scene_frame is not None
            return case.scene_frame.render(blur)(case.scene_frame.time)
        return blur(candidate.select(case.frame))

    def timer(self, case: Case, blur: Blur, candidate: Candidate) -> Callable[[], float]:
        """A function that does the case's work once and returns its seconds."""
        if "scene" in blur.method.needs:
            assert case.scene_frame is not None
            render, moment = case.scene_frame.render(blur), case.scene_frame.time

            def draw() -> float:
                started = time.perf_counter()
                render(moment)
                return time.perf_counter() - started

            return draw
        record = self._recorder(case, blur, candidate)
        return lambda: timing.work(blur.device, record)

    def _recorder(self, case: Case, blur: Blur, candidate: Candidate) -> Callable[..., None]:
        """A function that records the blur of the case's frame, which is uploaded now."""
        views = blur.upload(candidate.select(case.frame))
        output = self._images.view("timed", case.frame.size, blur.output)
        return partial(blur.encode, output=output, **views)

    def passes(
        self, case: Case, jobs: dict[Candidate, Blur]
    ) -> dict[Candidate, dict[str, tuple[int, float]]]:
        """Return the count and the median seconds of every pass of the image methods.

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
        """Return the seconds for one sharp frame of the scene; a film renders every frame once."""
        if case.scene_frame is None:
            return 0.0
        one = Candidate("accumulate")
        blur = one.blur(1, Shutter(0), self.device)
        timer = self.timer(case, blur, one)
        timer()  # compiles
        return self.least([timer])[0]


def _slowest_of_pictures(report: Report, case: Case) -> list[float]:
    entries = [e for e in report.of(case.name, kind="samples", on_page=True) if e.seconds]
    pictures = [e for e in entries if not e.traced] or entries
    return [max(e.seconds or 0.0 for e in pictures)]


def _guess(known: list[tuple[int, float]], budget: float, most: int = MOST_SAMPLES) -> int:
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
    return int(np.clip(round(wanted), 1, most))


def crossings(report: Report, case: Case, metric: str = "flip") -> Table | None:
    """Return a table of the times at which scene methods match each image method.

    Read off the error-against-time curves; `metric` must be one for which less is better.
    """
    curves: dict[str, list[tuple[float, float]]] = {}
    tracing = []
    for e in report.of(case.name, kind="samples"):
        curves.setdefault(e.label, []).append((e.seconds or 0.0, e.measures[metric]))
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
    columns = ["method", "its best after [ms]", METRICS[metric].title]
    for other in tracing:
        columns += [f"{other} as good after [ms]", "times as long"]
    return Table(
        f"{case.name}: when tracing the scene becomes as good",
        columns,
        rows,
        "Interpolated on the curves; > is beyond the last point, < before the first.",
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
