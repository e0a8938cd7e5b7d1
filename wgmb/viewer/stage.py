"""A State becomes a picture on the GPU, a bit at a time, so that no frame takes long.

While something moves, scenes are drawn as small as keeps the window quick (Pace); when all
is still the picture is drawn in full, and what converges (rays, the reference) goes on.
"""

from __future__ import annotations

import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import wgpu

from .. import gpu, shader, stills
from ..blur import METHODS
from ..errors import InputError
from ..images import Images
from ..options import ShutterOptions
from ..pipeline import SAMPLES, Blur
from ..shutter import Shutter
from ..timing import Timing
from .pace import QUICK, Pace
from .state import LOOKS, REFERENCE, State
from .subject import ClipSubject, Option, SceneSubject, Subject, options_of

REFERENCE_SAMPLES = 1024
ENOUGH = 64  # rays of the reference before it is worth measuring against
_STEP = 0.07  # seconds of work on what converges, between two frames of the window
_SETTLE = 0.35  # seconds of stillness before antialiasing
_WHEEL, _KEY_HEIGHT, _KEY_WIDTH, _MARGIN = 96, 8, 180, 16  # logical pixels

Box = tuple[float, float, float, float]  # x, y, width, height [px]


@dataclass
class Shown:
    """One image on the stage and how far it has come."""

    label: str
    kind: str = "COLOR"
    key: tuple = ()
    texture: wgpu.GPUTexture | None = None
    done: int = 0
    total: int = 1

    @property
    def ready(self) -> bool:
        """Whether nothing is left to do."""
        return self.texture is not None and self.done >= self.total


@dataclass
class Measured:
    """How far the picture is from the reference."""

    rays: int
    psnr: float
    flip: Future | None = None


@dataclass
class Report:
    """What became of one update, for the panel."""

    size: tuple[int, int] = (0, 0)
    full: tuple[int, int] = (0, 0)
    place: Box = (0, 0, 0, 0)
    area: Box = (0, 0, 0, 0)
    seconds: dict[str, float] = field(default_factory=dict)  # on the clock
    passes: dict[str, float] = field(default_factory=dict)  # on the GPU, where it tells
    labels: tuple[str, str] = ("", "")
    reference: int = 0
    measured: Measured | None = None
    busy: bool = False
    changed: bool = False
    moving: bool = False


