"""State of the viewer as one frozen value, with its TOML and command-line forms.

`wgmb render --config` (scenes) and `wgmb blur --config` (frames on disk) read the same file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from ...cone import Cone
from ...errors import InputError, did_you_mean
from ...files.near import near
from ...io import frame_numbers, limits
from ...methods import METHODS
from ...scene import builtin
from ...sequence.frame_file import about
from ...settings import (
    METHOD_OPTIONS,
    BlurSettings,
    InputSettings,
    SceneSettings,
    ShutterSettings,
)
from ...settings.color import ColorSettings
from ...settings.toml import text_of
from ...settings.video import VideoSettings
from . import toml as saved
from . import video_time
from .allowed import check_options
from .files import frames_of
from .groups import DEFAULTS, GROUP_OF, MASKS, written
from .shown_moment import ShownMoment
from .words import no_option, words_of

COMPARE = ("off", "wipe", "split", "difference", "flicker")
BOTH_EYES = ("pair", "red-cyan")
LOOKS = ("result", "sharp", "perceived", "depth", "velocity", "error")
TONES = ("clip", "soft", "false")
FLOWS, QUALITIES = ("auto", "search", "dis", "none"), ("best", "fast", "draft")
REFERENCE = "reference"
KEPT = "B"
"""The image by the settings that were kept."""


@dataclass(frozen=True)
class Kept:
    """Settings that are kept to be compared with: how things move, and how they are blurred."""

    blur: BlurSettings
    shutter: ShutterSettings
    flow: str
    flow_quality: str
    is_method_suited: bool = False

    @staticmethod
    def of(state: State) -> Kept:
        """Those of a state."""
        video, is_suited = state.video, state.is_method_suited
        return Kept(state.blur, state.shutter, video.flow, video.flow_quality, is_suited)

    def put_into(self, state: State) -> State:
        """The state with these settings."""
        video = replace(state.video, flow=self.flow, flow_quality=self.flow_quality)
        suited, shutter = self.is_method_suited, self.shutter
        return replace(state, blur=self.blur, shutter=shutter, video=video, is_method_suited=suited)


@dataclass(frozen=True)
class State(ShownMoment):
    """A scene or frames on disk, how they are blurred, and how that is shown."""

    look: str = "result"
    eyes: str = ""
    """Of stereo frames: the view shown, or one of BOTH_EYES; "" is the default view."""
    compare: str = "off"
    against: str = "sharp"
    wipe: float = 0.5  # of the picture's width
    gain: float = 4.0
    fastest: float = 0.05  # at full brightness [picture heights per frame]
    middle: float = 5.0  # depth shown as middle grey [scene units]
    exposure: float = 0.0  # stops
    tone: str = "clip"
    cone_rate: float = 50.0  # of the eye that perceives: how fast its answer fades [1/s]
    cone_peak: float = 0.05  # when it is strongest [s]
    zoom: float = 1.0  # of the picture on the screen, frames on disk only
    center: tuple[float, float] = (0.5, 0.5)
    playing: bool = False
    speed: float = 0.25
    panel: bool = True
    help: bool = False
    kept: Kept | None = None
    """Settings B, which the present ones can be compared with."""
    inspect: bool = False
    """Numbers under the mouse are shown."""
    arrows: bool = False
    """Motion is drawn as arrows."""

    @property
    def method(self) -> str:
        """Name of the blur method."""
        assert self.blur.method is not None
        return self.blur.method

    @property
    def suited_blur(self) -> BlurSettings:
        """`blur`, the samples adaptive for motion from pictures unless they are set."""
        return self.blur.for_pictures() if self.is_video else self.blur

    @property
    def eye(self) -> Cone | None:
        """The cone cell, if the view is of perceived images."""
        return Cone(self.cone_rate, self.cone_peak) if self.look == "perceived" else None

    @property
    def mode(self) -> str:
        """Comparison of two images: one of COMPARE, or of BOTH_EYES, or "error"."""
        if self.look == "error":
            return "error"
        return self.eyes if self.eyes in BOTH_EYES else self.compare

    @property
    def picture(self) -> State:
        """The same without settings of the display alone."""
        plain = State()
        same = replace(self, **{name: getattr(plain, name) for name in _SHOWING})
        same = replace(same, color=self.read_as)
        return same if self.is_scene else replace(same, frame=float(math.floor(self.frame)))

    @property
    def as_kept(self) -> State:
        """The same with settings B, if there are any."""
        return self.kept.put_into(self) if self.kept else self

    def keeping(self) -> State:
        """The same, its settings kept as B and compared with."""
        compare = "wipe" if self.compare == "off" else self.compare
        return replace(self, kept=Kept.of(self), compare=compare, against=KEPT)

    @property
    def is_compared_with_kept(self) -> bool:
        """True if the picture is compared with settings B."""
        return bool(self.kept) and self.against == KEPT and self.compare != "off"

    def differences(self, other: State) -> list[str]:
        """The settings, of those that are kept as B, that are others; the method is left out."""
        shutter, video = self.shutter, self.video
        found = []
        if self.suited_blur.samples != other.suited_blur.samples:
            found.append(f"{self.suited_blur.samples or 'own'} samples")
        if shutter.shutter != other.shutter.shutter:
            found.append(f"{shutter.degrees:g} deg")
        if (shutter.phase, shutter.curve) != (other.shutter.phase, other.shutter.curve):
            found.append(f"{shutter.phase}, {shutter.curve}")
        if (video.flow, video.flow_quality) != (other.video.flow, other.video.flow_quality):
            found.append(f"{video.flow}, {video.flow_quality}")
        return found

    def swapped(self) -> State:
        """The same with settings B, the present ones kept as B."""
        return self if self.kept is None else replace(self.as_kept, kept=Kept.of(self))

    @property
    def number(self) -> int:
        """Number of the frame on disk, or of the video's output frame, that is shown."""
        if self.is_scene or self.is_video:
            return min(math.floor(self.frame), self.span[1])
        numbers = frame_numbers.frame_numbers(self.frames)
        return max((n for n in numbers if n <= self.frame), default=min(numbers))

    @property
    def files(self) -> list[Path]:
        """The files whose pictures are shown; none of a built-in scene."""
        if self.is_scene or self.is_video:
            return [] if self.is_scene else [Path(self.source)]
        numbers = frame_numbers.frame_numbers(self.frames)
        return [frame_numbers.frame_path(self.source, n) for n in numbers]

    @property
    def moment(self) -> float:
        """The moment of the perceived picture [frame intervals].

        Frames and videos that stand still are looked at in the middle of a frame's time.
        """
        if self.is_scene:
            return self.frame
        return self.frame - 0.5 if self.playing else float(math.floor(self.frame))

    @property
    def read_as(self) -> ColorSettings:
        """The settings of `color` that change how files are read, not only how they are shown."""
        color = self.color
        return ColorSettings(from_=color.from_, ocio=color.ocio if color.from_ else None)

    @property
    def span(self) -> tuple[int, int]:
        """First and last frame of `frames`; of a video, of the output."""
        return video_time.span(self)

    def opened(self, source: str, max_mb: float = limits.MAX_MB) -> State:
        """The same state with another scene or other files, seen anew.

        `max_mb`: see InputSettings.
        """
        if source not in builtin.SCENES and not (
            frame_numbers.readable(Path(source)) or frame_numbers.is_pattern(source)
        ):
            scenes = ", ".join(builtin.SCENES)
            known = f"scenes: {scenes}{did_you_mean(source, builtin.SCENES)}"
            meant = near(Path(source))
            known = f"did you mean {str(Path(source).with_name(meant))!r}?" if meant else known
            raise InputError(f"no such file or scene: {source!r}; {known}")
        seen = self.unmoved()
        state = replace(
            seen,
            source=source,
            scene=replace(seen.scene, set=()),
            input=InputSettings(max_mb=max_mb),
            blur=replace(self.blur, **dict.fromkeys(MASKS, ())),
            color=replace(self.color, from_=None),
            video=VideoSettings(flow=self.video.flow, flow_quality=self.video.flow_quality),
            own_times=False,
            kept=None,
        )
        was, suited = self.suited(), state.suited()
        if self.tone == self.suited_tone:  # what was as the last source asks for follows this one
            state = replace(state, tone=state.suited_tone)
        follows = {n: v for n, v in suited.items() if self.setting(n) == was[n]}
        is_suited = state.is_video and (self.is_method_suited or self.method == was["method"])
        state = state.with_method(follows.pop("method", state.method)).with_settings(**follows)
        state = replace(state, is_method_suited=is_suited)
        if state.is_scene:
            plain, loop = State(), builtin.make(source).loop
            if loop:
                last = round(loop * state.fps) - 1
                return replace(state, frames=f"0-{last}", frame=0.0, speed=1.0)
            return replace(state, frames=plain.frames, frame=0.0, speed=plain.speed)
        if state.is_video:
            state = video_time.at_own_rate(state)
        frames = frames_of(source, max_mb)
        return replace(state, frames=frames, frame=math.nan, speed=1.0).settled()

    def suited(self) -> dict[str, Any]:
        """Method, shutter and curve that the source asks for; else those that are usual."""
        scene = builtin.make(self.source) if self.is_scene else None
        own = ShutterSettings().resolved(scene, self.fps)
        method = BlurSettings().resolved(scene).method  # where frames have no depth: tap
        return {"method": method, "shutter": own.shutter, "curve": own.curve}

    @property
    def suited_tone(self) -> str:
        """The tone that the source asks for."""
        return "soft" if self.is_video and video_time.is_hdr(self) else "clip"

    def settled(self) -> State:
        """The same, its moment within its frames."""
        return video_time.settled(self)

    def unmoved(self) -> State:
        """The same, seen from where the scene's own camera is."""
        own = SceneSettings()
        scene = replace(self.scene, orbit=own.orbit, pan=own.pan, dolly=own.dolly)
        return replace(self, scene=scene, zoom=1.0, center=(0.5, 0.5))

    def setting(self, name: str) -> Any:
        """An option, whichever group it is in."""
        return getattr(getattr(self, GROUP_OF[name]), name)

    def with_settings(self, **changes: Any) -> State:
        """The same with other values of options, whichever groups they are in."""
        groups: dict[str, dict[str, Any]] = {}
        for name, value in changes.items():
            groups.setdefault(GROUP_OF[name], {})[name] = value
        new = {group: replace(getattr(self, group), **some) for group, some in groups.items()}
        is_suited = self.is_method_suited and "method" not in changes
        return replace(self, **new, is_method_suited=is_suited)

    def with_video(self, **changes: Any) -> State:
        """The same with others of the VideoSettings, at the same time in the video."""
        return video_time.retimed(self, video=replace(self.video, **changes))

    def with_parameter(self, name: str, value: float | str) -> State:
        """The same with another value of a parameter of the scene."""
        kept = tuple(text for text in self.scene.set if text.partition("=")[0] != name)
        text = f"{name}={value}" if isinstance(value, str) else f"{name}={value:g}"
        return self.with_settings(set=(*kept, text))

    def with_method(self, method: str) -> State:
        """The same with another method, whose options are its own."""
        if method == self.method:
            return replace(self, is_method_suited=False)
        return self.with_settings(
            method=method, **{name: DEFAULTS[name] for name in METHOD_OPTIONS}
        )

    def suited_by(self, method: str) -> State:
        """The same of a video, whose method is not set, and so is this one."""
        return replace(self.with_method(method), is_method_suited=True)

    def with_options(self, options: dict[str, Any]) -> State:
        """The same with options of the command line, those that are not their defaults."""
        changed = {name: value for name, value in options.items() if value != DEFAULTS[name]}
        check_options(self, changed)
        state = replace(self, frames=changed.pop("frames", self.frames)).with_settings(**changed)
        if state.method not in METHODS:
            known = f"available: {', '.join(METHODS)}{did_you_mean(state.method, METHODS)}"
            raise InputError(f"unknown method {state.method!r}; {known}")
        video_time.check(state)
        return state.settled()

    # ---- what the command line is told ---------------------------------------------------

    def arguments(self) -> dict[str, object]:
        """Every option of `wgmb render` or `wgmb blur` that this state sets, by its name."""
        given: dict[str, object] = {"scene" if self.is_scene else "pattern": self.source}
        for group in ("scene" if self.is_scene else "input", "blur", "shutter"):
            given |= written(group, getattr(self, group))
        if self.is_video and self.is_method_suited:
            del given["method"]
        given["fps"] = video_time.SOURCE if self.own_times else str(video_time.rate(self))
        given |= written("color", self.color)
        if self.is_video:
            given |= written("video", self.video)
            if not self.own_times and video_time.is_own_rate(self):
                del given["fps"]
        return given

    def command(self, output: str) -> list[str]:
        """The words after `wgmb` that make `output` of all `frames` as they are seen here."""
        given = self.arguments()
        source = str(given.pop("scene" if self.is_scene else "pattern"))
        words = ["render" if self.is_scene else "blur", no_option(source)]
        words += ["-o", no_option(output)]
        if self.is_scene or self.frames != frames_of(source, self.input.max_mb):
            words += ["--frames", self.frames]
        if self.is_video:  # which keeps its own colours
            given = {n: v for n, v in given.items() if GROUP_OF.get(n) != "color"}
        return words + words_of(given)

    # ---- TOML ----------------------------------------------------------------------------

    def toml(self) -> str:
        """A table for the command line, [render] or [blur], and [view] for the rest."""
        given = self.arguments()
        if self.is_scene:
            given["time"] = self.frame / self.fps
        view = {f.name: getattr(self, f.name) for f in fields(self) if f.name in saved.VIEW}
        return saved.toml({"render" if self.is_scene else "blur": given, "view": view})

    @staticmethod
    def read(path: Path) -> State:
        """The state that was saved in a file; `InputError` names the file and the fault."""
        with about(path):
            return State.of_toml(text_of(path))

    @staticmethod
    def of_toml(text: str) -> State:
        """The state that `toml` wrote; `InputError` names what is wrong with it."""
        tables = saved.tables(text)
        on_disk = "blur" in tables
        given = dict(tables["blur" if on_disk else "render"])
        source = given.pop("pattern" if on_disk else "scene", None)
        if not isinstance(source, str):
            raise InputError("settings: [render] needs scene, [blur] needs pattern")
        if on_disk == (source in builtin.SCENES):
            raise InputError(f"settings: {source!r} is {'' if on_disk else 'not '}a built-in scene")
        given.pop("time", None)
        values = saved.values(given, tables.get("view", {}), State(), on_disk=on_disk)
        state = State(source, **values)
        if state.is_video:
            state = video_time.completed(state, {*given, *tables.get("view", {})})
            state = replace(state, is_method_suited="method" not in given)
        Cone(state.cone_rate, state.cone_peak)  # says what is wrong with them
        video_time.check(state)
        saved.check_words("method", state.blur.method, METHODS)
        saved.check_words("compare", state.compare, COMPARE)
        saved.check_words("tone", state.tone, TONES)
        return state.settled()


_SHOWING = (*(name for name in saved.VIEW if name != "frame"), "help", "kept", "inspect", "arrows")
