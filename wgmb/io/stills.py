"""PNG, JPEG and TIFF stills: display values in the file, linear light here.

Integer samples are sRGB and unassociated alpha; float TIFF samples are linear and
premultiplied already. 16 bits stay 16 bits both ways.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from ..color.spaces import ColorSpace
from ..color.srgb import ToDisplay, linear, to_display
from ..errors import InputError
from ..extras import needed_by
from ..files import bounded
from . import limits, stated
from .record import KEY
from .suffixes import STILLS

if TYPE_CHECKING:
    from av.video.codeccontext import VideoCodecContext

SUFFIXES = STILLS
_AFTER_HEADER = 33  # bytes of a PNG's signature and IHDR


def require(suffix: str) -> None:
    """InputError unless the packages for files of this kind are installed."""
    {".png": _av, ".jpg": _jpeg, ".jpeg": _jpeg}.get(suffix.lower(), _tifffile)()


def _av():
    with needed_by("PNG files", "images"):
        import av
    return av


def _jpeg():
    with needed_by("JPEG files", "images"):
        import imageio.v3
        from PIL import JpegImagePlugin
    return imageio.v3, JpegImagePlugin.JpegImageFile


def _tifffile():
    with needed_by("TIFF files", "images"):
        import tifffile
    return tifffile


def read(
    path: str | Path,
    *,
    max_mb: float = limits.MAX_MB,
    space: ColorSpace | None = None,
    held: int = 0,
) -> np.ndarray:
    """(height, width, 3 or 4) float32, linear, premultiplied.

    `max_mb`: megabytes that it may unpack to. `space`: of the samples, instead of sRGB or, of
    floats, linear light; the result is in `space.config.scene_linear`. `held`: values of 32 bits
    that a run holds of a pixel (see limits.check_held). `InputError` names the file where it is
    missing, damaged, cut off, no picture or beyond that limit, and where memory is short.
    """
    return _decoded(Path(path), max_mb, held, lambda samples: _to_linear(samples, space))


def samples(path: str | Path, *, max_mb: float = limits.MAX_MB) -> np.ndarray:
    """(height, width, 1 to 4) samples as they are stored: uint8, uint16 or floats.

    Grey of a PNG is repeated in three channels. The rest is as for `read`.
    """
    return _decoded(Path(path), max_mb, 0, _checked)


def _decoded(
    path: Path, max_mb: float, held: int, convert: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """The file's samples, converted; every failure is an InputError that names the file."""
    if not path.is_file():
        raise bounded.missing(path)

    def allow(width: int, height: int, segments: int) -> None:
        if width < 1 or height < 1:
            raise ValueError(f"{width} x {height} pixels")
        unpacked = max(limits.unpacked((width, height), 4), segments)
        stored = path.stat().st_size
        limits.check(path, f"{width} x {height}", unpacked, stored, max_mb)
        limits.check_held(path, (width, height), held, stored, max_mb)

    try:
        return convert(_READERS[path.suffix.lower()](path.read_bytes(), allow))
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{path}: not enough memory for its pixels") from None
    except Exception as error:  # decoders raise whatever they like on damaged data
        lines = str(error).splitlines() or [type(error).__name__]
        raise InputError(f"{path}: not a readable image: {lines[0]}") from None


def _read_png(data: bytes, allow: stated.Allow) -> np.ndarray:
    av = _av()
    codec = cast("VideoCodecContext", av.CodecContext.create("png", "r"))
    codec.thread_count = 1
    frame = [*codec.decode(av.Packet(stated.png(data, allow))), *codec.decode(None)][0]
    name = frame.format.name
    alpha = name.startswith(("rgba", "ya", "pal8"))
    deep = "16" in name or "48" in name or "64" in name
    wanted = {
        (False, False): "rgb24",
        (False, True): "rgb48le",
        (True, False): "rgba",
        (True, True): "rgba64le",
    }[alpha, deep]
    return frame.to_ndarray(format=wanted)


def _read_jpeg(data: bytes, allow: stated.Allow) -> np.ndarray:
    _, jpeg = _jpeg()
    with jpeg(io.BytesIO(stated.jpeg(data))) as image:  # PIL's `open` has its own limit
        allow(*image.size, 0)
        if image.mode not in ("L", "RGB"):
            raise ValueError(f"must be grey or RGB, is {image.mode}")
        return np.asarray(image)


