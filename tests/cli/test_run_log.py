"""`--log-json`: its lines fit the schema on its page, and say what happened."""

import json
import os
import re
from pathlib import Path

import jsonschema
import pytest

import make_clips
import make_frames as make

PAGE = Path(__file__).parents[2] / "docs/reference/files.md"
SECTION = PAGE.read_text("utf-8").partition("\n### Schema\n")[2]
(SCHEMA,) = re.findall(r"^```json\n(.*?)^```", SECTION, re.M | re.S)
VALID = jsonschema.Draft202012Validator(json.loads(SCHEMA))


def events(text: str) -> list[dict]:
    """The lines of a log, each valid by the page's schema."""
    assert text.endswith("\n")
    lines = [json.loads(line) for line in text.splitlines()]
    for line in lines:
        VALID.validate(line)
    return lines


@pytest.fixture
def frames(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make.write_sequence(tmp_path, range(1, 4))
    return tmp_path


BLUR = ("blur", "shot.####.exr", "-o", "out.####.exr", "--method", "tap", "-q")


def test_a_run_over_frames_has_a_line_for_each(frames, capsys):
    (frames / "shot.0002.exr").write_text("no frame")
    assert make.inside(capsys, *BLUR, "--log-json", "run.log")[0] == 1
    start, *middle, end = events((frames / "run.log").read_text())
    assert (start["event"], start["inputs"], start["frames"]) == ("start", ["shot.####.exr"], 3)
    assert start["settings"]["method"] == "tap"
    told = {line["number"]: line for line in middle}
    assert [told[n]["status"] for n in (1, 2, 3)] == ["done", "failed", "done"]
    assert "shot.0002.exr" in told[2]["reason"] and told[1]["reason"] == ""
    assert told[3]["output"] == "out.0003.exr" and Path(told[3]["output"]).is_file()
    assert (end["exit_code"], end["frames"]) == (1, {"done": 2, "skipped": 0, "failed": 1})


def test_a_run_that_is_resumed_adds_to_the_log_and_skips(frames, capsys):
    for code in (0, 0):
        assert make.inside(capsys, *BLUR, "--resume", "--log-json", "run.log")[0] == code
    lines = events((frames / "run.log").read_text())
    assert [line["event"] for line in lines].count("start") == 2
    assert lines[-1]["frames"] == {"done": 0, "skipped": 3, "failed": 0}


def test_standard_output_has_the_log_and_nothing_else(frames, capsys):
    code, said, _ = make.inside(capsys, *BLUR, "--log-json", "-")
    assert code == 0
    assert [line["event"] for line in events(said)] == ["start", *["frame"] * 3, "end"]


def test_an_error_before_the_first_frame_is_in_the_log(frames, capsys):
    code, _, err = make.inside(capsys, "blur", "no.####.exr", "-o", "x.####.exr", "--log-json=l")
    (end,) = events((frames / "l").read_text())
    assert (end["event"], end["exit_code"], code) == ("end", 2, 2)
    assert err == f"wgmb: {end['reason']}\n"


def test_a_file_that_is_no_log_and_a_pipe_that_has_pictures_are_refused(frames, capsys):
    before = (frames / "shot.0001.exr").read_bytes()
    code, _, err = make.inside(capsys, *BLUR, "--log-json", "shot.0001.exr")
    assert code == 2 and "shot.0001.exr: the file exists, but is no log" in err
    assert (frames / "shot.0001.exr").read_bytes() == before
    code, _, err = make.inside(capsys, "blur", "-", "-o", "-", "--log-json", "-")
    assert (code, len(err.splitlines())) == (2, 1)
    assert "--log-json and --output are both standard output" in err
    code, _, err = make.inside(capsys, *BLUR, "--log-json", "none/run.log")
    assert (code, err) == (2, "wgmb: none/run.log: no such file or directory\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no device that is full")
def test_a_log_that_cannot_be_written_is_told_once_and_the_run_goes_on(frames, capsys):
    code, _, err = make.inside(capsys, *BLUR, "--log-json", "/dev/full")
    assert (code, err) == (0, "wgmb: the log /dev/full ends here: no space left on device\n")
    assert (frames / "out.0003.exr").is_file()


def test_videos_have_their_frames_and_a_line_each(frames, capsys):
    make_clips.write(frames / "a.mp4", [make_clips.grey((64, 48)) for _ in range(4)])
    (frames / "b.mp4").write_bytes(b"no video")
    words = ("blur", "a.mp4", "b.mp4", "-o", "out/", "--flow", "none", "--shutter", "720", "-q")
    assert make.inside(capsys, *words, "--log-json", "run.log")[0] == 1
    lines = events((frames / "run.log").read_text())
    kinds = [line["event"] for line in lines]
    assert kinds == ["start", *["frame"] * 4, "video", "video", "end"]
    assert {line["output"] for line in lines[1:5]} == {os.path.join("out", "a.mp4")}
    good, bad = lines[5:7]
    assert (good["status"], good["input"], good["reason"]) == ("done", "a.mp4", "")
    assert bad["status"] == "failed" and "b.mp4" in bad["reason"]
    words = ("blur", "a.mp4", "-o", "f.###.png", "--flow", "none", "--shutter", "720", "-q")
    assert make.inside(capsys, *words, "--log-json", "frames.log")[0] == 0
    found = [e for e in events((frames / "frames.log").read_text()) if e["event"] == "frame"]
    assert all(Path(line["output"]).is_file() for line in found) and len(found) == 4


def test_perceived_frames_scenes_and_vectors_are_logged(frames, capsys):
    runs = {
        "perceive": ("shot.####.exr", "-o", "seen.####.exr"),
        "render": ("crossing", "--size", "32x18", "-o", "scene.exr", "--method", "tap"),
        "vectors": ("shot.####.exr", "-o", "mv.####.exr", "--as", "rsmb"),
    }
    for command, words in runs.items():
        code, _, err = make.inside(capsys, command, *words, "-q", "--log-json", f"{command}.log")
        assert code == 0, err
        start, *middle, end = events((frames / f"{command}.log").read_text())
        assert start["command"] == command
        assert len(middle) == start["frames"] == end["frames"]["done"]
        assert all(Path(line["output"]).is_file() for line in middle)


@pytest.mark.full
def test_the_frames_of_a_farm_are_logged_with_their_reasons(frames, capsys):
    (frames / "shot.0002.exr").write_text("no frame")
    assert make.inside(capsys, *BLUR, "--workers", "2", "--log-json", "run.log")[0] == 1
    start, *middle, end = events((frames / "run.log").read_text())
    assert start["frames"] == 3
    assert sorted((line["number"], line["status"]) for line in middle) == [
        (1, "done"), (2, "failed"), (3, "done")]  # fmt: skip
    assert all(line["reason"] for line in middle if line["status"] == "failed")
    assert end["frames"] == {"done": 2, "skipped": 0, "failed": 1}
