"""Open video files for reading; a fault is an error of one line."""

from __future__ import annotations

import errno
import math
import os
from pathlib import Path

import av
from av.codec.context import Flags
from av.container import InputContainer
from av.error import FFmpegError
from av.stream import Disposition
from av.video.stream import VideoStream

from ...errors import InputError
from ...files import bounded
from ...io import limits, watch
from ...io.frame_numbers import readable
from .boxes import boxes, check_counts

_MOST_PIXELS = 2**31 - 1  # that FFmpeg's option takes
_MOST_STREAMS = 1000  # that FFmpeg makes of a file; it leaves others out
_MOST_CODED = 100  # of pictures and sound, of which each may take a megabyte
_BEGINNING = 1 << 20  # bytes
_LONGEST = 60.0, 60.0  # seconds that opening, and reading once, may take
_LISTS = b"ffconcat", b"#EXTM3U", b"v=0", b"<?xml", b"<MPD"  # that name other files
# FFmpeg's readers of one file that holds moving pictures. No reader of lists (concat, hls, dash,
# imf, sdp, image2, ...), of scripts or devices, nor one that opens more files by itself (mlv).
READERS = (
    "4xm,anm,apng,asf,asf_o,av1,avi,avs,avs2,avs3,bethsoftvid,bfi,bink,c93,cavsvideo,cdg,cdxl,"
    "cine,dfa,dhav,dirac,dnxhd,dsicin,dv,dxa,ea,evc,film_cpk,filmstrip,flic,flv,frm,gdv,gif,gxf,"
    "h261,h263,h264,hevc,hnm,idcin,iff,ifv,ingenient,ipmovie,ipu,iv8,ivf,ivr,jpegxl_anim,jv,kux,"
    "live_flv,lmlm4,lvf,lxf,m4v,matroska,mgsts,mjpeg,mjpeg_2000,mm,mods,moflex,mov,mpeg,mpegts,"
    "mpegvideo,mpjpeg,msnwctcp,mtv,mv,mvi,mxf,mxg,nc,nsv,nut,nuv,obu,ogg,paf,pdv,pmp,pva,r3d,rl2,"
    "rm,roq,rpl,sdr2,ser,sga,siff,simbiosis_imx,smjpeg,smk,smush,swf,thp,tiertexseq,tmv,txd,ty,"
    "usm,v210,v210x,vc1,vc1test,vividas,vivo,vmd,vvc,wc3movie,webp_pipe,wsvqa,wtv,xmv,yop,yuv4mpegpipe"
)
_BOXES = (b"ftyp", b"mdat", b"wide", b"free", b"skip", b"pnot")  # that begin an MP4 or MOV


def opened(path: Path, max_mb: float = limits.MAX_MB, *, is_known: bool = False) -> InputContainer:
    """The file, open for reading; InputError in one line that names it.

    Nothing else is read: no other file, and nothing from a network, whatever it refers to. Its
    index may take an eighth of `max_mb` megabytes (see limits.py), unless the file `is_known` from
    an opening before. Larger pictures than that allows are not decoded. Ctrl-C does not wait.
    """
    stored = size_of(path)

    def work() -> InputContainer:
        if not is_known:
            check_counts(path, max_mb)
        container = av.open(
            f"file:{os.fspath(path)}",
            options=bound,
            container_options={
                "protocol_whitelist": "file",
                "format_whitelist": READERS,
            },
            timeout=_LONGEST,
            metadata_errors="replace",
        )
        _check_streams(path, container)
        bound_pictures(container, bound)
        for stream in container.streams.video:
            if stream.codec_context is not None:  # else it crops the left in steps of 32 bytes
                stream.codec_context.flags |= Flags.unaligned
        return container

    bound = largest_picture(stored, max_mb)
    try:
        return watch.watched(path, work, stored, math.inf if is_known else max_mb)
    except (FFmpegError, OSError, UnicodeError) as error:
        raise InputError(f"{path}: {_what_is_wrong(path, error)}") from None


