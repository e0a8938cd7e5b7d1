"""Rendered frames with vectors at another rate: exact laws, and what is refused."""

import shutil
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

import make_frames as make
import make_stereo as stereo
from wgmb import InputError, Shutter
from wgmb.io import exr
from wgmb.run.conversion import RateConversion

FAST = 2.0, 1.0  # pixels per frame
SLOW = 8.0, 4.0  # the same motion at a quarter of the rate


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """Frames 1 to 16 at 240 frames per second."""
    return make.write_sequence(tmp_path_factory.mktemp("quick"), range(1, 17), velocity=FAST)


def run(capsys, shot, folder, *options, suffix="exr", code=0):
    words = ("blur", shot, "-o", folder / f"b.####.{suffix}", "--method", "tap", *options)
    got, out, err = make.inside(capsys, *words)
    assert (got, out) == (code, ""), err
    return err


def read(path) -> np.ndarray:
    channels = make.plain_read(path)
    return np.stack([channels[f"ViewLayer.Combined.{c}"] for c in "RGB"], 2).astype("f4")


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


# ---- which frames, and how much of each -----------------------------------------------------


@pytest.mark.fast
@pytest.mark.parametrize("rates", [(240, 60), (120, 24), (24, 60), (144, 60), (60, 144), (24, 25)])
@pytest.mark.parametrize("degrees", [0, 90, 180, 360, 700])
def test_shares_of_every_exposure_add_up_to_1(rates, degrees):
    made = RateConversion(*map(Fraction, rates))
    there, shutter = range(1, 61), Shutter(degrees, "start", "triangle")
    for k in range(12):
        found = made.cells(made.at(1 + k, 1), shutter, there, ())
        assert sum(cell.share for cell in found) == pytest.approx(1, abs=1e-12)
        assert {cell.index for cell in found} <= set(there)


@pytest.mark.fast
def test_an_exposure_stays_in_its_shot_and_before_a_gap():
    made, shutter = RateConversion(Fraction(240), Fraction(60)), Shutter(720)
    there = [*range(1, 12), *range(14, 30)]
    indices = [c.index for c in made.cells(Fraction(9), shutter, there, {8})]
    assert indices == [8, 9, 10, 11]


@pytest.mark.fast
def test_output_frames_count_from_the_first_input_frame_on():
    clip = SimpleNamespace(numbers=list(range(101, 149)))
    assert RateConversion(Fraction(240), Fraction(60)).numbers(clip) == list(range(101, 113))
    assert len(RateConversion(Fraction(24), Fraction(60)).numbers(clip)) == 120
    assert len(RateConversion(Fraction(24000, 1001), Fraction(24)).numbers(clip)) == 48
    assert RateConversion(Fraction(240), Fraction(1)).numbers(clip) == [101]
    clip.numbers = [1, 2, 4]
    with pytest.raises(InputError, match="without gaps"):
        RateConversion(Fraction(240), Fraction(60)).numbers(clip)


# ---- pictures -------------------------------------------------------------------------------


def test_the_same_rate_gives_the_same_bytes(tmp_path, capsys, quick):
    few = "--frames", "1-3"
    run(capsys, quick, tmp_path / "a", *few, "--fps", "60")
    run(capsys, quick, tmp_path / "b", *few, "--fps-in", "120/2", "--fps", "60")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_240_made_60_is_the_blur_at_60_and_nearer_to_the_truth_than_an_average(
    tmp_path, capsys, quick
):
    err = run(capsys, quick, tmp_path / "c", "--fps-in", "240", "--fps", "60", "--samples", "64")
    assert "frames 1-16 at 240 frames per second become frames 1-4 at 60" in err
    assert "only the picture is written" in err
    assert make.names_in(tmp_path / "c") == [f"b.{n:04d}.exr" for n in (1, 2, 3, 4)]
    (tmp_path / "slow").mkdir()
    for n in (1, 2, 3, 4):  # at 60, frame n is frame 4 n - 3 of 240
        channels = make.colors(make.picture(4 * n - 3, FAST), "ViewLayer.Combined")
        _, _, inside = make._square(4 * n - 3, FAST)
        to_next = inside[..., None] * np.array(SLOW, np.float32)
        channels |= make.written("blender", -to_next, to_next)
        make.write_exr(tmp_path / "slow" / f"shot.{n:04d}.exr", channels)
    slow = str(tmp_path / "slow" / "shot.####.exr")
    run(capsys, slow, tmp_path / "d", "--samples", "64", "--layers", "picture")

    def error(got, want, where=(slice(8, -8), slice(8, -8))):
        return float(np.sqrt(np.mean((got - want)[where] ** 2)))

    for n in (2, 3):
        got, direct = (read(tmp_path / f / f"b.{n:04d}.exr") for f in "cd")
        at = 4 * n - 3
        truth = np.mean([make.picture(at + t, FAST) for t in np.linspace(-1, 1, 129)], 0)[..., :3]
        average = make.picture(at - 1, FAST) / 4 + make.picture(at, FAST) / 2
        average = (average + make.picture(at + 1, FAST) / 4)[..., :3]
        inner = np.all([make._square(at + t, FAST)[2] for t in (-2, 2)], axis=0)
        assert error(got, direct, inner) < 0.001  # two ways to sample one integral
        assert error(got, direct) < 0.03  # with silhouettes, which tap smears
        assert error(got, truth, inner) < 0.5 * error(average, truth, inner)
        assert error(got, truth) < error(average, truth)
    assert set(make.plain_read(tmp_path / "c" / "b.0002.exr")) == {
        f"ViewLayer.Combined.{c}" for c in "RGBA"
    }


