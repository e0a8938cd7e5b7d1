"""Commands that are gathered: one submission, in the order in which they are recorded."""

import numpy as np
import pytest

from wgmb import gpu
from wgmb.gpu.textures import TexturePool
from wgmb.lab.calls import counted

SIZE = (8, 4)


def picture(value):
    return np.full((SIZE[1], SIZE[0], 4), value, "f4")


def copied(device, pool, source, name):
    """A copy of a texture, handed in."""
    target = pool.texture(name, SIZE, "rgba32float")
    encoder = gpu.encoder(device, "copy")
    encoder.copy_texture_to_texture({"texture": source}, {"texture": target}, (*SIZE, 1))
    gpu.hand_in(device, encoder)
    return target


def test_many_are_one_submission(device):
    pool = TexturePool(device)
    one = pool.upload("one", picture(3), "rgba32float").texture
    with counted() as calls, gpu.gathered(device):
        for n in range(5):
            one = copied(device, pool, one, f"copy {n}")
    assert (calls["encoders"], calls["submits"]) == (1, 1)
    np.testing.assert_array_equal(pool.download(gpu.encoder(device, "read"), one), picture(3))


def test_what_is_written_meanwhile_is_read_after_it(device):
    pool, kept = TexturePool(device), []
    with counted() as calls, gpu.gathered(device):
        for n in range(3):
            source = pool.upload("source", picture(n), "rgba32float").texture
            kept.append(copied(device, pool, source, f"kept {n}"))
        last = pool.download(gpu.encoder(device, "read"), kept[-1])
    assert calls["submits"] == 4  # before each upload but the first; the read, and wgpu's own
    np.testing.assert_array_equal(last, picture(2))
    for n, texture in enumerate(kept):
        got = pool.download(gpu.encoder(device, "read"), texture)
        np.testing.assert_array_equal(got, picture(n))


def test_an_encoder_that_is_held_goes_on_after_a_submission(device):
    pool = TexturePool(device)
    source = pool.upload("source", picture(1), "rgba32float").texture
    with gpu.gathered(device):
        encoder = gpu.encoder(device, "held")
        first = copied(device, pool, source, "first")
        pool.upload("other", picture(2), "rgba32float")  # submits
        second = pool.texture("second", SIZE, "rgba32float")
        encoder.copy_texture_to_texture({"texture": first}, {"texture": second}, (*SIZE, 1))
        gpu.hand_in(device, encoder)
    np.testing.assert_array_equal(pool.download(gpu.encoder(device, "read"), second), picture(1))


def test_what_was_recorded_before_an_error_is_submitted(device):
    pool = TexturePool(device)
    source = pool.upload("source", picture(7), "rgba32float").texture
    with pytest.raises(ZeroDivisionError), gpu.gathered(device):
        target = copied(device, pool, source, "target")
        _ = 1 / 0
    np.testing.assert_array_equal(pool.download(gpu.encoder(device, "read"), target), picture(7))
    with counted() as calls:
        copied(device, pool, source, "alone")
    assert calls["submits"] == 1
