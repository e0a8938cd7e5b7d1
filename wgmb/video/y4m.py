"""YUV4MPEG2, the form in which video programs hand pictures through pipes: read and written.

A line of text for the stream, such as `YUV4MPEG2 W640 H360 F30:1 Ip A1:1 C420mpeg2`, then for each
picture the line `FRAME` and its planes. It says nothing of matrix, transfer and primaries.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO, Literal, cast

import numpy as np

from ..color.coding import BT601, BT709, SRGB, UNSPECIFIED, CodedPicture, Coding
from ..errors import InputError
from ..io import limits
from ..io.pipes import PipeWriter
from .pixels import PlaneLayout
from .read.color_tags import COLORS, PAL, RANGES, assumed
from .write import views
from .write.encoders import Facts

_LONGEST = 4096  # bytes of a line
_STEPS = {"420": (2, 2), "422": (2, 1), "444": (1, 1), "440": (1, 2), "411": (4, 1)}
_NAMES = {steps: name for name, steps in _STEPS.items()}
_AS_BT709 = BT709, BT601, SRGB, 14, 15  # curves of BT.2020, too
_SITED = "jpeg", "mpeg2", "paldv"  # how samples of chroma lie in 4:2:0
_PLAIN = re.compile(r"(420|422|444|440|411|mono)(jpeg|mpeg2|paldv|alpha|p?(?:9|10|12|14|16))?")


class Y4mReader:
    """Reads pictures from a stream that cannot be sought. `name`: of the stream, for messages.

    `color`: a name in COLORS, or None for the assumption of players. InputError in one line for a
    stream that holds none, or something else, and for pictures of more than `max_mb` megabytes.
    """

    def __init__(
        self, stream: BinaryIO, name: str, color: str | None = None, max_mb: float = limits.MAX_MB
    ):
        self._stream, self.name = stream, name
        self.loss = ""
        """The loss at the end, in words."""
        line = self._line()
        if not line:
            raise InputError(f"{name}: holds no pictures")
        kind, *words = line.split(b" ")
        if kind != b"YUV4MPEG2":
            raise InputError(
                f"{name}: is not YUV4MPEG2, which `ffmpeg -i in.mp4 -f yuv4mpegpipe -` makes, with "
                "-strict -1 for more than 8 bits"
            )
        said = {word[:1].decode("latin-1"): word[1:].decode("latin-1") for word in words if word}
        full = any(word == b"XCOLORRANGE=FULL" for word in words)
        self.size = self._whole(said, "W"), self._whole(said, "H")
        if max(self.size) > limits.MOST_PIXELS_A_SIDE:
            raise InputError(f"{name}: pictures of {self.size[0]} x {self.size[1]}, expected 1 to "
                             f"{limits.MOST_PIXELS_A_SIDE} pixels a side")  # fmt: skip
        promised = limits.unpacked(self.size, 4)
        limits.check(Path(name), f"{self.size[0]} x {self.size[1]}", promised, promised, max_mb)
        self.rate = self._ratio(said.get("F", "0:0"))
        """Pictures a second, exactly; None if the stream does not say."""
        self.facts = Facts(self._ratio(said.get("A", "0:0")) or Fraction(1))
        self.space = said.get("C", "420jpeg")
        """The samples, as the stream names them."""
        if said.get("I", "p") not in ("p", "?"):
            raise InputError(
                f"{name}: is interlaced, which a pipe cannot be; deinterlace it first: "
                "`ffmpeg -vf bwdif`"
            )
        self.coding, self.notes = self._coding(full, color)

    def pictures(self) -> Iterator[tuple[int, CodedPicture]]:
        """The pictures and their numbers, up to the end or a break in the stream (see `loss`)."""
        kind = np.dtype("<u2" if self.coding.bits > 8 else "u1")
        shapes = planes_of(self.size, self.coding)
        length, number = sum(h * w for h, w in shapes) * kind.itemsize, 0
        while line := self._line():
            data = b""
            if line.split(b" ")[0] == b"FRAME":
                data = self._stream.read(length)
            if len(data) < length:
                cut = f"{self.name}: is cut off in picture {number}"
                self.loss = cut if line.startswith(b"FRAME"[: len(line)]) else (
                    f"{self.name}: is damaged before picture {number}"
                )  # fmt: skip
                return
            planes, at = [], 0
            for height, width in shapes:
                plane = np.frombuffer(data, kind, height * width, at).reshape(height, width)
                planes.append(plane)
                at += plane.nbytes
            yield number, CodedPicture(tuple(planes), self.coding)
            number += 1

    def _line(self) -> bytes:
        return self._stream.readline(_LONGEST).rstrip(b"\n")

    def _whole(self, parameters: dict[str, str], key: str) -> int:
        if not re.fullmatch(r"[1-9]\d{0,8}", parameters.get(key, "")):
            raise InputError(f"{self.name}: its header lacks a size")
        return int(parameters[key])

    def _ratio(self, text: str) -> Fraction | None:
        if not (found := re.fullmatch(r"(\d{1,9}):(\d{1,9})", text)):
            raise InputError(f"{self.name}: its header has the ratio {text!r}")
        over, under = map(int, found.groups())
        return Fraction(over, under) if over and under else None

    def _coding(self, full: bool, color: str | None) -> tuple[Coding, list[str]]:
        found = _PLAIN.fullmatch(self.space.lower())
        if not found:
            raise InputError(f"{self.name}: samples of the kind {self.space!r} are not read")
        kind, more = found.groups()
        bits = int((more or "8").lstrip("p")) if (more or "8").lstrip("p").isdigit() else 8
        model: Literal["grey", "yuv"] = "grey" if kind == "mono" else "yuv"
        steps = _STEPS.get(kind, (1, 1))
        of = Coding(model, bits, steps, more == "alpha", full)
        coding, said = _assumed(of, self.size, color)
        return coding, [
            f"does not state its colours: {', '.join(said)} assumed; `color_in` sets others"
        ] if said else []


class Y4mWriter:
    """Writes pictures of one size and coding into an unbuffered stream.

    `space`: the name of the samples, if another than this coding's own is wanted. `aspect`: width
    of a pixel to its height. OSError if the stream's reader is gone.
    """

    def __init__(
        self,
        stream: BinaryIO,
        size: tuple[int, int],
        rate: Fraction,
        coding: Coding,
        space: str = "",
        aspect: Fraction = Fraction(1),
    ):
        self._out, self._coding = PipeWriter(stream), coding
        width, height = size
        limit = "FULL" if coding.full_range else "LIMITED"
        self._out.write(
            f"YUV4MPEG2 W{width} H{height} F{rate.numerator}:{rate.denominator} Ip "
            f"A{aspect.numerator}:{aspect.denominator} "
            f"C{space or space_of(coding)} XCOLORRANGE={limit}\n".encode()
        )

    def add(self, picture: CodedPicture) -> None:
        """Append a picture."""
        kind = np.dtype("<u2" if self._coding.bits > 8 else "u1")
        planes = (np.ascontiguousarray(plane, kind).tobytes() for plane in picture.planes)
        self._out.write(b"".join([b"FRAME\n", *planes]))
        self._out.pictures += 1


def coding_in(coding: Coding) -> Coding:
    """The coding of pictures in a pipe that were coded so in a file: RGB becomes 4:4:4."""
    if coding.model == "rgb":
        return replace(
            coding, model="yuv", steps=(1, 1), alpha=False, full_range=False, matrix=BT709
        )
    return replace(coding, alpha=coding.alpha and (coding.bits, coding.steps) == (8, (1, 1)))


def lost_in(size: tuple[int, int], coding: Coding, facts: Facts) -> list[str]:
    """Facts about the pictures of a file that a pipe does not hold, in words."""
    said, held = [], coding_in(coding)
    if coding.alpha and not held.alpha:
        said.append("YUV4MPEG2 holds no such transparency; `codec='ffv1'` does")
    taken, _ = _assumed(held, size, None)
    if any(a != b for a, b in zip(_for_players(taken), _for_players(held), strict=True)):
        said.append(
            "YUV4MPEG2 does not state colours, so players may show wrong ones; "
            "`codec='ffv1'` states them"
        )
    if facts.mastering or facts.light_level:
        said.append("YUV4MPEG2 keeps no HDR10 data (mastering display, light level)")
    return [*said, *views.left_out(facts, ".y4m")]


def _for_players(coding: Coding) -> tuple[int, int, int]:
    """Matrix, transfer and primaries, with one number for those that players show alike."""
    transfer = BT709 if coding.transfer in _AS_BT709 else coding.transfer
    matrix, primaries = (BT601 if n == PAL else n for n in (coding.matrix, coding.primaries))
    return matrix, transfer, primaries


def _assumed(
    of: Coding, size: tuple[int, int], color: str | None
) -> tuple[Coding, tuple[str, ...]]:
    """The coding of such samples in a pipe that states no colours; see color_tags.assumed."""
    like = PlaneLayout("", None, of.model, of.bits, of.steps, of.alpha, of.full_range)
    tags = RANGES[of.full_range], *(COLORS[color] if color else (UNSPECIFIED,) * 3)
    coding, said = assumed(like, size, "h264", cast("tuple[int, int, int, int]", tags))
    return replace(coding, full_range=of.full_range), said


def space_of(coding: Coding) -> str:
    """The name of a coding's samples."""
    if coding.model == "grey":
        return "mono" if coding.bits == 8 else f"mono{coding.bits}"
    if coding.steps not in _NAMES:
        raise InputError(
            f"chroma of {coding.steps[0]} x {coding.steps[1]} pixels has no name in a pipe"
        )
    name = _NAMES[coding.steps]
    if coding.alpha:
        return f"{name}alpha"
    if coding.bits > 8:
        return f"{name}p{coding.bits}"
    return "420mpeg2" if name == "420" else name


def planes_of(size: tuple[int, int], coding: Coding) -> list[tuple[int, int]]:
    """Height and width of each plane."""
    width, height = size
    across, down = coding.steps
    chroma = (-(-height // down), -(-width // across))
    if coding.model == "grey":
        return [(height, width)]
    return [(height, width), chroma, chroma] + [(height, width)] * coding.alpha