def test_a_constant_picture_stays_constant_whatever_moves_in_it(tmp_path, capsys):
    light = np.full((make.HEIGHT, make.WIDTH, 4), [0.3, 2.0, 0.7, 1.0], np.float32)
    for n in range(1, 8):
        channels = make.colors(light, "ViewLayer.Combined", np.float32)
        make.write_exr(
            tmp_path / f"k.{n:04d}.exr", channels | make.written("blender", *make.motion(n))
        )
    options = "--fps-in", "72", "--fps", "25", "--shutter", "360", "--vectors", "blender"
    run(capsys, str(tmp_path / "k.####.exr"), tmp_path / "o", *options, "--curve", "cosine")
    names = make.names_in(tmp_path / "o")
    assert len(names) == 3
    for name in names:
        np.testing.assert_allclose(read(tmp_path / "o" / name), light[..., :3], rtol=2e-6)


def test_pictures_of_other_windows_are_summed_where_they_lie(tmp_path, capsys):
    """A moving data window around the same moving thing on black gives the same light."""
    folders = tmp_path / "whole", tmp_path / "parts"
    for folder in folders:
        folder.mkdir()
    for n in range(1, 6):
        channels = make.frame(n, velocity=(2.0, 0.0))
        _, _, inside = make._square(n, (2.0, 0.0))
        channels = {k: v * inside.astype(v.dtype) for k, v in channels.items()}
        del channels["ViewLayer.Depth.Z"]
        make.write_exr(folders[0] / f"w.{n:04d}.exr", channels)
        left, right = 6 + 2 * n, 38 + 2 * n
        part = {k: v[6:34, left : right + 1] for k, v in channels.items()}
        windows = {"data": (left, 6, right, 33), "display": (0, 0, make.WIDTH - 1, make.HEIGHT - 1)}
        make.write_exr(folders[1] / f"w.{n:04d}.exr", part, **windows)
    options = "--fps-in", "48", "--fps", "24", "--shutter", "360", "--vectors", "blender"
    for folder in folders:
        run(capsys, str(folder / "w.####.exr"), tmp_path / f"o {folder.name}", *options)
    for name in ("b.0002.exr", "b.0003.exr"):
        whole = read(tmp_path / "o whole" / name)
        file = exr.read(tmp_path / "o parts" / name)
        left, top, right, bottom = file.parts[0].data_window
        own = read(tmp_path / "o parts" / name)
        laid = np.zeros_like(whole)
        laid[top : bottom + 1, left : right + 1] = own
        assert own.shape[1] < whole.shape[1]
        np.testing.assert_allclose(laid, whole, atol=2e-3)


def test_no_exposure_mixes_two_shots(tmp_path, capsys):
    """Frames 5 to 8 are another shot, of other colours: no output frame has light of both."""
    for n in range(1, 9):
        channels = make.frame(n, velocity=FAST)
        for c, name in enumerate("RGB"):
            key = f"ViewLayer.Combined.{name}"
            keep = c == 0 if n < 5 else c == 1
            channels[key] = channels[key] * np.float16(keep)
        make.write_exr(tmp_path / f"x.{n:04d}.exr", channels)
    err = run(
        capsys, str(tmp_path / "x.####.exr"), tmp_path / "o",
        "--fps-in", "72", "--fps", "24", "--shutter", "720", "--cuts", "5",
    )  # fmt: skip
    assert "camera cut before frame 5" in err
    for name in make.names_in(tmp_path / "o"):
        light = read(tmp_path / "o" / name)
        assert min(light[..., 0].max(), light[..., 1].max()) == 0


