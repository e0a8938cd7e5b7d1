"""Frames of a GIF: 256 colours each, dithered, on a clock of hundredths of a second."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
from av.error import BlockingIOError, EOFError
from av.filter import Graph

from ...errors import InputError

TICK = Fraction(1, 100)  # of a GIF's clock [s]
_RATES = Fraction(1, 600), Fraction(50)  # a delay has 16 bits; under two ticks it counts as ten


def check_rate(path: Path, fps: Fraction, rates: tuple[Fraction, Fraction] = _RATES) -> None:
    """InputError for a rate that is not within `rates`, by default those that a GIF can have."""
    least, most = rates
    if not least <= fps <= most:
        fits = f"; `fps={float(fps / math.ceil(fps / most)):g}` fits" if fps > most else ""
        raise InputError(
            f"output {path}: {path.suffix} takes {least} to {most} frames per second, "
            f"got {float(fps):g}{fits}"
        )


class Palettes:
    """Gives every frame the 256 colours that suit it, and dithers."""

    def __init__(self, width: int, height: int):
        self._graph = graph = Graph()
        pixels = av.VideoFormat("rgb24", width, height)
        source = graph.add_buffer(width=width, height=height, format=pixels, time_base=TICK)
        copies = graph.add("split")
        colors = graph.add("palettegen", "stats_mode=single")
        painted = graph.add("paletteuse", "new=1:dither=floyd_steinberg")
        source.link_to(copies)
        copies.link_to(painted, 0, 0)
        copies.link_to(colors, 1, 0)
        colors.link_to(painted, 0, 1)
        painted.link_to(graph.add("buffersink"))
        graph.configure()

    def of(self, frame: av.VideoFrame | None, tick: int = 0) -> Iterator[tuple[av.VideoFrame, int]]:
        """The frames that are ready once `frame` (rgb24) is there, with their ticks; None: all."""
        if frame is not None:
            frame.pts, frame.time_base = tick, TICK
        self._graph.push(frame)
        with contextlib.suppress(BlockingIOError, EOFError):
            while True:
                painted = cast(av.VideoFrame, self._graph.pull())
                assert painted.pts is not None
                yield painted, painted.pts
