"""Planes of videos to linear light and back: against H.273 written out, and to the sample."""

import dataclasses

import numpy as np
import pytest

from wgmb import InputError, gpu
from wgmb.color.coding import FLOAT, CodedPicture, Coding
from wgmb.gpu.textures import TexturePool
from wgmb.video.changing_light import ChangingLight
from wgmb.video.planes import Average, Planes, averages
from wgmb.video.planes.matrices import to_samples

SIZE = 38, 22  # width, height
WHITE = {16: 0.0203, 18: 0.26496256}  # light that counts as 1
CODINGS = {
    "709, 8 bit 4:2:0": Coding(),
    "601, full range": Coding(full_range=True, matrix=6, transfer=6, primaries=6),
    "709, 10 bit 4:2:2": Coding(bits=10, steps=(2, 1)),
    "2020 PQ, 10 bit": Coding(bits=10, matrix=9, transfer=16, primaries=9),
    "2020 HLG, 12 bit 4:4:4": Coding(bits=12, steps=(1, 1), matrix=9, transfer=18, primaries=9),
    "alpha, 12 bit 4:4:4": Coding(bits=12, steps=(1, 1), alpha=True),
    "rgb, gamma 2.2": Coding(model="rgb", steps=(1, 1), full_range=True, matrix=0, transfer=4),
    "rgb, 16 bit linear": Coding(
        model="rgb", bits=16, steps=(1, 1), full_range=True, matrix=0, transfer=8
    ),
    "grey": Coding(model="grey", steps=(1, 1), full_range=True, transfer=13),
    "YCgCo": Coding(steps=(1, 1), full_range=True, matrix=8, transfer=13),
    "gamma 2.8": Coding(transfer=5, matrix=5),
    "8 bit 4:1:0": Coding(steps=(4, 4)),
    "alpha, 8 bit 4:2:0": Coding(alpha=True),
}


def light_of(signal, transfer):
    """H.273, table 3, and BT.2100, for one number."""
    x = abs(signal)
    if transfer == 8:
        light = x
    elif transfer in (4, 5):
        light = x ** {4: 2.2, 5: 2.8}[transfer]
    elif transfer == 16:
        m1, m2 = 2610 / 16384, 2523 / 4096 * 128
        c1, c2, c3 = 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
        root = min(x, 1.0) ** (1 / m2)
        light = (max(root - c1, 0) / (c2 - c3 * root)) ** (1 / m1)
    elif transfer == 18:
        a, b, c = 0.17883277, 0.28466892, 0.55991073
        light = x * x / 3 if x <= 0.5 else (np.exp((x - c) / a) + b) / 12
    else:  # displays follow about the curve of sRGB, whose line near black goes on below
        return signal / 12.92 if signal <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4
    return np.sign(signal) * light / WHITE.get(transfer, 1)


