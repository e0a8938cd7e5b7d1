"""Sequences: which frames are read, which are done again, what is written, and that only."""

import numpy as np
import pytest
from PIL import Image

import make_frames as make
import wgmb
from wgmb import Blur, Frame, InputError
from wgmb.io import frame_numbers
from wgmb.output.output import Output
from wgmb.sequence import frame_cache
from wgmb.sequence.clip import Clip, Passes
from wgmb.sequence.layers.vectors import Vectors


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Frames 1 to 6 as Blender writes them."""
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, 7))


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


# ---- frames ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["f2", "f4"])
def test_a_picture_is_in_memory_once(tmp_path, kind):
    want = np.random.default_rng(3).random((9, 16, 4)).astype(kind)
    make.write_exr(tmp_path / "a.0001.exr", make.colors(want, kind=kind))
    source = Clip(tmp_path / "a.####.exr").source(1)
    picture = source.rgba
    np.testing.assert_array_equal(picture, want)
    assert not picture.flags.writeable and source.rgba is picture
    assert source.file is not None
    for channels in (source.channels, source.file.parts[0].channels):
        for i, name in enumerate("RGBA"):
            assert np.shares_memory(channels[name], picture)
            np.testing.assert_array_equal(channels[name], want[..., i])


def test_vectors_that_are_motion_as_stored_are_in_memory_once(shot):
    """Blender's x to the previous frame and y to the next; bit for bit, all channels stay."""
    clip, fresh = Clip(shot), Clip(shot).source(3).channels
    source = clip.source(3)
    frame = clip.with_neighbours(source)
    motion = frame.motion
    assert motion is not None and source.file is not None
    for axis in "XW":
        assert np.shares_memory(source.channels[f"ViewLayer.Vector.{axis}"], motion)
    for name, plane in source.channels.items():
        assert plane.dtype == fresh[name].dtype and plane.tobytes() == fresh[name].tobytes()
        assert source.file.parts[0].channels[name] is plane


# ---- names ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["s.####.exr", "s.%04d.exr", "s.$F4.exr", "s.@@@@.exr"])
def test_patterns_of_every_program_stand_for_the_same_files(tmp_path, name):
    assert frame_numbers.is_pattern(name)
    assert frame_numbers.frame_path(tmp_path / name, 7) == tmp_path / "s.0007.exr"
    assert frame_numbers.frame_path(tmp_path / name, 12345) == tmp_path / "s.12345.exr"


def test_a_name_without_pattern_stands_for_itself():
    assert not frame_numbers.is_pattern("shot.0001.exr")
    assert not frame_numbers.is_pattern("a.####/shot.0001.exr")
    assert frame_numbers.frame_path("x.exr", 5).name == "x.exr"


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("1-10x3", [1, 4, 7, 10]),
        ("1,3,5-8", [1, 3, 5, 6, 7, 8]),
        ("7", [7]),
        ("3-1", [3, 2, 1]),
        ("1-10:3", [1, 4, 7, 10]),
        ("-5--1:2,4", [-5, -3, -1, 4]),
    ],
)
def test_frame_ranges_are_understood(text, numbers):
    assert frame_numbers.frame_numbers(text) == numbers


@pytest.mark.parametrize("text", ["a-b", "1-", "1-5x0", "1-5:0", "one"])
def test_senseless_frame_ranges_are_refused_by_name(text):
    with pytest.raises(InputError, match="frames"):
        frame_numbers.frame_numbers(text)


@pytest.mark.parametrize("folder", ["plain", "with space (1)", "brackets [2]", "hash#4 at@ %d"])
def test_frames_are_found_in_folders_of_any_name(tmp_path, folder):
    place = tmp_path / folder
    place.mkdir()
    pattern = make.write_sequence(place, [3, 4])
    clip = Clip(pattern)
    assert clip.numbers == [3, 4]
    assert clip.dependencies.of(3) == [place / "shot.0003.exr"]


def test_other_files_beside_the_frames_do_not_count(tmp_path, shot):
    pattern = make.write_sequence(tmp_path, [1, 2])
    for name in ("shot.0009.png", "other.0003.exr", ".shot.0004.exr.part", "shot.exr"):
        (tmp_path / name).write_bytes(b"")
    assert Clip(pattern).numbers == [1, 2]


