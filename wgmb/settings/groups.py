"""The groups of settings of a blur; requests, job files and the viewer take them from here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self, get_type_hints

from .blur import BlurSettings
from .color import ColorSettings
from .input import InputSettings
from .shutter import ShutterSettings
from .video import VideoSettings


@dataclass(frozen=True, kw_only=True)
class SettingsGroups:
    """The groups of settings that rendered frames and videos are blurred with."""

    blur: BlurSettings = field(default_factory=BlurSettings)
    shutter: ShutterSettings = field(default_factory=ShutterSettings)
    input: InputSettings = field(default_factory=InputSettings)
    color: ColorSettings = field(default_factory=ColorSettings)
    video: VideoSettings = field(default_factory=VideoSettings)

    @classmethod
    def of(cls, groups: SettingsGroups, **more: Any) -> Self:
        """A request with these groups; `more`: its other fields."""
        return cls(**{name: getattr(groups, name) for name in GROUPS}, **more)


GROUPS: dict[str, type] = get_type_hints(SettingsGroups)
"""The groups' types by their names."""


def changed(settings: Any) -> list[str]:
    """Names of the options of a group that are not as by default."""
    return [f.name for f in fields(settings) if getattr(settings, f.name) != f.default]


def groups_of(options: Mapping[str, Any]) -> SettingsGroups:
    """The groups that hold these options; names that are in none are left out."""
    return SettingsGroups(**{name: chosen(kind, options) for name, kind in GROUPS.items()})


def chosen(kind: type, options: Mapping[str, Any]) -> Any:
    """A group with those of the options that it has."""
    names = [one.name for one in fields(kind) if one.name in options]
    return kind(**{name: options[name] for name in names})
