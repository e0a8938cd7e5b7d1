"""The pictures of a video in any order, as they are coded, and as arrays of linear light."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..color.coding import CodedPicture
from ..gpu.textures import TexturePool
from ..threads import ahead
from .planes import Planes
from .read.reader import VideoReader

_READ_AHEAD = 2  # coded pictures
_NEAR = 48  # pictures that are decoded rather than sought


class CodedPictures:
    """Decodes a video's pictures, in any order."""

    def __init__(self, reader: VideoReader):
        self._reader = reader
        self._going: Iterator[tuple[int, CodedPicture]] = iter(())
        self._reached = len(reader)  # number of the picture that `_going` gave last
        self._pending: tuple[int, CodedPicture] | None = None

    def at(self, number: int) -> CodedPicture | None:
        """One picture by its number; None if it cannot be decoded. Quick for the next ones."""
        if not self._reached < number <= self._reached + _NEAR:
            self._going, self._pending = self._reader.pictures(number), None
        while True:
            found = self._pending or next(self._going, None)
            self._pending = None
            if found is None:
                self._reached = len(self._reader)
                return None
            if found[0] > number:
                self._pending, self._reached = found, number
                return None
            self._reached = found[0]
            if found[0] == number:
                return found[1]


class VideoPictures:
    """Decodes a video's pictures, and makes them linear on the GPU, by `planes`."""

    def __init__(self, reader: VideoReader, planes: Planes):
        self.reader, self.planes = reader, planes
        self._images, self._coded = TexturePool(planes.device), CodedPictures(reader)

    def light(self, picture: CodedPicture) -> np.ndarray:
        """(height, width, 3, or 4 with alpha) float16, linear, premultiplied."""
        encoder = self.planes.device.create_command_encoder(label="decode")
        light = self._images.texture("light", picture.size, "rgba16float")
        self.planes.decode(encoder, picture, light.create_view())
        color = self._images.download(encoder, light)
        return color if picture.coding.alpha else color[..., :3]

    def read(self, first: int = 0, last: int | None = None) -> Iterator[tuple[int, np.ndarray]]:
        """The pictures from number `first` to `last`, both included, each with its number.

        They are decoded in a thread of its own. Those that cannot be decoded are left out.
        """
        for number, picture in ahead(self.reader.pictures(first, last), _READ_AHEAD):
            yield number, self.light(picture)

    def at(self, number: int) -> np.ndarray | None:
        """One picture by its number; None if it cannot be decoded. Quick for the next ones."""
        coded = self._coded.at(number)
        return None if coded is None else self.light(coded)
