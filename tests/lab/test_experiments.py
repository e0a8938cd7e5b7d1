"""The papers' experiments run, and read their findings off their figures."""

import importlib.util
import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from wgmb.errors import InputError
from wgmb.lab import compare, report, results
from wgmb.lab.cases import Case
from wgmb.lab.papers import experiments
from wgmb.lab.papers.chen import ALPHAS
from wgmb.lab.papers.rosado import TAPS
from wgmb.lab.papers.taylor import _equal_error
from wgmb.lab.results import Entry, Report
from wgmb.methods import METHODS
from wgmb.metrics import METRICS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def lab(device):
    return compare.Laboratory(device, rounds=1)


def made(lab, name, size=(48, 32), **options):
    found = Report(name, "", results.machine(lab.device), 16)
    experiments.EXPERIMENTS[name](lab, found, size, **options)
    assert "<svg" in report.page(found)
    for table in found.tables:
        assert all(len(row) == len(table.columns) for row in table.rows)
    return found


@pytest.fixture(scope="module")
def taylor(lab):
    return made(lab, "taylor", moves=["rotation"])


@pytest.fixture(scope="module")
def chen(lab):
    return made(lab, "chen", moments=2)


@pytest.mark.full
def test_taylor_has_two_budgets_and_his_findings(taylor):
    found = taylor
    (case,) = found.cases
    small, large = sorted({e.budget for e in found.of(case.name, kind="time")})
    assert large == pytest.approx(5 * small)
    assert case.shutter.span == (-1, 0)  # from the previous frame to this one
    claims, fixed, worth = found.tables
    assert len(claims.rows) == len(worth.rows) == 2
    assert {v for row in claims.rows for v in row[2:]} <= {"holds", "does not hold"}
    assert len(fixed.rows) == 4


@pytest.mark.full
@pytest.mark.parametrize("metric", ["flip", "psnr"])
def test_taylors_verdicts_are_those_of_the_figures(taylor, metric):
    """The verdicts depend on the speed of the machine; their truth does not."""

    def error(name, budget):
        (entry,) = taylor.of("rotation", label=name, kind="time", budget=budget)
        value = entry.measures[metric]
        return value if metric == "flip" else np.sqrt(10 ** (-value / 10))

    published, distributed = "reproject, variant published", "distributed"
    small, large = sorted({e.budget for e in taylor.of("rotation", kind="time")})
    want = [
        error(published, small) < error(distributed, small),
        error(published, small) < error("accumulate", small),
        1 - error(published, large) / error(published, small) < 0.1,
        error(distributed, large) < error(published, large),
    ]
    (said,) = (r[2:] for r in taylor.tables[0].rows if r[1] == METRICS[metric].title)
    assert said == ["holds" if it else "does not hold" for it in want]


@pytest.mark.full
def test_taylors_reprojection_gains_little_by_more_samples_and_distributed_gains_much(taylor):
    """His finding, at equal samples, where no clock has a say."""

    def flip(name, samples):
        (entry,) = taylor.of("rotation", label=name, kind="samples", samples=samples)
        return entry.measures["flip"]

    published, distributed = "reproject, variant published", "distributed"
    assert flip(published, 1) < 0.8 * flip("accumulate", 1)
    assert flip(published, 1) < 0.8 * flip(distributed, 1)
    assert 0.9 * flip(published, 8) < flip(published, 40) < 1.1 * flip(published, 8)
    rays = [flip(distributed, n) for n in (1, 2, 4, 8, 16, 40)]
    assert all(more < 0.8 * fewer for fewer, more in itertools.pairwise(rays))
    assert rays[-1] < 0.4 * flip(published, 40)


@pytest.mark.full
def test_chen_compares_rates_faces_and_alphas(chen):
    found = chen
    titles = [t.title for t in found.tables]
    assert titles[:3] == ["Table 1: frames per second of the blur over a dive",
                          "Table 1, pass by pass", "Quality at 8 samples"]  # fmt: skip
    by_pass, quality = found.tables[1:3]
    for method in ("tap, variant published", "fusion, variant published"):
        rows = [row for row in by_pass.rows if row[0] == method]
        *parts, (_, name, times, whole, ratio) = rows
        assert (name, times) == ("all", sum(row[2] for row in parts))
        assert whole == pytest.approx(sum(row[3] for row in parts), abs=0.03)
        assert ratio == 1 or method.startswith("fusion")
    assert {"methods/fusion_gaussian.wgsl:main", "methods/fusion.wgsl:main"} <= {
        row[1] for row in by_pass.rows
    }
    for scene in ("scaling", "crossing"):
        rows = {row[1]: row[2:] for row in quality.rows if row[0] == scene}
        assert {"sharp", "noise floor", "tap, variant published", "fusion"} <= rows.keys()
        assert min(rows, key=lambda name: rows[name][0]) == "noise floor"
    for scene in ("scaling", "crossing"):
        (figure,) = (t for t in found.tables if t.title == f"Figure 5, {scene}: alpha")
        assert len(figure.rows) == 2 * len(ALPHAS)
        faces = next(t for t in found.tables if t.title.startswith(f"{scene}: front and back"))
        assert len({row[2] for row in faces.rows}) > 1  # telling faces apart changes the blur
        assert faces.columns[-2:] == [
            "methods/fusion_gaussian.wgsl:main [ms]",
            "methods/fusion.wgsl:main [ms]",
        ]


