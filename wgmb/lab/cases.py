"""Cases (an image with its ground truth) and candidates (the methods that compute it)."""

from __future__ import annotations

import ast
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import wgpu

from ..errors import InputError
from ..extent import EVERYWHERE
from ..frame import Frame
from ..io.frame_numbers import frame_list
from ..methods import METHODS, check_method
from ..methods.options import options_of
from ..metrics import measure
from ..pipeline.blur import Blur
from ..render import Render
from ..scene import builtin
from ..scene.scene import Scene
from ..sequence.clip import Clip
from ..sequence.data_windows import laid, union
from ..shutter import Shutter

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Candidate:
    """A method with options as the command line writes it: `tap`, `reproject:variant=published`.

    `samples`: its own number at equal samples, `tap:32`; None takes everyone's. `name`: what
    tables call it, if not by method and options. `select`: the part of a case's frame that it gets.
    """

    method: str
    options: tuple[tuple[str, Any], ...] = ()
    samples: int | None = None
    name: str = ""
    select: Callable[[Frame], Frame] = lambda frame: frame

    @classmethod
    def parse(cls, text: str) -> Candidate:
        """NAME[:SAMPLES][:OPTION=VALUE]...; the error says which method is unknown."""
        name, *more = text.split(":")
        check_method(name)
        samples, options = None, []
        for part in more:
            key, equals, value = part.partition("=")
            if equals:
                options.append((key, _option(name, key, value)))
            elif part.isdecimal() and len(part) < 10:
                samples = int(part)
            else:
                raise InputError(f"a method is NAME:SAMPLES:OPTION=VALUE, got {text!r}")
        return cls(name, tuple(options), samples)

    @property
    def label(self) -> str:
        """Name in tables."""
        return self.name or ", ".join([self.method, *(f"{k} {v}" for k, v in self.options)])

    @property
    def needs_scene(self) -> bool:
        """True if the method renders a scene instead of blurring rendered frames."""
        return "scene" in METHODS[self.method].needs

    def blur(self, samples: int, shutter: Shutter, device: wgpu.GPUDevice) -> Blur:
        """Compiled for one number of samples."""
        return Blur(
            METHODS[self.method],
            shutter=shutter,
            samples=samples,
            device=device,
            **dict(self.options),
        )


def _option(method: str, name: str, text: str) -> Any:
    """The value of an option that a Blur of the method takes; the error says what it has."""
    known = options_of(METHODS[method].Options)
    value = _value(text)
    if name in known:
        known[name].check(value)
    elif name not in ("jitter", "max_blur"):
        every = ", ".join((*known, "jitter", "max_blur"))
        raise InputError(f"method {method!r} has no option {name}; available: {every}")
    elif not isinstance(value, (int, float)) or isinstance(value, bool):
        raise InputError(f"{name} must be a number, got {text!r}")
    return value


def _value(text: str) -> Any:
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):  # the last two: much nested
        return text


@dataclass(frozen=True)
class SceneFrame:
    """A scene at one moment, for the methods that need one."""

    scene: Scene
    time: float = 0.0
    size: tuple[int, int] = (480, 270)
    fps: float = 24.0
    antialias: int = 3

    def render(self, blur: Blur) -> Render:
        """The scene through a method."""
        return Render(self.scene, blur, size=self.size, fps=self.fps, antialias=self.antialias)

    def frame(self, device: wgpu.GPUDevice) -> Frame:
        """The sharp frame between two on either side, as image methods are given it from files."""
        render = self.render(Blur("tap", device=device))
        made = {k: render.frame(self.time + k / self.fps, k + 1, light=True) for k in range(-2, 3)}
        before, after = made[-1].between(made[-2], None), made[1].between(None, made[2])
        return made[0].between(before, after)


@dataclass(frozen=True)
class Case:
    """One picture to be made, with its inputs and its ground truth."""

    name: str
    frame: Frame
    shutter: Shutter
    truth: np.ndarray
    """(height, width, 3 or 4) linear."""
    about: str
    """Description of the truth."""
    scene_frame: SceneFrame | None = None
    peers: dict[str, np.ndarray] = field(default_factory=dict)
    """Pictures of other programs, by name."""
    floor: dict[str, float] | None = None
    """Score of a perfect image by each metric, if the truth's noise is known."""


