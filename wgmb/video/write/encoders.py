"""Codecs that videos can be written with: their containers, encoders, pixels and quality.

One table serves videos made of frames and videos made of videos. `quality` is the encoder's own
number of constant quality: smaller is better and larger.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
from av.codec.codec import UnknownCodecError

from ...color.coding import BT709, BT2020, Coding
from ...errors import InputError, did_you_mean
from ...io.suffixes import VIDEOS as SUFFIXES
from ..hdr10 import LightLevel, Mastering
from ..pixels import layout

FINEST_RATE = 1_001_000  # denominator of a rate: FFmpeg counts in 32 bits
CONTAINERS = {".mp4": "mp4", ".mov": "mov", ".mkv": "matroska", ".webm": "webm", ".gif": "gif"}
"""FFmpeg's names of the containers, by suffix; the first codec that has one is its default."""
HARDWARE = ("nvenc", "qsv", "amf", "videotoolbox", "v4l2m2m")
_MOST_TICKS = (1 << 31) - 1  # from one picture to the next in an MP4 or MOV
_FEWEST_TICKS = 10_000  # a second there
_MOST_HUNDREDTHS = (1 << 16) - 1  # of a second, for which a GIF shows a picture
# x264 chooses between algorithms by what it takes the processor for, which differs between runs.
_ALWAYS = {"libx264": ("cpu-independent=1",), "libx265": ("log-level=error",)}
_LAMBDA = 118  # FFmpeg's units of a global quality to one of `-q` (FF_QP2LAMBDA)


@dataclass(frozen=True)
class Facts:
    """Facts about a video's pictures besides their coding."""

    pixel_aspect: Fraction = Fraction(1)
    """Width of a pixel to its height."""
    mastering: Mastering | None = None
    light_level: LightLevel | None = None
    projection: bytes | None = None
    """FFmpeg's AVSphericalMapping: pictures are part of a sphere (360 degrees)."""
    stereo: bytes | None = None
    """FFmpeg's AVStereo3D: pictures hold two views."""


NO_FACTS = Facts()


@dataclass(frozen=True)
class Encoder:
    """One of FFmpeg's encoders."""

    name: str
    pixels: tuple[str, ...]
    """Formats to choose from."""
    quality: str = ""
    """Its option of constant quality."""
    options: tuple[tuple[str, str], ...] = ()
    parameters: str = ""
    """Its option of further parameters, in which HDR10 data goes."""
    even: bool = False
    """Sizes must be multiples of a sample of chroma."""

    def of_quality(self, quality: int | None) -> dict[str, str]:
        """The options that ask for a quality, if it has any."""
        if quality is None or not self.quality:
            return {}
        if self.name.endswith("_videotoolbox"):  # it counts from 1, the worst, to 100
            return {"flags": "+qscale", self.quality: str(_LAMBDA * max(1, 100 - 2 * quality))}
        more = {"qp_p": str(quality)} if self.name.endswith("_amf") else {}
        return {self.quality: str(quality)} | more

    @property
    def vui(self) -> bool:
        """Return True if the stream itself tells the shape of its pixels."""
        return any(name in self.name for name in ("264", "265", "hevc"))


@dataclass(frozen=True)
class Codec:
    """A codec that the command line offers."""

    suffixes: tuple[str, ...]
    software: Encoder
    quality: int | None = None
    """The one that is taken by default; None: the codec has none."""
    most: int = 51
    hardware: tuple[tuple[str, Encoder], ...] = ()


def _planar(names: str, depths: Iterable[int]) -> tuple[str, ...]:
    return tuple(
        name + ("" if bits == 8 else f"{bits}le") for bits in depths for name in names.split()
    )


