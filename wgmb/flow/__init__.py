"""Motion from pictures alone, for frames that have no vectors."""

from .flow import Flow
from .shot import Shot

__all__ = ["Flow", "Shot"]