HALF = "--fps-in", "48", "--fps", "24", "--shutter", "360"


def test_vectors_of_files_beside_the_pictures_are_those_of_one_file(tmp_path, capsys):
    places = {name: tmp_path / name for name in ("whole", "color", "data")}
    for place in places.values():
        place.mkdir()
    for n in range(1, 7):
        channels = make.frame(n)
        color = {k: v for k, v in channels.items() if "Combined" in k}
        data = {k: v for k, v in channels.items() if k not in color}
        for name, some in zip(places, (channels, color, data), strict=True):
            make.write_exr(places[name] / f"x.{n:04d}.exr", some)
    whole, color, data = (str(place / "x.####.exr") for place in places.values())
    run(capsys, whole, tmp_path / "a", *HALF)
    run(capsys, color, tmp_path / "b", *HALF, "--also", data)
    names = make.names_in(tmp_path / "a")
    assert names == make.names_in(tmp_path / "b") and len(names) == 3
    for name in names:
        np.testing.assert_array_equal(read(tmp_path / "b" / name), read(tmp_path / "a" / name))
    before = contents(tmp_path / "b")
    make.write_exr(places["data"] / "x.0006.exr", {
        k: v for k, v in make.frame(6, velocity=FAST).items() if "Combined" not in k
    })  # fmt: skip
    assert "2 already done" in run(capsys, color, tmp_path / "b", *HALF, "--also", data, "--resume")
    changed = {name for name, data in contents(tmp_path / "b").items() if data != before[name]}
    assert changed == {"b.0003.exr"}


def test_each_view_of_stereo_frames_is_converted_by_its_own_vectors(tmp_path, capsys):
    both = tmp_path / "both"
    both.mkdir()
    pattern = stereo.with_stereo(both, stereo.single_part, range(1, 7))
    run(capsys, pattern, tmp_path / "o", *HALF)
    names = make.names_in(tmp_path / "o")
    assert len(names) == 3
    for view, velocity in (("right", stereo.RIGHT), ("left", stereo.LEFT)):
        alone = tmp_path / view
        alone.mkdir()
        for n in range(1, 7):
            make.write_exr(alone / f"x.{n:04d}.exr", stereo.one_view(n, velocity))
        run(capsys, str(alone / "x.####.exr"), tmp_path / f"o {view}", *HALF)
        lead = "" if view == "right" else "left."
        for name in names:
            got, want = (make.plain_read(tmp_path / o / name) for o in ("o", f"o {view}"))
            for c in "RGB":
                np.testing.assert_array_equal(got[lead + c], want[c])
    run(capsys, pattern, tmp_path / "p", *HALF, "--view", "left")
    assert make.names_in(tmp_path / "p") == names


def test_views_in_files_of_their_own_stay_there(tmp_path, capsys):
    for view, velocity in (("left", stereo.LEFT), ("right", stereo.RIGHT)):
        for n in range(1, 5):
            make.write_exr(tmp_path / f"x.{view}.{n:04d}.exr", stereo.one_view(n, velocity))
    words = "blur", tmp_path / "x.%V.####.exr", "-o", tmp_path / "o" / "b.%V.####.exr"
    code, _, err = make.inside(capsys, *words, "--method", "tap", *HALF)
    assert code == 0, err
    assert make.names_in(tmp_path / "o") == [
        f"b.{view}.{n:04d}.exr" for view in ("left", "right") for n in (1, 2)
    ]


def test_a_view_that_a_frame_of_an_exposure_lacks_fails_that_exposure(tmp_path, capsys):
    for n in range(1, 7):
        views = ("left", "right") if n != 5 else ("left",)
        for view in views:
            channels = stereo.one_view(n, getattr(stereo, view.upper()))
            make.write_exr(tmp_path / f"x.{view}.{n:04d}.exr", channels)
    words = "blur", tmp_path / "x.%V.####.exr", "-o", tmp_path / "o" / "b.%V.####.exr"
    code, _, err = make.inside(capsys, *words, "--method", "tap", *HALF)
    assert code == 1 and "frame 3 failed" in err, err
    assert "b.right.0003.exr" not in make.names_in(tmp_path / "o")


