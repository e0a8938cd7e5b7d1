"""Pictures from anywhere in Python, such as lists, generators and tensors, blurred one by one."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np
import wgpu

from ..color.coding import BT709, FLOAT, HLG, LINEAR, PQ, SRGB, CodedPicture, Coding
from ..errors import InputError, check_choice
from ..frame import MOST_SIDE
from ..settings.output import rate_of
from ..shots.cut_list import CutList
from ..shots.reader import Picture
from ..shutter import Shutter
from ..video.exposures import Exposure, Exposures
from ..video.holdouts import NONE, Holdout
from ..video.output_times import SPARE, OutputFrame
from ..video.planes import Planes
from ..video.thumbnail import Thumbnail
from ..video.write.encoders import FINEST_RATE
from .engine import IsDone, frames
from .video import PictureKeywords, VideoRun, request_of

TRANSFERS = {"srgb": SRGB, "linear": LINEAR, "pq": PQ, "hlg": HLG, "bt709": BT709}
_BITS = {"uint8": 8, "uint16": 16, "float16": FLOAT, "float32": FLOAT, "float64": FLOAT}
_CPU = 1, 3  # of DLPack: memory of the CPU, and what CUDA pinned of it
_RATE = Fraction(24)  # of pictures whose rate is not told; only the length of a flash depends on it


class SteadyExposures:
    """Exposures of pictures at a steady rate, whose number nobody knows before the end."""

    def __init__(self, exposures: Exposures, rate: Fraction, fps: Fraction):
        self.exposures, self._rate, self._fps = exposures, rate, fps
        self.read = 0
        """Number of the last picture read so far, and 1."""
        self._ended = False

    def of(
        self, pictures: Iterable[tuple[int, CodedPicture]], shutter: Shutter, first: int = 0
    ) -> Iterator[tuple[OutputFrame, Exposure]]:
        """Every output frame and its exposure, which is valid until the next is asked for.

        `pictures`: with their numbers, which ascend. `first`: number of the first output frame.
        """
        return self.exposures.of(self._timed(pictures), shutter, self._wanted(first))

    def count(self, pictures: int) -> int:
        """Number of output frames of so many pictures."""
        return max(1, math.ceil(pictures / self._rate * self._fps - SPARE)) if pictures else 0

    def _timed(self, pictures: Iterable[tuple[int, CodedPicture]]) -> Iterator[Picture[Thumbnail]]:
        for number, picture in pictures:
            self.read = number + 1
            yield Picture(float(number / self._rate), Thumbnail(picture), number)
        self._ended = True

    def _wanted(self, first: int) -> Iterator[OutputFrame]:
        """The output frames, as many as the pictures turn out to fill."""
        interval = 1 / self._fps
        for number in count(first):
            shots = self.exposures.shots
            assert shots is not None
            shots.read_beyond(float(number * interval))
            if self._ended and number >= self.count(self.read):
                return
            yield OutputFrame(number, number * interval, interval)


class SteadyFrames:
    """Output frames of pictures at a steady rate, as the input of a run.

    `pictures`: with their numbers. They are read on the thread that blurs: a caller's iterator is
    the caller's, and a thread that waits for a pipe cannot be interrupted. `form`: converts an
    exposure to the caller's form.
    """

    ahead, total = 0, 0

    def __init__(
        self,
        pictures: Iterable[tuple[int, CodedPicture]],
        exposures: SteadyExposures,
        shutter: Shutter,
        form: Callable[[OutputFrame, Exposure], Any],
    ):
        self._pictures, self._exposures = pictures, exposures
        self._shutter, self._form = shutter, form

    def read(self, is_done: IsDone) -> Iterator[tuple[int, CodedPicture]]:
        """The pictures."""
        return iter(self._pictures)

    def blur(self, read: Iterator[tuple[int, CodedPicture]]) -> Iterator[Any]:
        """Make the exposures."""
        exposed = self._exposures.of(read, self._shutter)
        return (self._form(frame, exposure) for frame, exposure in exposed)


class PictureBlur(Iterator[Any]):
    """Blurred pictures, each made when it is asked for; `blur_pictures` returns one."""

    def __init__(
        self,
        pictures: Iterable[Any],
        steady: SteadyExposures,
        shutter: Shutter,
        transfer: str,
        how: str,
    ):
        self.how = how
        """The source of the motion, in words."""
        self._steady, self._transfer = steady, transfer
        self._like: type = type(None)
        self._shape, self._dtype, self._coding = (0, 0, 0), np.dtype(np.uint8), Coding()
        coded = ((number, self._coded(number, picture)) for number, picture in enumerate(pictures))
        self._results = frames(SteadyFrames(coded, steady, shutter, self._result))

    def __next__(self) -> Any:
        """The next picture, as an array or a tensor like those that were given."""
        return next(self._results)

    @property
    def read(self) -> int:
        """Number of pictures read so far: some more than were needed yet."""
        return self._steady.read

    def close(self) -> None:
        """End the run: no further picture comes, and none is held."""
        self._results.close()

    def count(self, pictures: int) -> int:
        """Number of results of so many pictures."""
        return self._steady.count(pictures)

    @property
    def cuts(self) -> list[int]:
        """Numbers of the pictures read so far that begin a shot."""
        return sorted(self._steady.exposures.shots.cuts) if self._steady.exposures.shots else []

    @property
    def flashes(self) -> list[int]:
        """Numbers of the pictures read so far that begin a flash."""
        return list(self._steady.exposures.shots.flashes) if self._steady.exposures.shots else []

    @property
    def repeated(self) -> list[int]:
        """Numbers of the repeated pictures that were left out (`duplicates` "fill")."""
        return list(self._steady.exposures.shots.doubles) if self._steady.exposures.shots else []

    def _coded(self, number: int, picture: Any) -> CodedPicture:
        """A copy of a picture: its owner may fill the same memory again."""
        array = _array(f"picture {number}", picture)
        if self._like is type(None):
            self._coding = Coding(
                "rgb",
                _BITS[array.dtype.name],
                (1, 1),
                alpha=array.shape[2] == 4,
                full_range=True,
                transfer=TRANSFERS[self._transfer],
            )
            self._shape, self._dtype, self._like = array.shape, array.dtype, type(picture)
        if array.shape != self._shape or array.dtype != self._dtype:
            want = _described(self._shape, self._dtype)
            raise InputError(f"picture {number} must be {want} like the first one, "
                             f"got {_described(array.shape, array.dtype)}")  # fmt: skip
        if self._coding.bits < FLOAT:
            planes = np.array(np.moveaxis(array, 2, 0), order="C")
            return CodedPicture(tuple(planes), self._coding)
        if not np.isfinite(array).all():
            raise InputError(f"picture {number} must be finite, got NaN or infinity")
        signals = np.ones((*array.shape[:2], 4), np.float32)
        signals[..., : array.shape[2]] = array
        return CodedPicture((signals,), self._coding)

    def _result(self, frame: OutputFrame, exposure: Exposure) -> Any:
        planes = exposure.coded(self._coding).planes
        if self._coding.bits < FLOAT:
            array = np.stack(planes, axis=2)
        else:
            channels = planes[0][..., : self._shape[2]]
            array = np.ascontiguousarray(channels, self._dtype)
        library = sys.modules.get(self._like.__module__.partition(".")[0])
        if isinstance(array, self._like) or not hasattr(library, "from_dlpack"):
            return array
        return library.from_dlpack(array)  # pyright: ignore[reportOptionalMemberAccess]


_OWN = "fps_in", "fps", "transfer", "holdout", "device"  # keywords of blur_pictures itself


def blur_pictures(
    pictures: Iterable[Any],
    *,
    fps_in: str | float | Fraction | None = None,
    fps: str | float | Fraction | None = None,
    transfer: Literal["srgb", "linear", "pq", "hlg", "bt709"] = "srgb",
    holdout: np.ndarray | Literal["none"] | None = None,
    device: wgpu.GPUDevice | str | None = None,
    **settings: Unpack[PictureKeywords],
) -> PictureBlur:
    """Blur pictures without vectors from anywhere: `wgmb blur` of a video, without the video.

    `pictures`: an iterable of arrays (height, width, 3 or 4), all of one size and type: RGB, and
    straight alpha; uint8, uint16 (of their whole range), or float, of which 1 is white. Tensors of
    other libraries in the CPU's memory are taken by DLPack. They are copied, and read as far as the
    next result needs: at most 15 are held, and ten more while a flash is told from a cut.
    `fps_in`, `fps`: pictures per second of the input and of the output; without `fps`, there is a
    result for each picture. `transfer`: the meaning of the samples; floats that are "linear" are
    not rounded and may exceed 1. `holdout` (height, width): 1 stays sharp; "none": nothing;
    without it, displays that are found. `settings`: options of `wgmb blur` with underscores, such
    as shutter=180, flow="search", cuts="only:12".

    Returns an iterator of pictures like those that were given. InputError for settings that do not
    fit, and, with its number, for a picture of another size or type, one that is not finite, or one
    on a GPU. Exceptions of `pictures` arrive unchanged.

    Example: for picture in wgmb.blur_pictures(imageio.v3.imiter("in.mp4"), fps_in=30, fps=60): ...
    """
    if fps is not None and fps_in is None:
        raise InputError("`fps` needs the rate of the pictures; set `fps_in`")
    check_choice("transfer", transfer, TRANSFERS)
    if isinstance(pictures, (str, bytes, Path)):
        raise InputError(f"pictures must be arrays, got a name; wgmb.blur_video takes {pictures!r}")
    if not isinstance(pictures, Iterable) and not hasattr(pictures, "__getitem__"):
        raise InputError(f"pictures must be an iterable of arrays, got {type(pictures).__name__}")
    rate = _RATE if fps_in is None else _rate("fps_in", fps_in)
    request, _ = request_of(dict(settings), PictureKeywords, _OWN)
    if isinstance(holdout, np.ndarray) and request.video.flow == "none":
        raise InputError("`holdout` needs motion; `flow` none averages whole pictures")
    request.video.expansion.check_pictures(transfer not in ("linear", "pq", "hlg"))
    wanted = rate if fps is None else _rate("fps", fps)
    request.shutter.resolved(fps=None if fps_in is None else wanted)
    run = request.open(device).at(wanted)
    held = _held(holdout)
    made = steady(run, rate, wanted, held)
    return PictureBlur(pictures, made, run.request.shutter.make(), transfer, run.how)


def steady(
    run: VideoRun, rate: Fraction, fps: Fraction, holdout: Holdout | None = None
) -> SteadyExposures:
    """The exposures of pictures at `rate`, `fps` of them a second.

    `holdout`: by default that of the run.
    """
    request, cuts = run.request, CutList(run.request.input.cuts or "")
    exposures = Exposures(
        run.blur,
        run.motion,
        holdout=holdout or Holdout(displays=not request.blur.holdout),
        at_edges=run.at_edges,
        fill=request.video.duplicates == "fill",
        cuts=cuts.is_search,
        known_cuts=cuts.frames(0),
        planes=Planes(run.blur.device, request.video.expansion),
    )
    return SteadyExposures(exposures, rate, fps)


def _rate(name: str, rate: str | float | Fraction) -> Fraction:
    return rate_of(str(rate), name).limit_denominator(FINEST_RATE)


def _held(holdout: np.ndarray | str | None) -> Holdout:
    if holdout is None or isinstance(holdout, str):
        if holdout not in (None, NONE):
            raise InputError(f"`holdout` must be an array or {NONE!r}, got {holdout!r}")
        return Holdout(displays=holdout is None)
    return Holdout(_matte(holdout), displays=False)


def _matte(holdout: np.ndarray) -> np.ndarray:
    found = np.asarray(holdout)
    if found.ndim != 2:
        raise InputError(f"`holdout` must be (height, width), got {found.shape}")
    _check_size("holdout", found)
    return np.asarray(found, np.float32)


def _check_size(name: str, array: np.ndarray) -> None:
    """InputError for more pixels a side than a texture has, before any is copied."""
    height, width = array.shape[:2]
    if max(width, height) > MOST_SIDE:
        raise InputError(
            f"{name} must be at most {MOST_SIDE} pixels a side, got {width} x {height}"
        )


def _array(name: str, picture: Any) -> np.ndarray:
    """The picture as an array, without a copy if possible."""
    if not isinstance(picture, np.ndarray) and hasattr(picture, "__dlpack_device__"):
        if picture.__dlpack_device__()[0] not in _CPU:
            raise InputError(f"{name} is on a GPU; bring it to the CPU first: `.cpu()`")
        with suppress(BufferError, RuntimeError, TypeError):  # else numpy's own way, or its words
            picture = np.from_dlpack(picture)
    array = np.asarray(picture)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise InputError(f"{name} must be (height, width, 3 or 4), got {array.shape}")
    _check_size(name, array)
    if array.dtype.name not in _BITS:
        raise InputError(f"{name} must be {', '.join(_BITS)}; got {array.dtype}")
    return array


def _described(shape: tuple[int, ...], kind: np.dtype) -> str:
    return f"{shape[1]} x {shape[0]} with {shape[2]} channels of {kind}"
