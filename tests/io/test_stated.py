"""Stills that state more than they hold, or unpack to more than their picture, are refused."""

import functools
import io
import lzma
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image, JpegImagePlugin

from wgmb import Clip, InputError
from wgmb.io import limits, stills

pytestmark = pytest.mark.fast

LONG = 64 << 20  # bytes: far more than any of these pictures takes
MOST = 16 << 20


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(*more: bytes, pixels: bytes = bytes(25) * 8, size=(8, 8), interlace: int = 0) -> bytes:
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", *size, 8, 2, 0, 0, interlace))
    rest = chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(more) + rest


def tiff(*, strip: bytes, compression: int, **other: int) -> bytes:
    """16 x 16 grey pixels of 8 bits in one strip; `other`: tags, such as t278=16."""
    tags = {256: 16, 257: 16, 258: 8, 259: compression, 262: 1, 273: 8, 277: 1, 278: 16,
            279: len(strip)} | {int(name[1:]): value for name, value in other.items()}  # fmt: skip
    if 322 in tags:
        tags = {t: v for t, v in tags.items() if t not in (273, 278, 279)}
    strip += bytes(len(strip) % 2)
    entries = b"".join(struct.pack("<HHII", t, 4, 1, tags[t]) for t in sorted(tags))
    listed = struct.pack("<H", len(tags)) + entries + bytes(4)
    return b"II*\0" + struct.pack("<I", 8 + len(strip)) + strip + listed


def scans(count: int) -> bytes:
    """A progressive JPEG of 64 x 64 grey pixels with so many scans, all but the first empty."""

    def segment(marker: int, body: bytes) -> bytes:
        return struct.pack(">BBH", 0xFF, marker, len(body) + 2) + body

    one = b"\1" + bytes(15)
    head = segment(0xDB, b"\0" + b"\1" * 64) + segment(0xC2, struct.pack(">BHHB", 8, 64, 64, 1))
    head = head[:-1] + b"\1\1\x11\0"
    head = head.replace(b"\xff\xc2\x00\x08", b"\xff\xc2\x00\x0b")
    tables = segment(0xC4, b"\x00" + one + b"\0") + segment(0xC4, b"\x10" + one + b"\xe0")
    first = segment(0xDA, b"\1\1\0\0\0\0") + bytes(8)
    empty = segment(0xDA, b"\1\1\0\1\x3f\0") + b"\x3f\xff\0"
    return b"\xff\xd8" + head + tables + first + empty * (count - 1) + b"\xff\xd9"


