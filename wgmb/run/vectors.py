"""Motion vectors of frames in the form of another program: a request, and its run."""

from __future__ import annotations

from dataclasses import dataclass

import wgpu

from ..errors import InputError
from ..output.vectors import VectorOutput
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..settings import InputSettings
from ..settings.record import record
from .report import BatchReport, Progress
from .sequence import vectors_sequence


@dataclass(frozen=True, kw_only=True)
class VectorsRequest:
    """Request to write vectors, as `wgmb vectors` receives it; `form`: one of FORMS."""

    pattern: str
    output: str
    form: str
    input: InputSettings
    max_displace: float | None = None
    overwrite: bool = False
    resume: bool = False

    def open(self, device: wgpu.GPUDevice | str | None = None) -> VectorsRun:
        """Open frames, GPU and output; InputError for frames without motion."""
        clip = self.input.open(self.pattern)
        has = clip.inspect().has
        settings = record(self.input, **{"as": self.form}, max_displace=self.max_displace)
        if has and "motion" not in has:
            raise InputError(f"{self.pattern}: no motion to write (neither vectors nor a camera)")
        blur = Blur("tap", device=device)
        files = VectorOutput(
            self.output,
            self.form,
            numbers=clip.numbers,
            max_displace=self.max_displace,
            mask_of=clip.vector_mask,
            settings=settings,
            inputs=clip.dependencies.every(),
            overwrite=self.overwrite,
            resume=self.resume,
            views=clip.chosen,
        )
        return VectorsRun(clip, blur, files, self.resume)


@dataclass(frozen=True)
class VectorsRun:
    """Frames, a GPU and an output of vectors; call it."""

    clip: Clip
    blur: Blur
    output: VectorOutput
    resume: bool

    def __call__(self, progress: Progress | None = None) -> BatchReport:
        """Write the vectors of every frame; see vectors_sequence."""
        return vectors_sequence(
            self.clip, self.output, blur=self.blur, resume=self.resume, progress=progress
        )
