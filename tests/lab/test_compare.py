"""The laboratory: who is compared, what is counted, and the page that tells of it."""

import csv
import json
import os
import re
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
from wgmb import METHODS, Clip, Frame, Shutter
from wgmb.errors import InputError
from wgmb.lab import cases, compare, report, results
from wgmb.lab.cases import Candidate, Case
from wgmb.lab.results import Entry, Report, Table
from wgmb.metrics import METRICS, measure

SIZE = (48, 32)


@pytest.fixture(scope="module")
def case(device):
    """A picture that moves to the right, and its truth by closed form."""
    x = np.broadcast_to(np.arange(48, dtype=np.float32), (32, 48))

    def at(time):
        bar = np.clip(8 - np.abs(x - 8 * time - 24.0), 0, 1)
        return np.dstack([bar, 0.5 * bar, 0.2 + 0 * bar]).astype(np.float32)

    truth = np.mean([at(t) for t in (np.arange(256) + 0.5) / 256 - 0.5], axis=0)
    to_next = np.full((32, 48, 2), (8, 0), np.float32)
    depth = np.ones((32, 48), np.float32)
    near = [Frame(at(k), to_next, depth=depth, number=k + 1) for k in (-1, 0, 1)]
    frame = replace(near[1], prev=near[0], next=near[2])
    return Case("bar", frame, Shutter(360), truth, "closed form", peers={"still": at(0)})


@pytest.fixture(scope="module")
def found(device, case):
    lab = compare.Laboratory(device, rounds=1)
    got = Report("Bars & <boxes>", "wgmb compare bar", results.machine(device), 8)
    lab.compare(got, case, [Candidate("tap"), Candidate("reproject")], (2, 4))
    got.tables.append(Table("More", ["what", "figure"], [["a < b", 1.5], ["c", None]]))
    return got


@pytest.fixture(scope="module")
def scene_frame(device):
    return cases.SceneFrame(cases.make_scene("crossing:speed=3")[1], size=SIZE, antialias=1)


@pytest.mark.parametrize(
    ("text", "label", "samples"),
    [("tap", "tap", None), ("tap:32", "tap", 32),
     ("tap:32:path=straight", "tap, path straight", 32),
     ("distributed:seed=3", "distributed, seed 3", None)],
)  # fmt: skip
def test_a_contender_is_read_from_text(text, label, samples):
    got = Candidate.parse(text)
    assert (got.label, got.samples) == (label, samples)


@pytest.mark.parametrize("text", ["", "smear", "tap:x", "tap:16:"])
def test_a_contender_that_is_none_is_refused(text):
    with pytest.raises(InputError):
        Candidate.parse(text)


def test_options_reach_the_method(device):
    with pytest.raises(InputError, match="path must be"):
        Candidate.parse("tap:path=crooked").blur(4, Shutter(180), device)
    with pytest.raises(InputError, match="no option wings"):
        Candidate.parse("tap:wings=2").blur(4, Shutter(180), device)


def test_a_scene_is_read_with_its_settings():
    name, scene = cases.make_scene("fence:speed=5:posts=3")
    assert name == "fence, speed 5, posts 3"
    assert scene.name == "fence"
    for wrong in ("nowhere", "fence:fast", "fence:height=3"):
        with pytest.raises(InputError):
            cases.make_scene(wrong)


def test_every_entry_has_every_measure_and_its_time(found, case):
    for entry in found.entries:
        assert list(entry.measures) == list(METRICS)
        assert (entry.seconds is None) == (entry.kind in ("sharp", "peer"))
        assert entry.seconds is None or entry.seconds > 0
    assert [e.samples for e in found.of("bar", label="tap", kind="samples")] == [2, 4, 8]


def test_figures_are_those_of_the_picture(found, case):
    for entry in found.entries:
        if entry.picture is not None:
            assert entry.measures == measure(entry.picture, case.truth)


