"""Motion blur of a VapourSynth clip: a clip in, a clip at the output's rate out."""

# Where VapourSynth is not installed, pyright takes this file for it.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, Literal, Unpack, cast

import numpy as np
import wgpu

from .. import gpu
from ..color.coding import FLOAT, SRGB, UNSPECIFIED, CodedPicture, Coding
from ..errors import Error, InputError
from ..extras import needed_by
from ..run.pictures import SteadyExposures, steady
from ..run.video import PictureKeywords, request_of
from ..settings.output import rate_of
from ..shutter import Shutter
from ..video.pixels import PlaneLayout
from ..video.read.color_tags import assumed
from ..video.write.encoders import FINEST_RATE

with needed_by("wgmb.hosts.vapoursynth"):
    import vapoursynth as vs

_BEFORE = 24  # pictures read before an exposure, which its motion and its shot may depend on
_KEPT = 16  # output frames: VapourSynth asks for several at once, a little out of order


def blur(
    clip: vs.VideoNode,
    *,
    fps: str | float | Fraction | None = None,
    device: wgpu.GPUDevice | str | None = None,
    **settings: Unpack[PictureKeywords],
) -> vs.VideoNode:
    """Blur a clip along its motion, which is found in its pictures.

    `clip`: of one format and rate; integers of 8 to 16 bits (YUV, RGB, GRAY), or RGBS, RGBH.
    `fps`: of the result; None: as the clip. `settings`: options of `wgmb blur` with underscores,
    such as flow="search", and shutter=180 degrees of an output frame's interval. Colours are those
    that the first frame's properties state, or that players assume.

    Returns a clip of the same format; each frame has the properties of the clip's at that time.
    Frames can be asked for in any order. vs.Error in one line for arguments that do not fit.

    Example: wgmb.hosts.vapoursynth.blur(clip, shutter=180, fps=60).set_output()
    """
    try:
        _check(clip)
        rate = Fraction(clip.fps)
        wanted = rate if fps is None else rate_of(str(fps), "fps").limit_denominator(FINEST_RATE)
        request, _ = request_of(dict(settings), PictureKeywords)
        with clip.get_frame(0) as first:
            coding = coding_of(first)
        run = request.open(device).at(wanted)
        frames = _Frames(clip, steady(run, rate, wanted), rate / wanted, coding)
        frames.shutter = run.request.shutter.make()
    except Error as error:
        raise vs.Error(f"wgmb: {error}") from None
    length = frames.count
    base = clip.std.BlankClip(
        length=length, fpsnum=wanted.numerator, fpsden=wanted.denominator, keep=True
    )
    return base.std.ModifyFrame(base, lambda n, f: frames.fill(n, f))


def coding_of(frame: vs.VideoFrame) -> Coding:
    """The coding that a frame's properties state, with players' assumptions for the rest."""
    form, properties = frame.format, cast(Mapping[str, Any], frame.props)
    families: dict[int, Literal["rgb", "grey", "yuv"]] = {vs.RGB: "rgb", vs.GRAY: "grey"}
    model = families.get(int(form.color_family), "yuv")
    steps = 1 << form.subsampling_w, 1 << form.subsampling_h
    of = PlaneLayout("", None, model, form.bits_per_sample, steps, False, model == "rgb")
    matrix, transfer, primaries = (
        int(properties.get(name, UNSPECIFIED)) for name in ("_Matrix", "_Transfer", "_Primaries")
    )
    tags = (_range(properties), matrix, transfer, primaries)
    coding, _ = assumed(of, (frame.width, frame.height), "h264", tags)
    if form.sample_type == vs.FLOAT:
        transfer = SRGB if transfer == UNSPECIFIED else transfer
        return Coding("rgb", FLOAT, (1, 1), False, True, 0, transfer, coding.primaries)
    return coding


def _range(properties: Mapping[str, Any]) -> int:
    """Limited (1), full (2) or not told (0), as FFmpeg counts it.

    VapourSynth 81 has `_Range`, 1 for full; until then `_ColorRange` is 0 for full.
    """
    if "_Range" in properties:
        return 2 if int(properties["_Range"]) == 1 else 1
    if "_ColorRange" in properties:
        return 2 if int(properties["_ColorRange"]) == 0 else 1
    return 0


