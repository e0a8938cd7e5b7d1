"""Frames as other programs write them: vectors in files, units and under names of their own."""

import struct
import zlib

import numpy as np
import pytest
import tifffile

import make_frames as make
from wgmb import Clip, InputError, Passes, Vectors
from wgmb.io import data_files
from wgmb.sequence.layers import vectors

NUMBERS = (4, 5, 6)
SIZE = np.array([make.WIDTH, make.HEIGHT], "f4")
UP = np.array([1, -1], "f4")


def png(path, samples: np.ndarray):
    """(height, width, 1 or 3 or 4) uint8 or uint16 as a PNG, written without wgmb."""
    height, width, count = samples.shape
    rows = samples.astype(samples.dtype.newbyteorder(">"))
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    kind = {1: 0, 3: 2, 4: 6}[count]
    head = struct.pack(">IIBBBBB", width, height, 8 * samples.itemsize, kind, 0, 0, 0)
    chunks = (b"IHDR", head), (b"IDAT", zlib.compress(raw)), (b"IEND", b"")
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    ))  # fmt: skip
    return path


def in_bits(values: np.ndarray, kind) -> np.ndarray:
    return np.rint(np.clip(values, 0, 1) * np.iinfo(kind).max).astype(kind)


def three(a: np.ndarray, third=0.0) -> np.ndarray:
    return np.dstack([a, np.full(a.shape[:2], third, "f4")])


def to_next(n: int) -> np.ndarray:
    return make.motion(n)[1]


def rgb(image: np.ndarray, layer: str = "", kind="f4") -> dict[str, np.ndarray]:
    lead = f"{layer}." if layer else ""
    return {
        f"{lead}{c}": image[..., i].astype(kind) for i, c in enumerate("RGBA"[: image.shape[2]])
    }


def beauty(folder, numbers=NUMBERS, **more):
    """Frames with nothing but the picture, and `more` channels by name; their pattern."""
    for n in numbers:
        channels = make.colors(make.picture(n)) | {k: f(n) for k, f in more.items()}
        make.write_exr(folder / f"beauty.{n:04d}.exr", channels)
    return folder / "beauty.####.exr"


def in_full(*cases):
    """Cases that are tried with all others only."""
    return [pytest.param(case, marks=pytest.mark.full) for case in cases]


def of_layers(folder, layers, kind="f4"):
    """Frames with the picture and further channels, of which `layers(n)` has (h, w, 2)."""
    for n in NUMBERS:
        channels = make.colors(make.picture(n))
        for names, plane in layers(n).items():
            for name, values in zip(names.split(","), np.moveaxis(plane, 2, 0), strict=True):
                channels[name] = values.astype(kind)
        make.write_exr(folder / f"s.{n:04d}.exr", channels)
    return folder / "s.####.exr"


def motion_of(clip: Clip, n: int = 5) -> np.ndarray:
    return clip.frame(clip.source(n)).motion


def is_right(clip: Clip, most: float, n: int = 5) -> None:
    """The motion is that of `make`, to `most` px."""
    np.testing.assert_allclose(motion_of(clip, n)[..., 2:], to_next(n), atol=most)


# ---- one layer a file -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vectors_in", "depth_in", "mask_in"),
    [
        ("mv/beauty.####.exr", "Z/beauty.####.exr", "matte/beauty.####.exr"),
        ("s010.Motion Vector_v2.####.exr", "s010.VRayZDepth.####.exr", "s010.matte.####.exr"),
        pytest.param(
            "shot_motionvector.####.exr",
            "shot_Z.####.exr",
            "shot_matte.####.exr",
            marks=pytest.mark.full,
        ),
    ],
)
def test_a_layer_a_file_is_called_as_its_file(tmp_path, vectors_in, depth_in, mask_in, capsys):
    mask = np.random.default_rng(0).random((make.HEIGHT, make.WIDTH)).astype("f4")
    for n in NUMBERS:
        depth = np.full((make.HEIGHT, make.WIDTH, 3), 7, "f4")
        made = three(to_next(n) * UP), depth, np.dstack([mask] * 3)
        for name, image in zip((vectors_in, depth_in, mask_in), made, strict=True):
            path = tmp_path / name.replace("####", f"{n:04d}")
            path.parent.mkdir(exist_ok=True)
            make.write_exr(path, rgb(np.dstack([image, mask])))
    also = tuple(str(tmp_path / name) for name in (vectors_in, depth_in, mask_in))
    clip = Clip(beauty(tmp_path), passes=Passes(also=also, holdout="matte"))
    (frame,) = Clip(tmp_path / "beauty.####.exr", frames="5", passes=clip.passes)
    np.testing.assert_array_equal(frame.color, make.picture(5).astype("f2"))
    np.testing.assert_array_equal(frame.motion[..., 2:], to_next(5))
    assert np.all(frame.depth == 7).all()
    np.testing.assert_array_equal(frame.holdout, mask)
    line = [word for name in also for word in ("--also", name)]
    code, out, _ = make.inside(capsys, "info", clip.pattern, *line)
    assert code == 0
    assert out.count("layer ") == 4
    assert "vectors   none" not in out
    assert "depth     none" not in out


