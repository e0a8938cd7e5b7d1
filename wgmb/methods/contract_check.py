"""Checks a class against the contract of a method, so that a mistake in it is one clear line."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from dataclasses import is_dataclass
from typing import Any, get_args

from ..errors import InputError
from ..extent import Spread
from .options import MethodOptions, options_of

NEEDS = frozenset({"color", "motion", "depth", "scene"})
USES = frozenset({
    "neighbours", "depth", "normal", "progress",
    "diffuse_light", "diffuse_color", "glossy_light", "glossy_color",
})  # fmt: skip
_RESERVED = """
adapter against alpha also antialias article as begin bits budget camera chunk cluster codec
color_in compression cone_peak cone_rate confidence config curve cuts depth depth_kind device
diffuse_color diffuse_light display dolly duplicates encoder end experiment far flow
flow_quality fps fps_in frames from from_ glossy_color glossy_light help help_all highlights
holdout inputs interface jitter job keep ladder layer layers log_json longest_pause look
max_blur max_displace max_mb method methods motion nature next normal number object_id
object_layer object_motion ocio openjd options orbit output outside overwrite pan passes pattern
peer phase pitch prev program progress quality quiet reference report resume rolling
rolling_duration rounds samples save scale scan scene seconds set settings sharp shutter
shutters size skip_missing slurm source speed streams time to_next to_prev truth try twos
vector_flip vector_layer vector_mask vector_offset vector_scale vectors verbose version view
view_transform what window workers wrap
"""
RESERVED = frozenset(_RESERVED.split())
"""Names of arguments and options of wgmb, which no option of a method may have."""


def check_contract(method: object) -> None:
    """InputError unless `method` is a class that keeps the contract of contract.Method."""
    if not inspect.isclass(method):
        raise InputError(f"a method must be a class, got {method!r}")
    with_name = f"the method {method.__name__}"
    name = getattr(method, "name", None)
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError(f"{with_name} needs a name of small letters and digits, got {name!r}")
    for field, known in (("needs", NEEDS), ("uses", USES)):
        _check_words(with_name, field, getattr(method, field, None), known)
    if not method.needs:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(f"{with_name}: needs is empty; a method needs color, or a scene")
    spread = getattr(method, "spread", "along")
    if spread not in get_args(Spread):
        known = ", ".join(get_args(Spread))
        raise InputError(f"{with_name}: spread must be one of {known}, got {spread!r}")
    _check_calls(with_name, method)
    _check_options(with_name, getattr(method, "Options", None))


def _check_words(with_name: str, field: str, words: object, known: Iterable[str]) -> None:
    if not isinstance(words, (set, frozenset)):
        raise InputError(f"{with_name} needs {field}, a frozenset of words, got {words!r}")
    if strange := sorted(map(str, words - set(known))):
        every = ", ".join(sorted(known))
        raise InputError(f"{with_name}: {field} has {strange[0]}; known are {every}")


def _check_calls(with_name: str, method: type) -> None:
    """InputError unless the class can be made and can record, as the pipeline calls it."""
    calls = {
        "__init__(device, options, *, output)": (method, (0, 0), {"output": ""}),
        "encode(encoder, inputs, output)": (getattr(method, "encode", None), (0, 0, 0, 0), {}),
    }
    for written, (function, arguments, keywords) in calls.items():
        try:
            inspect.signature(function).bind(*arguments, **keywords)  # pyright: ignore
        except (TypeError, ValueError) as error:
            raise InputError(f"{with_name} needs {written}: {error}") from None


def _check_options(with_name: str, options: Any) -> None:
    if not (inspect.isclass(options) and issubclass(options, MethodOptions)):
        raise InputError(f"{with_name} needs Options, a class of MethodOptions")
    if not is_dataclass(options) or not options.__dataclass_params__.frozen:  # pyright: ignore
        raise InputError(f"{with_name}: Options is not a frozen dataclass")
    try:
        declared = options_of(options)
        options()  # its defaults are values that it takes
    except Exception as error:  # an annotation is any expression
        raise InputError(f"{with_name}: Options: {error}") from None
    for name, option in declared.items():
        if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or name in RESERVED:
            raise InputError(f"{with_name}: no option can have the name {name}")
        if option.kind not in (str, bool, int, float):
            raise InputError(f"{with_name}: option {name} is of {option.kind}, not of a number, "
                             "bool or Literal")  # fmt: skip
        if option.kind is str and not option.choices:
            raise InputError(f"{with_name}: option {name} is a text, which needs a Literal")
        if option.kind is bool and option.default is not False:
            raise InputError(
                f"{with_name}: option {name} is on by default; a switch must be off by default"
            )