def test_missing_frames_are_listed_or_left_out(tmp_path):
    pattern = make.write_sequence(tmp_path, [1, 2, 5, 9])
    with pytest.raises(InputError, match=r"3-4,6-8; `skip_missing=True` leaves them out"):
        Clip(pattern)
    assert Clip(pattern, skip_missing=True).numbers == [1, 2, 5, 9]
    with pytest.raises(InputError, match="10"):
        Clip(pattern, frames="9-10")


@pytest.mark.parametrize("pattern", ["no.####.exr", "nofolder/no.####.exr", "no.exr"])
def test_frames_that_are_not_there_are_refused_by_name(tmp_path, pattern):
    with pytest.raises(InputError, match="no such"):
        Clip(tmp_path / pattern)


def test_nothing_to_do_is_an_error(shot):
    with pytest.raises(InputError):
        Clip(shot, frames="70-80", skip_missing=True)


def test_a_single_file_takes_no_frame_range(shot):
    with pytest.raises(InputError, match="pattern"):
        Clip(shot.replace("####", "0001"), frames="1-3")
    assert Clip(shot.replace("####", "0003")).numbers == [3]


# ---- what a frame is made of -------------------------------------------------------------


def test_a_frame_has_the_picture_and_its_motion(shot):
    clip = Clip(shot, frames="4")
    (frame,) = clip
    to_prev, to_next = make.motion(4)
    np.testing.assert_array_equal(frame.color, make.picture(4).astype("f2"))
    np.testing.assert_array_equal(frame.motion[..., :2], to_prev)
    np.testing.assert_array_equal(frame.motion[..., 2:], to_next)
    assert frame.number == 4
    assert "tested" in clip.finding


def test_wrong_vectors_are_found_out_on_the_first_frame_and_righted_on_all(tmp_path):
    for n in (1, 2, 3):
        channels = make.frame(n, "nuke")
        for name in ("forward.v", "backward.v"):
            channels[name] = -channels[name]
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    clip = Clip(tmp_path / "s.####.exr")
    for frame in clip:
        np.testing.assert_array_equal(frame.motion[..., 2:], make.motion(frame.number)[1])
    assert "flip y" in clip.finding
    assert "because" in clip.finding


def test_a_stated_convention_is_not_second_guessed(tmp_path):
    channels = make.frame(1, "nuke")
    channels["forward.v"] = -channels["forward.v"]
    make.write_exr(tmp_path / "s.0001.exr", channels)
    make.write_exr(tmp_path / "s.0002.exr", make.frame(2, "nuke"))
    clip = Clip(tmp_path / "s.####.exr", frames="1", passes=Passes(vectors=Vectors("nuke")))
    (frame,) = clip
    np.testing.assert_array_equal(
        frame.motion[..., 2:], make.motion(1)[1] * np.array([1, -1], "f4")
    )


def test_further_layers_come_from_other_files(tmp_path):
    for n in (1, 2):
        make.write_exr(tmp_path / f"rgb.{n:04d}.exr", make.frame(n, None))
        make.write_exr(tmp_path / f"mv.{n:04d}.exr", make.written("nuke", *make.motion(n)))
    passes = Passes(also=(str(tmp_path / "mv.####.exr"),))
    for frame in Clip(tmp_path / "rgb.####.exr", passes=passes):
        np.testing.assert_array_equal(frame.motion[..., 2:], make.motion(frame.number)[1])


def test_further_layers_of_another_size_are_refused_with_both_sizes(tmp_path):
    make.write_exr(tmp_path / "a.exr", make.frame(1, None))
    small = {k: v[:24] for k, v in make.written("nuke", *make.motion(1)).items()}
    make.write_exr(tmp_path / "mv.exr", small)
    clip = Clip(tmp_path / "a.exr", passes=Passes(also=(str(tmp_path / "mv.exr"),)))
    with pytest.raises(InputError, match=r"mv\.exr.*64 x 24.*64 x 48"):
        clip.source(0)


