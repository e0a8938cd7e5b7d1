"""The bindings of match.wgsl: a frame's features, and those of the frames it is compared with."""

from __future__ import annotations

import wgpu

from ..gpu import wgsl
from .passes import Bindings, FlowPasses
from .views import BESIDE, Views

FINEST_STRIDE, STRIDE = 1.0, 2.0  # between the samples of a patch [px]: finest level, coarser
MOST_SHADE = 0.08  # difference in grey that may be the light's, on coarser levels; 0 on the finest
FAR_PRICE = 0.03  # for being hidden in the near frame, if the far one is two frames away


def matched(
    passes: FlowPasses, views: Views, features: dict[int, list[wgpu.GPUTexture]], level: int
) -> Bindings:
    """Bindings by their names, and the override `VIEWS`; `features`: levels by frame number."""
    far = views.near if views.far is None else views.far
    view = passes.uniform(
        "match.wgsl",
        "View",
        far_factor=views.factor,
        far_price=FAR_PRICE if views.factor == BESIDE else 0.0,
        stride=STRIDE if level else FINEST_STRIDE,
        most_shade=MOST_SHADE if level else 0.0,
    )
    return {
        "constants": {"VIEWS": int(wgsl.load("flow/match.wgsl").constant(views.kind))},
        "view": view,
        "linear": passes.linear,
        "here": features[views.here][level],
        "near": features[views.near][level],
        "far": features[far][level],
    }
