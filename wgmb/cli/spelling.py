"""Arguments of the library, as its messages name them, spelled as options of the command line."""

from __future__ import annotations

import re
import shlex
from dataclasses import fields
from functools import cache

_ARGUMENT = re.compile(r"(?<![^\s(])`([a-z_]+)(?:=([^`]*))?`(?=[\s,;:.)]|$)")
_OTHERWISE = {
    "cluster": "--cluster",
    "color": "--layer",
    "confidence": "--confidence",
    "convention": "--vectors",
    "device": "--adapter",
    "color_in": "--color-in",
    "fps_in": "--fps-in",
    "inputs": "--inputs",
    "nature": "--nature",
    "passes": "--passes",
    "form": "--as",
    "rounds": "--rounds",
    "seconds": "--seconds",
    "sharp": "--sharp",
    "max_displace": "--max-displace",
    "space": "--from",
    "truth": "--truth",
    "try": "--try",
    "workers": "--workers",
}
"""Arguments whose options have other names, or are those of one command."""


@cache
def options() -> dict[str, str]:
    """The option that each argument is set by; the settings' fields have both names."""
    from ..settings import OutputSettings, SceneSettings
    from ..settings.color import option_name
    from ..settings.groups import GROUPS

    groups = *GROUPS.values(), OutputSettings, SceneSettings
    return {f.name: option_name(f.name) for group in groups for f in fields(group)} | _OTHERWISE


def as_options(message: str) -> str:
    """`skip_missing=True` between backticks -> --skip-missing, `max_mb=900` -> --max-mb 900.

    Names of files stay as they are: an argument stands alone, between backticks.
    """
    return _ARGUMENT.sub(_option, message) if "`" in message else message


def _option(match: re.Match[str]) -> str:
    name, value = match[1], (match[2] or "").strip("'\"")
    option = options().get(name)
    if option is None:
        return match[0]
    return option if value in ("", "True") else f"{option} {shlex.quote(value)}"
