"""Files give back what was written: EXR whole, stills within their bits, videos within loss."""

import io
import struct
from fractions import Fraction

import av
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

import make_frames as make
from wgmb import InputError
from wgmb.color.srgb import linear, srgb, to_display
from wgmb.io import exr, record, stills
from wgmb.output.output import Output
from wgmb.sequence import frame_file
from wgmb.sequence.frame_file import FrameFile

pytestmark = pytest.mark.fast

rng = np.random.default_rng(7)


# ---- EXR ------------------------------------------------------------------------------------

ATTRIBUTES = {
    "owner": ("string", "ünïcode".encode()),
    "none": ("string", b""),
    "anInt": ("int", struct.pack("<i", -7)),
    "pixelAspect2": ("float", struct.pack("<f", 1.5)),
    "aDouble": ("double", struct.pack("<d", 2.5)),
    "framesPerSecond": ("rational", struct.pack("<iI", 24000, 1001)),
    "timeCode": ("timecode", struct.pack("<II", 0x01020304, 5)),
    "keyCode": ("keycode", struct.pack("<7i", 1, 2, 3, 4, 5, 4, 64)),
    "chromaticities": ("chromaticities", struct.pack("<8f", *np.linspace(0.1, 0.8, 8))),
    "envmap": ("envmap", b"\1"),
    "preview": ("preview", struct.pack("<II", 2, 1) + bytes(range(8))),
    "aBox": ("box2f", struct.pack("<4f", 1, 2, 3, 4)),
    "worldToCamera": ("m44f", struct.pack("<16f", *range(16))),
    "aMatrix": ("m33d", struct.pack("<9d", *range(9))),
    "aPair": ("v2i", struct.pack("<2i", 3, -4)),
    "aPlace": ("v3d", struct.pack("<3d", 1, 2, 3)),
    "multiView": ("stringvector", struct.pack("<i4si5s", 4, b"left", 5, b"right")),
    "weights": ("floatvector", struct.pack("<3f", 1, 2, 3)),
    "cryptomatte/1a2b3c4/name": ("string", b"Crypto"),
    "ownKind": ("myOwnType", b"\1\2\3"),
}


def many_channels(height=48, width=64):
    """Half, float and uint, with every awkward value."""
    shape = (height, width)
    full = rng.standard_normal(shape).astype("f4")
    full.flat[:6] = np.nan, np.inf, -np.inf, 1e-42, -0.0, 3e38
    half = rng.standard_normal(shape).astype("f2")
    half.flat[:5] = np.nan, np.inf, -np.inf, 6e-8, -0.0
    ids = rng.integers(0, 2**32, shape, dtype=np.uint32)
    return {"R": half, "G": half[::-1].copy(), "B": half[:, ::-1].copy(), "Z": full, "id": ids}


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def again(path, tmp_path):
    """Read by wgmb, written by wgmb."""
    out = tmp_path / "again.exr"
    out.write_bytes(exr.encode(exr.read(path)))
    return out


def test_exr_channels_keep_type_and_bits(tmp_path):
    channels = many_channels()
    path = make.write_exr(tmp_path / "a.exr", channels)
    read = exr.read(path).channels()
    written = make.plain_read(again(path, tmp_path))
    assert read.keys() == written.keys() == channels.keys()
    for name, plane in channels.items():
        assert same_bits(read[name], plane), name
        assert same_bits(written[name], plane), name


@pytest.mark.parametrize(
    "compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"], ids=lambda c: c.lower()
)
def test_exr_of_every_lossless_compression_is_read(tmp_path, compression):
    channels = many_channels()
    kind = getattr(OpenEXR, f"{compression}_COMPRESSION")
    path = make.write_exr(tmp_path / "a.exr", channels, compression=kind)
    for name, plane in exr.read(path).channels().items():
        assert same_bits(plane, channels[name])


def test_exr_tiles_are_read_and_written_as_scan_lines(tmp_path):
    channels = many_channels(70, 90)
    header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    path = make.write_exr(tmp_path / "a.exr", channels, header)
    assert all(same_bits(exr.read(path).channels()[n], p) for n, p in channels.items())
    out = again(path, tmp_path)
    assert make.plain_header(out)["type"] == OpenEXR.scanlineimage
    assert all(same_bits(make.plain_read(out)[n], p) for n, p in channels.items())


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_exr_attributes_of_every_type_survive_to_the_byte(tmp_path, name):
    raw = {name: ATTRIBUTES[name]}
    path = make.add_attributes(make.write_exr(tmp_path / "a.exr", many_channels()), raw)
    stored = make.attribute_bytes(name, *ATTRIBUTES[name])
    assert stored in path.read_bytes()
    assert stored in again(path, tmp_path).read_bytes()


