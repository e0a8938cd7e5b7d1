"""A State becomes one or two images on the GPU, a bit at a time, so that no frame takes long.

While something moves, scenes are drawn as small as keeps the window quick (Pace); when all
is still the picture is drawn in full, and methods that converge (rays, the reference) go on.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import HLG, Coding
from ...color.primaries import (
    H273,
    REC709,
    conversion,
    luminance,
)
from ...errors import InputError
from ...gpu.textures import TexturePool
from ...gpu.timing import Clock, TimestampClock
from ...methods import METHODS
from ...sequence.input_color import chromaticities
from ..capabilities import QUICKEST, Choices
from ..state.state import BOTH_EYES, KEPT, REFERENCE, State
from ..subjects.subject import SceneSubject, Subject
from ..subjects.video import VideoSubject
from .adaptive import Pace
from .blurs import Blurs
from .composer import Image
from .detail import Detail
from .frame_status import FrameStatus
from .inspected import Inspected
from .perception import Perceived, seen_frames
from .place import Box, fit, whole
from .portions import DroppedError
from .quality import Measured, Quality
from .request import Available, Drawn, Request
from .slot import Slot

_STEP = 0.07  # seconds of work on what converges, between two frames of the window
_QUICK_STEP = 0.03  # while something moves
_SHORT = 0.02  # seconds
_PASSES = {"sharp": "color", "depth": "depth", "velocity": "motion"}


class Renderer:
    """The textures of the picture, and the passes that draw them.

    `timing`: a clock of the passes, by default that of the device, if it has one. `target`:
    seconds that a frame may take while something moves.
    """

    def __init__(
        self, device: wgpu.GPUDevice, timing: Clock | None = None, target: float = Pace.TARGET
    ):
        self.device = device
        self.choices, self.quality = Choices(device), Quality()
        self.detail = Detail(device.adapter_info["adapter_type"] == gpu.SOFTWARE, target)
        self.report = FrameStatus()
        self._images, self._video_light = TexturePool(device), VideoLight(device)
        self._perceived = {slot: Perceived(device) for slot in ("first", "second")}
        self._past: SceneSubject | None = None
        self._blurs = Blurs(device, self.choices, self.detail.pace)
        self._slots = {"first": Slot(), "second": Slot()}
        self._coming = dict(self._slots)  # takes the place of what is shown
        self._on_screen: dict[str, Image] = {}
        self.chromaticities: dict[str, Any] = {}  # of what is shown, as an attribute of an EXR
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._timing = timing
        if timing is None and TimestampClock.usable(device):
            self._timing = TimestampClock(device)
        self._inspected = Inspected(device, self.choices, self._blurs, self._timing)

    def draw(self, request: Request, now: float) -> Drawn:
        """Go on with the request, `now` [s]; InputError if it cannot be shown."""
        choices = self.choices
        light = None if request.full else choices.first_light(request.state)
        if light is not None:
            return self._as_it_is(request, light)
        state = choices.possible(request.state)
        report = self.update(state, request.area, now, request.moving, request.full)
        available = Available(
            methods=choices.methods(state),
            looks=choices.looks(state),
            eyes=choices.eyes(state),
            rivals=choices.rivals(state),
            options=choices.options(state.method),
            finding=getattr(choices.subject(state), "finding", ""),
            layers=getattr(choices.subject(state), "layers", {}),
            display=choices.displayed.display(state),
        )
        looked_at = (state.inspect or state.arrows) and not (report.busy or request.moving)
        under = {}
        if looked_at:
            under = self._inspected(state, available.looks, self._slots["first"], report)
        images = self._on_screen
        return Drawn(request, state, report, available, images, under, self.chromaticities)

    def _as_it_is(self, request: Request, light: np.ndarray) -> Drawn:
        """Frames that were just opened: the sharp picture, before all else is known of them."""
        state, choices, started = request.state, self.choices, time.perf_counter()
        size, name = (light.shape[1], light.shape[0]), "first 1"
        self._images.upload(name, light, "rgba32float")
        slot = Slot("sharp", ("as it is", state.picture), (size,), name, done=1)
        slot.texture = self._images.texture(name, size, "rgba32float")
        self._slots["first"] = slot
        self._on_screen, self.chromaticities = {"first": slot.image}, {}
        report = FrameStatus(size, size, fit(size, request.area, state), request.area, size=size)
        report.labels, report.waiting = ("sharp", "sharp"), "sharp: testing the vectors"
        report.busy = report.changed = True
        report.seconds["draw"] = time.perf_counter() - started
        self.report = report
        available = Available(
            [state.method], [state.look], [], [state.against], choices.options(state.method)
        )
        return Drawn(request, state, report, available, self._on_screen)

    def update(self, state: State, area: Box, now: float, moving: bool, full: bool) -> FrameStatus:
        """Go on with the picture of `state` in `area` [px] of the canvas, `now` [s].

        `moving`: quick is better than fine. `full`: everything now, however long it takes.
        """
        started = time.perf_counter()
        subject = self.choices.subject(state)
        self.choices.close_others(state)
        size = subject.size(state)
        shape = size if isinstance(subject, SceneSubject) else subject.shape
        place = fit(shape, area, state)
        full_size = whole(place) if state.is_scene else size
        names = self._wanted(state)
        can, detail = any(self.choices.has_preview(state, name) for name, _ in names), self.detail
        detail.begin(state, place, full_size, now, moving=moving, full=full, has_preview=can)
        size, antialias = detail.size(state, size, place)
        report = FrameStatus(full_size, shape, place, area, moving)
        quick = (moving or detail.is_preview) and not full
        slots, lacks, is_first_alone = ("first", "second")[: len(names)], False, False
        for slot, (name, eye) in zip(slots, names, strict=True):
            if name != "perceived":
                self._perceived[slot].forget()
            of_slot = self.choices.subject(state.as_kept) if name == KEPT else subject
            self._advance(slot, name, eye, state, of_slot, size, antialias, quick, full, report)
            if isinstance(of_slot, VideoSubject) and name != "sharp":
                report.waiting = report.waiting or of_slot.waiting
                lacks |= of_slot.busy
                if name in ("result", KEPT) and (draft := of_slot.draft):
                    report.drafts.append(f"{KEPT}: {draft}" if name == KEPT else draft)
            is_first_alone = (
                detail.has_choice and not quick and report.changed and slot != slots[-1]
            )
            if is_first_alone:  # it is shown before the second one, which may take long
                break
        first, last = self._slots["first"], self._slots[slots[-1]]
        assert first.texture is not None
        report.size, report.kind = first.texture.size[:2], first.kind
        report.labels = (first.label, last.label)
        if state.is_compared_with_kept:
            own, other = state.differences(state.as_kept), state.as_kept.differences(state)
            report.labels = ", ".join([first.label, *own]), ", ".join([last.label, *other])
        previews = [self._slots[slot] for slot in slots if self._slots[slot].is_preview]
        if previews:
            share = previews[0].fine[0][0] / max(full_size[0], 1)
            of_size = f" at {share:.0%}" if share < 0.995 else ""
            alone = f" for {previews[0].label}" if len(previews) < len(slots) else ""
            of_which = " for both" if len(previews) == 2 else alone
            report.preview = f"preview by {QUICKEST}{of_size}{of_which}"
        self._on_screen = self._displayed(slots, state, subject)
        done = not is_first_alone and all(self._coming[slot].ready for slot in slots)
        detail.is_complete = done
        report.busy = moving or not done or detail.level > 0 or detail.is_preview or lacks
        if isinstance(subject, VideoSubject):
            report.frame = subject.frame_of(state)
        if names[-1][0] == REFERENCE:
            report.reference = last.done, last.total
            report.measured = measured = self._measure(first, last)
            if measured and measured.flip and not measured.flip.done():
                report.busy = True
        report.seconds["draw"] = time.perf_counter() - started
        self.report = report
        return report

    @property
    def first(self) -> Image:
        """The first image as it was drawn."""
        return self._slots["first"].image

    def close(self) -> None:
        """End all work beside the window."""
        self.choices.close()

    def _displayed(
        self, slots: tuple[str, ...], state: State, subject: Subject
    ) -> dict[str, Image]:
        """The images by slot, colours as the display of an OpenColorIO config shows them.

        None of a second slot that is not drawn yet.
        """
        images = {slot: self._slots[slot].image for slot in slots if self._slots[slot].texture}
        displayed, self.chromaticities = self.choices.displayed, {}
        if isinstance(subject, VideoSubject):
            self.chromaticities = {"chromaticities": primaries_of(subject.coding)}
            for slot, image in images.items():
                if image.kind == "COLOR" and not self._is_data(self._slots[slot], state):
                    images[slot] = self._video_light.image(slot, image, subject.coding)
        if (display := displayed.display(state)) is None:
            return images
        space, exposure = subject.space(display.config), 2.0**state.exposure
        self.chromaticities = self.chromaticities or chromaticities(space)
        for slot, image in images.items():
            if image.kind == "COLOR":
                images[slot] = displayed.image(slot, image, display, space, exposure)
        return images

    def _is_data(self, slot: Slot, state: State) -> bool:
        """Return True for an image of a method's own data, whose colours are no light."""
        return slot.key[0] in self.choices.shows(state)

    def download(self, slot: Slot | None = None) -> np.ndarray:
        """(height, width, channels) float32 of the first image, or of another."""
        slot = slot or self._slots["first"]
        assert slot.texture is not None
        encoder = self.device.create_command_encoder(label="download")
        return self._images.download(encoder, slot.texture)

    def finished(self, seconds: float, antialias: int) -> None:
        """The window's frame took so long; moving frames set the pace."""
        self.detail.finished(self.report, seconds, antialias)

    def _wanted(self, state: State) -> list[tuple[str, str | None]]:
        """One or two names, of a look, a method or the reference, each with the view it is of."""
        if state.mode == "error":
            return [("result", None), (REFERENCE, None)]
        if state.mode in BOTH_EYES:
            return [(state.look, eye) for eye in self.choices.sides(state)]
        eye = None if state.eyes in ("", *BOTH_EYES) else state.eyes
        return (
            [(state.look, eye)]
            if state.mode == "off"
            else [(name, eye) for name in (state.look, state.against)]
        )

    def _advance(
        self,
        slot: str,
        name: str,
        view: str | None,
        state: State,
        subject: Subject,
        size: tuple[int, int],
        antialias: int,
        quick: bool,
        full: bool,
        report: FrameStatus,
    ) -> None:
        """Draw some of `name`; it is shown once it is no coarser than the picture it replaces."""
        shown, coming = self._slots[slot], self._coming[slot]
        is_kept = name == KEPT
        if is_kept:
            state, name = state.as_kept, "result"
        eye = state.eye if name in ("perceived", REFERENCE) else None
        known = self._known(name, state, subject, full)
        frame = state.moment if name == "perceived" else None
        key = (name, view, state.picture, eye, frame, tuple(known))
        is_preview = self.detail.is_preview and self.choices.has_preview(state, name)
        fine = (size, antialias, self.detail.level if quick else None, is_preview)
        if (coming.key, coming.fine) != (key, fine):
            coarse = self.detail.level or is_preview
            if coarse and shown.key == key and not _coarser(shown.fine, fine):
                return
            texture = f"{slot} {1 + shown.name.endswith('1')}"
            label = self._label(name, state) + (f", {view}" if view else "")
            label = f"{KEPT}: {label}" if is_kept else label
            coming = Slot(label, key, fine, texture, is_preview=is_preview)
            self._coming[slot] = coming
        if coming.ready:
            return
        started = time.perf_counter()
        seconds = float("inf") if full else _QUICK_STEP if quick else _STEP
        subject.look_at(state, size, antialias, view)
        try:
            self._draw(
                coming, slot, name, view, state, subject, seconds, quick, report.moving, known
            )
        except DroppedError:
            self._coming[slot] = shown
            raise
        if self._timing:
            report.passes |= self._timing.read()
        self.device.queue.read_buffer(self._token)  # waits
        if shown.key != key or coming.done >= min(shown.done, coming.total):
            self._slots[slot] = coming
        report.changed = True
        report.seconds[coming.label] = took = time.perf_counter() - started
        if not (quick or full) and self.choices.has_preview(state, name):
            self.detail.observe_still(took, math.prod(size))

    def _known(
        self, name: str, state: State, subject: Subject, full: bool
    ) -> list[tuple[Any, ...]]:
        """The findings about a video's motion, all that are needed if `full`.

        One entry for each output frame that is needed, the present one first.
        """
        if not isinstance(subject, VideoSubject) or name == "sharp":
            return []
        method = METHODS[name if name in METHODS else state.method]
        states = seen_frames(state) if name == "perceived" else [state]
        gathers = name not in METHODS and self.choices.has_edges_gathered(state)
        asked = states, state.shutter.make(), gathers or "neighbours" in method.uses
        known = subject.stamp(*asked)
        while full and subject.busy:
            time.sleep(_SHORT)
            known = subject.stamp(*asked)
        return known

    def _draw(
        self,
        coming: Slot,
        slot: str,
        name: str,
        view: str | None,
        state: State,
        subject: Subject,
        seconds: float,
        quick: bool,
        moving: bool,
        known: list[tuple[Any, ...]],
    ) -> None:
        size, antialias = coming.fine[:2]
        # What moves is not dropped, and the next pass is recorded while one is computed.
        timing = None if moving and self.detail.is_slow else self._timing
        volumes = state.is_scene and "volume" in self.choices.methods(state)
        if name in _PASSES and not (name == "sharp" and volumes):
            passes = subject.passes()
            if _PASSES[name] not in passes:
                raise InputError(f"these frames have no {name}")
            coming.texture, coming.done = passes[_PASSES[name]], 1
            coming.kind = {"depth": "DEPTH", "velocity": "MOTION"}.get(name, "COLOR")
            return
        stand_in = QUICKEST if coming.is_preview else None
        blur = self._blurs(slot, name, state, size, self.detail.level if quick else None, stand_in)
        at_edges = None
        if isinstance(subject, VideoSubject) and name in ("result", "perceived"):
            is_fine = stand_in is None and not (quick and self.detail.is_slow)
            if is_fine and self.choices.has_edges_gathered(state):
                at_edges = self._blurs.at_edges(slot, name, state, size)
            subject.at_edges = at_edges
        coming.texture = self._images.texture(coming.name, size, blur.output)
        if name == "perceived" and (eye := state.eye):
            if state.is_scene:  # of its own, so that what else is drawn keeps its moment
                subject = self._past = self._past or SceneSubject(self.device)
            coming.total = len(seen_frames(state))
            by = view, blur, antialias
            with self._blurs.kept_if_done(blur, at_edges):
                coming.done = self._perceived[slot].draw(
                    coming.texture, state, eye, subject, *by, seconds, timing, known
                )
            return
        budget = coming.done, float("inf") if quick else seconds
        coming.total = blur.samples
        with self._blurs.kept_if_done(blur, at_edges):
            coming.done = subject.draw(blur, coming.texture, budget, timing)

    def _label(self, name: str, state: State) -> str:
        if name == "result":
            at_edges = self.choices.has_edges_gathered(state) and state.method != "gather"
            return f"{state.method}, gather at edges" if at_edges else state.method
        if name == "perceived":
            return f"{state.method}, perceived"
        if name == REFERENCE and state.eye:
            return "nature, perceived"
        return f"{state.method}: {name}" if name in self.choices.shows(state) else name

    def _measure(self, first: Slot, last: Slot) -> Measured | None:
        """Return the difference between the first image and the reference, once both are ready.

        While one is drawn anew, the other may still be that of another state or size.
        """
        key = (first.key, first.fine, last.key, last.fine)
        alike = (first.key[2], first.fine[0]) == (last.key[2], last.fine[0])
        if first.kind == "COLOR" and first.ready and alike:
            self.quality.measure(
                key, last.done, last.total, lambda: [self.download(s) for s in (first, last)]
            )
        return self.quality.latest(key)