def test_blur_is_nearer_to_the_truth_than_none(found):
    error = {e.label: e.measures["flip"] for e in found.of("bar", on_page=True)}
    assert error["tap"] < error["sharp"]
    assert error["sharp"] == error["still"]


def test_equal_time_is_that_of_the_slowest_at_equal_samples(found):
    equal = [e.seconds for e in found.of("bar", kind="samples", samples=8)]
    timed = found.of("bar", kind="time")
    assert {e.label for e in timed} == {"tap", "reproject"}
    assert {e.budget for e in timed} == {max(equal)}


@pytest.mark.parametrize(("fixed", "each"), [(0.0, 0.01), (0.2, 0.01), (0.01, 0.1)])
def test_samples_for_a_budget_follow_a_straight_line(fixed, each):
    known = [(n, fixed + each * n) for n in (4, 16, 64)]
    for wanted in (8, 32, 200):
        assert compare._guess(known, fixed + each * wanted) == wanted


def test_samples_for_a_budget_stay_in_bounds_when_times_say_nothing():
    assert compare._guess([(4, 0.5), (16, 0.5)], 1e-6) == 1
    assert compare._guess([(4, 0.5), (16, 0.4)], 1e6) == 8 * 16
    assert compare._guess([(1000, 0.4)], 1e6) == 4096
    assert compare._guess([(100, 0.4)], 1e6, most=512) == 512


def test_one_time_that_was_disturbed_does_not_mislead():
    known = [(4, 0.04), (8, 3.0), (16, 0.16), (32, 0.32)]
    assert 7 <= compare._guess(known, 0.08) <= 9


def test_own_samples_hold_at_equal_samples_only(device, case):
    lab, got = compare.Laboratory(device, rounds=1), Report("", "", {}, 4)
    lab.compare(got, case, [Candidate.parse("tap:3")], (2,), budgets=lambda *_: [])
    assert [e.samples for e in got.of("bar", label="tap")] == [2, 3]
    assert got.of("bar", kind="time") == []


def test_what_cannot_take_part_is_left_out_and_said(device, case):
    lab, got = compare.Laboratory(device, rounds=1), Report("", "", {}, 4)
    lab.compare(got, case, [Candidate("tap"), Candidate("distributed")], (2,))
    assert {e.label for e in got.of("bar", kind="samples")} == {"tap"}
    assert "distributed skipped: needs a scene" in got.notes[0]
    with pytest.raises(InputError, match="needs a scene"):
        lab.compare(got, case, [Candidate("distributed")], (2,))


FEW = ["tap", "reproject", "accumulate", "distributed"]


@pytest.mark.parametrize("methods", [FEW, pytest.param([*METHODS], marks=pytest.mark.full)])
def test_a_scene_is_compared_with_every_method(device, scene_frame, methods):
    lab, got = compare.Laboratory(device, rounds=1), Report("", "", {}, 4)
    made = cases.scene_case("x", Shutter(360), Candidate.parse("distributed:64"), scene_frame,
                              device, lambda text: None)  # fmt: skip
    lab.compare(got, made, [Candidate(m) for m in methods], (2,))
    left_out = {m for m in methods if any(f" {m} skipped" in n for n in got.notes)}
    labels = {e.label for e in got.of("x", kind="samples")}
    assert labels == {*methods} - left_out
    assert labels >= {*FEW}
    errors = {e.label: e.measures["psnr"] for e in got.of("x", on_page=True, kind="samples")}
    assert min(errors.values()) > 20  # the same picture, from the same place, at the same time
    table = compare.crossings(got, made)
    assert table is not None
    assert len(table.rows[0]) == len(table.columns)


