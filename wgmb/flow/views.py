"""Frames with which a frame is compared, and the continuation of its flow to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

AROUND, BESIDE = -1.0, 2.0  # displacement to the far frame over that to the near one


@dataclass(frozen=True)
class Views:
    """Numbers of a frame and of the frames that it is compared with."""

    here: int
    near: int
    far: int | None
    factor: float

    @property
    def kind(self) -> str:
        """The name in match.wgsl."""
        if self.far is None:
            return "ONE"
        return "AROUND" if self.factor == AROUND else "BESIDE"

    @property
    def neighbours(self) -> tuple[int, ...]:
        """The frames of these that are direct neighbours."""
        return (self.near,) if self.far is None or self.factor == BESIDE else (self.near, self.far)

    def leads_by(self, other: int) -> float:
        """1 if the flow itself leads to the neighbour `other`, -1 if its continuation does."""
        return 1.0 if other == self.near else -1.0


def views_of(number: int, is_there: Callable[[int], bool]) -> Views | None:
    """Both neighbours of a frame; at an end the two nearest frames on one side, or only one.

    None if the frame is alone.
    """
    before, after = is_there(number - 1), is_there(number + 1)
    if before and after:
        return Views(number, number + 1, number - 1, AROUND)
    if not before and not after:
        return None
    step = 1 if after else -1
    second = number + 2 * step
    return Views(number, number + step, second if is_there(second) else None, BESIDE)
