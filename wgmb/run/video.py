"""Videos from file to file: a request, its shared resources, and the run of each video."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, Unpack, get_args, get_origin, get_type_hints

import wgpu

from .. import gpu
from ..errors import InputError, check_choice, did_you_mean_setting
from ..extras import install_command, is_installed
from ..io import limits
from ..methods import check_method
from ..methods.keywords import MethodKeywords
from ..pipeline.blur import Blur
from ..settings import BlurSettings, InputSettings, OutputSettings
from ..settings.groups import SettingsGroups, changed, chosen, groups_of
from ..settings.record import record
from ..settings.video import VideoSettings
from ..shots.cut_list import CutList
from ..shots.motion import MotionSource
from ..shots.reader import Picture
from ..shutter import Shutter
from ..video.clock import Clock
from ..video.exposures import Exposures, VideoBlur
from ..video.holdouts import NONE, check_masks, check_sizes, files_of, holdout_of
from ..video.output_times import OutputFrame, OutputFrames
from ..video.planes import Planes
from ..video.read.reader import VideoReader
from ..video.thumbnail import Thumbnail
from ..video.write.encoders import FINEST_RATE, SUFFIXES
from .engine import Blurred, Input, IsDone
from .report import Progress, VideoReport
from .video_output import check_output, losses, sounds_kept, write
from .video_sink import Form

_ANY_RATE = Fraction(24)  # with which a Blur begins
_TAKEN = "frames", "cuts", "max_mb"  # of InputSettings


@dataclass(frozen=True)
class VideoPlan:
    """One video and the output frames that are wanted of it."""

    reader: VideoReader
    output: OutputSettings
    video: VideoSettings
    clock: Clock
    wanted: OutputFrames
    rate: str
    """A line about the output's rate where it was chosen for the user, or ''."""
    remark: str = ""
    """A line about options without effect and small angles, or ''."""

    @property
    def notes(self) -> list[str]:
        """Lines that a user should know."""
        return [*self.reader.notes, *filter(None, (self.rate, self.remark))]

    @property
    def losses(self) -> list[str]:
        """Lines about losses in the output; they are in the report, too."""
        return losses(self.reader, self.output, self.video, self.clock, self.fps)

    @property
    def fps(self) -> Fraction:
        """Frames per second of the output; on average, if its rate varies."""
        return 1 / self.wanted[0].interval

    @property
    def name(self) -> str:
        """The output's name."""
        return self.output.output


@dataclass(frozen=True, kw_only=True)
class VideoRequest(SettingsGroups):
    """Request to blur videos, as `wgmb blur` receives it: the settings that all of them share.

    Videos keep their own colours; `color` has no part in it.
    """

    def open(self, device: wgpu.GPUDevice | str | None = None) -> VideoRun:
        """Open the GPU and all shared resources; InputError for settings that do not fit."""
        if self.blur.method is not None:
            check_method(self.blur.method, of_frames=True)
        check_fits(self.input, self.blur)
        self.video.check()
        check_masks(self.blur.holdout)
        CutList(self.input.cuts or "").frames(0)  # InputError, before anything is said
        if self.blur.holdout not in ((), (NONE,)) and self.video.flow == "none":
            raise InputError("`holdout` needs motion; `flow` none averages whole pictures")
        opened = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        flow, how = self.video.chosen(opened)
        shutter = self.shutter.resolved(fps=_ANY_RATE)  # see VideoRun.at
        settings = replace(self.blur, method=self.blur.method or flow.method).for_pictures()
        blur = settings.make(shutter.make(), device)
        motion, how = self.video.source(blur.device)
        at_edges = None
        if self.video.is_by_place(blur.device) and self.blur.method is None:
            at_edges = self.blur.at_edges(shutter.make(), blur.device)
        if self.shutter.seconds is not None:
            shutter = replace(shutter, shutter=self.shutter.shutter)
        shown = replace(self, blur=settings, shutter=shutter)
        return VideoRun(shown, blur, motion, how, at_edges)


