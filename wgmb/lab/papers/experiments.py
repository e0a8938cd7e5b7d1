"""The papers' own experiments, repeated to check their findings.

Each takes a Laboratory, an empty Report and a picture size, and fills the report.
"""

from __future__ import annotations

from collections.abc import Callable

from ..compare import Laboratory
from ..results import Report
from .chen import chen
from .rosado import rosado
from .taylor import taylor

EXPERIMENTS: dict[str, Callable[[Laboratory, Report, tuple[int, int]], None]] = {
    "taylor": taylor,
    "chen": chen,
    "rosado": rosado,
}
