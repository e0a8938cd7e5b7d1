"""A resumed run skips finished frames and makes the others again; no file is lost, inputs least of
all."""

import io
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from wgmb.io import (
    atomic,
    exr,
    record,
    stills,
)
from wgmb.output.output import Output
from wgmb.sequence.clip import Clip
from wgmb.video.write.frames import FrameVideo


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Frames 1 to 6 as Blender writes them."""
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, 7))


@pytest.fixture
def own_shot(tmp_path):
    """Frames 1 to 5, which a test may change."""
    (tmp_path / "in").mkdir()
    return make.write_sequence(tmp_path / "in", range(1, 6))


def run(capsys, shot, folder, *options, suffix="exr"):
    return make.inside(capsys, "blur", shot, "-o", folder / f"b.####.{suffix}", *options)


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def newer(path) -> None:
    """Make a file a minute younger than it is."""
    later = path.stat().st_mtime + 60
    os.utime(path, (later, later))


# ---- an output is never an input ------------------------------------------------------------


@pytest.mark.parametrize("option", ["", "--resume", "--overwrite", "--resume --overwrite"])
@pytest.mark.parametrize("way", ["same", "linked folder", "other name of the folder", "in to out"])
def test_an_output_that_is_an_input_is_refused_before_anything_is_written(
    tmp_path, capsys, own_shot, option, way
):
    folder = tmp_path / "in"
    output = folder / "shot.####.exr"
    if way == "linked folder":
        (tmp_path / "link").symlink_to(folder)
        output = tmp_path / "link" / "shot.####.exr"
    elif way == "other name of the folder":
        output = tmp_path / "in" / ".." / "in" / "shot.####.exr"
    elif way == "in to out":  # an input is a link to where the output goes
        real = tmp_path / "out"
        real.mkdir()
        shutil.move(folder / "shot.0003.exr", real / "o.0003.exr")
        (folder / "shot.0003.exr").symlink_to(real / "o.0003.exr")
        output = real / "o.####.exr"
    before = {p: p.read_bytes() for p in tmp_path.rglob("*.exr")}
    code, out, err = make.inside(capsys, "blur", own_shot, "-o", output, *option.split())
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "is the input" in err
    assert {p: p.read_bytes() for p in tmp_path.rglob("*.exr")} == before


def test_a_frame_that_is_only_a_neighbour_is_an_input_too(tmp_path, capsys, own_shot):
    target = tmp_path / "in" / "shot.0003.exr"
    words = ("blur", own_shot, "-o", target, "--frames", "4", "--overwrite")
    code, _, err = make.inside(capsys, *words)
    assert code == 2
    assert "is the input" in err


def test_masks_layers_from_beside_and_other_commands_pictures_are_inputs_too(tmp_path, capsys):
    mask = tmp_path / "m.png"
    Image.new("L", (64, 48), 255).save(mask)
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    also = make.write_exr(tmp_path / "also.exr", {"extra.X": np.ones((48, 64), "f4")})
    still = tmp_path / "s.png"
    Image.new("RGB", (64, 48)).save(still)
    before = contents(tmp_path)
    for words in (
        ("blur", path, "-o", mask, "--holdout", mask),
        ("blur", path, "-o", also, "--also", also),
        ("perceive", path, "-o", path),
        ("info", still, "--also", path, "-o", still),
    ):
        code, _, err = make.inside(capsys, *words, "--overwrite")
        assert code == 2, words
        assert "is the input" in err
    assert contents(tmp_path) == before


# ---- done is whole, of the same settings, made of the same ----------------------------------


def damage(path, how: str) -> None:
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    if how.endswith("%"):
        data = data[: len(data) * int(how[:-1]) // 100]
    elif how == "200 zeros":
        data[middle : middle + 200] = bytes(200)
    elif how == "zeros from 3000":
        data[3000:] = bytes(len(data) - 3000)
    elif how == "one bit":
        data[middle] ^= 1
    elif how == "empty":
        data = b""
    path.write_bytes(bytes(data))


@pytest.mark.parametrize("suffix", ["exr", "png", "tif", "jpg"])
def test_resume_redoes_what_is_gone_or_damaged_and_nothing_else(tmp_path, capsys, shot, suffix):
    run(capsys, shot, tmp_path, "--method", "tap", suffix=suffix)
    whole = contents(tmp_path)
    kept = tmp_path / f"b.0006.{suffix}"
    time = kept.stat().st_mtime_ns
    (tmp_path / f"b.0001.{suffix}").unlink()
    ways = ("50%", "99%", "200 zeros", "zeros from 3000", "one bit", "empty")
    for some in (ways[:3], ways[3:]):
        for number, how in enumerate(some, 2):
            damage(tmp_path / f"b.{number:04d}.{suffix}", how)
        assert run(capsys, shot, tmp_path, "--method", "tap", "--resume", suffix=suffix)[0] == 0
        assert contents(tmp_path) == whole
    assert kept.stat().st_mtime_ns == time


def test_another_programs_file_fails_that_frame_and_stays(tmp_path, capsys, shot):
    out = tmp_path
    out.joinpath("b.0002.exr").write_bytes(b"precious")
    make.write_exr(out / "b.0004.exr", make.frame(4))
    before = contents(out)
    code, _, err = run(capsys, shot, out, "--resume")
    assert code == 1
    for number in (2, 4):
        assert f"wgmb: frame {number} failed: {out}/b.{number:04d}.exr exists and was not" in err
    after = contents(out)
    assert before.items() <= after.items()
    assert len(after) == 6
    code, _, err = run(capsys, shot, out, "--resume", "--overwrite")
    assert code == 0
    assert "4 already done" in err


def test_a_file_that_appears_during_the_run_is_not_replaced(tmp_path, shot):
    clip = Clip(shot)
    output = Output(tmp_path / "b.####.exr", numbers=[1])
    (tmp_path / "b.0001.exr").write_bytes(b"precious")
    source = clip.source(1)
    with pytest.raises(ValueError, match=r"b\.0001\.exr"):
        output.write(source.rgba, source)
    assert contents(tmp_path) == {"b.0001.exr": b"precious"}


def test_resume_redoes_frames_whose_neighbour_changed_even_to_an_older_file(
    tmp_path, capsys, own_shot
):
    out = tmp_path / "out"
    run(capsys, own_shot, out)
    changed = tmp_path / "in" / "shot.0003.exr"
    time = changed.stat().st_mtime - 1000
    channels = {k: 0.95 * v if "Combined" in k else v for k, v in make.frame(3).items()}
    make.write_exr(changed, channels)
    os.utime(changed, (time, time))
    code, _, err = run(capsys, own_shot, out, "--resume")
    assert code == 0
    assert err.startswith("3 frames")
    run(capsys, own_shot, tmp_path / "fresh")
    assert contents(out) == contents(tmp_path / "fresh")


def test_resume_redoes_a_frame_whose_neighbour_could_not_be_read(tmp_path, capsys, own_shot):
    out = tmp_path / "out"
    path = tmp_path / "in" / "shot.0003.exr"
    data, times = path.read_bytes(), (path.stat().st_atime_ns, path.stat().st_mtime_ns)
    path.write_bytes(data[:-100] + bytes(100))  # as long, and as old, as it is when it is whole
    os.utime(path, ns=times)
    assert run(capsys, own_shot, out)[0] == 1
    path.write_bytes(data)
    os.utime(path, ns=times)
    code, _, err = run(capsys, own_shot, out, "--resume")
    assert code == 0
    assert err.startswith("3 frames")


def test_resume_redoes_frames_of_another_curve_file(tmp_path, capsys, shot):
    curve = tmp_path / "c.csv"
    for text, frames in (("0,1\n1,1\n", 2), ("0,1\n1,1\n", 0), ("0,0\n1,1\n", 2)):
        curve.write_text(text)
        code, _, err = run(capsys, shot, tmp_path, "--frames", "1-2", "--curve", curve, "--resume")
        assert code == 0
        assert err.startswith(f"{frames} frames")


def test_some_frames_are_the_same_bits_as_all_of_them(tmp_path, capsys):
    """Frames 1 to 4 stand still, so that only the others tell that y is upside down."""
    for n in range(1, 9):
        channels = make.frame(n, "nuke", (0.0, 0.0) if n < 5 else make.VELOCITY)
        for name in ("forward.v", "backward.v"):
            channels[name] = -channels[name]
        if n > 6:
            del channels["Z"]  # gather is for the sequence, whatever the frame
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    pattern, parts = tmp_path / "s.####.exr", tmp_path / "parts"
    run(capsys, pattern, tmp_path / "whole")
    for frames in ("5-6", "1-2", "3-4"):
        run(capsys, pattern, parts, "--frames", frames)
    whole = contents(tmp_path / "whole")
    assert contents(parts).items() <= whole.items()
    assert len(contents(parts)) == 6


@pytest.mark.parametrize(
    "suffix", ["exr", "png", *(pytest.param(s, marks=pytest.mark.full) for s in ("tif", "jpg"))]
)
def test_resume_redoes_frames_of_other_settings(tmp_path, capsys, shot, suffix):
    frames = ("--frames", "1-3")
    run(capsys, shot, tmp_path / "want", *frames, "--shutter", 90, suffix=suffix)
    run(capsys, shot, tmp_path / "got", *frames, suffix=suffix)
    code, _, err = run(
        capsys, shot, tmp_path / "got", *frames, "--shutter", 90, "--resume", suffix=suffix
    )
    assert code == 0
    assert err.startswith("3 frames")
    assert contents(tmp_path / "got") == contents(tmp_path / "want")
    _, _, err = run(
        capsys, shot, tmp_path / "got", *frames, "--shutter", 90, "--resume", suffix=suffix
    )
    assert err.startswith("0 frames")


def test_resume_redoes_stills_of_other_bits(tmp_path, capsys, shot):
    run(capsys, shot, tmp_path, "--frames", "1", suffix="png")
    run(capsys, shot, tmp_path, "--frames", "1", "--bits", 16, "--resume", suffix="png")
    assert (tmp_path / "b.0001.png").read_bytes()[24] == 16


def test_resume_redoes_frames_whose_input_is_newer(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    run(capsys, pattern, tmp_path / "out", "--method", "tap")
    newer(tmp_path / "shot.0002.exr")
    _, _, err = run(capsys, pattern, tmp_path / "out", "--resume", "--method", "tap")
    assert "1 frame in" in err


@pytest.mark.parametrize("option", ["--also", "--camera", "--holdout", "--scale"])
def test_resume_redoes_frames_whose_other_files_are_newer(tmp_path, capsys, option):
    pattern = make.write_depth_sequence(tmp_path, (1, 2))
    camera = make.write_cameras(tmp_path / "cam.json", (1, 2, 3))
    Image.new("L", (64, 48), 255).save(tmp_path / "m.png")
    also = make.write_exr(tmp_path / "also.exr", {"extra.X": np.ones((48, 64), "f4")})
    given = {"--camera": camera, "--also": also}.get(option, tmp_path / "m.png")
    options = [option, given] + ([] if option == "--camera" else ["--camera", camera])
    assert run(capsys, pattern, tmp_path / "out", *options)[0] == 0
    newer(given)
    _, _, err = run(capsys, pattern, tmp_path / "out", *options, "--resume")
    assert "2 frames" in err


def test_resume_gives_what_an_unbroken_run_gives_even_where_the_first_frame_says_nothing(
    tmp_path, capsys
):
    """Frames 1 and 2 stand still, so their vectors cannot be tested; later ones are wrong."""
    for n in range(1, 6):
        channels = make.frame(n, "nuke", (0.0, 0.0) if n < 3 else make.VELOCITY)
        for name in ("forward.v", "backward.v"):
            channels[name] = -channels[name]
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    pattern, out = tmp_path / "s.####.exr", tmp_path / "out"
    run(capsys, pattern, out)
    whole = contents(out)
    (out / "b.0004.exr").unlink()
    run(capsys, pattern, out, "--resume")
    assert contents(out) == whole


# ---- the record -----------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".exr", ".png", ".tif", ".jpg"])
def test_a_record_is_read_back_and_any_changed_bit_of_the_file_is_noticed(tmp_path, suffix):
    content = {"shutter": 180.0, "name": 'ä "\\', "files": [["a", 1, 2]]}
    text = record.blank(content)
    if suffix == ".exr":
        data = exr.encode(exr.new(make.picture(1), {record.KEY: text}))
    else:
        data = stills.encode(make.picture(1), suffix, 8, text)
    sealed = b"".join(record.seal(data, text))
    assert record.read(sealed) == content
    assert record.read(data) is None
    (tmp_path / f"a{suffix}").write_bytes(sealed)
    read = exr.read if suffix == ".exr" else stills.read
    read(tmp_path / f"a{suffix}")
    rng = np.random.default_rng(5)
    for at in (*range(16), *rng.integers(0, len(sealed), 60), len(sealed) - 1):
        damaged = bytearray(sealed)
        damaged[at] ^= 1 << int(rng.integers(8))
        assert record.read(bytes(damaged)) is None, at
    assert record.read(sealed[:-1]) is None
    assert record.read(sealed + b"\0") is None


def test_the_text_in_a_png_keeps_the_checksum_that_the_format_asks_for():
    text = record.blank({"a": 1})
    png = b"".join(record.seal(stills.encode(make.picture(1), ".png", 8, text), text))
    with Image.open(io.BytesIO(png)) as image:
        image.verify()
        assert image.info[record.KEY].startswith('{"seal": "')


# ---- temporary files ------------------------------------------------------------------------


def test_temporary_names_are_of_one_process_and_no_two_are_alike(tmp_path):
    names = {atomic.temporary_name(tmp_path / "o.0001.exr").name for _ in range(100)}
    assert len(names) == 100
    assert all(f"-{os.getpid()}-" in n and n.startswith(".o.0001.exr.") for n in names)
    longest = atomic.temporary_name(tmp_path / ("ä" * 120 + ".exr"))
    os.close(atomic.create(longest))


def test_a_temporary_file_is_not_written_through_a_link(tmp_path):
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    temporary = tmp_path / ".o.part"
    temporary.symlink_to(victim)
    with pytest.raises(OSError, match=r"o\.exr"):
        atomic.write_file(tmp_path / "o.exr", b"new", temporary=temporary)
    assert victim.read_bytes() == b"precious"
    assert not (tmp_path / "o.exr").exists()


def test_only_what_dead_processes_of_this_host_left_of_our_names_is_swept(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    name = atomic.temporary_name(tmp_path / "o.0001.exr").name
    own = f"-{os.getpid()}-"
    host = name.split(own)[0].rpartition(".")[2]
    left = tmp_path / name.replace(own, f"-{ended.pid}-")
    kept = [
        tmp_path / name,  # of this process
        tmp_path / name.replace(own, "-1-"),  # of a process that lives
        tmp_path / name.replace(own, f"-{ended.pid}-").replace(host, "elsewhere"),
        tmp_path / name.replace(own, f"-{ended.pid}-").replace("o.0001", "p.0001"),
        tmp_path / ".o.0001.exr.part",
    ]
    for path in (left, *kept):
        path.write_bytes(b"")
    locked = tmp_path / name.replace(own, f"-{ended.pid}-").replace(".part", "")
    locked = locked.with_name(locked.name[:-8] + "0123abcd.part")
    descriptor = atomic.create(locked)  # of a process of another container, which lives
    atomic.sweep(tmp_path, ["o.0001.exr", "o.0002.exr"])
    os.close(descriptor)
    assert sorted(tmp_path.iterdir()) == sorted([*kept, locked])


# ---- when nothing can be written any more ---------------------------------------------------


def test_a_run_whose_folder_is_gone_stops(tmp_path, capsys, monkeypatch):
    pattern = make.write_sequence(tmp_path, range(1, 21))
    out = tmp_path / "out"
    write = Output.write_views

    def removed_at_4(self, results, *more):
        if results[0].source.number == 4:
            shutil.rmtree(out)
        write(self, results, *more)

    monkeypatch.setattr(Output, "write_views", removed_at_4)
    code, _, err = run(capsys, pattern, out, "--method", "tap")
    assert code == 1
    said, why = err.splitlines(), "No such file or directory"
    assert [s.split(" failed")[0] for s in said[:3]] == [f"wgmb: frame {n}" for n in (4, 5, 6)]
    assert said[3] == f"wgmb: stopped: {out}: {why}; 14 other frames not written"


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_a_video_that_cannot_go_on_says_so_once(tmp_path, capsys, monkeypatch, suffix):
    def full(self, *picture):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(FrameVideo, "add", full)
    pattern = make.write_sequence(tmp_path, range(1, 21))
    target = tmp_path / "out" / f"v.{suffix}"
    code, _, err = make.inside(capsys, "blur", pattern, "-o", target, "--method", "tap")
    assert code == 1
    assert err.count("No space left") <= 2
    assert "19 other frames" in err
    assert make.names_in(tmp_path / "out") == []
