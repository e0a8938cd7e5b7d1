"""A frame without vectors that is alone in its shot is copied and named, by every method."""

import numpy as np
import pytest

import make_frames as make
from wgmb.io import stills


def _write(folder):
    """Frames 1 to 5 that move by 4 px; frame 3 is another picture."""
    for number in range(1, 6):
        picture = make.picture(number)
        if number == 3:
            picture = np.ascontiguousarray(1 - picture[::-1, ::-1])
            picture[..., 3] = 1
        path = folder / f"p.{number:04}.png"
        path.write_bytes(stills.encode(picture, ".png", 8, "{}"))
    return folder / "p.####.png"


@pytest.mark.parametrize("method", ["tap", "tiles", "fusion", "reproject", "gather"])
def test_a_frame_alone_in_its_shot_is_copied_and_named(tmp_path, capsys, method):
    pattern, out = _write(tmp_path), tmp_path / "o.####.png"
    words = ("blur", pattern, "-o", out, "--method", method, "--cuts", "only:3,4")
    code, _, err = make.inside(capsys, *words)
    assert code == 0
    assert "frame 3: alone in a shot" in err and "frame 2: alone" not in err
    before, after = (stills.read(tmp_path / f"{name}.0003.png") for name in "po")
    assert np.abs(after - before).max() < 1e-6
    moved = [stills.read(tmp_path / f"{name}.0002.png") for name in "po"]
    assert np.abs(moved[0] - moved[1]).max() > 0.005


def test_parts_with_such_a_frame_equal_the_whole(tmp_path, capsys):
    pattern = _write(tmp_path)
    whole, part = tmp_path / "whole.####.png", tmp_path / "part.####.png"
    for out, frames in ((whole, "1-5"), (part, "3"), (part, "4-5"), (part, "1-2")):
        words = ("blur", pattern, "-o", out, "--cuts", "only:3,4", "--frames", frames)
        assert make.inside(capsys, *words)[0] == 0
    for number in range(1, 6):
        both = [stills.read(tmp_path / f"{name}.{number:04}.png") for name in ("whole", "part")]
        np.testing.assert_array_equal(*both)