def test_stills_are_blurred_with_vectors_from_beside(tmp_path):
    Image.fromarray((make.picture(1)[..., :3] * 255).astype("u1")).save(tmp_path / "a.png")
    make.write_exr(tmp_path / "mv.exr", make.written("plain", *make.motion(1)))
    (frame,) = Clip(tmp_path / "a.png", passes=Passes(also=(str(tmp_path / "mv.exr"),)))
    assert frame.color.shape == (48, 64, 3)
    np.testing.assert_array_equal(frame.motion[..., 2:], make.motion(1)[1])


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_a_grey_image_is_a_mask(tmp_path, shot, kind):
    levels = np.tile(np.linspace(0, 255, 64).astype("u1"), (48, 1))
    path = tmp_path / f"mask.{kind}"
    if kind == "png":
        Image.fromarray(levels).save(path)
    else:
        make.write_exr(path, {"Y": levels.astype("f4") / 255})
    (frame,) = Clip(shot, frames="2", passes=Passes(holdout=str(path)))
    np.testing.assert_allclose(frame.holdout, levels / 255, atol=2e-3)


def test_a_mask_of_another_size_is_refused_with_both_sizes(tmp_path, shot):
    Image.new("L", (64, 40)).save(tmp_path / "m.png")
    with pytest.raises(InputError, match=r"m\.png.*64 x 48.*64 x 40"):
        list(Clip(shot, frames="2", passes=Passes(holdout=str(tmp_path / "m.png"))))


def test_masks_come_from_layers_of_the_frame(tmp_path):
    index = np.arange(48 * 64).reshape(48, 64).astype("f4") % 3
    make.write_exr(tmp_path / "a.exr", make.frame(1) | {"ViewLayer.IndexOB.X": index})
    passes = Passes(holdout="IndexOB=2", scale="IndexOB=1")
    (frame,) = Clip(tmp_path / "a.exr", passes=passes)
    np.testing.assert_array_equal(frame.holdout, index == 2)
    np.testing.assert_array_equal(frame.scale, index == 1)


def test_neighbours_have_masks_of_their_own(tmp_path):
    index = {n: (np.arange(48 * 64).reshape(48, 64) % 5 == n).astype("f4") for n in (1, 2, 3)}
    for n, plane in index.items():
        channels = make.frame(n) | {"ViewLayer.IndexOB.X": plane}
        make.write_exr(tmp_path / f"a.{n:04d}.exr", channels)
    clip = Clip(tmp_path / "a.####.exr", passes=Passes(holdout="IndexOB=1"))
    frame = clip.with_neighbours(clip.source(2))
    for n, one in ((1, frame.prev), (2, frame), (3, frame.next)):
        np.testing.assert_array_equal(one.holdout, index[n])


@pytest.mark.parametrize(
    "passes",
    [Passes(color="nope"), Passes(holdout="nope"), Passes(vectors=Vectors("nuke")),
     Passes(vectors=Vectors(layer="nope"))],
    ids=["colour", "holdout", "convention", "vector layer"],
)  # fmt: skip
def test_a_missing_layer_is_refused_with_the_files_name_once(shot, passes):
    with pytest.raises(InputError) as error:
        list(Clip(shot, frames="2", passes=passes))
    assert str(error.value).count("shot.0002.exr") == 1
    assert "available: " in str(error.value)


@pytest.mark.parametrize(
    "options",
    ["--layer nope", "--depth nope", "--vectors nuke", "--vectors blender --vector-layer nope",
     "--holdout nope", "--scale nope:2", "--holdout IndexOB=7"],
)  # fmt: skip
def test_a_layer_that_no_frame_has_is_one_line_before_the_first_frame(
    tmp_path, capsys, shot, options
):
    words = "blur", shot, "-o", tmp_path / "o" / "b.####.exr", "--method", "tap", *options.split()
    code, said, err = make.inside(capsys, *words)
    assert (code, said, err.count("\n")) == (2, "", 1)
    assert "available: " in err and not (tmp_path / "o").exists()


def test_a_layer_that_some_frames_lack_fails_those(tmp_path, capsys):
    for n in range(1, 6):
        plane = {"mask.Y": np.zeros((make.HEIGHT, make.WIDTH), "f4")} if n > 2 else {}
        make.write_exr(tmp_path / f"x.{n:04d}.exr", make.frame(n) | plane)
    words = "blur", tmp_path / "x.####.exr", "-o", tmp_path / "o" / "b.####.exr", "--method", "tap"
    code, _, err = make.inside(capsys, *words, "--holdout", "mask")
    assert code == 1 and "2 of 5 frames failed" in err
    assert make.names_in(tmp_path / "o") == [f"b.{n:04d}.exr" for n in (3, 4, 5)]


def test_vectors_of_passes_are_not_a_word():
    with pytest.raises(InputError, match=r"`vectors` must be Vectors, .*got 'none'"):
        Passes(vectors="none")


