"""Copies of changed files as other libraries read them, in a plain form, for `stated`.

No reader of wgmb is used: Pillow, tifffile, OpenEXR, OpenColorIO or PyAV opens the changed file
itself, with all that it states, and writes its content anew. A copy states nothing wrong.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import OpenEXR
import PyOpenColorIO
import tifffile
from av.error import FFmpegError
from av.stream import Disposition
from PIL import Image

from raw_exr import write_sampled

_TICK = Fraction(1, 1000)  # s, of Matroska
_PLAIN = {"pal8": "bgra", "rgb24": "bgr0", "bgr24": "bgr0", "rgb8": "bgr0", "gray8a": "bgra"}
"""Kinds of pixels that FFV1 has not, and those that hold the same values."""


def pillow(path: Path, to: Path) -> None:
    """A PNG of a PNG or JPEG."""
    with Image.open(path) as image:
        image.save(to)


def tiff(path: Path, to: Path) -> None:
    """A TIFF without compression of the first page of one."""
    with tifffile.TiffFile(path) as file:
        page = file.pages.first
        extra = [int(each) for each in page.extrasamples] or None
        tifffile.imwrite(to, page.asarray(), photometric=page.photometric, extrasamples=extra)


def exr(path: Path, to: Path) -> None:
    """An EXR without compression of all channels of one; of its attributes, if none is sampled."""
    found, parts = OpenEXR.File(str(path), separate_channels=True).parts, []
    if any((c.xSampling, c.ySampling) != (1, 1) for c in found[0].channels.values()):
        planes = {n: (c.pixels, c.xSampling, c.ySampling) for n, c in found[0].channels.items()}
        first, last = found[0].header["dataWindow"]
        write_sampled(to, planes, tuple(last - first + 1))
        return
    for part in found:
        header = {**part.header, "compression": OpenEXR.NO_COMPRESSION}
        if header.get("type") == OpenEXR.tiledimage:
            header["type"] = OpenEXR.scanlineimage
            header.pop("tiles", None)
        parts.append(OpenEXR.Part(header, part.channels, part.name()))
    OpenEXR.File(parts).write(str(to))


def table(path: Path, to: Path) -> None:
    """A table of colours in the Common LUT Format."""
    ocio: Any = PyOpenColorIO
    opened = ocio.FileTransform(str(path), interpolation=ocio.INTERP_TETRAHEDRAL)
    config = ocio.Config.CreateRaw()
    made = config.getProcessor(opened).createGroupTransform()
    made.write(formatName="Academy/ASC Common LUT Format", fileName=str(to), config=config)


def video(path: Path, to: Path) -> None:
    """A file of all pictures that FFmpeg decodes, in FFV1, at their times.

    Matroska keeps colours, and rounds times to ms; NUT keeps times in their own ticks.
    """
    with av.open(str(path)) as file, av.open(str(to), "w") as out:
        streams = [s for s in file.streams.video if not s.disposition & Disposition.attached_pic]
        stream = file.streams.best("video")
        source = stream if stream in streams else streams[0]
        made: Any = None
        tick = source.time_base if to.suffix == ".nut" and source.time_base else _TICK
        for frame in _decoded(file, source):
            if made is None:
                made = _like(out, frame, source, tick)
            plain = frame.reformat(made.width, made.height, format=made.pix_fmt)
            _mark(plain, frame)
            plain.pts, plain.time_base = round(frame.pts * frame.time_base / tick), tick
            out.mux(made.encode(plain))
        if made is not None:
            out.mux(made.encode(None))


def _decoded(file: Any, stream: Any) -> Iterator[Any]:
    """All pictures with a time, in the order of their times."""
    stream.thread_type = "NONE"
    packets, last = file.demux(stream), None
    while True:
        packet = None
        with contextlib.suppress(FFmpegError):
            packet = next(packets, None)
        frames: list[Any] = []
        with contextlib.suppress(FFmpegError):
            frames = stream.decode(packet)
        for frame in frames:
            if frame.pts is not None and (last is None or frame.pts > last):
                last = frame.pts
                yield frame
        if packet is None or not packet.size:
            return


def _like(out: Any, frame: Any, source: Any, tick: Fraction) -> Any:
    made = out.add_stream("ffv1", rate=source.average_rate or source.guessed_rate or 25)
    made.width, made.height = frame.width, frame.height
    pixels = frame.format.name
    made.pix_fmt = _PLAIN.get(pixels, pixels.replace("yuvj", "yuv"))
    made.codec_context.time_base = tick
    if source.sample_aspect_ratio:
        made.sample_aspect_ratio = source.sample_aspect_ratio
    _mark(made.codec_context, frame)
    return made


def _mark(to: Any, frame: Any) -> None:
    """Give a stream or a picture the colours of a picture."""
    to.color_range = 2 if frame.format.name.startswith("yuvj") else frame.color_range
    to.colorspace = frame.colorspace
    to.color_trc, to.color_primaries = frame.color_trc, frame.color_primaries