@pytest.mark.parametrize(
    ("data", "display"),
    [((10, 5, 73, 52), (0, 0, 99, 79)), ((-20, -7, 43, 40), (0, 0, 31, 31)),
     ((-64, -48, -1, -1), (5, 5, 9, 9))],
)  # fmt: skip
def test_exr_windows_survive(tmp_path, data, display):
    path = make.write_exr(tmp_path / "a.exr", many_channels(), data=data, display=display)
    part = exr.read(path).parts[0]
    assert (part.data_window, part.display_window, part.size) == (data, display, (64, 48))
    header = make.plain_header(again(path, tmp_path))
    for key, box in (("dataWindow", data), ("displayWindow", display)):
        assert tuple(np.concatenate(header[key]).tolist()) == box


def test_exr_parts_keep_names_order_windows_and_attributes(tmp_path):
    display = (0, 0, 99, 79)
    parts = [
        make.part(make.colors(make.picture(1)), {"owner": "a"}, name="rgba", display=display),
        make.part({"Z": np.ones((8, 9), "f4")}, {"owner": "b"}, name="depth", display=display,
                  data=(90, 70, 98, 77)),
        make.part(make.written("nuke", *make.motion(1)), name="mv", display=display),
    ]  # fmt: skip
    path = make.write_parts(tmp_path / "a.exr", parts)
    read = exr.read(path)
    assert [p.name for p in read.parts] == ["rgba", "depth", "mv"]
    assert {"rgba.R", "depth.Z", "mv.forward.u"} <= read.channels().keys()
    assert read.parts[1].data_window == (90, 70, 98, 77)
    twice = exr.read(again(path, tmp_path))
    assert [p.attributes["owner"] for p in twice.parts[:2]] == ["a", "b"]
    assert [p.data_window for p in twice.parts] == [p.data_window for p in read.parts]
    for name, plane in read.channels().items():
        assert same_bits(twice.channels()[name], plane)


def test_a_parts_name_that_its_channels_bear_is_not_said_twice(tmp_path):
    parts = [make.part({"a.Z": np.ones((4, 4), "f4")}, name="a"),
             make.part({"Z": np.ones((4, 4), "f4")}, name="b")]  # fmt: skip
    assert list(exr.read(make.write_parts(tmp_path / "a.exr", parts)).channels()) == ["a.Z", "b.Z"]


def test_an_empty_list_attribute_says_nothing_and_is_left_out(tmp_path):
    window = (0, 0, 3, 3)
    plane = {"Y": np.ones((4, 4), "f4")}
    part = exr.Part("", plane, {"noViews": [], "owner": "me"}, window, window)
    (tmp_path / "a.exr").write_bytes(exr.encode(exr.Exr(tmp_path, [part])))
    attributes = exr.read(tmp_path / "a.exr").parts[0].attributes
    assert attributes["owner"] == "me"
    assert "noViews" not in attributes


