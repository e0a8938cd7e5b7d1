"""Masks mean what they say: layers, indices, Cryptomattes, and several of them together."""

import json
import struct

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from wgmb import (
    Blur,
    Clip,
    InputError,
    Output,
    Passes,
    blur_sequence,
)
from wgmb.cli import app
from wgmb.io.exr import read
from wgmb.sequence.layers import cryptomatte, masks
from wgmb.viewer.state.state import State


def as_float(ident: int) -> np.float32:
    return np.frombuffer(struct.pack("<I", ident), np.float32)[0]


TREE, HOUSE = 0x3F9D70A4, 0xC2B0A1F3
LEVELS = np.array([[0.0, 0.5, 1.0, 2.5, -1.0]], np.float32)
INDEX = np.array([[0, 1, 2, 3, 2]], np.float32)


def cryptomatte_of_five(manifest=True):
    """Row of five: tree, tree and house half each (two ways), house, nothing."""
    ids = {"tree": TREE, "house": HOUSE}
    t, h = as_float(TREE), as_float(HOUSE)
    channels = {
        "CryptoObject00.r": np.array([[t, t, h, h, 0]], np.float32),
        "CryptoObject00.g": np.array([[1, 0.5, 0.75, 1, 0]], np.float32),
        "CryptoObject00.b": np.array([[0, h, t, 0, 0]], np.float32),
        "CryptoObject00.a": np.array([[0, 0.5, 0.25, 0, 0]], np.float32),
    }
    attributes = {"cryptomatte/abc1234/name": "CryptoObject"}
    if manifest:
        text = json.dumps({k: f"{v:08x}" for k, v in ids.items()})
        attributes["cryptomatte/abc1234/manifest"] = text
    return channels, attributes


def test_a_grey_layer_is_the_mask_held_to_0_and_1():
    got = masks.of_layer({"m.Y": LEVELS}, {}, "m")
    np.testing.assert_array_equal(got, [[0, 0.5, 1, 1, 0]])


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.uint32])
def test_an_index_chooses_the_pixels_that_hold_it(kind):
    got = masks.of_layer({"IndexOB.X": INDEX.astype(kind)}, {}, "IndexOB=2")
    np.testing.assert_array_equal(got, [[0, 0, 1, 0, 1]])


@pytest.mark.parametrize("value", ["tree", f"0x{TREE:08x}", f"0X{TREE:08X}"])
def test_a_cryptomatte_gives_an_objects_coverage_by_name_or_id(value):
    channels, attributes = cryptomatte_of_five()
    got = masks.of_layer(channels, attributes, f"CryptoObject={value}")
    np.testing.assert_array_equal(got, [[1, 0.5, 0.25, 0, 0]])


def test_a_cryptomattes_coverages_of_all_objects_fill_what_is_covered():
    channels, attributes = cryptomatte_of_five()
    tree, house = (
        masks.of_layer(channels, attributes, f"CryptoObject={o}") for o in ("tree", "house")
    )
    np.testing.assert_array_equal(tree + house, [[1, 1, 1, 1, 0]])


def test_a_cryptomatte_without_manifest_takes_the_id_and_asks_for_it():
    channels, attributes = cryptomatte_of_five(manifest=False)
    got = masks.of_layer(channels, attributes, f"CryptoObject=0x{HOUSE:08x}")
    np.testing.assert_array_equal(got, [[0, 0.5, 0.75, 1, 0]])
    with pytest.raises(InputError, match=r"tree.*0x"):
        masks.of_layer(channels, attributes, "CryptoObject=tree")


def test_blenders_cryptomatte_is_found_by_its_last_part():
    channels, _ = cryptomatte_of_five()
    lead = "ViewLayer."
    channels = {lead + k: v for k, v in channels.items()}
    attributes = {"cryptomatte/1a2b/name": "ViewLayer.CryptoObject"}
    got = masks.of_layer(channels, attributes, f"CryptoObject=0x{TREE:08x}")
    np.testing.assert_array_equal(got, [[1, 0.5, 0.25, 0, 0]])


