"""Damaged, absurd and foreign files: an error that names the file, and order."""

import io
import os

import numpy as np
import pytest
import tifffile

import make_frames as make
from soaking.damage import judge, spoiled
from soaking.kinds import KINDS
from wgmb import InputError
from wgmb.io import exr, stills

PICTURES = (
    *("exr-zip", "exr-piz", "exr-none", "png-8", "png-16"),
    *("jpeg", "tiff-8", "tiff-float", "tiff-tiled"),
)


def sound(kind, folder):
    """A file of a kind of the soak's catalogue: its path, under another name, and its bytes."""
    suffix = KINDS[kind].suffix
    KINDS[kind].write(folder / f"whole{suffix}")
    return folder / f"bad{suffix}", (folder / f"whole{suffix}").read_bytes()


@pytest.mark.parametrize("kind", PICTURES)
def test_a_file_cut_off_anywhere_is_refused_by_name(tmp_path, kind):
    path, whole = sound(kind, tmp_path)
    # The end of a PNG after its pixels is empty, and so is what follows a TIFF's last strip.
    for length in np.linspace(0, len(whole) - 13, 60).astype(int):
        path.write_bytes(whole[:length])
        outcome = judge(kind, path)
        assert (outcome["what"], outcome["why"]) == ("refused", ""), length


@pytest.mark.parametrize("kind", PICTURES)
def test_a_damaged_file_is_read_or_refused_by_name_and_nothing_else(tmp_path, kind):
    path, whole = sound(kind, tmp_path)
    for number in range(150):
        path.write_bytes(spoiled("mutated", kind, whole, 3, number))
        assert judge(kind, path)["why"] == "", number


