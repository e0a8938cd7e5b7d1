"""Settings files: TOML into values, each of the type that its field or option has."""

from __future__ import annotations

import json
import typing
from collections.abc import Collection
from dataclasses import replace
from typing import Any

from ...errors import InputError
from ...settings import parameters_of, rate_of
from ...settings.toml import parse
from ...settings.typed import typed
from .allowed import INPUTS, VIDEO
from .groups import GROUP_OF, GROUPS

VIEW = (
    "frames", "frame", "look", "eyes", "compare", "against", "wipe", "gain", "fastest", "middle",
    "exposure", "tone", "cone_rate", "cone_peak", "zoom", "center", "playing", "speed", "panel",
)  # fmt: skip
"""Options of the viewer alone, and the frame shown."""
_OF_SCENES = frozenset(name for name, group in GROUP_OF.items() if group == "scene")


def toml(tables: dict[str, dict[str, object]]) -> str:
    """The tables as text; None is left out."""
    return "\n".join(
        f"[{name}]\n" + "".join(_line(k.rstrip("_"), v) for k, v in table.items())
        for name, table in tables.items()
    )


def _line(name: str, value: object) -> str:
    if value is None:
        return ""
    plain = list(value) if isinstance(value, tuple) else value
    text = json.dumps(plain, ensure_ascii=False, default=str)
    return f"{name} = {text}\n".replace("\x7f", "\\u007f")  # which JSON leaves as it is


def tables(text: str) -> dict[str, dict[str, Any]]:
    """The tables of the text: [render] or [blur], and [view]; InputError if there are others."""
    found = parse(text)
    if unknown := found.keys() - {"render", "blur", "view"}:
        raise InputError(f"settings: unknown table {', '.join(sorted(unknown))}")
    if ("render" in found) == ("blur" in found):
        raise InputError("settings need either a table [render] or a table [blur]")
    if wrong := [name for name, table in found.items() if not isinstance(table, dict)]:
        raise InputError(f"settings: {wrong[0]} must be a table, [{wrong[0]}]")
    return found


def values(
    table: dict[str, Any], view: dict[str, Any], plain: object, on_disk: bool
) -> dict[str, Any]:
    """Fields of the State `plain`, changed to those of [render], or [blur], and [view]."""
    known = {"fps": str | float}
    for group in GROUPS.values():
        known |= typing.get_type_hints(group)
    allowed = {"fps", *GROUP_OF} - (_OF_SCENES if on_disk else INPUTS | VIDEO | {"from_"})
    found: dict[str, Any] = {}
    groups: dict[str, dict[str, Any]] = {name: {} for name in GROUPS}
    for word, value in table.items():
        name = "from_" if word == "from" else word
        if name not in allowed or word == "from_":
            raise InputError(f"settings: unknown name {word!r}")
        fit = typed(f"settings: {name}", value, known[name])
        if name == "fps":
            own_times = fit == "source" and on_disk
            found |= {"own_times": True} if own_times else {"fps": float(rate_of(str(fit)))}
        else:
            groups[GROUP_OF[name]][name] = fit
    parameters_of(groups["scene"].get("set", ()))
    hints = typing.get_type_hints(type(plain))
    for name, value in view.items():
        if name not in VIEW:
            raise InputError(f"settings: [view] has no {name!r}; available: {', '.join(VIEW)}")
        found[name] = typed(f"settings: {name}", value, hints[name])
    return found | {name: replace(getattr(plain, name), **some) for name, some in groups.items()}


def check_words(name: str, value: str | None, known: Collection[str]) -> None:
    """InputError for a value that is none of those that are known."""
    if value not in known:
        raise InputError(f"settings: {name} must be one of {', '.join(known)}, got {value!r}")
