"""A fully resolved run over rendered frames: its settings, and findings about the whole sequence.

`settle` looks at the sequence once. Any of the frames can then be blurred by any process, in a run
of its own, and have the bytes that one run over all of them gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import gpu
from ..color.spaces import ColorSpace, Display
from ..errors import InputError
from ..io import atomic
from ..io.frame_numbers import frame_list, frame_path, has_view, in_view, numbered
from ..io.suffixes import STILLS
from ..methods import METHODS, check_method
from ..output.names import check_suffix
from ..output.output import Output
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from ..sequence.findings import SequenceFindings
from ..sequence.frame_file import about
from ..sequence.input_color import space_of
from ..sequence.layers.masks import is_file, with_amount
from ..settings import OutputSettings
from ..settings.groups import changed
from ..settings.recipes import by_place
from ..settings.record import record
from ..settings.video import OF_FRAMES, VideoSettings
from ..shots.cut_list import CutList
from ..threads import Stop
from .conversion import RateConversion, RateConversionStages
from .engine import RunOptions
from .report import BatchReport, Progress
from .request import BlurRequest, check_needs
from .sequence import blur_into
from .stages import Stages

if TYPE_CHECKING:
    from .picture_stages import PictureRoad

_OWN = 0.5  # frame intervals around a frame that it stands for
_OF_VECTORS = "vector_scale", "vector_offset", "vector_flip", "vector_mask"  # of InputSettings
_OF_DEPTH = "depth_kind", "far"


@dataclass(frozen=True, eq=False)
class Job:
    """A run whose every frame is settled; `settle` makes one, run/job_file.py keeps it in a file.

    `request`: with the method, the shutter and the way to motion that were chosen. `settings`: the
    record of every frame. `findings`: those about the whole sequence (Clip.inspect). `flow`: where
    motion comes from, in words, if the frames hold none. `since`: files in the output that are
    older [ns since 1970] are not done; None: they may be.
    `is_part_of_run`: another process has looked at the outputs that exist.
    """

    request: BlurRequest
    settings: dict[str, Any]
    numbers: list[int]
    findings: SequenceFindings
    flow: str = ""
    since: int | None = None
    is_part_of_run: bool = False
    clip_opened: tuple[Clip, Display | None] | None = field(default=None, repr=False)
    remarks: tuple[str, ...] = ()

    @cached_property
    def _opened(self) -> tuple[Clip, Display | None]:
        if self.clip_opened is not None:
            return self.clip_opened
        clip, shown = self.request.opened(self.findings)
        self._check_machine(shown)
        return clip.part(self.numbers), shown

    @property
    def clip(self) -> Clip:
        """The frames; of a job from a file they are opened by this."""
        return self._opened[0]

    @property
    def is_shown(self) -> bool:
        """True if a config of OpenColorIO is in use."""
        return self._opened[1] is not None

    def _check_machine(self, display: Display | None) -> None:
        """InputError if colours or the shutter's curve are others here than they were."""
        for name, value in self.request.color_record(display).items():
            if self.settings.get(name) != value:
                was = self.settings.get(name)
                raise InputError(f"{name.replace('_', ' ')} is {value} here, but {was} in the job")
        curve = self.request.shutter.curve_read()
        if curve and curve.rpartition(" (")[2] != str(self.settings["curve"]).rpartition(" (")[2]:
            raise InputError(f"{self.request.shutter.curve} has changed since the job was written")

    def chosen(self, numbers: Sequence[int]) -> list[int]:
        """These frames; InputError if the job has not all of them."""
        if strange := sorted(set(numbers) - set(self.numbers)):
            raise InputError(
                f"`frames` {frame_list(strange)} are not in the job, "
                f"which has {frame_list(self.numbers)}"
            )
        return list(numbers)

    def run(self, adapter: str | None = None, numbers: Sequence[int] | None = None) -> Run:
        """Open the GPU and the output, for all frames or for some of them."""
        return self.run_with(self.made_blur(adapter), numbers)

    def made_blur(self, adapter: str | None = None) -> Blur:
        """The method, compiled on an adapter."""
        return self.request.blur.make(self.request.shutter.make(), adapter)

    def run_with(self, blur: Blur, numbers: Sequence[int] | None = None) -> Run:
        """`run` with a Blur that may serve many runs."""
        clip, _ = self._opened
        if numbers is not None:
            clip = clip.part(self.chosen(numbers))
        road = self._road(clip, blur) if self.flow else None
        if expansion := self.request.video.expansion:
            clip.expand_highlights(expansion.white)
        files = self.make_output(None if numbers is None else clip)
        request = self.request
        return Run(clip, blur, files, self._resumes, request.confidence, request.conversion, road)

    def _road(self, clip: Clip, blur: Blur) -> PictureRoad | None:
        """The choices for frames without vectors; None where each is blurred by itself."""
        from .picture_stages import PictureRoad, are_pictures  # only where it is needed

        request = self.request
        motion = by_place() if request.is_by_place else request.video.source(blur.device)[0]
        clip.move_by(motion)
        if motion is None or request.confidence or request.blur.scale or not are_pictures(clip):
            return None
        at_edges = None
        if request.has_edges_gathered:
            at_edges = request.blur.at_edges(blur.shutter, blur.device)
        is_still = Path(request.output.output).suffix.lower() in STILLS and not self.is_shown
        bits = request.output.bits if is_still else 0
        cuts = CutList(request.input.cuts or "").is_search
        return PictureRoad(motion, at_edges, not request.blur.holdout, cuts, bits)

    @property
    def _resumes(self) -> bool:
        return self.request.output.resume or self.is_part_of_run

    def make_output(self, part: Clip | None = None) -> Output:
        """The files of all frames, or of a `part` of them; see there for errors."""
        clip, shown = self._opened
        output = replace(self.request.output, resume=self._resumes)
        conversion = self.request.conversion
        inputs, numbers = (
            clip.dependencies.every(),
            conversion.numbers(clip) if conversion else clip.numbers,
        )
        if part is not None:  # those of the others were looked at when the job was made
            inputs, numbers = (
                (p for n in part.numbers for p in part.dependencies.of(n)),
                part.numbers,
            )
        return output.make(self.settings, numbers, inputs, clip.chosen, shown, self.since)

    def sweep(self) -> None:
        """Remove the job's unfinished files of dead processes of this host; see atomic.sweep."""
        pattern = self.request.output.output
        for view in self.clip.chosen if has_view(pattern) else (None,):
            of_view = in_view(pattern, view)
            names = [frame_path(of_view, n).name for n in self.numbers]
            if of_view.parent.is_dir():
                atomic.sweep(of_view.parent, names)


