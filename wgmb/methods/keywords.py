"""Names of the methods and of their options, for the type checkers of users' programs.

The options themselves, with ranges and help, are those of each method's `Options`; a test compares.
"""

from __future__ import annotations

from typing import Literal, TypedDict

MethodName = Literal[
    "tap", "tiles", "gather", "fusion", "reproject", "accumulate", "distributed", "volume"
]
Curve = Literal["box", "trapezoid", "triangle", "cosine", "gaussian"]


class MethodKeywords(TypedDict, total=False):
    """The options of all methods; each method takes its own."""

    path: Literal["curved", "straight", "five"]
    variant: Literal["shutter", "published", "even", "slices"]
    show: Literal["color", "tiles", "confidence", "count"]
    shading: Literal["auto", "off", "passes", "frames"]
    where: Literal["everywhere", "edges"]
    reach: int
    weights: Literal["normalised", "published"]
    alpha_front: float
    alpha_back: float
    tau: float
    facing: bool
    depth_test: bool
    splat: Literal["point", "line"]
    seed: int


class BlurKeywords(MethodKeywords, total=False):
    """Options of a Blur that all methods take, beside those of each."""

    jitter: float
    max_blur: float | None
