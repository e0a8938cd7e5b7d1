"""The stopwatch: what is timed and written down; how fast is nobody's business here."""

import json
import re
import runpy
import signal
from dataclasses import replace
from pathlib import Path

import pytest

import make_frames as make
from wgmb.cli import app
from wgmb.errors import InputError
from wgmb.gpu import timing
from wgmb.lab import bench, bench_figures, bench_report, report
from wgmb.lab.cases import Candidate
from wgmb.lab.results import Bars
from wgmb.methods import METHODS

SIZES = ((64, 36), (96, 54))


@pytest.fixture(scope="module")
def run(device):
    return bench.bench(device, [Candidate(m) for m in METHODS], SIZES, (2, 4), rounds=1)


@pytest.mark.full
def test_every_method_has_a_figure_for_every_size_and_number(run):
    keys = {f.key for f in run.figures}
    assert keys == {(m, *size, n) for m in METHODS for size in SIZES for n in (2, 4)}
    assert all(f.wall > 0 and f.gpu >= 0 for f in run.figures)


@pytest.mark.full
def test_methods_of_pictures_have_transfers_and_bytes(run):
    for f in run.figures:
        if "scene" in METHODS[f.method].needs:
            assert (f.call, f.upload, f.readback, f.record, f.bytes) == (None,) * 4 + (0,)
            assert f.gpu == pytest.approx(f.summed)  # submitted by itself, in portions
        else:
            assert min(f.wall, f.upload, f.readback) > 0 and f.gpu >= 0
            assert 0 < f.record < f.wall
            assert f.call > f.upload + f.readback
            # Colour, motion and the output are there at least, 16 bytes a pixel each.
            assert f.bytes >= 48 * f.width * f.height
            if f.gpu:  # too short for a wall clock, it may be 0
                assert f.bandwidth == pytest.approx(f.bytes / (f.gpu / 1e3) / 1e9)
    tap, reproject = (next(f for f in run.figures if f.method == m) for m in ("tap", "reproject"))
    assert tap.bytes == 48 * tap.width * tap.height
    assert reproject.bytes == (16 + 3 * 36) * tap.width * tap.height  # three frames with depth


def test_a_copy_has_a_bandwidth(run):
    assert 0.1 < run.copy < 1e5


def test_figures_are_kept_and_compared(run, tmp_path):
    run.save(tmp_path / "kept.json")
    kept = bench_figures.Bench.load(tmp_path / "kept.json")
    assert kept == run
    table = bench_report.against(run, kept)
    assert len(table.rows) == len(run.figures)
    assert all(row[-2] == 1.0 for row in table.rows)


def test_what_was_not_kept_is_refused(run, tmp_path):
    (tmp_path / "x.json").write_text('{"figures": 3}')
    with pytest.raises(InputError, match=r"x\.json"):
        bench_figures.Bench.load(tmp_path / "x.json")


def test_a_bench_of_other_fields_is_refused_in_one_line(run, tmp_path, capsys):
    """Files of other versions are no saved benches of this one."""
    run.save(tmp_path / "old.json")
    data = json.loads((tmp_path / "old.json").read_text())
    for change in ({"figures": [{k: v for k, v in f.items() if k != "wall"}
                                for f in data["figures"]]},
                   {"figures": [f | {"frame": 1.0} for f in data["figures"]]},
                   {"videos": [{"flow": "none"}]}):  # fmt: skip
        (tmp_path / "old.json").write_text(json.dumps(data | change))
        code, out, err = make.inside(capsys, "bench", "--against", tmp_path / "old.json")
        assert (code, out) == (2, "")
        assert "old.json: not a saved bench" in err and err.count("\n") == 1


def test_another_run_with_nothing_in_common_says_so(run):
    table = bench_report.against(run, bench_figures.Bench({}, 1.0, []))
    assert not table.rows and "in common" in table.note


@pytest.mark.parametrize("arguments, named", [
    (["--methods", "tap:32"], "tap:32"),
    (["--methods", "tap,tap"], "twice"),
    (["-o", "x.txt"], "x.txt"),
    (["-o", "missing/x.html"], "missing"),
    (["--save", "missing/x.json"], "missing"),
    (["-o", "x.html", "--save", "x.json"], "x.json"),
])  # fmt: skip
def test_wrong_usage_is_said_before_the_work(tmp_path, monkeypatch, capsys, arguments, named):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bench, "bench", lambda *a: pytest.fail("measured"))
    assert app.main(["bench", "--size", "64x36", *arguments]) == 2
    assert named in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_slower_is_over_one(run):
    slow = [replace(f, wall=2 * f.wall) for f in run.figures]
    table = bench_report.against(bench_figures.Bench(run.machine, run.copy, slow), run)
    assert all(row[-2] == 2.0 for row in table.rows)