LZMA = lzma.compress(bytes(LONG))
RUNS = b"\x81\0" * (LONG // 128)
TAGS, MANY = (struct.pack("<HHH", count, 256, 4) for count in (9, 65535))
REFUSED = {
    "idat.png": (lambda: png(pixels=bytes(LONG)), "IDAT inflates to more than 200 bytes"),
    "short.png": (lambda: png(size=(9, 8)), "IDAT inflates to 200 bytes, the picture has 224"),
    "profile.png": (lambda: png(chunk(b"iCCP", b"C\0\0" + zlib.compress(bytes(LONG)))),
                    "its colour profile inflates to more than 4194304 bytes"),
    "palette.png": (lambda: png(chunk(b"PLTE", bytes(3000))), "PLTE has 3000 bytes, at most 768"),
    "cut.png": (lambda: png()[:-2], "cut off before its end"),
    "strip.tif": (lambda: tiff(strip=zlib.compress(bytes(LONG)), compression=8),
                  "a strip inflates to more than 256 bytes"),
    "lzma.tif": (lambda: tiff(strip=LZMA, compression=34925), "a strip inflates to more than 256"),
    "tile.tif": (lambda: tiff(strip=zlib.compress(bytes(LONG)), compression=8, t322=65520,
                              t323=65520, t324=8, t325=100), "would decode to 4095 MB"),
    "tags.tif": (lambda: tiff(strip=bytes(256), compression=1).replace(TAGS, MANY),
                 "its list of tags is beyond its end"),
    "deep.tif": (lambda: tiff(strip=bytes(256), compression=1, t32997=9), "has a depth of 9"),
    "lzw.tif": (lambda: tiff(strip=bytes(256), compression=5), "LZW compression needs the package"),
    "webp.tif": (lambda: tiff(strip=bytes(256), compression=50001), "WEBP compression is not read"),
    "scans.jpg": (lambda: scans(101), "has over 100 scans"),
    "chunks.png": (lambda: png(chunk(b"tEXt", b"") * 66_000), "has over 65,536 chunks"),
    "segments.jpg": (lambda: scans(1)[:2] + b"\xff\xfe\0\2" * 66_000 + scans(1)[2:],
                     "has over 65,536 segments"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_states_or_unpacks_to_more_than_its_picture_is_refused(tmp_path, name):
    write, message = REFUSED[name]
    path = tmp_path / name
    path.write_bytes(write())
    stills.require(path.suffix)
    tracemalloc.start()
    with pytest.raises(InputError, match=message) as error:
        stills.read(path)
    assert tracemalloc.get_traced_memory()[1] < MOST
    tracemalloc.stop()
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_runs_of_packbits_beyond_the_picture_are_not_unpacked(tmp_path):
    path = tmp_path / "runs.tif"
    path.write_bytes(tiff(strip=RUNS, compression=32773))
    tracemalloc.start()
    assert not stills.read(path).any()
    assert tracemalloc.get_traced_memory()[1] < MOST
    tracemalloc.stop()


def test_a_usual_number_of_scans_is_read(tmp_path):
    (tmp_path / "a.jpg").write_bytes(scans(100))
    assert stills.read(tmp_path / "a.jpg").shape == (64, 64, 3)


def test_texts_of_a_png_are_not_unpacked(tmp_path):
    path = tmp_path / "a.png"
    texts = [chunk(b"zTXt", b"C%d\0\0" % i + zlib.compress(bytes(LONG))) for i in range(4)]
    path.write_bytes(png(*texts, pixels=(b"\0" + b"\xff" * 24) * 8))
    stills.require(".png")
    tracemalloc.start()
    assert (stills.read(path) == 1).all()
    assert tracemalloc.get_traced_memory()[1] < MOST
    tracemalloc.stop()


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
@pytest.mark.parametrize("size", [(1, 1), (5, 3), (64, 48)])
def test_pngs_of_every_mode_are_as_long_as_their_headers_say(tmp_path, mode, size):
    rng = np.random.default_rng(7)
    path = tmp_path / "a.png"
    Image.fromarray(rng.integers(0, 256, (*size[::-1], 3), "u1")).convert(
        "L" if mode == "I;16" else mode
    ).convert(mode).save(path)
    assert stills.read(path).shape[:2] == size[::-1]


@pytest.mark.parametrize("size", [(1, 1), (2, 9), (5, 3), (64, 48)])
def test_interlaced_pngs_are_read(tmp_path, size):
    passes = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
              (0, 1, 1, 2))  # fmt: skip
    picture = np.random.default_rng(7).integers(0, 256, (*size[::-1], 3), "u1")
    rows = [b"\0" + row.tobytes() for x, y, dx, dy in passes
            for row in picture[y::dy, x::dx] if row.size]  # fmt: skip
    path, plain = tmp_path / "a.png", tmp_path / "b.png"
    path.write_bytes(png(pixels=b"".join(rows), size=size, interlace=1))
    Image.fromarray(picture).save(plain)
    assert np.array_equal(stills.read(path), stills.read(plain))


@pytest.mark.parametrize(
    "options",
    [{}, {"tile": (16, 16)}, {"bigtiff": True}, {"byteorder": ">"},
     {"compression": "zlib"}, {"compression": "lzma"}, {"compression": "zlib", "tile": (32, 16)},
     {"compression": "zlib", "predictor": True}, {"compression": "zlib", "rowsperstrip": 5}],
    ids=str,
)  # fmt: skip
@pytest.mark.parametrize("kind", ["u1", "u2", "f4"])
def test_tiffs_of_every_form_are_read_as_before(tmp_path, kind, options):
    if options.get("predictor") and kind == "f4":
        options = options | {"predictor": None}  # needs a package
    samples = np.random.default_rng(7).integers(0, 256, (48, 64, 3)).astype(kind)
    path, plain = tmp_path / "a.tif", tmp_path / "b.tif"
    tifffile.imwrite(path, samples, photometric="rgb", **options)
    tifffile.imwrite(plain, samples, photometric="rgb", metadata=None)
    assert np.array_equal(stills.read(path), stills.read(plain))


def test_a_tiff_of_two_pages_is_refused(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((2, 8, 8, 3), "u1"), photometric="rgb")
    with pytest.raises(InputError, match="must be a single image, has more pages"):
        stills.read(path)


def test_jpegs_with_profiles_and_texts_are_read_as_without(tmp_path):
    shown = Image.fromarray(np.random.default_rng(7).integers(0, 256, (48, 64, 3), "u1"))
    for name, options in (("a.jpg", {}), ("b.jpg", {"comment": b"x" * 999, "exif": bytes(99),
                                                    "icc_profile": bytes(99_999)})):  # fmt: skip
        stream = io.BytesIO()
        shown.save(stream, "jpeg", quality=90, restart_marker_rows=1, **options)
        (tmp_path / name).write_bytes(stream.getvalue())
    assert np.array_equal(stills.read(tmp_path / "a.jpg"), stills.read(tmp_path / "b.jpg"))


FLAT = 1500, 1000  # px, of one colour: 24 MB of light, and 150 MB where its motion is searched
LAYERS = {"picture": "RGB", "motion": ("R", "G", "B", "Vector.X", "Vector.Y")}


def write_flat(path, layers="picture") -> None:
    """A file of a few KB, whose last pixels are damaged."""
    grey = np.full(FLAT[::-1], 51, np.uint8)
    if path.suffix == ".exr":
        plane = np.full(FLAT[::-1], 0.2, np.float16)
        OpenEXR.File({}, dict.fromkeys(LAYERS[layers], plane)).write(str(path))
    elif path.suffix == ".tif":
        options = {"compression": "zlib", "rowsperstrip": FLAT[1], "photometric": "rgb"}
        tifffile.imwrite(path, np.stack([grey] * 3, axis=2), **options)
    else:
        Image.fromarray(grey).convert("RGB").save(path, quality=50)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".exr"])
