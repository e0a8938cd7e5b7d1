"""Pictures that are stored otherwise than as flat R, G, B: chroma, grey, levels, deep pixels."""

import struct

import numpy as np
import OpenEXR
import pytest

import make_frames as make
import raw_exr
from wgmb import Clip, InputError
from wgmb.io import chroma, deep, exr
from wgmb.sequence.layers import names as layers
from wgmb.sequence.layers import vectors

REC709 = np.array([0.2126, 0.7152, 0.0722])
AP1 = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)


def blur(capsys, path, out, *options) -> str:
    """Messages of `wgmb blur` about one frame that it blurs."""
    code, _, err = make.inside(capsys, "blur", path, "-o", out, *options)
    assert code == 0, err
    return err


# ---- luminance and chroma -------------------------------------------------------------------

TAPS = {1: 0.627123, 3: -0.186077, 5: 0.087929, 7: -0.043159, 9: 0.019597, 11: -0.007540,
        13: 0.002128}  # fmt: skip


def slow_line(stored, count: int) -> list[float]:
    """Stored values at 0, 2, 4, ... and the filter's between them, the ends repeated."""
    line = []
    for at in range(count):
        if at % 2 == 0:
            line.append(float(stored[at // 2]))
            continue
        total = 0.0
        for distance, tap in TAPS.items():
            for there in (at - distance, at + distance):
                total += tap * float(stored[min(max(there // 2, 0), len(stored) - 1)])
        line.append(total)
    return line


def slow_rgb(y, ry, by, shares):
    """The twin: pixel by pixel, without the limit of saturation."""
    height, width = y.shape
    planes = []
    for stored in (ry, by):
        rows = [slow_line(row, width) for row in stored]
        columns = [slow_line([row[x] for row in rows], height) for x in range(width)]
        planes.append(np.array(columns).T)
    made = np.zeros((height, width, 3))
    for i, j in np.ndindex(height, width):
        r, b = ((plane[i, j] + 1) * y[i, j] for plane in planes)
        g = (y[i, j] - r * shares[0] - b * shares[2]) / shares[1]
        made[i, j] = r, g, b
    return made


def saturation(one) -> float:
    return 1 - min(one) / max(one) if max(one) > 0 else 0.0


def slow_held_back(made, shares):
    """The twin of the limit."""
    height, width, _ = made.shape
    held = made.copy()
    for i, j in np.ndindex(height, width):
        near = [(i + a, j + b) for a in (-1, 1) for b in (-1, 1)]
        near = [(min(max(a, 0), height - 1), min(max(b, 0), width - 1)) for a, b in near]
        mean = min(sum(saturation(made[at]) for at in near) / 4, 1)
        own, most = saturation(made[i, j]), 1 - (1 - mean) / 4
        if own > mean and own > most:
            top = made[i, j].max()
            less = np.maximum(top - (top - made[i, j]) * most / own, 0)
            held[i, j] = less * (made[i, j] @ shares) / (less @ shares)
    return held


@pytest.mark.parametrize("size", [(14, 10), (40, 6), (2, 2)])
def test_chroma_is_filtered_as_the_slow_twin_does(size):
    rng = np.random.default_rng(0)
    width, height = size
    half = height // 2, width // 2
    y = rng.random((height, width), "f4") + 0.1
    ry, by = (rng.random(half, "f4") - 0.4 for _ in "rb")
    shares = chroma.weights()
    wholes = tuple(chroma.whole(c, (2, 2)) for c in (ry, by))
    got = chroma.rgb(y, wholes, shares)
    want = slow_held_back(slow_rgb(y, ry, by, shares), shares)
    np.testing.assert_allclose(got, want, atol=2e-4)
    np.testing.assert_allclose(got @ shares, y, rtol=2e-3)


def test_without_chroma_a_picture_is_grey_to_the_bit():
    y = np.random.default_rng(1).random((5, 7), "f4")
    none = np.zeros((5, 7), "f4")
    for plane in np.moveaxis(chroma.rgb(y, (none, none), chroma.weights()), 2, 0):
        np.testing.assert_array_equal(plane, y)


def test_weights_are_the_row_of_luminance_of_the_primaries():
    np.testing.assert_allclose(chroma.weights(), REC709, atol=1e-4)
    np.testing.assert_allclose(chroma.weights(AP1), (0.27223, 0.67408, 0.05369), atol=1e-4)
    xyz = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)  # X, Y and Z themselves
    np.testing.assert_allclose(chroma.weights(xyz), (0, 1, 0), atol=1e-6)


@pytest.mark.parametrize("wrong", [(0,) * 8, (0.3, 0.3) * 4, (1, 0, 1, 0, 0, 0, 0.3, 0), "red"])
def test_chromaticities_of_no_colour_space_are_refused(wrong):
    with pytest.raises(InputError, match="no colour space"):
        chroma.weights(wrong)


def smooth(width: int, height: int) -> np.ndarray:
    y, x = np.mgrid[:height, :width].astype("f4")
    waves = [0.5 + 0.4 * np.sin(x / 17 + y / 23 + c) for c in (0.0, 1.1, 2.5)]
    return np.stack(waves, 2)


def as_chroma(rgb: np.ndarray) -> dict:
    """Channels of the file for a picture, every second chroma of every second row."""
    y = rgb @ REC709.astype("f4")
    ry, by = ((rgb[..., i] - y) / y for i in (0, 2))
    return {"Y": (y.astype("f2"), 1, 1), "RY": (ry[::2, ::2].astype("f2"), 2, 2),
            "BY": (by[::2, ::2].astype("f2"), 2, 2)}  # fmt: skip


def test_a_file_of_luminance_and_chroma_is_its_coloured_twin(tmp_path, capsys):
    size = 64, 48
    rgb = smooth(*size)
    path = raw_exr.write_sampled(tmp_path / "a.exr", as_chroma(rgb), size)
    source = Clip(path).source(0)
    assert source.color == ["R", "G", "B"]
    assert np.abs(source.rgba - rgb).mean() < 0.007
    shape = size[::-1]
    vectors = {"velocity.x": np.full(shape, 6, "f4"), "velocity.y": np.zeros(shape, "f4")}
    more = make.write_exr(tmp_path / "v.exr", vectors)
    out = tmp_path / "o.exr"
    said = blur(capsys, path, out, "--also", more, "--method", "tap")
    assert said.count("luminance and chroma (Y, RY, BY) become R, G, B in half floats\n") == 1
    written = make.plain_read(out)
    assert set(written) == {"R", "G", "B"}
    assert {plane.dtype for plane in written.values()} == {np.dtype("f2")}


def test_chroma_takes_its_weights_from_the_file_and_belongs_to_a_view(tmp_path):
    rgb = np.random.default_rng(3).random((6, 8, 1), "f4").repeat(3, 2)
    rgb[..., 0] *= 1.25
    y = rgb @ np.array([0.27223, 0.67408, 0.05369], "f4")
    planes = {"Y": (y.astype("f4"), 1, 1)}
    for c, i in (("RY", 0), ("BY", 2)):
        planes[c] = (((rgb[..., i] - y) / y).astype("f4"), 1, 1)
    eye = {f"right.{name}": plane for name, plane in planes.items()}
    given = raw_exr.attribute("chromaticities", "chromaticities", struct.pack("<8f", *AP1))
    views = b"".join(struct.pack("<i", len(v)) + v for v in (b"left", b"right"))
    stereo = raw_exr.attribute("multiView", "stringvector", views)
    black = {c: (np.zeros((6, 8), "f2"), 1, 1) for c in "RGB"}
    path = raw_exr.write_sampled(tmp_path / "a.exr", black | eye, (8, 6), given, stereo)
    source = Clip(path).source(0, "right")
    np.testing.assert_allclose(source.rgba, rgb, atol=2e-3)
    assert source.attributes["chromaticities"] == pytest.approx(AP1)


@pytest.mark.parametrize("step", [(2, 2), (4, 4), (1, 2), (3, 1)])
def test_any_other_channel_gets_the_value_that_is_stored_for_its_pixels(tmp_path, step):
    x, y = step
    mask = np.arange(1, 97, dtype="f4").reshape(8, 12)[: 8 // y, : 12 // x]
    channels = {c: (np.ones((8, 12), "f2"), 1, 1) for c in "RGB"} | {"mask": (mask, x, y)}
    path = raw_exr.write_sampled(tmp_path / "a.exr", channels, (12, 8))
    source = Clip(path).source(0)
    want = [[mask[i // y, j // x] for j in range(12)] for i in range(8)]
    np.testing.assert_array_equal(source.channels["mask"], want)
    assert source.notes == (
        f"channel mask, stored for every {x} x {y} pixels, gets a value for each",
    )


# ---- grey, and less than three colours ------------------------------------------------------


def test_what_is_the_picture_where_there_is_no_rgb():
    assert layers.find_color(["Y", "Z", "A"]) == ["Y", "Y", "Y", "A"]
    assert layers.find_color(["N.X", "N.Y", "N.Z", "R", "G", "B"]) == ["R", "G", "B"]
    assert layers.find_color(["G"]) == ["", "G", ""]
    assert layers.find_color(["R", "A"]) == ["R", "", "", "A"]
    assert layers.find_color(["Combined.Y"]) == 3 * ["Combined.Y"]
    assert layers.find_color(["mask.Y"], "mask") == 3 * ["mask.Y"]
    assert layers.find_color(["Y", "beauty.R", "beauty.G", "beauty.B"])[0] == "beauty.R"
    for none in (["X", "Y", "Z"], ["mask.Y"], ["Z"], ["mask.R"]):
        with pytest.raises(InputError, match="cannot tell"):
            layers.find_color(none)


@pytest.mark.parametrize("speed", [0, 6])
def test_a_grey_picture_is_blurred_once_and_written_back_as_grey(tmp_path, capsys, speed):
    """As it is red, green and blue of the same picture."""
    grey = make.picture(1)[..., 1].astype("f2")
    shape = grey.shape
    vectors = {"velocity.x": np.full(shape, speed, "f4"), "velocity.y": np.zeros(shape, "f4")}
    make.write_exr(tmp_path / "y.exr", {"Y": grey} | vectors)
    make.write_exr(tmp_path / "rgb.exr", dict.fromkeys("RGB", grey) | vectors)
    for name in ("y", "rgb"):
        blur(capsys, tmp_path / f"{name}.exr", tmp_path / f"{name}-o.exr", "-q")
    got = make.plain_read(tmp_path / "y-o.exr")
    assert set(got) == {"Y", "velocity.x", "velocity.y"}
    np.testing.assert_array_equal(got["Y"], make.plain_read(tmp_path / "rgb-o.exr")["R"])
    assert (got["Y"].tobytes() == grey.tobytes()) == (speed == 0)


def test_a_colour_that_is_not_there_is_0(tmp_path, capsys):
    green = make.picture(1)[..., 1].astype("f2")
    path = make.write_exr(tmp_path / "a.exr", {"G": green} | make.written("plain", *make.motion(1)))
    rgba = Clip(path).source(0).rgba
    assert (rgba.shape, rgba.dtype) == ((48, 64, 3), np.float16)
    np.testing.assert_array_equal(rgba[..., 1], green)
    assert not rgba[..., [0, 2]].any()
    said = blur(capsys, path, tmp_path / "o.exr")
    assert "the picture has no R, B, counted as 0\n" in said
    got = make.plain_read(tmp_path / "o.exr")
    assert not {"R", "B"} & set(got)
    assert (got["G"] != green).any()
    assert "picture   G\n" in make.inside(capsys, "info", path)[1]


# ---- levels ---------------------------------------------------------------------------------


def test_of_tiles_in_several_sizes_the_largest_is_read_and_written(tmp_path, capsys):
    planes = {c: np.random.default_rng(i).random((16, 16)).astype("f2")
              for i, c in enumerate("RGB")}  # fmt: skip
    planes |= {"to_next.x": np.full((16, 16), 4, "f4"), "to_next.y": np.zeros((16, 16), "f4")}
    path = raw_exr.write_levels(tmp_path / "a.exr", planes)
    source = Clip(path).source(0)
    for name, plane in planes.items():
        np.testing.assert_array_equal(source.channels[name], plane)
    said = blur(capsys, path, tmp_path / "o.exr")
    assert said.count("of tiles in several sizes the largest is used\n") == 1
    assert make.plain_header(tmp_path / "o.exr")["type"] == OpenEXR.scanlineimage


# ---- deep pixels ----------------------------------------------------------------------------


def samples(counts: np.ndarray, seed: int, kind="f2", most: float = 1.0) -> np.ndarray:
    """(height, width) arrays of so many numbers up to `most`; None where there are none."""
    rng = np.random.default_rng(seed)
    pixels = np.empty(counts.shape, object)
    for at, n in np.ndenumerate(counts):
        pixels[at] = (most * rng.random(n)).astype(kind) if n else None
    return pixels


def deep_channels(counts: np.ndarray) -> dict[str, np.ndarray]:
    alpha = samples(counts, 0)
    made = {"A": alpha}
    for i, c in enumerate("RGB"):
        made[c] = samples(counts, 1 + i)
        for at in np.ndindex(counts.shape):
            if counts[at]:
                made[c][at] = (made[c][at] * alpha[at]).astype("f2")  # premultiplied
    made["Z"] = samples(counts, 5, "f4", 100)
    made["forward.u"] = samples(counts, 6, "f4", 8)
    made["forward.v"] = samples(counts, 7, "f4", 8)
    made["id"] = samples(counts, 8, "u4", 1e9)
    return made


def write_deep(path, channels, kind=OpenEXR.deepscanline, **attributes):
    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": kind} | attributes
    if kind == OpenEXR.deeptile:
        header["tiles"] = OpenEXR.TileDescription()
    OpenEXR.File(header, channels).write(str(path))
    return path


def slow_flat(channels, at) -> dict:
    """The twin of one pixel: sorted by Z, colour laid over, all else the nearest sample's."""
    z = channels["Z"][at]
    if z is None:
        return {name: np.inf if name == "Z" else 0 for name in channels}
    order = sorted(range(len(z)), key=lambda i: float(z[i]))
    flat = {name: pixels[at][order[0]] for name, pixels in channels.items()}
    for name in "RGBA":
        through, total = 1.0, 0.0
        for i in order:
            total += through * float(channels[name][at][i])
            through *= 1 - float(channels["A"][at][i])
        flat[name] = total
    return flat


@pytest.mark.parametrize("kind", [OpenEXR.deepscanline, OpenEXR.deeptile])
def test_deep_pixels_are_flattened_as_the_slow_twin_does(tmp_path, kind):
    counts = np.random.default_rng(9).choice([0, 1, 2, 5], (9, 12))
    channels = deep_channels(counts)
    expected = {at: slow_flat(channels, at) for at in np.ndindex(counts.shape)}
    path = write_deep(tmp_path / "a.exr", channels, kind)
    (part,) = exr.read(path).parts
    assert part.notes == ("deep pixels are flattened, the nearest sample first",)
    for name, plane in part.channels.items():
        want = np.array([expected[at][name] for at in np.ndindex(counts.shape)], "f8")
        tolerance = 1e-6 if plane.dtype != np.float16 else 1e-3  # half an ulp of half floats
        np.testing.assert_allclose(plane.ravel(), want, rtol=tolerance, atol=1e-6)
    assert part.channels["id"].dtype == np.uint32


def test_a_deep_frame_is_blurred_and_written_flat(tmp_path, capsys):
    counts = np.random.default_rng(9).choice([0, 1, 2], (9, 12))
    path = write_deep(tmp_path / "a.exr", deep_channels(counts), owner="me")
    said = blur(capsys, path, tmp_path / "o.exr", "--vectors", "nuke")
    assert "deep pixels are flattened, the nearest sample first\n" in said
    header = make.plain_header(tmp_path / "o.exr")
    assert (header["type"], header["owner"]) == (OpenEXR.scanlineimage, "me")
    assert "maxSamplesPerPixel" not in header
    got = make.plain_read(tmp_path / "o.exr")
    assert np.isinf(got["Z"][counts == 0]).all()
    assert "note      deep pixels" in make.inside(capsys, "info", path)[1]


def test_deep_views_are_flattened_each(tmp_path):
    parts = []
    for i, view in enumerate(("left", "right")):
        counts = np.full((4, 5), 1 + i)
        header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
        channels = {k: v for k, v in deep_channels(counts).items() if k in "RGBAZ"}
        parts.append(OpenEXR.Part(header | {"view": view}, channels, f"rgba.{view}"))
    clip = Clip(make.write_parts(tmp_path / "a.exr", parts))
    assert clip.views == ("left", "right")
    left, right = (clip.source(0, view).rgba for view in clip.views)
    assert (left != right).any()


def test_channels_of_a_layer_go_with_its_own_depth_and_alpha():
    names = dict.fromkeys(["Z", "A", "left.Z", "left.A", "glass.A", "glass.R", "left.R"])
    assert deep.companion("left.R", "Z", names) == "left.Z"
    assert deep.companion("spec.left.R", "A", names) == "left.A"
    assert deep.companion("glass.R", "A", names) == "glass.A"
    assert deep.companion("glass.R", "Z", names) == "Z"
    assert deep.companion("R", "Z", {"R": None}) is None


def one_pixel(**channels) -> dict:
    made = {}
    for name, values in channels.items():
        made[name] = np.empty((1, 1), object)
        made[name][0, 0] = np.array(values, "f4")
    return made


def test_without_alpha_the_nearest_sample_hides_the_others():
    assert deep.flatten(one_pixel(R=(1, 2, 4), Z=(3, 1, 2)))["R"] == 2


def test_hidden_infinite_light_does_not_shine_through():
    flat = deep.flatten(one_pixel(R=(1, np.inf), A=(1, 1), Z=(1, 2)))
    assert flat["R"] == 1


def test_vectors_stored_as_colours_are_not_mixed():
    channels = one_pixel(A=(0.5, 1), Z=(1, 2))
    channels["motionvector.R"] = one_pixel(x=(8, 2))["x"]
    channels["velocity.y"] = one_pixel(x=(8, 2))["x"]
    channels["CryptoObject00.r"] = one_pixel(x=(8, 2))["x"]
    flat = deep.flatten(channels, vectors.STEMS)
    assert {flat[name].item() for name in channels if "." in name} == {8}


def test_volumes_are_said_to_be_points(tmp_path):
    counts = np.full((2, 2), 2)
    front, back = samples(counts, 1, "f4"), samples(counts, 2, "f4")
    base = {"R": samples(counts, 3), "A": samples(counts, 4), "Z": front}
    volume = exr.read(write_deep(tmp_path / "v.exr", base | {"ZBack": back})).parts[0]
    points = exr.read(write_deep(tmp_path / "p.exr", base | {"ZBack": front})).parts[0]
    assert "volumes (ZBack) count as points" in volume.notes[0]
    assert "volumes" not in points.notes[0]


def test_channels_with_other_numbers_of_samples_are_damage():
    channels = one_pixel(R=(1, 2), Z=(1,))
    with pytest.raises(InputError, match="R and Z do not have the same samples"):
        deep.flatten(channels)


# ---- how large deep pixels are --------------------------------------------------------------


def test_deep_samples_beyond_the_limit_are_refused_by_the_headers_of_their_chunks(
    tmp_path, monkeypatch
):
    """Black samples pack well: so small a file could ask for gigabytes."""
    channels = {}
    for name in ("A", "Z"):
        channels[name] = np.empty((4, 4), object)
        for at in np.ndindex(4, 4):
            channels[name][at] = np.zeros(50_000, "f4")
    for kind in (OpenEXR.deepscanline, OpenEXR.deeptile):
        path = write_deep(tmp_path / "bomb.exr", channels, kind)
        exr.read(path, max_mb=100)
        plain = OpenEXR.File

        def header_alone(*arguments, plain=plain, **options):
            assert options.get("header_only")
            return plain(*arguments, **options)

        with monkeypatch.context() as held:
            held.setattr(OpenEXR, "File", header_alone)
            with pytest.raises(InputError, match=r"bomb\.exr: image of 4 x 4, 2 channels, deep,"):
                exr.read(path, max_mb=5)


def test_a_deep_window_of_a_billion_pixels_is_refused(tmp_path):
    data = write_deep(tmp_path / "a.exr", deep_channels(np.ones((4, 4), int))).read_bytes()
    start = b"dataWindow\0box2i\0\x10\0\0\0"
    at = data.index(start) + len(start)
    for last, says in ((32767, "MB"), (2**31 - 2, "b.exr")):
        box = np.array([0, 0, last, last], "<i4").tobytes()
        (tmp_path / "b.exr").write_bytes(data[:at] + box + data[at + 16 :])
        with pytest.raises(InputError, match=says) as error:
            exr.read(tmp_path / "b.exr")
        assert "b.exr" in str(error.value)


def test_damaged_deep_files_are_one_line(tmp_path):
    data = write_deep(tmp_path / "a.exr", deep_channels(np.full((8, 8), 3))).read_bytes()
    rng, refused = np.random.default_rng(2), 0
    for i in range(40):
        broken = bytearray(data)
        if i % 2:
            del broken[int(rng.integers(len(data) // 4, len(data))) :]
        else:
            at = int(rng.integers(len(data) // 4, len(data) - 8))
            broken[at : at + 8] = rng.bytes(8)
        (tmp_path / "b.exr").write_bytes(bytes(broken))
        try:
            exr.read(tmp_path / "b.exr")
        except InputError as error:
            assert str(error).startswith(str(tmp_path / "b.exr"))
            refused += 1
    assert refused > 20


def test_too_little_memory_for_deep_pixels_is_one_line(tmp_path, monkeypatch):
    path = write_deep(tmp_path / "a.exr", deep_channels(np.ones((4, 4), int)))

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(deep, "flatten", fail)
    with pytest.raises(InputError, match=r"a\.exr: not enough memory"):
        exr.read(path)