def test_text_and_page_tell_every_method(run):
    said = bench_report.text(run)
    page = report.page(bench_report.report(run, "wgmb bench", run))
    for method in METHODS:
        assert f", {method}, 4 samples" in said
        assert page.count(f"{method}</td>") >= 4
    several = {f.method for f in run.figures if len(f.passes) > 1}
    assert {"tiles", "gather", "reproject", "accumulate"} <= several
    groups = {(f.size, f.samples) for f in run.figures}
    assert page.count("<svg") == len(groups) + 2 + len(several)
    assert "upload + frame + readback" in said and "bandwidth, at least" in said
    assert "methods/accumulate.wgsl:main x 4" in said


@pytest.mark.fast
def test_bars_are_as_long_as_their_parts():
    bars = Bars("times", "ms", {"tap": {"upload": 1.0, "GPU": 2.0}, "gather": {"GPU": 6.0}})
    drawing = report.bars_svg(bars, {"upload": "red", "GPU": "blue"})
    found = re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)"', drawing)
    (left, _, one), (middle, _, two), (_, below, six) = (map(float, rect) for rect in found)
    assert (two, six) == (pytest.approx(2 * one, abs=0.3), pytest.approx(6 * one, abs=0.6))
    assert middle == pytest.approx(left + one, abs=0.1) and below > 0
    assert ">3 ms</text>" in drawing and ">6 ms</text>" in drawing


def test_without_entries_the_tables_are_the_csv(run):
    every, passes = report.as_csv(bench_report.report(run, "")).split("\n\n")
    assert len(every.splitlines()) == 1 + len(run.figures)
    assert len(passes.splitlines()) == 1 + sum(len(f.passes) for f in run.figures)
    assert passes.startswith("method,size,samples,pass,times")


def test_all_jobs_take_turns():
    order = []
    jobs = {name: lambda n=name: order.append(n) for name in "ab"}
    seconds = timing.alternate(jobs, 3)
    assert order == list("ab" * 4)  # one round for warmth
    assert {k: len(v) for k, v in seconds.items()} == {"a": 3, "b": 3}


def test_a_job_that_has_used_up_its_limit_is_not_repeated(monkeypatch):
    monkeypatch.setattr(timing, "_seconds", lambda job: job())
    jobs = {"quick": lambda: 1, "slow": lambda: 5, "slowest": lambda: 20}
    seconds = timing.alternate(jobs, 3, limit=12)  # the round for warmth is spent too
    assert seconds == {"quick": [1, 1, 1], "slow": [5, 5], "slowest": [20]}


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
    assert titles == ["Every method", "Every pass", "Against an earlier run"]


def test_a_video_has_a_rate_and_counts_of_a_picture(device, tmp_path):
    run = bench.bench(device, [], SIZES[:1], (), rounds=2, flows=["none"])
    (one,) = run.videos
    assert (one.key, one.pictures) == (("none", *SIZES[0]), 2)
    assert min(one.rate, one.thread, one.counts["waits"]) > 0 and one.counts["passes"] == 2
    made = bench_report.report(run, "", run)
    assert "video, flow none" in bench_report.text(run)
    assert "2 passes, " in bench_report.text(run)
    assert [row[0] for row in made.tables[2].rows] == ["none"] and made.tables[2].title == "Videos"
    assert [row[-2] for row in made.tables[-1].rows] == [1.0]  # against itself
    run.save(tmp_path / "kept.json")
    assert bench_figures.Bench.load(tmp_path / "kept.json") == run
    assert report.page(made).count("none</td>") >= 1


@pytest.mark.full
def test_a_video_whose_motion_is_searched_has_more_passes(device):
    run = bench.bench(device, [], SIZES[:1], (), rounds=1, flows=["none", "search:draft"])
    assert [v.flow for v in run.videos] == ["none", "search:draft"]
    assert 2 * run.videos[0].counts["passes"] < run.videos[1].counts["passes"]


def test_a_video_that_takes_long_has_fewer_pictures(device):
    run = bench.bench(device, [], SIZES[:1], (), rounds=4, flows=["none"], limit=1e-9)
    assert run.videos[0].pictures == 1


@pytest.mark.parametrize("options, wanted", [
    ([], (True, ["auto"])), (["--methods", "tap"], (True, [])),
    (["--flow", "none,dis:fast,none"], (False, ["none", "dis:fast"])),
    (["--flow", "none", "--methods", "tap"], (True, ["none"])),
])  # fmt: skip
def test_methods_videos_or_both_are_timed(monkeypatch, capsys, options, wanted):
    """Without a choice, both are."""
    asked = []

    def measure(device, candidates, sizes, counts, rounds, seconds, say, flows):
        asked.append((bool(candidates), flows))
        return bench_figures.Bench({"adapter": "none"}, 1.0, [])

    monkeypatch.setattr(bench, "bench", measure)
    assert app.main(["bench", *options]) == 0
    assert asked == [wanted]


