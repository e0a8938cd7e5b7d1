"""The papers' own experiments, repeated to check their findings.

Each takes a Laboratory, an empty Report and a picture size, and fills the report.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..frame import Frame
from ..methods import METHODS
from ..metrics import METRICS, display
from ..scene import builtin
from ..scene.bodies import Body, moving
from ..scene.scene import CameraPath, Scene
from ..shutter import Shutter
from .cases import Candidate, Case, SceneFrame, scene_case
from .compare import Laboratory
from .results import Plot, Report, Table

UNIT_RAYS = 8  # taylor: rays a pixel that distributed makes in the small budget
ALPHAS = (0.02, 0.04, 0.06, 0.08, 0.10)  # chen, figure 5
TAPS = (4, 8, 12, 16, 24, 32)  # rosado


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
    the smaller is in favour of reprojection. Sharp frames have one ray a pixel. What a ray
    costs differs from renderer to renderer, and these rays are well distributed, which his may
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
            worth += _worth(report, case, metric)
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
    report.notes.append(_about(taylor))


def _about(experiment: Callable) -> str:
    """Its docstring, as one paragraph."""
    return " ".join((experiment.__doc__ or "").split())


def _budgets(report: Report, case: Case) -> list[float]:
    unit = next(
        e.seconds or 0.0
        for e in report.of(case.name, kind="samples", label="distributed", samples=UNIT_RAYS)
    )
    return [unit, 5 * unit]


def _claims(
    report: Report, case: Case, metric: str, labels: list[str]
) -> tuple[list[str], list[list]]:
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
        _holds(error[published, small] < error[traced, small]),
        _holds(error[published, small] < error[blended, small]),
        _holds(error[published, large] > 0.9 * error[published, small]),
        _holds(error[traced, large] < error[published, large]),
    ], rows


def _error(metric: str, value: float) -> float:
    """Something of which less is better, in proportion: of PSNR, the root of the mean square."""
    return 10 ** (-value / 20) if metric.startswith("psnr") else value


def _worth(report: Report, case: Case, metric: str) -> list[list]:
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


def _holds(it: object) -> str:
    return "holds" if it else "does not hold"


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
        for c, found in lab.passes(case, blurs).items():  # compiles
            for label, pass_ in found.items():
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
            f"finding {_holds(faster > 1.05)}.",
        )
    )
    report.tables.append(_by_pass(lab, passes, tap.label))
    quality: list[list] = []
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
    report.notes.append(_about(chen))


def _by_pass(
    lab: Laboratory, passes: dict[tuple[str, str], list[tuple[int, float]]], tap: str
) -> Table:
    """Table 1 by method and pass, over all moments; in proportion to all passes of `tap`."""
    median = {key: float(np.median([s for _, s in found])) for key, found in passes.items()}
    whole: dict[str, float] = {}
    for (method, _), s in median.items():
        whole[method] = whole.get(method, 0.0) + s
    rows: list[list] = []
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

    def slopes(p) -> float:
        shown = display(p)
        return float(sum(np.abs(np.diff(shown, axis=axis)).sum() for axis in (0, 1)))

    return 1 - slopes(picture) / slopes(case.frame.color)


def rosado(lab: Laboratory, report: Report, size: tuple[int, int]) -> None:
    """Rosado's choices: what a tap costs, camera-only or velocity buffer, with and without mask.

    A car-like box drives before a camera that follows it, while a ball crosses. Camera-only
    motion blurs the box, which should stay sharp; the chapter masks it; a velocity buffer
    knows that it stands still in the picture.
    """
    scene_frame = SceneFrame(_chase(), size=size)
    reference = Candidate("distributed", (("seed", 1),), 256)
    case = scene_case("chase", Shutter(180), reference, scene_frame, lab.device, lab.tell)
    candidates = [
        Candidate("tap", name="camera only", given=_camera_only),
        Candidate("tap", name="camera only, mask", given=lambda f: _camera_only(_masked(f))),
        Candidate("tap", name="velocity buffer"),
        Candidate("tap", name="velocity buffer, mask", given=_masked),
    ]
    lab.compare(report, case, candidates, TAPS)
    rows, curves = [], {}
    for c in candidates:
        entries = report.of(case.name, kind="samples", label=c.label)
        points = [(e.samples or 0, 1e3 * ((e.seconds or 0.0) - e.frame_seconds)) for e in entries]
        taps, times = np.array(points, float).T
        slope, start = np.polyfit(taps, times, 1)
        at = next(e for e in entries if e.samples == report.samples)
        rows.append([c.label, round(slope, 3), round(start, 2),
                     *(round(at.measures[m], 4) for m in ("flip", "psnr"))])  # fmt: skip
        curves[c.label] = points
    columns = ["motion", "a tap [ms]", "without taps [ms]", "FLIP", "PSNR"]
    note = f"{size[0]} x {size[1]}; a straight line through {min(TAPS)} to {max(TAPS)} taps."
    report.tables.append(Table("What a tap costs, and what it is given", columns, rows, note))
    report.plots.append(Plot("Time against taps", "taps", "ms of the blur alone", curves, False))
    report.notes.append(_about(rosado))


def _chase(speed: float = 9.0) -> Scene:
    """A box that a camera follows through the hall, and a ball that crosses."""
    hall = builtin.make("translation")
    box = Body("box", (0.4, 0.28, 0.5), moving((0, 0.35, -1.0), (speed, 0, 0)),
               (0.72, 0.10, 0.07), (0.9, 0.85, 0.75), "CHECKER", (3, 3))  # fmt: skip
    ball = Body("sphere", (0.4, 0.4, 0.4), moving((1.3, 1.2, -2.2), (-4, 0, 0)),
                (0.08, 0.45, 0.46), (0.9, 0.85, 0.75), "STRIPES", (12, 1))  # fmt: skip
    camera = CameraPath(lambda t: (speed * t, 1.3, 2.2), pitch=lambda t: -0.07 + 0 * t)
    return replace(hall, name="chase", bodies=(*hall.bodies, box, ball), camera=camera)


def _camera_only(frame: Frame) -> Frame:
    return replace(frame, object_id=None, prev=None, next=None)


def _masked(frame: Frame) -> Frame:
    """Keep the body that is seen in the middle, below: the box."""
    assert frame.object_id is not None
    height, width = frame.color.shape[:2]
    box = frame.object_id[int(0.72 * height), width // 2]
    holdout = (frame.object_id == box).astype(np.float32)
    return replace(frame, holdout=holdout, prev=None, next=None)


EXPERIMENTS: dict[str, Callable[[Laboratory, Report, tuple[int, int]], None]] = {
    "taylor": taylor,
    "chen": chen,
    "rosado": rosado,
}
