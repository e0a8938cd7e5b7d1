"""The defaults of a video in one table: who finds its motion, and which method blurs it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import wgpu

from .. import gpu
from ..errors import InputError
from ..extras import is_installed
from ..methods.keywords import MethodName
from ..shots.motion import MotionSource

FlowName = Literal["auto", "search", "dis", "none"]
FlowQuality = Literal["best", "fast", "draft"]


class Recipe(NamedTuple):
    """A source of motion, and the method that blurs by it."""

    flow: FlowName
    "The setting `flow` that does the same; there is none for inverse search on the GPU: auto."
    quality: FlowQuality | None
    "None: as the setting `flow_quality` says."
    method: MethodName
    "The method, if none is set."
    has_edges_gathered: bool
    "Pictures with edges of motion are blurred with gather, if no method is set."
    words: str
    "The source in words."
    make: Callable[[FlowQuality, wgpu.GPUDevice], MotionSource | None]


def by_place() -> MotionSource:
    """Dense inverse search by OpenCV, made finer and searched in blocks where it is needed."""
    from ..flow.dis.by_place import ByPlace  # only where it is needed

    return ByPlace()


def _on_gpu(quality: FlowQuality, device: wgpu.GPUDevice) -> MotionSource:
    from ..flow.dense import DenseInverseSearch

    return DenseInverseSearch(device=device)


def _dis(quality: FlowQuality, device: wgpu.GPUDevice) -> MotionSource:
    from ..flow.dis import Dis

    return Dis(quality)


def _search(quality: FlowQuality, device: wgpu.GPUDevice) -> MotionSource:
    from ..flow import Flow

    return Flow(quality=quality, device=device)


GPU, OPENCV, ALONE = "auto on a GPU", "auto with OpenCV", "auto with neither"
RECIPES = {
    GPU: Recipe("auto", None, "gather", True,
                "dense inverse search on the GPU, and in blocks where something moves fast",
                _on_gpu),
    OPENCV: Recipe("dis", "fast", "tap", True,
                   "dense inverse search (fast, because there is no GPU); finer, and searched in "
                   "blocks, where something moves fast", lambda *_: by_place()),
    ALONE: Recipe("search", "draft", "gather", False,
                  "search (draft, because there is no GPU)", _search),
    "search": Recipe("search", None, "gather", False, "search", _search),
    "dis": Recipe("dis", None, "tap", False, "dense inverse search", _dis),
    "none": Recipe("none", None, "tap", False, "none: pictures are averaged", lambda *_: None),
}  # fmt: skip
METHODS_BY_FLOW = {one.flow: one.method for one in RECIPES.values()}


def recipe_of(flow: FlowName, quality: FlowQuality, device: wgpu.GPUDevice) -> Recipe:
    """The recipe for these settings on a device.

    InputError for a draft of dense inverse search. A draft of "auto" is a search.
    """
    if flow == "dis" and quality == "draft":
        raise InputError("`flow_quality` draft is for `flow` search; dis is best or fast")
    if flow != "auto" or quality == "draft":
        return RECIPES["search" if flow == "auto" else flow]
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return RECIPES[GPU]
    return RECIPES[OPENCV if is_installed("cv2") else ALONE]
