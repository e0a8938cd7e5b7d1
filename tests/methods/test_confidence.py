"""Confidence beside the result: in Python and as layers of EXR files."""

import numpy as np
import pytest

import make_frames as make
import wgmb
from images import crossing, frame_of
from wgmb import Clip, InputError, Output
from wgmb.io import exr

SIZE = (54, 96)
NAMES = ("accepted", "disocclusion", "residual", "left")


@pytest.fixture
def shot(tmp_path):
    return make.write_sequence(tmp_path, (1, 2, 3))


def test_it_is_what_show_gives_and_the_picture_stays_the_same():
    frame = frame_of([crossing(SIZE, offset) for offset in (0, -1, 1)])
    shown = wgmb.Blur("gather", shutter=360, show="confidence")(frame)
    blur = wgmb.Blur("gather", shutter=360)
    picture, told = blur.with_confidence(frame)
    assert tuple(told) == blur.confidence == NAMES
    assert np.array_equal(np.dstack(list(told.values())), shown)
    assert np.array_equal(picture, blur(frame))
    assert told["disocclusion"].max() > 0.1


@pytest.mark.parametrize("value", [1e19, 1e30, 3e38])
def test_a_wild_motion_spoils_no_channel(noise, value):
    scale = np.ones(noise.shape[:2], "f4")
    scale[21:23, 30:33] = value
    frame = wgmb.Frame(noise, np.full((*scale.shape, 2), 4, "f4"), depth=5 + 0 * scale, scale=scale)
    picture, told = wgmb.Blur("gather", shutter=360, samples=8).with_confidence(frame)
    assert np.isfinite(picture).all()
    for name, plane in told.items():
        assert np.isfinite(plane).all(), name


def test_a_method_that_cannot_tell_names_those_that_can():
    frame = frame_of([crossing(SIZE, offset) for offset in (0, -1, 1)])
    with pytest.raises(InputError, match="'tap' cannot report confidence; use gather"):
        wgmb.Blur("tap").with_confidence(frame)


def test_it_is_written_beside_the_picture(tmp_path, capsys, shot):
    plain, told = (tmp_path / f"{name}.####.exr" for name in ("plain", "told"))
    assert make.inside(capsys, "blur", shot, "-o", plain, "--shutter", 360)[0] == 0
    assert make.inside(capsys, "blur", shot, "-o", told, "--shutter", 360, "--confidence")[0] == 0
    clip, blur = Clip(shot), wgmb.Blur("gather", shutter=360)
    for n in (1, 2, 3):
        _, want = blur.with_confidence(clip.with_neighbours(clip.source(n)))
        with_it = exr.read(tmp_path / f"told.{n:04d}.exr").channels()
        for name in NAMES:
            np.testing.assert_allclose(with_it.pop(f"confidence.{name}"), want[name], atol=1e-3)
        without = exr.read(tmp_path / f"plain.{n:04d}.exr").channels()
        assert with_it.keys() == without.keys()
        assert all(np.array_equal(with_it[k], without[k]) for k in without)
    assert want["disocclusion"].max() > 0.1


def test_resuming_with_it_redoes_what_was_done_without(tmp_path, capsys, shot):
    words = ["blur", shot, "-o", tmp_path / "o.####.exr", "--resume"]
    make.inside(capsys, *words)
    assert "already done" not in make.inside(capsys, *words, "--confidence")[2]
    assert "3 already done" in make.inside(capsys, *words, "--confidence")[2]


def test_it_lies_in_the_part_that_the_picture_is_in(tmp_path):
    depth = make.part({"Z": np.ones((20, 30), "f4")}, name="depth", display=(0, 0, 63, 47))
    picture = make.part(make.colors(make.picture(1)), name="beauty")
    make.write_parts(tmp_path / "a.exr", [depth, picture])
    clip = Clip(tmp_path / "a.exr")
    output = Output(tmp_path / "o.exr", numbers=clip.numbers)
    plane = np.full((48, 64), 0.5, "f4")
    output.write(make.picture(1), clip.source(clip.numbers[0]), {"residual": plane})
    parts = {part.name: part for part in exr.read(tmp_path / "o.exr").parts}
    assert "confidence.residual" not in parts["depth"].channels
    assert np.array_equal(parts["beauty"].channels["confidence.residual"], plane)


def test_scenes_have_it_too(tmp_path, capsys):
    path = tmp_path / "o.exr"
    words = ["render", "crossing", "-o", path, "--size", "64x36", "--method", "gather"]
    assert make.inside(capsys, *words, "--confidence")[0] == 0
    channels = exr.read(path).channels()
    assert {f"confidence.{name}" for name in NAMES} < channels.keys()
    assert channels["confidence.accepted"].max() == 1


@pytest.mark.parametrize(
    "words, says",
    [("blur {} -o {}.png", "needs an .exr output"),
     ("blur {} -o {}.exr --method tap", "use gather"),
     ("render crossing -o {1}.png", "needs an .exr output"),
     ("render crossing -o {1}.exr --method distributed", "use gather"),
     ("render crossing -o {1}.exr --sharp", "cannot be combined")],
)  # fmt: skip
def test_where_it_cannot_be_is_said_before_anything_is_done(tmp_path, capsys, shot, words, says):
    out = tmp_path / "out" / "o.####"
    code, _, err = make.inside(capsys, *words.format(shot, out).split(), "--confidence")
    assert code == 2
    assert says in err
    assert not out.parent.exists()


def test_a_still_has_no_room_for_it(tmp_path, shot):
    output = Output(tmp_path / "o.png", numbers=[1])
    clip = Clip(shot, frames="1")
    with pytest.raises(InputError, match=r"store confidence\.left"):
        output.write(make.picture(1), clip.source(1), {"left": np.zeros((48, 64), "f4")})