def _check_streams(path: Path, container: InputContainer) -> None:
    """InputError for a file of too many streams, of which FFmpeg may have left some out."""
    count = len(container.streams)
    coded = sum(one.type in ("video", "audio") for one in container.streams)
    if count < _MOST_STREAMS and coded <= _MOST_CODED:
        return
    container.close()
    raise InputError(
        f"{path}: has {count} streams, {coded} of them pictures and sound; "
        f"at most {_MOST_STREAMS - 1} and {_MOST_CODED} are read"
    )


def size_of(path: Path) -> int:
    """The length of a file in bytes; InputError in one line where there is nothing to read."""
    if not readable(path):
        raise bounded.missing(path)
    if not (stored := path.stat().st_size):
        raise InputError(f"{path}: is empty")
    return stored


def largest_picture(stored: int, max_mb: float) -> dict[str, str]:
    """FFmpeg's option that bounds the pictures of a file of `stored` bytes; see limits.check.

    Codecs round sizes up to their blocks, so that it is an eighth more.
    """
    most = limits.most_pixels(stored, limits.AVERAGED, max_mb)
    return {"max_pixels": str(min(most + most // 8, _MOST_PIXELS))}


def bound_pictures(container: InputContainer, bound: dict[str, str]) -> None:
    """Bound the pictures that the decoders make, whose size may change within a stream.

    Decoders of formats with checksums, such as PNG, refuse pictures whose checksum is wrong.
    """
    more = bound | {"err_detect": "crccheck"}
    for stream in container.streams.video:
        if stream.codec_context is not None:
            stream.codec_context.options = stream.codec_context.options | more


def picture_stream(container: InputContainer, path: Path | str) -> VideoStream:
    """The stream of moving pictures: the one FFmpeg thinks best, but never a cover, nor the alpha.

    Animated AVIF holds alpha as grey pictures in a stream of its own, which may be thought best.
    """
    streams = [s for s in container.streams.video if not s.disposition & Disposition.attached_pic]
    if not streams:
        there = ", ".join(dict.fromkeys(s.type for s in container.streams)) or "nothing"
        raise InputError(f"{path}: has no pictures that move; it holds {there}")
    best = container.streams.best("video")
    chosen = next((s for s in streams if best is not None and s.index == best.index), streams[0])
    if _is_grey(chosen):
        colored = (s for s in streams if s.frames == chosen.frames and not _is_grey(s))
        chosen = next(colored, chosen)
    if chosen.codec_context is None:
        raise InputError(f"{path}: its pictures are of a codec that is not known here")
    return chosen


def has_alpha_beside(container: InputContainer, pictures: VideoStream) -> bool:
    """Return True if another stream holds the transparency of the pictures, as in animated AVIF."""
    return any(
        _is_grey(other) and other.frames == pictures.frames > 1
        for other in container.streams.video
        if other.index != pictures.index and not _is_grey(pictures)
    ) and "avis" in str(container.metadata.get("major_brand", ""))


def _is_grey(stream: VideoStream) -> bool:
    context = stream.codec_context
    return context is not None and (context.pix_fmt or "").startswith("gray")


def _what_is_wrong(path: Path, error: Exception) -> str:
    if _lacks_index(path):
        return "is cut off: its index (moov), which comes last, is missing"
    with open(path, "rb") as file:
        beginning = file.read(_BEGINNING)
    if beginning.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(_LISTS):
        return "is a list of other files, which is not opened; name the video itself"
    if getattr(error, "errno", 0) == errno.ENOMEM:
        return f"has over {_MOST_STREAMS} streams, or asks for more memory than there is"
    if getattr(error, "errno", 0) == errno.EINVAL:
        return "is no kind of video that is read"
    text = getattr(error, "strerror", None) or str(error)
    if getattr(error, "errno", 0) and not isinstance(error, ValueError):
        return text.lower()
    if b"encv" in beginning:
        return "is encrypted"
    return "is not a video, or its beginning is damaged"


def _lacks_index(path: Path) -> bool:
    """Return True for an MP4 or MOV whose boxes end without a moov."""
    kinds: list[bytes] = []
    with open(path, "rb") as file:
        for box in boxes(file, 0, path.stat().st_size):
            if box.kind == b"moov" or (not kinds and box.kind not in _BOXES):
                return False
            kinds.append(box.kind)
    return bool(kinds)