@pytest.mark.parametrize("options", ["--flow smear", "--flow search:worst", "--flow dis:draft",
                                     "--rounds 0", "--samples x", "--methods smear",
                                     "--against no.json", "--size big", "--seconds 0"])  # fmt: skip
def test_wrong_usage_is_one_line_and_2(capsys, options):
    code, out, err = make.inside(capsys, "bench", "--size", "64x36", *options.split())
    assert (code, out) == (2, "")
    assert err.startswith("wgmb: ") and err.count("\n") == 1


def test_every_method_has_its_passes(run):
    for figure in run.figures:
        assert figure.passes.keys() == figure.counts.keys()
        assert any(label.startswith(f"methods/{figure.method}") for label in figure.passes)
    every = bench_report.report(run, "").tables[1]
    assert len(every.rows) == sum(len(f.passes) for f in run.figures)
    for f in run.figures:
        shares = [row[-1] for row in every.rows if row[:3] == bench_report._first(f)]
        if any(f.passes.values()):  # too short for a wall clock, all may be 0
            assert sum(shares) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("usable", [True, False])
def test_both_clocks_tell_the_same_passes(device, monkeypatch, usable):
    monkeypatch.setattr(timing.TimestampClock, "usable", staticmethod(lambda device: usable))
    several = [Candidate(m) for m in ("tap", "tiles", "gather", "accumulate")]
    run = bench.bench(device, several, SIZES[:1], (3,), 1)
    assert run.clock == ("timestamps" if usable else "wall clock")
    assert run.clock.split()[-1] in bench_report.report(run, "").tables[1].note
    assert (run.empty > 0) != usable
    counts = {f.method: f.counts for f in run.figures}
    assert counts["tap"] == {"methods/tap.wgsl:main": 1}
    assert counts["tiles"]["methods/tiles_velocity.wgsl:main"] == 1
    assert counts["gather"]["methods/gather/layers/edges.wgsl:detect_edges"] == 3  # of three frames
    assert counts["accumulate"] == {"scene/gbuffer.wgsl:main": 3, "methods/accumulate.wgsl:main": 3}
    if not usable:
        assert all(v >= 0 for f in run.figures for v in f.passes.values())


def test_a_method_holds_its_pictures_and_what_it_needs_besides(run):
    for f in run.figures:
        pixels = f.width * f.height
        assert f.memory >= 0.95 * max(f.bytes, 16 * pixels)
        assert f.memory < 1000 * pixels + 8_000_000
    tap = [f for f in run.figures if f.method == "tap" and f.size == SIZES[0]]
    for f in tap:
        assert f.memory == pytest.approx(f.bytes, rel=0.05)


def test_what_takes_too_long_is_left_out_and_said(device):
    said = []
    run = bench.bench(device, [Candidate("tap"), Candidate("gather")], SIZES[::-1], (2,),
                      rounds=1, limit=1e-6, tell=said.append)  # fmt: skip
    assert [(f.method, f.size) for f in run.figures] == [("tap", SIZES[0]), ("gather", SIZES[0])]
    assert [n.partition(" skipped")[0] for n in run.notes] == [
        "96 x 54, 2 samples: tap", "96 x 54, 2 samples: gather"
    ]  # fmt: skip
    assert set(run.notes) <= set(said)
    assert all(note in bench_report.text(run) and note in bench_report.report(run, "").notes
               for note in run.notes)  # fmt: skip


@pytest.mark.full
def test_what_does_not_fit_into_memory_is_left_out(device, monkeypatch):
    tap = bench.bench(device, [Candidate("tap")], SIZES[:1], (2,), 1).figures[0]
    monkeypatch.setattr(bench, "_memory", lambda: 2 * tap.memory)
    run = bench.bench(device, [Candidate("tap")], SIZES, (2,), 1)
    assert [f.size for f in run.figures] == [SIZES[0]]
    assert "skipped: it would hold" in run.notes[0]


@pytest.mark.full
def test_a_size_that_no_texture_has_is_left_out(device):
    huge = 1 << 20, 4
    run = bench.bench(device, [Candidate("tap")], [huge, SIZES[0]], (2,), 1)
    assert [f.size for f in run.figures] == [SIZES[0]]
    assert "skipped: image is 1048576 x 4" in run.notes[0]
    with pytest.raises(InputError, match="1048576 x 4"):
        bench.bench(device, [Candidate("tap")], [huge], (2,), 1)