# ---- cameras --------------------------------------------------------------------------------


def camera_motion(pattern, camera, number=2, **more):
    clip = Clip(pattern, frames=str(number), passes=Passes(camera=camera, **more))
    (frame,) = clip
    return Blur("tap").motion(frame)


def per_unit(depth: float) -> float:
    """Pixels that a point at `depth` moves when the camera goes one unit sideways."""
    return make.projection()[0, 0] / depth * make.WIDTH / 2


@pytest.mark.parametrize("number", [2, 5])
def test_a_camera_that_goes_right_moves_the_picture_left(tmp_path, number):
    pattern = make.write_depth_sequence(tmp_path, (number,))
    camera = make.write_cameras(tmp_path / "cam.json", range(1, 8), step=0.5)
    motion = camera_motion(pattern, camera, number)
    want = 0.5 * per_unit(10) * np.array([1, 0, -1, 0])
    np.testing.assert_allclose(motion, np.broadcast_to(want, motion.shape), atol=2e-3)


def test_inverse_depth_says_the_same(tmp_path):
    camera = make.write_cameras(tmp_path / "cam.json", range(1, 4))
    pattern = make.write_depth_sequence(tmp_path, depth=0.25)
    motion = camera_motion(pattern, camera, depth_kind="inverse")
    np.testing.assert_allclose(motion[..., 2], -0.5 * per_unit(4), atol=2e-3)


def test_the_cameras_picture_is_the_display_window(tmp_path):
    """A camera that rolls turns about the display window's centre, wherever the data lies."""
    angle = 0.02
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    frames = {}
    for n in (1, 2, 3):
        world = np.eye(4)
        world[:2, :2] = np.linalg.matrix_power(turned, n)
        frames[n] = world.tolist()
    camera = make.write_cameras(tmp_path / "cam.json", (1, 2, 3),
                                camera_matrix_world=lambda n: frames[n],
                                projection=lambda n: make.projection(128, 96).tolist())  # fmt: skip
    data, display = (40, -10, 103, 37), (-5, -20, 122, 75)  # 128 x 96 shown
    pattern = make.write_depth_sequence(tmp_path, data=data, display=display)
    motion = camera_motion(pattern, camera)
    y, x = np.mgrid[:48, :64] + 0.5
    from_centre = np.stack([x + 40 + 5 - 64, y - 10 + 20 - 48], 2)
    # The camera turns anticlockwise, so the picture turns clockwise: the same way in y down.
    want = from_centre @ turned.T - from_centre
    np.testing.assert_allclose(motion[..., 2:], want, atol=5e-3)


def test_objects_are_told_apart_by_their_index(tmp_path):
    index = np.zeros((48, 64))
    index[:, 32:] = 3

    def body(n):
        world = np.eye(4)
        world[0, 3] = 0.25 * n
        return {"a": {"index": 3, "matrix_world": world.tolist()}}

    camera = make.write_cameras(tmp_path / "cam.json", (1, 2, 3), step=0.0, objects=body)
    motion = camera_motion(make.write_depth_sequence(tmp_path, index=index), camera)
    np.testing.assert_allclose(motion[:, :32], 0, atol=1e-3)
    np.testing.assert_allclose(motion[:, 32:, 2], 0.25 * per_unit(10), atol=2e-3)


def test_the_first_and_last_frame_use_the_neighbour_that_there_is(tmp_path):
    camera = make.write_cameras(tmp_path / "cam.json", (1, 2, 3))
    pattern = make.write_depth_sequence(tmp_path)
    whole = camera_motion(pattern, camera, 2)
    for n in (1, 3):
        np.testing.assert_allclose(camera_motion(pattern, camera, n), whole, atol=2e-3)


@pytest.mark.parametrize("numbers", [(7, 8), (2,)], ids=["other frames", "no neighbour"])
def test_a_frame_that_the_camera_file_cannot_serve_is_refused_by_its_name(tmp_path, numbers):
    camera = make.write_cameras(tmp_path / "cam.json", numbers)
    with pytest.raises(InputError, match=r"cam\.json"):
        camera_motion(make.write_depth_sequence(tmp_path), camera)


