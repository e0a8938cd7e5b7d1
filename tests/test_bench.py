"""The stopwatch: what is timed and written down; how fast is nobody's business here."""

import json

import pytest

import make_frames as make
from wgmb import bench, report
from wgmb.blur import METHODS
from wgmb.compare import Contender
from wgmb.errors import InputError

SIZES = ((64, 36), (96, 54))


@pytest.fixture(scope="module")
def run(device):
    return bench.bench(device, [Contender(m) for m in METHODS], SIZES, (2, 4), rounds=1)


def test_every_method_has_a_figure_for_every_size_and_number(run):
    keys = {f.key for f in run.figures}
    assert keys == {(m, *size, n) for m in METHODS for size in SIZES for n in (2, 4)}
    assert all(f.gpu > 0 for f in run.figures)


def test_methods_of_pictures_have_transfers_and_bytes(run):
    for f in run.figures:
        if "scene" in METHODS[f.method].needs:
            assert (f.call, f.upload, f.readback, f.bytes) == (None, None, None, 0)
        else:
            assert f.call > 0 and f.upload > 0 and f.readback > 0
            # Colour, motion and the output are there at least, 16 bytes a pixel each.
            assert f.bytes >= 48 * f.width * f.height
            assert f.bandwidth == pytest.approx(f.bytes / (f.gpu / 1e3) / 1e9)
    tap, reproject = (next(f for f in run.figures if f.method == m) for m in ("tap", "reproject"))
    assert tap.bytes == 48 * tap.width * tap.height
    assert reproject.bytes == (16 + 3 * 36) * tap.width * tap.height  # three frames with depth


def test_a_copy_has_a_bandwidth(run):
    assert 0.1 < run.copy < 1e5


def test_figures_are_kept_and_compared(run, tmp_path):
    run.save(tmp_path / "kept.json")
    kept = bench.Bench.load(tmp_path / "kept.json")
    assert kept == run
    table = bench.against(run, kept)
    assert len(table.rows) == len(run.figures)
    assert all(row[-2] == 1.0 for row in table.rows)


def test_what_was_not_kept_is_refused(run, tmp_path):
    (tmp_path / "x.json").write_text('{"figures": 3}')
    with pytest.raises(InputError, match=r"x\.json"):
        bench.Bench.load(tmp_path / "x.json")
    with pytest.raises(InputError, match="in common"):
        bench.against(run, bench.Bench({}, 1.0, []))


def test_slower_is_over_one(run):
    slow = [bench.replace(f, gpu=2 * f.gpu) for f in run.figures]
    table = bench.against(bench.Bench(run.machine, run.copy, slow), run)
    assert all(row[-2] == 2.0 for row in table.rows)


def test_text_and_page_tell_every_method(run):
    said = bench.text(run)
    page = report.page(bench.report(run, "wgmb bench", run))
    for method in METHODS:
        assert f", {method}, 4 samples" in said
        assert page.count(f"{method}</td>") >= 4
    assert page.count("<svg") == 2


def test_all_jobs_take_turns():
    order = []
    jobs = {name: lambda n=name: order.append(n) for name in "ab"}
    seconds = bench.alternate(jobs, 3)
    assert order == list("ab" * 4)  # one round for warmth
    assert {k: len(v) for k, v in seconds.items()} == {"a": 3, "b": 3}


def test_the_command_prints_saves_and_compares(tmp_path, capsys):
    command = ["bench", "--methods", "tap", "--size", "64x36", "--samples", "2", "--rounds", 1]
    code, out, _ = make.inside(capsys, *command, "--save", tmp_path / "a.json")
    assert code == 0
    assert "64 x 36, tap, 2 samples" in out
    code, out, _ = make.inside(capsys, *command, "--against", tmp_path / "a.json",
                               "-o", tmp_path / "b.html")  # fmt: skip
    assert code == 0
    assert "now / before" in out
    titles = [t["title"] for t in json.loads((tmp_path / "b.json").read_text())["tables"]]
    assert titles == ["Every method", "Against an earlier run"] or "Every pass" in titles


@pytest.mark.parametrize("options", ["--rounds 0", "--samples x", "--methods smear",
                                     "--against no.json", "--size big"])  # fmt: skip
def test_wrong_usage_is_one_line_and_2(capsys, options):
    code, out, err = make.inside(capsys, "bench", *options.split())
    assert (code, out) == (2, "")
    assert err.startswith("wgmb: ") and err.count("\n") == 1


def test_passes_are_told_where_the_clock_is_believed(device, monkeypatch):
    monkeypatch.setattr(bench.Timing, "usable", lambda device: True)
    run = bench.bench(device, [Contender("tap"), Contender("reproject")], SIZES[:1], (64,), 1)
    for figure in run.figures:
        assert figure.passes
        assert all(v >= 0 for v in figure.passes.values())
    titles = [t.title for t in bench.report(run, "").tables]
    assert titles == ["Every method", "Every pass"]
