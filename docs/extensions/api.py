"""The API reference: everything that `wgmb` exports, on the page of its group.

A page gets its group where it has the comment `<!-- api GROUP -->`.
"""

import inspect
import re

from sphinx.application import Sphinx
from sphinx.util import logging

import wgmb

GROUPS = {
    "blurring": ("blur", "Blur", "Frame", "FrameViews", "Shutter", "METHODS"),
    "sequences": (
        "Clip", "Passes", "Vectors", "Output", "blur_sequence", "BatchReport", "blurred",
        "BlurredFrame", "Result", "Flow", "VectorOutput", "vectors_sequence",
    ),
    "videos": ("blur_video", "blur_pictures", "PictureBlur", "VideoReport"),
    "colours": ("ColorConfig", "ColorSpace", "Display"),
    "cameras": ("Camera", "Reprojections", "CameraFile"),
    "scenes": (
        "Scene", "Body", "CameraPath", "Render", "scene.make", "scene.at", "scene.moving",
        "scene.translation", "scene.rotation", "scene.scaling",
        "scene.OrbitingSphere", "scene.Torus", "scene.Backdrop",
    ),
    "perception": ("Cone", "Observer"),
    "notebooks": ("show", "explore"),
    "errors": ("Error", "InputError", "DeviceError", "GpuMemoryError", "ShaderError"),
}  # fmt: skip

DATA = {"METHODS": "The methods: classes by name."}


def missing() -> list[str]:
    """Names that `wgmb` exports and no group has."""
    grouped = {name.partition(".")[0] for names in GROUPS.values() for name in names}
    return sorted(set(wgmb.__all__) - grouped)


def entries(group: str) -> str:
    """The autodoc directives of a group."""
    blocks = []
    for name in GROUPS[group]:
        found = _find(name)
        if inspect.isclass(found):
            lines = [f".. autoclass:: wgmb.{name}", "   :members:"]
            if "__call__" in vars(found):
                lines.append("   :special-members: __call__")
        elif callable(found):
            lines = [f".. autofunction:: wgmb.{name}"]
        else:
            lines = [f".. py:data:: wgmb.{name}", "", f"   {DATA[name]}"]
        blocks.append("\n".join(("```{eval-rst}", *lines, "```")))
    return "\n\n".join(blocks)


def _find(name: str):
    found = wgmb
    for part in name.split("."):
        found = getattr(found, part)
    return found


def _itemise(app: Sphinx, what: str, name: str, found, options, lines: list[str]) -> None:
    """Make a list of the lines of a docstring that explain one parameter each: "`name`: ..."."""
    made, in_item = [], False
    for line in lines:
        if re.match(r"`\w+`(, `\w+`)*: ", line):
            made += ["", f"* {line}"]
            in_item = True
        elif in_item and line.strip():
            made.append(f"  {line}")
        else:
            made.append(line)
            in_item = False
    lines[:] = made


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = re.sub(r"<!-- api (\w+) -->", lambda mark: entries(mark[1]), source[0])


def _complain(app: Sphinx) -> None:
    if names := missing():
        logging.getLogger(__name__).warning("not in the API reference: %s", ", ".join(names))


def setup(app: Sphinx) -> dict:
    """Called by Sphinx."""
    app.connect("builder-inited", _complain)
    app.connect("source-read", _fill)
    app.connect("autodoc-process-docstring", _itemise)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