def test_a_camera_without_depth_is_refused_with_a_list_of_layers(tmp_path):
    make.write_exr(tmp_path / "c.0002.exr", make.colors(make.picture(2)))
    camera = make.write_cameras(tmp_path / "cam.json", (1, 2, 3))
    with pytest.raises(InputError, match=r"c\.0002\.exr.*depth"):
        camera_motion(tmp_path / "c.####.exr", camera)


# ---- writing --------------------------------------------------------------------------------


def run(capsys, shot, folder, *options, suffix="exr"):
    return make.inside(capsys, "blur", shot, "-o", folder / f"b.####.{suffix}", *options)


def test_every_frame_is_what_the_library_makes_of_it(tmp_path, capsys, shot):
    code, out, _ = run(capsys, shot, tmp_path, "--method", "tap", "--samples", 8, "--frames", "2-4")
    assert (code, out) == (0, "")
    assert make.names_in(tmp_path) == [f"b.{n:04d}.exr" for n in (2, 3, 4)]
    blur = Blur("tap", samples=8)
    for n in (2, 3, 4):
        got = make.plain_read(tmp_path / f"b.{n:04d}.exr")
        color = make.picture(n).astype("f2")
        to_prev, to_next = make.motion(n)
        want = blur(Frame(color, to_next, to_prev, number=n)).astype("f2")
        for i, c in enumerate("RGBA"):
            np.testing.assert_array_equal(got[f"ViewLayer.Combined.{c}"], want[..., i])
        for name, plane in make.frame(n).items():
            if "Combined" not in name:
                assert got[name].tobytes() == plane.tobytes()


def test_what_exists_is_not_overwritten_unless_told(tmp_path, capsys, shot):
    kept = tmp_path / "b.0003.exr"
    kept.write_bytes(b"precious")
    code, out, err = run(capsys, shot, tmp_path)
    assert (code, out) == (2, "")
    assert err.startswith("wgmb: ")
    assert err.count("\n") == 1
    assert "b.0003.exr" in err
    assert "--overwrite" in err
    assert contents(tmp_path) == {"b.0003.exr": b"precious"}
    assert run(capsys, shot, tmp_path, "--overwrite")[0] == 0
    assert kept.read_bytes() != b"precious"


def test_several_that_exist_are_counted(tmp_path, capsys, shot):
    for number in (2, 3):
        (tmp_path / f"b.{number:04d}.exr").write_bytes(b"precious")
    code, _, err = run(capsys, shot, tmp_path)
    assert code == 2
    assert "b.0002.exr and 1 more exist; --overwrite replaces them" in err


def test_the_same_run_twice_gives_the_same_bytes(tmp_path, capsys, shot):
    for suffix in ("exr", "png", "jpg", "tif"):
        for folder in ("a", "b"):
            run(capsys, shot, tmp_path / folder, "--frames", "2,3", suffix=suffix)
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_a_report_says_what_was_seen_in_the_frames(tmp_path):
    shot = make.write_sequence(tmp_path, range(1, 7))
    (tmp_path / "shot.0002.exr").write_bytes(b"damaged")
    clip = Clip(shot, frames="1-5", cuts="4,99")
    output = Output(tmp_path / "o.####.exr", numbers=clip.numbers, overwrite=True)
    report = wgmb.blur_sequence(clip, Blur("tap", samples=2), output)
    assert (report.done, list(report.failed)) == ([1, 3, 4, 5], [2])
    assert (report.total, report.rest) == (5, 0)
    assert (report.cuts, report.stray_cuts, report.on_disk) == ({4}, [99], (1, 6))
    assert report.finding == clip.finding
    assert report.sizes == {clip[1].size: [1, 3, 4, 5]}


@pytest.mark.parametrize("name", ["o.bmp", "o", "o.exr.gz"])
def test_an_output_of_unknown_kind_is_refused_with_what_there_is(tmp_path, name):
    with pytest.raises(InputError, match=r"\.exr.*\.png.*\.mp4"):
        Output(tmp_path / name, settings={}, numbers=[1])


def test_many_frames_need_a_pattern_or_a_video(tmp_path):
    with pytest.raises(InputError, match="pattern"):
        Output(tmp_path / "o.exr", settings={}, numbers=[1, 2])


