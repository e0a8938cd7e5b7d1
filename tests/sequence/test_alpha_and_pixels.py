"""Alpha and pixels as programs write them: straight, 0 everywhere, wider than high; view layers."""

from fractions import Fraction

import av
import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb.io import exr, stills
from wgmb.sequence.layers.passes import Passes


def _sequence(folder, change, attributes=None):
    """Three frames of the square with alpha 0 around it; `change` edits their channels."""
    folder.mkdir(exist_ok=True)
    for number in (1, 2, 3):
        channels = make.frame(number, "plain")
        _, to_next = make.motion(number)
        inside = (to_next != 0).any(axis=2)
        for c in "RGBA":
            channels[c] = np.where(inside, channels[c] * 0.5, 0).astype("f4")
        change(channels, inside)
        make.write_exr(folder / f"s.{number:04}.exr", channels, attributes)
    return str(folder / "s.####.exr")


def _straight(channels, inside):
    for c in "RGB":
        channels[c] = np.where(inside, channels[c] * 2, 0.7).astype("f4")


def test_straight_alpha_gives_the_picture_of_premultiplied_colour(tmp_path):
    right = wgmb.Clip(_sequence(tmp_path / "right", lambda *_: None))
    straight = wgmb.Clip(
        pattern := _sequence(tmp_path / "wrong", _straight), passes=Passes(alpha="straight")
    )
    blur = wgmb.Blur("gather", shutter=180, samples=8)
    (wanted,), (seen,) = (
        [f.views[0].picture for f in wgmb.blurred(c, blur) if f.number == 2]
        for c in (right, straight)
    )
    np.testing.assert_allclose(seen, wanted, atol=1e-5)
    assert not any("straight" in note for note in straight.notes)
    for clip, is_told in ((right, False), (wgmb.Clip(pattern), True)):
        assert clip[2].color is not None
        assert any("straight" in note for note in clip.notes) == is_told


def test_light_without_alpha_is_written_and_told(tmp_path, capsys):
    def dark(channels, inside):
        channels["A"] = np.zeros_like(channels["A"])

    pattern = _sequence(tmp_path, dark)
    code, _, err = make.inside(
        capsys, "blur", pattern, "-o", tmp_path / "o.####.png", "--method", "tap"
    )
    assert code == 0 and "alpha is 0 everywhere" in err
    picture = stills.read(tmp_path / "o.0002.png")
    assert picture.shape[2] == 3 and picture.max() > 0.2


def test_a_picture_with_alpha_keeps_it(tmp_path, capsys):
    pattern = _sequence(tmp_path, lambda *_: None)
    code, _, err = make.inside(
        capsys, "blur", pattern, "-o", tmp_path / "o.####.png", "--method", "tap"
    )
    assert code == 0 and "alpha is" not in err
    assert stills.read(tmp_path / "o.0002.png").shape[2] == 4


@pytest.mark.parametrize("stated, wanted", [(2.0, 2), (0.5, Fraction(1, 2)), (1.0, 1)])
def test_the_shape_of_pixels_reaches_videos_and_is_told(tmp_path, capsys, stated, wanted):
    pattern = _sequence(tmp_path, lambda *_: None, {"pixelAspectRatio": stated})
    outputs = tmp_path / "o.mp4", tmp_path / "o.####.exr"
    for out in outputs:
        code, _, err = make.inside(capsys, "blur", pattern, "-o", out, "--method", "tap")
        assert code == 0
        assert ("as wide as high" in err) == (wanted != 1)
    with av.open(str(outputs[0])) as file:
        assert (file.streams.video[0].sample_aspect_ratio or 1) == wanted
    (part,) = exr.read(tmp_path / "o.0002.exr").parts
    assert part.attributes["pixelAspectRatio"] == stated


def test_the_view_layer_that_is_blurred_is_named_where_others_move_too(tmp_path):
    frame = make.frame(1)
    for name, layers in {
        "one": ("Back",),
        "two": ("Back", "Front"),
        "still": ("Back", "Sky"),
    }.items():
        channels = {
            k.replace("ViewLayer", layer): plane
            for layer in layers
            for k, plane in frame.items()
            if layer != "Sky" or "Vector" not in k
        }
        make.write_exr(tmp_path / f"{name}.exr", channels)
        clip = wgmb.Clip(tmp_path / f"{name}.exr")
        assert clip[clip.numbers[0]] is not None
        told = [note for note in clip.notes if "Back.Combined is blurred" in note]
        assert bool(told) == (name == "two")
        assert all("Front.Combined" in note for note in told)


def test_gaps_are_told(tmp_path, capsys):
    for number in (2, 4, 6, 7):
        make.write_exr(tmp_path / f"g.{number:04}.exr", make.frame(number))
    for number in (2, 4, 6):
        make.write_exr(tmp_path / f"t.{number:04}.exr", make.frame(number))
    for name, says in {
        "g": "frames 2-6x2: a neighbouring frame is missing",
        "t": "frames are 2 apart, but the shutter and the vectors count intervals of one frame",
    }.items():
        pattern, out = tmp_path / f"{name}.####.exr", tmp_path / f"{name}.out.####.exr"
        code, _, err = make.inside(capsys, "blur", pattern, "-o", out, "--skip-missing")
        assert code == 0 and says in err