@dataclass(frozen=True)
class VideoRun:
    """A request with the resources that all its videos share."""

    request: VideoRequest
    blur: Blur
    motion: MotionSource | None
    how: str
    """The source of the motion, in words."""
    at_edges: Blur | None = None
    """Blurs pictures with edges of motion, if not the usual Blur."""

    @property
    def settings(self) -> dict[str, Any]:
        """Settings on which a result depends, for the record of a video."""
        return record(self.request.blur, self.request.shutter, self.request.video)

    @property
    def advice(self) -> str:
        """A line on quicker or better sources of motion, if none was set."""
        is_slow = self.blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE
        if self.request.video.flow != "auto" or not is_slow:
            return ""
        if not is_installed("cv2"):
            return f"without a GPU, OpenCV finds motion much sooner: {install_command('flow')}"
        better = "`flow=search` is better in some videos, but takes much longer"
        return f"there is no GPU, so motion is found by a quick search; {better}"

    @property
    def quicker(self) -> str:
        """The next choice that takes less time, in words."""
        flow, method = self.request.video.chosen(self.blur.device)[0], self.blur.method.name
        qualities = {"best": "`flow_quality=fast`", "fast": "`flow_quality=draft`"}
        if flow.flow == "search" and flow.flow_quality in qualities:
            advice = f"{qualities[flow.flow_quality]} takes less"
        elif (flow.flow == "search" and is_installed("cv2")) or (
            flow.flow == "dis" and self.at_edges is not None
        ):
            advice = "`flow=dis` takes less, but loses fast motion"
        elif flow.flow == "dis" and (flow.flow_quality, method) != ("fast", "tap"):
            by = "`flow_quality=fast`" if flow.flow_quality == "best" else "`method=tap`"
            advice = f"{by} takes less"
        elif self.motion is not None:
            advice = "`flow=none`, which averages pictures, takes less"
        else:
            return "`end` ends earlier"
        return advice

    def plan(self, path: str | Path, output: OutputSettings) -> VideoPlan:
        """Open a video; InputError if it cannot be read or has no pictures in the range."""
        video = self.request.video
        check_output(output, video, path)
        max_mb = self.request.input.max_mb
        reader = VideoReader(path, max_mb=max_mb)
        stored = reader.path.stat().st_size
        limits.check_held(reader.path, reader.size, self._held, stored, max_mb)
        check_sizes(self.request.blur.holdout, reader.size)
        clock = video.clock(reader, self.request.input.frames, sounds_kept(reader, output, video))
        fps, said = _rate(reader, output)
        wanted = OutputFrames(reader, clock, fps, video.longest_pause)
        remark = "; ".join(filter(None, (self.request.shutter.remark, video.remark)))
        return VideoPlan(reader, output, video, clock, wanted, said, remark)

    @property
    def _held(self) -> int:
        """Values that are held of a pixel; see limits. A GPU has its own memory for textures."""
        is_on_gpu = self.blur.device.adapter_info["adapter_type"] != gpu.SOFTWARE
        if self.motion is None or is_on_gpu:
            return limits.AVERAGED
        is_tapped = self.blur.method.name == "tap" and self.at_edges is None
        is_quick = self.request.video.chosen(self.blur.device)[0].flow == "dis"
        return limits.MOVED if is_tapped and is_quick else limits.GATHERED

    def at(self, fps: Fraction | None) -> VideoRun:
        """The same with its shutter in degrees, of frames at this rate of the output.

        InputError where it is a part of a second, and no rate is known.
        """
        shutter = self.request.shutter.resolved(fps=fps)
        if shutter == self.request.shutter:
            return self
        for blur in filter(None, (self.blur, self.at_edges)):
            blur.shutter = shutter.make()
        return replace(self, request=replace(self.request, shutter=shutter))

    def exposures(self, plan: VideoPlan) -> VideoBlur:
        """The exposures of a video."""
        request, cuts = self.request, CutList(self.request.input.cuts or "")
        return VideoBlur(
            plan.reader,
            self.blur,
            self.motion,
            clock=plan.clock,
            has_own_times=plan.wanted.has_own_times,
            holdout=holdout_of(request.blur.holdout, plan.reader),
            at_edges=self.at_edges,
            fill=request.video.duplicates == "fill",
            cuts=cuts.is_search,
            known_cuts=cuts.frames(0),
            planes=Planes(self.blur.device, request.video.expansion),
        )

    def __call__(self, plan: VideoPlan, progress: Progress | None = None) -> VideoReport:
        """Blur a video into its output, which is complete, or is not there."""
        if self.request.shutter.seconds is not None:
            return self.at(plan.fps)(plan, progress)
        begun, request = time.perf_counter(), self.request
        cuts = CutList(request.input.cuts or "")
        exposures = self.exposures(plan)
        left_out = write(
            BlurredVideo(exposures, request.shutter.make()),
            plan.output,
            request.video,
            plan.wanted,
            self.settings | {"cuts": [cuts.is_search, sorted(cuts.frames(0))]},
            masks=files_of(request.blur.holdout),
            progress=progress,
        )
        report = VideoReport(
            plan.reader.path,
            plan.name,
            len(plan.wanted),
            time.perf_counter() - begun,
            notes=plan.notes,
            left_out=left_out,
            scaling=plan.reader.scaling(),
            loss=plan.reader.loss(),
        )
        return self.described(report, exposures)

    def described(self, report: VideoReport, exposures: Exposures) -> VideoReport:
        """The report with the findings of its exposures."""
        shots = exposures.shots
        return replace(
            report,
            method=" and ".join(exposures.methods) if self.motion is not None else "",
            cuts=sorted(shots.cuts) if shots else [],
            flashes=shots.flashes if shots else [],
            alone=exposures.alone,
            unfollowed=exposures.unfollowed,
            repeated=len(shots.doubles) if shots else 0,
            is_new=shots is not None,
            held_out=exposures.holdout.message,
        )