class Stage:
    """The textures of what is shown, and the passes that draw them."""

    def __init__(self, device: wgpu.GPUDevice):
        self.device = device
        self.images = Images(device)
        software = device.adapter_info["adapter_type"] == gpu.SOFTWARE
        self.pace = Pace(5 if software else 0)
        self.report = Report()
        self._scene: SceneSubject | None = None
        self._clip: tuple[tuple, ClipSubject] | None = None
        self._blurs: dict[tuple, Blur] = {}
        self._shown = {"first": Shown(""), "second": Shown("")}
        self._level, self._still_since, self._still = 0, 0.0, ()
        self._composed, self._canvas, self._moved = (), (1, 1), False
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._none = self.images.view("none", (1, 1), "rgba32float")
        self._timing = Timing(device) if Timing.usable(device) else None
        self._worker = ThreadPoolExecutor(1, "flip")
        self._measured: tuple[tuple, Measured] | None = None
        self._options: dict[str, dict[str, Option]] = {}

    # ---- what there is -------------------------------------------------------------------

    def subject(self, state: State) -> Subject:
        """The scene or the frames that the state is about."""
        if state.is_scene:
            self._scene = self._scene or SceneSubject(self.device)
            return self._scene
        key = (state.source, state.given)
        if self._clip is None or self._clip[0] != key:
            self._clip = key, ClipSubject(self.device, state)
        return self._clip[1]

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can be used."""
        return self.subject(state).methods(state)

    def options(self, method: str) -> dict[str, Option]:
        """The method's own options; see `options_of`."""
        if method not in self._options:
            self._options[method] = options_of(self.device, method)
        return self._options[method]

    def looks(self, state: State) -> list[str]:
        """What can be looked at: also what the method shows of its inner life."""
        has, methods = self.subject(state).has(state), self.methods(state)
        blurred = state.method in methods
        can = {
            "result": blurred,
            "sharp": "color" in has,
            "depth": "depth" in has,
            "velocity": "motion" in has,
            "error": blurred and "distributed" in methods,
        }
        return [look for look in LOOKS if can[look]] + (self._shows(state) if blurred else [])

    def rivals(self, state: State) -> list[str]:
        """What the result can be compared with."""
        methods = self.methods(state)
        sharp = ["sharp"] if "sharp" in self.looks(state) else []
        reference = [REFERENCE] if "distributed" in methods else []
        return [*sharp, *reference, *methods]

    def possible(self, state: State) -> State:
        """The same state; a method or look that is not to be had is replaced by one that is."""
        methods = self.methods(state)
        if methods and state.method not in methods:
            state = state.with_method(methods[0])
        if state.look not in (looks := self.looks(state)):
            state = replace(state, look=looks[0])
        if state.against not in self.rivals(state):
            state = replace(state, against=self.rivals(state)[0])
        return state

    # ---- drawing -------------------------------------------------------------------------

    def update(self, state: State, area: Box, now: float, moving: bool, full: bool) -> Report:
        """Go on with what `state` shows in `area` [px] of the canvas, `now` [s].

        `moving`: quick is better than fine. `full`: everything now, however long it takes.
        """
        started = time.perf_counter()
        subject = self.subject(state)
        shape = subject.size(state)
        place = _fit(shape, area, state)
        size, rays = self._quality(state, shape, place, now, moving, full)
        report = Report(
            size, shape if not state.is_scene else _whole(place), place, area, moving=moving
        )
        subject.look_at(state, size, rays)
        quick = moving and not full
        names = self._wanted(state)
        for slot, name in zip(("first", "second"), names, strict=False):
            self._advance(slot, name, state, subject, size, rays, quick, full, report)
        shown = [self._shown[slot] for slot in ("first", "second")[: len(names)]]
        report.labels = (shown[0].label, shown[-1].label)
        report.busy = moving or not all(s.ready for s in shown) or self._level > 0
        if REFERENCE in names:
            report.reference = shown[-1].done
            report.measured = measured = self._measure(shown[0], shown[-1], state)
            if measured and measured.flip and not measured.flip.done():
                report.busy = True
        report.seconds["draw"] = time.perf_counter() - started
        self.report = report
        return report

    def finished(self, seconds: float, rays: int) -> None:
        """The window's frame took so long; moving frames set the pace."""
        if not self.report.moving:
            self._moved = False
        elif self.report.changed:
            if self._moved:  # the first one may have had shaders to compile
                self.pace.observe(seconds, self.report.seconds["draw"], rays)
            self._moved = True

    def _quality(self, state, shape, place, now, moving, full) -> tuple[tuple[int, int], int]:
        """Size to draw [px] and rays: coarse while moving, then in full, then antialiased."""
        if not state.is_scene:
            self._level = 0
            return shape, 1
        if full:
            self._level = 0
        elif moving:
            self._level, self._still_since = self.pace.level, now
        elif (key := (picture_key(state), place)) != self._still:
            self._still, self._still_since = key, now
            self._level = min(self._level, 1) if self._level else min(self.pace.level, 1)
        elif self._level > 1:
            self._level = 1
        elif self._level == 1 and now - self._still_since > _SETTLE:
            self._level = 0
        scale, rays = self.pace.quality(self._level, state.rays)
        width, height = _whole(place)
        return (max(round(width * scale), 1), max(round(height * scale), 1)), rays

    def _wanted(self, state: State) -> list[str]:
        """One or two names: of a look, a method or the reference."""
        if state.look == "error":
            return ["result", REFERENCE]
        if state.compare == "off":
            return [state.look]
        return [state.look, state.against]

    def _advance(
        self, slot, name, state, subject, size, rays, quick: bool, full: bool, report: Report
    ) -> None:
        shown = self._shown[slot]
        key = (name, picture_key(state), size, rays, quick and self._level)
        if shown.key != key:
            shown = Shown(self._label(name, state), key=key, texture=shown.texture)
            self._shown[slot] = shown
        if shown.ready:
            return
        started = time.perf_counter()
        volumes = state.is_scene and "volume" in self.methods(state)
        if name in ("depth", "velocity") or (name == "sharp" and not volumes):
            pass_ = {"sharp": "color", "depth": "depth", "velocity": "motion"}[name]
            passes = subject.passes()
            if pass_ not in passes:
                raise InputError(f"there is no {name} in these frames")
            shown.texture, shown.done = passes[pass_], 1
            shown.kind = {"depth": "DEPTH", "motion": "MOTION"}.get(pass_, "COLOR")
        else:
            blur = self._blur(name, state, quick)
            shown.texture = self.images.texture(slot, size, blur.output)
            shown.total = blur.samples
            seconds = float("inf") if full or quick else _STEP
            budget = shown.done, seconds
            shown.done = subject.draw(blur, shown.texture, budget, self._timing)
        if self._timing:
            report.passes |= self._timing.read()
        self.device.queue.read_buffer(self._token)  # waits
        report.changed = True
        report.seconds[shown.label] = time.perf_counter() - started

    def _label(self, name: str, state: State) -> str:
        if name == "result":
            return state.method
        return f"{state.method}: {name}" if name in self._shows(state) else name

    def _shows(self, state: State) -> list[str]:
        """What the method can show of its inner life instead of its result."""
        show = self.options(state.method).get("show")
        return [word for word in show.choices if word != show.default] if show else []

    def _blur(self, name: str, state: State, quick: bool) -> Blur:
        """The compiled method called `name`, kept for the next time it is asked for."""
        options: dict[str, Any] = dict(state.options)
        method, samples = state.method, state.samples
        if name == REFERENCE:
            options, method, samples = {}, "distributed", REFERENCE_SAMPLES
        elif name in self._shows(state):
            options["show"] = name
        elif name == "sharp":
            options, method = {}, "volume"
        elif name not in ("result", state.method):
            options, method = {}, name
        if method not in (allowed := self.methods(state)):
            raise InputError(f"method {method!r} cannot be used here, only {', '.join(allowed)}")
        if quick:
            count = samples if isinstance(samples, int) else SAMPLES
            traced = "progress" in METHODS[method].uses
            fewer = min(count, QUICK) if traced else self.pace.samples(self._level, count)
            samples = fewer if fewer < count else samples
        key = (
            name in (REFERENCE, "sharp"),
            method,
            samples,
            state.jitter,
            state.max_blur,
            *options.items(),
        )
        if key not in self._blurs:
            while len(self._blurs) >= 12:
                del self._blurs[next(iter(self._blurs))]
            self._blurs[key] = Blur(
                method,
                samples=samples,
                jitter=state.jitter,
                max_blur=state.max_blur,
                device=self.device,
                **options,
            )
        blur = self._blurs[key] = self._blurs.pop(key)
        shutter = shutter_of(state) if name != "sharp" else Shutter(0)
        if blur.shutter != shutter:
            blur.shutter = shutter
        return blur

    # ---- composing -----------------------------------------------------------------------

    def compose(self, state: State, canvas: tuple[int, int], ratio: float, flicked: bool):
        """Draw the picture as it goes on the screen, in display values; its texture."""
        picture = self.images.texture("picture", canvas, "rgba16float")
        report = self.report
        first, second = self._shown["first"], self._shown["second"]
        compare = _mode(state)
        if flicked and state.compare == "flicker":
            first = second
        look = (first.texture, second.texture, first.done, second.done, compare, flicked, ratio)
        keys = (first.key, second.key, report.place, report.area, canvas)
        shown = (*look, *keys, state.exposure, state.tone, state.gain, state.middle,
                 state.fastest, state.wipe)  # fmt: skip
        if shown == self._composed:
            return picture
        self._composed, self._canvas = shown, canvas
        started = time.perf_counter()
        source = shader.load("view.wgsl")
        kernel = gpu.kernel(
            self.device,
            "view.wgsl",
            FIRST=source.constant(first.kind),
            SECOND=source.constant(second.kind),
            COMPARE=source.constant(compare),
            TONE=source.constant(state.tone.upper()),
            TAPS=self._taps(compare),
        )
        data = np.zeros((), source.dtype("View"))
        data["area"], data["place"] = report.area, report.place
        left, _, width, _ = report.place
        data["line"] = left + state.wipe * width
        data["exposure"], data["gain"] = 2.0**state.exposure, state.gain
        data["middle"], data["fastest"] = state.middle, state.fastest
        if (key := self.key_box(state, ratio)) is not None:
            name = "wheel" if first.kind == "MOTION" else "key"
            data[name] = key
        buffer = self.device.create_buffer_with_data
        given = np.zeros((), shader.load("common/frame.wgsl").dtype("Frame"))
        given["size"] = canvas
        uniform = wgpu.BufferUsage.UNIFORM
        frame = buffer(label="frame", data=given, usage=uniform)
        encoder = self.device.create_command_encoder(label="view")
        kernel.run(
            encoder,
            "main",
            gpu.Given(canvas, {"frame": frame}),
            view=buffer(label="view", data=data, usage=uniform),
            first=first.texture.create_view() if first.texture else self._none,
            second=second.texture.create_view() if second.texture else self._none,
            picture=picture.create_view(),
        )
        gpu.submit(self.device, encoder)
        self.device.queue.read_buffer(self._token)
        report.seconds["view"] = time.perf_counter() - started
        return picture

    def _taps(self, compare: str) -> int:
        """Texels a side for a pixel of the screen; 0 where they are the same."""
        width, height = self.report.size
        across = _whole(self.report.place)
        if across == (width, height) and compare != "SPLIT":
            return 0
        return max(1, min(4, round(width / across[0] * (2 if compare == "SPLIT" else 1))))

    def key_box(self, state: State, ratio: float) -> Box | None:
        """Where the colours are explained [px]; None where they need no words."""
        if state.compare in ("split", "difference"):
            return None
        x, y, width, height = _overlap(self.report.place, self.report.area)
        margin = _MARGIN * ratio
        kind = self._shown["first"].kind
        if kind == "MOTION":
            edge = min(_WHEEL * ratio, 0.3 * min(width, height))
            return x + width - edge - margin, y + height - edge - margin, edge, edge
        if kind == "DEPTH" or state.look == "error":
            long, high = min(_KEY_WIDTH * ratio, 0.4 * width), _KEY_HEIGHT * ratio
            return x + margin, y + height - high - margin, long, high
        return None

    # ---- numbers -------------------------------------------------------------------------

    def _measure(self, first: Shown, second: Shown, state: State) -> Measured | None:
        """PSNR and FLIP of display values, anew whenever the reference has twice the rays."""
        key = (first.key, second.key)
        have = self._measured[1] if self._measured and self._measured[0] == key else None
        if first.kind != "COLOR" or not first.ready or second.done < ENOUGH:
            return have
        if have and (have.rays == second.done or second.done < min(2 * have.rays, second.total)):
            return have
        got, want = (stills.srgb(self.download(s)[..., :3]) for s in (first, second))
        error = float(np.mean((got.astype("f8") - want) ** 2))
        psnr = -10 * np.log10(max(error, 1e-10))
        flip = self._worker.submit(_flip, got, want) if _flip_known() else None
        self._measured = key, Measured(second.done, float(psnr), flip)
        return self._measured[1]

    def download(self, shown: Shown | None = None) -> np.ndarray:
        """(height, width, channels) float32 of the first image, or of another."""
        shown = shown or self._shown["first"]
        assert shown.texture is not None
        encoder = self.device.create_command_encoder(label="download")
        return self.images.download(encoder, shown.texture)

    def picture(self) -> np.ndarray:
        """(height, width, 3) display values 0..1 of what was composed, the panel not in it."""
        encoder = self.device.create_command_encoder(label="download")
        texture = self.images.texture("picture", self._canvas, "rgba16float")
        x, y, w, h = (round(v) for v in _overlap(self.report.place, self.report.area))
        whole = self.images.download(encoder, texture)[..., :3].astype(np.float32)
        return whole[y : y + h, x : x + w]