@pytest.mark.full
def test_the_time_to_come_is_told(device):
    said = []
    bench.bench(device, [Candidate("tap")], SIZES, (2, 4), 1, tell=said.append)
    assert [text.partition(":")[0] for text in said] == [
        "64 x 36, 2 samples (1 of 4)", "64 x 36, 4 samples (2 of 4)",
        "96 x 54, 2 samples (3 of 4)", "96 x 54, 4 samples (4 of 4)",
    ]  # fmt: skip
    assert all("to the end" in text for text in said[1:])


def test_what_is_interrupted_has_what_was_measured(device, monkeypatch):
    measure = bench._Matrix.measure

    def interrupt(matrix, size, samples):
        if samples == 4:
            raise KeyboardInterrupt
        measure(matrix, size, samples)

    monkeypatch.setattr(bench._Matrix, "measure", interrupt)
    run = bench.bench(device, [Candidate("tap")], SIZES[:1], (2, 4, 8), 1)
    assert [f.samples for f in run.figures] == [2]
    assert run.notes == ["interrupted: the rest is skipped"]
    with pytest.raises(KeyboardInterrupt):
        bench.bench(device, [Candidate("tap")], SIZES[:1], (4,), 1)


def test_ctrl_c_writes_what_there_is_and_ends_with_130(tmp_path, capsys, monkeypatch):
    measure = bench._Matrix.measure

    def interrupt(matrix, size, samples):
        measure(matrix, size, samples)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(bench._Matrix, "measure", interrupt)
    code, out, err = make.inside(capsys, "bench", "--methods", "tap", "--size", "64x36", "--rounds",
                                 1, "--samples", "2,4", "--save", tmp_path / "a.json")  # fmt: skip
    assert code == 130
    assert "64 x 36, tap, 2 samples" in out and "tap, 4 samples" not in out
    assert err.splitlines()[-1] == "wgmb: interrupted"
    assert len(bench_figures.Bench.load(tmp_path / "a.json").figures) == 1


def test_all_methods_are_timed_when_all_are_asked_for(tmp_path, capsys):
    code, _, err = make.inside(
        capsys, "bench", "--methods", "all", "--size", "32x18", "--samples", 1, "--rounds", 1,
        "--quiet", "--save", tmp_path / "a.json",
    )  # fmt: skip
    assert (code, err) == (0, "")
    run = bench_figures.Bench.load(tmp_path / "a.json")
    assert [f.method for f in run.figures] == list(METHODS)


# ---- tools/speed/gpu_check.py, of which lavapipe runs every part with tiny pictures -------------

CHECK = Path(__file__).parents[2] / "tools" / "speed" / "gpu_check.py"


@pytest.mark.full
def test_a_gpu_is_checked_in_one_run(tmp_path, capsys):
    tool = runpy.run_path(str(CHECK))
    assert tool["main"](["reference", str(tmp_path / "refs.npz")]) == 0
    words = ["check", str(tmp_path), "--refs", str(tmp_path / "refs.npz"), "--quick"]
    assert tool["main"](words) == 0
    kept = json.loads((tmp_path / "check.json").read_text())
    assert (kept["left out"], kept["failed"]) == ([], {})
    assert kept["device"]["adapter"] and kept["waits"]["wait ms"] > 0
    said = capsys.readouterr().out
    for method in tool["METHODS"]:
        one = kept[f"{method}, 64 x 36"]
        assert min(one["record"], one["wall"], one["in a row"], one["asked"]["passes"]) > 0
        assert f"| {method}, 64 x 36 |" in said
    for flow in tool["FLOWS"]:
        assert kept[f"video by {flow}"]["counts"]["submits"] > 0
        assert f"| video by {flow} |" in said
    assert {one["largest"] for one in kept["references"].values()} == {0.0}  # the same adapter


def test_parts_of_a_check_that_fail_or_have_no_time_are_named(tmp_path, capsys):
    tool = runpy.run_path(str(CHECK))
    check = tool["check"]

    def parts(device, options):
        yield "fails", lambda: 1 / 0
        yield "runs", lambda: {"rate": 2.0, "thread": 1.0, "counts": dict.fromkeys(
            ("passes", "submits", "waits", "groups", "buffers", "textures"), 3.0)}  # fmt: skip

    check.__globals__["parts_of"] = parts
    assert tool["main"](["check", str(tmp_path)]) == 1
    said = capsys.readouterr().out
    assert "| runs | 2.0 | 1.0 | 3.0 |" in said and "Failed: fails." in said
    assert (
        "ZeroDivisionError" in json.loads((tmp_path / "check.json").read_text())["failed"]["fails"]
    )
    assert tool["main"](["check", str(tmp_path), "--seconds", "0"]) == 0
    assert "Left out: fails, runs." in capsys.readouterr().out