def test_passes_of_light_in_files_of_their_own_are_found(tmp_path):
    light = {"diffuse_direct": 0.5, "diffuse_albedo": 0.25}
    for name, value in light.items():
        for n in NUMBERS:
            make.write_exr(tmp_path / f"shot_{name}.{n:04d}.exr", rgb(0 * make.picture(n) + value))
    also = tuple(str(tmp_path / f"shot_{name}.####.exr") for name in light)
    clip = Clip(beauty(tmp_path), passes=Passes(also=also))
    frame = clip.frame(clip.source(5))
    np.testing.assert_allclose(frame.diffuse_light, 2)
    np.testing.assert_allclose(frame.diffuse_color, 0.25)


def test_a_layer_that_is_in_both_files_keeps_its_name_in_the_pictures(tmp_path):
    zero, own = np.zeros((make.HEIGHT, make.WIDTH), "f4"), {"mask.R": lambda n: zero + n}
    for n in NUMBERS:
        make.write_exr(tmp_path / f"more.{n:04d}.exr", {"mask.R": zero + 0.5, "other.R": zero})
    clip = Clip(beauty(tmp_path, **own), passes=Passes(also=(str(tmp_path / "more.####.exr"),)))
    channels = clip.source(5).channels
    assert channels["mask.R"][0, 0] == 5
    assert channels["more.mask.R"][0, 0] == 0.5
    assert "other.R" in channels


def test_the_picture_is_not_read_as_vectors(tmp_path, capsys):
    pattern = beauty(tmp_path)
    line = "blur", pattern, "-o", tmp_path / "o.####.exr", "--vector-layer", ""
    code, out, err = make.inside(capsys, *line)
    assert code != 0
    assert "G, R of the picture itself" in out + err
    assert "--vector-layer" in err
    assert not list(tmp_path.glob("o*"))


# ---- stills that hold numbers ---------------------------------------------------------------


OTHER_STILLS = ("png", "u1"), ("tif", "u2")


@pytest.mark.parametrize("most", [16.0, pytest.param(64.0, marks=pytest.mark.full)])
@pytest.mark.parametrize(
    ("form", "kind"),
    [("png", "u2"), *(pytest.param(*one, marks=pytest.mark.full) for one in OTHER_STILLS)],
)
def test_motion_around_half_is_found_with_its_unit(tmp_path, form, kind, most):
    """As After Effects and ReelSmart Motion Blur take it: y up, 1 is a motion of `most` px."""
    for n in NUMBERS:
        samples = in_bits(three(0.5 + to_next(n) * UP / (2 * most)), np.dtype(kind).type)
        path = tmp_path / f"shot_mv.{n:04d}.{form}"
        png(path, samples) if form == "png" else tifffile.imwrite(path, samples, photometric="rgb")
    also = (str(tmp_path / f"shot_mv.####.{form}"),)
    clip = Clip(beauty(tmp_path), passes=Passes(also=also))
    is_right(clip, most / 100 if kind == "u1" else 0.05)
    told = Clip(tmp_path / "beauty.####.exr",
                passes=Passes(also=also, vectors=Vectors("rsmb", scale=2 * most)))  # fmt: skip
    is_right(told, 2 * most / np.iinfo(kind).max)
    assert (motion_of(told)[0, -1] == 0).all()  # the middle of whole numbers does not move