def _check(clip: vs.VideoNode) -> None:
    if clip.format is None or not clip.width or not clip.height:
        raise InputError("the clip's format or size varies; `resize` makes one of it")
    if not clip.fps:
        raise InputError("the clip has no constant rate; `std.AssumeFPS` sets one")
    if clip.format.sample_type == vs.FLOAT and clip.format.color_family != vs.RGB:
        raise InputError(
            f"{clip.format.name} is not taken: float pictures are RGBS or RGBH, and `resize` makes "
            "integers of others, such as YUV444P16"
        )
    if clip.format.sample_type != vs.FLOAT and clip.format.bits_per_sample > 16:
        raise InputError(f"{clip.format.name} is not taken: integers have 8 to 16 bits")


class _Frames:
    """The output frames of a clip, in any order.

    They are made forwards by one thread at a time; elsewhere the run begins anew, far enough
    before for the same result. The last few are kept.
    """

    shutter: Shutter

    def __init__(self, clip: vs.VideoNode, steady: SteadyExposures, pace: Fraction, coding: Coding):
        self._clip, self._steady, self._coding = clip, steady, coding
        self._pace = pace
        """Input frames per output frame."""
        self.count = steady.count(clip.num_frames)
        self._lock = threading.Lock()
        self._kept: dict[int, CodedPicture] = {}
        self._run = iter(())
        self._next: int | None = None

    def fill(self, number: int, blank: vs.VideoFrame) -> vs.VideoFrame:
        """The output frame of that number."""
        picture = self[number]
        made = blank.copy()
        nearest = min(int(number * self._pace), self._clip.num_frames - 1)
        with self._clip.get_frame(nearest) as frame:
            kept = {n: made.props[n] for n in ("_DurationNum", "_DurationDen") if n in made.props}
            for name, value in (dict(frame.props) | kept).items():
                made.props[name] = value
        for index, plane in enumerate(self._planes(picture, made)):
            np.copyto(np.asarray(made[index]), plane)
        return made

    def __getitem__(self, number: int) -> CodedPicture:
        with self._lock, gpu.reported():
            if number not in self._kept:
                self._make(number)
            return self._kept[number]

    def _make(self, number: int) -> None:
        """Make a frame, and those just before it that will be asked for, too."""
        ahead = None if self._next is None else number - self._next
        if ahead is None and number < _KEPT:
            self._begin(0)
        elif ahead is None or ahead < 0 or ahead * self._pace > _BEFORE:
            self._begin(number)
        for moment, exposure in self._run:
            self._next = moment.number + 1
            if moment.number > number - _KEPT:  # one that is skipped costs nothing
                self._kept[moment.number] = exposure.coded(self._coding)
            if moment.number == number:
                break
        for old in [*self._kept][:-_KEPT]:
            del self._kept[old]

    def _begin(self, number: int) -> None:
        """Begin the run anew at an output frame."""
        opens = number * self._pace + Fraction(min(self.shutter.span[0], 0.0)) * self._pace
        first = max(int(opens) - _BEFORE, 0)
        self._kept.clear()
        self._run = self._steady.of(self._pictures(first), self.shutter, number)

    def _pictures(self, first: int) -> Iterator[tuple[int, CodedPicture]]:
        for number in range(first, self._clip.num_frames):
            with self._clip.get_frame(number) as frame:
                planes = tuple(np.array(frame[i]) for i in range(frame.format.num_planes))
            if self._coding.bits == FLOAT:
                signals = np.ones((*planes[0].shape, 4), np.float32)
                signals[..., :3] = np.stack(planes, axis=2)
                planes = (signals,)
            yield number, CodedPicture(planes, self._coding)

    def _planes(self, picture: CodedPicture, like: vs.VideoFrame) -> tuple[np.ndarray, ...]:
        if self._coding.bits != FLOAT:
            return picture.planes
        return tuple(picture.planes[0][..., i] for i in range(like.format.num_planes))
