"""Plain values, as files hold them, become the settings that they were."""

from __future__ import annotations

import math
import types
import typing
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from ..errors import InputError

_Kind = TypeVar("_Kind")


def restored(kind: type[_Kind], values: dict[str, Any]) -> _Kind:
    """A dataclass from the values of all its fields; InputError where one is missing or wrong."""
    hints, made = typing.get_type_hints(kind), {}
    for one in fields(kind):  # pyright: ignore[reportArgumentType]
        if one.name not in values:
            raise InputError(f"{one.name} is missing")
        made[one.name] = typed(one.name, values[one.name], hints[one.name])
    return kind(**made)


def typed(name: str, value: object, hint: Any) -> Any:
    """`value`, from TOML or JSON, as a setting of type `hint` has it; InputError if it cannot be.

    A whole number may stand for a float, a list for a tuple, a table for a dataclass; numbers are
    finite.
    """
    union = typing.get_origin(hint) in (typing.Union, types.UnionType)
    for one in typing.get_args(hint) if union else (hint,):
        try:
            return _as(value, one)
        except (TypeError, ValueError, OverflowError):
            continue
    raise InputError(f"{name} cannot be {_described(value)}")


def _as(value: Any, hint: Any) -> Any:
    """`value` as one type that is no union; an exception if it is of another."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is Literal:
        if isinstance(value, str) and value in arguments:
            return value
    elif typing.get_origin(hint) is tuple and isinstance(value, list):
        if arguments[-1] is ...:
            return tuple(_as(item, arguments[0]) for item in value)
        return tuple(_as(item, one) for item, one in zip(value, arguments, strict=True))
    elif hint is float and type(value) in (int, float):
        if math.isfinite(float(value)):
            return value
    elif hint is int and type(value) is int:
        if abs(value) < 2**63:  # as TOML has them
            return value
    elif hint in (bool, str) and type(value) is hint:
        return value
    elif hint is Path and isinstance(value, str):
        return Path(value)
    elif hint is types.NoneType and value is None:
        return None
    elif is_dataclass(hint) and isinstance(value, dict):
        return restored(hint, value)
    raise TypeError


def _described(value: object) -> str:
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or lists as deep
        return f"this {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:60]}..."