def _hardware(
    family: str, others: bool = True, ten: bool = True, p444: bool = True
) -> tuple[tuple[str, Encoder], ...]:
    """The hardware encoders of a codec family.

    `ten`: with 10 bits, `p444`: with 4:4:4 (nvenc); `others`: also Apple's and Linux's (V4L2),
    which has no constant quality.
    """
    nv = ("yuv420p", *(("p010le",) * ten), *(("yuv444p",) * p444))
    nvidia = Encoder(f"{family}_nvenc", nv, "cq", (("rc", "vbr"), ("b", "0"), ("preset", "p5")),
                     even=True)  # fmt: skip
    two = ("nv12", *(("p010le",) * ten))
    found = {
        "nvenc": nvidia,
        "qsv": Encoder(f"{family}_qsv", two, "global_quality", even=True),
        "amf": Encoder(f"{family}_amf", two, "qp_i", (("rc", "cqp"),), even=True),
    }
    if others:
        apple = Encoder(f"{family}_videotoolbox", two, "global_quality", even=True)
        linux = Encoder(f"{family}_v4l2m2m", ("yuv420p",), "", (("b", "20M"),), even=True)
        found |= {"videotoolbox": apple, "v4l2m2m": linux}
    return tuple(found.items())


CODECS = {
    "h264": Codec(
        (".mp4", ".mkv", ".mov"),
        Encoder("libx264", (*_planar("yuv420p yuv422p yuv444p gray", (8, 10)),), "crf",
                (("preset", "medium"),), "x264-params", even=True),
        16, 51, _hardware("h264", ten=False),
    ),
    "h265": Codec(
        (".mp4", ".mkv", ".mov"),
        Encoder("libx265", _planar("yuv420p yuv422p yuv444p gray", (8, 10, 12)), "crf",
                (("preset", "medium"),), "x265-params", even=True),
        18, 51, _hardware("hevc"),
    ),
    "av1": Codec(
        (".mp4", ".mkv", ".webm"),
        Encoder("libsvtav1", _planar("yuv420p", (8, 10)), "crf", (("preset", "7"),),
                "svtav1-params"),
        20, 63, _hardware("av1", others=False, p444=False),
    ),
    "vp9": Codec(
        (".webm", ".mp4", ".mkv"),
        Encoder("libvpx-vp9", _planar("yuv420p yuv422p yuv444p", (8,)), "crf",
                (("b", "0"), ("row-mt", "1"))),
        24, 63, (("qsv", Encoder("vp9_qsv", ("nv12", "p010le"), "global_quality", even=True)),),
    ),
    "prores": Codec(
        (".mov", ".mkv"),
        Encoder("prores_ks", ("yuv422p10le", "yuv444p10le", "yuva444p10le")),
    ),
    "ffv1": Codec(
        (".mkv",),
        Encoder("ffv1", (*_planar("yuv420p yuv422p yuv444p gray", (8, 10, 12, 16)),
                         *_planar("yuva420p yuva422p yuva444p", (8, 10, 16)),
                         *_planar("gbrp gbrap", (10, 12, 14, 16)), "bgr0", "bgra",
                         *_planar("yuva422p yuva444p", (12,)), "yuv440p", "yuv411p", "yuv410p"),
                "", (("level", "3"), ("slicecrc", "1"), ("g", "1"))),
    ),
    # Its differences from the picture before are of indices, also where the palette is another.
    "gif": Codec((".gif",), Encoder("gif", ("pal8",), options=(("gifflags", "0"),))),
}  # fmt: skip


