"""The contract between the pipeline and a method: its interface and its inputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import wgpu

from .. import gpu
from ..extent import Extent
from ..frame import Frame
from ..gpu_frame.preparation import PreparedFrame
from ..gpu_frame.views import View
from ..scene.gbuffer import SceneOnGpu
from ..shutter import Shutter
from .options import MethodOptions


@dataclass(frozen=True)
class Inputs:
    """Inputs of a method while it records one frame."""

    bindings: gpu.FrameBindings
    samples: int
    number: int
    jitter: float
    shutter: Shutter
    frames: tuple[PreparedFrame, ...]
    """The frame itself, then those neighbours that there are; none for a scene."""
    linear: wgpu.GPUSampler
    even: bool
    """The shutter is a box."""
    auto: bool
    """`samples` is the most a pixel may take."""
    drawn: SceneOnGpu | None
    """The scene, of methods that draw one."""
    progress: tuple[int, int]
    """Samples done before, samples to do now."""
    steps: int | None = None
    """Steps that are recorded, of a method that has `steps`; None: all."""

    @property
    def exposed(self) -> tuple[float, float]:
        """First and last time at which the frame is exposed anywhere [frame intervals].

        The same as exposure_window() of shutter.wgsl for the frame itself.
        """
        x, y, width, height = self.bindings.window
        whole, size = (width, height), self.bindings.size
        late = 0.0
        for delay, first, length, full in zip(self.shutter.delay, (x, y), size, whole, strict=True):
            ends = 0.5 - first / full, (first + length) / full - 0.5
            late += abs(delay) * max(0.5, *ends)
        opens, closes = self.shutter.span
        return opens - late, closes + late

    @property
    def scene(self) -> SceneOnGpu:
        """The scene that is drawn."""
        assert self.drawn is not None, "the method needs a scene"
        return self.drawn

    @property
    def frame(self) -> PreparedFrame:
        """The frame that is blurred."""
        return self.frames[0]


def reach_of(method: Method) -> int:
    """Frames to either side of the one that is blurred that a method takes."""
    return getattr(method, "reach", 1) if "neighbours" in method.uses else 0


def frames_around(frame: Frame, method: Method) -> dict[int, Frame]:
    """The frame and those neighbours that a method takes, by their offsets from it."""
    around: dict[int, Frame] = {0: frame}
    for side in (-1, 1):
        beside = frame
        for offset in range(side, side * (reach_of(method) + 1), side):
            beside = beside.prev if side < 0 else beside.next
            if beside is None or not beside.has >= method.needs:
                break
            around[offset] = beside
    return around


def extent_of(method: Method, shutter: Shutter, max_blur: float | None) -> Extent:
    """Distance over which a method moves colours while the shutter is open."""
    opens, closes = shutter.span
    late = sum(map(abs, shutter.delay))  # twice that of the display window's edges
    return Extent(
        (opens - late, closes + late),
        (opens, closes),
        getattr(method, "spread", "along"),
        max_blur,
        getattr(method, "margin", lambda height: 0),
        getattr(method, "bend", 0.0),
    )


class Method(Protocol):
    """Interface of a method: its name, its inputs, and the recording of its passes.

    It may also have `samples`, its own default number of them, and `adaptive`: it can take as
    many samples as each pixel's streak needs (AUTO of wgsl/common/shutter.wgsl); `quick`, options
    of a cheaper picture, for the viewer while something moves; `confidence`, the names of the
    four channels of its `show="confidence"`; `most_in_software`: the most samples it takes without
    a GPU, if not as many as with one. Of how far it carries colours (see extent.py): `spread`, by
    default "along"; `margin(height)`: pixels that it looks at beyond that, in pictures of this
    height [px]; `bend`: how far its paths leave the parabola through three positions, as a share of
    half the acceleration. Where it uses neighbours, `reach`: frames to either side that it takes,
    by default 1. `steps`: its passes may be recorded in as many steps, each of which has no work
    unless the step before finds some; `finds`: words of buffers, one for each step but the last,
    that are not 0 if there is work for the next one, in the frame that was recorded last, once it
    was run. `repeats(inputs)`: True if it records the same commands for inputs that differ in
    nothing but the number of the frame, so that they need not be recorded again.
    """

    name: str
    """Also the stem of its Python file, its WGSL file and its twin in the tests."""
    needs: frozenset[str]
    """Of "color", "motion", "depth", "scene"."""
    uses: frozenset[str]
    """Optional inputs: "neighbours", "depth", "normal", passes of light; "progress": its samples
    may be recorded in portions."""

    Options: type[MethodOptions]
    """Its own options; see options.py."""

    def __init__(self, device: wgpu.GPUDevice, options: MethodOptions, *, output: str): ...

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record its passes; never submit, never wait."""
        ...
