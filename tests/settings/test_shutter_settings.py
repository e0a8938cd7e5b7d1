"""The shutter as a user gives it: degrees, or a part of a second."""

import struct
from fractions import Fraction

import pytest

import make_clips as clips
import make_frames as make
import raw_exr
from wgmb import InputError, blur_pictures
from wgmb.io import record
from wgmb.settings import ShutterSettings

FILM = Fraction(24000, 1001)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("shutter", "fps", "degrees"),
    [("1/48", 24, 180), ("1/60", 30, 180), ("0.5/24", 24, 180), ("1/48", FILM, 180 / 1.001),
     ("1/8", 24, 1080), (90, None, 90), (None, None, 180)],
)  # fmt: skip
def test_a_part_of_a_second_is_an_angle_at_a_rate(shutter, fps, degrees):
    made = ShutterSettings(shutter=shutter).resolved(fps=fps)
    assert made.make().degrees == pytest.approx(degrees, 1e-12)


@pytest.mark.fast
@pytest.mark.parametrize("text", ["half", "1/0", "1/", "/48", "-1/48", "1/48s", "1e3/2", ""])
def test_other_texts_are_refused(text):
    with pytest.raises(InputError, match="must be degrees such as 180, or a part of a second"):
        ShutterSettings(shutter=text).resolved(fps=24)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("angle", "said"), [(0.5, "Blender's 0.5 is 180 degrees"), (1, "Blender's 1 is 360 degrees"),
                        (0, ""), (5, ""), (180, ""), (None, ""), ("1/48", "")],
)  # fmt: skip
def test_an_angle_that_is_none_is_told(angle, said):
    assert ShutterSettings(shutter=angle).remark.endswith(said)
    assert bool(ShutterSettings(shutter=angle).remark) == bool(said)


def frames(folder, rate):
    """A sequence whose files state a rate."""
    for n in (1, 2, 3):
        planes = make.frame(n)
        size = next(iter(planes.values())).shape[::-1]
        more = [
            raw_exr.attribute("framesPerSecond", "rational", struct.pack("<iI", *(rate or (1, 1))))
        ]
        channels = {name: (plane, 1, 1) for name, plane in planes.items()}
        path = folder / f"shot.{n:04d}.exr"
        raw_exr.write_sampled(path, channels, size, *(more if rate else ()))
    return folder / "shot.####.exr"


@pytest.mark.parametrize(
    ("rate", "words", "degrees"), [((24, 1), (), 180), (None, ("--fps", "30"), 225)]
)
def test_frames_take_it_at_the_rate_of_the_files_or_of_the_output(
    tmp_path, capsys, rate, words, degrees
):
    pattern, how = frames(tmp_path, rate), ("--method", "tap", "--shutter", "1/48", *words)
    code, _, _ = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr", *how)
    assert (code, record.read((tmp_path / "o.0002.exr").read_bytes())["shutter"]) == (0, degrees)


def test_frames_without_a_rate_say_what_is_needed(tmp_path, capsys):
    line = "blur", frames(tmp_path, None), "-o", tmp_path / "o.####.exr", "--shutter", "1/48"
    code, _, err = make.inside(capsys, *line)
    needs = "a part of a second needs the rate of the frames; set --fps, or give degrees such as"
    assert (code, err) == (2, f"wgmb: --shutter 1/48: {needs} 180\n")


@pytest.mark.parametrize(("words", "degrees"), [((), 180), (("--fps", "12"), 90)])
def test_a_video_takes_it_at_its_output_rate(tmp_path, capsys, words, degrees):
    path, to = clips.write(tmp_path / "a.mp4"), tmp_path / "b.mp4"
    line = "blur", path, "-o", to, "--flow", "none", "--shutter", "1/48", *words
    assert make.inside(capsys, *line)[0] == 0
    assert record.read_file(to)[0]["shutter"] == degrees


def test_few_degrees_are_told_of_videos_and_frames(tmp_path, capsys):
    """`--shutter 0.5`, as Blender counts, gave no blur and no word."""
    path = clips.write(tmp_path / "a.mp4")
    video = path, "-o", tmp_path / "b.mp4", "--flow", "none"
    rendered = frames(tmp_path, None), "-o", tmp_path / "o.####.exr", "--method", "tap"
    for words in (video, rendered):
        code, _, err = make.inside(capsys, "blur", *words, "--shutter", "0.5")
        assert code == 0
        assert (
            "--shutter 0.5 is in degrees, and hardly blurs; Blender's 0.5 is 180 degrees\n" in err
        )


def test_pictures_need_their_rate(tmp_path):
    with pytest.raises(InputError, match="needs the rate of the frames"):
        blur_pictures([], shutter="1/48", flow="none")
    assert blur_pictures([], fps_in=24, shutter="1/48", flow="none") is not None
