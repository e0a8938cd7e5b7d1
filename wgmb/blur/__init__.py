"""The methods. Each is one WGSL file and one small class; all are called alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from .accumulate import Accumulate
from .distributed import Distributed
from .fusion import Fusion
from .gather import Gather
from .reproject import Reproject
from .tap import Tap
from .tiles import Tiles
from .volume import Volume

if TYPE_CHECKING:
    import wgpu

    from ..pipeline import Inputs


class Method(Protocol):
    """What a method is: a name, the inputs it needs, and how it is recorded.

    It may also have `samples`, its own default number of them, and `adaptive`: it can take as
    many samples as each pixel's streak needs (ADAPTIVE of wgsl/common/shutter.wgsl); `confidence`,
    what the four channels of its `show="confidence"` are called; `most_in_software`: the most
    samples it takes without a GPU, if not as many as with one.
    """

    name: str
    """Also the stem of its Python file, its WGSL file and its twin in the tests."""
    needs: frozenset[str]
    """Of "color", "motion", "depth", "scene"."""
    uses: frozenset[str]
    """What it takes if it is there: "neighbours", "depth", "normal"; "progress": its samples may
    be recorded bit by bit."""

    def encode(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: wgpu.GPUTextureView
    ) -> None:
        """Record its passes; never submit, never wait."""
        ...


_ALL = (Tap, Tiles, Gather, Fusion, Reproject, Volume, Accumulate, Distributed)
METHODS: dict[str, type] = {m.name: m for m in _ALL}