def _coarser(a: tuple[Any, ...], b: tuple[Any, ...]) -> bool:
    """Return True if an image of quality `a` is coarser than one of quality `b`."""
    if a[3] != b[3]:
        return a[3]
    return a[0][0] < b[0][0] or a[1] < b[1]


# ---- light of videos as a display with the primaries of Rec. 709 shows it: wide gamut, HLG ----


_TEXEL = "rgba32float"


class VideoLight:
    """The display light of a video's picture, kept as long as the picture stays."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._frame = gpu.SizeBindings(device)
        self._converted: dict[str, tuple[tuple[Any, ...], Image]] = {}

    def image(self, slot: str, image: Image, coding: Coding) -> Image:
        """`image` as linear Rec. 709 light of a display; `slot`: on which side it is.

        Light of the scene (HLG) is shown as on a display of 1,000 cd/m2. Colours that Rec. 709
        does not have are left negative.
        """
        primaries = primaries_of(coding)
        if primaries == REC709 and coding.transfer != HLG:
            return image
        key = image.stamp, coding
        if self._converted.get(slot, (None,))[0] != key:
            assert image.texture is not None
            texture = self._images.texture(slot, image.texture.size[:2], _TEXEL)
            self._convert(image.texture, texture, primaries, coding.transfer == HLG)
            self._converted[slot] = key, Image(texture, "COLOR", key)
        return self._converted[slot][1]

    def _convert(
        self,
        light: wgpu.GPUTexture,
        output: wgpu.GPUTexture,
        primaries: tuple[float, ...],
        of_scene: bool,
    ) -> None:
        size = output.size[0], output.size[1]
        kernel = gpu.kernel(
            self._device, "viewer/draw/video_light.wgsl", {"Output": _TEXEL}, HLG=of_scene
        )
        red, green, blue = conversion(primaries, REC709)
        onto = {"red": red, "green": green, "blue": blue, "luminance": luminance(primaries)}
        encoder = self._device.create_command_encoder(label="video light")
        kernel.run(
            encoder,
            "main",
            self._frame(size),
            onto=onto,
            light=light.create_view(),
            output=output.create_view(),
        )
        gpu.submit(self._device, encoder)


def primaries_of(coding: Coding) -> tuple[float, ...]:
    """The chromaticities of a video's primaries; Rec. 709 where they are not known here."""
    return H273.get(coding.primaries, REC709)
