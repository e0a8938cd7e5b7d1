"""Faults that one line tells before any frame is read, and counts in words."""

import pytest

import make_frames as make
from wgmb.cli.console import cuts_told
from wgmb.errors import counted
from wgmb.io.frame_numbers import numbered

FRAMES = "tap, tiles, gather, fusion, reproject"


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    """Frames with vectors and depth; one without vectors, one without depth; pictures."""
    folder = tmp_path_factory.mktemp("shots")
    channels = make.frame(1)
    no_depth = {name: plane for name, plane in channels.items() if "Depth" not in name}
    make.write_exr(folder / "flat.0001.exr", no_depth)
    make.write_exr(folder / "flat.0002.exr", no_depth)
    no_vectors = {name: plane for name, plane in channels.items() if "Vector" not in name}
    make.write_exr(folder / "one.exr", no_vectors)
    make.write_sequence(folder, range(1, 4))
    return folder


@pytest.mark.parametrize(
    "pattern, options, said",
    [("shot.####.exr", "--holdout mate.png", "mate.png: no such file"),
     ("shot.####.exr", "--holdout mate.####.png", "mate.####.png: no such frames"),
     ("shot.####.exr", "--scale mate.png:0.5", "mate.png: no such file"),
     ("shot.####.exr", "--method volume",
      f"method 'volume' draws built-in scenes; for frames: {FRAMES}"),
     ("shot.####.exr", "--method tapp",
      f"unknown method 'tapp'; available: {FRAMES}; did you mean 'tap'?"),
     ("flat.####.exr", "--method gather",
      "flat.####.exr has no depth (layers: ViewLayer.Combined, ViewLayer.Vector); gather needs it, "
      "tap and tiles do not"),
     ("one.exr", "",
      "one.exr has no motion vectors (layers: ViewLayer.Combined, ViewLayer.Depth); name several "
      "frames, such as 'shot.####.exr', to find the motion in their pictures, or give a --camera "
      "file for frames with depth")],
)  # fmt: skip
@pytest.mark.parametrize("command", ["blur", "job"])
def test_one_line_tells_it_before_any_frame_is_blurred(
    command, pattern, options, said, shots, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(shots)
    more = ["-j", tmp_path / "job.json"] if command == "job" else []
    line = [command, pattern, "-o", tmp_path / "o.####.exr", *options.split(), *more]
    assert make.inside(capsys, *line) == (2, "", f"wgmb: {said}\n")
    assert make.names_in(tmp_path) == []


@pytest.mark.parametrize("line", ["render crossing", "blur shot.####.exr"])
def test_one_frame_is_one_frame(line, shots, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(shots)
    more = ["--frames", "2", "--samples", "1", "--method", "tap"]
    more += ["--size", "64x36"] if "render" in line else []
    *_, said = make.inside(capsys, *line.split(), "-o", tmp_path / "o.####.exr", *more)
    assert said.startswith("1 frame in ")


@pytest.mark.fast
def test_numbers_of_things_are_words():
    assert [counted(n, "frame") for n in (0, 1, 2)] == ["0 frames", "1 frame", "2 frames"]
    assert numbered([9]) == "frame 9"
    assert cuts_told({4}, "frame") == "camera cut before frame 4"
    assert cuts_told({9, 4}, "picture") == "camera cuts before pictures 4,9"
    assert numbered([9, 10, 12], "picture") == "pictures 9-10,12"