def test_the_floor_is_what_a_perfect_picture_gets(device, scene_frame):
    """A picture with far less noise and rays of its own stands where the floor says."""
    shutter, tell = Shutter(180), lambda text: None
    few, more = (cases.scene_case("x", shutter, Candidate.parse(f"distributed:{n}"), scene_frame,
                                    device, tell) for n in (32, 64))  # fmt: skip
    much = Candidate.parse("distributed:1024:seed=9")
    clean = cases.scene_case("x", shutter, much, scene_frame, device, tell).truth
    assert list(few.floor) == list(METRICS)
    for case in (few, more):
        perfect = measure(clean, case.truth)
        assert case.floor["psnr"] == pytest.approx(
            perfect["psnr"], abs=1.5
        )  # halves among themselves: 6
        assert case.floor["flip"] == pytest.approx(perfect["flip"], rel=0.2)
    assert 2 < more.floor["psnr"] - few.floor["psnr"] < 9


def test_halves_share_no_rays_with_each_other_or_with_who_is_judged():
    for text, seeds in (("distributed:64", {1, 2}), ("distributed:64:seed=1", {3, 4})):
        halves = cases._halves(Candidate.parse(text), 64)
        assert {dict(h.options)["seed"] for h in halves} == seeds
        assert [h.samples for h in halves] == [32, 32]
    assert [h.samples for h in cases._halves(Candidate("distributed"), 3)] == [2, 1]
    assert cases._halves(Candidate("distributed"), 1) == []
    assert cases._halves(Candidate("accumulate"), 64) == []  # has no noise


def test_the_floor_stands_in_table_files_and_plots(device, scene_frame, tmp_path):
    lab, got = compare.Laboratory(device, rounds=1), Report("", "", {}, 4)
    reference = Candidate.parse("distributed:32")
    case = cases.scene_case("x", Shutter(180), reference, scene_frame, device, lab.tell)
    lab.compare(got, case, [Candidate("tap")], (2,), budgets=lambda *_: [])
    page, figures, table = report.write(got, tmp_path / "r.html")
    text, data = page.read_text(), json.loads(figures.read_text())
    assert data["cases"][0]["floor"] == case.floor
    with table.open(newline="") as lines:
        (row,) = (r for r in csv.DictReader(lines) if r["kind"] == "floor")
    assert float(row["psnr"]) == case.floor["psnr"]
    assert text.count('class="floor"') == 4  # FLIP and PSNR, against time and samples
    cells = text[text.index("<td>noise floor</td>") :].partition("</tr>")[0]
    assert f"{case.floor['flip']:.4f}" in cells and "best" not in cells


def test_the_line_of_the_floor_lies_where_it_belongs():
    plot = results.Plot("p", "x", "y", {"a": [(1, 0.2), (10, 1.0)]}, floor=0.2)
    drawn = report.plot_svg(plot, {"a": "red"})
    (at,) = re.findall(r'class="floor" [^>]*y1="([\d.]+)" y2="\1"', drawn)
    assert at == re.findall(r'cy="([\d.]+)"', drawn)[0]
    assert "floor" not in report.plot_svg(replace(plot, floor=None), {"a": "red"})


def test_a_reference_must_trace_the_scene(device, scene_frame):
    with pytest.raises(InputError, match="reference must be"):
        cases.scene_case("x", Shutter(180), Candidate("tap"), scene_frame, device, print)


def test_crossings_are_read_off_the_curves():
    made = Case("x", None, None, None, "")  # pyright: ignore[reportArgumentType]
    points = {"cheap": [(0.1, 0.3), (0.2, 0.2)], "slow": [(0.1, 0.4), (1.0, 0.1)]}
    entries = [Entry("x", k, "samples", {"flip": error}, 1, seconds, traced=k == "slow")
               for k, curve in points.items() for seconds, error in curve]  # fmt: skip
    table = compare.crossings(Report("", "", {}, 1, entries=entries), made)
    assert table is not None
    (row,) = table.rows
    # Error 0.2 lies two thirds down from 0.4 to 0.1: 0.1 s x 10 ** (2 / 3).
    assert row[:3] == ["cheap", 200.0, 0.2]
    assert row[3] == pytest.approx(464.2, abs=0.2)
    assert row[4] == pytest.approx(2.3, abs=0.05)


