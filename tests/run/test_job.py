"""A job file: any part of a sequence, blurred by any process, has the bytes of one run over all."""

import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from make_stereo import single_part, with_stereo
from wgmb import Clip, InputError
from wgmb._version import __version__
from wgmb.run import job_file
from wgmb.run.job_file import findings_of, of_text
from wgmb.sequence.findings import numbers, ranges

COUNT = 10


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """An empty folder, in which the commands run, so that names are relative."""
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, COUNT + 1))


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in Path(folder).iterdir()}


def said(capsys, *words, code=0) -> str:
    got, out, err = make.inside(capsys, *words)
    assert (got, out) == (code, ""), err
    return err


def make_job(capsys, pattern, *options, output="parts/o.####.exr") -> str:
    return said(capsys, "job", pattern, "-o", output, "-j", "shot.json", *options)


def in_parts(capsys, parts) -> str:
    return "".join(said(capsys, "blur", "--job", "shot.json", f"--frames={p}") for p in parts)


def check(capsys, pattern, parts, *options, suffix="exr", name="o.####"):
    """The parts, blurred one by one from a job file elsewhere, are the whole."""
    whole = said(capsys, "blur", pattern, "-o", f"whole/{name}.{suffix}", *options)
    make_job(capsys, pattern, *options, output=f"parts/{name}.{suffix}")
    os.mkdir("elsewhere")
    shutil.move("shot.json", "elsewhere/shot.json")
    os.chdir("elsewhere")
    told = in_parts(capsys, parts)
    os.chdir("..")
    assert contents("whole")
    assert contents("parts") == contents("whole")
    return whole, told


# ---- the same bytes -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "chunk"),
    [
        pytest.param("tap", 1, marks=pytest.mark.full),
        ("gather", 3),
        pytest.param("gather", COUNT, marks=pytest.mark.full),
        pytest.param("gather --reach 2", 3, marks=pytest.mark.full),
        pytest.param("reproject", 4, marks=pytest.mark.full),
        pytest.param("tiles", 7, marks=pytest.mark.full),
        pytest.param("fusion", 4, marks=pytest.mark.full),
    ],
)
def test_parts_of_any_size_are_the_whole_with_every_method(desk, capsys, shot, method, chunk):
    parts = [f"{n}-{min(n + chunk - 1, COUNT)}" for n in range(1, COUNT + 1, chunk)]
    check(capsys, shot, parts, "--method", *method.split())


def test_parts_of_a_shot_that_moves_only_at_times_read_its_vectors_alike(desk, capsys):
    """Only frames 5 to 8 of 12 tell that the vectors are upside down."""
    for n in range(1, 13):
        moves = make.VELOCITY if 5 <= n < 9 else (0.0, 0.0)
        channels = make.frame(n, "nuke", moves)
        for name in ("forward.v", "backward.v"):
            channels[name] = -channels[name]
        make.write_exr(desk / "in" / f"s.{n:04d}.exr", channels)
    whole, told = check(capsys, "in/s.####.exr", ["1-4", "5-8", "9-12"])
    assert "flip y" in whole
    assert told.count("flip y") == 3


@pytest.mark.covers(0)
@pytest.mark.parametrize("reach", [1, 2])
@pytest.mark.parametrize("cut", [5, 6, 7])
@pytest.mark.parametrize("known", [True, False], ids=["named", "found"])
def test_cuts_at_before_and_after_a_border_are_the_same(desk, capsys, cut, known, reach):
    """Parts of 5 frames, so that the second one begins with frame 6."""
    for n in range(1, 11):
        channels = make.frame(n)
        if n >= cut:  # another picture
            for name in [c for c in channels if "Combined" in c and c[-1] != "A"]:
                channels[name] = channels[name][::-1, ::-1]
        make.write_exr(desk / "in" / f"s.{n:04d}.exr", channels)
    options = ("--cuts", f"only:{cut}") if known else ()
    options = "--method", "gather", "--reach", reach, *options
    whole, told = check(capsys, "in/s.####.exr", ["1-5", "6-10"], *options)
    for text in (whole, told):  # in others the vectors may not fit the picture either
        assert re.search(f"camera cuts? before frames? {cut}", text)


