"""Settings files: TOML into values, each of the type that its field or option has."""

from __future__ import annotations

import json
import typing
from collections.abc import Collection
from dataclasses import fields
from typing import Any

from ...errors import InputError
from ...settings import (
    METHOD_OPTIONS,
    BlurSettings,
    InputSettings,
    OutputSettings,
    SceneSettings,
    ShutterSettings,
    rate_of,
)
from ...settings.color import ColorSettings
from ...settings.toml import parse
from ...settings.typed import typed
from ...settings.video import VideoSettings
from .allowed import INPUTS, VIDEO

GROUPS = (
    BlurSettings, ShutterSettings, SceneSettings, OutputSettings, InputSettings, ColorSettings,
    VideoSettings,
)  # fmt: skip
COLORS = frozenset(f.name for f in fields(ColorSettings))
"""Options of colours; of scenes all but `from_`, as files write `from`."""
VIEW = (
    "frames", "frame", "look", "eyes", "compare", "against", "wipe", "gain", "fastest", "middle",
    "exposure", "tone", "cone_rate", "cone_peak", "zoom", "center", "playing", "speed", "panel",
)  # fmt: skip
"""Options of the viewer alone, and the frame shown."""


def toml(tables: dict[str, dict[str, object]]) -> str:
    """The tables as text; what is None or an empty list is left out."""
    return "\n".join(
        f"[{name}]\n" + "".join(_line(k.rstrip("_"), v) for k, v in table.items())
        for name, table in tables.items()
    )


def _line(name: str, value: object) -> str:
    if value is None or value == []:
        return ""
    plain = list(value) if isinstance(value, tuple) else value
    text = json.dumps(plain, ensure_ascii=False, default=str)
    return f"{name} = {text}\n".replace("\x7f", "\\u007f")  # which JSON leaves as it is


def tables(text: str) -> dict[str, dict]:
    """The tables of the text: [render] or [blur], and [view]; InputError if there are others."""
    found = parse(text)
    if unknown := found.keys() - {"render", "blur", "view"}:
        raise InputError(f"settings: unknown table {', '.join(sorted(unknown))}")
    if ("render" in found) == ("blur" in found):
        raise InputError("settings need either a table [render] or a table [blur]")
    if wrong := [name for name, table in found.items() if not isinstance(table, dict)]:
        raise InputError(f"settings: {wrong[0]} must be a table, [{wrong[0]}]")
    return found


def values(given: dict[str, Any], view: dict[str, Any], state: type, on_disk: bool) -> dict:
    """Fields of the dataclass `state` from what the tables [render], or [blur], and [view] hold."""
    known = _hints(*GROUPS) | {"fps": str | float}
    own = {f.name for f in fields(state)} & known.keys() - set(VIEW)
    own -= set() if on_disk else VIDEO
    allowed = own | {"set", *METHOD_OPTIONS} | (INPUTS | VIDEO if on_disk else set())
    allowed |= COLORS if on_disk else COLORS - {"from_"}
    found: dict[str, Any] = {}
    pairs: dict[str, list] = {"settings": [], "options": [], "given": [], "color": [], "video": []}
    for word, value in given.items():
        name = "from_" if word == "from" else word
        if name not in allowed or word == "from_":
            raise InputError(f"settings: unknown name {word!r}")
        fit = typed(f"settings: {name}", value, known[name])
        if name == "speed":  # of the output; in [view] it is that of the playing
            found["pace"] = fit
        elif name == "set":
            pairs["settings"] = [_setting(text) for text in fit]
        elif name == "fps" and fit == "source" and on_disk:
            found["own_times"] = True
        elif name in own:
            found[name] = float(rate_of(str(fit))) if name == "fps" else fit
        else:
            pairs[_group(name)].append((name, fit))
    hints = _hints(state)
    for name, value in view.items():
        if name not in VIEW:
            raise InputError(f"settings: [view] has no {name!r}; available: {', '.join(VIEW)}")
        found[name] = typed(f"settings: {name}", value, hints[name])
    return found | {name: tuple(some) for name, some in pairs.items()}


def _group(name: str) -> str:
    """The field of a State that keeps an option."""
    if name in METHOD_OPTIONS:
        return "options"
    return "color" if name in COLORS else "video" if name in VIDEO else "given"


def _setting(text: str) -> tuple[str, float | str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise InputError(f"settings: set takes NAME=VALUE, got {text!r}")
    try:
        return name, float(value)
    except ValueError:
        return name, value


def _hints(*groups: type) -> dict[str, Any]:
    """The types of all fields of the dataclasses, by name; the first one counts."""
    found: dict[str, Any] = {}
    for group in groups:
        found = typing.get_type_hints(group) | found
    return found


def check_words(state: object, **known: Collection[str]) -> None:
    """InputError for a field whose value is none of those that are known."""
    for name, words in known.items():
        if (value := getattr(state, name)) not in words:
            raise InputError(f"settings: {name} must be one of {', '.join(words)}, got {value!r}")