@dataclass(frozen=True, eq=False)
class Run:
    """Frames, a Blur and an output; call it."""

    clip: Clip
    blur: Blur
    output: Output
    resume: bool
    confidence: bool
    conversion: RateConversion | None = None
    road: PictureRoad | None = None
    """Of frames without vectors, which are blurred as the pictures of a video."""

    @property
    def numbers(self) -> list[int]:
        """The frames of the output."""
        return self.conversion.numbers(self.clip) if self.conversion else self.clip.numbers

    def __call__(self, progress: Progress | None = None, stop: Stop | None = None) -> BatchReport:
        """Blur every frame; see blur_sequence."""
        options = RunOptions(self.resume, progress, stop, on_error="go on")
        stages = self._stages()
        report = blur_into(self.output, stages, options)
        report.notes |= {text: list(report.done) for text in stages.messages}
        return report

    def _stages(self) -> Stages:
        all_views = self.output.takes_views
        if self.road is not None:
            from .picture_stages import PictureStages

            return PictureStages(self.clip, self.blur, self.road, self.conversion, all_views)
        if self.conversion is not None:
            return RateConversionStages(self.clip, self.blur, self.conversion, all_views)
        return Stages(self.clip, self.blur, self.confidence, all_views)


def settle(request: BlurRequest, adapter: str | None = None) -> Job:
    """Look at the frames (Clip.inspect), and choose what was left to them: method and motion.

    A GPU is opened only where the frames hold no motion and `flow` is "auto". InputError where the
    settings make no sense together.
    """
    if request.blur.method is not None:
        check_method(request.blur.method, of_frames=True)
    if request.shutter.seconds is None:  # says what is wrong with it
        request.shutter.make()
    check_suffix(request.output.output)
    check_fits(request)
    clip, shown = request.opened()
    findings = clip.inspect()
    request = replace(request, shutter=request.shutter.resolved(fps=_rate(request, clip)))
    clip.builder.check_layers()
    remarks = [
        *_without_effect(request, findings),
        request.input.remark,
        request.shutter.remark,
        *map(_of_scale, request.blur.scale),
        _of_cuts(request.input.cuts, clip),
    ]
    if request.color.space(shown) is None:
        remarks.append(_check_space(clip, shown))
    request = replace(request, averages=_averages(findings, request))
    conversion = request.conversion
    if conversion:
        remarks.append(_of_conversion(conversion, clip, request.output))
        if request.output.is_exr:
            request = replace(request, output=replace(request.output, layers="picture"))
    video, how = _motion(findings, request, adapter)
    is_by_place = bool(how) and request.video.flow == "auto" and video.flow == "dis"
    has_edges = is_by_place and request.blur.method is None
    request = replace(request, is_by_place=is_by_place, has_edges_gathered=has_edges)
    if how:
        blur = replace(request.blur, method=request.blur.method or video.method).for_pictures()
    else:
        blur = request.blur.resolved(has=findings.has)
        check_needs(clip, blur.method or "")
    request = replace(request, blur=blur, video=video)
    blur, output = request.blur, request.output
    request.shutter.make()  # says what is wrong with it
    samples = blur.settled_samples()
    settings = record(blur, request.shutter, request.input, output, samples=samples)
    settings |= request.color_record(shown)
    if request.confidence:
        check_confidence(blur.method or "", output)
        settings["confidence"] = True
    if conversion:
        settings |= {"fps_in": str(conversion.fps_in), "fps": str(conversion.fps)}
    if request.color.remark and not output.is_exr:
        remarks.append(request.color.remark)
    is_converted = request.color.space(shown) is not None
    is_clipped = Path(request.pattern).suffix.lower() in STILLS
    video.expansion.check_frames(request.pattern, is_clipped, is_converted)
    settings |= video.expansion.record
    if how:
        settings["flow"] = how
        remarks.append(f"the frames have no vectors; motion: {how}")
    told = tuple(filter(None, remarks))
    opened = clip, shown
    return Job(request, settings, clip.numbers, findings, how, clip_opened=opened, remarks=told)


