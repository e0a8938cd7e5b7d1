"""Frames without vectors as the input of a run: blurred as the pictures of a video are."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from ..color.coding import FLOAT, LINEAR, SRGB, CodedPicture, Coding
from ..color.srgb import linear, to_display
from ..errors import InputError
from ..exposure import Cell, cells_in_shot
from ..frame import Frame
from ..gpu.textures import TexturePool
from ..io import limits
from ..output.result import Result
from ..pipeline.blur import Blur
from ..sequence import panorama_signs
from ..sequence.clip import Clip
from ..sequence.data_windows import Placement
from ..sequence.frame_builder import ALONE
from ..sequence.frame_file import FrameFile
from ..shots.motion import MotionSource
from ..shots.reader import REACH, Picture
from ..video.exposures import Exposure, Exposures
from ..video.gpu_frames import VideoFrames
from ..video.holdouts import Holdout
from ..video.planes import Planes
from ..video.thumbnail import Thumbnail, is_cut
from .conversion import RateConversion, RateConversionStages
from .file_sink import BlurredFrame
from .report import UNFOLLOWED
from .stages import ReadFrame, Stages


class ClipPictures:
    """The frames of a clip in one view as pictures in time (see shots.reader.Shots), in any order.

    Each is read when it is asked for, and kept while those around it are.
    """

    tolerance = 0.0

    def __init__(self, clip: Clip, view: str | None, cuts: bool):
        """`cuts`: whether cuts are looked for, beside the known ones."""
        self._clip, self._view, self._is_search = clip, view, cuts
        self._kept: dict[int, Picture[Thumbnail]] = {}
        self._cuts: dict[int, bool] = {}
        self._refused: dict[int, InputError] = {}

    def __getitem__(self, index: int) -> Picture[Thumbnail]:
        """A frame; KeyError where there is none, InputError or OSError where it is not readable."""
        if index not in self._kept:
            if not self._clip.cache.files.is_there(index):
                raise KeyError(index)
            coded = self._read(index)
            for kept in (self._kept, self._cuts):
                for old in [n for n in kept if abs(n - index) > 2 * REACH]:
                    del kept[old]
            self._kept[index] = Picture(float(index), Thumbnail(coded), index)
        return self._kept[index]

    def _read(self, index: int) -> CodedPicture:
        if index in self._refused:
            raise self._refused[index]
        source = self._clip.source(index, self._view)
        height, width = source.rgba.shape[:2]
        stored = source.path.stat().st_size
        try:
            limits.check_held(
                source.path, (width, height), limits.AVERAGED, stored, self._clip.max_mb
            )
        except InputError as error:
            self._refused[index] = error
            self._clip.forget(index)
            raise
        return _coded(source.rgba)

    def neighbour(self, index: int, side: int) -> int | None:
        """The frame before (-1) or after (1) another one, if motion leads there.

        A frame stands for its own interval alone.
        """
        return index + side if self.moves_on(index, index + side) else None

    def moves_on(self, index: int, other: int) -> bool:
        """True if both frames are there, and neither a cut nor a gap lies between them."""
        first, last = min(index, other), max(index, other)
        if last - first > 2 * REACH or self._at(first) is None:
            return False
        return not any(self._begins(n) for n in range(first + 1, last + 1))

    def _begins(self, number: int) -> bool:
        """True if a cut, a gap, or a frame of another size lies before a frame."""
        if number not in self._cuts:
            before, after = self._at(number - 1), self._at(number)
            self._cuts[number] = (
                before is None
                or after is None
                or self._clip.cache.is_known_cut(number, -1)
                or before.coded.size != after.coded.size
                or (self._is_search and is_cut(before, after))
            )
        return self._cuts[number]

    def _at(self, number: int) -> Thumbnail | None:
        try:
            return self[number].content
        except (KeyError, InputError, OSError):  # its turn to fail comes
            return None


def _coded(rgba: np.ndarray) -> CodedPicture:
    """A picture (height, width, 3 or 4), linear, premultiplied: 8 bits where it came from these."""
    opaque = rgba.shape[2] == 3 or bool((rgba[..., 3] == 1).all())
    if opaque and rgba.dtype == np.float32:
        samples = to_display(rgba[..., :3], 8)
        if np.array_equal(_light_of(samples, 8), rgba[..., :3]):
            return CodedPicture(tuple(np.moveaxis(samples, 2, 0).copy()), _samples(8))
    signals = np.ones((*rgba.shape[:2], 4), rgba.dtype)
    signals[..., : rgba.shape[2]] = np.nan_to_num(rgba)  # not finite counts as black
    return CodedPicture((signals,), Coding("rgb", FLOAT, (1, 1), full_range=True, transfer=LINEAR))


def _samples(bits: int) -> Coding:
    return Coding("rgb", bits, (1, 1), full_range=True, transfer=SRGB)


def _light_of(samples: np.ndarray, bits: int) -> np.ndarray:
    """Display values of so many bits as linear light, as stills are read."""
    most = 2**bits - 1
    return linear(np.arange(most + 1, dtype=np.float32) / np.float32(most))[samples]


@dataclass
class _FrameHoldout(Holdout):
    """Holdout of frames: their own masks, or the displays that are found in them."""

    masks: Callable[[int], np.ndarray | None] | None = None

    def of(self, shots: Any, ahead: bool = False) -> Callable[[int], np.ndarray | None]:
        """Masks of pictures, by their indices. `ahead`: see Displays."""
        return super().of(shots, ahead) if self.masks is None else self.masks


@dataclass(frozen=True)
class PictureRoad:
    """The choices of a video, for frames without vectors.

    `at_edges`: blurs those with edges of motion, if not the usual Blur. `displays`: displays stay
    sharp. `cuts`: cuts are looked for. `bits`: of the samples that results become, 0 where they
    stay light.
    """

    motion: MotionSource
    at_edges: Blur | None = None
    displays: bool = True
    cuts: bool = True
    bits: int = 0


class PictureStages(Stages):
    """Frames without vectors: the motion is found in their pictures, as in those of a video.

    A result depends on its number and on the files around it, whatever was asked for before.
    """

    def __init__(
        self,
        clip: Clip,
        blur: Blur,
        road: PictureRoad,
        conversion: RateConversion | None = None,
        all_views: bool = True,
    ):
        super().__init__(clip, blur, all_views=all_views)
        clip.move_by(None)
        self.reach = REACH
        self._road, self._shutter, self._conversion = road, blur.shutter, conversion
        self._at = Fraction(0)
        self._converted = None
        if conversion is not None:
            self._converted = RateConversionStages(clip, blur, conversion, all_views)
            self.numbers = self._converted.numbers
        self._images, self._reading = TexturePool(blur.device), threading.Lock()
        self._views: dict[str | None, tuple[Exposures, ClipPictures, VideoFrames]] = {}

    @property
    def messages(self) -> list[str]:
        """Lines about the holdouts of each view."""
        told = (exposures.holdout.message for exposures, *_ in self._views.values())
        return list(dict.fromkeys(filter(None, told)))

    def made_of(self, number: int) -> dict[str, Any]:
        """Files and facts on which a frame depends."""
        if self._converted is not None:
            return self._converted.made_of(number)
        return super().made_of(number)

    def _read(self, number: int, made_of: dict[str, Any]) -> ReadFrame:
        """The frame that is shown at the time of an output frame."""
        nearest = min(math.floor(self._time(number)), self.clip.on_disk[-1])
        with self._reading:
            return replace(super()._read(nearest, made_of), number=number)

    def _forget(self, number: int) -> None:
        """Nothing: the clip keeps the last frames only."""

    def _prepared(self, source: FrameFile) -> tuple[Frame, None]:
        return self.clip.frame(source, normal=False, light=False), None

    def _blurred(self, read: ReadFrame) -> BlurredFrame:
        self._at = self._time(read.number)
        done = super()._blurred(read)
        if self._conversion is not None:
            done.views = [
                replace(one, source=replace(one.source, number=read.number), is_converted=True)
                for one in done.views
            ]
        return done

    def _time(self, number: int) -> Fraction:
        """The time of an output frame, in numbers of input frames."""
        if self._conversion is None:
            return Fraction(number)
        return self._conversion.at(number, self.numbers[0])

    def _view(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        with self._reading:
            exposures, pictures, textures = self._of(source.view)
            cells = self._cells(source.number, pictures)
            exposure = Exposure(exposures, textures, cells)
            is_coded = pictures[source.number].content.coded.coding.bits == 8
            if self._road.bits and is_coded:
                planes = exposure.coded(_samples(self._road.bits)).planes
                picture = _light_of(np.stack(planes, axis=2), self._road.bits)
            else:
                encoder = exposures.device.create_command_encoder(label="result")
                picture = self._images.download(encoder, exposure.light())
        if source.number in textures.alone:
            self._note(ALONE, source.number)
        if source.number in textures.unfollowed:
            self._note(UNFOLLOWED, source.number)
        if source.rgba.shape[2] == 3:
            picture = picture[..., :3]
        elif picture.shape[2] == 3:
            picture = np.concatenate([picture, np.ones_like(picture[..., :1])], axis=2)
        return Result(source, np.ascontiguousarray(picture, np.float32))

    def _note(self, text: str, number: int) -> None:
        on = self.clip.notes.setdefault(text, [])
        on += [number] if number not in on else []

    def _cells(self, here: int, pictures: ClipPictures) -> list[Cell]:
        if self._shutter.rolling is not None:
            return [Cell(here, 1.0, self._shutter)]

        step = 1.0 if self._conversion is None else float(self._conversion.step)
        return cells_in_shot(here, pictures.neighbour, float, float(self._at), step, self._shutter)

    def _of(self, view: str | None) -> tuple[Exposures, ClipPictures, VideoFrames]:
        """The exposures of a view, with its pictures."""
        if view not in self._views:
            road, pictures = self._road, ClipPictures(self.clip, view, self._road.cuts)
            masks = None if not self.clip.passes.holdout else self._mask_of(view)
            exposures = Exposures(
                self._blur,
                road.motion,
                holdout=_FrameHoldout(displays=road.displays, masks=masks),
                at_edges=road.at_edges,
                planes=Planes(self._blur.device, self.clip.expansion),
            )
            self._views[view] = exposures, pictures, exposures.frames(pictures)
        return self._views[view]

    def _mask_of(self, view: str | None) -> Callable[[int], np.ndarray | None]:
        def mask(number: int) -> np.ndarray | None:
            source = self.clip.source(number, view)
            return self.clip.frame(source, picture=False, normal=False, light=False).holdout

        return mask


def are_pictures(clip: Clip) -> bool:
    """True if frames are whole pictures, which PictureStages takes; neither parts nor panoramas."""
    source = clip.source(clip.numbers[0])
    wraps = clip.passes.wrap == "on" or panorama_signs.may_be(source)
    return source.data_window == source.display_window and not wraps