def scene_case(
    name: str,
    shutter: Shutter,
    reference: Candidate,
    scene_frame: SceneFrame,
    device: wgpu.GPUDevice,
    tell: Tell,
) -> Case:
    """A case whose truth is rendered by `reference`, such as distributed:1024.

    One that takes a seed renders it as two halves with seeds of their own.
    """
    if not reference.needs_scene:
        wanted = ", ".join(m for m in METHODS if "scene" in METHODS[m].needs)
        raise InputError(f"the reference must be one of {wanted}, got {reference.method!r}")
    samples = reference.samples or 1024
    tell(f"{name}: reference, {reference.label} {samples}")
    started = time.perf_counter()
    pictures = [
        scene_frame.render(part.blur(part.samples or samples, shutter, device))(scene_frame.time)
        for part in _halves(reference, samples) or [reference]
    ]
    took = time.perf_counter() - started
    about = f"{reference.label}, {samples} samples per pixel, {took:.1f} s"
    case = Case(name, scene_frame.frame(device), shutter, pictures[0], about, scene_frame)
    return case if len(pictures) == 1 else _of_halves(case, pictures)


def _halves(reference: Candidate, samples: int) -> list[Candidate]:
    """The reference as two with half the samples; none where it has no noise, or one sample."""
    known = options_of(METHODS[reference.method].Options)
    if "seed" not in known or samples < 2:
        return []
    options = dict(reference.options)
    seed = options.get("seed", known["seed"].default)
    # Neither has the seed of a candidate that nobody gave one, which would share its rays.
    return [
        replace(reference, options=tuple((options | {"seed": s}).items()), samples=n)
        for s, n in ((2 * seed + 1, samples - samples // 2), (2 * seed + 2, samples // 2))
    ]


def _of_halves(case: Case, halves: Sequence[np.ndarray]) -> Case:
    """The case with the mean of two independent halves as its truth, and with its noise floor.

    The mean has half the variance of one half, and so has the difference between them: a half
    is as far from the mean as a perfect picture is, in the root of the mean square.
    """
    if halves[0].shape != halves[1].shape:
        sizes = " and ".join(f"{h.shape[1]} x {h.shape[0]}" for h in halves)
        raise InputError(f"two halves of the truth must be of one size, got {sizes}")
    truth = np.mean(halves, axis=0)
    found = [measure(half, truth) for half in halves]
    floor = {name: float(np.mean([f[name] for f in found])) for name in found[0]}
    return replace(case, truth=truth, floor=floor)


def clip_case(
    name: str, shutter: Shutter, inputs: Sequence[str], truth: Sequence[Path],
    peers: dict[str, Path], open_clip: Callable[[str], Clip] = Clip,
) -> Case:  # fmt: skip
    """A case of rendered frames on disk.

    `inputs`: a pattern of which `open_clip` chooses one frame, or the file of one frame, or the
    files of the frames before, here and after. `truth`: one file, or two independent halves of it.
    """
    if len(truth) not in (1, 2):
        raise InputError(f"`truth` must be one file or two halves of it, got {len(truth)}")
    if len(inputs) == 3:
        before, here, after = (
            clip.with_neighbours(clip.source(clip.numbers[0]), extent=EVERYWHERE)
            for clip in map(open_clip, inputs)
        )
        frame = replace(here, prev=before, next=after)
    elif len(inputs) == 1:
        clip = open_clip(inputs[0])
        if len(clip.numbers) > 1:
            raise InputError(
                f"{inputs[0]}: got frames {frame_list(clip.numbers)}, but a truth shows one frame; "
                "`frames` selects it"
            )
        here = clip.source(clip.numbers[0])
        frame = clip.with_neighbours(here, extent=EVERYWHERE, reach=2)
    else:
        raise InputError(f"`inputs` must be a pattern, one file or three, got {len(inputs)}")
    pictures = {k: _read(path) for k, path in peers.items()}
    truths = [_read(path) for path in truth]
    if len(truths) == 1:
        about = f"{truth[0].name}; a single image, so its noise is unknown"
        return Case(name, frame, shutter, truths[0], about, peers=pictures)
    about = f"mean of {truth[0].name} and {truth[1].name}"
    return _of_halves(Case(name, frame, shutter, truths[0], about, peers=pictures), truths)


def _read(path: Path) -> np.ndarray:
    clip = Clip(path)
    source = clip.source(clip.numbers[0])
    return laid(source.rgba, source.data_window, union([source.data_window, source.display_window]))


def make_scene(text: str) -> tuple[str, Scene]:
    """NAME[:SETTING=VALUE]... -> a name for tables, and the scene."""
    name, *more = text.split(":")
    pairs = [part.partition("=") for part in more]
    if wrong := [part[0] for part in pairs if not part[1]]:
        raise InputError(f"a scene is NAME:SETTING=VALUE, got {wrong[0]!r}")
    settings = {key: value for key, _, value in pairs}
    return ", ".join([name, *(f"{k} {v}" for k, v in settings.items())]), builtin.make(
        name, **settings
    )
