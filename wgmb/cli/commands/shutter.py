"""`wgmb shutter`: draw a shutter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from ... import charts
from ...errors import InputError
from ...io.atomic import mode_of, write_file
from ...shutter import OVERLAPS
from ..options import ShutterOptions, Shutters
from ..terminal import out


def shutter(
    shutter: Shutters = ShutterOptions(),
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    overwrite: bool = False,
) -> int:
    """Draw a shutter: its curve, its integral, and the sum of neighbouring windows.

    Without --shutter, the angle is the one whose windows add up to 1, else 360 degrees.

    Example: wgmb shutter --curve cosine -o shutter.svg

    Parameters
    ----------
    output
        Name of the drawing, .svg.
    overwrite
        Replace an existing file.
    """
    if output.suffix.lower() != ".svg":
        raise InputError(f"output {output}: the name must end in .svg")
    if output.exists() and not overwrite:
        raise InputError(f"{output} exists; --overwrite replaces it")
    if shutter.shutter is None:
        shutter = replace(shutter, shutter=OVERLAPS.get(shutter.curve or "box", 360.0))
    made, name = shutter.resolved().make(), shutter.curve or "box"
    drawing = charts.svg(*charts.shutter_charts(made, Path(name).name))
    write_file(output, drawing.encode(), mode=mode_of(output.parent, [Path(name)]))
    total = made.overlap(np.linspace(0, 1, 2001))
    low, high = round(float(total.min()), 3), round(float(total.max()), 3)
    even = high - low < 0.01
    text = "add up to 1" if even else f"add up to {low:g} to {high:g}"
    out(f"{name}, {made.degrees:g} degrees: all frames' windows {text}")
    return 0
