"""The EXR file of a result: its source's file with the pictures replaced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..io import exr, record
from ..sequence.data_windows import laid, union
from ..sequence.frame_file import FrameFile
from ..sequence.input_color import chromaticities, relabelled
from ..sequence.layers import stereo
from .result import Result

_OF_TIME = "framesPerSecond", "timeCode", "keyCode"  # attributes


def with_results(
    results: Sequence[Result], view: str | None, text: str, only_picture: bool, grows: bool
) -> exr.Exr:
    """The source's file with its pictures replaced, confidence and the record's text added.

    `view`: without layers of other views. `only_picture`: without all other layers, and
    without the description of Cryptomattes. `grows`: parts with a picture have a data window that
    holds it.
    """
    source = results[0].source
    if source.file is None:
        made = exr.new(results[0].picture, chromaticities(source.space) | {record.KEY: text})
        made.parts[0].channels |= _confidence(results[0], made.parts[0])
        return made
    parts = [_twin(part, results if grows else ()) for part in source.file.parts]
    twins = dict(zip(map(id, source.file.parts), parts, strict=True))
    new: set[tuple[int, str]] = set()
    for result in results:
        home, space = result.source.part, result.source.space
        assert home is not None
        if space is not None and result.source.made_linear:
            twins[id(home)].attributes = relabelled(twins[id(home)].attributes, space)
        written = {full: i for i, full in enumerate(result.source.color) if full}
        for full, i in written.items():
            part, name = _place(result.source, full)
            kind = result.source.channels[full].dtype
            plane = laid(result.picture[..., i], result.canvas, twins[id(part)].data_window)
            plane = exr.to_half(plane) if kind == np.float16 else plane.astype(kind)
            twins[id(part)].channels[name] = plane
            new.add((id(twins[id(part)]), name))
    if any(result.is_converted for result in results):
        for part in parts:
            for name in _OF_TIME:
                part.attributes.pop(name, None)
    if only_picture:
        _keep(parts, new)
        for part in parts:
            for name in [n for n in part.attributes if n.startswith("cryptomatte/")]:
                del part.attributes[name]
    elif view is not None:
        _keep(parts, {(id(twins[id(part)]), name) for part, name in source.origin.values()} | new)
    for result in results:
        home = twins[id(result.source.part)]
        home.channels |= _confidence(result, home)
    if view is not None:
        for part in parts:
            stereo.leave_only(part, view)
    parts = [part for part in parts if part.channels]
    parts[0].attributes[record.KEY] = text
    return exr.Exr(source.path, parts)


def _place(source: FrameFile, channel: str) -> tuple[exr.Part, str]:
    """The part that a channel of the picture is in, and its name there."""
    assert source.part is not None
    return source.origin.get(channel, (source.part, channel))


def _twin(part: exr.Part, results: Sequence[Result]) -> exr.Part:
    """A copy of `part` whose window holds the pictures that are in it."""
    windows = [
        result.window
        for result in results
        if any(_place(result.source, name)[0] is part for name in result.source.color)
    ]
    onto = union([part.data_window, *windows])
    channels = {k: laid(plane, part.data_window, onto) for k, plane in part.channels.items()}
    return replace(part, channels=channels, attributes=dict(part.attributes), data_window=onto)


def _confidence(result: Result, part: exr.Part) -> dict[str, np.ndarray]:
    """Confidence as channels of `part`."""
    view = result.source.view or ""
    return {
        stereo.joined("confidence", view, name, part): exr.to_half(
            laid(plane, result.canvas, part.data_window)
        )
        for name, plane in result.confidence.items()
    }


def _keep(parts: list[exr.Part], wanted: set[tuple[int, str]]) -> None:
    """Drop all other channels; `wanted`: ids of parts, and names in them."""
    for part in parts:
        part.channels = {k: v for k, v in part.channels.items() if (id(part), k) in wanted}