def test_masks_layers_from_beside_cameras_and_curves_are_found_from_anywhere(desk, capsys):
    index = np.zeros((48, 64))
    index[10:20, 10:30] = 4
    make.write_depth_sequence(desk / "in", range(1, 7), index=index)
    make.write_cameras(desk / "in" / "cam.json", range(9))
    for n in range(1, 7):
        make.write_exr(desk / "in" / f"m.{n:04d}.exr", {"Y": np.full((48, 64), n / 10, np.float32)})
    Image.new("L", (64, 48), 100).save(desk / "in" / "half.png")
    (desk / "in" / "also.exr").write_bytes(b"")
    make.write_exr(desk / "in" / "also.exr", {"extra.X": np.ones((48, 64), "f4")})
    (desk / "in" / "c.csv").write_text("0,1\n1,0.5\n")
    (desk / "in" / "cut.edl").write_text(
        "001 A V C 00:00:00:00 00:00:00:03 00:00:00:00 00:00:00:03\n"
        "002 A V C 00:00:00:00 00:00:00:03 00:00:00:03 00:00:00:06\n"
    )
    words = "--camera in/cam.json --also in/also.exr --curve in/c.csv --cuts only:in/cut.edl@24 "
    words += (
        "--holdout IndexOB=4 --holdout in/m.####.exr --scale in/half.png:0.5 --scale IndexOB=4:0"
    )
    whole, _ = check(capsys, "in/c.####.exr", ["1-2", "3-5", "6"], *words.split())
    assert "camera cut before frame 4" in whole


@pytest.mark.covers(0)
@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_stills_with_a_config_of_the_environment_are_the_same(
    desk, capsys, shot, suffix, monkeypatch
):
    monkeypatch.setenv("OCIO", "ocio://default")
    said(capsys, "blur", shot, "-o", f"whole/o.####.{suffix}", "--bits", 16)
    make_job(capsys, shot, "--bits", 16, output=f"parts/o.####.{suffix}")
    monkeypatch.delenv("OCIO")
    in_parts(capsys, ["1-4", "5-10"])
    assert contents("parts") == contents("whole")


def test_a_job_of_srgb_is_not_shown_otherwise_by_the_environment(desk, capsys, shot, monkeypatch):
    said(capsys, "blur", shot, "-o", "whole/o.####.png", "--frames", "1-2")
    make_job(capsys, shot, "--frames", "1-2", output="parts/o.####.png")
    monkeypatch.setenv("OCIO", "ocio://default")
    in_parts(capsys, ["1", "2"])
    assert contents("parts") == contents("whole")


def test_every_view_is_the_same(desk, capsys):
    pattern = with_stereo(desk / "in", single_part, range(1, 6))
    check(capsys, pattern, ["1-2", "3-5"], "--method", "gather")


def test_views_with_files_of_their_own_are_the_same(desk, capsys):
    for view in ("left", "right"):
        (desk / "in" / view).mkdir()
        make.write_sequence(desk / "in" / view, range(1, 5))
    check(capsys, "in/%V/shot.####.exr", ["1", "2-4"], name="o.%V.####")


def test_windows_that_cut_through_the_picture_are_the_same(desk, capsys):
    for n in range(1, 6):
        width = 40 if n != 4 else 30
        channels = {k: v[:, :width] for k, v in make.frame(n).items()}
        window = (8, 4, 7 + width, 51)
        make.write_exr(
            desk / "in" / f"s.{n:04d}.exr", channels, data=window, display=(0, 0, 79, 59)
        )
    check(capsys, "in/s.####.exr", ["1-3", "4", "5"], "--method", "gather")


