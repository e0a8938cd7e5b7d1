"""Vectors are written in the form of other programs: what is read back is the same motion."""

import av
import numpy as np
import pytest
import tifffile

import make_frames as make
from make_vectors import moving, side_by_side
from wgmb import (
    Blur,
    Clip,
    InputError,
    Passes,
    VectorOutput,
    Vectors,
    vectors_sequence,
)
from wgmb.output.vectors import FORMS, written
from wgmb.sequence.layers import vectors

BOTH = ("nuke", "blender", "plain")


def told(program: str, max_displace: float = 2048) -> Vectors:
    """Options that read the files written for a program."""
    if program == "rsmb":
        return Vectors("rsmb", layer="", scale=2 * max_displace)
    return Vectors(program)


def samples(path) -> np.ndarray:
    """Of a 16-bit still, 0..1, read without wgmb."""
    if path.suffix == ".png":  # Pillow has no colours of 16 bits
        with av.open(str(path)) as container:
            data = next(container.decode(video=0)).to_ndarray(format="rgba64le")
    else:
        data = tifffile.imread(path)
    assert data.dtype == np.uint16
    return data / np.float32(65535)


# ---- the numbers ----------------------------------------------------------------------------


@pytest.mark.parametrize("program", BOTH)
def test_what_programs_keep_in_pixels_is_exact(program):
    motion = side_by_side(moving()) * np.array([90, 0.01, 7, 1e-3], "f4")
    np.testing.assert_array_equal(vectors.read(written(motion, program), told(program)), motion)


@pytest.mark.parametrize(
    ("most", "step", "error"),
    [(2048, None, 1.3e-4), (64, None, 4e-6), (2048, 65535, 0.0314), (64, 65535, 0.001)],
)
def test_what_rsmb_keeps_is_as_near_as_its_steps(most, step, error):
    rng = np.random.default_rng(0)
    motion = rng.uniform(-most, most, (make.HEIGHT, make.WIDTH, 4)).astype("f4")
    channels = written(motion, "rsmb", most)
    assert not channels["B"].any()
    if step:
        channels = {
            k: np.rint(v * step).astype("f4") / np.float32(step) for k, v in channels.items()
        }
    got = vectors.read(channels, told("rsmb", most))
    assert np.abs(got[..., 2:] - motion[..., 2:]).max() <= error
    np.testing.assert_array_equal(got[..., :2], -got[..., 2:])


def test_rsmb_has_right_and_up_in_red_and_green():
    motion = np.zeros((1, 2, 4), "f4")
    motion[0, :, 2:] = (16, 8), (-64, 64)  # right and down; left and down
    channels = written(motion, "rsmb", 32)
    np.testing.assert_allclose(channels["R"], [[0.75, 0]])
    np.testing.assert_allclose(channels["G"], [[0.375, 0]])


# ---- the files ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), (1, 2, 3), "nuke")


@pytest.mark.parametrize("program", [p for p in FORMS if p != "flo"])
def test_a_sequence_is_written_as_floats_that_read_back_as_the_same_motion(
    shot, tmp_path, capsys, program
):
    out = tmp_path / "out" / "mv.####.exr"
    code, said, err = make.inside(capsys, "vectors", shot, "-o", out, "--as", program)
    assert (code, said) == (0, "")
    assert err.startswith("3 frames in ")
    for n in (1, 2, 3):
        channels = make.plain_read(tmp_path / "out" / f"mv.{n:04d}.exr")
        assert {v.dtype for v in channels.values()} == {np.dtype("f4")}
        want, error = side_by_side(make.motion(n)), 1.3e-4 if program == "rsmb" else 0
        np.testing.assert_allclose(vectors.read(channels, told(program)), want, atol=error)


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_rsmbs_are_images_of_16_bits_too(shot, tmp_path, capsys, suffix):
    out = tmp_path / f"mv.####.{suffix}"
    line = ("vectors", shot, "-o", out, "--as", "rsmb", "--max-displace", 64, "-q")
    assert make.inside(capsys, *line) == (0, "", "")
    found = samples(tmp_path / f"mv.0002.{suffix}")
    channels = {c: found[..., i] for i, c in enumerate("RGBA")}
    got = vectors.read(channels, told("rsmb", 64))
    np.testing.assert_allclose(got[..., 2:], make.motion(2)[1], atol=0.001)
    assert (found[..., 3] == 1).all()


