"""Stereo frames: which view a channel belongs to, each view's own blur, and the files written."""

import numpy as np
import OpenEXR
import pytest

import make_frames as make
from make_stereo import (
    LEFT,
    NUKE,
    RIGHT,
    STEREO,
    blenders,
    many_parts,
    nukes,
    one_view,
    single_part,
    with_stereo,
)
from wgmb import (
    Blur,
    Clip,
    InputError,
    Output,
    blur_sequence,
)
from wgmb.io import exr
from wgmb.sequence.layers import stereo

# ---- the rule -------------------------------------------------------------------------------

THREE, ONE = ["center", "left", "right"], ["left"]


@pytest.mark.parametrize(
    ("name", "part_view", "multi", "expected"),
    [
        ("R", None, STEREO, ("", "right", "R")),
        ("Z", None, STEREO, ("", "right", "Z")),
        ("left.R", None, STEREO, ("", "left", "R")),
        ("forward.left.u", None, STEREO, ("forward", "left", "u")),
        ("whitebarmask.right.mask", None, STEREO, ("whitebarmask", "right", "mask")),
        ("disparityL.x", None, STEREO, ("disparityL", None, "x")),
        ("right.Y", None, NUKE, ("", "right", "Y")),
        ("Y", None, NUKE, ("", "left", "Y")),
        ("left.B", None, THREE, ("", "left", "B")),
        ("B", None, THREE, ("", "center", "B")),
        ("forward.u", "left", [], ("forward", "left", "u")),
        ("Z", "left", [], ("", "left", "Z")),
        ("disparityR.x", None, [], ("disparityR", None, "x")),
        ("ViewLayer.Combined.left.R", None, NUKE, ("ViewLayer.Combined", "left", "R")),
        ("ViewLayer.Combined.R", None, ONE, ("ViewLayer.Combined", "left", "R")),
        ("right.depth.Z", None, NUKE, ("depth", "right", "Z")),
        ("depth.Z", None, NUKE, ("depth", "left", "Z")),
        ("left.forward.left.u", None, NUKE, ("left.forward", "left", "u")),
        ("a.b.R", None, [], ("a.b", None, "R")),
    ],
)
def test_a_channel_belongs_to_the_view_that_the_documentation_says(
    name, part_view, multi, expected
):
    there = {name, "right.depth.Z"}
    assert stereo.split(name, part_view, multi, there) == expected


def part_of(name: str, channels: str, **attributes) -> exr.Part:
    window = (0, 0, 0, 0)
    planes = dict.fromkeys(channels.split(), np.zeros((1, 1), "f2"))
    return exr.Part(name, planes, attributes, window, window)


def found(*parts: exr.Part) -> dict:
    """Names by view."""
    return {v: sorted(p) for v, p in stereo.by_view(exr.Exr(make.Path("a.exr"), [*parts])).items()}


def test_a_parts_name_leads_only_where_its_channels_need_it():
    rgb = part_of("rgba_right", "R G B A", view="right")
    depth = part_of("part7", "Z", view="right")
    forward = part_of("forward", "u v", view="right")
    assert found(rgb, depth, forward) == {
        "right": ["A", "B", "G", "R", "Z", "forward.u", "forward.v"]
    }
    diffuse = part_of("diffuse_right", "R G B", view="right")
    layers = {name.rpartition(".")[0] for name in found(rgb, diffuse, depth)["right"]}
    assert layers == {"", "rgba", "diffuse"}
    normal = part_of("N", "X Y Z", view="right")
    assert {"N.X", "N.Y", "N.Z"} < set(found(rgb, normal)["right"])
    both = [part_of(view, "R G B mask character.R", view=view) for view in ("left", "right")]
    named = ["B", "G", "R", "character.R", "mask"]
    assert found(*both) == {"left": named, "right": named}


@pytest.mark.parametrize(
    ("asked", "expected"),
    [("rgba", "rgba.R"), ("RGBA", "rgba.R"), ("rgb", "R"), ("zpass", "zpass.Z"),
     ("mv.forward", "mv.forward.u"), ("forward", "forward.u")],
)  # fmt: skip
def test_a_layer_may_be_asked_for_by_the_name_of_its_part(asked, expected):
    parts = [part_of("rgba", "R G B"), part_of("zpass", "Z"), part_of("mv", "forward.u")]
    assert expected in stereo.by_view(exr.Exr(make.Path("a.exr"), parts), [asked])[None]


