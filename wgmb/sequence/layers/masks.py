"""Masks from layers, Cryptomattes and image files, and how several of them become one."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...color.srgb import srgb
from ...errors import InputError, size_text
from ...files import bounded
from ...io import exr, stills
from ...io.frame_numbers import frame_path, in_view, is_pattern, numbers_on_disk, readable
from ..data_windows import laid
from ..frame_file import FrameFile, read
from . import cryptomatte
from .names import Channels, grey, layers, one_channel

_AMOUNT = re.compile(r"(.+):([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")


@dataclass
class Masks:
    """The masks of a sequence, as Passes has them: holdouts, and scales of motion."""

    held_out: Sequence[str]
    scales: Sequence[str]
    patterns: Sequence[str]  # of the frames' files
    numbers: Sequence[int]
    max_mb: float
    of_views: Callable[[str], list[Path]]  # a pattern, for each of the views that %V stands for
    _met: dict[str, bool] = field(default_factory=dict)  # masks by number: if a frame has them
    _in_pixels: dict[str, bool] = field(default_factory=dict)  # masks by name: if a pixel has them
    _missing: dict[str, InputError | None] = field(default_factory=dict)  # why, by mask

    @property
    def every(self) -> list[str]:
        """All masks, without amounts."""
        return list(dict.fromkeys([*self.held_out, *(with_amount(s)[0] for s in self.scales)]))

    @property
    def absent(self) -> list[str]:
        """Masks by index or id that no frame read so far has."""
        return [mask for mask in self.every if self._met.get(mask) is False]

    @property
    def unseen(self) -> list[str]:
        """Masks by name that manifests list, and no pixel of the frames read so far has."""
        return [mask for mask in self.every if self._in_pixels.get(mask) is False]

    def holdout(self, source: FrameFile) -> np.ndarray | None:
        """(height, width) float32 0..1 of one frame; None without masks."""
        return joined(self._plane(source, mask) for mask in self.held_out)

    def scale(self, source: FrameFile) -> np.ndarray | None:
        """(height, width) float32 of one frame; None without masks."""
        pairs = map(with_amount, self.scales)
        return product((self._plane(source, mask), amount) for mask, amount in pairs)

    def files(self, number: int) -> list[Path]:
        """The image files among the masks of frame `number`."""
        masks = [mask for mask in self.every if is_file(mask, number)]
        return [frame_path(one, number) for mask in masks for one in self.of_views(mask)]

    def manifests(self, number: int) -> list[Path]:
        """The files beside frame `number` that hold the manifests which its masks need."""
        found = []
        for mask in self._by_name:
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                crypto = cryptomatte.find(self._attributes(number), mask.partition("=")[0])
                path = cryptomatte.sidecar(crypto, self._folders(number)) if crypto else None
                found += [path] if path else []
        return found

    def check(self) -> None:
        """InputError where a mask has no file, or names what no Cryptomatte has."""
        for mask in self.every:
            if is_file(mask):
                for path in self.of_views(mask):
                    if is_pattern(path):
                        numbers_on_disk(path)
                    elif not readable(path):
                        raise bounded.missing(path)
        for mask in self._by_name:
            if error := self._why_missing(mask):
                raise error

    def take_names_as_found(self) -> None:
        """Some frame's Cryptomatte has every name, as another run over all frames has found."""
        self._missing = dict.fromkeys(self._by_name)

    @property
    def _by_name(self) -> list[str]:
        """Masks that may name an object of a Cryptomatte."""
        layered = [mask for mask in self.every if "=" in mask and not is_file(mask)]
        return [mask for mask in layered if not cryptomatte.is_id(mask.partition("=")[2])]

    def _why_missing(self, mask: str) -> InputError | None:
        """The error of the first manifest if none has the name of a mask, else None."""
        if mask not in self._missing:
            self._missing[mask] = self._search_manifests(mask)
        return self._missing[mask]

    def _search_manifests(self, mask: str) -> InputError | None:
        layer, _, value = mask.partition("=")
        first: InputError | None = None
        for number in self.numbers:
            try:
                crypto = cryptomatte.find(self._attributes(number), layer)
            except (InputError, OSError):  # its turn to fail comes
                continue
            if crypto is None:  # an index layer, or a mistake that reading the frame tells
                return first
            try:
                cryptomatte.ids(crypto, value, self._folders(number))
            except InputError as error:
                first = first or error
            else:
                return None
        return first

    def _attributes(self, number: int) -> dict[str, Any]:
        """The attributes of a frame's EXR files, without their pixels."""
        found: dict[str, Any] = {}
        for pattern in self.patterns:
            path = frame_path(pattern, number)
            if path.suffix.lower() == ".exr":
                for part in exr.read(path, header_only=True).parts:
                    found = {**part.attributes, **found}
        return found

    def _folders(self, number: int) -> list[Path]:
        return list(dict.fromkeys(frame_path(p, number).parent for p in self.patterns))

    def _plane(self, source: FrameFile, mask: str) -> np.ndarray:
        if is_file(mask, source.number):
            return self._of_file(source, frame_path(in_view(mask, source.view), source.number))
        folders = self._folders(source.number)
        try:
            plane = of_layer(source.channels, source.attributes, mask, folders)
        except cryptomatte.NoSuchNameError:
            if self._why_missing(mask):
                raise
            return np.zeros(source.size[::-1], np.float32)  # some manifests list what is seen
        by_number = asks_by_number(source.attributes, mask)
        met = self._met if by_number else self._in_pixels
        if "=" in mask and not met.get(mask):
            met[mask] = bool(plane.any())
        return plane

    def _of_file(self, source: FrameFile, file: Path) -> np.ndarray:
        window, display = source.data_window, source.display_window
        if file.suffix.lower() == ".exr":
            sources = read([file], source.number, None, self.max_mb)
            mask = next((one for one in sources if one.view == source.view), sources[0])
            plane = grey(mask.channels).astype(np.float32)
            if mask.display_window == display:
                return laid(plane, mask.data_window, window)
        else:
            light = stills.read(file, max_mb=self.max_mb)
            plane = srgb(light[..., 0])  # grey values as painted
        if plane.shape[::-1] == source.whole:
            return laid(plane, display, window)
        if plane.shape[::-1] != source.size:
            raise InputError(
                f"{file} must be {size_text(source.whole)} like the image, got {size_text(plane)}"
            )
        return plane