@pytest.mark.full
def test_where_nothing_was_drawn_vectors_around_half_do_not_move(tmp_path):
    for n in NUMBERS:
        samples = in_bits(three(0.5 + to_next(n) * UP / 64), np.uint16)
        png(tmp_path / f"mv.{n:04d}.png", samples * to_next(n).any(axis=2, keepdims=True))
    is_right(Clip(beauty(tmp_path), passes=Passes(also=(str(tmp_path / "mv.####.png"),))), 0.05)


@pytest.mark.parametrize("form", ["png", "flo", *in_full("tif", "exr")])
def test_what_wgmb_writes_for_other_programs_comes_back(tmp_path, capsys, form):
    pattern = make.write_sequence(tmp_path, NUMBERS, "nuke")
    out = tmp_path / f"mv.####.{form}"
    line = () if form == "flo" else ("--as", "rsmb", "--max-displace", "100")
    assert make.inside(capsys, "vectors", pattern, "-o", out, *line, "-q") == (0, "", "")
    step = {"exr": 1e-4, "flo": 0}.get(form, 200 / 65535)
    clip = Clip(beauty(tmp_path), passes=Passes(also=(str(out),)))
    for n in NUMBERS:
        is_right(clip, step, n)
    assert not clip.is_finding_notable
    code, said, _ = make.inside(capsys, "info", clip.pattern, "--also", out)
    assert code == 0
    assert "tested" in said


def test_a_flow_file_of_the_other_direction_says_so_by_its_name(tmp_path):
    for n in NUMBERS:
        for name, flow in (("flow_fwd", to_next(n)), ("flow_bwd", make.motion(n)[0])):
            (tmp_path / f"{name}.{n:04d}.flo").write_bytes(data_files.encode_flo(flow))
    also = tuple(str(tmp_path / f"flow_{way}.####.flo") for way in ("bwd", "fwd"))
    clip = Clip(beauty(tmp_path), passes=Passes(also=also))
    np.testing.assert_array_equal(motion_of(clip), np.dstack(make.motion(5)))
    sides = vectors.channels_of(clip.source(5).channels, Vectors("plain"))
    assert {side: x.split(".")[0] for side, (x, _) in sides.items()} == {
        "prev": "flow_bwd", "next": "flow_fwd"}  # fmt: skip


def test_unknown_flow_is_no_motion(tmp_path):
    for n in NUMBERS:
        flow = to_next(n)
        flow[:5] = 1e10
        (tmp_path / f"flow.{n:04d}.flo").write_bytes(data_files.encode_flo(flow))
    got = motion_of(Clip(beauty(tmp_path), passes=Passes(also=(str(tmp_path / "flow.####.flo"),))))
    assert (got[:5] == 0).all()
    np.testing.assert_array_equal(got[5:, :, 2:], to_next(5)[5:])


HEAD = struct.pack("<fii", 202021.25, 4, 3)


@pytest.mark.parametrize(
    ("data", "text"),
    [(b"", "begin"), (b"PIEH" + 8 * b"\0", "0 x 0"), (HEAD + 95 * b"\0", "108 bytes, got 107"),
     (HEAD + 97 * b"\0", "108 bytes, got 109"), (b"PIEX" + HEAD[4:] + 96 * b"\0", "begin"),
     (HEAD[:4] + struct.pack("<ii", -1, 4), "-1 x 4"),
     (HEAD[:4] + struct.pack("<ii", 30000, 30000), "7200000012 bytes, got 12")],
)  # fmt: skip
def test_a_damaged_flow_file_is_one_line_with_its_name(tmp_path, data, text):
    (tmp_path / "a.flo").write_bytes(data)
    with pytest.raises(InputError, match=rf"a\.flo.*{text}"):
        data_files.read_flo(tmp_path / "a.flo")
    with pytest.raises(InputError, match="no such file"):
        data_files.read_flo(tmp_path / "b.flo")


def test_a_flow_file_is_not_resumed_as_it_holds_no_record(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1, 2), "nuke")
    line = "vectors", pattern, "-o", tmp_path / "f.####.flo"
    assert make.inside(capsys, *line)[0] == 0
    assert (tmp_path / "f.0001.flo").stat().st_size == 12 + 8 * make.WIDTH * make.HEIGHT
    code, _, err = make.inside(capsys, *line, "--resume")
    assert code == 2
    assert "--resume needs the record" in err
    code, _, err = make.inside(capsys, "vectors", pattern, "-o", tmp_path / "f.####.png")
    assert code == 2
    assert "--as is missing" in err


