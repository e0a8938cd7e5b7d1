"""EXR files: each compression, fewer layers, sizes that differ."""

import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import make_frames as make
from wgmb import Clip, InputError, Output
from wgmb.io import exr, record

LOSSLESS = ("none", "rle", "zips", "zip", "piz")
LOSSY = ("pxr24", "b44", "b44a", "dwaa", "dwab")
CRYPTO = {"cryptomatte/1a2b3c4/name": "Crypto"}


def channels(rows=40, columns=70) -> dict[str, np.ndarray]:
    """Half, float and uint, smooth where lossy kinds are good."""
    y, x = np.mgrid[:rows, :columns].astype("f4")
    smooth = {c: (0.5 + 0.3 * np.sin(x / 9 + i) * np.cos(y / 7)) for i, c in enumerate("RGB")}
    made = {name: plane.astype("f2") for name, plane in smooth.items()}
    made["Z"] = (5 + x / 11 + y / 13).astype("f4")
    made["id"] = (x * 1e7).astype("u4")
    return made


@pytest.mark.parametrize("name", exr.COMPRESSIONS)
def test_each_compression_round_trips(tmp_path, name):
    given = channels()
    file = exr.read(make.write_exr(tmp_path / "a.exr", given, compression=OpenEXR.RLE_COMPRESSION))
    out = tmp_path / "o.exr"
    out.write_bytes(exr.encode(file, name))
    assert make.plain_header(out)["compression"] == exr.COMPRESSIONS[name]
    got = {k: plane for part in exr.read(out).parts for k, plane in part.channels.items()}
    for channel, plane in given.items():
        assert got[channel].dtype == plane.dtype
        if name in LOSSLESS or channel in ("id", "Z"):
            np.testing.assert_array_equal(got[channel], plane)
        else:
            np.testing.assert_allclose(got[channel], plane, atol=0.02)
    assert set(exr.COMPRESSIONS) == {*LOSSLESS, *LOSSY}


def test_same_is_the_compression_of_each_part(tmp_path):
    kinds = (OpenEXR.PIZ_COMPRESSION, OpenEXR.DWAA_COMPRESSION, OpenEXR.ZIPS_COMPRESSION)
    parts = [make.part(channels(), name=f"p{i}", compression=k) for i, k in enumerate(kinds)]
    out = tmp_path / "o.exr"
    out.write_bytes(exr.encode(exr.read(make.write_parts(tmp_path / "a.exr", parts)), "same"))
    got = [make.plain_header(out, i)["compression"] for i in range(3)]
    assert got == list(kinds)


def test_an_unknown_compression_is_refused_with_those_there_are():
    with pytest.raises(InputError, match=r"none.*dwab.*same.*'zipp'"):
        exr.encode(exr.new(np.zeros((4, 4, 3), "f4")), "zipp")


@pytest.mark.parametrize("name", [*LOSSY, "same"])
@pytest.mark.parametrize("kind", ["f2", "f4"])
def test_lossy_compression_leaves_data_as_it_is(tmp_path, name, kind):
    noise = np.random.default_rng(0).normal(0, 300, (40, 70)).astype(kind)
    data = {f"V.Vector.{c}": noise for c in "XYZW"} | {f"N.{c}": noise for c in "XYZ"}
    data |= {"Z": noise, "motionvector.R": noise, "motionvector.G": noise}
    data |= {f"Crypto00.{c}": noise for c in "RGBA"}
    path = make.write_exr(
        tmp_path / "a.exr", channels() | data, CRYPTO, compression=OpenEXR.DWAA_COMPRESSION
    )
    before = exr.read(path).parts[0].channels
    out = tmp_path / "o.exr"
    out.write_bytes(exr.encode(exr.read(path), name, lambda layer: layer == "motionvector"))
    parts = exr.read(out).parts
    after = {k: plane for part in parts for k, plane in part.channels.items()}
    assert after.keys() == before.keys()
    assert [k for k in data if not np.array_equal(after[k], before[k])] == []
    assert {part.compression for part in parts} <= {parts[0].compression, OpenEXR.ZIP_COMPRESSION}
    assert {"R", "G", "B"} <= parts[0].channels.keys()
    assert out.stat().st_size and parts[0].compression != OpenEXR.ZIP_COMPRESSION