@pytest.mark.parametrize("flow", ["dis", pytest.param("search", marks=pytest.mark.full)])
def test_motion_that_comes_from_the_pictures_is_the_same(desk, capsys, flow):
    for n in range(1, 9):
        make.write_exr(desk / "in" / f"s.{n:04d}.exr", make.colors(make.picture(n)))
    options = ("--flow", flow, "--flow-quality", "fast")
    whole, _ = check(capsys, "in/s.####.exr", ["1-3", "4-8"], *options)
    assert "motion: " in whole


def test_steps_gaps_and_frames_before_0_are_the_same(desk, capsys):
    make.write_sequence(desk / "in", [-6, -4, -3, -2, -1, 0, 1, 2, 5])
    check(capsys, "in/shot.####.exr", ["-6--2x2", "0", "-1", "2,5"],
          "--frames=-6-0x2,-1,2-5", "--skip-missing")  # fmt: skip


def test_a_single_file_and_confidence_are_the_same(desk, capsys, shot):
    shutil.copy(shot.replace("####", "0003"), "in/a.0003.exr")
    check(capsys, "in/a.0003.exr", ["3"], "--confidence", "--method", "gather", name="o")


def test_a_mask_that_other_parts_have_is_no_fault_of_this_part(desk, capsys):
    for n in range(1, 5):
        index = np.full((48, 64), 4.0 if n == 4 else 1.0, np.float32)
        make.write_exr(desk / "in" / f"s.{n:04d}.exr", make.frame(n) | {"IndexOB.X": index})
    _, told = check(
        capsys, "in/s.####.exr", ["1-3", "4"], "--holdout", "IndexOB=4", "--method", "tap"
    )
    assert told.count("IndexOB=4 is in no pixel of these frames") == 1


# ---- what a job is of -----------------------------------------------------------------------


@pytest.fixture
def own(desk, capsys):
    """A job of eight frames that a test may change."""
    pattern = make.write_sequence(desk / "in", range(1, 9))
    make_job(capsys, pattern)
    return desk


@pytest.mark.parametrize(
    ("change", "frames", "says"),
    [
        (lambda f: os.utime(f / "shot.0005.exr", (0, 0)), "5", "shot.0005.exr has changed"),
        (lambda f: os.utime(f / "shot.0005.exr", (0, 0)), "6", "shot.0005.exr has changed"),
        (lambda f: (f / "shot.0005.exr").write_bytes(b""), "4", "shot.0005.exr has changed"),
        (lambda f: (f / "shot.0003.exr").unlink(), "2-3", "shot.0003.exr is gone"),
        (lambda f: os.utime(f / "shot.0008.exr", (0, 0)), "3", "shot.0008.exr has changed"),
        (lambda f: shutil.copy(f / "shot.0001.exr", f / "shot.0009.exr"), "8", "0009.exr did not"),
    ],
    ids=["frame", "neighbour", "cut off", "gone", "looked at", "new neighbour"],
)  # fmt: skip
def test_a_job_whose_inputs_have_changed_is_one_line(own, capsys, change, frames, says):
    change(own / "in")
    err = said(capsys, "blur", "--job", "shot.json", "--frames", frames, code=2)
    assert err.count("\n") == 1
    assert says in err
    assert "write the job again" in err
    assert make.names_in(own / "parts") == []


def test_parts_that_do_not_depend_on_a_changed_frame_are_blurred(own, capsys):
    os.utime(own / "in" / "shot.0003.exr", (0, 0))
    in_parts(capsys, ["6-7"])
    assert make.names_in(own / "parts") == ["o.0006.exr", "o.0007.exr"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: t[: len(t) // 2], "not a job written by wgmb, or cut off"),
        (lambda t: "[]", "not a job written by wgmb"),
        (lambda t: "[" * 100_000, "not a job written by wgmb"),
        (lambda t: t.replace('"shutter": 180.0', '"shutter": 90.0'), "was changed after it had"),
        (lambda t: t.replace(f'"wgmb": "{__version__}"', '"wgmb": "9.9"'), "wgmb 9.9, this is"),
        (lambda t: t.replace('"wgmb_job": 1', '"wgmb_job": 2'), "whose results may differ"),
    ],
    ids=["half", "list", "deep", "edited", "version", "format"],
)
def test_a_job_file_that_does_not_fit_is_one_line(own, capsys, change, says):
    path = own / "shot.json"
    text = path.read_text()
    path.write_text(change(text))
    assert path.read_text() != text
    err = said(capsys, "blur", "--job", path, "--frames", "1", code=2)
    assert err.count("\n") == 1
    assert says in err