@dataclass(frozen=True)
class Encoding:
    """Encoding of a video, as `chosen` returns it."""

    suffix: str
    codec: str
    encoder: Encoder
    quality: int | None

    @property
    def container(self) -> str:
        """FFmpeg's name of the container."""
        return CONTAINERS[self.suffix]

    def check_pause(self, path: Path, pause: Fraction, base: Fraction) -> None:
        """InputError where pictures are further apart [s] than the container counts.

        `base`: see VideoWriter. FFmpeg would write other times, or end with a line about itself.
        """
        ticks, longest = base.denominator, math.inf
        while ticks < _FEWEST_TICKS:
            ticks *= 2  # as FFmpeg does
        if self.suffix in (".mp4", ".mov"):
            longest = _MOST_TICKS / ticks
        elif self.suffix == ".gif":
            longest = _MOST_HUNDREDTHS / 100
        if pause > longest:
            raise InputError(
                f"output {path}: {self.suffix} holds at most {int(longest):,} s from one picture "
                f"to the next at this rate, got {math.ceil(pause):,} s; .mkv holds more"
            )

    def options(self, coding: Coding, facts: Facts) -> dict[str, str]:
        """For the encoder, by name."""
        found = dict(self.encoder.options) | self.encoder.of_quality(self.quality)
        if self.codec == "prores":
            found["profile"] = "4" if coding.steps == (1, 1) else "3"
        if self.encoder.parameters:
            found |= self._parameters(facts)
        return found

    def _parameters(self, facts: Facts) -> dict[str, str]:
        """Of the encoder itself: the same bytes on every processor, HDR10 data, and silence."""
        name, display = self.encoder.name, facts.mastering
        said = list(_ALWAYS.get(name, ()))
        if display is not None and display.is_whole:
            option = "master-display" if name == "libx265" else "mastering-display"
            as_text = display.for_svt_av1 if name == "libsvtav1" else display.for_x265
            said.append(f"{option}={as_text()}")
        if facts.light_level is not None:
            option = {"libx265": "max-cll", "libx264": "cll"}.get(name, "content-light")
            said.append(f"{option}={facts.light_level}")
        return {self.encoder.parameters: ":".join(said)} if said else {}

    def left_out(self, facts: Facts) -> list[str]:
        """Facts that the file cannot hold, in words."""
        said = []
        if (facts.mastering or facts.light_level) and not self.encoder.parameters:
            said.append(f"{self.encoder.name} keeps no HDR10 data (mastering display, light level)")
        tells = self.encoder.vui and facts.stereo is None
        if facts.pixel_aspect != 1 and self.suffix in (".mkv", ".webm") and not tells:
            said.append(
                f"{self.codec} in {self.suffix} keeps no shape of pixels: these are "
                f"{facts.pixel_aspect} times as wide as high"
            )
        return said

    def pixels(self, coding: Coding) -> str:
        """The encoder's format for pictures of a Coding that `coding` returned."""
        return next(n for n in self.encoder.pixels if _holds(n) == _of(coding))

    def coding(self, wanted: Coding) -> tuple[Coding, list[str]]:
        """The Coding nearest to `wanted` that the encoder takes; and the losses, in words."""
        near = wanted
        if wanted.model == "rgb" and self.codec not in _OF_RGB:
            near = replace(wanted, model="yuv", steps=(2, 2))
        name = min(self.encoder.pixels, key=lambda n: _distance(_holds(n), near))
        model, bits, steps, alpha = _holds(name)
        matrix, full = wanted.matrix, wanted.full_range
        if model == "rgb":
            matrix, full = 0, True
        elif wanted.model == "rgb":
            matrix = BT2020 if wanted.primaries == BT2020 else BT709
            full = False
        if self.codec == "prores":
            full = False
        found = replace(
            wanted, model=model, bits=bits, steps=steps, alpha=alpha, matrix=matrix, full_range=full
        )
        return found, self._lost(wanted, found)

    def _lost(self, wanted: Coding, stored: Coding) -> list[str]:
        said = []
        if wanted.alpha and not stored.alpha:
            held = "wgmb writes no transparent GIF" if self.codec == "gif" else ""
            held = held or f"{self.codec} holds no transparency"
            said.append(f"{held}: it is left out; prores and ffv1 do")
        if wanted.bits > stored.bits:
            said.append(f"{self.codec} holds {stored.bits} bits of {wanted.bits}")
        coarser = any(a > b for a, b in zip(stored.steps, wanted.steps, strict=True))
        if coarser and wanted.model != "grey":
            across, down = stored.steps
            said.append(f"{self.codec} holds one colour for {across} x {down} pixels")
        return said


