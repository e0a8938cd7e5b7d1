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
from ...io import frame_numbers, limits
from ...methods import METHODS
from ...scene import builtin
from ...sequence.frame_file import about
from ...settings import METHOD_OPTIONS, ShutterSettings
from ...settings.color import ColorSettings
from ...settings.toml import text_of
from . import toml as saved
from . import video_time
from .allowed import INPUTS, VIDEO, check_said
from .files import frames_of, is_video_file
from .words import (
    DEFAULTS,
    no_option,
    set_words,
    words_of,
)

COMPARE = ("off", "wipe", "split", "difference", "flicker")
BOTH_EYES = ("pair", "red-cyan")
LOOKS = ("result", "sharp", "perceived", "depth", "velocity", "error")
TONES = ("clip", "soft")
FLOWS, QUALITIES = ("auto", "search", "dis", "none"), ("best", "fast")
REFERENCE = "reference"


@dataclass(frozen=True)
class State:
    """A scene or frames on disk, how they are blurred, and how that is shown."""

    source: str = "crossing"
    """A scene's name, or a file or pattern."""
    settings: tuple[tuple[str, float | str], ...] = ()
    """The scene's parameters that differ from their defaults."""
    given: tuple[tuple[str, object], ...] = ()
    """InputSettings, holdout and scale of files that differ from their defaults."""
    color: tuple[tuple[str, object], ...] = ()
    """ColorSettings that differ from their defaults."""
    orbit: tuple[float, float] = (0.0, 0.0)  # degrees to the right, up
    pan: tuple[float, float] = (0.0, 0.0)  # scene units to the right, up
    dolly: float = 1.0
    frames: str = "0-11"
    """Of a video: its pictures that the output is made from."""
    frame: float = 0.0
    """The moment [frame intervals]; of a video the output frame, from 0 on."""
    size: str = "1280x720"
    antialias: int = 2
    fps: float = 24.0
    """Of a video: of the output, whose interval the shutter is in."""
    own_times: bool = False
    """Of a video: `fps` is "source", an output frame for each picture, at its time."""
    flow: str = "auto"
    """Of a video: where motion comes from (FlowSettings)."""
    flow_quality: str = "best"
    pace: str = "1"
    """Of a video: the speed of the output, such as "0.5" for slow motion."""
    video: tuple[tuple[str, object], ...] = ()
    """The other VideoSettings that differ from their defaults."""

    method: str = "gather"
    samples: int | str | None = None
    """A number, "auto", or None for what the method has by default."""
    jitter: float = 0.0
    max_blur: float | None = None
    options: tuple[tuple[str, object], ...] = ()
    """Of the method: path, variant, show, seed, ..."""
    shutter: float = 180.0
    phase: str = "centre"
    curve: str = "box"
    rolling: str | None = None
    rolling_duration: float = 1.0

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

    @property
    def is_scene(self) -> bool:
        """True if `source` is a built-in scene."""
        return self.source in builtin.SCENES

    @property
    def is_video(self) -> bool:
        """True if `source` is a video."""
        return not self.is_scene and is_video_file(self.source)

    @property
    def sampling(self) -> int | str | None:
        """The samples, which for motion from pictures are adaptive unless they are set."""
        adaptive = getattr(METHODS[self.method], "adaptive", False)
        return "auto" if self.samples is None and adaptive and self.is_video else self.samples

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
        """The same without what only changes how the picture is shown."""
        plain = State()
        same = replace(self, **{name: getattr(plain, name) for name in _SHOWING})
        same = replace(same, color=self.read_as)
        return same if self.is_scene else replace(same, frame=float(math.ceil(self.frame - 0.5)))

    @property
    def colors(self) -> ColorSettings:
        """Colour space of the input, and display of the pictures."""
        given: dict[str, Any] = dict(self.color)
        return ColorSettings(**given)

    @property
    def read_as(self) -> tuple[tuple[str, object], ...]:
        """Of `color` what changes how files are read, not only how they are shown."""
        given = dict(self.color)
        return tuple((n, given.get(n)) for n in ("from_", "ocio")) if "from_" in given else ()

    @property
    def span(self) -> tuple[int, int]:
        """First and last frame of `frames`; of a video, of the output."""
        if self.is_video:
            return 0, len(video_time.output(self).moments) - 1
        numbers = frame_numbers.frame_numbers(self.frames)
        return min(numbers), max(numbers)

    def opened(self, source: str, max_mb: float = limits.MAX_MB) -> State:
        """The same state with another scene or other files, seen anew.

        `max_mb`: see InputSettings.
        """
        if source not in builtin.SCENES and not (
            frame_numbers.readable(Path(source)) or frame_numbers.is_pattern(source)
        ):
            known = f"{', '.join(builtin.SCENES)}{did_you_mean(source, builtin.SCENES)}"
            raise InputError(f"no such file or scene: {source!r}; scenes: {known}")
        color = _changed(self.color, "from_", None)
        state = replace(self.unmoved(), source=source, settings=(), given=(), color=color)
        state = replace(state, pace="1", video=(), own_times=False)
        if max_mb != limits.MAX_MB:
            state = replace(state, given=(("max_mb", max_mb),))
        before, after = self.suited(), state.suited()
        for name, value in after.items():  # what was as the last scene asks for follows the new one
            if getattr(self, name) == before[name]:
                state = replace(state, **{name: value})
        if state.method != self.method:
            state = replace(state, options=())
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
        """Method, shutter, curve and tone that the source asks for; else those that are usual."""
        scene = builtin.make(self.source) if self.is_scene else None
        when = ShutterSettings().resolved(scene, self.fps)
        volumes = scene is not None and scene.has_volumes
        method = "volume" if volumes else "gather"  # where frames have no depth: tap
        tone = "soft" if self.is_video and video_time.is_hdr(self) else "clip"
        return {"method": method, "shutter": when.shutter, "curve": when.curve, "tone": tone}

    def settled(self) -> State:
        """The same, its moment within its frames."""
        first, last = self.span
        frame = min(max(self.frame, first), last) if math.isfinite(self.frame) else float(first)
        return replace(self, frame=frame)

    def with_video(self, name: str, value: object) -> State:
        """The same with another of the VideoSettings, at the same time in the video."""
        value = None if value == DEFAULTS[name] else value
        return video_time.retimed(self, video=_changed(self.video, name, value))

    def unmoved(self) -> State:
        """The same, seen from where the scene's own camera is."""
        return replace(self, orbit=(0.0, 0.0), pan=(0.0, 0.0), dolly=1.0, zoom=1.0,
                       center=(0.5, 0.5))  # fmt: skip

    def with_setting(self, name: str, value: float | str) -> State:
        """The same with another parameter of the scene."""
        return replace(self, settings=_changed(self.settings, name, value))

    def with_option(self, name: str, value: object) -> State:
        """The same with an option of the method changed; None is its default."""
        return replace(self, options=_changed(self.options, name, value))

    def with_color(self, **changes: object) -> State:
        """The same with some of the ColorSettings changed; None is the default."""
        color = self.color
        for name, value in changes.items():
            color = _changed(color, name, value)
        return replace(self, color=color)

    def with_method(self, method: str) -> State:
        """The same with another method, whose options are its own."""
        return replace(self, method=method, options=()) if method != self.method else self

    def told(self, given: dict[str, object]) -> State:
        """The same with options of the command line, those that are not their defaults."""
        said = {name: value for name, value in given.items() if value != DEFAULTS[name]}
        check_said(self, said)
        state = replace(self, pace=str(said.pop("speed", self.pace)))
        own = {f.name for f in fields(self)} - saved.COLORS
        state = replace(state, **{n: v for n, v in said.items() if n in own})
        if not self.is_scene:
            found = {n: v for n, v in said.items() if n in INPUTS}
            state = replace(state, given=tuple((dict(state.given) | found).items()))
        for name in VIDEO - own:
            if name in said:
                state = replace(state, video=_changed(state.video, name, said[name]))
        of_files = () if self.is_scene else ("from_",)
        shown = [name for name in saved.COLORS if not name.endswith("_") or name in of_files]
        state = state.with_color(**{name: said[name] for name in sorted(shown) if name in said})
        for name in METHOD_OPTIONS:
            if name in said:
                state = state.with_option(name, said[name])
        if state.method not in METHODS:
            known = f"available: {', '.join(METHODS)}{did_you_mean(state.method, METHODS)}"
            raise InputError(f"unknown method {state.method!r}; {known}")
        video_time.check(state)
        return state.settled()

    # ---- what the command line is told ---------------------------------------------------

    def arguments(self) -> dict[str, object]:
        """Every option of `wgmb render` or `wgmb blur` that this state sets, by its name."""
        look: dict[str, object] = {
            "method": self.method,
            "samples": self.samples,
            "jitter": self.jitter,
            "max_blur": self.max_blur,
            **dict(self.options),
            "shutter": self.shutter,
            "phase": self.phase,
            "curve": self.curve,
            "rolling": self.rolling,
            "rolling_duration": self.rolling_duration,
            "fps": video_time.SOURCE if self.own_times else str(video_time.rate(self)),
            **dict(self.color),
        }
        if self.is_video:
            look |= {"flow": self.flow, "flow_quality": self.flow_quality, "speed": self.pace}
            look |= dict(self.video)
            if not self.own_times and video_time.is_own_rate(self):
                del look["fps"]
        if not self.is_scene:
            return {"pattern": self.source, **dict(self.given), **look}
        return {
            "scene": self.source,
            "set": set_words(self.settings),
            "size": self.size,
            "antialias": self.antialias,
            "orbit": list(self.orbit),
            "pan": list(self.pan),
            "dolly": self.dolly,
            **look,
        }

    def command(self, output: str) -> list[str]:
        """The words after `wgmb` that make `output` of all `frames` as they are seen here."""
        given = self.arguments()
        source = str(given.pop("scene" if self.is_scene else "pattern"))
        words = ["render" if self.is_scene else "blur", no_option(source)]
        words += ["-o", no_option(output)]
        if self.is_scene or self.frames != frames_of(source, video_time.most_mb(self)):
            words += ["--frames", self.frames]
        if self.is_video:  # which keeps its own colours
            given = {name: value for name, value in given.items() if name not in saved.COLORS}
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
        """The state that was saved in a file; `InputError` names the file and what is wrong."""
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
        state = State(source, **saved.values(given, tables.get("view", {}), State, on_disk=on_disk))
        if state.is_video:
            state = video_time.completed(state, {*given, *tables.get("view", {})})
        Cone(state.cone_rate, state.cone_peak)  # says what is wrong with them
        video_time.check(state)
        saved.check_words(state, method=METHODS, compare=COMPARE, tone=TONES)
        return state.settled()


_SHOWING = (*(name for name in saved.VIEW if name != "frame"), "help")


def _changed(pairs: tuple, name: str, value: object) -> tuple:
    kept = tuple(pair for pair in pairs if pair[0] != name)
    return kept if value is None else (*kept, (name, value))
