"""A folder of frames as programs write it, and presets by program."""

import shutil
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import make_frames as make
from wgmb import Clip, InputError, Passes, Vectors
from wgmb.sequence.folder import frames_in
from wgmb.settings import InputSettings
from wgmb.settings.input import PROGRAMS, ProgramName

NUMBERS = (4, 5, 6)
UP = np.array([1, -1], "f4")


def write(folder, *names: str) -> None:
    """A sequence of each name with # for its numbers: of the picture, vectors or depth, by name."""
    for name in names:
        for n in NUMBERS:
            path = folder / name.replace("####", f"{n:04d}")
            path.parent.mkdir(parents=True, exist_ok=True)
            image = make.picture(n)
            if any(word in name.lower() for word in ("mv", "mot", "vel", "vector", "flow")):
                image = np.dstack([make.motion(n)[1] * UP, np.zeros(image.shape[:2], "f4")])
            elif any(word in name.lower() for word in ("depth", "z.", "z/")):
                image = np.full((*image.shape[:2], 3), 7, "f4")
            make.write_exr(path, {c: image[..., i].astype("f4") for i, c in enumerate("RGB")})


LAYOUTS = {
    "arnold": ("beauty.####.exr", "motionvector.####.exr", "Z.####.exr"),
    "vray": ("shot.####.exr", "shot.velocity.####.exr", "shot.VRayZDepth.####.exr"),
    "redshift": ("shot.####.exr", "shot_MotionVectors.####.exr", "shot_Z.####.exr"),
    "blender": ("Image####.exr", "Vector####.exr", "Depth####.exr"),
    "unreal": ("Seq.FinalImage.####.exr", "Seq.MotionVectors.####.exr", "Seq.WorldDepth.####.exr"),
    "ae": ("Comp 1_####.exr", "Comp 1 MV_####.exr", "Comp 1 Depth_####.exr"),
    "folders": ("beauty/s010.####.exr", "mv/s010.####.exr", "depth/s010.####.exr"),
    "numbers": ("beauty/####.exr", "vectors/####.exr", "depth/####.exr"),
}
SINGLES = {
    "files": ("beauty.exr", "vectors.exr", "depth.exr"),
    "shot": ("shot.exr", "shot_motionvector.exr", "shot_Z.exr"),
    "folders": ("rgba/shot.exr", "velocity/shot.exr", "depth/shot.exr"),
    "a version": ("beauty.exr", "vectors_v2.exr", "depth.exr"),
    "one number": ("beauty.0005.exr", "vectors.exr", "depth.exr"),
}


@pytest.mark.fast
@pytest.mark.parametrize("layout", LAYOUTS)
def test_picture_vectors_and_depth_are_found_by_their_names(tmp_path, layout):
    names = LAYOUTS[layout]
    write(tmp_path, *names, "shot.Normal.####.exr", "diffuse_direct.####.exr", "crypto.####.exr")
    found = frames_in(tmp_path)
    assert found.pattern == str(tmp_path / names[0])
    assert found.also == tuple(str(tmp_path / name) for name in names[1:])
    assert found.text.endswith(
        f": picture {names[0]}, vectors {names[1]}, depth {names[2]} (3 frames)"
    )


@pytest.mark.fast
@pytest.mark.parametrize("layout", SINGLES)
def test_a_single_frame_is_a_sequence_of_one(tmp_path, layout):
    for name in SINGLES[layout]:
        write(tmp_path, name)
    for name in ("thumbs.txt", ".beauty.exr"):
        (tmp_path / name).write_text("")
    found = frames_in(tmp_path)
    files = [Path(p).relative_to(tmp_path).as_posix() for p in (found.pattern, *found.also)]
    assert [one.replace("####", "0005").replace("v#", "v2") for one in files] == [*SINGLES[layout]]
    assert found.text.endswith("(1 frame)")


def test_a_single_frame_in_a_folder_is_blurred(tmp_path, capsys):
    write(tmp_path / "r", *SINGLES["files"])
    code, _, said = make.inside(capsys, "blur", tmp_path / "r", "-o", f"{tmp_path}/out/")
    assert code == 0
    assert "picture beauty.exr, vectors vectors.exr, depth depth.exr (1 frame)" in said
    (frame,) = Clip(tmp_path / "out" / "beauty.exr")
    assert np.abs(frame.color - make.picture(6)[..., :3]).max() > 0.1