def shutter_of(state: State):
    """The Shutter that the state describes."""
    return ShutterOptions(
        shutter=state.shutter,
        phase=state.phase,
        curve=state.curve,
        rolling=state.rolling,  # pyright: ignore[reportArgumentType]
        rolling_duration=state.rolling_duration,
    ).make()


def _mode(state: State) -> str:
    if state.look == "error":
        return "ERROR"
    return {"off": "ONE", "flicker": "ONE"}.get(state.compare, state.compare.upper())


def picture_key(state: State) -> State:
    """The state without what only changes how the picture is shown."""
    plain = State()
    names = ("look", "compare", "against", "wipe", "gain", "fastest", "middle", "exposure", "tone",
             "zoom", "center", "playing", "speed", "panel", "help", "frames")  # fmt: skip
    same = replace(state, **{name: getattr(plain, name) for name in names})
    return same if state.is_scene else replace(same, frame=float(state.frame // 1))


def _fit(shape: tuple[int, int], area: Box, state: State) -> Box:
    """Where the picture goes: as large as the area allows, in its middle, then zoomed."""
    x, y, width, height = area
    scale = min(width / shape[0], height / shape[1]) * state.zoom
    w, h = shape[0] * scale, shape[1] * scale
    left = x + width / 2 - w * state.center[0]
    top = y + height / 2 - h * state.center[1]
    return round(left), round(top), max(round(w), 1), max(round(h), 1)


def _whole(place: Box) -> tuple[int, int]:
    return max(round(place[2]), 1), max(round(place[3]), 1)


def _overlap(a: Box, b: Box) -> Box:
    left, top = max(a[0], b[0]), max(a[1], b[1])
    right, bottom = min(a[0] + a[2], b[0] + b[2]), min(a[1] + a[3], b[1] + b[3])
    return left, top, max(right - left, 0), max(bottom - top, 0)


def _flip_known() -> bool:
    import importlib.util

    return importlib.util.find_spec("flip_evaluator") is not None


def _flip(got: np.ndarray, want: np.ndarray) -> float:
    """Mean LDR-FLIP of display values (Andersson et al. 2020)."""
    import flip_evaluator  # pyright: ignore[reportMissingImports]

    _, mean, _ = flip_evaluator.evaluate(want, got, "LDR", inputsRGB=True)
    return float(mean)
