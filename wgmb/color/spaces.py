"""OpenColorIO: colour spaces of pictures, and their conversion for a display.

The package is optional (the extra `ocio`) and loaded when a ColorConfig is made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from . import config_files, ocio
from .primaries import AP0, AP1, REC709, conversion, of_matrix
from .srgb import ToDisplay

_NAMED_BY = "colorInteropID", "oiio:ColorSpace", "colorspace"
_NAMED = {  # linear spaces whose primaries their names tell
    "lin_ap0_scene": AP0, "lin_ap0": AP0, "ACES2065-1": AP0, "ACES - ACES2065-1": AP0,
    "lin_ap1_scene": AP1, "lin_ap1": AP1, "ACEScg": AP1, "ACES - ACEScg": AP1,
    "lin_rec709_scene": REC709, "lin_rec709": REC709, "Linear Rec.709 (sRGB)": REC709,
    "Linear Rec.709": REC709, "Utility - Linear - sRGB": REC709,
}  # fmt: skip
_MOST = 65504.0  # brighter than any display: largest half float


@dataclass(frozen=True)
class ColorSpace:
    """A colour space of a config: the meaning of a picture's numbers.

    `name` is a space of the config. Where `matrix` is given (9 numbers, row by row), RGB must be
    multiplied by it first. `why` says how the space was found.
    """

    config: ColorConfig = field(compare=False, repr=False)
    name: str
    why: str = field(compare=False)
    matrix: tuple[float, ...] | None = None

    @cached_property
    def is_linear(self) -> bool:
        """True if the numbers are scene-linear light, or no colours at all (data)."""
        return self.matrix is not None or self.config.is_linear(self.name)

    @property
    def text(self) -> str:
        """The name of the space and the reason for it, in words."""
        by_matrix = "linear Rec.709" if self.why == "default" else "linear RGB"
        return f"{self.name if self.matrix is None else by_matrix} (by {self.why})"

    def check_linear(self) -> None:
        """InputError unless the numbers are linear."""
        if not self.is_linear:
            raise InputError(
                f"{self.why} is {self.name!r}, which is not linear, and only linear light can be "
                f"blurred; `space='{self.name}'` makes it linear, another `space` overrides it"
            )

    def linear(self, rgba: np.ndarray) -> np.ndarray:
        """Convert RGB or premultiplied RGBA of this space to `config.scene_linear`; new float32."""
        rgb, alpha = rgba[..., :3], rgba[..., 3:].astype(np.float32, copy=False)
        if self.is_linear or not alpha.shape[2]:
            return np.concatenate([self.config.linearised(rgb, self.name), alpha], axis=2)
        with np.errstate(over="ignore", invalid="ignore"):
            straight = np.divide(rgb, alpha, out=np.zeros(rgb.shape, "f4"), where=alpha > 0)
            light = self.config.linearised(straight, self.name) * alpha
        return np.concatenate([light, alpha], axis=2)


class ColorConfig:
    """An OpenColorIO config: its spaces, displays and views.

    `config`: "builtin" (OpenColorIO's default, ACES), "studio" (the same with cameras' spaces),
    "blender" (of the module bpy, or of the program), `ocio://NAME`, or a file. InputError
    where there is none, or OpenColorIO is not installed.
    """

    def __init__(self, config: str | Path):
        self._ocio, place = ocio.load(), ocio.config_file(str(config))
        config_files.check(str(config), Path(place))
        with ocio.reported(str(config)):
            self._config: Any = self._ocio.Config.CreateFromFile(place)
            config_files.check_tables(self._ocio, self._config)
        self.name: str = self._config.getName() or Path(place).name
        """For messages and records."""
        self.version: str = self._config.getCacheID().partition(":")[0]
        """Changes with the contents of the config."""

    def space(self, name: str) -> ColorSpace:
        """The space of that name, alias or role; InputError lists the names there are."""
        found = self._config.getColorSpace(name)
        if found is None:
            known = list(self._config.getColorSpaceNames())
            every = [*known, *map(str.lower, known), *self._config.getRoleNames()]
            every += [a for n in known for a in self._config.getColorSpace(n).getAliases()]
            raise InputError(
                f"unknown colour space {name!r} in {self.name}; available: {', '.join(known)}"
                f"{did_you_mean(name, every)}"
            )
        return ColorSpace(self, found.getName(), "choice")

    def space_of(self, attributes: Mapping[str, Any]) -> ColorSpace:
        """The space of a picture with these attributes, of an EXR's part.

        In this order: `colorInteropID`, `oiio:ColorSpace` or `colorspace` where the config has
        a space of that name or alias (not: role); `acesImageContainerFlag` of 1 is ACES2065-1
        (SMPTE ST 2065-4); `chromaticities`; else linear Rec.709, the meaning of an EXR without
        any of these.
        """
        for key in _NAMED_BY:
            value = attributes.get(key)
            space = self._config.getColorSpace(value) if isinstance(value, str) and value else None
            names = [space.getName(), *space.getAliases()] if space else []
            if space and str(value).casefold() in map(str.casefold, names):
                return ColorSpace(self, space.getName(), key)
        if attributes.get("acesImageContainerFlag") == 1:
            return self._by_primaries(AP0, "acesImageContainerFlag")
        if (given := attributes.get("chromaticities")) is not None:
            return self._by_primaries(tuple(np.ravel(given).tolist()), "chromaticities")
        return self._by_primaries(REC709, "default")

    def unknown(self, attributes: Mapping[str, Any]) -> str:
        """A colour space that the attributes name and the config lacks; '' if there is none."""
        for key in _NAMED_BY:
            value = attributes.get(key)
            if isinstance(value, str) and value:
                return "" if self.space_of({key: value}).why == key else f"{key} {value!r}"
        return ""

    @cached_property
    def scene_linear(self) -> ColorSpace:
        """The space of the role scene_linear, in which pictures of other spaces are blurred."""
        if not self._config.hasRole("scene_linear"):
            raise InputError(f"{self.name} has no role scene_linear, in which pictures are blurred")
        found = self._config.getColorSpace("scene_linear")
        if found is None:
            raise InputError(f"the role scene_linear of {self.name} names no colour space it has")
        return ColorSpace(self, found.getName(), "the role scene_linear")

    def chromaticities(self, space: ColorSpace) -> tuple[float, ...] | None:
        """Chromaticities of that linear space for an EXR: x, y of red, green, blue and white; None
        if unknown."""
        if self._interchange is None:
            return None
        onto, primaries = self._interchange
        if space.matrix is not None:
            return of_matrix(conversion(primaries, AP0) @ np.reshape(space.matrix, (3, 3)))
        columns = np.eye(3, dtype=np.float32)[None]
        with ocio.reported(f"{space.name} in {self.name}"):
            moved = self._lossless(self._config.getProcessor(space.name, onto))
            moved.applyRGB(columns)
        matrix = conversion(primaries, AP0) @ columns[0].T.astype(np.float64)
        return of_matrix(matrix)

    def is_linear(self, name: str) -> bool:
        """True if the space of that name holds scene-linear light or data."""
        scene = self._ocio.REFERENCE_SPACE_SCENE
        with ocio.reported(f"{name} in {self.name}"):
            data = self._config.getColorSpace(name).isData()
            return data or self._config.isColorSpaceLinear(name, scene)

    def linearised(self, rgb: np.ndarray, name: str) -> np.ndarray:
        """Convert (height, width, 3) RGB of the named space to `scene_linear`; new float32."""
        with ocio.reported(f"{name} in {self.name}"):
            processor = self._config.getProcessor(name, self.scene_linear.name)
            return ocio.applied(self._lossless(processor), np.array(rgb, np.float32, order="C"))

    @property
    def displays(self) -> list[str]:
        """Names of the config's displays."""
        return list(self._config.getDisplaysAll())

    def views(self, display: str) -> list[str]:
        """Names of the views of a display."""
        return list(self._config.getViews(display))

    @property
    def looks(self) -> list[str]:
        """Names of the config's looks."""
        return list(self._config.getLookNames())

    def display(
        self, display: str | None = None, view: str | None = None, look: str | None = None
    ) -> Display:
        """A display and view of the config; None stands for the config's default.

        `look`: instead of the view's own looks. InputError lists the names there are.
        """
        config = self._config
        display = str(display or config.getDefaultDisplay())
        displays = self.displays
        if (found := _same(display, displays)) is None:
            raise InputError(
                f"unknown display {display!r} in {self.name}; available: {', '.join(displays)}"
                f"{did_you_mean(display, displays)}"
            )
        views = self.views(found)
        view = str(view or config.getDefaultView(found))
        if not config.hasView(found, view):
            raise InputError(
                f"unknown view {view!r} of display {found!r} in {self.name}; "
                f"available: {', '.join(views)}{did_you_mean(view, views)}"
            )
        looks = self.looks
        for name in (part.strip(" +-") for part in (look or "").replace("|", ",").split(",")):
            if name and _same(name, looks) is None:
                raise InputError(
                    f"unknown look {name!r} in {self.name}; available: {', '.join(looks)}"
                    f"{did_you_mean(name, looks)}"
                )
        return Display(self, found, _same(view, views) or view, look)

    def processor(self, space: ColorSpace, display: str, view: str, look: str | None) -> Any:
        """OpenColorIO's processor from a space to a display and view."""
        pipeline = self._ocio.LegacyViewingPipeline()
        pipeline.setDisplayViewTransform(
            self._ocio.DisplayViewTransform(src=space.name, display=display, view=view)
        )
        if look is not None:
            pipeline.setLooksOverrideEnabled(True)
            pipeline.setLooksOverride(look)
        with ocio.reported(f"{display}, {view} in {self.name}"):
            shown = pipeline.getProcessor(self._config)
            if space.matrix is None:
                return shown
            rows = np.eye(4)
            rows[:3, :3] = np.reshape(space.matrix, (3, 3))
            first = self._ocio.MatrixTransform(rows.ravel().tolist())
            every = self._ocio.GroupTransform([first, *shown.createGroupTransform()])
            return self._config.getProcessor(every)

    def names_of(self, display: str, view: str) -> set[str]:
        """Every name of the colour space that a view makes, in lower case."""
        name = self._config.getDisplayViewColorSpaceName(display, view)
        found = self._config.getColorSpace(display if name.startswith("<") else name)
        if found is None:
            return set()
        interop = found.getInteropID() if hasattr(found, "getInteropID") else ""
        names = found.getName(), interop, *found.getAliases()
        return {name.casefold() for name in names if name}

    @cached_property
    def _interchange(self) -> tuple[str, tuple[float, ...]] | None:
        """A linear space of the config whose primaries are known, and these."""
        if self._config.hasRole("aces_interchange"):
            return self._config.getColorSpace("aces_interchange").getName(), AP0
        for name, primaries in _NAMED.items():
            if found := self._config.getColorSpace(name):
                return found.getName(), primaries
        return None

    def _by_primaries(self, primaries: tuple[float, ...], why: str) -> ColorSpace:
        for name, known in _NAMED.items():
            if np.allclose(primaries, known, rtol=0, atol=1e-5) and (
                space := self._config.getColorSpace(name)
            ):
                return ColorSpace(self, space.getName(), why)
        if self._interchange is None:
            raise InputError(
                f"{self.name} has neither the role aces_interchange nor a space of known primaries "
                f"(ACEScg, lin_rec709, ...), so the colours cannot be found by {why}; `space` "
                "names their space"
            )
        name, known = self._interchange
        matrix = conversion(primaries, known)
        return ColorSpace(self, name, why, tuple(matrix.ravel().tolist()))

    def _lossless(self, processor: Any) -> Any:
        return processor.getOptimizedCPUProcessor(self._ocio.OPTIMIZATION_LOSSLESS)