@pytest.mark.fast
def test_passes_of_other_frames_are_left_out_and_named(tmp_path):
    write(tmp_path, "beauty.####.exr", "depth.####.exr")
    for n in NUMBERS:
        (tmp_path / f"depth.{n:04}.exr").rename(tmp_path / f"mv.{1000 + n}.exr")
    found = frames_in(tmp_path)
    assert not found.also
    left_out = "vectors mv.####.exr left out, as it holds frames 1004-1006"
    assert found.text.endswith(f"; {left_out}, and the picture holds frames 4-6")


def test_a_folder_is_blurred_in_one_command(tmp_path, capsys):
    write(tmp_path / "r", *LAYOUTS["arnold"])
    code, _, said = make.inside(
        capsys, "blur", tmp_path / "r", "-o", f"{tmp_path}/out/", "--frames", 5
    )
    assert code == 0
    assert "picture beauty.####.exr, vectors motionvector.####.exr, depth Z.####.exr" in said
    by_hand = (
        "--also",
        tmp_path / "r" / "motionvector.####.exr",
        "--also",
        tmp_path / "r" / "Z.####.exr",
    )
    pattern = tmp_path / "r" / "beauty.####.exr"
    code, *_ = make.inside(
        capsys, "blur", pattern, *by_hand, "-o", tmp_path / "hand.####.exr", "--frames", 5
    )
    assert code == 0
    own, hand = (
        Clip(p)[5].color for p in (tmp_path / "out/beauty.####.exr", tmp_path / "hand.####.exr")
    )
    np.testing.assert_array_equal(own, hand)
    for command in (("info",), ("vectors", "-o", tmp_path / "v.####.exr", "--as", "nuke")):
        code, out, said = make.inside(capsys, command[0], tmp_path / "r", *command[1:])
        assert code == 0
        assert "vectors motionvector.####.exr" in out + said


@pytest.mark.fast
def test_both_directions_and_own_vectors_are_taken(tmp_path):
    one = tmp_path / "one"
    write(tmp_path / "two", "rgb.####.exr", "forward_vector.####.exr", "backward_vector.####.exr")
    assert len(frames_in(tmp_path / "two").also) == 2
    one.mkdir()
    for n in NUMBERS:
        planes = make.colors(make.picture(n)) | {"forward.u": make.motion(n)[1][..., 0]}
        planes["forward.v"] = planes["forward.u"]
        make.write_exr(one / f"s.{n}.exr", planes)
    write(one, "mv.####.exr")
    assert frames_in(one).also == ()


@pytest.mark.fast
@pytest.mark.parametrize(
    ("names", "text"),
    [
        (("a.####.exr", "b.####.exr"), "picture may be a.####.exr or b.####.exr; name one"),
        (("a.####.exr", "mv.####.exr", "velocity.####.exr"),
         r"vectors may be mv.####.exr or velocity.####.exr; `also` takes one"),
        (("a.####.exr", "z.####.exr", "depth.####.exr"), r"depth may be .*`also`"),
        (("mv.####.exr", "z.####.exr"), "without pictures.*mv.####.exr, z.####.exr"),
        ((), "without pictures"),
    ],
)  # fmt: skip
def test_two_that_are_as_good_are_named(tmp_path, names, text):
    write(tmp_path, *names)
    with pytest.raises(InputError, match=text):
        frames_in(tmp_path)


@pytest.mark.fast
def test_what_is_told_decides(tmp_path):
    write(tmp_path, "a.####.exr", "mv.####.exr", "velocity.####.exr")
    chosen = (str(tmp_path / "mv.####.exr"),)
    assert frames_in(tmp_path, chosen).also == chosen
    (tmp_path / "x").mkdir()
    shutil.copytree(tmp_path, tmp_path / "x" / "y", ignore=shutil.ignore_patterns("x", "velocity*"))
    write(tmp_path / "x" / "y", "blurred.####.exr")
    found = frames_in(tmp_path / "x" / "y", leave_out=str(tmp_path / "x/y/blurred.####.exr"))
    assert found.pattern.endswith("a.####.exr")


@pytest.mark.fast
def test_unpadded_numbers_are_one_sequence(tmp_path):
    for n in (8, 9, 10, 11):
        make.write_exr(tmp_path / f"s.{n}.exr", make.colors(make.picture(5)))
    assert frames_in(tmp_path).pattern == str(tmp_path / "s.#.exr")


