"""Textures of somebody else's program: the formats that `encode` lists, and what it refuses."""

import numpy as np
import pytest
import wgpu

import wgmb
from wgmb import (
    Blur,
    FrameViews,
    InputError,
    gpu,
)
from wgmb.gpu.textures import TexturePool

SIZE = 40, 24
READ = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
STORE = wgpu.TextureUsage.STORAGE_BINDING | wgpu.TextureUsage.COPY_SRC

LIGHT = 0.25  # its sRGB code is 137
RGB10 = 256 | 256 << 10 | 256 << 20 | 3 << 30
RG11 = 0b01101000000 | 0b01101000000 << 11 | 0b0110100000 << 22  # 0.25 with 6, 6 and 5 bits
TEXELS = {  # bytes of one texel, for the value that it stands for
    "rgba8unorm": (np.uint8, [64, 64, 64, 255]),
    "rgba8unorm-srgb": (np.uint8, [137, 137, 137, 255]),
    "bgra8unorm-srgb": (np.uint8, [137, 137, 137, 255]),
    "rgb10a2unorm": (np.uint32, [RGB10]),
    "rg11b10ufloat": (np.uint32, [RG11]),
    "rgba16float": (np.float16, [LIGHT, LIGHT, LIGHT, 1]),
    "rgba32float": (np.float32, [LIGHT, LIGHT, LIGHT, 1]),
}


def texture(device, format, texel=None, dtype=None, usage=READ, size=SIZE, **more):
    made = device.create_texture(size=(*size, 1), format=format, usage=usage, **more)
    if texel is not None:
        data = np.ascontiguousarray(
            np.broadcast_to(np.array(texel, dtype), (*size[::-1], len(texel)))
        )
        device.queue.write_texture(
            {"texture": made}, data, {"bytes_per_row": data.strides[0]}, (*size, 1)
        )
    return made.create_view()


def depth_buffer(device, format, value):
    """A depth buffer that a render pass has cleared to a value."""
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.RENDER_ATTACHMENT
    made = device.create_texture(size=(*SIZE, 1), format=format, usage=usage)
    encoder = device.create_command_encoder()
    attachment = {
        "view": made.create_view(), "depth_clear_value": value, "depth_load_op": "clear",
        "depth_store_op": "store",
    }  # fmt: skip
    if "stencil" in format:
        attachment |= {"stencil_load_op": "clear", "stencil_store_op": "store"}
    encoder.begin_render_pass(color_attachments=[], depth_stencil_attachment=attachment).end()
    gpu.submit(device, encoder)
    return made.create_view(aspect="depth-only", format=format.removesuffix("-stencil8"))


def blurred(device, method="tap", **views):
    blur = Blur(method, samples=4, device=device)
    frame = {"color": texture(device, "rgba32float", [LIGHT, LIGHT, LIGHT, 1], "f4")} | views
    images = TexturePool(device)
    output = images.texture("output", SIZE, blur.output)
    encoder = device.create_command_encoder()
    blur.encode(encoder, FrameViews(**frame), output.create_view())
    return images.download(encoder, output)


def test_a_texture_is_taken_in_place_of_its_view(device):
    """It ended with AttributeError."""
    expected = blurred(device, to_next=moving(device))
    color = texture(device, "rgba32float", [LIGHT, LIGHT, LIGHT, 1], "f4").texture
    blur, images = Blur("tap", samples=4, device=device), TexturePool(device)
    output, encoder = images.texture("output", SIZE, blur.output), device.create_command_encoder()
    blur.encode(encoder, FrameViews(color=color, to_next=moving(device).texture), output)
    np.testing.assert_array_equal(images.download(encoder, output), expected)


def moving(device, format="rg32float"):
    count = 4 if "rgba" in format else 2
    return texture(device, format, [3, -2, -3, 2][:count], "f2" if "16" in format else "f4")


@pytest.mark.parametrize("format", TEXELS)
def test_colours_of_every_listed_format_are_taken(device, format):
    dtype, texel = TEXELS[format]
    got = blurred(device, color=texture(device, format, texel, dtype), to_prev=moving(device))
    np.testing.assert_allclose(got[..., :3], LIGHT, atol=2e-3)
    np.testing.assert_allclose(got[..., 3], 1, atol=1e-6)


@pytest.mark.parametrize("format", ["rg16float", "rg32float", "rgba16float", "rgba32float"])
@pytest.mark.parametrize("name", ["to_prev", "to_next", "motion"])
def test_vectors_of_every_listed_format_are_taken(device, format, name):
    blur, images = Blur("tap", device=device), TexturePool(device)
    frame = {"color": texture(device, "rgba16float", [1, 1, 1, 1], "f2")}
    frame[name] = moving(device, format)
    if name == "motion" and "rgba" not in format:
        with pytest.raises(InputError, match=f"motion must hold 4 float channels.*got {format}"):
            blurred(device, **frame)
        return
    output = images.texture("output", SIZE, "rgba32float")
    encoder = device.create_command_encoder()
    blur.encode_motion(encoder, FrameViews(**frame), output.create_view())
    got = images.download(encoder, output)
    want = [3, -2, -3, 2] if name != "to_next" else [-3, 2, 3, -2]
    np.testing.assert_array_equal(got, np.broadcast_to(np.float32(want), got.shape))


