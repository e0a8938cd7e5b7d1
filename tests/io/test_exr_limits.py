"""EXR files that would unpack to gigabytes are refused by their headers."""

import struct
import subprocess
import sys
import textwrap
import tracemalloc

import numpy as np
import OpenEXR
import pytest

import make_frames as make
from wgmb import InputError
from wgmb.cli.app import main
from wgmb.io import exr, exr_headers, limits, stills


def promising(folder, width: int, height: int) -> tuple:
    """A small EXR whose header promises a picture of this size."""
    data = make.write_exr(folder / "whole.exr", make.frame(1)).read_bytes()
    start = b"dataWindow\0box2i\0\x10\0\0\0"
    at = data.index(start) + len(start)
    box = np.array([0, 0, width - 1, height - 1], "<i4").tobytes()
    path = folder / "bomb.exr"
    path.write_bytes(data[:at] + box + data[at + 16 :])
    return path


@pytest.mark.parametrize("size", [(16384, 16384), (8000, 8000), (6000, 6000)])
def test_what_would_unpack_to_gigabytes_is_refused_by_its_header(tmp_path, monkeypatch, size):
    path = promising(tmp_path, *size)
    plain = OpenEXR.File

    def header_alone(*arguments, **options):
        assert options.get("header_only")
        return plain(*arguments, **options)

    monkeypatch.setattr(OpenEXR, "File", header_alone)
    with pytest.raises(InputError, match=r"bomb\.exr.* MB.*`max_mb=\d+` allows it") as error:
        exr.read(path)
    assert f"{size[0]} x {size[1]}" in str(error.value)
    assert exr.read(path, header_only=True).parts[0].size == size


def test_the_limit_that_the_error_names_lets_the_file_in(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    with pytest.raises(InputError, match="`max_mb=1` "):
        exr.read(path, max_mb=0.05)
    exr.read(path, max_mb=1)
    (tmp_path / "a.png").write_bytes(stills.encode(make.picture(1), ".png", 8, "{}"))
    with pytest.raises(InputError, match=r"a\.png: image of 64 x 48.*`max_mb=1` "):
        stills.read(tmp_path / "a.png", max_mb=0.04)
    stills.read(tmp_path / "a.png", max_mb=1)


@pytest.mark.parametrize(
    ("size", "count", "stored", "fits"),
    [((7680, 4320), 4, 600_000, True),  # black
     ((3840, 2160), 16, 600_000, True),
     ((3840, 2160), 100, 500 << 20, True),
     ((16384, 16384), 3, 3_200_000, False),
     ((16384, 16384), 3, 500 << 20, True),
     ((32767, 32767), 4, 1 << 40, False)],
)  # fmt: skip
def test_black_frames_fit_into_the_limit_and_bombs_do_not(tmp_path, size, count, stored, fits):
    promised = limits.unpacked(size, count)
    if fits:
        limits.check(tmp_path, str(size), promised, stored, limits.MAX_MB)
        return
    with pytest.raises(InputError, match="max_mb") as error:
        limits.check(tmp_path, str(size), promised, stored, limits.MAX_MB)
    named = float(str(error.value).split("max_mb=")[1].split("`")[0])
    limits.check(tmp_path, str(size), promised, stored, named)


def test_the_command_line_raises_the_limit(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1, 2))
    for command in (("info", pattern), ("blur", pattern, "-o", tmp_path / "o.####.exr")):
        code, out, err = make.inside(capsys, *command, "--max-mb", 0.1)
        assert (code, out) != (0, "")
        assert f"{tmp_path}/shot.0001.exr: image of 64 x 48" in err
        assert make.inside(capsys, *command, "--max-mb", 1)[0] == 0


def test_too_many_channels_are_refused(tmp_path):
    dot = np.zeros((1, 1), "f2")
    path = make.write_exr(tmp_path / "a.exr", {f"c{i}.x": dot for i in range(4097)})
    with pytest.raises(InputError, match=r"a\.exr: 4097 channels; at most 4096"):
        exr.read(path)


SHORT = """
    import resource, sys
    import av  # before the limit, so that it is the pixels that lack memory
    from wgmb import InputError
    from wgmb.io import exr, stills
    small, damaged, large, png = sys.argv[1:]
    exr.read(small)
    used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    for more, path in ((20, large), (20, png), (200, damaged), (200, large)):
        resource.setrlimit(resource.RLIMIT_AS, (used + (more << 20), resource.RLIM_INFINITY))
        try:
            (exr if path.endswith(".exr") else stills).read(path)
            print("read")
        except InputError as error:
            print(error)
"""