@pytest.mark.fast
def test_programs_set_what_is_not_given():
    assert set(PROGRAMS) == set(get_args(ProgramName))
    for name, program in PROGRAMS.items():
        alone = InputSettings(program=name).of_program
        assert alone == InputSettings(**program.options)
        assert alone.looks == InputSettings(program=name).looks
        for option, value in program.options.items():
            assert f"`{option}={value}`" in InputSettings(program=name).remark
    mine = InputSettings(program="nuke", depth_kind="planar")
    assert (mine.of_program.depth_kind, mine.of_program.vectors) == ("planar", "nuke")
    assert "depth_kind" not in mine.remark
    with pytest.raises(InputError, match="`program` must be"):
        _ = InputSettings(program="vrya").of_program


def program_frames(folder, name: str) -> str:
    """Frames as a program writes them, where the test cannot tell: a single one."""
    image, ahead = make.picture(5), make.motion(5)
    size = np.array(image.shape[1::-1], "f4")
    planes = {
        "ae": {"mv": 0.5 + ahead[1] * UP / 128},
        "arnold": {"motionvector": ahead[1] * UP},
        "blender": {"Vector": np.dstack([ahead[0] * UP, -ahead[1] * UP])},
        "nuke": {"forward": ahead[1] * UP, "backward": ahead[0] * UP},
        "redshift": {"MotionVectors": 0.5 + ahead[1] * UP / 64},
        "unreal": {"FinalImageMovieRenderQueue_MotionVectors": 0.5 - ahead[0] * UP / size},
        "vray": {"velocity": 0.5 + ahead[1] * UP / 64},
    }[name]
    parts = {"blender": "XYZW", "nuke": "uv"}.get(name, "RG")
    made = make.colors(image)
    for layer, plane in planes.items():
        made |= {f"{layer}.{c}": plane[..., i].astype("f4") for i, c in enumerate(parts)}
    made["depth.Z" if name != "blender" else "Depth.Z"] = np.full(image.shape[:2], 4, "f4")
    make.write_exr(folder / "s.0005.exr", made)
    return str(folder / "s.####.exr")


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_a_single_frame_of_each_program_is_read(tmp_path, capsys, name):
    pattern = program_frames(tmp_path, name)
    more = {"ae": {"vector_scale": 128.0}, "vray": {"vector_scale": 64.0},
            "redshift": {"vectors": "rsmb", "vector_scale": 64.0}}.get(name, {})  # fmt: skip
    clip = InputSettings(program=name, **more).open(pattern)
    motion = clip.frame(clip.source(5)).motion
    side = slice(0, 2) if name == "unreal" else slice(2, 4)
    np.testing.assert_allclose(motion[..., side], make.motion(5)[side.start // 2], atol=1e-3)
    code, out, _ = make.inside(capsys, "info", pattern, "--program", name)
    assert code == 0
    assert f"program   frames of {PROGRAMS[name].name}: --" in out


def test_a_run_tells_what_its_program_sets(tmp_path, capsys):
    pattern = program_frames(tmp_path, "nuke")
    code, _, said = make.inside(
        capsys, "blur", pattern, "-o", tmp_path / "o.####.exr", "--program", "nuke"
    )
    assert code == 0
    assert said.splitlines()[0] == "frames of Nuke: --vectors nuke, --depth-kind inverse"


@pytest.mark.parametrize("convention", ["rsmb", "vray"])
def test_the_unit_of_a_told_convention_is_found(tmp_path, convention):
    for n in NUMBERS:
        image, plane = make.picture(n), 0.5 + make.motion(n)[1] * UP / 128
        planes = make.colors(image) | {"velocity.R": plane[..., 0], "velocity.G": plane[..., 1]}
        make.write_exr(tmp_path / f"s.{n:04}.exr", planes)
    passes = Passes(vectors=Vectors(convention, "velocity"))
    clip = Clip(tmp_path / "s.####.exr", passes=passes)
    motion = clip.frame(clip.source(5)).motion
    np.testing.assert_allclose(motion[..., 2:], make.motion(5)[1], atol=0.1)
    assert clip.is_finding_notable
    single = Clip(tmp_path / "s.0005.exr", passes=passes)
    np.testing.assert_allclose(
        single.frame(single.source(5)).motion[..., 2:], make.motion(5)[1] / 128, atol=1e-4
    )