def test_what_is_too_fast_for_rsmb_is_clipped_and_counted(shot, tmp_path, capsys):
    out = tmp_path / "mv.####.exr"
    line = ("vectors", shot, "-o", out, "--as", "rsmb", "--max-displace", 3)
    code, _, err = make.inside(capsys, *line)
    assert code == 0
    fast = int((np.abs(make.motion(2)[1]).max(axis=2) > 3).sum())
    assert f"frame 2: clipped {fast} pixels" in err
    channels = make.plain_read(tmp_path / "mv.0002.exr")
    assert channels["R"].max() == 1
    _, _, err = make.inside(capsys, *line[:-1], 5, "--overwrite")
    assert "clipped" not in err


def test_where_vectors_are_not_valid_rsmbs_alpha_says_so(tmp_path):
    mask = np.ones((make.HEIGHT, make.WIDTH), "f4")
    mask[:, 20:] = 0
    path = make.write_exr(tmp_path / "a.exr", make.frame(1, "nuke") | {"MV_Alpha.R": mask})
    clip = Clip(path)
    output = VectorOutput(tmp_path / "o.exr", "rsmb", numbers=[0], mask_of=clip.vector_mask)
    assert vectors_sequence(clip, output).done == [0]
    channels = make.plain_read(tmp_path / "o.exr")
    np.testing.assert_array_equal(channels["A"], mask)
    got = vectors.read(channels, told("rsmb"))[..., 2:]
    np.testing.assert_allclose(got, make.motion(1)[1] * mask[..., None], atol=1.3e-4)


def test_vectors_that_mean_something_else_are_put_right(tmp_path, capsys):
    for n in (1, 2, 3):
        channels = make.frame(n, "nuke")
        channels |= {k: v / 2 for k, v in channels.items() if "ward" in k}
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    out = tmp_path / "o.####.exr"
    code, _, err = make.inside(
        capsys, "vectors", tmp_path / "s.####.exr", "-o", out, "--as", "plain"
    )
    assert code == 0
    assert "nuke scale 2 (vectors of 0.5 frames)" in err
    got = vectors.read(make.plain_read(tmp_path / "o.0002.exr"), Vectors("plain"))
    np.testing.assert_allclose(got, side_by_side(make.motion(2)), atol=1e-5)


def test_the_motion_of_a_camera_is_written_too(tmp_path, capsys):
    pattern = make.write_depth_sequence(tmp_path)
    cameras = make.write_cameras(tmp_path / "c.json", (1, 2, 3))
    out = tmp_path / "o.####.exr"
    line = ("vectors", pattern, "-o", out, "--as", "nuke", "--camera", cameras, "--frames", "2")
    assert make.inside(capsys, *line)[0] == 0
    clip = Clip(pattern, passes=Passes(camera=cameras))
    want = Blur("tap").motion(clip.frame(clip.source(2)))
    assert np.abs(want).max() > 1
    got = vectors.read(make.plain_read(tmp_path / "o.0002.exr"), Vectors("nuke"))
    np.testing.assert_array_equal(got, want)


def test_windows_and_what_tells_of_time_and_camera_stay(tmp_path, capsys):
    data, display = (-4, 6, 59, 53), (0, 0, 79, 59)
    channels = make.frame(1, "nuke")
    attributes = {"cryptomatte/1/name": "C", "owner": "me"}
    path = make.write_exr(tmp_path / "a.exr", channels, attributes, data=data, display=display)
    for suffix in ("exr", "png"):
        line = ("vectors", path, "-o", tmp_path / f"o.{suffix}", "--as", "rsmb")
        assert make.inside(capsys, *line)[0] == 0
    header = make.plain_header(tmp_path / "o.exr")
    assert [tuple(map(int, edge)) for edge in header["dataWindow"]] == [(-4, 6), (59, 53)]
    assert [tuple(map(int, edge)) for edge in header["displayWindow"]] == [(0, 0), (79, 59)]
    assert header["owner"] == "me"
    assert "cryptomatte/1/name" not in header
    whole = samples(tmp_path / "o.png")
    assert whole.shape == (60, 80, 4)
    inside = make.plain_read(tmp_path / "o.exr")["R"][:, 4:]
    np.testing.assert_allclose(whole[6:54, :60, 0], inside, atol=1e-5)
    assert not whole[:6, :, 3].any()
    assert not whole[:, 60:, 3].any()
    np.testing.assert_allclose(whole[:6, :, :2], 0.5, atol=1e-5)


def test_a_window_outside_the_display_is_nothing_in_an_image(tmp_path, capsys):
    path = make.write_exr(
        tmp_path / "a.exr", make.frame(1, "nuke"), data=(200, 100, 263, 147), display=(0, 0, 9, 7)
    )
    assert make.inside(capsys, "vectors", path, "-o", tmp_path / "o.png", "--as", "rsmb")[0] == 0
    whole = samples(tmp_path / "o.png")
    assert whole.shape == (8, 10, 4)
    assert not whole[..., 3].any()


