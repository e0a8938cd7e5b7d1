"""Available choices: subjects, methods and their options, views, comparisons."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
import wgpu

from ..methods import METHODS, default_method
from ..methods.options import Option, options_of
from .draw.display import DisplayCache
from .state.files import reader_of
from .state.state import (
    BOTH_EYES,
    KEPT,
    LOOKS,
    REFERENCE,
    State,
)
from .subjects.subject import ClipSubject, SceneSubject, Subject
from .subjects.video import VideoSubject

QUICKEST = "tap"
"""The method that stands for slower ones where drawing is slow."""


class Choices:
    """Choices available with the device and the scene or frames."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self.displayed = device, DisplayCache(device)
        self._scene: SceneSubject | None = None
        self._clips: dict[tuple[Any, ...], ClipSubject | VideoSubject] = {}
        self._coming: tuple[tuple[Any, ...], ClipSubject] | None = (
            None  # seen, but its vectors unknown
        )

    def subject(self, state: State) -> Subject:
        """The scene or the frames that the state is about."""
        if state.is_scene:
            self._scene = self._scene or SceneSubject(self._device)
            return self._scene
        key = _key(state)
        if key not in self._clips:
            self._clips[key] = self._opened(state)
        return self._clips[key]

    def close_others(self, state: State) -> None:
        """Let go of the files that the state is not about."""
        # B may find the motion in another way.
        self._close_but(() if state.is_scene else (_key(state), _key(state.as_kept)))

    def first_light(self, state: State) -> np.ndarray | None:
        """The picture alone of frames that are opened now, once; None of all else.

        (height, width, 4), as the file has it. It need not wait for the test of their vectors.
        """
        if state.is_scene or state.is_video or state.mode in BOTH_EYES:
            return None
        key, display = _key(state), self.displayed.display(state)
        if display is not None or key in self._clips or (self._coming and self._coming[0] == key):
            return None
        clip = ClipSubject(self._device, state, display)
        self._coming = key, clip
        return clip.light()

    def _opened(self, state: State) -> ClipSubject | VideoSubject:
        if state.is_video:
            return VideoSubject(self._device, state)
        coming, self._coming = self._coming, None
        if coming is not None and coming[0] == _key(state):
            clip = coming[1]
        else:
            clip = ClipSubject(self._device, state, self.displayed.display(state))
        _ = clip.finding  # what cannot be read is not opened
        return clip

    def _close_but(self, keys: Collection[tuple[Any, ...]]) -> None:
        for key in [key for key in self._clips if key not in keys]:
            clip = self._clips.pop(key)
            if isinstance(clip, VideoSubject):
                clip.close()

    def close(self) -> None:
        """End all work beside the window."""
        self._close_but(())

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can be used."""
        return self.subject(state).methods(state)

    def options(self, method: str) -> dict[str, Option]:
        """The method's own options that have a control: words, numbers and switches."""
        every = options_of(METHODS[method].Options)
        return {name: option for name, option in every.items() if option.default is not None}

    def shows(self, state: State) -> list[str]:
        """Return the diagnostic outputs of the method."""
        show = self.options(state.method).get("show")
        return [word for word in show.choices if word != show.default] if show else []

    def looks(self, state: State) -> list[str]:
        """Return the available views, including the method's diagnostic outputs."""
        has, methods = self.subject(state).has(state), self.methods(state)
        blurred = state.method in methods
        can = {
            "result": blurred,
            "sharp": "color" in has,
            "perceived": blurred,
            "depth": "depth" in has,
            "velocity": "motion" in has,
            "error": blurred and "distributed" in methods,
        }
        return [look for look in LOOKS if can[look]] + (self.shows(state) if blurred else [])

    def eyes(self, state: State) -> list[str]:
        """Return the choices for stereo frames: each view, and both eyes."""
        subject = self.subject(state)
        if isinstance(subject, ClipSubject) and len(subject.eyes) > 1:
            return [*subject.eyes, *BOTH_EYES]
        return []

    def sides(self, state: State) -> tuple[str, str]:
        """The views that the left and the right eye see."""
        subject = self.subject(state)
        assert isinstance(subject, ClipSubject)
        return subject.sides()

    def reference(self, state: State) -> str | None:
        """The method that draws the ground truth, if there is one.

        Where the perceived picture is shown, that is nature: a world without frames.
        """
        if state.eye:
            return self.subject(state).nature(state)
        return "distributed" if "distributed" in self.methods(state) else None

    def has_preview(self, state: State, name: str) -> bool:
        """True if the quickest method may stand for `name`, a look or method, until it is drawn."""
        method = state.method if name in ("result", "perceived") else name
        method = state.as_kept.method if name == KEPT else method
        if method not in METHODS or method == QUICKEST or QUICKEST not in self.methods(state):
            return False
        return METHODS[QUICKEST].needs <= METHODS[method].needs  # others add samples meanwhile

    def has_edges_gathered(self, state: State) -> bool:
        """True if pictures of a video whose motion has edges are blurred with gather."""
        is_suited = state.is_video and state.is_method_suited
        return is_suited and state.video.is_by_place(self._device)

    def rivals(self, state: State) -> list[str]:
        """Return the images that the result can be compared with."""
        sharp = ["sharp"] if "sharp" in self.looks(state) else []
        reference = [REFERENCE] if self.reference(state) else []
        kept = [KEPT] if state.kept and state.as_kept.method in self.methods(state) else []
        return [*kept, *sharp, *reference, *self.methods(state)]

    def possible(self, state: State) -> State:
        """The same state; a method or look that is not to be had is replaced by one that is."""
        methods = self.methods(state)
        if state.is_video and state.is_method_suited:
            state = state.suited_by(state.video.chosen(self._device)[0].method)
        elif methods and state.method not in methods:
            usual = default_method(self.subject(state).has(state))
            state = state.with_method(usual if usual in methods else methods[0])
        if state.look not in (looks := self.looks(state)):
            state = replace(state, look=looks[0])
        if state.eyes not in (eyes := self.eyes(state)):
            state = replace(state, eyes=eyes[0] if eyes else "")
        if state.against not in (rivals := self.rivals(state)):
            state = replace(state, against=rivals[0])
        return state


def _key(state: State) -> tuple[Any, ...]:
    """Settings with which files are opened."""
    masks = state.blur.holdout, state.blur.scale
    return state.source, state.input, masks, state.read_as, _motion_of(state)


def _motion_of(state: State) -> tuple[Any, ...]:
    """Settings on which a video's motion depends; none for other files."""
    if not state.is_video:
        return ()
    video = state.video
    file = reader_of(state.source, state.input.max_mb)  # another object once it has changed
    return file, video.flow, video.flow_quality, video.duplicates