def test_want_of_memory_is_told_apart_from_damage(tmp_path):
    black = np.zeros((2000, 2500), "f4")
    large = make.write_exr(tmp_path / "large.exr", dict.fromkeys("RGB", black))
    small = make.write_exr(tmp_path / "small.exr", make.frame(1))
    damaged, png = tmp_path / "damaged.exr", tmp_path / "large.png"
    damaged.write_bytes(small.read_bytes()[:-2000])
    png.write_bytes(stills.encode(np.stack([black] * 3, 2), ".png", 8, "{}"))
    line = [sys.executable, "-c", textwrap.dedent(SHORT), small, damaged, large, png]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    first, second, third, fourth = done.stdout.splitlines()
    assert first == f"{large}: not enough memory for 57 MB of pixels"
    assert second == f"{png}: not enough memory for its pixels"
    assert third.startswith(f"{damaged}: damaged or cut off: ")
    assert fourth == "read"


def test_a_description_holds_no_more_than_the_file_does(tmp_path, capsys):
    """The picture was put together once more, only to count its bad pixels."""
    planes = {c: np.zeros((1000, 1000), np.float32) for c in "RGB"}
    planes["R"][7, 5], planes["G"][7, 5], planes["B"][900, 3] = np.nan, np.inf, -np.inf
    window = (0, 0, 999, 999)
    path = tmp_path / "a.exr"
    path.write_bytes(exr.encode(exr.Exr(path, [exr.Part("", planes, {}, window, window)])))
    assert main(["info", str(path)]) == 0  # modules are loaded
    tracemalloc.start()
    try:
        assert main(["info", str(path)]) == 0
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    said = capsys.readouterr().out
    assert "not finite or not in front of the camera: 2 pixels of color" in said
    assert peak < 30e6, peak  # 12 MB are stored; it was 39


def deep(path, samples: int = 2, **attributes):
    """A deep EXR of 16 x 8 pixels, each with so many samples of R, G, B, A and Z."""
    planes = {name: np.empty((8, 16), object) for name in "RGBAZ"}
    for plane in planes.values():
        for place in np.ndindex(*plane.shape):
            plane[place] = np.full(samples, 0.5, "f4")
    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
    OpenEXR.File(header | attributes, planes).write(str(path))
    return path


def test_the_samples_of_deep_pixels_are_counted_behind_a_header_of_any_length(tmp_path):
    path = deep(tmp_path / "a.exr", 400, comment="x" * (17 << 20))
    with pytest.raises(InputError, match="deep, would decode to"):
        exr.read(path, max_mb=1)
    assert exr.read(path).parts[0].channels["Z"].shape == (8, 16)


@pytest.mark.parametrize(
    ("offset", "message"),
    [(0, "a chunk is at 0 of"), (1 << 40, "a chunk is at 1099511627776 of"),
     (300, "no chunk|bytes of a chunk")],
)  # fmt: skip
def test_deep_samples_that_cannot_be_counted_are_refused(tmp_path, monkeypatch, offset, message):
    path = deep(tmp_path / "a.exr")
    data = path.read_bytes()
    header = OpenEXR.File(str(path), header_only=True).parts[0].header
    with open(path, "rb") as file:
        _, _, at = exr_headers.read(file)
    assert header["chunkCount"] == 8
    path.write_bytes(data[:at] + struct.pack("<Q", offset) + data[at + 8 :])
    plain = OpenEXR.File

    def header_alone(*arguments, **options):
        assert options.get("header_only")
        return plain(*arguments, **options)

    monkeypatch.setattr(OpenEXR, "File", header_alone)
    with pytest.raises(InputError, match=rf"a\.exr: its deep samples cannot be counted.*{message}"):
        exr.read(path)


def test_too_many_tiles_are_refused_by_the_header(tmp_path):
    """Tiles of a pixel each take the library seconds in which it hears no Ctrl-C."""
    path = tmp_path / "tiles.exr"
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 1
    plane = np.zeros((257, 256), np.float16)
    OpenEXR.File({"type": OpenEXR.tiledimage, "tiles": tiles}, {"Y": plane}).write(str(path))
    with pytest.raises(InputError, match=r"tiles\.exr: 65,792 tiles; at most 65,536"):
        exr.read(path, header_only=True)
