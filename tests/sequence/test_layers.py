"""Layers are found by the names that renderers give them."""

import pytest

from wgmb import InputError
from wgmb.sequence.layers import names as layers
from wgmb.sequence.layers import vectors

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
    "guerilla": (
        ["R", "G", "B", "Depth", "MotionVector.r", "MotionVector.g"],
        ["R", "G", "B"], "Depth", "arnold"),
    "karma": (
        [*RGBA, "depth", "P.x", "P.y", "P.z", "motionvector.x", "motionvector.y", "motionvector.z"],
        list(RGBA), "depth", "arnold"),
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
    with pytest.raises(InputError, match=r"`color` chooses one: one, two"):
        layers.find_color([f"{layer}.{c}" for layer in ("one", "two") for c in "RGB"])


def test_depth_in_the_layer_of_the_picture_is_found():
    """As of a part called `beauty`, in which each channel is beauty's."""
    picture, place = ["beauty.R", "beauty.G", "beauty.B"], ["P.X", "P.Y", "P.Z"]
    assert layers.find_depth([*picture, "beauty.Z", *place], near="beauty.R") == "beauty.Z"
    assert layers.find_depth([*picture, *place], near="beauty.R") is None
