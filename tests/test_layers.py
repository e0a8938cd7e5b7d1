"""Layers are found by the names that renderers give them; masks mean what they say."""

import json
import struct

import numpy as np
import pytest

from wgmb import InputError
from wgmb.io import layers, vectors

pytestmark = pytest.mark.fast

RGBA = "RGBA"
RENDERERS = {
    # names of one frame: picture, depth channel, convention found
    "blender": (
        ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
         "ViewLayer.Combined.A", "ViewLayer.Depth.Z", "ViewLayer.Vector.X", "ViewLayer.Vector.Y",
         "ViewLayer.Vector.Z", "ViewLayer.Vector.W", "ViewLayer.Normal.X", "ViewLayer.Normal.Y",
         "ViewLayer.Normal.Z", "ViewLayer.IndexOB.X"],
        [f"ViewLayer.Combined.{c}" for c in RGBA], "ViewLayer.Depth.Z", "blender"),
    "nuke": (
        [*RGBA, "depth.Z", "forward.u", "forward.v", "backward.u", "backward.v"],
        list(RGBA), "depth.Z", "nuke"),
    "arnold": (
        [*RGBA, "Z", "N.X", "N.Y", "N.Z", "motionvector.R", "motionvector.G", "motionvector.B"],
        list(RGBA), "Z", "arnold"),
    "vray": (
        [*RGBA, "VRayZDepth.R", "velocity.R", "velocity.G", "velocity.B"],
        list(RGBA), "VRayZDepth.R", "vray"),
    "plain": (
        ["R", "G", "B", "Z", "velocity.x", "velocity.y"], ["R", "G", "B"], "Z", "plain"),
    "nothing": (["R", "G", "B"], ["R", "G", "B"], None, None),
}  # fmt: skip


@pytest.mark.parametrize("renderer", RENDERERS)
def test_every_renderers_layers_are_found_in_any_order(renderer):
    names, color, depth, convention = RENDERERS[renderer]
    for order in (names, names[::-1], sorted(names)):
        assert layers.find_color(order) == color
        assert layers.find_depth(order) == depth
        found = vectors.named(order, vectors.Vectors())
        assert (found and found.convention) == convention


def test_the_components_of_a_layer_come_in_their_natural_order():
    found = layers.layers(["v.W", "v.Y", "v.X", "v.Z", "A", "B", "G", "R", "f.v", "f.u"])
    assert found == {"": list(RGBA), "v": ["v.X", "v.Y", "v.Z", "v.W"], "f": ["f.u", "f.v"]}


def test_a_layer_is_chosen_by_its_full_name_or_its_last_part():
    names = [f"{layer}.{c}" for layer in ("a.Combined", "a.Diffuse") for c in "RGB"]
    assert layers.find_color(names, "a.Diffuse") == [f"a.Diffuse.{c}" for c in "RGB"]
    assert layers.find_color(names, "diffuse") == [f"a.Diffuse.{c}" for c in "RGB"]
    assert layers.find_color(names) == [f"a.Combined.{c}" for c in "RGB"]


@pytest.mark.parametrize(
    "find", [lambda n: layers.find_color(n, "nope"), lambda n: layers.find_depth(n, "nope")]
)
def test_a_missing_layer_is_refused_with_a_list_of_what_there_is(find):
    with pytest.raises(InputError, match=r"nope.*one.*two"):
        find([f"{layer}.{c}" for layer in ("one", "two") for c in "RGB"])


def test_an_ambiguous_last_part_is_refused():
    names = [f"{layer}.Combined.{c}" for layer in ("a", "b") for c in "RGB"]
    with pytest.raises(InputError, match=r"a\.Combined.*b\.Combined"):
        layers.find_color(names, "combined")


def test_two_pictures_without_a_telling_name_are_refused_with_both():
    with pytest.raises(InputError, match=r"--layer.*one.*two"):
        layers.find_color([f"{layer}.{c}" for layer in ("one", "two") for c in "RGB"])


# ---- masks ----------------------------------------------------------------------------------


def as_float(ident: int) -> np.float32:
    return np.frombuffer(struct.pack("<I", ident), np.float32)[0]


