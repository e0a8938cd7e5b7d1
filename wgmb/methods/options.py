"""A method's own options: a frozen dataclass, read by the command line and the viewer.

Each field is annotated with its type, its range where it is a number, and its help:

    variant: Annotated[Literal["even", "published"], "even: ...; published: as printed."] = "even"
"""

from __future__ import annotations

import math
import typing
from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from functools import cache
from types import MappingProxyType, UnionType
from typing import Annotated, Any, Literal

from ..errors import InputError, check_choice


@dataclass(frozen=True)
class Range:
    """The numbers that an option takes: `low` to `high`, without `low` where it is `above`."""

    low: float
    high: float
    above: bool = False

    def __contains__(self, value: float) -> bool:
        return (self.low < value if self.above else self.low <= value) and value <= self.high

    def __str__(self) -> str:
        if self.above:
            return f"over {self.low:g} and at most {self.high:g}"
        return f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Option:
    """One option: its values, its default and its help."""

    name: str
    kind: type
    """str (one of `choices`), bool, int or float."""
    default: Any
    choices: tuple[str, ...]
    range: Range | None
    help: str

    def check(self, value: object) -> None:
        """InputError unless the option can be `value`."""
        if value is None and self.default is None:
            return
        if self.choices:
            check_choice(self.name, value, self.choices)
            return
        if self.kind is bool or isinstance(value, bool):
            if not (self.kind is bool and isinstance(value, bool)):
                wanted = "true or false" if self.kind is bool else "a number"
                raise InputError(f"{self.name} must be {wanted}, got {value!r}")
            return
        try:
            right = math.isfinite(value) and (self.kind is float or value == int(value))  # pyright: ignore
        except (TypeError, ValueError):
            right = False
        if not right or (self.range is not None and value not in self.range):  # pyright: ignore
            expected = "a whole number" if self.kind is int else "a number"
            raise InputError(f"{self.name} must be {self.range or expected}, got {value!r}")


@dataclass(frozen=True, kw_only=True)
class MethodOptions:
    """Base of every method's `Options`, and those of a method that has none."""

    def __post_init__(self) -> None:
        for option in options_of(type(self)).values():
            option.check(getattr(self, option.name))


@cache
def options_of(options: type[MethodOptions]) -> Mapping[str, Option]:
    """The options of a method's `Options` by name, in the order in which they are written."""
    hints = typing.get_type_hints(options, include_extras=True)
    return MappingProxyType({f.name: _option(f, hints[f.name]) for f in fields(options)})


def _option(field: Field[Any], hint: Any) -> Option:
    kind, *notes = typing.get_args(hint) or (hint,)
    if isinstance(kind, UnionType):  # ... | None
        kind = next(k for k in typing.get_args(kind) if k is not type(None))
    choices = typing.get_args(kind) if typing.get_origin(kind) is Literal else ()
    range_ = next((note for note in notes if isinstance(note, Range)), None)
    help_ = next((note for note in notes if isinstance(note, str)), None)
    if typing.get_origin(hint) is not Annotated or help_ is None:
        raise InputError(f"option {field.name} must be Annotated with its type and its help")
    return Option(field.name, str if choices else kind, field.default, choices, range_, help_)
