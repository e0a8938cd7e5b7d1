"""Arrays on their way to the GPU and back."""

import numpy as np
import pytest

from wgmb.gpu import textures
from wgmb.gpu.textures import TexturePool

SIZE = (9, 33)
VALUES = np.random.default_rng(3).normal(0, 3, (*SIZE, 4))


def there_and_back(device, image, format):
    images = TexturePool(device)
    texture = images.upload("one", image, format).texture
    return images.download(device.create_command_encoder(), texture)


@pytest.mark.parametrize("band", [1, 600, 1 << 20])
@pytest.mark.parametrize("kind", ["f2", "f4", "f8"])
@pytest.mark.parametrize("order", ["by pixel", "plane by plane", "every other row"])
def test_an_array_comes_back_however_it_lies(device, monkeypatch, band, kind, order):
    for name in ("_BAND", "_READBACK", "_READBACK_IN_SOFTWARE"):
        monkeypatch.setattr(textures, name, band)
    image = VALUES.astype(kind)
    if order == "plane by plane":
        image = np.moveaxis(np.ascontiguousarray(np.moveaxis(image, 2, 0)), 0, 2)
    elif order == "every other row":
        image = np.repeat(image, 2, axis=0)[::2]
    np.testing.assert_array_equal(there_and_back(device, image, "rgba32float"), image.astype("f4"))


def test_only_infinity_becomes_infinite_halves(device):
    image = np.full((*SIZE, 4), 1.5, "f4")
    image[0, :3, 0] = 1e6, -1e6, np.inf
    got = there_and_back(device, image, "rgba16float")
    assert got[0, :3, 0].tolist() == [65504, -65504, np.inf]
    assert (got[1:] == 1.5).all()


def test_what_a_float_cannot_hold_is_infinite(device):
    image = np.full((*SIZE, 4), 1e200)
    assert np.isinf(there_and_back(device, image, "rgba32float")).all()