def test_a_lossy_picture_without_data_stays_in_one_part(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", channels())
    assert [part.name for part in exr.read(path).parts] == [""]
    (tmp_path / "o.exr").write_bytes(exr.encode(exr.read(path), "dwaa"))
    assert len(exr.read(tmp_path / "o.exr").parts) == 1


def test_a_cryptomatte_whose_part_bears_its_name_is_known(tmp_path):
    ids = dict.fromkeys("RGBA", np.random.default_rng(0).random((40, 70), "f4"))
    parts = [make.part(channels(), name="rgb"), make.part(ids, CRYPTO, name="Crypto00")]
    file = exr.read(make.write_parts(tmp_path / "a.exr", parts))
    (tmp_path / "o.exr").write_bytes(exr.encode(file, "dwaa"))
    first, second = exr.read(tmp_path / "o.exr").parts
    assert first.compression == OpenEXR.DWAA_COMPRESSION and first.name == "rgb"
    assert all(np.array_equal(second.channels[c], ids[c]) for c in "RGBA")


def blur(capsys, pattern, out, *options):
    return make.inside(capsys, "blur", pattern, "-o", out, *options)


def test_the_command_line_takes_a_compression(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    plain, out = tmp_path / "p.0001.exr", tmp_path / "o.0001.exr"
    assert blur(capsys, pattern, tmp_path / "p.####.exr")[0] == 0
    assert blur(capsys, pattern, tmp_path / "o.####.exr", "--compression", "piz")[0] == 0
    assert make.plain_header(plain)["compression"] == OpenEXR.ZIP_COMPRESSION
    assert make.plain_header(out)["compression"] == OpenEXR.PIZ_COMPRESSION
    got = make.plain_read(out)
    for name, plane in make.plain_read(plain).items():
        assert got[name].tobytes() == plane.tobytes()


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [("o.####.exr", ("--compression", "zipp"), "zipp"),
     ("o.####.exr", ("--layers", "some"), "some"),
     ("o.####.png", ("--compression", "piz"), "piz"), ("o.mp4", ("--compression", "same"), "same")],
)  # fmt: skip
def test_what_cannot_be_written_so_is_one_line_and_2(tmp_path, capsys, name, options, says):
    pattern = make.write_sequence(tmp_path, (1,))
    code, out, err = blur(capsys, pattern, tmp_path / "out" / name, *options)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert not (tmp_path / "out").exists()


def test_the_picture_alone_is_written_where_no_layers_are_wanted(tmp_path, capsys):
    crypto = {f"Crypto00.{c}": np.ones((48, 64), "f4") for c in "RGBA"}
    attributes = CRYPTO | {"owner": "me"}
    path = make.write_exr(tmp_path / "a.exr", make.frame(1) | crypto, attributes,
                          data=(-9, 5, 54, 52), display=(0, 0, 79, 59))  # fmt: skip
    assert blur(capsys, path, tmp_path / "all.exr")[0] == 0
    assert blur(capsys, path, tmp_path / "o.exr", "--layers", "picture")[0] == 0
    got, want = make.plain_read(tmp_path / "o.exr"), make.plain_read(tmp_path / "all.exr")
    assert sorted(got) == [f"ViewLayer.Combined.{c}" for c in "ABGR"]
    assert all(got[name].tobytes() == want[name].tobytes() for name in got)
    header = make.plain_header(tmp_path / "o.exr")
    assert header["owner"] == "me"
    assert '"layers": "picture"' in header["wgmb"]
    assert not [name for name in header if name.startswith("cryptomatte")]
    assert tuple(np.concatenate(header["dataWindow"]).tolist()) == (-9, 5, 54, 52)


def test_of_many_parts_the_pictures_stays(tmp_path):
    parts = [make.part({"Z": np.ones((48, 64), "f4")}, {"owner": "b"}, name="depth"),
             make.part(make.colors(make.picture(1)), {"owner": "a"}, name="rgba")]  # fmt: skip
    (source,) = map(Clip(make.write_parts(tmp_path / "a.exr", parts)).source, [0])
    out = Output(tmp_path / "o.exr", numbers=[0], settings={"a": 1}, layers="picture")
    told = {"accepted": np.ones((48, 64), "f4")}
    out.write(make.picture(2), source, told)
    (part,) = exr.read(tmp_path / "o.exr").parts
    assert part.name == "rgba"
    assert sorted(part.channels) == ["A", "B", "G", "R", "confidence.accepted"]
    np.testing.assert_array_equal(part.channels["R"], make.picture(2)[..., 0].astype("f2"))
    assert part.attributes["owner"] == "a"
    assert record.read((tmp_path / "o.exr").read_bytes()) == {"a": 1}


@pytest.mark.parametrize("options", [("--layers", "picture"), ("--compression", "zips")])
def test_resume_redoes_frames_that_were_written_otherwise(tmp_path, capsys, options):
    pattern, out = make.write_sequence(tmp_path, (1, 2)), tmp_path / "o.####.exr"
    assert blur(capsys, pattern, out)[0] == 0
    assert blur(capsys, pattern, out, *options, "--resume")[2].startswith("2 frames")
    assert blur(capsys, pattern, out, *options, "--resume")[2].startswith("0 frames")


def test_passes_without_layers_are_refused(tmp_path, capsys):
    code, _, err = make.inside(capsys, "render", "crossing", "--passes", "--layers", "picture",
                               "-o", tmp_path / "o.exr")  # fmt: skip
    assert code == 2
    assert "--passes" in err


def test_frames_of_another_size_are_named_at_the_end(tmp_path, capsys):
    for n, rows in ((1, 48), (2, 24), (3, 48), (4, 24), (5, 48)):
        make.write_exr(tmp_path / f"s.{n:04d}.exr", {k: v[:rows] for k, v in make.frame(n).items()})
    out = tmp_path / "o.####.exr"
    code, _, err = blur(capsys, tmp_path / "s.####.exr", out, "--method", "tap")
    assert code == 0
    assert "frames of another size than most, 64 x 48: 2,4: 64 x 24\n" in err
    code, _, err = blur(capsys, tmp_path / "s.####.exr", out, "--frames", "1,3", "--overwrite")
    assert (code, "another size" in err) == (0, False)


def test_windows_that_differ_within_one_display_are_no_other_size(tmp_path, capsys):
    for n, left in ((1, 0), (2, 10)):
        cut = {k: v[:, left:] for k, v in make.frame(n).items()}
        make.write_exr(tmp_path / f"s.{n:04d}.exr", cut, data=(left, 0, 63, 47),
                       display=(0, 0, 63, 47))  # fmt: skip
    code, _, err = blur(capsys, tmp_path / "s.####.exr", tmp_path / "o.####.exr")
    assert (code, "another size" in err) == (0, False)


EVERY = [name for name in dir(OpenEXR) if name.endswith("_COMPRESSION")]


@pytest.mark.parametrize("name", EVERY)
def test_same_keeps_the_ids_of_a_cryptomatte_in_all_that_the_library_knows(tmp_path, name):
    rng = np.random.default_rng(7)
    ids = rng.integers(0, 2**32, (64, 64), np.uint32).view("f4")
    given = channels(64, 64) | {f"Crypto00.{c}": ids for c in "RGBA"}
    plain = exr.read(make.write_exr(tmp_path / "a.exr", given, CRYPTO))
    plain.parts[0].compression = getattr(OpenEXR, name)
    out = tmp_path / "o.exr"
    try:
        out.write_bytes(exr.encode(plain, "same"))
    except InputError as error:
        assert "cannot be written" in str(error)
        return
    planes = {k: v for part in exr.read(out).parts for k, v in part.channels.items()}
    assert all(planes[f"Crypto00.{c}"].tobytes() == ids.tobytes() for c in "RGBA")


@pytest.mark.parametrize("value", [(0, 0), (1, 0), (-(2**31), 0)])
def test_an_attribute_that_is_divided_by_0_is_left_out_and_named(tmp_path, value):
    path = tmp_path / "a.exr"
    OpenEXR.File({"framesPerSecond": Fraction(24, 1), "owner": "me"}, channels()).write(str(path))
    data, lead = path.read_bytes(), b"framesPerSecond\0rational\0\x08\0\0\0"
    at = data.index(lead) + len(lead)
    path.write_bytes(data[:at] + struct.pack("<iI", *value) + data[at + 8 :])
    for header_only in (True, False):
        part = exr.read(path, header_only=header_only).parts[0]
        assert part.attributes["owner"] == "me" and "framesPerSecond" not in part.attributes
        assert part.notes == ("attribute framesPerSecond has a denominator of 0, and is left out",)
    np.testing.assert_array_equal(part.channels["R"], channels()["R"])


def with_levels(path: Path, channels: dict[str, np.ndarray], mode: OpenEXR.LevelMode) -> Path:
    """An uncompressed file of tiles with all their levels; those below the largest hold 7."""
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = size = 32
    tiles.mode = mode
    planes = dict(sorted(channels.items()))
    header = {"type": OpenEXR.tiledimage, "tiles": tiles, "compression": OpenEXR.NO_COMPRESSION}
    OpenEXR.File(header, dict(planes)).write(str(path))
    height, width = next(iter(planes.values())).shape
    across, down = ([n >> k for k in range(n.bit_length())] for n in (width, height))
    places = [(i, j) for j in range(len(down)) for i in range(len(across))]
    if mode == OpenEXR.MIPMAP_LEVELS:
        places = [(k, k) for k in range(max(len(across), len(down)))]
    chunks = []
    for i, j in places:
        shape = down[min(j, len(down) - 1)], across[min(i, len(across) - 1)]
        level = [p if i == j == 0 else np.full(shape, 7, p.dtype) for p in planes.values()]
        for y in range(0, shape[0], size):
            for x in range(0, shape[1], size):
                rows = zip(*(plane[y : y + size, x : x + size] for plane in level), strict=True)
                data = b"".join(row.tobytes() for planes_row in rows for row in planes_row)
                head = struct.pack("<5i", x // size, y // size, i, j, len(data))
                chunks.append(head + data)
    written = path.read_bytes()
    lead = written[: _end_of(written)]
    begin = len(lead) + 8 * len(chunks)
    starts = np.cumsum([begin, *map(len, chunks[:-1])]).astype("<u8")
    path.write_bytes(lead + starts.tobytes() + b"".join(chunks))
    return path


def _end_of(data: bytes) -> int:
    """The first byte behind the header of a one-part file."""
    at = 8
    while data[at]:
        kind = data.index(b"\0", at) + 1
        size = data.index(b"\0", kind) + 1
        at = size + 4 + int.from_bytes(data[size : size + 4], "little")
    return at + 1


@pytest.mark.parametrize("mode", [OpenEXR.MIPMAP_LEVELS, OpenEXR.RIPMAP_LEVELS])
def test_of_tiles_in_several_sizes_the_largest_is_read(tmp_path, mode):
    channels = make.frame(5, "nuke")
    file = exr.read(with_levels(tmp_path / "a.exr", channels, mode))
    for name, plane in channels.items():
        np.testing.assert_array_equal(file.parts[0].channels[name], plane)
    assert file.parts[0].notes == ("of tiles in several sizes the largest is used",)