def test_json_and_csv_hold_every_entry(found, tmp_path):
    page, figures, table = report.write(found, tmp_path / "r.html")
    data = json.loads(figures.read_text())
    assert len(data["entries"]) == len(found.entries)
    assert data["command"] == "wgmb compare bar"
    assert data["machine"]["adapter"]
    with table.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [r["method"] for r in rows] == [e.label for e in found.entries]
    assert float(rows[0]["flip"]) == pytest.approx(found.entries[0].measures["flip"])
    assert page.stat().st_size > 10_000


class _Page(HTMLParser):
    """Tags that must be closed, and everything that an address points to."""

    VOID = frozenset({"meta", "img", "input", "br"})

    def __init__(self, text):
        super().__init__()
        self.open, self.wrong, self.addresses = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.addresses += [v for k, v in attrs if k in ("src", "href") and v]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        if tag in ("p", "option", "td", "th", "tr", "dt", "dd"):
            while self.open and self.open[-1] != tag:
                self.wrong.append(self.open.pop())
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def test_the_page_needs_no_network_and_is_well_formed(found):
    text = report.page(found)
    parsed = _Page(text)
    assert (parsed.open, parsed.wrong) == ([], [])
    assert all(a.startswith(("data:image/", "#")) for a in parsed.addresses)
    assert not re.search(r"https?:|url\(|@import|fetch\(", text)


def test_the_page_tells_command_machine_and_figures(found):
    text = report.page(found)
    assert "Bars &amp; &lt;boxes&gt;" in text
    assert "<boxes>" not in text
    assert "a &lt; b" in text
    for part in ("wgmb compare bar", *found.machine.values(), "still", "closed form"):
        assert part in text
    tap = found.of("bar", label="tap", on_page=True)[0]
    assert f"{tap.measures['flip']:.4f}" in text
    assert text.count('class="card"') == len(found.of("bar", on_page=True)) + 1  # and the truth


def test_a_plot_has_every_point_where_it_belongs():
    plot = results.Plot("p", "x", "y", {"a": [(1, 0.0), (10, 0.5), (100, 1.0)]})
    at = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', report.plot_svg(plot, {"a": "red"}))
    (x0, y0), (x1, y1), (x2, y2) = [(float(x), float(y)) for x, y in at]
    assert x1 - x0 == pytest.approx(x2 - x1, abs=0.2)
    assert y0 - y1 == pytest.approx(y1 - y2, abs=0.2)
    assert y2 < y0


@pytest.mark.parametrize("points", [[(4, 0.2)], [(4, 0.2), (4, 0.2)], [(1, -3.0), (1e4, 1e-9)]])
def test_a_plot_of_little_is_drawn(points):
    text = report.plot_svg(results.Plot("p", "x", "y", {"a": points}), {"a": "red"})
    assert text.count("<circle") == len(points)
    assert "nan" not in text


def test_files_are_compared_with_the_frames_around_them(tmp_path, capsys):
    shot = make.write_sequence(tmp_path, range(1, 4))
    truth = shot.replace("####", "0002")
    Path(truth).chmod(0o600)
    said = make.inside(
        capsys, "compare", "--truth", truth, "--inputs", shot, "--frames", 2, "--methods", "tap",
        "--ladder", "2", "--samples", 4, "--peer", f"other={truth}", "--rounds", 1,
        "-o", tmp_path / "r.html",
    )  # fmt: skip
    assert said[:2] == (0, "")
    if os.name != "nt":  # a page that shows a private file is private
        assert not any(path.stat().st_mode & 0o077 for path in tmp_path.glob("r.*"))
    data = json.loads((tmp_path / "r.json").read_text())
    kinds = {e["method"]: e["kind"] for e in data["entries"]}
    assert kinds == {"sharp": "sharp", "other": "peer", "tap": "time"}
    assert next(e["flip"] for e in data["entries"] if e["method"] == "other") == 0
    again = make.inside(capsys, "compare", "crossing", "-o", tmp_path / "r.html")
    assert again[0] == 2
    assert "--overwrite" in again[2]


