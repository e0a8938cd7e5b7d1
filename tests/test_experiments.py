"""The papers' experiments run, and read their findings off their figures."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from wgmb import compare, experiments, findings, report
from wgmb.cases import Case
from wgmb.errors import InputError
from wgmb.findings import Entry, Report

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def lab(device):
    return compare.Laboratory(device, rounds=1)


def made(lab, name, size=(48, 32), **options):
    found = Report(name, "", findings.machine(lab.device), 16)
    experiments.EXPERIMENTS[name](lab, found, size, **options)
    assert "<svg" in report.page(found)
    for table in found.tables:
        assert all(len(row) == len(table.columns) for row in table.rows)
    return found


def test_taylor_has_two_budgets_and_his_findings(lab):
    found = made(lab, "taylor", moves=["rotation"])
    (case,) = found.cases
    small, large = sorted({e.budget for e in found.of(case.name, kind="time")})
    assert large == pytest.approx(5 * small)
    assert case.shutter.span == (-1, 0)  # from the previous frame to this one
    claims, fixed, worth = found.tables
    assert len(claims.rows) == len(worth.rows) == 2
    assert {v for row in claims.rows for v in row[2:]} <= {"holds", "does not hold"}
    assert len(fixed.rows) == 4


def test_chen_compares_rates_faces_and_alphas(lab):
    found = made(lab, "chen", moments=2)
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
    assert {"gaussian.wgsl:main", "blur/fusion.wgsl:main"} <= {row[1] for row in by_pass.rows}
    for scene in ("scaling", "crossing"):
        rows = {row[1]: row[2:] for row in quality.rows if row[0] == scene}
        assert {"sharp", "noise floor", "tap, variant published", "fusion"} <= rows.keys()
        assert min(rows, key=lambda name: rows[name][0]) == "noise floor"
    for scene in ("scaling", "crossing"):
        (figure,) = (t for t in found.tables if t.title == f"Figure 5, {scene}: alpha")
        assert len(figure.rows) == 2 * len(experiments.ALPHAS)
        faces = next(t for t in found.tables if t.title.startswith(f"{scene}: front and back"))
        assert len({row[2] for row in faces.rows}) > 1  # telling faces apart changes the blur
        assert faces.columns[-2:] == ["gaussian.wgsl:main [ms]", "blur/fusion.wgsl:main [ms]"]


def test_the_page_of_experiments_takes_its_tables_from_reports(lab):
    found = report.as_json(made(lab, "chen", moments=1))
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
    monkeypatch.delitem(experiments.METHODS, "fusion")
    with pytest.raises(InputError, match="needs the method fusion"):
        made(lab, "chen")


def test_rosado_finds_that_the_mask_or_the_velocity_buffer_helps(lab):
    found = made(lab, "rosado", (160, 90))
    error = {row[0]: row[3] for row in found.tables[0].rows}
    assert error["camera only, mask"] < error["camera only"]
    assert error["velocity buffer"] < error["camera only"]
    (plot,) = found.plots
    assert [n for n, _ in plot.curves["velocity buffer"]] == sorted({*experiments.TAPS, 16})


@pytest.mark.parametrize(("limit", "rays"), [(0.2, 4.0), (0.1, 16.0), (0.05, "> 16")])
def test_worth_in_rays_is_read_off_the_curve(limit, rays):
    """Error 0.4 / sqrt(rays), time 10 ms a ray."""
    case = Case("x", None, None, None, "")  # pyright: ignore[reportArgumentType]
    entries = [Entry("x", "distributed", "samples", {"flip": 0.4 / np.sqrt(n)}, n, 0.01 * n)
               for n in (1, 2, 8, 16)]  # fmt: skip
    entries += [Entry("x", "reproject, variant published", "samples", {"flip": error}, n, 0.001 * n)
                for n, error in ((1, 2 * limit), (8, 1.01 * limit), (16, limit))]  # fmt: skip
    ((_, _, best, after, enough, _),) = experiments._worth(
        Report("", "", {}, 1, entries=entries), case, "flip"
    )
    assert (best, after) == (round(1.01 * limit, 4), 8.0)  # the first that is nearly its best
    assert enough == (pytest.approx(rays, rel=0.03) if rays != "> 16" else rays)