def _read_tiff(data: bytes, allow: stated.Allow) -> np.ndarray:
    tifffile = _tifffile()
    with tifffile.TiffFile(io.BytesIO(stated.tiff(data))) as file:
        page = file.pages.first
        segments = stated.tiff_segment(page) * len(page.databytecounts)
        allow(page.imagewidth, page.imagelength, segments)
        if page.photometric not in (tifffile.PHOTOMETRIC.RGB, tifffile.PHOTOMETRIC.MINISBLACK):
            raise ValueError(
                f"must be grey or RGB, is {tifffile.PHOTOMETRIC(page.photometric).name}"
            )
        if sum(page.databytecounts) > len(data) or page.samplesperpixel > 4:
            raise ValueError("damaged: the header declares more data than the file holds")
        stated.tiff_segments_held(page, len(data))
        stated.bound_segments(page, tifffile.TIFF.DECOMPRESSORS)
        return page.asarray()


_READERS = {
    ".png": _read_png,
    ".jpg": _read_jpeg,
    ".jpeg": _read_jpeg,
    ".tif": _read_tiff,
    ".tiff": _read_tiff,
}


def _checked(samples: np.ndarray) -> np.ndarray:
    """Samples as (height, width, 1 to 4); ValueError where they are none of one image."""
    if samples.ndim == 2:
        samples = samples[..., None]
    if samples.ndim != 3 or 0 in samples.shape or samples.shape[2] not in (1, 2, 3, 4):
        raise ValueError(f"must be one grey, RGB or RGBA image, got shape {samples.shape}")
    if samples.dtype.kind != "f" and samples.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"samples must be 8 or 16 bit or float, got {samples.dtype}")
    return samples


def _to_linear(samples: np.ndarray, space: ColorSpace | None) -> np.ndarray:
    samples = _checked(samples)
    if samples.shape[2] < 3:  # grey, grey and alpha
        samples = np.concatenate([samples[..., :1]] * 3 + [samples[..., 1:]], axis=2)
    if samples.dtype.kind == "f":
        return samples.astype(np.float32) if space is None else space.linear(samples)
    most = np.iinfo(samples.dtype).max
    table = np.arange(most + 1, dtype=np.float32) / np.float32(most)
    if space is None:
        light = linear(table)[samples[..., :3]]
    else:
        light = space.linear(table[samples[..., :3]])
    if samples.shape[2] == 3:
        return light
    alpha = samples[..., 3:] / np.float32(most)
    return np.concatenate([light * alpha, alpha], axis=2)


def encode(
    rgba: np.ndarray, suffix: str, bits: int, text: str, convert: ToDisplay = to_display
) -> bytes:
    """The bytes of a still of (height, width, 3 or 4) linear light, with the record's text."""
    suffix = suffix.lower()
    if suffix in (".jpg", ".jpeg"):
        samples = convert(rgba, 8, over_black=True)
        imageio, _ = _jpeg()
        return imageio.imwrite(
            "<bytes>",
            samples,
            extension=".jpg",
            quality=95,
            subsampling=0,
            comment=text.encode(),
        )
    samples = convert(rgba, bits)
    if suffix == ".png":
        return _with_text(_png(samples), text)
    stream = io.BytesIO()
    extra = ["unassalpha"] if samples.shape[2] == 4 else None
    _tifffile().imwrite(
        stream,
        samples,
        photometric="rgb",
        extrasamples=extra,
        compression="zlib",
        description=f"{KEY} {text}",
        metadata=None,
    )
    return stream.getvalue()


def _png(samples: np.ndarray) -> bytes:
    kinds = {
        (3, 1): ("rgb24", "rgb24"),
        (4, 1): ("rgba", "rgba"),
        (3, 2): ("rgb48le", "rgb48be"),
        (4, 2): ("rgba64le", "rgba64be"),
    }
    given, stored = kinds[samples.shape[2], samples.itemsize]
    av = _av()
    frame = av.VideoFrame.from_ndarray(samples, format=given)
    codec = av.CodecContext.create("png", "w")
    codec.width, codec.height, codec.pix_fmt = frame.width, frame.height, stored
    codec.time_base = Fraction(1, 25)
    codec.options = {"pred": "mixed"}
    packets = [*codec.encode(frame.reformat(format=stored)), *codec.encode(None)]
    return b"".join(bytes(p) for p in packets)


def _with_text(png: bytes, text: str) -> bytes:
    """The PNG with a tEXt chunk after its header (PNG specification, 11.3.3)."""
    body = b"tEXt" + KEY.encode() + b"\0" + text.encode("latin-1", "replace")
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    return png[:_AFTER_HEADER] + chunk + png[_AFTER_HEADER:]