def chosen(
    path: str | Path,
    codec: str | None = None,
    quality: int | None = None,
    encoder: str | None = None,
) -> Encoding:
    """Encoding for the video `path`.

    `codec`: a name in CODECS, by default the first that the suffix is for. `quality`: instead of
    the codec's own. `encoder`: a kind of HARDWARE; None is software. InputError for settings that
    do not fit together, and for an encoder that this FFmpeg lacks.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"output {path}: the name must end in one of {', '.join(SUFFIXES)}")
    if codec is None:
        codec = _DEFAULTS[suffix]
    if codec not in CODECS:
        raise InputError(
            f"`codec` must be one of {', '.join(CODECS)}, got {codec!r}"
            f"{did_you_mean(codec, CODECS)}"
        )
    found = CODECS[codec]
    if suffix not in found.suffixes:
        able = ", ".join(name for name, other in CODECS.items() if suffix in other.suffixes)
        raise InputError(
            f"output {path}: {codec} goes into {', '.join(found.suffixes)}; {suffix} takes {able}"
        )
    asked = quality is not None
    if quality is None:
        quality = found.quality
    elif found.quality is None:
        raise InputError(f"codec {codec} has no quality to choose, got {quality}")
    elif not 0 <= quality <= found.most:
        raise InputError(
            f"quality of {codec} must be 0 to {found.most} (smaller is better), got {quality}"
        )
    by = _encoder(codec, encoder)
    if asked and not by.quality:
        raise InputError(f"encoder {by.name} has no quality to choose, got {quality}")
    return Encoding(suffix, codec, by, quality)


_OF_RGB = ("ffv1", "prores", "gif")  # others make 4:2:0 of RGB, which all players take
_DEFAULTS = {".mp4": "h264", ".mkv": "h264", ".mov": "prores", ".webm": "vp9", ".gif": "gif"}


def _encoder(codec: str, kind: str | None) -> Encoder:
    found = CODECS[codec]
    if kind is None:
        encoder = found.software
    elif kind not in HARDWARE:
        raise InputError(
            f"`encoder` must be one of {', '.join(HARDWARE)}, got {kind!r}"
            f"{did_you_mean(kind, HARDWARE)}"
        )
    elif kind not in dict(found.hardware):
        able = ", ".join(name for name, other in CODECS.items() if kind in dict(other.hardware))
        raise InputError(f"encoder {kind} is not for {codec}; it is for {able}")
    else:
        encoder = dict(found.hardware)[kind]
    if not _is_there(encoder):
        there = [name for name, other in found.hardware if _is_there(other)]
        others = f", which has {', '.join(there)}" if there else ""
        raise InputError(f"encoder {encoder.name} is not in this build of PyAV{others}")
    return encoder


def _is_there(encoder: Encoder) -> bool:
    try:
        av.Codec(encoder.name, "w")
    except UnknownCodecError:
        return False
    return True


_Held = tuple[str, int, tuple[int, int], bool]  # model, bits, steps, alpha


def _holds(pixels: str) -> _Held:
    if pixels == "pal8":
        return "rgb", 8, (1, 1), False
    found = layout(pixels)
    assert found is not None
    return found.model, found.bits, found.steps, found.alpha


def _of(coding: Coding) -> _Held:
    return coding.model, coding.bits, coding.steps, coding.alpha


def _distance(held: _Held, wanted: Coding) -> tuple[int, ...]:
    """Distance of a format from the wanted one: first its losses, then its waste."""
    model, bits, steps, alpha = held
    order = {"rgb": ("rgb", "yuv"), "grey": ("grey", "yuv"), "yuv": ("yuv",)}[wanted.model]
    area, asked = steps[0] * steps[1], wanted.steps[0] * wanted.steps[1]
    if wanted.model == "grey":
        asked = 4
    coarser = any(a > b for a, b in zip(steps, wanted.steps, strict=True))
    return (
        order.index(model) if model in order else len(order),
        wanted.alpha and not alpha,
        max(wanted.bits - bits, 0),
        (area if coarser else 0) if wanted.model != "grey" else 0,
        alpha and not wanted.alpha,
        max(bits - wanted.bits, 0),
        abs(asked - area),
    )
