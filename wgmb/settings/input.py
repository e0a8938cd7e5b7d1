"""Settings of the input frames."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, Self

from ..color.spaces import ColorSpace
from ..errors import check_choice
from ..io import limits
from ..io.frame_numbers import is_pattern, readable
from ..sequence.clip import Clip, Passes
from ..sequence.findings import SequenceFindings
from ..sequence.layers import vectors
from .record import plain

ProgramName = Literal["ae", "arnold", "blender", "nuke", "redshift", "unreal", "vray"]


@dataclass(frozen=True)
class ProgramPreset:
    """A program, and the fields of InputSettings that its frames need."""

    name: str
    options: Mapping[str, Any]


def _program(name: str, **values: Any) -> ProgramPreset:
    return ProgramPreset(name, MappingProxyType(values))


PROGRAMS: dict[str, ProgramPreset] = {
    "ae": _program("After Effects", vectors="rsmb", depth_kind="white-near"),
    "arnold": _program("Arnold", vector_layer="motionvector", depth_kind="planar"),
    "blender": _program("Blender", vectors="blender", depth_kind="planar"),
    "nuke": _program("Nuke", vectors="nuke", depth_kind="inverse"),
    "redshift": _program("Redshift", vector_layer="MotionVectors"),
    "unreal": _program("Unreal", vectors="unreal", depth_kind="planar"),
    "vray": _program("V-Ray", vectors="vray"),
}
"""By the names that the option takes. Where `vectors` is not set, their convention is detected."""


_NO_LOOK = "program", "frames", "skip_missing", "max_mb"


@dataclass(frozen=True, kw_only=True)
class InputSettings:
    """Input frames, layers and conventions."""

    frames: str | None = None
    "Frame numbers, such as 1-100x2 or 1,3,5-8; by default all existing frames."
    program: ProgramName | None = None
    "Program that made the frames; it sets the options that are not given, as its frames need them."
    layer: str | None = None
    "Colour layer, if it cannot be found by name."
    vectors: str = "auto"
    "Motion vector convention: auto (detected), none, or a name."
    vector_layer: str | None = None
    "Motion vector layer, or two channels such as dx,dy, if their names do not tell."
    vector_scale: float | tuple[float, float] = 1.0
    "Factor applied to the motion vectors, or one for x and one for y, such as 1920,1080."
    vector_offset: float | None = None
    "Value that encodes zero motion, subtracted before scaling (vray, rsmb: 0.5)."
    vector_flip: Literal["x", "y", "xy"] | None = None
    "Axes along which the motion vectors are reversed."
    vector_mask: str | None = None
    "Layer that is 1 where the vectors are valid, or none; default: MV_Alpha, or rsmb's alpha."
    object_motion: bool = False
    "The vectors hold object motion only; the camera's motion is added from --camera."
    camera: Path | None = None
    "JSON file with a camera per frame, for motion from depth where vectors are missing."
    depth: str | None = None
    "Depth layer, if it cannot be found by name."
    depth_kind: Literal["auto", "planar", "inverse", "clip", "white-near"] = "auto"
    """Depth convention: distance along the view axis, its inverse (Nuke), z after projection, or
    larger is nearer; auto: planar, or white-near where the frames show it.
    """
    far: float = 1e9
    "Depth from which a pixel counts as empty (sky)."
    object_layer: str | None = None
    "Object index layer that identifies the objects of the camera file."
    also: tuple[str, ...] = ()
    "Pattern of files with additional layers of the same frames; may be repeated."
    outside: Literal["auto", "nothing", "edge"] = "auto"
    "Surroundings of a cropped frame: nothing, or its edge repeated."
    alpha: Literal["premultiplied", "straight"] = "premultiplied"
    "Colours of the input EXR files; outputs are premultiplied, as OpenEXR prescribes."
    wrap: Literal["auto", "on", "off"] = "auto"
    "Panoramas of 360 degrees: motion and blur go on around the left and right edge."
    twos: Literal["auto", "off"] = "auto"
    "Animation on twos: auto does not blur jumps between held poses; off blurs them."
    cuts: str | None = None
    """Frames that begin a shot: 101,155, cut.edl[@FPS] or cut.otio; only:101,155 switches the
    detection off; none: no cuts.
    """
    view: str | None = None
    "One view of stereo frames, such as left; by default all are blurred."
    skip_missing: bool = False
    "Skip missing frames instead of stopping with an error."
    max_mb: float = limits.MAX_MB
    "Largest allowed decoded size of an image file in megabytes (as 32-bit floats)."

    @property
    def looks(self) -> dict[str, Any]:
        """The settings that change frames; the others select or limit them."""
        return {k: v for k, v in plain(self.of_program).items() if k not in _NO_LOOK}

    @property
    def of_program(self) -> Self:
        """A copy with the options that its program sets, as far as they were left as they are."""
        if self.program is None:
            return self
        check_choice("`program`", self.program, PROGRAMS)
        return replace(self, program=None, **self._set_by_program)

    @property
    def _set_by_program(self) -> dict[str, Any]:
        unset = {one.name for one in fields(self) if getattr(self, one.name) == one.default}
        program = PROGRAMS[self.program] if self.program else None
        return {k: v for k, v in program.options.items() if k in unset} if program else {}

    @property
    def remark(self) -> str:
        """The options that the program sets, in one line; "" without one."""
        if self.program is None:
            return ""
        told = [f"`{name}={value}`" for name, value in self._set_by_program.items()]
        name = PROGRAMS[self.program].name
        return (
            f"frames of {name}: {', '.join(told) or 'all options that it sets have other values'}"
        )

    def open(
        self,
        pattern: str,
        holdout: tuple[str, ...] = (),
        scale: tuple[str, ...] = (),
        space: ColorSpace | None = None,
        settled: SequenceFindings | None = None,
    ) -> Clip:
        """Return the Clip these settings describe; `space` of its pictures (ColorSettings.space).

        `settled`: what was found out about the sequence before (Clip.settle). InputError if a file
        is not readable, or a mask names what no Cryptomatte has.
        """
        if self.program is not None:
            return self.of_program.open(pattern, holdout, scale, space, settled)
        for name in self.also:
            if Path(name).suffix and not is_pattern(name):
                readable(Path(name))
        passes = Passes(
            color=self.layer,
            vectors=vectors.Vectors(
                self.vectors,
                self.vector_layer,
                self.vector_scale,
                self.vector_offset,
                self.vector_flip or "",
                self.vector_mask,
            ),
            depth=self.depth,
            depth_kind=self.depth_kind,
            far=self.far,
            camera=self.camera,
            object_layer=self.object_layer,
            object_motion=self.object_motion,
            holdout=holdout,
            scale=scale,
            also=self.also,
            outside=self.outside,
            wrap=self.wrap,
            twos=self.twos,
            alpha=self.alpha,
        )
        clip = Clip(
            pattern,
            frames=self.frames,
            passes=passes,
            skip_missing=self.skip_missing,
            cuts=self.cuts,
            view=self.view,
            space=space,
            max_mb=self.max_mb,
            settled=settled,
        )
        clip.masks.check()
        return clip
