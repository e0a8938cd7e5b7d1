"""The methods. Each is one WGSL file and one small class; all are called alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from .accumulate import Accumulate
from .distributed import Distributed
from .gather import Gather
from .reproject import Reproject
from .tap import Tap
from .tiles import Tiles

if TYPE_CHECKING:
    import wgpu

    from ..pipeline import Inputs


class Method(Protocol):
    """What a method is: a name, the inputs it needs, and how it is recorded."""

    name: str
    """Also the stem of its Python file, its WGSL file and its twin in the tests."""
    needs: frozenset[str]
    """Of "color", "motion", "depth", "scene"."""
    uses: frozenset[str]
    """What it takes if it is there: "neighbours", "depth"."""

    def encode(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: wgpu.GPUTextureView
    ) -> None:
        """Record its passes; never submit, never wait."""
        ...


_CLASSES = (Tap, Tiles, Gather, Reproject, Accumulate, Distributed)
METHODS: dict[str, type] = {m.name: m for m in _CLASSES}