@pytest.mark.full
def test_chens_verdict_is_that_of_the_rates(chen):
    rates = chen.tables[0]
    milliseconds = {row[0]: row[-1] for row in rates.rows}
    times = milliseconds["tap, variant published"] / milliseconds["fusion, variant published"]
    said = re.search(
        r"its own is ([\d.]+) times as fast.* finding (holds|does not hold)", rates.note
    )
    assert float(said[1]) == pytest.approx(times, abs=0.02)
    if abs(times - 1.05) > 0.02:
        assert said[2] == ("holds" if times > 1.05 else "does not hold")


@pytest.mark.full
@pytest.mark.parametrize("scene", ["scaling", "crossing"])
def test_chens_printed_weights_brighten_instead_of_blurring(chen, scene):
    """Normalised, they take gradients away as the truth does; as printed they add to them."""
    (figure,) = (t for t in chen.tables if t.title == f"Figure 5, {scene}: alpha")
    (plot,) = (p for p in chen.plots if p.title == f"Figure 5, {scene}")
    (truth,) = {amount for _, amount in plot.curves["the truth's"]}
    for weights in ("normalised", "published"):
        amounts, errors = ([row[i] for row in figure.rows if row[0] == weights] for i in (3, 4))
        if weights == "normalised":
            assert all(0.3 * truth < amount < 3 * truth for amount in amounts)
        else:
            assert all(amount < 0 for amount in amounts)
            assert errors == sorted(errors) and errors[-1] > 1.1 * errors[0]


@pytest.mark.full
def test_the_page_of_experiments_takes_its_tables_from_reports(chen):
    found = report.as_json(chen)
    spec = importlib.util.spec_from_file_location("gallery", ROOT / "tools" / "gallery.py")
    docs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(docs)
    text = (ROOT / "docs" / "laboratory" / "experiments.md").read_text(encoding="utf-8")
    places = re.findall(r"<!-- (.+?) -->\n", text)
    tables = {t["title"]: t for t in found["tables"]}
    assert places and set(places) <= tables.keys()
    filled = docs.fill(text, [found])
    for title in places:
        lines = filled.partition(f"<!-- {title} -->\n")[2].partition("<!-- -->")[0].splitlines()
        assert len(lines) == 2 + len(tables[title]["rows"])
        assert lines[0] == f"| {' | '.join(tables[title]['columns'])} |"
        assert str(tables[title]["rows"][-1][-1]) in lines[-1]
    assert docs.fill(filled, [found]) == filled
    assert docs.fill(text, []) == text


def test_chen_without_fusion_says_so(lab, monkeypatch):
    monkeypatch.delitem(METHODS._loaded, "fusion")
    with pytest.raises(InputError, match="needs the method fusion"):
        made(lab, "chen")


@pytest.mark.full
def test_rosado_finds_that_the_mask_or_the_velocity_buffer_helps(lab):
    found = made(lab, "rosado", (160, 90))
    error = {row[0]: row[3] for row in found.tables[0].rows}
    assert error["camera only, mask"] < error["camera only"]
    assert error["velocity buffer"] < error["camera only"]
    assert error["velocity buffer, mask"] < error["velocity buffer"]
    (plot,) = found.plots
    assert [n for n, _ in plot.curves["velocity buffer"]] == sorted({*TAPS, 16})


@pytest.mark.parametrize(("limit", "rays"), [(0.2, 4.0), (0.1, 16.0), (0.05, "> 16")])
def test_worth_in_rays_is_read_off_the_curve(limit, rays):
    """Error 0.4 / sqrt(rays), time 10 ms a ray."""
    case = Case("x", None, None, None, "")  # pyright: ignore[reportArgumentType]
    entries = [Entry("x", "distributed", "samples", {"flip": 0.4 / np.sqrt(n)}, n, 0.01 * n)
               for n in (1, 2, 8, 16)]  # fmt: skip
    entries += [Entry("x", "reproject, variant published", "samples", {"flip": error}, n, 0.001 * n)
                for n, error in ((1, 2 * limit), (8, 1.01 * limit), (16, limit))]  # fmt: skip
    ((_, _, best, after, enough, _),) = _equal_error(
        Report("", "", {}, 1, entries=entries), case, "flip"
    )
    assert (best, after) == (round(1.01 * limit, 4), 8.0)  # the first that is nearly its best
    assert enough == (pytest.approx(rays, rel=0.03) if rays != "> 16" else rays)