def test_the_header_alone_tells_windows_and_channel_names(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", many_channels(), {"owner": "me"}, data=(1, 2, 64, 49))
    header = exr.read(path, header_only=True)
    assert header.parts[0].size == (64, 48)
    assert header.parts[0].attributes["owner"] == "me"
    assert header.channels().keys() == many_channels().keys()
    assert all(plane.size == 0 for plane in header.channels().values())


def test_strided_channels_are_written_right(tmp_path):
    rgba = make.picture(3)
    window = (0, 0, 23, 31)
    turned = {c: rgba[::2, ::2, i].T.astype("f4") for i, c in enumerate("RGB")}
    views = {c: rgba.transpose(1, 0, 2)[::2, ::2, i] for i, c in enumerate("RGB")}
    part = exr.Part("", views, {}, window, window)
    (tmp_path / "a.exr").write_bytes(exr.encode(exr.Exr(tmp_path, [part])))
    for name, plane in make.plain_read(tmp_path / "a.exr").items():
        np.testing.assert_array_equal(plane, turned[name])


def test_what_is_too_large_for_half_is_held_to_its_largest():
    got = exr.to_half(np.array([1e9, -1e9, 65504, 70000, np.inf, 1.0], "f4"))
    np.testing.assert_array_equal(got, np.array([65504, -65504, 65504, 65504, 65504, 1], "f2"))


def test_a_result_replaces_the_picture_only(tmp_path):
    channels = many_channels() | {"A": np.ones((48, 64), "f4")}
    path = make.write_exr(tmp_path / "a.exr", channels, {"owner": "me"}, data=(-3, 4, 60, 51),
                          display=(0, 0, 59, 59))  # fmt: skip
    (source,) = frame_file.read([path], 1, None)
    result = make.picture(9)
    out = Output(tmp_path / "o.exr", settings={"shutter": 180}, numbers=[1])
    out.write(result, source)
    got, header = make.plain_read(tmp_path / "o.exr"), make.plain_header(tmp_path / "o.exr")
    assert got.keys() == channels.keys()
    for i, name in enumerate("RGBA"):
        assert same_bits(got[name], result[..., i].astype(channels[name].dtype))
    assert same_bits(got["Z"], channels["Z"])
    assert same_bits(got["id"], channels["id"])
    assert header["owner"] == "me"
    assert record.read((tmp_path / "o.exr").read_bytes()) == {"shutter": 180}
    assert header["dataWindow"][0].tolist() == [-3, 4]


# ---- stills ---------------------------------------------------------------------------------


def save(path, rgba, bits=8, settings="{}"):
    path.write_bytes(stills.encode(rgba, path.suffix, bits, settings))
    return path


def opaque():
    return make.picture(2)[..., :3]


def translucent():
    rgba = make.picture(2)
    rgba[..., 3] = np.linspace(0, 1, make.WIDTH)
    rgba[..., :3] *= rgba[..., 3:]
    return rgba


@pytest.mark.parametrize(
    ("suffix", "bits"), [(".png", 8), (".png", 16), (".tif", 8), (".tiff", 16)]
)
@pytest.mark.parametrize("size", [(48, 64), (1, 1), (1, 7), (5, 1), (31, 33)])
def test_integer_stills_come_back_within_half_a_step(tmp_path, suffix, bits, size):
    rgb = opaque()[: size[0], : size[1]]
    got = stills.read(save(tmp_path / f"a{suffix}", rgb, bits))
    assert got.shape == rgb.shape
    assert got.dtype == np.float32
    step = np.abs(srgb(got) - srgb(rgb)).max()
    assert step <= 0.6 / (2**bits - 1) + (1e-3 if bits == 8 else 1e-6)


@pytest.mark.parametrize(("suffix", "bits"), [(".png", 8), (".png", 16), (".tif", 8), (".tif", 16)])
def test_alpha_is_straight_in_the_file_and_premultiplied_here(tmp_path, suffix, bits):
    rgba = translucent()
    path = save(tmp_path / f"a{suffix}", rgba, bits)
    got = stills.read(path)
    np.testing.assert_allclose(got, rgba, atol=0.012 if bits == 8 else 1e-4)
    raw = tifffile.imread(path) if suffix == ".tif" else None
    if suffix == ".png" and bits == 8:
        raw = np.asarray(Image.open(path))
    if raw is not None:  # straight: the colour of what is half there is as bright as ever
        most = 2**bits - 1
        seen = rgba[..., 3] > 0.05
        want = srgb(make.picture(2)[..., :3])[seen]
        np.testing.assert_allclose(raw[..., :3][seen] / most, want, atol=0.02)


def test_png_of_16_bits_has_16(tmp_path):
    path = save(tmp_path / "a.png", np.linspace(0, 1, 3000, dtype="f4").reshape(20, 50, 3), 16)
    assert path.read_bytes()[24] == 16
    assert len(np.unique(stills.read(path))) > 2900


@pytest.mark.parametrize("suffix", [".jpg", ".jpeg"])
def test_jpeg_comes_back_within_its_loss(tmp_path, suffix):
    rgb = opaque()
    got = stills.read(save(tmp_path / f"a{suffix}", rgb))
    assert np.abs(srgb(got) - srgb(rgb)).mean() < 0.02
    assert got.shape == rgb.shape


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_float_tiff_is_linear_already(tmp_path, kind):
    rgba = (translucent() * 3).astype(kind)
    tifffile.imwrite(tmp_path / "a.tif", rgba, photometric="rgb", extrasamples=["assocalpha"])
    np.testing.assert_array_equal(stills.read(tmp_path / "a.tif"), rgba.astype("f4"))


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "I;16", "RGB", "RGBA"])
def test_png_of_every_mode_is_the_picture_it_shows(tmp_path, mode):
    shown = Image.fromarray((srgb(opaque()) * 255).astype("u1"))
    grey = np.asarray(shown)[..., 0]
    if mode == "I;16":
        image = Image.fromarray(grey.astype(np.uint16) * 257)
    elif mode == "LA":
        image = Image.merge("LA", [Image.fromarray(grey)] * 2)
    else:
        image = (Image.fromarray(grey) if mode in "1L" else shown).convert(mode)
    image.save(tmp_path / "a.png")
    want = np.asarray(
        image.convert("RGBA") if mode != "I;16" else Image.fromarray(grey).convert("RGBA")
    )
    light = linear(want[..., :3] / np.float32(255)) * (want[..., 3:] / np.float32(255))
    np.testing.assert_allclose(stills.read(tmp_path / "a.png")[..., :3], light, atol=2e-3)