@pytest.mark.parametrize("kind", ["exr-zip", "png-8", "png-16"])
def test_damaged_pixels_are_refused_and_not_passed_on(tmp_path, kind):
    """ZIP and PNG carry checksums: one wrong bit among the pixels is found."""
    path, whole = sound(kind, tmp_path)
    rng = np.random.default_rng(4)
    for at in rng.integers(len(whole) // 3, len(whole) - 100, 40):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        with pytest.raises(InputError):
            KINDS[kind].read(path)


@pytest.mark.parametrize(
    "box",
    [(0, 0, 32767, 32767), (0, 0, 63, 32767), (0, 0, 2**31 - 1, 2**31 - 1),
     (-(2**31), -(2**31), 2**31 - 1, 2**31 - 1), (5, 5, 0, 0)],
)  # fmt: skip
def test_absurd_exr_sizes_are_refused_at_once(tmp_path, box):
    path, data = sound("exr-zip", tmp_path)
    start = b"dataWindow\0box2i\0\x10\0\0\0"
    at = data.index(start) + len(start)
    path.write_bytes(data[:at] + np.array(box, "<i4").tobytes() + data[at + 16 :])
    with pytest.raises(InputError, match=r"bad\.exr"):
        exr.read(path)


@pytest.mark.parametrize(
    ("suffix", "size"),
    [(".png", (65500, 65500)), (".png", (20000, 20000)), (".png", (0, 0)),
     (".jpg", (65500, 65500)), (".jpg", (20000, 20000)), (".jpg", (0, 0)),
     (".tif", (30000, 30000)), (".tif", (0, 0))],
)  # fmt: skip
def test_absurd_still_sizes_are_refused_by_name(tmp_path, suffix, size):
    path = tmp_path / f"a{suffix}"
    width, height = size
    data = stills.encode(make.picture(1)[..., :3], suffix, 8, "{}")
    if suffix == ".png":
        data = data[:16] + width.to_bytes(4, "big") + height.to_bytes(4, "big") + data[24:]
    elif suffix == ".jpg":
        at = data.index(b"\xff\xc0") + 5
        data = data[:at] + height.to_bytes(2, "big") + width.to_bytes(2, "big") + data[at + 4 :]
    else:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            tags = [file.pages.first.tags[t].offset for t in ("ImageWidth", "ImageLength")]
        changed = bytearray(data)
        for at, value in zip(tags, size, strict=True):
            changed[at + 2 : at + 12] = np.array([4, 1, 0, value, 0], "<u2")[:5].tobytes()
            changed[at + 8 : at + 12] = value.to_bytes(4, "little")
        data = bytes(changed)
    path.write_bytes(data)
    with pytest.raises(InputError, match=path.name):
        stills.read(path)


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg", "a.tif"])
@pytest.mark.parametrize("what", ["nothing", "empty", "folder", "text", "fifo"])
def test_what_is_no_picture_is_refused_by_name(tmp_path, name, what):
    path = tmp_path / name
    if what == "empty":
        path.write_bytes(b"")
    elif what == "folder":
        path.mkdir()
    elif what == "text":
        path.write_text("not a picture\n" * 50)
    elif what == "fifo":
        os.mkfifo(path)
    with pytest.raises(InputError, match=name):
        (exr if path.suffix == ".exr" else stills).read(path)


@pytest.mark.parametrize("kind", ["exr-zip", "png-8", "tiff-8", "tiff-tiled", "jpeg"])
def test_a_damaged_frame_is_one_line_without_native_chatter(tmp_path, capfd, kind):
    path, whole = sound(kind, tmp_path)
    path.write_bytes(whole[:-400])
    code, out, err = make.inside(capfd, "info", path)
    assert (code, out) == (2, "")
    (line,) = make.error_lines(err)
    assert line.startswith(f"wgmb: {path}: ")


def test_one_bad_frame_is_reported_and_the_rest_is_done(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, range(1, 6))
    bad = tmp_path / "shot.0003.exr"
    bad.write_bytes(bad.read_bytes()[:3000])
    out = tmp_path / "out"
    code, said, err = make.inside(capsys, "blur", pattern, "-o", out / "o.####.exr")
    assert (code, said) == (1, "")
    assert make.names_in(out) == [f"o.{n:04d}.exr" for n in (1, 2, 4, 5)]
    failed = [line for line in make.error_lines(err) if "failed: " in line]
    assert len(failed) == 1
    assert failed[0].startswith("wgmb: frame 3 failed: ")
    assert str(bad) in failed[0]
    assert "1 of 5 frames failed" in err


@pytest.mark.parametrize("kind", ["a.tif", "b.png", "c.jpg"])
def test_one_bad_still_is_reported_and_the_rest_is_done(tmp_path, capsys, kind):
    suffix = kind[1:]
    for n in (1, 2, 3):
        data = stills.encode(make.picture(n), suffix, 8, "{}")
        (tmp_path / f"s.{n:04d}{suffix}").write_bytes(data[: len(data) // (2 if n == 2 else 1)])
        make.write_exr(tmp_path / f"mv.{n:04d}.exr", make.written("nuke", *make.motion(n)))
    code, _, err = make.inside(capsys, "blur", tmp_path / f"s.####{suffix}", "--also",
                               tmp_path / "mv.####.exr", "-o", tmp_path / "o.####.exr")  # fmt: skip
    assert code == 1
    assert f"wgmb: frame 2 failed: {tmp_path}/s.0002{suffix}" in err
    assert [n for n in make.names_in(tmp_path) if n.startswith("o")] == ["o.0001.exr", "o.0003.exr"]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("convention", ["nuke", "blender"])
def test_bad_pixels_are_reported_and_do_not_spread(tmp_path, capsys, bad, convention):
    channels = make.frame(1, convention)
    for i, plane in enumerate(channels.values()):
        plane[3 + 2 * i, 5:7] = bad
    path = make.write_exr(tmp_path / "a.exr", channels)
    code, _, err = make.inside(capsys, "blur", path, "-o", tmp_path / "o.exr")
    assert code == 0
    assert "not finite" in err
    assert "in color" in err
    assert "in motion" in err or "in to_next" in err
    got = make.plain_read(tmp_path / "o.exr")
    lead = "ViewLayer.Combined." if convention == "blender" else ""
    assert all(np.isfinite(got[lead + c].astype("f4")).all() for c in "RGBA")