class Display:
    """A display and a view of a config; see ColorConfig.display."""

    def __init__(self, config: ColorConfig, display: str, view: str, look: str | None):
        self.config, self.display, self.view, self.look = config, display, view, look
        self._processors: dict[ColorSpace, Any] = {}

    @property
    def settings(self) -> dict[str, str | None]:
        """Names of config, display, view and look, for the record of a file."""
        config = f"{self.config.name} ({self.config.version})"
        return {"ocio": config, "display": self.display, "view_transform": self.view,
                "look": self.look}  # fmt: skip

    @cached_property
    def names(self) -> set[str]:
        """Every name of the colour space that the view makes, in lower case."""
        return self.config.names_of(self.display, self.view)

    def of(self, space: ColorSpace) -> ToDisplay:
        """Conversion of linear premultiplied pictures in `space` to the display, as
        `color.to_display` for sRGB."""
        space.check_linear()
        return partial(self._to_display, space)

    def shown(self, rgba: np.ndarray, space: ColorSpace, over_black: bool = False) -> np.ndarray:
        """Convert linear premultiplied (height, width, 3 or 4) to RGB on the display, float32 0..1.

        The colour is unassociated for the transform, and stays so unless it is to lie
        `over_black`. Where alpha is 0, it is light that is added: it has a colour over black only.
        """
        rgb, alpha = rgba[..., :3], rgba[..., 3:].astype(np.float32, copy=False)
        if not alpha.shape[2]:
            return self._transformed(rgb, space)
        covered = alpha > 0
        with np.errstate(over="ignore", invalid="ignore"):
            straight = np.divide(rgb, alpha, out=rgb.astype(np.float32), where=covered)
        colors = self._transformed(straight, space)
        if not over_black:
            return np.where(covered, colors, np.float32(0))
        added = np.any(rgb != 0, axis=2, keepdims=True)
        return colors * np.where(covered, np.clip(alpha, 0, 1), added).astype(np.float32)

    def shader(self, space: ColorSpace, first_binding: int) -> ocio.Shader:
        """OpenColorIO's shader for pictures in `space` (unassociated, linear)."""
        with ocio.reported(f"{self.display}, {self.view} in {self.config.name}"):
            return ocio.shader(self._processor(space), first_binding)

    def _processor(self, space: ColorSpace) -> Any:
        return self.config.processor(space, self.display, self.view, self.look)

    def _transformed(self, rgb: np.ndarray, space: ColorSpace) -> np.ndarray:
        if space not in self._processors:
            self._processors[space] = self._processor(space).getDefaultCPUProcessor()
        light = np.nan_to_num(
            rgb.astype(np.float32), copy=False, nan=0, posinf=_MOST, neginf=-_MOST
        )
        light = np.clip(light, -_MOST, _MOST, out=np.ascontiguousarray(light))
        shown = np.nan_to_num(ocio.applied(self._processors[space], light), copy=False)
        return np.clip(shown, 0, 1, out=shown)

    def _to_display(
        self, space: ColorSpace, rgba: np.ndarray, bits: int, over_black: bool = False
    ) -> np.ndarray:
        most, kind = (255, np.uint8) if bits == 8 else (65535, np.uint16)
        samples = np.rint(self.shown(rgba, space, over_black) * most).astype(kind)
        if over_black or rgba.shape[2] == 3:
            return samples
        covered = np.rint(np.clip(rgba[..., 3:], 0, 1).astype(np.float32) * most).astype(kind)
        return np.concatenate([samples, covered], axis=2)


def _same(name: str, known: list[str]) -> str | None:
    """The name as the config writes it, which does not tell capital letters from small ones."""
    return next((k for k in known if k.casefold() == name.casefold()), None)