# ---- runs -----------------------------------------------------------------------------------


def test_resume_keeps_what_is_done_and_redoes_what_was_made_of_other_files(tmp_path, capsys, quick):
    (tmp_path / "in").mkdir()
    for n in range(1, 17):
        shutil.copy(quick.replace("####", f"{n:04d}"), tmp_path / "in")
    shot, rates = str(tmp_path / "in" / "shot.####.exr"), ("--fps-in", "240", "--fps", "60")
    run(capsys, shot, tmp_path / "o", *rates)
    before = contents(tmp_path / "o")
    (tmp_path / "o" / "b.0003.exr").unlink()
    assert "3 already done" in run(capsys, shot, tmp_path / "o", *rates, "--resume")
    assert contents(tmp_path / "o") == before
    make.write_exr(tmp_path / "in" / "shot.0013.exr", make.frame(14, velocity=FAST))
    assert "3 already done" in run(capsys, shot, tmp_path / "o", *rates, "--resume")
    changed = {name for name, data in contents(tmp_path / "o").items() if data != before[name]}
    assert changed == {"b.0004.exr"}
    other = "--fps-in", "240", "--fps", "80"
    assert "already done" not in run(capsys, shot, tmp_path / "o", *other, "--resume")


def test_a_frame_that_cannot_be_read_fails_only_the_exposures_it_shares(tmp_path, capsys, quick):
    (tmp_path / "in").mkdir()
    for n in range(1, 17):
        shutil.copy(quick.replace("####", f"{n:04d}"), tmp_path / "in")
    (tmp_path / "in" / "shot.0009.exr").write_bytes(b"damaged")
    shot = str(tmp_path / "in" / "shot.####.exr")
    err = run(capsys, shot, tmp_path / "o", "--fps-in", "240", "--fps", "60", code=1)
    assert "frame 3 failed" in err
    assert "shot.0009.exr" in err
    assert make.names_in(tmp_path / "o") == ["b.0001.exr", "b.0002.exr", "b.0004.exr"]


def test_times_of_the_input_do_not_stay_in_headers(tmp_path, capsys):
    for n in (1, 2, 3):
        make.write_exr(tmp_path / f"t.{n:04d}.exr", make.frame(n), {"timeCode": f"0:{n}", "a": "b"})
    shot = str(tmp_path / "t.####.exr")
    run(capsys, shot, tmp_path / "o", "--fps-in", "48", "--fps", "24")
    header = make.plain_header(tmp_path / "o" / "b.0002.exr")
    assert "timeCode" not in header
    assert header["a"] == "b"


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ("--fps-in 240", "--fps-in needs --fps"),
        ("--fps-in 0 --fps 60", "--fps-in must be 0.001 to 1000"),
        ("--fps-in 240 --fps 60 --frames 1-9x2", "--fps-in needs frames that follow each other"),
        ("--fps-in 240 --fps 60 --rolling down", "a rolling shutter needs frames of the output's"),
        ("--fps-in 240 --fps 60 --confidence", "--confidence cannot be combined with --fps-in"),
        (
            "--fps-in 240 --fps 60 --workers 2",
            "--fps-in cannot be combined with --workers or",
        ),
    ],
)
def test_what_does_not_go_together_is_refused_in_one_line(tmp_path, capsys, quick, options, why):
    err = run(capsys, quick, tmp_path / "o", *options.split(), code=2)
    assert why in err
    assert err.count("\n") == 1
    assert not (tmp_path / "o").exists()


def test_videos_and_jobs_have_no_rate_of_their_frames(tmp_path, capsys):
    (tmp_path / "in.mp4").write_bytes(b"a video")
    words = "blur", tmp_path / "in.mp4", "-o", tmp_path / "o.mp4", "--fps-in", "240", "--fps", "60"
    code, _, err = make.inside(capsys, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert "--fps-in is for rendered frames" in err
    code, _, err = make.inside(capsys, "blur", "--job", tmp_path / "j.json", "--fps-in", "240")
    assert (code, err.count("\n")) == (2, 1)
    assert "--job holds all settings" in err
    words = "job", tmp_path / "x.####.exr", "-o", tmp_path / "o.####.exr", "-j", tmp_path / "j.json"
    code, _, err = make.inside(capsys, *words, "--fps-in", "240", "--fps", "60")
    assert (code, err.count("\n")) == (2, 1)
    assert "job files do not support --fps-in" in err and "wgmb blur" in err