def test_layers_of_parts_are_found_by_the_options_that_name_them(tmp_path, capsys):
    """As command lines did when a part's name always led."""
    channels = one_view(1, RIGHT)
    masks = {"Y": np.ones((make.HEIGHT, make.WIDTH), "f4")}
    parts = [make.part(dict(list(channels.items())[i:j]), name=name)
             for name, i, j in (("rgba", 0, 4), ("far", 4, 5), ("mv", 5, 7))]  # fmt: skip
    path = make.write_parts(tmp_path / "a.exr", [*parts, make.part(masks, name="matte")])
    options = "--layer", "rgba", "--depth", "far", "--vectors", "nuke", "--holdout", "matte"
    for name in ("forward", "mv.forward"):
        out = tmp_path / "o.exr"
        more = "--vector-layer", name, "--overwrite"
        code, _, err = make.inside(capsys, "blur", path, "-o", out, *options, *more)
        assert code == 0, err
    assert make.plain_header(out, 3)["name"] == "matte"


def test_the_same_channel_of_two_views_is_no_clash():
    right, left = part_of("a", "R G B", view="right"), part_of("b", "R G B", view="left")
    shared = part_of("c", "disparity.x")
    assert found(right, left, shared) == {
        "right": ["B", "G", "R"], "left": ["B", "G", "R"], None: ["disparity.x"]
    }  # fmt: skip


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ([part_of("", "R right.R G", multiView=["right", "left"])], "R and right.R are both R"),
        ([part_of("", "a.left.Z left.a.Z", multiView=NUKE)], "a.left.Z and left.a.Z are both a.Z"),
        ([part_of("x", "R"), part_of("y", "R", view="left")], "'x', must name its view.*: left"),
        ([part_of("", "R a.b.R", multiView=["right", "a.b"])], "no periods or blanks.*'a.b'"),
        ([part_of("", "R", multiView=["right", "le ft"])], "no periods or blanks.*'le ft'"),
        ([part_of("", "R", multiView=["left", "/abs/x"])], "'/abs/x', cannot be part of a file's"),
        ([part_of("", "R", multiView=["left", "a\\b"])], "cannot be part of a file's name"),
        ([part_of("", "R", view="left"), part_of("b", "R", view="../../x")], "'../../x', cannot"),
        ([part_of("", "R", view="left"), part_of("b", "R", view="..")], "'..', cannot be part"),
        ([part_of("", "R", view="left"), part_of("b", "R", view="a/b")], "'a/b', cannot be part"),
        ([part_of("", "R", view="\x1b[2J")], "cannot be part of a file's name"),
    ],
)
def test_what_contradicts_the_documentation_is_named(parts, says):
    with pytest.raises(InputError, match=rf"^a\.exr: .*{says}"):
        found(*parts)


# ---- files ----------------------------------------------------------------------------------