def slowly(picture):
    """(height, width, 4) linear light, premultiplied, one pixel at a time."""
    c = picture.coding
    width, height = picture.size
    out = np.ones((height, width, 4))
    unit, most = 2 ** (c.bits - 8), 2**c.bits - 1
    red, blue = {1: (0.2126, 0.0722), 9: (0.2627, 0.0593)}.get(c.matrix, (0.299, 0.114))
    for y in range(height):
        for x in range(width):
            if c.model != "yuv":
                s = [float(p[y, x]) / most for p in picture.planes[:3]]
                rgb = s * 3 if c.model == "grey" else s
            else:
                luma = float(picture.planes[0][y, x])
                cb, cr = (float(p[y // c.steps[1], x // c.steps[0]]) for p in picture.planes[1:3])
                if c.full_range:
                    luma, cb, cr = luma / most, cb / most - 2 ** (c.bits - 1) / most, (
                        cr / most - 2 ** (c.bits - 1) / most)  # fmt: skip
                else:
                    luma = (luma / unit - 16) / 219
                    cb, cr = (cb / unit - 128) / 224, (cr / unit - 128) / 224
                if c.matrix == 8:
                    rgb = [luma - cb + cr, luma + cb, luma - cb - cr]
                else:
                    r, b = luma + 2 * (1 - red) * cr, luma + 2 * (1 - blue) * cb
                    rgb = [r, (luma - red * r - blue * b) / (1 - red - blue), b]
            alpha = float(picture.planes[-1][y, x]) / most if c.alpha else 1.0
            out[y, x] = [*(alpha * light_of(v, c.transfer) for v in rgb[:3]), alpha]
    return out


def stored(coding, seed=0):
    """A picture of samples that a video may hold."""
    rng = np.random.default_rng(seed)
    width, height = SIZE
    unit, most = 2 ** (coding.bits - 8), 2**coding.bits - 1
    kind = np.uint8 if coding.bits == 8 else np.uint16
    small = -(-height // coding.steps[1]), -(-width // coding.steps[0])
    low, high = (0, most) if coding.full_range else (16 * unit, 235 * unit)
    if coding.transfer == 16:  # nothing is brighter than its 1, also with chroma
        high = 170 * unit
    planes = [rng.integers(low, high + 1, (height, width))]
    if coding.model == "yuv":
        planes += [rng.integers(100 * unit, 156 * unit, small) for _ in range(2)]
    elif coding.model == "rgb":
        planes += [rng.integers(low, high + 1, (height, width)) for _ in range(2)]
    if coding.alpha:
        planes.append(rng.integers(most // 8, most + 1, (height, width)))
    return CodedPicture(tuple(np.ascontiguousarray(p.astype(kind)) for p in planes), coding)


@pytest.fixture(scope="module")
def device():
    return gpu.open_device(None)


def decoded(device, picture, texel="rgba32float"):
    images, encoder = TexturePool(device), device.create_command_encoder()
    output = images.texture("light", picture.size, texel)
    Planes(device).decode(encoder, picture, output.create_view())
    return images.download(encoder, output)


@pytest.mark.parametrize("name", CODINGS)
def test_light_is_what_the_standard_says(device, name):
    picture = stored(CODINGS[name])
    want = slowly(picture)
    np.testing.assert_allclose(decoded(device, picture), want, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("texel", ["rgba32float", "rgba16float"])
@pytest.mark.parametrize("name", CODINGS)
def test_what_is_stored_comes_back(device, name, texel):
    """To the sample from 32-bit floats; within 1 of 255, 2 of 1023 from 16-bit ones."""
    coding = CODINGS[name]
    picture, planes = stored(coding), Planes(device)
    images, encoder = TexturePool(device), device.create_command_encoder()
    light = images.texture("light", SIZE, texel)
    planes.decode(encoder, picture, light.create_view())
    got = planes.encode(encoder, light.create_view(), coding)
    assert got.coding == coding and len(got.planes) == len(picture.planes)
    allowed = 0 if texel == "rgba32float" else max(1, 2 ** (coding.bits - 9))
    if coding.transfer == 16 and texel == "rgba32float":
        allowed = 1  # its powers of 78 and 1 / 0.16 cost a bit
    for want, plane in zip(picture.planes, got.planes, strict=True):
        assert plane.dtype == want.dtype and plane.shape == want.shape
        assert np.abs(plane.astype(int) - want).max() <= allowed


YUV = [name for name, coding in CODINGS.items() if averages(coding, coding)]


@pytest.mark.parametrize("transfer", [4, 5, 8, 13, 16, 18])
def test_floats_are_signals_and_come_back(device, transfer):
    rgba = np.random.default_rng(transfer).random((7, 13, 4), np.float32)
    coding = Coding("rgb", FLOAT, (1, 1), alpha=True, full_range=True, transfer=transfer)
    picture = CodedPicture((rgba,), coding)
    assert picture.size == (13, 7)
    light = decoded(device, picture)
    want = np.vectorize(light_of)(rgba[..., :3].astype(float), transfer) * rgba[..., 3:]
    np.testing.assert_allclose(light[..., :3], want, atol=2e-6, rtol=1e-4)
    np.testing.assert_array_equal(light[..., 3], rgba[..., 3])
    images, planes = TexturePool(device), Planes(device)
    view = images.upload("light", light, "rgba32float")
    encoder = device.create_command_encoder()
    (back,) = planes.encode(encoder, view, coding).planes
    np.testing.assert_allclose(back, rgba, atol=4e-5)


def averaged(pictures, weights, wanted):
    """The samples of a weighted sum in linear light, not rounded: through H.273 written out."""
    light = sum(w * slowly(p)[..., :3] for p, w in zip(pictures, weights, strict=True))
    code = wanted
    white = WHITE.get(code.transfer, 1)
    if code.transfer in (16, 18, 5):
        known = np.linspace(0, 1.2, 200_001)
        table = np.array([light_of(v, code.transfer) for v in known])
        signal = np.interp(light, table, known)
        assert white
    else:
        high = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
        signal = np.where(light <= 0.0031308, 12.92 * light, high)
    planes = []
    rows = to_samples(code)
    for n, steps in ((0, (1, 1)), (1, code.steps), (2, code.steps)):
        samples = signal @ rows[n, :3] + rows[n, 3]
        height, width = samples.shape
        samples = np.pad(samples, ((0, -height % steps[1]), (0, -width % steps[0])), "edge")
        tall, wide = samples.shape[0] // steps[1], samples.shape[1] // steps[0]
        planes.append(samples.reshape(tall, steps[1], wide, steps[0]).mean(axis=(1, 3)))
    return planes


@pytest.mark.covers(0)
@pytest.mark.parametrize("name", YUV)
def test_one_picture_averaged_is_itself(device, name):
    picture = mild(stored(CODINGS[name]), 0)
    got = Average(device)([picture], [1.0], picture.coding)
    allowed = 1 if picture.coding.transfer == 16 else 0
    for want, plane in zip(picture.planes, got.planes, strict=True):
        assert plane.dtype == want.dtype and plane.shape == want.shape
        assert np.abs(plane.astype(int) - want).max() <= allowed


@pytest.mark.parametrize("full_range", [False, True])
@pytest.mark.parametrize("matrix", [1, 5, 8, 9])
def test_every_colour_of_8_bits_averaged_with_itself_is_itself(device, matrix, full_range):
    """Those that no display has too, below black and above white."""
    levels = np.array([0, 1, 15, 16, 17, 40, 77, 128, 180, 235, 240, 254, 255], np.uint8)
    every = np.stack(np.meshgrid(np.arange(256), levels, levels)).reshape(3, 256, -1)
    coding = Coding(steps=(1, 1), matrix=matrix, full_range=full_range)
    picture = CodedPicture(tuple(p.astype(np.uint8) for p in every), coding)
    got = Average(device)([picture] * 4, [0.1, 0.2, 0.3, 0.4], coding)
    for want, plane in zip(picture.planes, got.planes, strict=True):
        np.testing.assert_array_equal(plane, want)


@pytest.mark.covers(0)
@pytest.mark.parametrize("count", [3, 19])
@pytest.mark.parametrize("name", YUV)
def test_an_average_of_planes_is_that_of_their_light(device, name, count):
    """Within rounding, and a fiftieth of a sample; also more than one pass takes."""
    rng = np.random.default_rng(count)
    pictures = [mild(stored(CODINGS[name], seed), seed) for seed in range(3)]
    pictures = [pictures[n % 3] for n in range(count)]
    weights = rng.random(count)
    weights /= weights.sum()
    got = Average(device)(pictures, weights, pictures[0].coding)
    coding = CODINGS[name]
    slack = 1.1 if coding.transfer == 16 else 0.52  # the powers of PQ cost a bit
    for want, plane in zip(
        averaged(pictures, weights, pictures[0].coding), got.planes, strict=True
    ):
        assert np.abs(plane - want).max() < slack


@pytest.mark.parametrize("weight", [0.5, 0.1, 0.01])
@pytest.mark.parametrize("full_range", [False, True])
def test_the_average_of_any_two_greys_of_8_bits_is_that_of_their_light(device, full_range, weight):
    """Within rounding, and a fiftieth of a sample."""
    black, white = (0, 255) if full_range else (16, 235)
    grey = np.full((256, 256), 128, np.uint8)
    first = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 256, axis=1)
    coding = Coding(steps=(1, 1), full_range=full_range)
    pictures = [CodedPicture((luma, grey, grey), coding) for luma in (first, first.T.copy())]
    light = [light_of_grey((p.planes[0] - float(black)) / (white - black)) for p in pictures]
    light = weight * light[0] + (1 - weight) * light[1]
    power = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    want = black + (white - black) * np.where(light <= 0.0031308, 12.92 * light, power)
    got = Average(device)(pictures, [weight, 1 - weight], coding).planes
    assert np.abs(got[0] - np.clip(want, 0, 255)).max() < 0.52
    assert (got[1] == 128).all() and (got[2] == 128).all()


def light_of_grey(signal):
    """The same as `light_of` for an array, on the curve of sRGB."""
    power = ((np.maximum(signal, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(signal <= 0.04045, signal / 12.92, power)


def mild(picture, seed):
    """The same with chroma near grey, so that no signal is negative."""
    rng = np.random.default_rng(seed)
    unit = 2 ** (picture.coding.bits - 8)
    luma, *chroma = picture.planes
    luma = np.clip(luma, 60 * unit, 160 * unit)
    chroma = [rng.integers(120 * unit, 136 * unit, c.shape).astype(c.dtype) for c in chroma]
    return CodedPicture((luma, *chroma), picture.coding)


@pytest.mark.covers(1)
@pytest.mark.parametrize("size", [(13, 7), (8, 2), (1, 1)])
@pytest.mark.parametrize(
    ("stored_as", "wanted"),
    [((2, 2), (2, 2)), ((1, 1), (2, 2)), ((2, 2), (2, 1)), ((1, 2), (1, 1))],
)
@pytest.mark.parametrize("bits", [(8, 8), (12, 10)])
def test_any_size_and_sampling_is_averaged_into_any_other(device, size, stored_as, wanted, bits):
    rng = np.random.default_rng(5)
    width, height = size
    unit, kind = 2 ** (bits[0] - 8), "u1" if bits[0] == 8 else "u2"
    small = -(-height // stored_as[1]), -(-width // stored_as[0])
    shapes = ((height, width), small, small)
    pictures = [
        CodedPicture(
            tuple(rng.integers(110 * unit, 140 * unit, s).astype(kind) for s in shapes),
            Coding(bits=bits[0], steps=stored_as),
        )
        for _ in range(2)
    ]
    into = Coding(bits=bits[1], steps=wanted)
    got = Average(device)(pictures, [0.25, 0.75], into)
    for want, plane in zip(averaged(pictures, [0.25, 0.75], into), got.planes, strict=True):
        assert plane.shape == want.shape and np.abs(plane - want).max() < 0.52


def test_pictures_that_stay_on_the_gpu_are_not_mistaken(device):
    """Each is uploaded once while it is needed, and its place then serves others."""
    average, coding = Average(device), Coding()
    levels = [CodedPicture(tuple(np.full(s, v, "u1") for s in ((4, 8), (2, 4), (2, 4))), coding)
              for v in range(60, 200, 7)]  # fmt: skip
    for begin in range(16):
        some = levels[begin : begin + 4]
        for n, picture in enumerate(some):
            weights = np.eye(4)[n]
            got = average(some, weights, coding)
            np.testing.assert_array_equal(got.planes[0], picture.planes[0])


def test_odd_sizes_have_a_last_sample_of_chroma(device):
    rng = np.random.default_rng(1)
    shapes = ((7, 13), (4, 7), (4, 7))
    planes = tuple(rng.integers(90, 160, s).astype(np.uint8) for s in shapes)
    images, encoder, both = TexturePool(device), device.create_command_encoder(), Planes(device)
    light = images.texture("light", (13, 7), "rgba32float")
    both.decode(encoder, CodedPicture(planes, Coding()), light.create_view())
    got = both.encode(encoder, light.create_view(), Coding())
    for want, plane in zip(planes, got.planes, strict=True):
        np.testing.assert_array_equal(plane, want)


def test_chroma_is_the_mean_of_its_pixels(device):
    light = np.zeros((2, 2, 4), "f4")
    light[...] = 1, 0, 0, 1
    light[0, 0] = 0, 0, 1, 1
    images, encoder = TexturePool(device), device.create_command_encoder()
    view = images.upload("light", light, "rgba32float")
    got = Planes(device).encode(encoder, view, Coding())
    cb = [128 + 224 * v for v in (0.5, -0.5 * 0.2126 / 0.9278)]
    assert got.planes[1][0, 0] == round((cb[0] + 3 * cb[1]) / 4)
    assert got.planes[0].tolist() == [[round(16 + 219 * 0.0722), 63], [63, 63]]


@pytest.mark.parametrize("coding", [Coding(), Coding("rgb", FLOAT, (1, 1), alpha=True)])
def test_changes_of_light_are_coded_as_if_they_were_added_before(device, coding):
    rng = np.random.default_rng(4)
    images, planes = TexturePool(device), Planes(device)
    light = rng.uniform(0.1, 0.6, (22, 38, 4)).astype(np.float32)
    light[..., 3] = 1
    view = images.upload("light", light, "rgba32float")
    changing = ChangingLight(device)
    small = (rng.random((6, 10, 4)) * 0.2 - 0.1).astype(np.float32)
    small[..., 3] = 0.25  # the neighbours' share of the exposure: a pixel loses no more
    changes = images.upload("changes", small, gpu.texel(device, 4))
    given = dataclasses.replace(changing.changes((38, 22)), view=changes)
    y, x = ((np.arange(n) + 0.5) / 4 - 0.5 for n in (22, 38))
    y, x = y.clip(0, 5), x.clip(0, 9)
    top, left = (np.minimum(at.astype(int), n) for at, n in ((y, 4), (x, 8)))
    down, right = (y - top)[:, None, None], (x - left)[:, None]
    rows = (1 - down) * small[top] + down * small[top + 1]
    change = (1 - right) * rows[:, left] + right * rows[:, left + 1]
    assert (change < -0.25 * light).any()
    added = light + np.maximum(change, -0.25 * light)
    added[..., 3] = 1
    before = images.upload("before", np.maximum(added, 0).astype(np.float32), "rgba32float")
    encoder = device.create_command_encoder()
    got = planes.encode(encoder, view, coding, given)
    want = planes.encode(device.create_command_encoder(), before, coding)
    off = 2e-3 if coding.bits == FLOAT else 1
    for one, other in zip(got.planes, want.planes, strict=True):
        np.testing.assert_allclose(one.astype(float), other.astype(float), atol=off)
        assert np.abs(one.astype(float) - other).mean() < 0.03 * off


def test_what_is_not_finite_is_coded_as_black(device):
    light = np.full((4, 6, 4), 0.5, np.float32)
    light[1, 2] = np.nan
    light[2, 3, 0] = np.inf
    view = TexturePool(device).upload("light", light, "rgba32float")
    coding = Coding("rgb", FLOAT, (1, 1), alpha=True)
    (got,) = Planes(device).encode(device.create_command_encoder(), view, coding).planes
    np.testing.assert_array_equal(got[[1, 2], [2, 3]], 0)
    assert np.isfinite(got).all() and (got[0] >= 0.5).all()


@pytest.mark.parametrize(
    ("numbers", "said"), [({"matrix": 14}, "matrix 14"), ({"transfer": 12}, "transfer 12")]
)
def test_what_is_not_known_is_named(device, numbers, said):
    with pytest.raises(InputError, match=said):
        decoded(device, stored(Coding(**numbers)))
