"""The figures of SECURITY.md: what a file that unpacks to far more than its size may take."""

import io
import re
from pathlib import Path

import pytest

from wgmb import InputError
from wgmb.io import limits
from wgmb.video.y4m import Y4mReader

pytestmark = pytest.mark.fast

PATH, MB = Path("a.png"), 2**20


def test_a_thin_file_may_take_a_quarter_of_the_limit():
    """It unpacks to over 500 times its own size; the message names a limit that allows it."""
    limits.check(PATH, "4 x 4", 40 * MB, 40 * MB // 500 + 1, max_mb=40)
    limits.check(PATH, "4 x 4", 10 * MB, 1, max_mb=40)
    for promised, stored in ((40 * MB + 1, 40 * MB), (10 * MB + 500, 10 * MB // 500)):
        with pytest.raises(InputError) as refused:
            limits.check(PATH, "4 x 4", promised, stored, max_mb=40)
        (named,) = re.findall(r"`max_mb=(\d+)` allows it", str(refused.value))
        limits.check(PATH, "4 x 4", promised, stored, max_mb=float(named))


@pytest.mark.parametrize(
    ("values", "each"), [(limits.AVERAGED, 100), (limits.MOVED, 204), (limits.GATHERED, 512)]
)
def test_a_run_over_a_small_file_may_hold_a_quarter_of_the_limit(values, each):
    """`each`: bytes a pixel, as the page has them. A file of a 500th of a picture is not judged."""
    size = 1000, 10 * MB // each // 1000
    limits.check_held(PATH, size, values, 1, max_mb=40)
    larger = 1000, size[1] + 1
    limits.check_held(PATH, larger, values, limits.unpacked(larger, 4) // 500, max_mb=40)
    with pytest.raises(InputError) as refused:
        limits.check_held(PATH, larger, values, 1, max_mb=40)
    (named,) = re.findall(r"`max_mb=(\d+)` allows it", str(refused.value))
    limits.check_held(PATH, larger, values, 1, max_mb=float(named))


def test_a_pipe_may_take_all_of_the_limit():
    """1,024 x 1,024 pixels unpack to 16 MB."""
    header = b"YUV4MPEG2 W1024 H%d F24:1 C420jpeg\n"
    assert Y4mReader(io.BytesIO(header % 1024), "-", max_mb=16).size == (1024, 1024)
    with pytest.raises(InputError, match="the limit is 16 MB"):
        Y4mReader(io.BytesIO(header % 1025), "-", max_mb=16)
