"""Taylor's experiment: reprojection against ray tracing, in equal time."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ...metrics import METRICS
from ...scene import builtin
from ...shutter import Shutter
from ..cases import Candidate, Case, SceneFrame, scene_case
from ..compare import Laboratory
from ..findings import about, holds
from ..results import Report, Table

UNIT_RAYS = 8  # rays a pixel that distributed makes in the small budget


def taylor(
    lab: Laboratory,
    report: Report,
    size: tuple[int, int],
    moves: Iterable[str] = ("translation", "scaling", "rotation"),
) -> None:
    """Taylor's comparison: three camera moves, two budgets in ratio 1 : 5, reference 1,000 rays.

    The exposure is the interval between the previous frame and this one, as in the paper.
    The small budget is the time of UNIT_RAYS = 8 rays per pixel; the paper gives 2 s on two
    threads of 2 GHz and no number of rays; a ray tracer of its day shaded one to two million
    rays per second on these, 2 to 4 million in 2 s, 8 to 16 per pixel of a 512 x 512 image;
    the smaller is in favour of reprojection. Sharp frames have one ray a pixel. The cost of
    a ray differs from renderer to renderer, and these rays are well distributed, which his may
    not have been; so the rays per pixel that match reprojection at its best say more
    than the crossing points in time.
    """
    names = ("distributed", "accumulate", "reproject:variant=published", "reproject", "tap")
    candidates = [Candidate.parse(name) for name in names]
    claims, fixed, worth = [], [], []
    for name in moves:
        scene_frame = SceneFrame(builtin.make(name), size=size, antialias=1)
        reference = Candidate("distributed", (("seed", 1),), 1000)
        case = scene_case(name, Shutter(360, "end"), reference, scene_frame, lab.device, lab.tell)
        lab.compare(report, case, candidates, (1, 2, 4, UNIT_RAYS, 16, 5 * UNIT_RAYS), _budgets)
        for metric in ("flip", "psnr"):
            said, rows = _claims(report, case, metric, [c.label for c in candidates])
            claims.append([name, METRICS[metric].title, *said])
            fixed += rows
            worth += _equal_error(report, case, metric)
    labels = [c.label for c in candidates]
    report.tables += [
        Table(
            "Taylor's findings",
            ["scene", "metric", "small budget: better than distributed", "than frame blending",
             "five times the time gains under 10 %", "large budget: distributed is better"],
            claims,
            "Of reprojection as published.",
        ),
        Table("In a fixed time", ["scene", "metric", "budget [ms]", *labels], fixed),
        Table(
            "Where distributed becomes as good as reprojection as published at its best",
            ["scene", "metric", "reprojection's best", "after [ms]", "rays per pixel as good",
             "distributed's time for them [ms]"],
            worth,
            "Reprojection wins where a renderer needs longer for these rays than for one sharp "
            "frame and the reprojection.",
        ),
    ]  # fmt: skip
    report.notes.append(about(taylor))


def _budgets(report: Report, case: Case) -> list[float]:
    unit = next(
        e.seconds or 0.0
        for e in report.of(case.name, kind="samples", label="distributed", samples=UNIT_RAYS)
    )
    return [unit, 5 * unit]


def _claims(
    report: Report, case: Case, metric: str, labels: list[str]
) -> tuple[list[str], list[list[Any]]]:
    """Return the paper's findings as reproduced here, and the numbers behind them."""
    traced, blended, published, *_ = labels
    small, large = _budgets(report, case)
    shown = {(e.label, e.budget): e.measures[metric] for e in report.of(case.name, kind="time")}
    error = {key: _error(metric, value) for key, value in shown.items()}
    title, digits = METRICS[metric].title, METRICS[metric].digits
    rows = [
        [case.name, title, round(1e3 * b, 1), *(round(shown[k, b], digits) for k in labels)]
        for b in (small, large)
    ]
    return [
        holds(error[published, small] < error[traced, small]),
        holds(error[published, small] < error[blended, small]),
        holds(error[published, large] > 0.9 * error[published, small]),
        holds(error[traced, large] < error[published, large]),
    ], rows


def _error(metric: str, value: float) -> float:
    """Something of which less is better, in proportion: of PSNR, the root of the mean square."""
    return 10 ** (-value / 20) if metric.startswith("psnr") else value


def _equal_error(report: Report, case: Case, metric: str) -> list[list[Any]]:
    traced = report.of(case.name, kind="samples", label="distributed")
    rays, times, errors = np.array(
        [(e.samples or 0, e.seconds or 0.0, _error(metric, e.measures[metric])) for e in traced]
    ).T
    published = report.of(case.name, label="reproject, variant published")
    least = min(_error(metric, e.measures[metric]) for e in published)
    near = [e for e in published if _error(metric, e.measures[metric]) < 1.02 * least]
    best = min(near, key=lambda e: e.seconds or 0.0)
    limit, m = _error(metric, best.measures[metric]), METRICS[metric]
    falling = -np.log(np.minimum.accumulate(errors))
    # Errors and times follow powers of the number of rays: straight lines in logarithms.
    enough = np.exp(np.interp(-np.log(limit), falling, np.log(rays)))
    seconds = np.exp(np.interp(np.log(enough), np.log(rays), np.log(times)))
    beyond = limit < np.exp(-falling[-1])
    return [
        [case.name, m.title, round(best.measures[metric], m.digits),
         round(1e3 * (best.seconds or 0.0), 1), f"> {rays[-1]:g}" if beyond else round(enough, 1),
         round(1e3 * seconds, 1)]
    ]  # fmt: skip