@pytest.mark.parametrize("name", ["a.jpg", "a.tif"])
def test_pictures_that_are_not_grey_or_rgb_are_refused(tmp_path, name):
    Image.new("CMYK", (8, 8), (10, 20, 30, 40)).save(tmp_path / name)
    with pytest.raises(InputError, match=name):
        stills.read(tmp_path / name)


def test_a_tiff_of_palette_indices_is_refused_or_looked_up(tmp_path):
    shown = Image.fromarray((srgb(opaque()) * 255).astype("u1")).convert("P")
    shown.save(tmp_path / "a.tif")
    try:
        got = stills.read(tmp_path / "a.tif")
    except InputError:
        return
    want = np.asarray(shown.convert("RGB")) / np.float32(255)
    np.testing.assert_allclose(srgb(got[..., :3]), want, atol=0.01)


def test_light_and_display_values_undo_each_other():
    x = np.linspace(0, 1, 1001, dtype="f4")
    np.testing.assert_allclose(srgb(linear(x)), x, atol=1e-6)
    np.testing.assert_allclose(linear(np.float32([0.04045, 0.5])), [0.0031308, 0.2140411],
                               atol=1e-6)  # fmt: skip


def test_light_out_of_range_is_held_to_what_can_be_shown():
    rgb = np.array([[[np.inf, -np.inf, 9.0], [-1.0, 1e-9, 1.0]]], "f4")
    for bits in (8, 16):
        most = 2**bits - 1
        np.testing.assert_array_equal(to_display(rgb, bits),
                                      [[[most, 0, most], [0, 0, most]]])  # fmt: skip


# ---- video ----------------------------------------------------------------------------------


def decoded(path):
    with av.open(str(path)) as container:
        frames = [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]
        return frames, container.streams.video[0].average_rate, container.metadata


def smooth(n):
    """A picture that a codec keeps: no detail, and another colour in every frame."""
    y, x = np.mgrid[:48, :64] / 64
    return np.stack([0.2 + 0.6 * x, 0.2 + 0.6 * y, 0 * x + 0.1 * n, 0 * x + 1], 2).astype("f4")


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv", ".webm", ".gif"])
@pytest.mark.parametrize("size", [(48, 64), (47, 63)], ids=["even", "odd"])
def test_videos_hold_every_frame_in_its_colours(tmp_path, suffix, size):
    path = tmp_path / f"v{suffix}"
    frames = [smooth(n)[: size[0], : size[1]] for n in range(6)]
    out = Output(path, settings={"a": 1}, numbers=list(range(6)), fps=Fraction(25))
    for n, rgba in enumerate(frames):
        out.write(rgba, FrameFile(n, path, None, {}, {}))
    assert not path.exists()  # not before it is complete
    out.close()
    assert make.names_in(tmp_path) == [path.name]
    got, rate, metadata = decoded(path)
    assert len(got) == 6
    assert rate == 25
    even = tuple(s + s % 2 for s in size) if suffix in (".mp4", ".mkv") else size
    for shown, rgba in zip(got, frames, strict=True):
        assert shown.shape[:2] == even
        error = np.abs(shown[: size[0], : size[1]] / 255 - srgb(rgba[..., :3]))
        assert error.mean() < (0.05 if suffix == ".gif" else 0.02)
    assert "comment" not in metadata
    assert record.read_file(path)[0]["a"] == 1


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_an_abandoned_video_leaves_nothing(tmp_path, suffix):
    path = tmp_path / f"v{suffix}"
    out = Output(path, settings={}, numbers=[1, 2])
    out.write(smooth(1), FrameFile(1, path, None, {}, {}))
    out.abandon()
    assert make.names_in(tmp_path) == []


def test_png_bytes_hold_their_settings_as_a_sound_chunk(tmp_path):
    image = Image.open(io.BytesIO(stills.encode(opaque(), ".png", 8, '{"a": 1}')))
    image.load()
    assert image.text == {"wgmb": '{"a": 1}'}
