"""The laws of a blur method as tests, for packages that bring a method of their own.

A class of tests inherits MethodLaws, or `pytest -p wgmb.testing --pyargs wgmb.testing.laws
--wgmb-method NAME` runs them over an installed method.
"""

from __future__ import annotations

from ..extras import needed_by

with needed_by("wgmb.testing", "testing"):
    import pytest

pytest.register_assert_rewrite("wgmb.testing.laws")

from .laws import MethodLaws  # noqa: E402

__all__ = ["MethodLaws", "pytest_addoption"]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `pytest -p wgmb.testing`."""
    parser.addoption("--wgmb-method", help="method that wgmb.testing.laws tests, by its name")