def plain_parts(path) -> list[tuple[str, dict, dict]]:
    """Name, header and channels of every part, read without wgmb."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return [
            (p.name(), dict(p.header), {n: c.pixels.copy() for n, c in p.channels.items()})
            for p in file.parts
        ]


def alone(folder, number: int, velocity, convention="nuke", **options):
    """The blurred picture of one eye from files of its own."""
    pattern = make.write_sequence(folder, (1, 2, 3), convention, velocity)
    if convention == "nuke":
        for n in (1, 2, 3):
            make.write_exr(folder / f"shot.{n:04d}.exr", one_view(n, velocity))
    clip = Clip(pattern)
    return Blur("gather")(clip.with_neighbours(clip.source(number)))


FORMS = (single_part, many_parts, nukes, blenders)


@pytest.mark.parametrize("form", FORMS)
def test_every_view_follows_its_own_vectors_and_all_else_is_as_it_was(tmp_path, form):
    clip = Clip(with_stereo(tmp_path, form))
    order = ("right", "left") if form in (single_part, many_parts) else ("left", "right")
    assert clip.views == order
    report = blur_sequence(clip, Blur("gather"), Output(tmp_path / "o.####.exr", numbers=[1, 2, 3]))
    assert report.done == [1, 2, 3]
    results = Clip(tmp_path / "o.####.exr")
    convention = "blender" if form is blenders else "nuke"
    for view, velocity in (("right", RIGHT), ("left", LEFT)):
        (tmp_path / view).mkdir()
        want = alone(tmp_path / view, 2, velocity, convention)
        got = results.source(2, view).rgba
        np.testing.assert_array_equal(got, exr.to_half(want))
        assert np.abs(got - clip.source(2, view).rgba).max() > 0.05
    pictures = {"R", "G", "B", "A"}
    before, after = plain_parts(tmp_path / "s.0002.exr"), plain_parts(tmp_path / "o.0002.exr")
    assert [p[0] for p in before] == [p[0] for p in after]
    changed = 0
    for (_, header, channels), (_, new_header, new) in zip(before, after, strict=True):
        assert list(new) == list(channels)
        assert all(
            str(new_header[k]) == str(v)
            for k, v in header.items()
            if k not in ("channels", "chunkCount")
        )
        for name, plane in channels.items():
            assert new[name].dtype == plane.dtype
            if new[name].tobytes() != plane.tobytes():
                assert name.rpartition(".")[2] in pictures
                changed += 1
    assert changed == 6  # alpha is 1 everywhere


def test_one_view_may_be_chosen_and_all_are_written(tmp_path, capsys):
    pattern = with_stereo(tmp_path, many_parts)
    for view, name in ((None, "both"), ("left", "one")):
        options = ("--view", view) if view else ()
        out = tmp_path / f"{name}.####.exr"
        assert make.inside(capsys, "blur", pattern, "-o", out, "-q", *options)[0] == 0
    both, one = Clip(tmp_path / "both.####.exr"), Clip(tmp_path / "one.####.exr")
    source = Clip(pattern).source(2, "right")
    np.testing.assert_array_equal(one.source(2, "left").rgba, both.source(2, "left").rgba)
    np.testing.assert_array_equal(one.source(2, "right").rgba, source.rgba)
    assert (both.source(2, "right").rgba != source.rgba).any()


def test_one_view_a_file_is_that_view(tmp_path):
    """As Blender writes individual views: names without the view, which an attribute tells."""
    path = make.write_exr(tmp_path / "a.exr", make.frame(1, "blender"), {"multiView": ["left"]})
    source = Clip(path).source(0)
    assert (source.view, source.color[0]) == ("left", "ViewLayer.Combined.R")
    path = make.write_exr(tmp_path / "b.exr", make.frame(1, "nuke"), {"view": "right"})
    assert Clip(path).views == ("right",)


def test_neighbours_are_matched_by_name_whatever_their_order(tmp_path):
    with_stereo(tmp_path, single_part, (1, 3))
    pattern = with_stereo(tmp_path, nukes, (2,))
    assert Clip(pattern).views == ("right", "left")
    for view, velocity in (("right", RIGHT), ("left", LEFT)):
        clip = Clip(pattern)
        frame = clip.with_neighbours(clip.source(2, view))
        assert frame.prev is not None
        np.testing.assert_array_equal(frame.prev.color, make.picture(1, velocity).astype("f2"))
    assert [s.view for s in Clip(pattern).sources(2)] == ["right", "left"]


def test_a_neighbour_without_that_view_is_not_used(tmp_path):
    pattern = with_stereo(tmp_path, single_part, (1, 2))
    make.write_exr(tmp_path / "s.0003.exr", one_view(3, LEFT), {"view": "left"})
    clip = Clip(pattern)
    frame = clip.with_neighbours(clip.source(2, "right"))
    assert frame.prev is not None
    assert frame.next is None
    assert clip.unread == {3}


def test_cuts_and_the_meaning_of_vectors_are_those_of_the_default_view(tmp_path):
    """The other view's picture jumps where the default view's does not."""
    for n in (1, 2, 3):
        (part,) = single_part(n)
        channels = {k: c.pixels for k, c in part.channels.items()}
        if n == 3:
            noise = np.random.default_rng(0).random((make.HEIGHT, make.WIDTH))
            channels |= {f"left.{c}": noise.astype("f2") for c in "RGB"}
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels, {"multiView": STEREO})
    for chosen in (None, "left"):
        clip = Clip(tmp_path / "s.####.exr", view=chosen)
        assert clip.with_neighbours(clip.source(2, "left")).next is not None
        assert not clip.cuts


# ---- other outputs --------------------------------------------------------------------------


def test_a_picture_or_video_has_the_default_view_and_percent_v_makes_one_of_each(tmp_path, capsys):
    pattern = with_stereo(tmp_path, single_part, (1, 2))
    for name in ("plain.####.png", "%V/eye.%V.####.png", "film.mp4", "film.%V.mp4", "%V.####.exr"):
        code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "out" / name, "-q")
        assert (code, err) == (0, "")
    out = tmp_path / "out"
    assert make.names_in(out) == [
        "film.left.mp4", "film.mp4", "film.right.mp4", "left", "left.0001.exr", "left.0002.exr",
        "plain.0001.png", "plain.0002.png", "right", "right.0001.exr", "right.0002.exr",
    ]  # fmt: skip
    assert make.names_in(out / "left") == ["eye.left.0001.png", "eye.left.0002.png"]
    eye = (out / "right/eye.right.0001.png").read_bytes()
    assert len(eye) == len((out / "plain.0001.png").read_bytes())
    one = Clip(out / "left.####.exr")
    assert one.views == ("left",)
    assert sorted(make.plain_read(out / "left.0001.exr")) == [
        "A", "B", "G", "R", "Z", "disparityL.x", "forward.u", "forward.v"
    ]  # fmt: skip
    assert make.plain_header(out / "left.0001.exr")["multiView"] == ["left"]
    again = make.inside(capsys, "blur", pattern, "-o", out / "%V.####.exr", "--resume")
    assert again[2].startswith("0 frames")
    (out / "right.0002.exr").unlink()
    again = make.inside(capsys, "blur", pattern, "-o", out / "%V.####.exr", "--resume")
    assert again[2].startswith("1 frame in")


def test_percent_v_reads_a_file_of_each_view(tmp_path, capsys):
    for n in (1, 2):
        for view, velocity in (("right", RIGHT), ("left", LEFT)):
            (tmp_path / view).mkdir(exist_ok=True)
            make.write_exr(tmp_path / view / f"s_{view}.{n:04d}.exr", one_view(n, velocity))
    pattern = tmp_path / "%V" / "s_%V.####.exr"
    assert Clip(pattern).views == ("left", "right")
    out = tmp_path / "o.%V.####.exr"
    assert make.inside(capsys, "blur", pattern, "-o", out, "-q")[0] == 0
    got = Clip(out).source(1, "right")
    assert (got.view, got.path.name) == ("right", "o.right.0001.exr")
    assert (got.rgba != Clip(pattern).source(1, "right").rgba).any()
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "one.####.exr")
    assert (code, err.count("\n")) == (2, 1)
    assert "%V" in err
    png = tmp_path / "one.####.png"
    assert make.inside(capsys, "blur", pattern, "-o", png, "-q")[0] == 0


def test_masks_and_other_files_may_be_of_a_view_each(tmp_path):
    pattern = with_stereo(tmp_path, single_part, (1,))
    shape = make.HEIGHT, make.WIDTH
    for view, value in (("right", 0.25), ("left", 0.75)):
        make.write_exr(tmp_path / f"matte.{view}.exr", {"Y": np.full(shape, value, "f4")})
        make.write_exr(tmp_path / f"more.{view}.exr", {"more.x": np.full(shape, value, "f4")})
    make.write_exr(tmp_path / "mono.exr", {"mono.x": np.ones(shape, "f4")})
    passes = make_passes(tmp_path, "matte.%V.exr", ("more.%V.exr", "mono.exr"))
    clip = Clip(pattern, passes=passes)
    for view, value in (("right", 0.25), ("left", 0.75)):
        source = clip.source(1, view)
        assert clip.frame(source).holdout == pytest.approx(value)
        assert (source.channels["more.x"] == value).all()
        assert ("mono.x" in source.channels) == (view == "right")  # the default view's
    names = {path.name for path in clip.dependencies.of(1)}
    assert names == {"s.0001.exr", "mono.exr", "matte.right.exr", "matte.left.exr",
                     "more.right.exr", "more.left.exr"}  # fmt: skip


def make_passes(folder, mask: str, also: tuple[str, ...]):
    from wgmb import Passes

    return Passes(holdout=str(folder / mask), also=tuple(str(folder / name) for name in also))


def test_each_view_has_its_own_camera(tmp_path):
    for view, velocity in (("right", RIGHT), ("left", LEFT)):
        channels = {k: v for k, v in one_view(1, velocity).items() if "forward" not in k}
        make.write_exr(tmp_path / f"s.{view}.0001.exr", channels)
        make.write_cameras(tmp_path / f"cam.{view}.json", (0, 1, 2), 0.5 if view == "left" else 1)
    make.write_cameras(tmp_path / "cam.json", (0, 1, 2))
    from wgmb import Passes

    pattern, cameras = tmp_path / "s.%V.####.exr", tmp_path / "cam.%V.json"
    clip = Clip(pattern, passes=Passes(camera=cameras))
    slow, fast = (Blur("tap").motion(clip.frame(clip.source(1, v))) for v in ("left", "right"))
    np.testing.assert_allclose(2 * slow, fast, rtol=1e-3, atol=1e-3)
    with pytest.raises(InputError, match=r"cam\.json: is the camera of one view.*left, right.*%V"):
        Clip(pattern, passes=Passes(camera=tmp_path / "cam.json"))
    one = Clip(pattern, passes=Passes(camera=tmp_path / "cam.json"), view="left")
    assert "motion" in one.has


def test_confidence_is_told_of_every_view(tmp_path, capsys):
    for form, names in (
        (single_part, {"confidence.left.residual", "confidence.right.residual"}),
        (many_parts, {"confidence.residual"}),
    ):
        pattern = with_stereo(tmp_path, form, (1, 2))
        out = tmp_path / "c.####.exr"
        code, _, err = make.inside(capsys, "blur", pattern, "-o", out, "--confidence",
                                   "--overwrite", "--frames", 1)  # fmt: skip
        assert code == 0, err
        told = [
            name
            for _, _, channels in plain_parts(tmp_path / "c.0001.exr")
            for name in channels
            if name.endswith("residual")
        ]
        assert set(told) == names
        assert len(told) == 2
        residuals = {v: Clip(out).source(1, v).channels for v in ("left", "right")}
        assert all("confidence.residual" in channels for channels in residuals.values())


def test_the_picture_alone_means_that_of_every_view(tmp_path, capsys):
    pattern, out = with_stereo(tmp_path, many_parts, (1,)), tmp_path / "o.####.exr"
    assert make.inside(capsys, "blur", pattern, "-o", out, "--layers", "picture", "-q")[0] == 0
    parts = plain_parts(tmp_path / "o.0001.exr")
    assert [(name, sorted(channels)) for name, _, channels in parts] == [
        ("rgba_right", ["A", "B", "G", "R"]), ("rgba_left", ["A", "B", "G", "R"])
    ]  # fmt: skip


# ---- what a user is told --------------------------------------------------------------------


def test_info_lists_the_views(tmp_path, capsys):
    pattern = with_stereo(tmp_path, single_part)
    _, out, _ = make.inside(capsys, "info", pattern)
    assert "views     right (default), left; in no view: disparityL\n" in out
    assert "layer     forward: U float32, V float32\n" in out
    _, out, _ = make.inside(capsys, "info", pattern, "--view", "left")
    assert "views     right (default), left; in no view: disparityL; here: left\n" in out


@pytest.mark.parametrize(("view", "says"), [("up", "right, left"), ("lefft", "mean 'left'")])
def test_an_unknown_view_is_one_line(tmp_path, capsys, view, says):
    pattern = with_stereo(tmp_path, single_part, (1,))
    for command in (("info",), ("blur", "-o", tmp_path / "o.####.exr")):
        code, _, err = make.inside(capsys, *command[:1], pattern, *command[1:], "--view", view)
        assert (code, err.count("\n")) == (2, 1)
        assert f"no view {view!r}" in err
        assert says in err


def test_a_view_of_frames_without_views_is_one_line(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    code, _, err = make.inside(capsys, "info", pattern, "--view", "left")
    assert (code, err.count("\n")) == (2, 1)
    assert "do not name any" in err
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.%V.####.exr")
    assert (code, err.count("\n")) == (2, 1)
    assert "%V" in err


def without(parts: list, *names: str) -> list:
    """One part without some channels."""
    channels = {k: c.pixels for k, c in parts[0].channels.items() if k not in names}
    return [make.part(channels, {"multiView": STEREO})]


def test_a_view_without_a_picture_is_left_as_it_is_and_said_once(tmp_path, capsys):
    gone = tuple(f"left.{c}" for c in "RGB")
    pattern = with_stereo(tmp_path, lambda n: without(single_part(n), *gone), (1, 2))
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr")
    assert code == 0
    assert err.count("view left has no picture and is left as it is\n") == 1
    assert "note      view left has no picture" in make.inside(capsys, "info", pattern)[1]
    before, after = (make.plain_read(tmp_path / f"{n}.0001.exr") for n in "so")
    assert (after["R"] != before["R"]).any()
    assert after["left.A"].tobytes() == before["left.A"].tobytes()


def test_a_view_without_vectors_is_named_with_those_that_have_some(tmp_path, capsys):
    gone = "forward.left.u", "forward.left.v"
    pattern = with_stereo(tmp_path, lambda n: without(single_part(n), *gone), (1, 2))
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr")
    assert code == 1
    assert "s.0001.exr: view left: no nuke vectors" in err
    assert "choose a view: right\n" in err
    options = ("--view", "right", "-q")
    assert make.inside(capsys, "blur", pattern, "-o", tmp_path / "r.####.exr", *options)[0] == 0
    gone = "forward.right.u", "forward.right.v"
    with_stereo(tmp_path, lambda n: without(single_part(n), *gone), (1, 2))
    assert "nuke" in Clip(pattern, view="left").finding
    options = ("--view", "left", "-q")
    assert make.inside(capsys, "blur", pattern, "-o", tmp_path / "l.####.exr", *options)[0] == 0


def test_vectors_in_no_view_are_the_default_views(tmp_path, capsys):
    """As OpenEXR has it: `forward.u` beside the picture of the first view."""

    def unnamed(n):
        channels = {k: c.pixels for k, c in single_part(n)[0].channels.items()}
        for name in ("u", "v"):
            del channels[f"forward.left.{name}"]
            channels[f"forward.{name}"] = channels.pop(f"forward.right.{name}")
        return [make.part(channels, {"multiView": STEREO})]

    pattern = with_stereo(tmp_path, unnamed, (1, 2, 3))
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr")
    assert code == 1 and "view left: no nuke vectors" in err
    right = Clip(pattern, view="right")
    assert right.frame(right.source(2)).motion is not None


def test_a_frame_that_lacks_a_view_is_told(tmp_path, capsys):
    def half(n):
        gone = [f"left.{c}" for c in "RGBA"] + [f"forward.left.{c}" for c in "uv"] + ["left.Z"]
        return without(single_part(n), *gone) if n == 2 else single_part(n)

    pattern = with_stereo(tmp_path, half, (1, 2, 3))
    code, _, err = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr")
    assert code == 0 and "frame 2: " in err and "left" in err


def test_resume_redoes_what_another_view_was_chosen_for(tmp_path, capsys):
    pattern, out = with_stereo(tmp_path, single_part, (1, 2)), tmp_path / "o.####.exr"
    assert make.inside(capsys, "blur", pattern, "-o", out)[0] == 0
    assert make.inside(capsys, "blur", pattern, "-o", out, "--resume")[2].startswith("0 frames")
    line = make.inside(capsys, "blur", pattern, "-o", out, "--resume", "--view", "left")[2]
    assert line.startswith("2 frames")
