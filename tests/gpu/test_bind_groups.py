"""Bind groups and constants are kept from frame to frame, change no bit, and keep nothing alive."""

import gc
import weakref

import numpy as np
import pytest
import wgpu

import wgmb
from wgmb import gpu
from wgmb.gpu import bind_groups
from wgmb.scene import builtin

SIZE = 40, 24
METHODS = ("tap", "tiles", "reproject", "gather")


@pytest.fixture
def made(monkeypatch):
    """Every bind group that was made."""
    calls = []
    make = bind_groups.made_group
    monkeypatch.setattr(bind_groups, "made_group", lambda *a: calls.append(1) or make(*a))
    return calls


def views(device, seed=0):
    """A frame whose textures are kept, and the output."""
    rng = np.random.default_rng(seed)
    pool = wgmb.gpu.textures.TexturePool(device)
    width, height = SIZE
    frame = wgmb.FrameViews(
        color=pool.upload("color", rng.random((height, width, 4), "f4"), "rgba16float"),
        depth=pool.upload("depth", 0.5 + 0.4 * rng.random((height, width), "f4"), "r32float"),
        motion=pool.upload("motion", 9 * rng.random((height, width, 4), "f4"), "rgba32float"),
    )
    return pool, frame, pool.texture("output", SIZE, "rgba16float")


def blurred(blur, pool, frame, output, number=0):
    encoder = blur.device.create_command_encoder()
    blur.encode(encoder, frame, pool.view_of(output), number=number)
    return pool.download(encoder, output)


@pytest.mark.parametrize("method", METHODS)
def test_a_second_frame_makes_no_bind_groups_and_has_the_same_bits(device, made, method):
    blur = wgmb.Blur(method, device=device, output="rgba16float")
    there = views(device)
    first = blurred(blur, *there)
    assert made
    made.clear()
    again = blurred(blur, *there)
    assert not made
    assert np.array_equal(first, again)
    fresh = wgmb.Blur(method, device=device, output="rgba16float")
    fresh._groups = None  # every group anew
    assert np.array_equal(blurred(fresh, *there), first)


def test_a_second_picture_of_a_scene_makes_no_bind_groups(device, made):
    """Nor where light is followed, in buffers and views of its own."""
    blur = wgmb.Blur("gather", device=device, output="rgba16float")
    render = wgmb.Render(builtin.make("crossing"), blur, size=SIZE)
    pool = wgmb.gpu.textures.TexturePool(device)
    view = pool.view("output", SIZE, "rgba16float")
    render.draw(view, 0.0)
    assert made
    made.clear()
    render.draw(view, 0.0)
    assert not made


def test_other_textures_and_other_numbers_get_other_groups(device):
    blur = wgmb.Blur("tap", device=device, output="rgba16float", jitter=1)
    a, b = views(device), views(device, seed=1)
    first = blurred(blur, *a)
    assert not np.array_equal(blurred(blur, *b), first)
    assert not np.array_equal(blurred(blur, *a, number=5), first)
    assert np.array_equal(blurred(blur, *a), first)
    blur.shutter = 20
    assert not np.array_equal(blurred(blur, *a), first)


def test_groups_go_with_what_they_bind(device):
    blur = wgmb.Blur("tap", device=device, output="rgba16float")
    there = views(device)
    blurred(blur, *there)
    gone = weakref.ref(there[1].color)
    assert len(blur._constants.groups)
    del there
    gc.collect()
    assert gone() is None
    assert len(blur._constants.groups) <= 1  # that of the frame's own constants
    assert len(blur._constants.groups._keys) == len(blur._constants.groups._watched) <= 3


def test_constants_are_shared_by_contents_and_use(device):
    data = np.arange(4, dtype=np.uint32)
    one = gpu.constant(device, "a", data)
    assert gpu.constant(device, "a", data.copy()) is one
    assert gpu.constant(device, "a", data + 1) is not one
    storage = gpu.constant(device, "a", data, wgpu.BufferUsage.STORAGE)
    assert storage is not one
    large = np.zeros(5000, np.uint32)
    assert gpu.constant(device, "a", large) is not gpu.constant(device, "a", large)