def test_kittis_flow_is_read_with_its_mask(tmp_path):
    for n in NUMBERS:
        samples = np.rint(three(to_next(n) * 64 + 32768, 1)).astype("u2")
        samples[:3] = 0
        png(tmp_path / f"flow.{n:04d}.png", samples)
    clip = Clip(beauty(tmp_path), passes=Passes(also=(str(tmp_path / "flow.####.png"),)))
    is_right(clip, 1 / 128)
    assert clip.vector_mask(clip.source(5)) == "flow.MV_Alpha"
    assert not clip.is_finding_notable


@pytest.mark.parametrize("count", [2, 3])
def test_floats_of_a_tiff_are_pixels(tmp_path, count):
    for n in NUMBERS:
        image = three(to_next(n))[..., :count]
        more = {"photometric": "rgb"} if count == 3 else {"planarconfig": "contig"}
        tifffile.imwrite(tmp_path / f"mv.{n:04d}.tif", image, **more)
    is_right(Clip(beauty(tmp_path), passes=Passes(also=(str(tmp_path / "mv.####.tif"),))), 0)


def test_colour_in_a_still_is_light_and_a_mask_is_not(tmp_path):
    level = np.full((make.HEIGHT, make.WIDTH, 3), 128, "u1")
    for n in NUMBERS:
        png(tmp_path / f"matte.{n:04d}.png", level[..., :1])
        png(tmp_path / f"DiffCol.{n:04d}.png", level)
    also = tuple(str(tmp_path / f"{name}.####.png") for name in ("matte", "DiffCol"))
    clip = Clip(beauty(tmp_path), passes=Passes(also=also, holdout="matte"))
    source = clip.source(5)
    np.testing.assert_allclose(clip.frame(source).holdout, 0.5)
    np.testing.assert_allclose(source.channels["DiffCol.R"], 0.2159, atol=1e-3)


# ---- units ----------------------------------------------------------------------------------

UNITS = {  # numbers of a motion to the next frame [px, y down]: as programs write them
    "fractions": (lambda v: v / SIZE, "motion.x,motion.y", "(fractions of the picture)"),
    "fractions, y up": (lambda v: UP * v / SIZE, "_MotionVectors.R,_MotionVectors.G", "flip y"),
    "-1 to 1, y up": (lambda v: 2 * UP * v / SIZE, "velocity.x,velocity.y", "(-1 to 1 over"),
    "-1 to 1, backwards": (lambda v: -2 * v / SIZE, "mv.R,mv.G", "flip xy"),
    "Unreal": (lambda v: UP * v / SIZE + 0.5,
               "FinalImageMovieRenderQueue_MotionVectors.R,"
               "FinalImageMovieRenderQueue_MotionVectors.G", "unreal scale 64,48"),
    "0 to 1 of the picture": (lambda v: UP * v / SIZE + 0.5, "MotionVectors.R,MotionVectors.G",
                              "rsmb scale 64,48 (fractions"),
    "of the longest motion": (lambda v: UP * v / 32 + 0.5, "Motion vector.R,Motion vector.G",
                              "(1 is 32 px)"),
    "clamped velocity": (lambda v: UP * v / 40 + 0.5, "velocity.R,velocity.G", "vray scale "),
    "fractions, all negative": (lambda v: -v / SIZE, "velocity.R,velocity.G", "flip x (fractions"),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["f2", pytest.param("f4", marks=pytest.mark.full)])
@pytest.mark.parametrize(
    "unit",
    [
        *list(UNITS)[3:4],
        *in_full(*list(UNITS)[:3], *list(UNITS)[4:]),
    ],
)
def test_the_unit_of_vectors_is_found(tmp_path, unit, kind):
    numbers, names, text = UNITS[unit]
    clip = Clip(of_layers(tmp_path, lambda n: {names: numbers(to_next(n))}, kind))
    assert text in clip.finding
    is_right(clip, 0.05)


@pytest.mark.parametrize("unit", in_full("-1 to 1, backwards", "of the longest motion"))
def test_what_crosses_half_of_the_picture_does_not_hide_the_unit(tmp_path, unit):
    """Numbers of a few pixels lie beyond -1 and 1, or 0 and 1."""
    numbers, names, _ = UNITS[unit]

    def fast(n):
        motion = to_next(n)
        motion[-1, -24:] = (70, 0)
        return {names: numbers(motion)}

    got = motion_of(Clip(of_layers(tmp_path, fast, "f2")))[..., 2:]
    np.testing.assert_allclose(got[:-1], to_next(5)[:-1], atol=0.05)


