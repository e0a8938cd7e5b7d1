"""Passes of light in files: found by their names, of the picture's own view layer."""

import numpy as np
import pytest

from wgmb import Clip
from wgmb.io import exr
from wgmb.sequence.layers import light as light_passes

pytestmark = pytest.mark.fast

SIZE = (6, 8)


def channels(*layers):
    return [f"{layer}.{c}" for layer in layers for c in "RGB"]


BLENDER = channels(*(f"ViewLayer.{n}" for n in ("Combined", "DiffDir", "DiffInd", "DiffCol")))


def fields(found):
    return [light.field for light in found.lights]


@pytest.mark.parametrize(
    "layers, light, multiplied",
    [
        (("DiffDir", "DiffInd", "DiffCol"), "diffuse_light", False),
        (("GlossDir", "GlossInd", "GlossCol"), "glossy_light", False),
        (("Diffuse Direct", "Diffuse Indirect", "Diffuse Color"), "diffuse_light", False),
        (("Glossy Direct", "Glossy Indirect", "Glossy Color"), "glossy_light", False),
        (("diffuse_direct", "diffuse_indirect", "diffuse_albedo"), "diffuse_light", True),
        (("specular_direct", "specular_indirect", "specular_albedo"), "glossy_light", True),
        (
            ("VRayRawLighting", "VRayRawGlobalIllumination", "VRayDiffuseFilter"),
            "diffuse_light",
            False,
        ),
        (("rawLight", "rawGI", "diffuse"), "diffuse_light", False),
        (("VRayLighting", "VRayGlobalIllumination", "VRayDiffuseFilter"), "diffuse_light", True),
        (("VRayReflection", "VRaySpecular", "VRayReflectionFilter"), "glossy_light", True),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_renderers_names_are_known(layers, light, multiplied):
    found = light_passes.find(["R", "G", "B", *channels(*layers)], "R")
    assert fields(found) == [light]
    assert found.lights[0].is_multiplied == multiplied
    assert found.lights[0].color == tuple(channels(layers[2]))
    assert len(found.lights[0].lights) == 2
    assert layers[0] in found.text and found.lacking is None


def test_light_without_indirect_light_is_light():
    found = light_passes.find(["R", "G", "B", *channels("DiffDir", "DiffCol")], "R")
    assert fields(found) == ["diffuse_light"]


def test_light_without_its_colour_is_said():
    found = light_passes.find(["R", "G", "B", *channels("DiffDir", "DiffInd")], "R")
    assert not found.lights
    assert found.lacking == (
        "DiffDir without the surface's colour (DiffCol): shadows are not followed"
    )


def test_another_view_layers_light_is_not_the_pictures():
    names = [*BLENDER, *channels("Other.Combined")]
    assert light_passes.find(names, "ViewLayer.Combined.R").lights
    assert not light_passes.find(names, "Other.Combined.R").lights
    # A file of its own needs no view layer.
    names = channels("Other.Combined", "DiffDir", "DiffCol")
    assert light_passes.find(names, "Other.Combined.R").lights


def test_a_single_layer_of_light_is_not_the_picture():
    found = light_passes.find(BLENDER, "ViewLayer.DiffDir.R")
    assert not found.lights and found.lacking is not None
    assert "left alone" in found.lacking


def test_what_is_not_followed_is_named():
    found = light_passes.find([*BLENDER, *channels("ViewLayer.TransDir")], BLENDER[0])
    assert found.unused == ("TransDir",)
    assert found.text == "shadows: DiffDir + DiffInd, DiffCol; not followed: TransDir"


def test_values_are_light_without_colour():
    rng = np.random.default_rng(1)
    names = channels("diffuse_direct", "diffuse_indirect", "diffuse_albedo")
    planes = {name: rng.random(SIZE).astype("f2") for name in names}
    given = light_passes.read(planes, light_passes.find(["R", "G", "B", *names], "R"))
    direct, indirect, albedo = (
        np.stack([planes[n] for n in names[k : k + 3]], 2).astype("f4") for k in (0, 3, 6)
    )
    np.testing.assert_array_equal(given["diffuse_color"], albedo)
    want = (direct + indirect) / np.maximum(albedo, 0.02)
    np.testing.assert_allclose(given["diffuse_light"], want, rtol=1e-6)


def test_black_light_is_none():
    names = channels("GlossDir", "GlossCol")
    planes = {name: np.ones(SIZE, "f4") * (name.startswith("GlossDir")) for name in names}
    assert not light_passes.read(planes, light_passes.find(["R", "G", "B", *names], "R"))


@pytest.fixture
def files(tmp_path):
    window = (0, 0, SIZE[1] - 1, SIZE[0] - 1)
    for number in (1, 2, 3):
        rng = np.random.default_rng(2)  # no cut between the frames
        planes = {name: rng.random(SIZE).astype("f4") for name in BLENDER}
        planes |= {f"ViewLayer.Vector.{c}": np.zeros(SIZE, "f4") for c in "XYZW"}
        planes["ViewLayer.Depth.Z"] = np.ones(SIZE, "f4")
        if number == 2:
            del planes["ViewLayer.DiffCol.R"]
        part = exr.Part("", planes, {}, window, window)
        (tmp_path / f"f.{number}.exr").write_bytes(exr.encode(exr.Exr(tmp_path, [part])))
    return tmp_path / "f.#.exr"


def test_a_clip_has_them_and_says_what_is_missing(files):
    clip = Clip(files)
    frames = [clip.with_neighbours(clip.source(n)) for n in (1, 2)]
    assert frames[0].diffuse_light is not None and frames[0].diffuse_color is not None
    assert frames[1].diffuse_light is None and frames[1].next is not None
    assert frames[1].next.diffuse_light is not None
    lacking = [text for text, on in clip.notes.items() if on == [2]]
    assert lacking and "DiffCol" in lacking[0]
    assert clip.frame(clip.source(1), light=False).diffuse_light is None