def test_a_curve_that_changes_is_told(desk, capsys, shot):
    Path("c.csv").write_text("0,1\n1,0.5\n")
    make_job(capsys, shot, "--curve", "c.csv")
    Path("c.csv").write_text("0,1\n1,0.6\n")
    err = said(capsys, "blur", "--job", "shot.json", "--frames", "1", code=2)
    assert "c.csv has changed since the job was written" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--job none.json", "none.json: no such file"),
        ("--job shot.json --frames 8-12", "9-12 are not in the job, which has 1-8"),
        ("--job shot.json --shutter 90", "--job holds all settings"),
        ("--job shot.json --color-in bt709", "--job holds all settings"),
        ("--job shot.json --try 0", "--job holds all settings"),
        ("--job shot.json -o x.####.exr", "--job holds all settings"),
        ("--job shot.json --frames 11 --resume", "--job holds all settings, and frames that are"),
        ("--job=shot.json --overwrite", "--job holds all settings"),
        ("in/shot.####.exr --job shot.json", "--job holds all settings"),
        ("in/shot.####.exr", "--output is missing"),
        ("-o x.####.exr", "no input"),
    ],
)
def test_words_that_do_not_go_with_a_job_are_one_line(own, capsys, words, says):
    err = said(capsys, "blur", *words.split(), code=2)
    assert err.count("\n") == 1
    assert says in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("-o o.mp4 -j a.json", "a video is written by one process; write frames"),
        ("-o o.####.exr -j a.txt", "must end in .json"),
        ("-o o.####.exr -j other.json", "other.json exists and was not written by wgmb job"),
        ("-o o.####.exr -j a.json --chunk 0", "--chunk must be 1 frame or more"),
        ("-o o.####.exr -j a.json --method gahter", "did you mean 'gather'"),
        ("-o o.####.exr -j a.json --method tap --weights published", "method 'tap' has no option"),
        ("-o o.####.exr -j a.json --samples 5000", "--samples must be 1 to 4096"),
        ("-o in/shot.####.exr -j a.json", "is the input"),
        ("-o parts/o.####.exr -j a.json", "o.0001.exr exists; --overwrite replaces it"),
        ("-o o.####.png -j a.json --confidence", "needs an .exr output"),
    ],
)
def test_what_makes_no_job_is_one_line_and_leaves_nothing(own, capsys, words, says):
    Path("other.json").write_text("{}")
    Path("parts/o.0001.exr").write_bytes(b"")
    before = sorted(own.rglob("*"))
    err = said(capsys, "job", "in/shot.####.exr", *words.split(), code=2)
    assert err.count("\n") == 1
    assert says in err
    assert sorted(own.rglob("*")) == before


def test_a_job_is_written_without_a_gpu(desk, capsys, shot):
    env = {"VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"}
    line = ("job", shot, "-o", "o.####.exr", "-j", "shot.json")
    done = make.command(*line, env=env)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert done.stderr == "shot.json: 10 frames (1-10) with gather, not blurred yet\n"


# ---- what is there --------------------------------------------------------------------------


def test_a_part_that_is_run_again_keeps_what_is_done(own, capsys):
    in_parts(capsys, ["1-3"])
    times = {p: p.stat().st_mtime_ns for p in (own / "parts").iterdir()}
    assert "2 frames in" in (err := in_parts(capsys, ["2-5"]))
    assert "2 already done" in err
    assert all(p.stat().st_mtime_ns == time for p, time in times.items())