def test_unreals_unit_is_known_by_its_name(tmp_path):
    numbers, names, _ = UNITS["Unreal"]
    path = of_layers(tmp_path, lambda n: {names: numbers(to_next(n))})
    for n in (4, 6):
        (tmp_path / f"s.{n:04d}.exr").unlink()
    is_right(Clip(path), 1e-5)


def test_two_scales_are_given(tmp_path, capsys):
    names = "strange.x,strange.y"
    pattern = of_layers(tmp_path, lambda n: {names: to_next(n) / (16, 8)})
    told = Vectors("plain", layer="strange", scale=(16.0, 8.0))
    is_right(Clip(pattern, passes=Passes(vectors=told)), 0)
    line = "info", pattern, "--vectors", "plain", "--vector-layer", "strange", "--vector-scale"
    code, out, _ = make.inside(capsys, *line, "16,8")
    assert code == 0
    assert "plain scale 16,8" in out
    for wrong in ("16,8,4", "16,", "a"):
        code, _, err = make.inside(capsys, *line, wrong)
        assert code == 2
        assert "--vector-scale" in err


def test_vectors_below_a_pixel_of_no_unit_are_told(tmp_path):
    rng = np.random.default_rng(0)
    noise = {n: rng.uniform(-0.2, 0.2, (make.HEIGHT, make.WIDTH, 2)) for n in NUMBERS}
    clip = Clip(of_layers(tmp_path, lambda n: {"motion.x,motion.y": noise[n]}))
    assert clip.is_finding_notable
    assert "below a pixel" in clip.finding


@pytest.mark.full
def test_objects_alone_that_all_move_one_way_are_around_half_too(tmp_path):
    """Nothing is drawn around them, and no number is near 0.5."""
    for n in NUMBERS:
        moves = to_next(n).any(axis=2)[..., None]
        motion = (0.5 - to_next(n) / 10) * moves
        make.write_exr(tmp_path / f"mv.{n:04d}.exr", rgb(np.dstack([motion, 0 * moves, moves])))
    clip = Clip(beauty(tmp_path), passes=Passes(also=(str(tmp_path / "mv.####.exr"),)))
    is_right(clip, 0.05)


@pytest.mark.parametrize(("convention", "velocity"), [("nuke", (0.6, 0.3)), ("plain", (0.4, 0.4))])
def test_slow_vectors_stay_pixels(tmp_path, convention, velocity):
    for n in NUMBERS:
        channels = make.colors(make.picture(n, velocity)) | make.written(
            convention, *make.motion(n, velocity)
        )
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    got = motion_of(Clip(tmp_path / "s.####.exr"))[..., 2:]
    np.testing.assert_array_equal(got, make.motion(5, velocity)[1])


# ---- names ----------------------------------------------------------------------------------

ONE_WAY = (
    "Motion Vector.R,Motion Vector.G", "MV.R,MV.G", "VectX,VectY", "Vectors.X,Vectors.Y",
    "motionvec.r,motionvec.g", "motion_vectors.r,motion_vectors.g", "motionFore.x,motionFore.y",
    "VectorX,VectorY", "RS_MotionVectors.R,RS_MotionVectors.G", "motionVectorX,motionVectorY",
    "rgba_motionvector.red,rgba_motionvector.green", "flow.u,flow.v",
    "ViewLayer.Motion Vectors.R,ViewLayer.Motion Vectors.G",
    "_CameraMotionVectorsTexture.R,_CameraMotionVectorsTexture.G",
    "XVector,YVector", "X Motion,Y Motion", "vector.X,vector.Y",
    "MotionVectors2D.R,MotionVectors2D.G", "motion2d.x,motion2d.y", "RE_Velocity.R,RE_Velocity.G",
)  # fmt: skip


