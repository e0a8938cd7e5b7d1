"""Chen's experiment: fusion against the tap blur."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...methods import METHODS
from ...metrics import METRICS, display
from ...scene import builtin
from ...shutter import Shutter
from ..cases import Candidate, Case, SceneFrame, scene_case
from ..compare import Laboratory
from ..findings import about, holds
from ..results import Plot, Report, Table

ALPHAS = (0.02, 0.04, 0.06, 0.08, 0.10)  # of figure 5


def chen(lab: Laboratory, report: Report, size: tuple[int, int], moments: int = 8) -> None:
    """Chen's table 1 and figure 5: fusion compared with the tap blur, 8 samples.

    Frame rates over a dive, of the blur alone, and its passes; quality of both against
    distributed:256; alpha from 0.02 to 0.10 against time and amount of blur. Amount of blur is the
    share of the sharp image's gradients that is lost; the truth's own value is given as well.
    """
    if "fusion" not in METHODS:
        raise InputError(f"this experiment needs the method fusion; known: {', '.join(METHODS)}")
    report.samples = 8
    tap, fusion = (Candidate(m, (("variant", "published"),)) for m in ("tap", "fusion"))
    printed = Candidate("fusion", (("variant", "published"), ("weights", "published")))
    both = [tap, fusion, printed, Candidate("tap"), Candidate("fusion")]
    dive, shutter = builtin.make("scaling"), Shutter(180)
    seconds: dict[str, list[float]] = {c.label: [] for c in both}
    passes: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for k in range(moments):
        scene_frame = SceneFrame(dive, time=k / 24, size=size)
        frame = scene_frame.frame(lab.device)
        case = Case("dive", frame, shutter, frame.color, "", scene_frame)
        lab.tell(f"dive, moment {k + 1} of {moments}")
        blurs = {c: c.blur(8, shutter, lab.device) for c in both}
        for c, by_label in lab.passes(case, blurs).items():  # compiles
            for label, pass_ in by_label.items():
                passes.setdefault((c.label, label), []).append(pass_)
        timers = [lab.timer(case, blur, c) for c, blur in blurs.items()]
        for c, s in zip(both, lab.least(timers), strict=True):
            seconds[c.label].append(s)
    rows = [
        [name, *(round(f(1 / np.array(s)), 1) for f in (np.min, np.max, np.mean)),
         round(1e3 * float(np.mean(s)), 2)]
        for name, s in seconds.items()
    ]  # fmt: skip
    faster = np.mean(seconds[tap.label]) / np.mean(seconds[fusion.label])
    report.tables.append(
        Table(
            "Table 1: frames per second of the blur over a dive",
            ["method", "least", "most", "mean", "mean [ms]"],
            rows,
            f"The paper has 62, 71, 65.5 for the tap blur and 73, 82, 77.5 for its own, 1.18 times "
            f"as fast. Here its own is {faster:.2f} times as fast as the tap blur: the paper's "
            f"finding {holds(faster > 1.05)}.",
        )
    )
    report.tables.append(_by_pass(lab, passes, tap.label))
    quality: list[list[Any]] = []
    for name in ("scaling", "crossing"):
        scene_frame = SceneFrame(builtin.make(name), size=size)
        reference = Candidate("distributed", (("seed", 1),), 256)
        case = scene_case(name, shutter, reference, scene_frame, lab.device, lab.tell)
        lab.compare(report, case, both, (4, 8, 16))
        judged = [e for e in report.of(case.name) if e.kind in ("sharp", "floor") or
                  (e.kind, e.samples) == ("samples", report.samples)]  # fmt: skip
        quality += [
            [name, e.label, *(round(e.measures[m], METRICS[m].digits) for m in METRICS)]
            for e in judged
        ]
        _facing(lab, report, case)
        _alphas(lab, report, case)
    columns = ["scene", "method", *(m.title for m in METRICS.values())]
    report.tables.insert(2, Table("Quality at 8 samples", columns, quality))
    report.notes.append(about(chen))


def _by_pass(
    lab: Laboratory, passes: dict[tuple[str, str], list[tuple[int, float]]], tap: str
) -> Table:
    """Table 1 by method and pass, over all moments; in proportion to all passes of `tap`."""
    median = {key: float(np.median([s for _, s in found])) for key, found in passes.items()}
    whole: dict[str, float] = {}
    for (method, _), s in median.items():
        whole[method] = whole.get(method, 0.0) + s
    rows: list[list[Any]] = []
    for method, total in whole.items():
        parts = [(label, passes[method, label][0][0], s)
                 for (m, label), s in median.items() if m == method]  # fmt: skip
        rows += [
            [
                method,
                label,
                times,
                round(1e3 * s, 2),
                round(s / whole[tap], 2) if whole[tap] else None,
            ]
            for label, times, s in [*parts, ("all", sum(t for _, t, _ in parts), total)]
        ]
    columns = ["method", "pass", "times", "median [ms]", "to the tap blur's"]
    note = f"By {lab.clock.name}, each pass by itself. Sums exclude the time between passes."
    return Table("Table 1, pass by pass", columns, rows, note)


def _alphas(lab: Laboratory, report: Report, case: Case) -> None:
    """Figure 5: alpha of all faces against time and amount of blur."""
    curves: dict[str, list[tuple[float, float]]] = {}
    rows = []
    for weights in ("normalised", "published"):
        candidates = [
            Candidate("fusion", (("weights", weights), ("alpha_back", alpha))) for alpha in ALPHAS
        ]
        blurs = [c.blur(8, case.shutter, lab.device) for c in candidates]
        pictures = [lab.picture(case, b, c) for b, c in zip(blurs, candidates, strict=True)]
        times = lab.least([lab.timer(case, b, c) for b, c in zip(blurs, candidates, strict=True)])
        for alpha, picture, s in zip(ALPHAS, pictures, times, strict=True):
            amount = _gone(picture, case)
            error = METRICS["flip"].compute(picture, case.truth)
            rows.append([weights, f"{alpha:g} / 0.08", round(1e3 * s, 2), round(amount, 3),
                         round(error, 4)])  # fmt: skip
            curves.setdefault(f"amount of blur, {weights}", []).append((alpha, amount))
    curves["the truth's"] = [(a, _gone(case.truth, case)) for a in (ALPHAS[0], ALPHAS[-1])]
    columns = ["weights", "alpha back / front", "time [ms]", "amount of blur", "FLIP"]
    report.tables.append(Table(f"Figure 5, {case.name}: alpha", columns, rows))
    report.plots.append(
        Plot(f"Figure 5, {case.name}", "alpha of trailing faces", "amount of blur", curves, False)
    )


def _facing(lab: Laboratory, report: Report, case: Case) -> None:
    """Measure the cost or gain of separate weights for leading and trailing faces."""
    names = {"front 0.08, back 0.04": (0.08, 0.04), "all faces 0.04": (0.04, 0.04),
             "all faces 0.08": (0.08, 0.08)}  # fmt: skip
    candidates = [
        Candidate("fusion", (("alpha_front", a), ("alpha_back", b)), name=name)
        for name, (a, b) in names.items()
    ]
    blurs = [c.blur(8, case.shutter, lab.device) for c in candidates]
    pictures = [lab.picture(case, b, c) for b, c in zip(blurs, candidates, strict=True)]
    times = lab.least([lab.timer(case, b, c) for b, c in zip(blurs, candidates, strict=True)])
    passes = lab.passes(case, dict(zip(candidates, blurs, strict=True)))
    rows = [
        [c.label, round(1e3 * s, 2), round(_gone(p, case), 3),
         *(round(METRICS[m].compute(p, case.truth), 4) for m in ("flip", "psnr")),
         *(round(1e3 * t, 2) for _, t in passes[c].values())]
        for c, p, s in zip(candidates, pictures, times, strict=True)
    ]  # fmt: skip
    columns = ["alpha", "time [ms]", "amount of blur", "FLIP", "PSNR"]
    columns += [f"{label} [ms]" for label in passes[candidates[0]]]
    report.tables.append(Table(f"{case.name}: front and back told apart", columns, rows))


def _gone(picture: np.ndarray, case: Case) -> float:
    """The share of the sharp frame's gradients that a picture has lost."""

    def slopes(p: np.ndarray) -> float:
        shown = display(p)
        return float(sum(np.abs(np.diff(shown, axis=axis)).sum() for axis in (0, 1)))

    return 1 - slopes(picture) / slopes(case.frame.color)