def test_three_files_are_before_here_and_after(tmp_path):
    shot = make.write_sequence(tmp_path, range(1, 4))
    files = [shot.replace("####", f"{n:04d}") for n in (1, 2, 3)]
    truth = [Path(files[1])]
    three = cases.clip_case("x", Shutter(180), files, truth, {})
    one = cases.clip_case("x", Shutter(180), [shot], truth, {}, partial(Clip, frames="2"))
    for made in (three.frame, three.frame.prev, three.frame.next):
        assert made is not None
    for a, b in ((three.frame.prev, one.frame.prev), (three.frame.next, one.frame.next)):
        assert a is not None and b is not None
        np.testing.assert_array_equal(a.color, b.color)
    with pytest.raises(InputError, match="missing frame 7"):
        cases.clip_case("x", Shutter(180), [shot], truth, {}, partial(Clip, frames="7"))
    with pytest.raises(InputError, match="got frames 1-3, but a truth shows one frame; `frames`"):
        cases.clip_case("x", Shutter(180), [shot], truth, {})
    with pytest.raises(InputError, match="one file or three, got 2"):
        cases.clip_case("x", Shutter(180), files[:2], truth, {})


def test_two_halves_of_a_true_picture_tell_its_noise(tmp_path, capsys):
    shot = make.write_sequence(tmp_path, range(1, 4))
    files = [Path(shot.replace("####", f"{n:04d}")) for n in (1, 2, 3)]

    def case(*truth):
        return cases.clip_case("x", Shutter(180), [shot], truth, {}, partial(Clip, frames="2"))

    one, two = case(files[1]), case(files[0], files[2])
    assert one.floor is None and "noise is unknown" in one.about
    a, b = (case(files[i]).truth for i in (0, 2))
    np.testing.assert_allclose(two.truth, (a + b) / 2)
    wanted = [measure(p, (a + b) / 2)["psnr"] for p in (a, b)]
    assert two.floor["psnr"] == pytest.approx(np.mean(wanted))
    with pytest.raises(InputError, match="one file or two halves of it, got 3"):
        case(*files)
    small = tmp_path / "small.png"
    iio.imwrite(small, np.zeros((4, 5, 3), np.uint8))
    with pytest.raises(InputError, match="of one size, got 64 x 48 and 5 x 4"):
        case(files[0], small)
    said = make.inside(
        capsys, "compare", "--truth", *files[::2], "--inputs", shot, "--frames", 2, "--methods",
        "tap", "--ladder", "2", "--samples", 2, "--rounds", 1, "-o", tmp_path / "r.html",
    )  # fmt: skip
    assert said[0] == 0
    assert "noise floor of the truth: FLIP" in said[2]


@pytest.mark.parametrize(
    "arguments",
    ["crossing", "-o r.html", "crossing -o r.txt", "crossing --truth a.exr -o r.html",
     "--truth a.exr -o r.html", "nowhere -o r.html", "crossing --methods smear -o r.html",
     "crossing --reference tap -o r.html", "crossing --ladder 4,x -o r.html",
     "crossing --shutters 1,x -o r.html", "crossing --rounds 0 -o r.html",
     "crossing --budget 0 -o r.html", "--experiment magic -o r.html"],
)  # fmt: skip
def test_wrong_usage_is_one_line_and_2(tmp_path, capsys, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    code, out, err = make.inside(capsys, "compare", *arguments.split())
    assert (code, out) == (2, "")
    assert err.splitlines()[-1].startswith("wgmb: ")
    assert list(tmp_path.iterdir()) == []