def is_file(mask: str, number: int = 0) -> bool:
    """Return True if a mask is an image file or a pattern of them, and not a layer."""
    return frame_path(mask, number).suffix.lower() in (".exr", *stills.SUFFIXES)


def with_amount(scale: str) -> tuple[str, float | None]:
    """`LAYER=VALUE:AMOUNT` or `FILE:AMOUNT` -> the mask and the amount; None if there is none."""
    m = _AMOUNT.fullmatch(scale)
    if m is None or not ("=" in m[1] or is_file(m[1])):
        return scale, None
    return m[1], float(m[2])


def joined(planes: Iterable[np.ndarray]) -> np.ndarray | None:
    """Union of the masks: 1 - product of (1 - mask); None if there are none."""
    whole: np.ndarray | None = None
    for plane in planes:
        if whole is not None:
            plane = 1 - (1 - np.clip(whole, 0, 1)) * (1 - np.clip(plane, 0, 1))
        whole = plane
    return whole


def product(factors: Iterable[tuple[np.ndarray, float | None]]) -> np.ndarray | None:
    """The product of the masks' factors; None if there are none.

    A mask with an amount has the factor 1 + (amount - 1) * mask, one without is the factor.
    """
    whole: np.ndarray | None = None
    for plane, amount in factors:
        factor = plane if amount is None else 1 + np.float32(amount - 1) * plane
        whole = factor if whole is None else whole * factor
    return whole


def of_layer(
    channels: Channels, attributes: Mapping[str, Any], wanted: str, folders: Iterable[Path] = ()
) -> np.ndarray:
    """A mask 0..1 from `LAYER` or `LAYER=VALUE`.

    A grey layer is the mask itself. With a number for VALUE, the pixels of the layer that
    hold it (object or material index). Where LAYER is a Cryptomatte, VALUE is what
    `cryptomatte.ids` takes, and the mask the coverage of these objects together.
    """
    layer, _, value = wanted.partition("=")
    crypto = cryptomatte.find(attributes, layer)
    if crypto is not None:
        return cryptomatte.coverage(channels, crypto, cryptomatte.ids(crypto, value, folders))
    plane = np.asarray(channels[one_channel(layers(channels), layer, "layer")], np.float32)
    if not value:
        return np.clip(plane, 0, 1)
    try:
        number = float(value)
    except ValueError:
        raise InputError(
            f"layer {layer!r} is not a Cryptomatte, so {value!r} must be a number"
        ) from None
    return (np.abs(plane - number) < 0.5).astype(np.float32)


def asks_by_number(attributes: Mapping[str, Any], wanted: str) -> bool:
    """Return True for `LAYER=VALUE` with an index or an id, which no manifest can tell wrong."""
    layer, _, value = wanted.partition("=")
    crypto = cryptomatte.find(attributes, layer)
    return bool(value) and (crypto is None or cryptomatte.is_id(value))