@pytest.mark.parametrize(
    ("wanted", "says"),
    [("CryptoObject=cow", r"cow.*tree.*house"), ("CryptoObject", "choose an object"),
     ("IndexOB=x", "must be a number"), ("nope", r"nope.*IndexOB"), ("nope=3", r"nope.*IndexOB")],
)  # fmt: skip
def test_a_mask_that_cannot_be_made_is_refused_with_the_reason(wanted, says):
    channels, attributes = cryptomatte_of_five()
    with pytest.raises(InputError, match=says):
        masks.of_layer({**channels, "IndexOB.X": INDEX}, attributes, wanted)


@pytest.mark.parametrize(
    "manifest",
    ["not json", "[]", "3", '{"tree": 5}', '{"tree": "xyz"}', 100_000 * "[", 5000 * "9"],
    ids=lambda text: text[:15],
)
def test_a_damaged_cryptomatte_manifest_is_refused(manifest):
    channels, attributes = cryptomatte_of_five()
    attributes["cryptomatte/abc1234/manifest"] = manifest
    with pytest.raises(InputError):
        masks.of_layer(channels, attributes, "CryptoObject=tree")


def test_a_cryptomatte_without_a_name_is_none():
    channels, attributes = cryptomatte_of_five()
    del attributes["cryptomatte/abc1234/name"]
    with pytest.raises(InputError, match="no layer"):
        masks.of_layer(channels, attributes, "=tree")


def test_a_cryptomatte_without_its_channels_is_refused():
    _, attributes = cryptomatte_of_five()
    with pytest.raises(InputError, match="CryptoObject"):
        masks.of_layer({"R": INDEX}, attributes, "CryptoObject=tree")


# ---- names and patterns of names ------------------------------------------------------------


MANIFEST = {
    "hero": 1,
    "hero_arm": 2,
    "hero_leg": 3,
    "Hero_hat": 4,
    "has_*_star": 5,
    "has_a_star": 6,
}


def of(names: dict[str, int]) -> dict[str, str]:
    """The metadata of a Cryptomatte of these objects."""
    text = json.dumps({name: f"{number:08x}" for name, number in names.items()})
    return {"name": "CryptoObject", "manifest": text}


@pytest.mark.parametrize(
    ("value", "meant"),
    [
        ("hero", [1]),
        ("hero_*", [2, 3]),
        ("[hH]ero_?at", [4]),
        ("*", [1, 2, 3, 4, 5, 6]),
        ("has_*_star", [5]),  # in the manifest as it stands
        ("has_*", [5, 6]),
        ("0x00000002", [2]),
        ("0x63", [0x63]),
    ],
)
def test_a_name_may_stand_for_several_objects(value, meant):
    assert cryptomatte.ids(of(MANIFEST), value) == meant


@pytest.mark.parametrize("value", ["hreo_arm", "hero_arn", "hero_army*"])
def test_a_name_that_is_nearly_right_is_recognised(value):
    with pytest.raises(cryptomatte.NoSuchNameError, match=r"; did you mean 'hero_arm'\?$"):
        cryptomatte.ids(of(MANIFEST), value)


def test_of_a_long_manifest_a_few_names_are_shown():
    with pytest.raises(InputError, match=r"n0, .*n7, \.\.\. \(1000 names\)$") as error:
        cryptomatte.ids(of({f"n{i}": i for i in range(1000)}), "xyz")
    assert "n8" not in str(error.value)


@pytest.mark.parametrize("count", [1, 2, 700])
def test_several_objects_cover_what_each_of_them_does(count):
    rng = np.random.default_rng(count)
    numbers = rng.choice(2**32, 1000, replace=False).astype(np.uint32)
    channels, shares = {}, {}
    for rank in range(3):
        for pair in ("rg", "ba"):
            ids = rng.choice(numbers, (20, 30))
            channels[f"C{rank:02d}.{pair[0]}"] = ids.view("f4")
            shares[rank, pair] = share = rng.random((20, 30), np.float32) / 6
            channels[f"C{rank:02d}.{pair[1]}"] = share
    wanted = {int(n) for n in numbers[:count]}
    want = np.zeros((20, 30))
    for (rank, pair), share in shares.items():
        ids = channels[f"C{rank:02d}.{pair[0]}"].view("u4")
        want += share * np.vectorize(lambda n: int(n) in wanted)(ids)
    got = cryptomatte.coverage(channels, {"name": "C"}, wanted)
    np.testing.assert_allclose(got, want, atol=1e-6)


