"""Interlaced frames as pictures: two of each, one for either field."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from fractions import Fraction
from typing import cast

import av
from av.error import BlockingIOError, EOFError
from av.filter import Graph


class Deinterlaced:
    """Makes two pictures of an interlaced frame (bwdif)."""

    def __init__(self, size: tuple[int, int], pixels: str, base: Fraction):
        self._base, self._count = base, 0
        self._waiting: deque[int] = deque()
        graph = Graph()
        form = av.VideoFormat(pixels, *size)
        source = graph.add_buffer(width=size[0], height=size[1], format=form, time_base=base)
        bwdif = graph.add("bwdif", "mode=send_field:parity=auto:deint=all")
        source.link_to(bwdif)
        bwdif.link_to(graph.add("buffersink"))
        graph.configure()
        self._graph = graph

    def of(
        self, frame: av.VideoFrame | None, number: int = 0
    ) -> Iterator[tuple[int, av.VideoFrame]]:
        """The pictures that are ready once `frame`, of that number, is there; None: the rest."""
        if frame is not None:
            frame.pts, frame.time_base = self._count, self._base
            self._count += 1
            self._waiting += (2 * number, 2 * number + 1)
        self._graph.push(frame)
        with contextlib.suppress(BlockingIOError, EOFError):
            while True:
                field = cast(av.VideoFrame, self._graph.pull())
                yield self._waiting.popleft(), field
