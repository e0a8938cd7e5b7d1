"""Lines of `wgmb info` about a video."""

from __future__ import annotations

from ...color.coding import Coding
from ...video.read.reader import VideoReader
from ...video.scan import scan_video
from ...video.write.views import described
from ..console import Console
from ..exit_codes import DONE, SOME_FAILED
from ..terminal import out

_KINDS = {"yuv": "Y'CbCr", "rgb": "RGB", "grey": "grey"}
_STEPS = {(2, 2): " 4:2:0", (2, 1): " 4:2:2", (1, 1): " 4:4:4"}


_MATRICES = {0: "RGB", 1: "BT.709", 5: "BT.601", 6: "BT.601", 9: "BT.2020"}
_PRIMARIES = {1: "BT.709", 5: "BT.601 (625 lines)", 6: "BT.601", 9: "BT.2020", 11: "DCI-P3"}
_PRIMARIES |= {12: "Display P3"}
_TRANSFERS = {1: "BT.709", 4: "gamma 2.2", 5: "gamma 2.8", 6: "BT.601", 8: "linear", 13: "sRGB"}
_TRANSFERS |= {14: "BT.2020", 15: "BT.2020", 16: "HDR (PQ)", 18: "HDR (HLG)"}


def _colors(coding: Coding) -> str:
    """Primaries, and where their names differ transfer and matrix, of a video (ITU-T H.273)."""
    primaries = _PRIMARIES.get(coding.primaries, f"primaries {coding.primaries} of H.273")
    transfer = _TRANSFERS.get(coding.transfer, f"{coding.transfer} of H.273")
    matrix = _MATRICES.get(coding.matrix, f"{coding.matrix} of H.273")
    words = [primaries]
    if transfer != primaries:
        words.append(transfer if transfer.startswith("HDR") else f"transfer {transfer}")
    if not primaries.startswith(matrix) and coding.model == "yuv":
        words.append(f"matrix {matrix}")
    return ", ".join(words)


def tell_about(path: str, max_mb: float, scan: bool) -> int:
    """Print the lines about a video; returns the exit code. `scan`: those of all its pictures."""
    reader = VideoReader(path, max_mb=max_mb)
    _print(describe_video(reader))
    if not scan:
        _print([("cuts", "not looked for; --scan decodes the video and lists them")])
        return DONE
    console = Console()
    with console.progress(len(reader), "reading") as tick:
        summary = scan_video(reader, tick)
    _print(summary)
    if scaling := reader.scaling():
        _print([("scaled", scaling)])
    if loss := reader.loss():
        console.complain(loss)
        return SOME_FAILED
    return DONE


def _print(lines: list[tuple[str, str]]) -> None:
    for name, text in lines:
        out(f"{name:10}{text}")


def describe_video(reader: VideoReader) -> list[tuple[str, str]]:
    """(name, text) lines about a video."""
    coding = reader.coding
    kind = _KINDS[coding.model] + (_STEPS.get(coding.steps, "") if coding.model == "yuv" else "")
    extent = "full" if coding.full_range else "limited"
    lines = [
        ("file", str(reader.path)),
        ("video", f"{reader.codec} in {reader.container}"),
        ("size", "{} x {}".format(*reader.size)),
        ("pictures", f"{len(reader)} in {float(reader.duration):.2f} s"),
        ("rate", _rate(reader)),
        ("colour", f"{_colors(coding)}; {kind}, {coding.bits} bits, {extent} range"),
    ]
    if reader.mastering is not None and (display := str(reader.mastering)):
        lines.append(("mastered", f"on a display of {display}"))
    if reader.light_level is not None:
        level = reader.light_level
        text = f"brightest pixel {level.max_cll}, brightest mean of a picture {level.max_fall}"
        lines.append(("light", f"{text} cd/m2 (MaxCLL, MaxFALL)"))
    if coding.alpha:
        lines.append(("alpha", "straight"))
    if reader.pixel_aspect != 1:
        lines.append(("pixels", f"{reader.pixel_aspect} times as wide as high"))
    if reader.rotation:
        lines.append(("rotation", f"turned by {reader.rotation} degrees to be upright"))
    lines += described(reader.facts).items()
    if reader.times[0]:
        lines.append(("begins", f"at {float(reader.times[0]):.3f} s"))
    for stream in reader.streams:
        language = stream.language if stream.language != "und" else ""  # undetermined
        words = [stream.text, language, stream.title]
        lines.append(("stream", f"{stream.kind}: {', '.join(filter(None, words))}"))
    if reader.chapters:
        lines.append(("chapters", str(reader.chapters)))
    return lines + [("note", note) for note in reader.notes]


def _rate(reader: VideoReader) -> str:
    """The rate, and how steady it is."""
    text = f"{float(reader.rate):g} pictures a second"
    if not reader.is_variable:
        return text
    least, most = reader.steps
    return f"{text}, variable: {1000 * least:.1f} to {1000 * most:.1f} ms apart"