def test_overwrite_means_what_was_there_before_the_job_and_not_what_it_made(own, capsys):
    in_parts(capsys, ["1-3"])
    whole = contents("parts")
    Path("parts/o.0002.exr").write_bytes(b"of another program")
    make_job(capsys, "in/shot.####.exr", "--overwrite")
    assert "3 frames in" in in_parts(capsys, ["1-3"])
    assert "0 frames in" in in_parts(capsys, ["1-3"])
    assert contents("parts") == whole


def test_a_job_that_resumes_keeps_what_was_there_before(own, capsys):
    in_parts(capsys, ["1-3"])
    make_job(capsys, "in/shot.####.exr", "--resume")
    assert "1 frame in" in (err := in_parts(capsys, ["2-4"]))
    assert "2 already done" in err


def test_a_frame_that_cannot_be_read_fails_alone(desk, capsys):
    pattern = make.write_sequence(desk / "in", range(1, 6))
    damaged = desk / "in" / "shot.0003.exr"
    damaged.write_bytes(damaged.read_bytes()[:-300])
    make_job(capsys, pattern)
    err = said(capsys, "blur", "--job", "shot.json", "--frames", "2-4", code=1)
    assert "frame 3 failed" in err
    assert make.names_in(desk / "parts") == ["o.0002.exr", "o.0004.exr"]


# ---- numbers and findings -------------------------------------------------------------------


@pytest.mark.fast
@pytest.mark.parametrize(
    ("given", "as_ranges"),
    [
        ([], []),
        ([7], [(7, 7, 1)]),
        ([1, 2, 3, 5, 7, 9, 20], [(1, 3, 1), (5, 9, 2), (20, 20, 1)]),
        ([5, 4, 3], [(5, 3, -1)]),
        ([-5, -3, -1, 4, 4], [(-5, -1, 2), (4, 4, 1), (4, 4, 1)]),
        ([1, 100, 101, 102], [(1, 1, 1), (100, 102, 1)]),
    ],
)
def test_numbers_as_ranges_and_back(given, as_ranges):
    assert ranges(given) == as_ranges
    assert numbers(as_ranges) == given


def test_findings_are_plain_values_and_come_back(shot):
    clip = Clip(shot, cuts="3")
    settled = clip.settle()
    again = findings_of(json.loads(json.dumps(settled.plain())))
    assert again == settled
    other = Clip(shot, cuts="3", settled=again)
    assert (other.finding, other.on_disk, other.views) == (clip.finding, clip.on_disk, ())


def test_a_job_that_somebody_changed_and_sealed_again_is_one_line(desk, capsys, shot):
    make_job(capsys, shot)
    whole = json.loads(Path("shot.json").read_text())

    def places(value, at=()):
        yield at
        if isinstance(value, dict):
            for name in value:
                yield from places(value[name], (*at, name))

    for at in places({k: v for k, v in whole.items() if k not in ("wgmb_job", "seal", "wgmb")}):
        for wrong in (None, 0, -1, "x", [], {}, [[0, 1, 0]], 1e400, "gone"):
            content = json.loads(json.dumps(whole))
            del content["seal"], content["wgmb_job"]
            inner = content
            for name in at[:-1]:
                inner = inner[name]
            if wrong == "gone" and at:
                del inner[at[-1]]
            elif at:
                inner[at[-1]] = wrong
            sealed = json.dumps({"wgmb_job": 1, "seal": job_file._seal(content)} | content)
            try:
                found = of_text(sealed, "x")
            except InputError as error:
                assert str(error).startswith("x: ")
            else:
                assert isinstance(found.job.numbers, list)


def test_a_part_of_a_clip_begins_with_nothing_read(shot):
    clip = Clip(shot)
    clip.frame(clip.source(2))
    part = clip.part([4, 5])
    assert (part.numbers, part.sizes, part.cuts) == ([4, 5], {}, set())
    assert part.finding == clip.finding
    assert clip.numbers == list(range(1, COUNT + 1))


def test_no_text_is_a_job_but_a_job(desk, capsys, shot):
    make_job(capsys, shot)
    text = Path("shot.json").read_text()
    assert of_text(text, "x").text() == text
    with pytest.raises(InputError, match=r"^x: not a job"):
        of_text("", "x")
