"""Places of a video at which settings are tried."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from fractions import Fraction

from ..video import VideoPlan


def places(plan: VideoPlan, count: int, length: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Begin and end in the input [s] of parts of a `length`, evenly spaced in the selected part.

    The whole of it if the parts would meet.
    """
    reader, clock = plan.reader, plan.clock
    begin = reader.times[0] if clock.first is None else max(clock.first, reader.times[0])
    end = reader.until if clock.end is None else min(clock.end, reader.until)
    if end - begin <= count * length:
        return [(begin, end)]
    middles = (begin + (end - begin) * (2 * k + 1) / (2 * count) for k in range(count))
    return [(middle - length / 2, middle + length / 2) for middle in middles]