def test_windows_metadata_and_premultiplied_alpha_survive_a_blur(tmp_path, capsys):
    channels = make.frame(2, "nuke")
    for name in "RGBA":
        channels[name] = channels[name] * np.float16(0.5)
    channels |= {"other.X": np.ones((48, 64), "u4"), "still.f": np.ones((48, 64), "f4")}
    path = make.write_exr(tmp_path / "a.exr", channels, {"owner": "me"}, data=(-9, 5, 54, 52),
                          display=(0, 0, 79, 59))  # fmt: skip
    assert make.inside(capsys, "blur", path, "-o", tmp_path / "o.exr")[0] == 0
    got, header = make.plain_read(tmp_path / "o.exr"), make.plain_header(tmp_path / "o.exr")
    assert {k: v.dtype for k, v in got.items()} == {k: v.dtype for k, v in channels.items()}
    assert header["owner"] == "me"
    assert "shutter" in header["wgmb"]
    assert tuple(np.concatenate(header["dataWindow"]).tolist()) == (-9, 5, 54, 52)
    assert tuple(np.concatenate(header["displayWindow"]).tolist()) == (0, 0, 79, 59)
    np.testing.assert_allclose(got["A"], 0.5, atol=1e-3)
    assert got["R"].max() <= 0.46


def test_frames_of_different_sizes_do_not_make_a_video_of_stretched_ones(tmp_path, capsys):
    for n, rows in ((1, 48), (2, 24), (3, 48)):
        make.write_exr(tmp_path / f"s.{n:04d}.exr", {k: v[:rows] for k, v in make.frame(n).items()})
    for suffix in (".mp4", ".gif"):
        code, out, err = make.inside(capsys, "blur", tmp_path / "s.####.exr", "-o",
                                     tmp_path / f"v{suffix}")  # fmt: skip
        assert (code, out) == (1, "")
        assert "64 x 24" in err


def test_a_clip_holds_no_more_than_a_few_frames(shot):
    clip = Clip(shot)
    for _ in clip:
        assert len(clip.cache._kept) <= 3


def test_the_folder_of_the_output_is_made(tmp_path, capsys, shot):
    folder = tmp_path / "new" / "deep"
    assert run(capsys, shot, folder, "--frames", "1")[0] == 0
    assert make.names_in(folder) == ["b.0001.exr"]


# ---- frames by iteration and by number ------------------------------------------------------


def test_frames_of_a_loop_have_neighbours_that_are_read_when_they_are_asked_for(tmp_path):
    clip = Clip(make.write_sequence(tmp_path, (1, 2, 3, 4)))
    assert (len(clip), 3 in clip, 7 in clip) == (4, True, False)
    frames = list(clip)
    assert [frame.number for frame in frames] == [1, 2, 3, 4]
    assert (frames[0].prev, frames[3].next) == (None, None)
    third = clip[3]
    assert (third.prev.number, third.next.number, third.prev.prev.number) == (2, 4, 1)
    np.testing.assert_array_equal(third.next.color, frames[3].color)
    assert third.between(None, third.next).prev is None
    (tmp_path / "shot.0002.exr").unlink()
    lonely = Clip(str(tmp_path / "shot.####.exr"), skip_missing=True)[3]
    assert lonely.prev is None and lonely.next is not None
    with pytest.raises(InputError, match=r"frame 9 is not in Clip\("):
        clip[9]


def test_a_frame_alone_reads_no_other(tmp_path, monkeypatch):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    read, real = [], frame_cache.FrameCache.source
    clip = Clip(pattern, passes=Passes(vectors=Vectors("blender")))
    monkeypatch.setattr(
        frame_cache.FrameCache,
        "source",
        lambda self, number, *more: (read.append(number), real(self, number, *more))[1],
    )
    frame = clip[2]
    assert "prev" in repr(clip[2].between(frame, None)) and "prev" not in repr(frame)
    assert set(read) == {2}
    wgmb.Blur("tap", samples=2)(frame)
    assert set(read) == {2}


def test_a_loop_with_gather_gives_what_files_get(tmp_path):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    blur = wgmb.Blur("gather", samples=4)
    clip = Clip(pattern)
    looped = [blur(frame) for frame in clip]
    for one, want in zip(looped, wgmb.blurred(Clip(pattern), blur), strict=True):
        np.testing.assert_array_equal(one, want.views[0].picture)


def test_no_neighbour_lies_beyond_a_cut(tmp_path):
    clip = Clip(make.write_sequence(tmp_path, (1, 2, 3)), cuts="only:2")
    assert clip[1].next is None and clip[2].prev is None and clip[2].next is not None