class BlurredVideo:
    """A video whose pictures are blurred, as the source of an output."""

    def __init__(self, exposures: VideoBlur, shutter: Shutter):
        self._exposures, self._shutter = exposures, shutter
        self.reader, self.clock = exposures.reader, exposures.clock
        self.device = exposures.device

    def frames(self, wanted: Sequence[OutputFrame], form: Form) -> Input[Any, Any]:
        """Output frames in a form, as the input of a run."""
        return ExposedFrames(self._exposures, self._shutter, wanted, form)


class ExposedFrames:
    """Output frames of a video: its pictures are read, and the exposures made of them."""

    ahead = 3

    def __init__(
        self, exposures: VideoBlur, shutter: Shutter, wanted: Sequence[OutputFrame], form: Form
    ):
        self._exposures, self._shutter = exposures, shutter
        self._wanted, self._form = wanted, form
        self.total = len(wanted)

    def read(self, is_done: IsDone) -> Iterator[Picture[Thumbnail]]:
        """Decode the pictures; frames that are done were left out before."""
        return self._exposures.pictures(self._shutter, self._wanted)

    def blur(self, read: Iterator[Picture[Thumbnail]]) -> Iterator[Blurred]:
        """Make the exposures."""
        made = self._exposures.of(read, self._shutter, self._wanted)
        return (self._form(frame, exposure) for frame, exposure in made)


def check_fits(input: InputSettings, blur: BlurSettings) -> None:
    """InputError for settings that only rendered frames have."""
    for name in changed(input):
        if name not in _TAKEN:
            raise InputError(f"`{name}` is for rendered frames, a video has no layers")
    if blur.scale:
        raise InputError("`scale` is for rendered frames, a video has no layers")


def _rate(reader: VideoReader, output: OutputSettings) -> tuple[Fraction | None, str]:
    """Output frames per second, None for the times of the pictures; and a line if not wished for.

    Image files have no times, so that they need a rate.
    """
    if output.fps == "source":
        return None, ""
    if output.fps is not None or not reader.is_variable or reader.gaps:
        return output.rate_or(reader.rate).limit_denominator(FINEST_RATE), ""
    steps = "{:.1f} to {:.1f} ms".format(*(1000 * step for step in reader.steps))
    if not reader.has_rate and Path(output.output).suffix.lower() in SUFFIXES:
        return None, (
            f"variable rate ({steps}): each picture keeps its own time; `fps=60` sets a steady rate"
        )
    return reader.rate, (
        f"variable rate ({steps}): {float(reader.rate):g} frames a second, as on average; "
        "`fps` sets another rate"
    )


