"""Settings of colours: the meaning of the input's numbers, and the display of results."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from ..color.ocio import installed
from ..color.spaces import ColorConfig, ColorSpace, Display
from ..errors import InputError
from ..extras import install_command


@dataclass(frozen=True, kw_only=True)
class DisplaySettings:
    """Display of colours in PNG, JPEG, TIFF, videos and the viewer."""

    ocio: str | None = None
    "OpenColorIO config: builtin (ACES), studio, blender, a file, or off (sRGB); default: $OCIO."
    display: str | None = None
    "Display of the config; default: the first."
    view_transform: str | None = None
    "View of the display, such as AgX; default: the first."
    look: str | None = None
    "Look of the config, such as 'AgX - Punchy', instead of the view's own."

    def open(self, *, needed: bool = True) -> Display | None:
        """Return the Display these settings describe; None: sRGB.

        Unless `needed`, a config is opened only where an option asks for it.
        """
        given = [name for name, value in vars(self).items() if value is not None and name != "ocio"]
        if self.ocio is not None and self.ocio != "off":
            return self._display_of(self.ocio)
        config = os.environ.get("OCIO") if self.ocio is None else None
        if config and (given or (needed and installed())):
            try:
                return self._display_of(config)
            except InputError as error:
                raise InputError(f"$OCIO: {error}; `ocio='off'` shows sRGB") from None
        if given:
            known = "`ocio` may be builtin, studio, blender or a file"
            raise InputError(f"`{given[0]}` needs an OpenColorIO config: {known}")
        return None

    def _display_of(self, config: str) -> Display:
        return ColorConfig(config).display(self.display, self.view_transform, self.look)

    @property
    def remark(self) -> str | None:
        """A remark for users whose $OCIO cannot be used; None otherwise."""
        if self.ocio is not None or not os.environ.get("OCIO") or installed():
            return None
        return f"$OCIO is ignored, as OpenColorIO is not installed: {install_command('ocio')}"


@dataclass(frozen=True, kw_only=True)
class ColorSettings(DisplaySettings):
    """Colour space of the input, and display in PNG, JPEG, TIFF, videos and the viewer."""

    from_: str | None = None
    "Colour space of the input, such as acescg; default: by its attributes, else linear Rec.709."

    def unused_by_videos(self) -> str:
        """A line on options that have no effect on videos; "" without any.

        InputError for a time, where a part of the video was meant.
        """
        if self.from_ and re.fullmatch(r"[\d:.]+", self.from_):
            raise InputError(
                f"`from_` names a colour space, got {self.from_}; `begin` and `end` select a part "
                "of a video"
            )
        used = [f"`{name}`" for name, value in vars(self).items() if value is not None]
        if not used:
            return ""
        have = "has" if len(used) == 1 else "have"
        return f"videos keep their own colours, so {' and '.join(used)} {have} no effect"

    def space(self, display: Display | None) -> ColorSpace | None:
        """The colour space of the input, where it is given; `display`: from `open`."""
        if self.from_ is None or display is None:
            return None
        return display.config.space(self.from_)


def option_name(field: str) -> str:
    """The option that sets a field: `view_transform` -> `--view-transform`, `from_` -> `--from`."""
    return "--" + field.rstrip("_").replace("_", "-")


def color_record(
    display: Display | None, output: str, space: ColorSpace | None = None, pattern: str = ""
) -> dict[str, str | None]:
    """Colour settings that change the contents of `output`, for its record; nothing for sRGB.

    `space`: of the input `pattern`, where it is given.
    """
    if display is None:
        return {}
    said = {} if output.lower().endswith(".exr") else display.settings
    if space is not None:
        said = {"ocio": display.settings["ocio"]} | said | {"from": space.name}
        if not (space.is_linear and pattern.lower().endswith(".exr")):
            said["working_space"] = display.config.scene_linear.name
    return said
