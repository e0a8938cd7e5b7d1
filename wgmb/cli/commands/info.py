"""`wgmb info`: a readable description of a frame, and its motion as an image."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from ...color.spaces import Display
from ...color.srgb import motion_picture
from ...errors import InputError, counted
from ...extras import needed_by
from ...frame import bad_colors
from ...io import stills
from ...io.atomic import mode_of, write_file
from ...io.frame_numbers import frame_list
from ...output.names import refuse_inputs
from ...pipeline.blur import Blur
from ...sequence.clip import Clip
from ...sequence.frame_file import FrameFile, is_video
from ...sequence.input_color import space_of
from ...sequence.layers import names
from ...settings.color import ColorSettings
from ...settings.groups import changed
from ..console import Console
from ..exit_codes import DONE
from ..names import frames_at
from ..options import Colors, InputOptions, Inputs
from ..spelling import as_options
from ..terminal import out

_FIRST = 3  # frames in which poses that are held are looked for
_MUCH = 0.25  # of the width: a 99th percentile of speed above it is worth a warning


def info(
    pattern: str,
    /,
    input: Inputs = InputOptions(),
    color: Colors = ColorSettings(),
    *,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    overwrite: bool = False,
    scan: bool = False,
) -> int:
    """Describe a frame or a video: layers, sizes, motion vector convention, speeds.

    Example: wgmb info 'shot.####.exr' --frames 10 -o motion.png

    Example: wgmb info clip.mp4 --scan

    Parameters
    ----------
    pattern
        File or pattern, whose first frame is described, its vectors tested on the neighbours; or a
        video, whose streams, times and colours are described.
    output
        Draw the motion as an image: hue is direction, brightness is speed.
    overwrite
        Replace an existing image.
    scan
        Decode a video to its end, and list its cuts, flashes and repeated pictures.
    """
    if is_video(pattern):
        with needed_by(pattern, "video"):
            from .info_video import tell_about
        if output is not None:
            raise InputError("`output` draws the motion of rendered frames, a video holds none")
        for name in changed(input):
            if name != "max_mb":
                raise InputError(f"`{name}` is for rendered frames; a video is described whole")
        Console().say(color.unused_by_videos())
        return tell_about(pattern, input.max_mb, scan)
    if scan:
        raise InputError("`scan` is for videos")
    shown = color.open()
    source = frames_at(pattern, input)
    clip = source.input.open(source.pattern, space=color.space(shown))
    Console().say(color.remark)
    if output is not None and output.exists() and not overwrite:
        raise InputError(f"{output} exists; --overwrite replaces it")
    lines = describe(clip, output, shown)
    lines[1:1] = [("program", as_options(input.remark))] if input.remark else []
    lines[:0] = [("folder", source.text)] if source.text else []
    for name, text in lines:
        out(f"{name:10}{text}")
    return DONE


def describe(
    clip: Clip, output: Path | None = None, display: Display | None = None
) -> list[tuple[str, str]]:
    """Return (name, text) lines about the clip's first frame; `output`: draw its motion.

    `display`: say what its colours are in that config, and how they would be shown.
    """
    if output is not None and output.suffix.lower() not in stills.SUFFIXES:
        raise InputError(f"output {output}: must be an image, {', '.join(stills.SUFFIXES)}")
    if output is not None:
        refuse_inputs(output.parent, [output.name], [output], clip.dependencies.every())
    clip.inspect()
    source = clip.source(clip.numbers[0])
    lines = [("file", str(source.path))]
    if len(clip.numbers) > 1:
        lines.append(("frames", f"{frame_list(clip.numbers)} ({len(clip.numbers)})"))
    lines.append(("size", "{} x {}".format(*source.size)))
    for part in source.file.parts if source.file else ():
        if part.data_window != part.display_window:
            lines.append(("window", f"data {part.data_window} in display {part.display_window}"))
    if clip.views:
        lines.append(("views", _views_text(clip, source)))
    for layer, members in names.layers(source.channels).items():
        kinds = [f"{names.component(m).upper()} {source.channels[m].dtype}" for m in members]
        lines.append(("layer", f"{layer or '(picture)'}: {', '.join(kinds)}"))
    beginning = len(lines)
    color = (
        ", ".join(dict.fromkeys(filter(None, source.color)))
        if source.reference_channel
        else "none found"
    )
    lines.append(("picture", color))
    if display is not None:
        space = space_of(source, display.config)
        text = space.text + ("" if space.is_linear else ", not linear: --from makes it so")
        lines.append(("colour", f"{text}; shown on {display.display}, {display.view}"))
    depth = names.find_depth(source.channels, clip.passes.depth, source.reference_channel)
    lines.append(("depth", depth or "none"))
    lines.append(("vectors", as_options(clip.finding)))
    lines.append(("light", clip.light_passes(source).text))
    if valid := clip.vector_mask(source):
        lines.append(("valid", f"vectors are used where {valid} is 1"))
    lines += _about_motion(clip, source, output)
    notes = [("note", as_options(text)) for text, on in clip.notes.items() if source.number in on]
    lines += _about_poses(clip)
    return [*lines[:beginning], *notes, *lines[beginning:]]


def _views_text(clip: Clip, source: FrameFile) -> str:
    """Return the names of the views, and of the layers that are in none."""
    first, *others = clip.views
    text = ", ".join((f"{first} (default)", *others))
    if source.shared:
        text += f"; in no view: {', '.join(names.layers(source.shared))}"
    return text if source.view == first else f"{text}; here: {source.view}"


def _about_poses(clip: Clip) -> list[tuple[str, str]]:
    """Return a line if the first frames hold poses: frames on ones may come before them."""
    held = clip.held_poses(_FIRST)
    if not held:
        return []
    where = f"at {'frame' if len(held) == 1 else 'frames'} {frame_list(held)}"
    text = f"held, as in animation on twos ({where}): jumps are not blurred; --twos off blurs them"
    return [("poses", text)]


def _about_motion(clip: Clip, source: FrameFile, output: Path | None) -> list[tuple[str, str]]:
    """Return lines about the frame's motion, and draw it into `output`."""
    frame = clip.frame(source, picture=False, normal=False, light=False)
    lines, bad = [], dict(frame.bad)
    if source.reference_channel is not None:
        colors = bad_colors([source.channels[name] for name in source.color if name])
        bad = {"color": colors, **bad} if colors else bad
    if bad:
        counts = [f"{counted(n, 'pixel')} of {name}" for name, n in bad.items()]
        lines.append(("bad", f"not finite or not in front of the camera: {', '.join(counts)}"))
    if "motion" not in frame.has:
        if output:
            raise InputError(f"{source.path}: no motion to draw (neither vectors nor a camera)")
        return lines
    motion = Blur("tap").motion(frame)[..., 2:]
    speed = np.hypot(motion[..., 0], motion[..., 1])
    half, most, nearly, fastest = np.percentile(speed, (50, 90, 99, 100))
    lines.append((
        "speed",
        f"pixels per frame: half are under {half:.1f}, 90 % under {most:.1f}, "
        f"99 % under {nearly:.1f}, the fastest is {fastest:.1f}",
    ))  # fmt: skip
    if nearly > _MUCH * frame.size[0]:
        lines.append((
            "warning",
            f"one pixel in a hundred moves over {nearly:.0f} px, a quarter of the width: "
            "check the vectors' convention and scale",
        ))  # fmt: skip
    if output is not None:
        full = max(float(nearly), 1.0)
        picture = motion_picture(motion, full)
        mode = mode_of(output.parent, clip.dependencies.every())
        write_file(output, stills.encode(picture, output.suffix, 8, "motion"), mode=mode)
        lines.append(("motion", f"{output} (full brightness: {full:.1f} px per frame)"))
    return lines