class PictureKeywords(MethodKeywords, total=False):
    """Keywords of `blur_pictures`: options of `wgmb blur`, each with its meaning and default."""

    method: Literal["tap", "tiles", "gather", "fusion", "reproject"]
    samples: int | Literal["auto"]
    jitter: float
    max_blur: float
    shutter: float | str
    phase: Literal["start", "centre", "center", "end"] | float
    curve: str
    rolling: Literal["up", "down", "left", "right"]
    rolling_duration: float
    cuts: str
    flow: Literal["auto", "search", "dis", "none"]
    flow_quality: Literal["best", "fast", "draft"]
    duplicates: Literal["keep", "fill"]
    highlights: float


class VideoKeywords(PictureKeywords, total=False):
    """Keywords of `blur_video`: the options of `wgmb blur`, each with its meaning and default."""

    holdout: str | Sequence[str]
    frames: str
    max_mb: float
    begin: str | float
    end: str | float
    longest_pause: float
    speed: str | float | Fraction
    pitch: Literal["keep", "follow"]
    streams: Literal["all", "video"]
    codec: Literal["h264", "h265", "av1", "vp9", "prores", "ffv1"]
    quality: int
    encoder: Literal["nvenc", "qsv", "amf", "videotoolbox", "v4l2m2m"]
    bits: Literal[8, 16]
    fps: str | float | Fraction
    overwrite: bool
    resume: bool
    compression: str


_TIMES = "begin", "end"
_CHECKED = "method", "codec", "encoder", "bits"  # by what knows more about them
_AS_TEXT = "phase", "speed", "fps"  # numbers that the settings hold as text


def blur_video(
    source: str | Path,
    output: str | Path,
    *,
    device: wgpu.GPUDevice | str | None = None,
    progress: Callable[[int, str], None] | None = None,
    **settings: Unpack[VideoKeywords],
) -> VideoReport:
    """Blur a video into a video, or into frames: `wgmb blur` from Python.

    `output`: a video (.mp4 .mov .mkv .webm .gif) or a pattern of frames such as out.####.png.
    `settings`: the command's options with underscores, such as fps=60, shutter=180, flow="search".
    `device`: your own wgpu device, the name of an adapter, or None for the best one. `progress` is
    called with each output frame's number and "done" once it is written, in the thread that writes,
    and may raise to end the run. A video is
    complete under its name, or not there. InputError for settings that do not fit, a file that is
    no video, or an output that exists, unless `overwrite` or `resume` is set.

    Example: wgmb.blur_video("in.mp4", "out.mp4", fps=60, shutter=180)
    """
    request, keywords = request_of(dict(settings), VideoKeywords, ("device", "progress"))
    run = request.open(device)
    options = chosen(OutputSettings, keywords | {"output": str(output)})
    return run(run.plan(source, options), progress)


def request_of(
    keywords: dict[str, Any], options: type[PictureKeywords], own: Collection[str] = ()
) -> tuple[VideoRequest, dict[str, Any]]:
    """The request of a user's keywords, and the keywords as the settings hold them.

    InputError for one that is not among the `options`. `own`: further keywords of the function,
    which may be meant.
    """
    hints = get_type_hints(options)
    if unknown := sorted(keywords.keys() - hints.keys()):
        near = did_you_mean_setting(unknown[0], [*hints, *own])
        raise InputError(f"unknown setting {unknown[0]!r}{near}")
    for name, kind in hints.items():
        if name in keywords and get_origin(kind) is Literal and name not in _CHECKED:
            check_choice(f"`{name}`", keywords[name], get_args(kind))
        if name in keywords and name in _TIMES and not isinstance(keywords[name], str):
            keywords[name] = f"{keywords[name]:.9f}"
        elif name in keywords and name in _AS_TEXT:
            keywords[name] = str(keywords[name])
        elif name in keywords and kind in (float, float | str) and type(keywords[name]) is not str:
            keywords[name] = float(keywords[name])
    if isinstance(keywords.get("holdout"), str):
        keywords["holdout"] = (keywords["holdout"],)
    keywords |= {"holdout": tuple(keywords["holdout"])} if "holdout" in keywords else {}
    return VideoRequest.of(groups_of(keywords)), keywords
