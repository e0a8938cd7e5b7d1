"""What `wgmb info` says of a video."""

from __future__ import annotations

from ..io.footage import Footage

_KINDS = {"yuv": "Y'CbCr", "rgb": "RGB", "grey": "grey"}
_STEPS = {(2, 2): " 4:2:0", (2, 1): " 4:2:2", (1, 1): " 4:4:4"}


def describe_video(footage: Footage) -> list[tuple[str, str]]:
    """(name, text) lines about a video."""
    coding = footage.coding
    kind = _KINDS[coding.model] + (_STEPS.get(coding.steps, "") if coding.model == "yuv" else "")
    extent = "full" if coding.full_range else "limited"
    numbers = f"matrix {coding.matrix}, transfer {coding.transfer}, primaries {coding.primaries}"
    lines = [
        ("file", str(footage.path)),
        ("video", f"{footage.codec} in {footage.container}"),
        ("size", "{} x {}".format(*footage.size)),
        ("pictures", f"{len(footage)} in {float(footage.duration):.2f} s"),
        ("rate", _rate(footage)),
        ("colour", f"{kind}, {coding.bits} bits, {extent} range, {numbers} (ITU-T H.273)"),
    ]
    if coding.alpha:
        lines.append(("alpha", "straight"))
    if footage.pixel_aspect != 1:
        lines.append(("pixels", f"{footage.pixel_aspect} times as wide as high"))
    if footage.rotation:
        lines.append(("rotation", f"turned by {footage.rotation} degrees to be upright"))
    if footage.times[0]:
        lines.append(("begins", f"at {float(footage.times[0]):.3f} s"))
    for stream in footage.streams:
        words = [stream.text, stream.language, stream.title]
        lines.append(("stream", f"{stream.kind}: {', '.join(filter(None, words))}"))
    if footage.chapters:
        lines.append(("chapters", str(footage.chapters)))
    return lines + [("note", note) for note in footage.notes]


def _rate(footage: Footage) -> str:
    """The rate, and how steady it is."""
    text = f"{float(footage.rate):g} pictures a second"
    if not footage.is_variable:
        return text
    least, most = footage.steps
    return f"{text}, variable: {1000 * least:.1f} to {1000 * most:.1f} ms apart"
