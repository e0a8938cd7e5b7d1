"""Motion vectors as other programs read them: the inverse of vectors.py."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, check_choice
from ..io import data_files, exr, record, stills
from ..io.frame_numbers import has_view
from ..io.suffixes import DEEP
from ..sequence.data_windows import laid
from ..sequence.frame_file import FrameFile
from .output import Output
from .result import Result

FORMS = ("nuke", "rsmb", "blender", "plain", "flo")
"""Whose vectors can be written; CONVENTIONS in vectors.py has the meaning of the numbers."""
MAX_DISPLACE = 2048.0
"""The motion [px] that rsmb's 0 and 1 stand for, unless another is given."""
_OF_THE_PICTURE = ("multiView", "view", "chromaticities", record.KEY)


def written(
    motion: np.ndarray, form: str, max_displace: float = MAX_DISPLACE
) -> dict[str, np.ndarray]:
    """The channels in which a program stores `motion`, (height, width, 4) to_prev, to_next [px].

    Float32. Motion longer than `max_displace` on an axis is clipped in rsmb's.
    """
    px, py, nx, ny = np.moveaxis(motion.astype(np.float32, copy=False), 2, 0)
    if form == "nuke":
        return {"forward.u": nx, "forward.v": -ny, "backward.u": px, "backward.v": -py}
    if form == "blender":
        lead = "ViewLayer.Vector."
        return {f"{lead}X": px, f"{lead}Y": -py, f"{lead}Z": -nx, f"{lead}W": ny}
    if form == "rsmb":
        half = np.float32(0.5 / max_displace)
        red, green = (np.clip(0.5 + v * half, 0, 1) for v in (nx, -ny))
        return {"R": red, "G": green, "B": np.zeros_like(red)}
    if form == "flo":
        return {"u": nx, "v": ny}
    return {"to_prev.x": px, "to_prev.y": py, "to_next.x": nx, "to_next.y": ny}


class VectorOutput(Output):
    """Files of motion vectors in a program's form; `written` makes the numbers.

    `form`: one of FORMS. EXR files are 32-bit floats and have the windows of the input;
    rsmb's may be PNG or TIFF of 16 bits too, which cover the display window, and have
    `max_displace` in their records. A .flo covers it too, and has no record: it cannot be resumed.
    Alpha of rsmb's is 1 where the vectors are valid. `max_displace`: of rsmb's [px]. `mask_of`: the
    channel of a frame that is 1 where its vectors are valid (Clip.vector_mask). `clipped` has the
    number of pixels that rsmb's form clipped, by frame. The others are as for Output.
    """

    _ENDS = (".exr", *DEEP, data_files.FLO)

    def __init__(
        self,
        pattern: str | Path,
        form: str,
        *,
        numbers: list[int],
        max_displace: float | None = None,
        mask_of: Callable[[FrameFile], str | None] = lambda source: None,
        settings: dict[str, Any] | None = None,
        inputs: Iterable[Path] = (),
        overwrite: bool = False,
        resume: bool = False,
        views: Sequence[str] = (),
    ):
        _check(str(pattern), form, max_displace, resume)
        self._form, self._mask_of = form, mask_of
        self._has_record = form != "flo"
        self._max_displace = MAX_DISPLACE if max_displace is None else max_displace
        unit = {"max_displace": self._max_displace} if form == "rsmb" else {}
        super().__init__(
            pattern,
            settings=(settings or {}) | {"as": form} | unit,
            numbers=numbers,
            bits=16 if str(pattern).lower().endswith(DEEP) else 8,
            inputs=inputs,
            overwrite=overwrite,
            resume=resume,
            views=views,
        )
        self.clipped: dict[int, int] = {}

    @property
    def takes_views(self) -> bool:
        """True if there is a file for each view."""
        return has_view(self.pattern)

    def _encoded(self, path: Path, view: str | None, results: Sequence[Result], text: str) -> bytes:
        (result,) = results
        source, motion = result.source, result.picture
        channels = written(motion, self._form, self._max_displace)
        if self._form == "rsmb":
            channels["A"] = self._valid(source, motion)
            over = np.abs(motion[..., 2:]).max(axis=2) > self._max_displace
            if count := int(over.sum()):
                self.clipped[source.number] = self.clipped.get(source.number, 0) + count
        if self._form == "flo":
            shown = source.data_window, source.display_window
            return data_files.encode_flo(
                np.stack([laid(channels[c], *shown) for c in "uv"], axis=2)
            )
        if path.suffix.lower() == ".exr":
            return exr.encode(_file(source, channels, {record.KEY: text}, view))
        return stills.encode(_in_display(source, channels), path.suffix, 16, text, _as_data)

    def _valid(self, source: FrameFile, motion: np.ndarray) -> np.ndarray:
        """Float32, 1 where the vectors are valid, else 0."""
        valid = np.ones(motion.shape[:2], np.float32)
        if mask := self._mask_of(source):
            valid[(source.channels[mask] < 1) & ~motion.any(axis=2)] = 0
        return valid


def _check(pattern: str, form: str, max_displace: float | None, resume: bool) -> None:
    check_choice("`form`", form, FORMS)
    ends = {"rsmb": (".exr", *DEEP), "flo": (data_files.FLO,)}.get(form, (".exr",))
    if not pattern.lower().endswith(ends):
        raise InputError(f"output {pattern}: {form} vectors need {' or '.join(ends)}")
    if resume and form == "flo":
        raise InputError("`resume` needs the record of a file, which a .flo cannot hold")
    if max_displace is not None and form != "rsmb":
        raise InputError(f"`max_displace` is for rsmb vectors, {form} vectors are in pixels")
    if max_displace is not None and not 0 < max_displace < 1e6:
        raise InputError(
            f"`max_displace` must be over 0 and under 1000000 px, got {max_displace:g}"
        )


def _file(
    source: FrameFile, channels: dict[str, np.ndarray], attributes: dict[str, Any], view: str | None
) -> exr.Exr:
    """A file of one part with the windows, and the time and camera, of the source's picture."""
    kept = {
        name: value
        for name, value in (source.part.attributes if source.part else {}).items()
        if name not in _OF_THE_PICTURE and not name.startswith("cryptomatte/")
    }
    kept |= attributes | ({"view": view} if view is not None else {})
    part = exr.Part("", channels, kept, source.data_window, source.display_window)
    return exr.Exr(source.path, [part])


def _in_display(source: FrameFile, channels: dict[str, np.ndarray]) -> np.ndarray:
    """RGBA in the display window; pixels around the data do not move, and are not valid."""
    planes = [
        laid(channels[c], source.data_window, source.display_window, empty=empty)
        for c, empty in zip("RGBA", (0.5, 0.5, 0.0, 0.0), strict=True)
    ]
    return np.stack(planes, axis=2)


def _as_data(rgba: np.ndarray, bits: int, over_black: bool = False) -> np.ndarray:
    """Samples 0..1 as whole numbers, without any curve for display."""
    return np.rint(rgba * (2**bits - 1)).astype(np.uint16)