TREE, HOUSE = 0x3F9D70A4, 0xC2B0A1F3
LEVELS = np.array([[0.0, 0.5, 1.0, 2.5, -1.0]], np.float32)
INDEX = np.array([[0, 1, 2, 3, 2]], np.float32)


def cryptomatte(manifest=True):
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
    got = layers.mask({"m.Y": LEVELS}, {}, "m")
    np.testing.assert_array_equal(got, [[0, 0.5, 1, 1, 0]])


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.uint32])
def test_an_index_chooses_the_pixels_that_hold_it(kind):
    got = layers.mask({"IndexOB.X": INDEX.astype(kind)}, {}, "IndexOB=2")
    np.testing.assert_array_equal(got, [[0, 0, 1, 0, 1]])


@pytest.mark.parametrize("value", ["tree", f"0x{TREE:08x}", f"0X{TREE:08X}"])
def test_a_cryptomatte_gives_an_objects_coverage_by_name_or_id(value):
    channels, attributes = cryptomatte()
    got = layers.mask(channels, attributes, f"CryptoObject={value}")
    np.testing.assert_array_equal(got, [[1, 0.5, 0.25, 0, 0]])


def test_a_cryptomattes_coverages_of_all_objects_fill_what_is_covered():
    channels, attributes = cryptomatte()
    tree, house = (
        layers.mask(channels, attributes, f"CryptoObject={o}") for o in ("tree", "house")
    )
    np.testing.assert_array_equal(tree + house, [[1, 1, 1, 1, 0]])


def test_a_cryptomatte_without_manifest_takes_the_id_and_asks_for_it():
    channels, attributes = cryptomatte(manifest=False)
    got = layers.mask(channels, attributes, f"CryptoObject=0x{HOUSE:08x}")
    np.testing.assert_array_equal(got, [[0, 0.5, 0.75, 1, 0]])
    with pytest.raises(InputError, match=r"tree.*0x"):
        layers.mask(channels, attributes, "CryptoObject=tree")


def test_blenders_cryptomatte_is_found_by_its_last_part():
    channels, _ = cryptomatte()
    lead = "ViewLayer."
    channels = {lead + k: v for k, v in channels.items()}
    attributes = {"cryptomatte/1a2b/name": "ViewLayer.CryptoObject"}
    got = layers.mask(channels, attributes, f"CryptoObject=0x{TREE:08x}")
    np.testing.assert_array_equal(got, [[1, 0.5, 0.25, 0, 0]])


@pytest.mark.parametrize(
    ("wanted", "says"),
    [("CryptoObject=cow", r"cow.*tree.*house"), ("CryptoObject", "choose an object"),
     ("IndexOB=x", "must be a number"), ("nope", r"nope.*IndexOB"), ("nope=3", r"nope.*IndexOB")],
)  # fmt: skip
def test_a_mask_that_cannot_be_made_is_refused_with_the_reason(wanted, says):
    channels, attributes = cryptomatte()
    with pytest.raises(InputError, match=says):
        layers.mask({**channels, "IndexOB.X": INDEX}, attributes, wanted)


@pytest.mark.parametrize(
    "manifest",
    ["not json", "[]", "3", '{"tree": 5}', '{"tree": "xyz"}', 100_000 * "[", 5000 * "9"],
    ids=lambda text: text[:15],
)
def test_a_damaged_cryptomatte_manifest_is_refused(manifest):
    channels, attributes = cryptomatte()
    attributes["cryptomatte/abc1234/manifest"] = manifest
    with pytest.raises(InputError):
        layers.mask(channels, attributes, "CryptoObject=tree")


def test_a_cryptomatte_without_a_name_is_none():
    channels, attributes = cryptomatte()
    del attributes["cryptomatte/abc1234/name"]
    with pytest.raises(InputError, match="no layer"):
        layers.mask(channels, attributes, "=tree")


def test_a_cryptomatte_without_its_channels_is_refused():
    _, attributes = cryptomatte()
    with pytest.raises(InputError, match="CryptoObject"):
        layers.mask({"R": INDEX}, attributes, "CryptoObject=tree")
