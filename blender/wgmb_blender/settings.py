"""Settings of the panel, stored in the file."""

from __future__ import annotations

from functools import cache

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .process import lent
from .wanted import Wanted
from .wgmb_worker.problem import ProblemError

_PATIENCE = 30  # seconds to wait for a list of GPUs

# Without it, 4.5 and later warn of paths beside the file; 4.2 does not know the word.
_BESIDE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()
METHODS = (
    ("gather", "Gather", "Closest to the truth; looks at the frames before and after"),
    ("reproject", "Reproject", "Visibility by depth; looks at the frames before and after"),
    ("tiles", "Tiles", "Soft silhouettes; one frame is enough"),
    ("tap", "Tap", "The quickest; blur ends at silhouettes"),
)
COMPOSITING = (
    (
        "BEFORE",
        "Before Compositing",
        "Blur each view layer, then composite: as if the renderer had blurred them",
    ),
    (
        "AFTER",
        "After Compositing",
        "Blur the composited picture with the vectors of the first view layer; for compositing "
        "that moves nothing",
    ),
)


LIGHT = (
    ("AUTO", "Automatic", "With Cycles and Gather on a GPU, where it costs almost nothing"),
    ("ON", "On", "Render the passes of light, by which Gather follows shadows and reflections"),
    ("OFF", "Off", "Shadows and reflections are blurred with the surface on which they appear"),
)


class WgmbKeptCollection(bpy.types.PropertyGroup):
    """A collection whose objects stay sharp."""

    collection: PointerProperty(type=bpy.types.Collection, name="Collection")


class WgmbSettings(bpy.types.PropertyGroup):
    """The settings of a scene."""

    method: EnumProperty(name="Method", items=METHODS, description="How frames are blurred")
    is_auto: BoolProperty(
        name="Automatic Samples", default=False, description="One sample a pixel of a streak"
    )
    samples: IntProperty(
        name="Samples", min=1, max=512, default=16, description="Times within the exposure"
    )
    light: EnumProperty(
        name="Moving Shadows",
        items=LIGHT,
        description="Follow shadows and reflections that move over surfaces. The sharp frames have "
        "the passes Diffuse and Glossy: Direct, Indirect and Color for it",
    )
    handles: BoolProperty(
        name="Handles",
        default=True,
        description="Render the frames beside those to be blurred too: one more at either end, and "
        "with a frame step the frames between. Vectors are there without them, but what an object "
        "hides is then not known",
    )
    overscan: IntProperty(
        name="Overscan",
        min=0,
        max=1024,
        default=0,
        subtype="PIXEL",
        description="Pixels rendered around the picture and cut off after the blur, for what "
        "comes into the picture during the exposure",
    )
    compositing: EnumProperty(name="Compositing", items=COMPOSITING)
    sharp: StringProperty(
        name="Sharp Frames",
        subtype="FILE_PATH",
        default="//sharp/",
        options={"ANIMATABLE", *_BESIDE},
        description="Where the sharp frames lie: a folder, or the beginning of their names. The "
        "frame number and .exr follow",
    )
    kept: CollectionProperty(type=WgmbKeptCollection)


@cache
def adapters() -> tuple[str, ...]:
    """The names of the GPUs, asked for once."""
    try:
        with lent() as process:
            return tuple(process.ask("adapters").result(_PATIENCE))
    except (ProblemError, TimeoutError) as error:  # the panel is drawn all the same
        print(f"wgmb: {error or 'no answer about the GPUs'}")
        return ()


def _devices(
    self: bpy.types.AddonPreferences, context: bpy.types.Context, text: str
) -> tuple[str, ...]:
    return adapters()


class WgmbPreferences(bpy.types.AddonPreferences):
    """Settings of the machine, not of the scene."""

    bl_idname = __package__

    device: StringProperty(
        name="GPU",
        description="A part of its name; empty: the fastest kind",
        search=_devices,
        search_options={"SUGGESTION"},
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice of a GPU."""
        self.layout.prop(self, "device")
        if not adapters():
            self.layout.label(
                text="No Vulkan, Metal or DirectX 12 driver found. Motion blur cannot run here.",
                icon="ERROR",
            )
        elif all("(CPU)" in name for name in adapters()):
            self.layout.label(text="No GPU found: blurring on the CPU", icon="INFO")


def device() -> str | None:
    """The GPU chosen in the preferences; None: the fastest."""
    addon = bpy.context.preferences.addons.get(__package__)
    return getattr(getattr(addon, "preferences", None), "device", "").strip() or None


def wanted_of(scene: bpy.types.Scene) -> Wanted:
    """The request of a scene's panel."""
    own = scene.wgmb
    return Wanted(
        method=own.method,
        samples="auto" if own.is_auto else own.samples,
        light=own.light,
        handles=own.handles,
        overscan=own.overscan,
        composited=own.compositing == "AFTER",
        kept=tuple(item.collection.name for item in own.kept if item.collection),
        sharp=own.sharp,
        device=device(),
    )


CLASSES = (WgmbKeptCollection, WgmbSettings, WgmbPreferences)


def register() -> None:
    """Give scenes their settings."""
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.wgmb = PointerProperty(type=WgmbSettings)


def unregister() -> None:
    """Take them away; their values stay in the file."""
    del bpy.types.Scene.wgmb
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