def test_a_picture_whose_motion_would_take_too_much_is_refused_by_its_header(
    tmp_path, suffix, monkeypatch
):
    monkeypatch.setattr(JpegImagePlugin.JpegImageFile, "load", lambda _: 1 // 0)
    path = tmp_path / f"a.0001{suffix}"
    write_flat(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] + bytes(len(data) // 2 - 64) + data[-64:])
    with pytest.raises(InputError, match=r"to blur its pictures of 1500 x 1000 takes 144 MB"):
        Clip(str(path), max_mb=400).source(1)
    with pytest.raises(InputError, match=r"damaged|not a readable image|could be read"):
        Clip(str(path), max_mb=577).source(1)


def test_a_frame_with_vectors_is_judged_by_its_own_pixels(tmp_path):
    write_flat(tmp_path / "a.0001.exr", "motion")
    assert Clip(str(tmp_path / "a.0001.exr"), max_mb=400).source(1).size == FLAT


@pytest.mark.parametrize("size", [(3840, 2160), (5000, 4000), (1021, 4099)])
def test_the_limit_that_a_refusal_names_suffices_and_no_less(size):
    law = functools.partial(limits.check_held, Path("a.mp4"), size, limits.GATHERED, 1000)
    with pytest.raises(InputError, match=r"`max_mb=\d+` allows it$") as refused:
        law(limits.MAX_MB)
    enough = int(str(refused.value).rpartition("max_mb=")[2].partition("`")[0])
    law(enough)
    with pytest.raises(InputError):
        law(enough - 1)
