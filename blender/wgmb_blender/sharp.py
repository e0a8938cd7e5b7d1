"""Sharp frames: where they lie, what they must hold, and how Blender renders them."""

from __future__ import annotations

import re
from collections.abc import Iterator

import bpy

from . import picture
from .changed import Change, changed
from .rendering import Render
from .wgmb_worker.problem import ProblemError
from .wgmb_worker.recipe import MATTE, Picture, SharpFrames, View

FIVE = bpy.app.version >= (5, 0, 0)
_ENGINES = {"CYCLES": "Cycles", "BLENDER_EEVEE_NEXT": "EEVEE", "BLENDER_EEVEE": "EEVEE"}
PASSES = {"use_pass_z": "Depth", "use_pass_vector": "Vector"}
LIGHT_PASSES = {
    "use_pass_diffuse_direct": "Diffuse Direct" if FIVE else "DiffDir",
    "use_pass_diffuse_indirect": "Diffuse Indirect" if FIVE else "DiffInd",
    "use_pass_diffuse_color": "Diffuse Color" if FIVE else "DiffCol",
    "use_pass_glossy_direct": "Glossy Direct" if FIVE else "GlossDir",
    "use_pass_glossy_indirect": "Glossy Indirect" if FIVE else "GlossInd",
    "use_pass_glossy_color": "Glossy Color" if FIVE else "GlossCol",
}


def sharp_frames(text: str) -> SharpFrames:
    """The pattern of the setting, in Blender's form: `//sharp/shot_` or `//sharp/shot_####.exr`."""
    if not text.strip():
        raise ProblemError("Sharp Frames is empty: choose where the sharp frames lie")
    if text.startswith("//") and not bpy.data.filepath:
        raise ProblemError(
            "Save the file first, or choose another place for the sharp frames: // is beside it"
        )
    whole = bpy.path.abspath(text)
    if whole.lower().endswith(".exr"):
        whole = whole[:-4]
    found = re.fullmatch(r"(.*?)(#*)", whole, re.S)
    if not found or len(found[2]) not in (0, 4) or "#" in found[1]:
        raise ProblemError(f"Sharp Frames: the number is four # at the end of the name, got {text}")
    return SharpFrames(found[1])


def views_of(scene: bpy.types.Scene) -> list[View]:
    """The views that are rendered, the left or first one first."""
    render = scene.render
    if not render.use_multiview:
        return [View()]
    views = render.stereo_views if render.views_format == "STEREO_3D" else render.views
    found = [View(view.name, view.file_suffix) for view in views if view.use]
    if not found:
        raise ProblemError("Stereoscopy is on, but none of its views is")
    return found


def layers_of(scene: bpy.types.Scene) -> list[bpy.types.ViewLayer]:
    """The view layers that are rendered."""
    found = [layer for layer in scene.view_layers if layer.use]
    if not found:
        raise ProblemError("No view layer is used for rendering")
    return found


def has_compositor(scene: bpy.types.Scene) -> bool:
    """Return True if rendering runs a compositor."""
    if not scene.render.use_compositing:
        return False
    if FIVE:
        return scene.compositing_node_group is not None
    return bool(scene.use_nodes and scene.node_tree)


def check(scene: bpy.types.Scene) -> None:
    """ProblemError where the scene cannot be rendered with vectors."""
    if not any(m.camera for m in scene.timeline_markers) and scene.camera is None:
        raise ProblemError("The scene has no camera: add one, then render again")
    if scene.render.engine not in _ENGINES:
        names = " or ".join(dict.fromkeys(_ENGINES.values()))
        raise ProblemError(f"This render engine has no Vector pass: choose {names}")


def render_frame(
    scene: bpy.types.Scene,
    number: int,
    files: SharpFrames,
    seen: Picture,
    matte: bool,
    light: bool,
    composited: bool,
    render: Render,
) -> Iterator[None]:
    """Render one frame, with the settings that it needs and not a moment longer."""
    views = views_of(scene)
    paths = [files.path(number, view) for view in views]
    stem = str(files.path(number).with_suffix(""))
    with changed(
        [*_settings(scene, stem, matte, light, composited), *picture.changes(scene, seen)]
    ):
        yield from render(scene, number, paths)


def _settings(
    scene: bpy.types.Scene, path: str, matte: bool, light: bool, composited: bool
) -> Iterator[Change]:
    render = scene.render
    image = render.image_settings
    yield render, "use_motion_blur", False  # Cycles has no vectors with it
    for layer in layers_of(scene):
        yield layer, "use_pass_combined", True
        for name in (*PASSES, *(LIGHT_PASSES if light else ())):
            yield layer, name, True
        if matte:
            yield layer, MATTE[0], True
    if FIVE:
        yield image, "media_type", "MULTI_LAYER_IMAGE"
    yield image, "file_format", "OPEN_EXR_MULTILAYER"
    yield image, "color_depth", "32"  # 16 bits would spoil bright light; the rest has 32 anyway
    yield image, "exr_codec", "ZIP"
    yield image, "views_format", "INDIVIDUAL"
    yield render, "filepath", path
    yield render, "use_file_extension", True
    yield render, "use_sequencer", False
    yield render, "use_compositing", composited
    yield render, "use_stamp", False
    yield render, "use_single_layer", False