# ---- several masks, and amounts -------------------------------------------------------------


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Two frames with a Cryptomatte, an index and a grey layer; "house" is in frame 2 only."""
    folder = tmp_path_factory.mktemp("shot")
    for n in (1, 2):
        channels = make.frame(n, "plain") | planes()
        names = {"tree": TREE} | ({"house": HOUSE} if n == 2 else {})
        if n == 1:  # nor in its pixels
            for pair in ("rg", "ba"):
                ids, share = (channels[f"CryptoObject00.{c}"] for c in pair)
                share[ids.view("u4") == HOUSE] = 0
                ids[ids.view("u4") == HOUSE] = 0
        text = json.dumps({k: f"{v:08x}" for k, v in names.items()})
        attributes = {"cryptomatte/1/name": "CryptoObject", "cryptomatte/1/manifest": text}
        make.write_exr(folder / f"s.{n:04d}.exr", channels, attributes)
    return folder / "s.####.exr"


def planes() -> dict[str, np.ndarray]:
    """The rows of `cryptomatte_of_five` and of INDEX over and over, and half of a grey layer."""
    small = cryptomatte_of_five()[0] | {"IndexOB.X": INDEX, "matte.Y": INDEX / 4}
    wide = {k: np.tile(v, (make.HEIGHT, 13))[:, : make.WIDTH] for k, v in small.items()}
    return {k: v.astype("f4") for k, v in wide.items()}


def frame(pattern, number=2, **passes):
    clip = Clip(pattern, passes=Passes(**passes))
    return clip.frame(clip.source(number))


TREE_SHARE, HOUSE_SHARE = np.array([1, 0.5, 0.25, 0, 0]), np.array([0, 0.5, 0.75, 1, 0])


@pytest.mark.parametrize(
    ("given", "want"),
    [
        (("CryptoObject=tree",), TREE_SHARE),
        (("CryptoObject=*e",), [1, 1, 1, 1, 0]),
        (("CryptoObject=tree", "IndexOB=3"), [1, 0.5, 0.25, 1, 0]),
        (("CryptoObject=tree", "matte"), 1 - (1 - TREE_SHARE) * (1 - INDEX[0] / 4)),
    ],
)
def test_held_out_is_what_any_mask_has(shot, given, want):
    got = frame(shot, holdout=given).holdout
    np.testing.assert_allclose(got[7, :5], want, atol=1e-6)


@pytest.mark.parametrize(
    ("given", "want"),
    [
        (("matte",), INDEX[0] / 4),
        (("CryptoObject=tree",), TREE_SHARE),
        (("CryptoObject=tree:0.5",), 1 - 0.5 * TREE_SHARE),
        (("CryptoObject=tree:0", "CryptoObject=house:3"), (1 - TREE_SHARE) * (1 + 2 * HOUSE_SHARE)),
        (("IndexOB=2:1.5",), [1, 1, 1.5, 1, 1.5]),
        (("IndexOB=2:.5", "IndexOB=3:2e0", "matte"), INDEX[0] / 4 * [1, 1, 0.5, 2, 0.5]),
    ],
)
def test_scales_multiply(shot, given, want):
    np.testing.assert_allclose(frame(shot, scale=given).scale[7, :5], want, atol=1e-6)


def test_an_image_takes_an_amount_too(shot, tmp_path):
    levels = np.full((make.HEIGHT, make.WIDTH), 255, "u1")
    Image.fromarray(levels).save(tmp_path / "m.png")
    got = frame(shot, scale=f"{tmp_path / 'm.png'}:0.25").scale
    np.testing.assert_allclose(got, 0.25, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "mask", "amount"),
    [
        ("C=tree:0.5", "C=tree", 0.5),
        ("C=/obj/box:polygons:1:2", "C=/obj/box:polygons:1", 2.0),
        ("C=char:hero", "C=char:hero", None),
        ("layer:1", "layer:1", None),  # a layer may be called so
        ("a.####.exr:0", "a.####.exr", 0.0),
        ("C=x:nan", "C=x:nan", None),
    ],
)
def test_the_amount_is_the_number_after_the_last_colon(text, mask, amount):
    assert masks.with_amount(text) == (mask, amount)


def test_the_blur_of_one_object_is_halved(tmp_path):
    """Pixels of the mask move half as far, the rest as before."""
    color = np.zeros((40, 60, 3), "f4")
    color[5:15, 20:30] = color[25:35, 20:30] = 1
    index = np.zeros((40, 60), "f4")
    index[20:] = 7
    moving = {"velocity.x": np.full((40, 60), 12, "f4"), "velocity.y": np.zeros((40, 60), "f4")}
    channels = make.colors(color, kind=np.float32) | moving | {"IndexOB.X": index}
    path = make.write_exr(tmp_path / "a.exr", channels)
    out = tmp_path / "o.exr"
    line = f"blur {path} -o {out} --method tap --shutter 360 --scale IndexOB=7:0.5 -q"
    assert app.main(line.split()) == 0
    row = read(out).channels()["R"].astype(float)
    whole, half = (int((row[y] > 0.01).sum()) for y in (10, 30))
    assert abs(whole - 22) <= 1
    assert abs(half - 16) <= 1


# ---- what is nowhere ------------------------------------------------------------------------


def test_a_name_of_another_frames_manifest_is_not_there_in_this_one(shot):
    assert not frame(shot, 1, holdout="CryptoObject=house").holdout.any()
    assert frame(shot, 2, holdout="CryptoObject=house").holdout.any()


@pytest.mark.parametrize("option", ["--holdout", "--scale"])
def test_a_name_in_no_manifest_is_an_error_before_anything_is_written(
    shot, tmp_path, capsys, option
):
    mask = "CryptoObject=hous" + (":2" if option == "--scale" else "")
    out = tmp_path / "out"
    code, said, err = make.inside(capsys, "blur", shot, "-o", out / "o.####.exr", option, mask)
    assert (code, said) == (2, "")
    assert err.count("\n") == 1
    assert "'hous'" in err
    assert not out.exists()


def test_a_name_in_no_manifest_is_an_error_of_the_library(shot, tmp_path):
    clip = Clip(shot, passes=Passes(holdout="CryptoObject=cow"))
    output = Output(tmp_path / "o.####.exr", numbers=clip.numbers)
    with pytest.raises(InputError, match="cow"):
        blur_sequence(clip, Blur("tap"), output)
    assert make.names_in(tmp_path) == []


@pytest.mark.parametrize(
    ("mask", "there"),
    [
        ("CryptoObject=0xdeadbeef", False),
        (f"CryptoObject=0x{HOUSE:08x}", True),  # in the second frame only
        ("IndexOB=7", False),
        ("IndexOB=3", True),
    ],
)
@pytest.mark.parametrize("option", ["--holdout", "--scale"])
def test_a_number_that_is_nowhere_is_an_error_at_the_end(
    shot, tmp_path, capsys, mask, there, option
):
    text = mask + (":0.5" if option == "--scale" else "")
    line = ("blur", shot, "-o", tmp_path / "o.####.exr", "--method", "tap", option, text)
    code, _, err = make.inside(capsys, *line)
    assert code == (0 if there else 1)
    assert (f"wgmb: {mask} is in no frame" in err) != there
    assert len(make.names_in(tmp_path)) == 2  # they are as asked for all the same
    assert make.inside(capsys, *line, "--resume")[0] == 0  # nothing is read, so nothing is known


def test_the_report_has_what_is_nowhere(shot, tmp_path):
    clip = Clip(shot, passes=Passes(holdout=("IndexOB=7", "IndexOB=2"), scale="IndexOB=8:2"))
    output = Output(tmp_path / "o.####.exr", numbers=clip.numbers)
    assert blur_sequence(clip, Blur("tap"), output).absent == ["IndexOB=7", "IndexOB=8"]


# ---- manifests beside the file --------------------------------------------------------------


def with_sidecar(folder, file="m.json", text=None):
    attributes = {"cryptomatte/1/name": "CryptoObject", "cryptomatte/1/manif_file": file}
    if text is not None:
        (folder / "m.json").write_bytes(text)
    return make.write_exr(folder / "a.exr", make.frame(1, "plain") | planes(), attributes)


def test_a_manifest_beside_the_file_has_at_most_16_mib(tmp_path):
    text = json.dumps({"tree": f"{TREE:08x}"}).encode()
    path = with_sidecar(tmp_path, text=text.ljust(16 << 20))
    assert frame(path, 0, holdout="CryptoObject=t*").holdout is not None
    path = with_sidecar(tmp_path, text=text.ljust((16 << 20) + 1))
    with pytest.raises(InputError, match=r"m\.json: over 16 MiB"):
        frame(path, 0, holdout="CryptoObject=t*")


def test_a_manifest_beside_the_file_is_read(tmp_path):
    text = json.dumps({"tree": f"{TREE:08x}"}).encode()
    path = with_sidecar(tmp_path, text=text)
    got = frame(path, 0, holdout="CryptoObject=t*").holdout
    np.testing.assert_allclose(got[7, :5], TREE_SHARE)


def test_a_manifest_beside_a_file_of_more_layers_is_read(tmp_path):
    (tmp_path / "crypto").mkdir()
    more = with_sidecar(tmp_path / "crypto", text=b'{"tree": "%08x"}' % TREE)
    path = make.write_exr(tmp_path / "a.exr", make.frame(1, "plain"))
    got = frame(path, 0, holdout="CryptoObject=tree", also=(str(more),)).holdout
    np.testing.assert_allclose(got[7, :5], TREE_SHARE)


@pytest.mark.parametrize(
    ("file", "text", "says"),
    [
        ("m.json", None, r"m\.json: no such file"),
        ("m.json", b"[1]", r"m\.json: is no JSON of names"),
        ("m.json", 100_000 * b"[", r"m\.json: is no JSON of names"),
        ("m.json", b"\xff", r"m\.json: not UTF-8"),
        ("../m.json", b"{}", "without a folder"),
        ("/etc/passwd", b"{}", "without a folder"),
        ("sub/m.json", b"{}", "without a folder"),
        ("sub\\m.json", b"{}", "without a folder"),
        ("..", b"{}", "without a folder"),
        ("m.txt", b"{}", "without a folder"),
    ],
)
def test_a_manifest_that_cannot_be_had_is_one_line(tmp_path, file, text, says):
    path = with_sidecar(tmp_path, file, text)
    with pytest.raises(InputError, match=says) as error:
        frame(path, 0, holdout="CryptoObject=tree")
    assert "\n" not in str(error.value)
    by_id = frame(path, 0, holdout=f"CryptoObject=0x{TREE:08x}").holdout  # needs none
    np.testing.assert_allclose(by_id[7, :5], TREE_SHARE)


def test_a_folder_or_a_pipe_is_no_manifest(tmp_path):
    (tmp_path / "m.json").mkdir()
    with pytest.raises(InputError, match="no such file"):
        frame(with_sidecar(tmp_path), 0, holdout="CryptoObject=tree")


def test_a_manifest_that_changed_makes_the_frame_anew(tmp_path, capsys):
    path = with_sidecar(tmp_path, text=b'{"tree": "%08x"}' % TREE)
    line = ("blur", path, "-o", tmp_path / "o.exr", "--method", "tap", "--holdout",
            "CryptoObject=tree", "--resume")  # fmt: skip
    assert "1 frame in" in make.inside(capsys, *line)[2]
    assert "1 already done" in make.inside(capsys, *line)[2]
    (tmp_path / "m.json").write_bytes(b'{"tree": "%08x", "house": "00000001"}' % TREE)
    assert "already done" not in make.inside(capsys, *line)[2]


# ---- the viewer and settings files ----------------------------------------------------------


def test_the_viewer_hands_several_masks_on(shot):
    given = {"holdout": ("CryptoObject=tree", "IndexOB=2"), "scale": ("IndexOB=3:0.5",)}
    state = State().opened(str(shot)).with_options(given)
    words = state.command("o.####.png")
    assert [words[i + 1] for i, w in enumerate(words) if w == "--holdout"] == list(given["holdout"])
    again = State.of_toml(state.toml()).blur
    assert {name: getattr(again, name) for name in given} == given


def test_a_settings_file_has_a_list_of_masks(shot, tmp_path, capsys):
    saved = tmp_path / "s.toml"
    masks = '["IndexOB=2", "CryptoObject=tree"]'
    saved.write_text(f"[blur]\npattern = '{shot}'\nholdout = {masks}\nmethod = 'tap'\n")
    assert State.read(saved).blur.holdout == ("IndexOB=2", "CryptoObject=tree")
    out = tmp_path / "o.####.exr"
    assert make.inside(capsys, "blur", "-o", out, "--config", saved)[0] == 0
    assert masks in make.plain_header(tmp_path / "o.0002.exr")["wgmb"]