DEPTHS = ["r16float", "r32float", "depth16unorm", "depth24plus", "depth32float"]
STENCILS = ["depth24plus-stencil8"]


@pytest.mark.parametrize("format", DEPTHS + STENCILS)
@pytest.mark.parametrize("method", ["tiles", "gather"])
def test_depth_of_every_listed_format_is_taken(device, format, method):
    if format.startswith("depth"):
        depth = depth_buffer(device, format, 0.5)
    else:
        depth = texture(device, format, [0.5], "f2" if "16" in format else "f4")
    got = blurred(device, method, depth=depth, motion=moving(device, "rgba32float"))
    np.testing.assert_allclose(got, np.broadcast_to(np.float32([0.25, 0.25, 0.25, 1]), got.shape),
                               atol=1e-5)  # fmt: skip


@pytest.mark.parametrize(
    ("format", "dtype"),
    [("r8uint", "u1"), ("r16uint", "u2"), ("r32uint", "u4"), ("rg32uint", "u4")],
)
def test_indices_of_every_listed_format_are_taken(device, format, dtype):
    from images import body, camera

    here, there = (camera((0, 0, 0), bodies={7: body(x, 0)}) for x in (0, 0.5))
    frame = FrameViews(
        color=texture(device, "rgba16float", [1, 1, 1, 1], "f2"),
        depth=texture(device, "r32float", [6.0], "f4"),
        camera=wgmb.Reprojections(here, None, there),
        object_id=texture(device, format, [7] + [0] * ("rg" in format), dtype),
    )
    images = TexturePool(device)
    output = images.texture("output", SIZE, "rgba32float")
    encoder = device.create_command_encoder()
    Blur("tap", device=device).encode_motion(encoder, frame, output.create_view())
    got = images.download(encoder, output)
    assert (got[..., 2] > 0.5).all()


@pytest.mark.parametrize("format", ["r8unorm", "r16float", "r32float"])
def test_masks_of_every_listed_format_are_taken(device, format):
    kind = {"r8unorm": (np.uint8, 255), "r16float": ("f2", 1), "r32float": ("f4", 1)}[format]
    mask = texture(device, format, [kind[1]], kind[0])
    got = blurred(device, holdout=mask, scale=mask, to_next=moving(device))
    np.testing.assert_allclose(got[..., :3], LIGHT, atol=1e-6)


@pytest.mark.parametrize(
    ("views", "said"),
    [
        (lambda d: {"color": texture(d, "rgba16float", usage=STORE)},
         "color needs the usage TEXTURE_BINDING"),
        (lambda d: {"color": texture(d, "rgba32uint")}, "color must hold colours.*got rgba32uint"),
        (lambda d: {"color": texture(d, "rg16float")}, "color must hold colours.*got rg16float"),
        (lambda d: {"color": texture(d, "rgba16float", sample_count=4,
                                     usage=READ | wgpu.TextureUsage.RENDER_ATTACHMENT)},
         "color has 4 samples per pixel"),
        (lambda d: {"depth": texture(d, "r32uint")}, "depth must hold 1 float channel"),
        (lambda d: {"to_prev": texture(d, "r32float")}, "to_prev must hold 2 float channels"),
        (lambda d: {"object_id": texture(d, "r32float")}, "object_id must hold unsigned integers"),
        (lambda d: {"scale": texture(d, "r8unorm", size=(40, 23))}, "scale is 40 x 23"),
        (lambda d: {"holdout": texture(d, "r8sint")}, "holdout must hold 1 float channel"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_by_its_name(device, views, said):
    with pytest.raises(InputError, match=said):
        blurred(device, **{"to_next": moving(device)} | views(device))


def test_a_texture_of_another_device_is_refused(device):
    other = gpu.choose_adapter().request_device_sync()
    with pytest.raises(InputError, match="to_next belongs to another device"):
        blurred(device, to_next=moving(other))


def test_what_a_device_cannot_filter_is_refused():
    plain = gpu.choose_adapter().request_device_sync()
    with pytest.raises(InputError, match=r"color is rgba32float.*float32-filterable"):
        blurred(plain, to_next=moving(plain))


@pytest.mark.parametrize(
    ("format", "usage", "said"),
    [
        ("rgba16float", STORE, "output must be rgba32float.*got rgba16float"),
        ("rgba32float", READ, "output needs the usage STORAGE_BINDING"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused(device, format, usage, said):
    blur = Blur("tap", device=device)
    frame = FrameViews(color=texture(device, "rgba16float"), to_next=moving(device))
    with pytest.raises(InputError, match=said):
        blur.encode(device.create_command_encoder(), frame, texture(device, format, usage=usage))
