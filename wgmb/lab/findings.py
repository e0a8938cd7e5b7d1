"""A paper's findings in words."""

from collections.abc import Callable
from typing import Any


def about(experiment: Callable[..., Any]) -> str:
    """The docstring of an experiment, as one paragraph."""
    return " ".join((experiment.__doc__ or "").split())


def holds(it: object) -> str:
    """The verdict on a finding."""
    return "holds" if it else "does not hold"