def check_fits(request: BlurRequest) -> None:
    """InputError for settings that only input videos have, or outputs of another kind."""
    for name in changed(request.video):
        if name not in OF_FRAMES:
            raise InputError(f"`{name}` is for input videos, {request.pattern} names frames")
    request.output.check()


def _without_effect(request: BlurRequest, findings: SequenceFindings) -> list[str]:
    """Lines on options that change nothing, as the frames hold other layers."""
    if not findings.has:  # none can be read
        return []
    has_motion, has_depth = "motion" in findings.has, "depth" in findings.has
    input = [] if has_motion else [n for n in changed(request.input) if n in _OF_VECTORS]
    depth = [] if has_depth else [n for n in changed(request.input) if n in _OF_DEPTH]
    video = [n for n in changed(request.video) if n.startswith("flow")] if has_motion else []
    found = {"no vectors": input, "no depth": depth, "motion of their own": video}
    return [
        f"the frames have {layers}, so `{name}` has no effect"
        for layers, names in found.items()
        for name in names
    ]


def _rate(request: BlurRequest, clip: Clip) -> Fraction | None:
    """Frames per second of the output; of the frames, as their files say; None if they do not."""
    if request.output.fps is not None:
        return request.output.rate
    if request.shutter.seconds is None:
        return None
    return clip.source(clip.numbers[0]).rate


def _of_cuts(cuts: str | None, clip: Clip) -> str:
    """A remark where a list has no cut of these frames, and none are searched for."""
    known = CutList(cuts or "")
    if known.is_search or not clip.stray_cuts or len(clip.stray_cuts) < len(known.frames(0)):
        return ""
    return f"`cuts` {cuts}: no cut is searched for, so the frames are one shot, as with `cuts` none"


def _of_scale(scale: str) -> str:
    if "=" not in scale or with_amount(scale)[1] is not None or is_file(scale):
        return ""
    return f"`scale` {scale} has no amount such as {scale}:0.5, so everything else stands still"


def _of_conversion(conversion: RateConversion, clip: Clip, output: OutputSettings) -> str:
    said = []
    if conversion.step != 1:
        said.append(
            f"{numbered(clip.numbers)} at {conversion.fps_in} frames per second become "
            f"{numbered(conversion.numbers(clip))} at {conversion.fps}"
        )
    if output.is_exr and output.layers == "all":
        said.append(
            "only the picture is written, as the other layers belong to single input frames"
        )
    return "; ".join(said)


def _check_space(clip: Clip, display: Display | None) -> str:
    """InputError where frames say that they are not linear; a remark on a space of no config."""
    if display is None:
        return ""
    source = clip.source(clip.numbers[0])
    if source.part is None:
        return ""
    said = display.config.unknown(source.part.attributes)
    found: ColorSpace = space_of(source, display.config)
    with about(source.name):
        found.check_linear()
    if not said:
        return ""
    return f"{source.path}: {said} is not in {display.config.name}, so it is taken as {found.text}"


def _motion(
    findings: SequenceFindings, request: BlurRequest, adapter: str | None
) -> tuple[VideoSettings, str]:
    """Source of the motion for frames without vectors, decided, and in words."""
    if not _lacks_motion(findings):
        return request.video, ""
    return request.video.chosen(gpu.open_device(adapter))


def _lacks_motion(findings: SequenceFindings) -> bool:
    """Return True if the frames can be read, and motion must come from their pictures."""
    return len(findings.on_disk) > 1 and bool(findings.has) and "motion" not in findings.has


def _averages(findings: SequenceFindings, request: BlurRequest) -> bool:
    """Return True if frames without motion are averaged; InputError where that changes nothing."""
    if request.video.flow != "none" or not _lacks_motion(findings):
        return False
    if request.blur.holdout:
        raise InputError("`holdout` needs motion; `flow` none averages whole pictures")
    opens, closes = request.shutter.make().span
    if request.conversion is None and max(-opens, closes) <= _OWN:
        raise InputError(
            "the frames have no vectors, and `flow` none would leave each as it is: it averages "
            "frames of a higher rate, such as `fps_in` 240 and `fps` 60, or over a `shutter` above "
            "360"
        )
    return True


def check_confidence(method: str, output: OutputSettings) -> None:
    """Raise InputError unless the method reports confidence and the output can store it."""
    names = getattr(METHODS[method], "confidence", ())
    if not names:
        able = ", ".join(n for n, m in METHODS.items() if hasattr(m, "confidence"))
        raise InputError(f"method {method!r} cannot report confidence; use {able}")
    if not output.is_exr:
        what = ", ".join(names)
        raise InputError(f"`confidence` ({what}) needs an .exr output, got {output.output}")
