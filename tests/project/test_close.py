"""The judge is judged: the comparison fails where it must."""

import numpy as np
import pytest

from conftest import difference

pytestmark = pytest.mark.fast


def test_equal_pictures_are_close(close, noise):
    close(noise, noise.copy(), 0)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda p: np.roll(p, 1, axis=1),
        lambda p: np.roll(p, 1, axis=0),
        lambda p: p + np.float32(0.01),
        lambda p: p[..., ::-1],
        lambda p: p[:-1],
        lambda p: np.where(np.arange(p.size).reshape(p.shape) == 777, np.nan, p),
        lambda p: np.where(np.arange(p.size).reshape(p.shape) == 777, p + 0.01, p),
    ],
)
def test_a_spoilt_picture_is_not_close(close, noise, spoil):
    with pytest.raises(pytest.fail.Exception, match="differ by up to"):
        close(spoil(noise), noise, 0.005)


def test_the_difference_of_swapped_arguments_is_the_same(noise):
    other = np.sqrt(noise)
    assert difference(noise, other) == difference(other, noise)