def stereo(folder):
    """Two views whose squares move their own ways."""
    ways = {"right": (6.0, 0.0), "left": (0.0, 6.0)}
    for n in (1, 2):
        channels = {}
        for view, way in ways.items():
            lead = "" if view == "right" else "left."
            channels |= {lead + c: p for c, p in make.colors(make.picture(n, way)).items()}
            for name, plane in make.written("nuke", *make.motion(n, way)).items():
                layer, _, component = name.partition(".")
                channels[f"{layer}.{view}.{component}"] = plane
        make.write_exr(folder / f"s.{n:04d}.exr", channels, {"multiView": list(ways)})
    return folder / "s.####.exr", ways


def test_of_stereo_frames_one_view_goes_into_a_file(tmp_path, capsys):
    pattern, ways = stereo(tmp_path)
    for name, more in (("d", ()), ("l", ("--view", "left"))):
        line = ("vectors", pattern, "-o", tmp_path / f"{name}.####.exr", "--as", "nuke", *more)
        code, _, err = make.inside(capsys, *line)
        assert code == 0
        assert ("only view right" in err) == (not more)
    line = ("vectors", pattern, "-o", tmp_path / "%V.####.exr", "--as", "nuke")
    code, _, err = make.inside(capsys, *line)
    assert code == 0
    assert "only view" not in err
    for name, view in (("d", "right"), ("l", "left"), ("right", "right"), ("left", "left")):
        path = tmp_path / f"{name}.0002.exr"
        got = vectors.read(make.plain_read(path), Vectors("nuke"))
        np.testing.assert_array_equal(got, side_by_side(make.motion(2, ways[view])))
        assert make.plain_header(path).get("view") == (view if name == view else None)
        assert "multiView" not in make.plain_header(path)


# ---- what is refused, replaced and done again -----------------------------------------------


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("-o o.####.exr --as nuk", "did you mean 'nuke'"),
        ("-o o.####.png --as nuke", "nuke vectors need .exr"),
        ("-o o.####.jpg --as rsmb", "need .exr"),
        ("-o o.mp4 --as rsmb", "need .exr"),
        ("-o o.####.exr --as plain --max-displace 9", "pixels"),
        ("-o o.####.exr --as rsmb --max-displace 0", "over 0"),
        ("-o o.####.exr --as rsmb --max-displace nan", "over 0"),
        ("-o o.####.exr --as nuke --vectors none", "no motion"),
        ("-o o.exr --as nuke", "pattern"),
        ("-o SHOT --as nuke", "is the input"),
        ("-o o.%V.####.exr --as nuke", "%V"),
    ],
)
def test_what_cannot_be_written_is_one_line_and_nothing(
    shot, tmp_path, capsys, monkeypatch, words, says
):
    monkeypatch.chdir(tmp_path)
    code, out, err = make.inside(capsys, "vectors", shot, *words.replace("SHOT", shot).split())
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert make.names_in(tmp_path) == []


def test_a_frame_without_vectors_fails_and_the_others_are_written(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1, 2, 3), "nuke")
    make.write_exr(tmp_path / "shot.0002.exr", make.frame(2, None))
    line = ("vectors", pattern, "-o", tmp_path / "o.####.exr", "--as", "nuke")
    code, _, err = make.inside(capsys, *line)
    assert code == 1
    assert "frame 2 failed: " in err
    assert {"o.0001.exr", "o.0003.exr"} <= set(make.names_in(tmp_path))
    assert "o.0002.exr" not in make.names_in(tmp_path)


def test_runs_are_resumed_and_files_replaced_only_when_asked(shot, tmp_path, capsys):
    line = ("vectors", shot, "-o", tmp_path / "o.####.exr", "--as", "nuke")
    assert make.inside(capsys, *line)[0] == 0
    code, _, err = make.inside(capsys, *line)
    assert (code, "and 2 more exist;" in err) == (2, True)
    before = (tmp_path / "o.0001.exr").read_bytes()
    (tmp_path / "o.0002.exr").unlink()
    _, _, err = make.inside(capsys, *line, "--resume")
    assert "1 frame in" in err
    assert "2 already done" in err
    assert (tmp_path / "o.0001.exr").read_bytes() == before
    other = (*line[:-1], "plain")
    assert "3 frames" in make.inside(capsys, *other, "--resume")[2]  # another form
    assert make.inside(capsys, *line, "--overwrite")[0] == 0
    assert (tmp_path / "o.0001.exr").read_bytes() == before


def test_the_library_refuses_an_unknown_program(tmp_path):
    with pytest.raises(InputError, match="did you mean 'blender'"):
        VectorOutput(tmp_path / "a.exr", "blendr", numbers=[0])