@pytest.mark.parametrize("up", [-1, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize("names", [ONE_WAY[0], *in_full(*ONE_WAY[1:])])
def test_names_that_programs_give_to_vectors_are_known(tmp_path, names, up):
    turned = np.array([1, up], "f4")
    is_right(Clip(of_layers(tmp_path, lambda n: {names: to_next(n) * turned})), 0)


@pytest.mark.parametrize("sign", [-1, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize(
    "names",
    [("motionFore.x,motionFore.y", "motionBack.x,motionBack.y"),
     *in_full(("mv_fwd.x,mv_fwd.y", "mv_bwd.x,mv_bwd.y"),
              ("VectorX,VectorY", "BackVectorX,BackVectorY"),
              ("forward.u,forward.v", "backward.u,backward.v"))],
)  # fmt: skip
def test_vectors_to_the_previous_frame_may_lead_from_it(tmp_path, names, sign):
    ahead, back = names
    clip = Clip(of_layers(tmp_path, lambda n: {
        ahead: to_next(n) * UP, back: sign * make.motion(n)[0] * UP}))  # fmt: skip
    np.testing.assert_array_equal(motion_of(clip), np.dstack(make.motion(5)))


@pytest.mark.parametrize("name", ["Normal Vector", "P", *in_full("position", "world_velocity")])
def test_other_vectors_are_not_motion(tmp_path, name):
    names = f"{name}.x,{name}.y"
    clip = Clip(of_layers(tmp_path, lambda n: {names: to_next(n)}))
    assert clip.frame(clip.source(5)).motion is None
    assert "vector_layer" not in clip.finding


def test_a_layer_around_a_half_is_named_with_its_option(tmp_path, capsys):
    """A name in another language."""
    names = "Bewegung.R,Bewegung.G"
    pattern = of_layers(tmp_path, lambda n: {names: to_next(n) * UP / 64 + 0.5})
    _, out, _ = make.inside(capsys, "info", pattern)
    assert "Bewegung is 0.5 in most places; --vector-layer Bewegung takes Bewegung" in out
    clip = Clip(pattern, passes=Passes(vectors=Vectors(layer="Bewegung", scale=64)))
    np.testing.assert_allclose(motion_of(clip)[..., 2:], to_next(5), atol=0.1)


@pytest.mark.fast
def test_directions_and_constants_are_no_candidates():
    rng = np.random.default_rng(0)
    still = np.full((64, 64), 0.5, np.float32)
    some = still.copy()
    some[20:40, 20:40] = rng.random((20, 20))
    assert list(vectors.candidates({"a.R": some, "a.G": still, "a.B": 0 * still})) == ["a"]
    assert list(vectors.candidates({"a.R": some, "a.G": still, "a.B": 2 * still})) == []
    assert list(vectors.candidates({"P_warp.R": some, "P_warp.G": still})) == ["P_warp"]
    assert list(vectors.candidates({"P_w.R": some, "P_w.G": still, "P_w.B": 0 * still})) == []
    assert list(vectors.candidates({"a.R": still, "a.G": still})) == []
    small = np.zeros((64, 64), np.float32)
    small[5:11, 5:11] = -3
    assert list(vectors.candidates({"a.R": small, "a.G": small})) == ["a"]
    four = {"a.R": small, "a.G": small, "a.B": 0 * small}
    assert list(vectors.candidates(four | {"a.A": 0 * small + 1})) == ["a"]
    assert list(vectors.candidates(four | {"a.A": small})) == []


def test_a_layer_that_may_hold_vectors_is_named_with_its_option(tmp_path, capsys):
    pattern = of_layers(tmp_path, lambda n: {"warp.x,warp.y": to_next(n) * -UP})
    code, out, _ = make.inside(capsys, "info", pattern)
    assert code == 0
    assert "warp has negative numbers; --vector-layer warp takes warp" in out
    is_right(Clip(pattern, passes=Passes(vectors=Vectors(layer="warp"))), 0)


BARE = {  # numbers of vectors, and the reason to take them
    "y down": (lambda v: v, "has numbers over 1"),
    "y up": (lambda v: v * -UP, "has negative numbers"),
    "around a half": (lambda v: v * UP / 64 + 0.5, "is 0.5 in most places"),
}


@pytest.mark.parametrize("kind", [next(iter(BARE)), *in_full(*list(BARE)[1:])])
@pytest.mark.parametrize(
    "names",
    ["u,v", *in_full("dx,dy", "VX,VY", "mx,my", "Xvel,Yvel", "shift_x,shift_y", "e.dx,e.dy")],
)
def test_channels_without_a_layer_are_named_with_their_option(tmp_path, capsys, names, kind):
    numbers, reason = BARE[kind]
    small = names.startswith("e.") and {"e.k,e.l": three(to_next(5) * 0)[..., :2]}

    def planes(n):
        depth_and_id = np.dstack([to_next(n)[..., 0] * 0 - 5, to_next(n)[..., 0] * 0 - 1])
        return {names: numbers(to_next(n)), "depth,objectId": depth_and_id} | (small or {})

    pattern = of_layers(tmp_path, planes)
    code, out, _ = make.inside(capsys, "info", pattern)
    assert code == 0
    assert f"{names} {reason}; --vector-layer {names} takes {names}" in out
    clip = Clip(pattern, passes=Passes(vectors=Vectors(layer=names)))
    is_right(clip, 0.05)
    line = "blur", pattern, "-o", tmp_path / "o.####.exr", "--frames", "5", "--shutter", "180"
    code, out, err = make.inside(capsys, *line)
    assert code == 0
    assert f"--vector-layer {names} takes {names}" in out + err
    assert "vector-layer" not in "".join(
        make.inside(capsys, *line, "--vector-layer", names, "--overwrite")[1:]
    )
    told, right = make.plain_read(tmp_path / "o.0005.exr"), tmp_path / "right"
    right.mkdir()
    of_layers(right, lambda n: {"to_next.x,to_next.y": to_next(n)} | planes(n))
    line = "blur", right / "s.####.exr", "-o", right / "o.####.exr", "--frames", "5", *line[6:]
    assert make.inside(capsys, *line)[0] == 0
    wanted = make.plain_read(right / "o.0005.exr")
    for c in "RGB":
        np.testing.assert_allclose(told[c], wanted[c], atol=0.02)


@pytest.mark.fast
def test_parts_of_larger_layers_are_candidates():
    speed = np.zeros((64, 64), np.float32)
    speed[5:11, 5:11] = -3

    def found(*names: str) -> list[str]:
        return list(vectors.candidates(dict.fromkeys(names, speed)))

    assert found("u", "v", "depth", "id", "A", "crypto00") == ["u,v"]
    assert found("m.r", "m.g", "m.b", "m.dx", "m.dy") == ["m.dx,m.dy"]
    assert found("fwd_u", "fwd_v", "other", "back_u", "back_v") == ["back_u,back_v", "fwd_u,fwd_v"]
    assert found("down", "right") == ["down,right"]
    assert found("one") == []
    assert found("Px", "Py", "Pz") == []
    assert found("N_x", "N_y", "N_z") == []
    assert found("tx", "ty", "tz") == ["tx,ty"]
    assert found("Z", "depth", "id") == []
    with_depth = {"X": speed, "Y": speed, "Z": 0 * speed + 9}
    assert list(vectors.candidates(with_depth)) == ["X,Y"]
    places = {"u": np.abs(speed) / 4, "v": np.abs(speed) / 4}  # of a texture
    assert list(vectors.candidates(places)) == []


def test_the_alpha_of_a_picture_is_no_mask_of_vectors_beside_it():
    half = np.full((8, 8), 0.5, "f4")
    channels = {**dict.fromkeys("RGBA", half), "u": half, "v": half}
    told = Vectors("rsmb", layer="u,v")
    assert vectors.mask_of(channels, told) is None
    assert vectors.mask_of({"u": half, "v": half, "A": half}, told) == "A"
    assert vectors.mask_of(dict.fromkeys("RGBA", half), Vectors("rsmb", layer="")) == "A"


def test_two_channels_that_are_not_there_are_told(tmp_path):
    clip = Clip(beauty(tmp_path), passes=Passes(vectors=Vectors(layer="dx,dy")))
    with pytest.raises(InputError, match="no vector layer 'dx,dy'"):
        clip.frame(clip.source(5))


@pytest.mark.parametrize("numbers", [(5,), *in_full(NUMBERS)])
def test_a_vector_pass_in_a_file_of_its_own_is_blenders(tmp_path, numbers):
    """The compositor's File Output writes it as R, G, B and A."""
    for n in numbers:
        back, ahead = make.motion(n)
        make.write_exr(tmp_path / f"Vector{n:04d}.exr", rgb(np.dstack([back * UP, -ahead * UP])))
    also = (str(tmp_path / "Vector####.exr"),)
    clip = Clip(beauty(tmp_path, numbers), passes=Passes(also=also))
    np.testing.assert_array_equal(motion_of(clip), np.dstack(make.motion(5)))
    assert not clip.is_finding_notable


# ---- no vectors -----------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["blender", "nuke", "arnold", "plain"])
@pytest.mark.parametrize("number", [1e4, -1e4, -9999.0, 1e10, 65504.0])
def test_where_there_is_no_vector_nothing_moves(convention, number):
    channels = make.written(convention, *make.motion(5))
    for plane in channels.values():
        plane[:6] = number
    got = vectors.read(channels, Vectors(convention))
    assert (got[:6] == 0).all()
    np.testing.assert_array_equal(got[6:, :, 2:], to_next(5)[6:])


# ---- depth ----------------------------------------------------------------------------------

KINDS = {  # numbers of a distance
    "planar": lambda z: z,
    "white-near": lambda z: (10 - z) / 8,
    "1 / z": lambda z: 1 / z,
    "along the axis towards the camera": lambda z: -z,
}


def of_depth(folder, numbers, empty=None):
    """Frames whose square is nearer than the background, and the pattern."""
    for n in NUMBERS:
        inside = to_next(n).any(axis=2)
        depth = numbers(np.where(inside, 3.0, 9.0)).astype("f4")
        if empty is not None:
            depth[:5] = empty
        make.write_exr(folder / f"s.{n:04d}.exr", make.frame(n, "nuke") | {"Z": depth})
    return folder / "s.####.exr"


def order_of(clip: Clip) -> np.ndarray:
    """Depth of the square and of the background of frame 5."""
    depth, inside = clip.frame(clip.source(5)).depth, to_next(5).any(axis=2)
    return np.array([np.nanmedian(depth[inside]), np.nanmedian(depth[~inside])])


@pytest.mark.parametrize("kind", [*list(KINDS)[:2], *in_full(*list(KINDS)[2:])])
def test_the_order_of_depth_is_found_by_what_covers_what(tmp_path, capsys, kind):
    pattern = of_depth(tmp_path, KINDS[kind])
    clip = Clip(pattern)
    near, far = order_of(clip)
    assert 0 < near < far
    told = [text for text in clip.notes if "larger depth is taken as nearer" in text]
    assert len(told) == (kind != "planar")
    if kind != "1 / z":
        assert (near, far) == pytest.approx({"white-near": (1 / 0.875, 8)}.get(kind, (3, 9)))
    settled = Clip(pattern, settled=clip.settle())
    assert tuple(order_of(settled)) == (near, far)
    code, out, _ = make.inside(capsys, "info", pattern)
    assert code == 0
    assert ("larger depth is taken as nearer" in out) == (kind != "planar")


@pytest.mark.parametrize("empty", [np.inf, *in_full(0.0, 1e10, np.nan)])
def test_empty_depth_does_not_turn_its_order(tmp_path, empty):
    clip = Clip(of_depth(tmp_path, KINDS["planar"], empty))
    assert tuple(order_of(clip)) == (3, 9)
    assert not clip.notes


def test_the_kind_of_depth_is_told_instead(tmp_path):
    clip = Clip(of_depth(tmp_path, KINDS["white-near"]), passes=Passes(depth_kind="planar"))
    assert tuple(order_of(clip)) == pytest.approx((0.875, 0.125))
    assert not clip.notes
    clip = Clip(of_depth(tmp_path, KINDS["planar"]), passes=Passes(depth_kind="white-near"))
    assert tuple(order_of(clip)) == pytest.approx((1 / 3, 1 / 9))
    with pytest.raises(InputError, match="needs distances"):
        Passes(depth_kind="white-near", camera=tmp_path / "c.json")


def test_a_body_that_leaves_a_render_region_is_not_covered_by_nothing(tmp_path):
    """Blender writes no picture, 1e11 as depth and 10000 as vectors outside of the region."""
    for n in NUMBERS:
        inside = to_next(n).any(axis=2)
        planes = make.frame(n, "blender")
        planes["ViewLayer.Depth.Z"] = np.where(inside, 3, 9).astype("f4")
        for name, plane in planes.items():
            nothing = {"Depth": 1e11, "Vector": 1e4}.get(name.split(".")[1], 0)
            plane[:, 44:] = nothing
        make.write_exr(tmp_path / f"s.{n:04d}.exr", planes)
    clip = Clip(tmp_path / "s.####.exr")
    depth = clip.frame(clip.source(5)).depth
    assert (depth[:, :44].min(), depth[:, :44].max()) == (3, 9)
    assert not clip.notes
