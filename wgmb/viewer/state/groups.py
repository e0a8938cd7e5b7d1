"""The settings' own groups that a State holds, and which of them an option belongs to."""

from __future__ import annotations

import ast
import inspect
import textwrap
from dataclasses import fields
from itertools import pairwise

from ...settings import METHOD_OPTIONS, OutputSettings, SceneSettings
from ...settings.groups import GROUPS as BLUR_GROUPS

GROUPS = BLUR_GROUPS | {"scene": SceneSettings}
"""Settings by the name of a State's field."""
GROUP_OF = {
    field.name: name
    for name, group in GROUPS.items()
    for field in fields(group)
    if field.name not in ("frames", "time")  # of all that is shown, a State has its own
}
"""The field of a State that holds an option."""
DEFAULTS = {
    f.name: f.default for group in (*GROUPS.values(), OutputSettings) for f in fields(group)
}
"""Defaults of the command line's options."""


def _help_of(group: type) -> dict[str, str]:
    """The strings under the fields of a dataclass, by name."""
    found: dict[str, str] = {}
    for kind in reversed(group.__mro__[:-1]):
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
        assert isinstance(body, ast.ClassDef)
        for field, text in pairwise(body.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                found[field.target.id] = " ".join(text.value.value.split())  # pyright: ignore
    return found


HELP = {name: text for group in GROUPS.values() for name, text in _help_of(group).items()}
HELP |= {name: help for name, (_, _, help) in METHOD_OPTIONS.items()}
"""The help of an option, by its name."""
MASKS = ("holdout", "scale")
"""Options of the blur that say what files hold."""

_ALWAYS = {
    *(name for name, home in GROUP_OF.items() if home in ("blur", "shutter", "scene")),
    *("flow", "flow_quality", "speed"),
} - {*METHOD_OPTIONS, *MASKS}  # are written even where they are as by default


def changed(name: str, group: object) -> dict[str, object]:
    """The options of a State's group that differ from their defaults."""
    values = {option: getattr(group, option) for option, of in GROUP_OF.items() if of == name}
    return {option: value for option, value in values.items() if value != DEFAULTS[option]}


def written(name: str, group: object) -> dict[str, object]:
    """The options of a State's group that a settings file names."""
    return {
        option: getattr(group, option)
        for option, of in GROUP_OF.items()
        if of == name and (option in _ALWAYS or getattr(group, option) != DEFAULTS[option])
    }
