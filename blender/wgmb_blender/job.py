"""What the buttons and the command line do, as steps: no window, no event.

Each `next` of `steps` does a little and tells how far it is; closing the generator stops the work
and leaves Blender as it was.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import sharp
from .blurring import COMPOSITE, Blurring, Recipe, open_blur, plain
from .exposure import cuts_of, shutter_of
from .multilayer import save_multilayer
from .picture import Picture, picture_of
from .problem import ProblemError
from .rendering import Render, at_once
from .saving import Compositing, Saving, paths_of
from .sharp import SharpFrames, View

Step = tuple[float, str]
"""The share that is done, 0..1, and what is being done."""

COMPARISON = "Motion Blur: sharp, blurred"


@dataclass(frozen=True)
class Wanted:
    """What the user asks for. `frames`: by default the scene's. `samples`: a number or "auto".

    `handles`: render the frames around those too. `overscan`: pixels. `composited`: blur what the
    compositor makes, not what it is given. `kept`: collections that stay sharp. `sharp`: where the
    sharp frames lie, as in the panel. `device`: a part of an adapter's name.
    """

    method: str = "gather"
    samples: int | str = 16
    frames: tuple[int, ...] | None = None
    handles: bool = True
    overscan: int = 0
    composited: bool = False
    kept: tuple[str, ...] = ()
    sharp: str = "//sharp/"
    device: str | None = None
    is_rendering: bool = True
    is_blurring: bool = True


@dataclass
class Report:
    """What was done: frames, those that failed and why, remarks, and files."""

    done: list[int] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    skipped: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    @property
    def lines(self) -> list[str]:
        """What the user reads, the most important last."""
        lines = list(dict.fromkeys(self.notes))
        if self.skipped:
            lines.append(f"{_count(self.skipped)} already there: Overwrite is off")
        lines += list(self.failed.values())
        if self.done or self.failed:
            lines.append(f"{_count(self.done)} blurred")
        return lines


def _count(frames: Sequence[int]) -> str:
    return "1 frame" if len(frames) == 1 else f"{len(frames)} frames"


def frames_of(scene: bpy.types.Scene, wanted: Wanted) -> list[int]:
    """The frames to blur."""
    if wanted.frames is not None:
        return list(dict.fromkeys(wanted.frames))
    return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))


def steps(
    scene: bpy.types.Scene, wanted: Wanted, report: Report, render: Render = at_once
) -> Iterator[Step]:
    """Render sharp frames and blur them into the scene's output.

    ProblemError where nothing, or nothing more, can be done. A frame that fails is in the report,
    and the others are done. What is finished stays.
    """
    work = _Work(scene, wanted, report, render)
    with contextlib.closing(work.steps()) as all_steps:
        yield from all_steps


def compare(
    scene: bpy.types.Scene, wanted: Wanted, report: Report, render: Render = at_once
) -> Iterator[Step]:
    """Render the current frame and those around it; the image COMPARISON shows what the blur does.

    The left half is sharp, the right half blurred, before compositing unless it comes first.
    """
    number = scene.frame_current
    folder = Path(tempfile.mkdtemp(prefix="wgmb_"))
    wanted = replace(
        wanted, frames=(number,), handles=True, sharp=str(folder / "sharp_"), is_rendering=True
    )
    try:
        work = _Work(scene, wanted, report, render, is_shown=True)
        with contextlib.closing(work.steps()) as all_steps:
            yield from all_steps
    finally:
        shutil.rmtree(folder, ignore_errors=True)


class _Work:
    """One run."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        wanted: Wanted,
        report: Report,
        render: Render,
        is_shown: bool = False,
    ):
        self.scene, self.wanted, self.report, self.render = scene, wanted, report, render
        self.is_shown = is_shown
        sharp.check(scene)
        self.picture: Picture = picture_of(scene, wanted.overscan)
        self.files: SharpFrames = sharp.sharp_frames(wanted.sharp)
        self.views: list[View] = sharp.views_of(scene)
        self.has_compositor = sharp.has_compositor(scene)
        self.is_composited = wanted.composited and self.has_compositor
        self.is_multilayer = (
            scene.render.image_settings.file_format == "OPEN_EXR_MULTILAYER" and not is_shown
        )
        self.kept = _names(wanted.kept)
        self.shown = frames_of(scene, wanted)
        if not self.shown:
            raise ProblemError("There are no frames: the end is before the start")
        self.cuts = cuts_of(scene)
        self.rendered: set[int] = set()
        self._done = 0
        self._all = 1

    # ---- all of it -----------------------------------------------------------------------------

    def steps(self) -> Iterator[Step]:
        """See `steps` of this file."""
        wanted = self.wanted
        saving = Saving(self.scene, self.picture, self.views, self.shown)
        if wanted.is_blurring and not self.is_shown:
            self._check_output(saving)
        if wanted.is_rendering:
            _check_folder(Path(self.files.stem).parent)
        blur = None
        if wanted.is_blurring:  # what cannot run is known before hours of rendering
            shutter = shutter_of(self.scene)
            blur = open_blur(wanted.method, shutter, wanted.samples, wanted.device)
            if blur.device.adapter_info["adapter_type"] == "CPU":
                self.report.notes.append("No GPU found: blurred on the CPU")
        around = self._around() if wanted.is_rendering else []
        self._all = len(around) + (len(self.shown) if wanted.is_blurring else 0) or 1
        yield from self._render(around)
        if blur is not None:
            yield from self._blur(blur, saving)
        yield 1.0, "Done"

    def _around(self) -> list[int]:
        near = (-1, 0, 1) if self.wanted.handles else (0,)
        return sorted({n + o for n in self.shown for o in near})

    def _step(self, text: str) -> Step:
        return self._done / self._all, text

    def _check_output(self, saving: Saving) -> None:
        """ProblemError where results could not be written, or would replace what they are of."""
        scene = self.scene
        if not scene.render.use_overwrite and not saving.is_film:
            there = [n for n in self.shown if all(p.exists() for p in saving.paths(n))]
            self.report.skipped += there
            self.shown = [n for n in self.shown if n not in there]
        targets = {p for n in self.shown for p in paths_of(scene, self.views, n)}
        inputs = {self.files.path(n, view) for n in self.shown for view in self.views}
        if same := targets & inputs:
            raise ProblemError(
                f"{min(same)} is a sharp frame, and the blurred one would replace it: choose "
                "another output, or another place for the sharp frames"
            )
        for folder in {path.parent for path in targets}:
            _check_folder(folder)

    # ---- rendering -----------------------------------------------------------------------------

    def _render(self, around: Sequence[int]) -> Iterator[Step]:
        scene = self.scene
        now, part = scene.frame_current, scene.frame_subframe
        try:
            for number in around:
                paths = [self.files.path(number, view) for view in self.views]
                is_there = all(path.is_file() for path in paths)
                if scene.render.use_overwrite or not is_there:
                    yield self._step(f"Rendering frame {number}")
                    rendering = sharp.render_frame(
                        scene,
                        number,
                        self.files,
                        self.picture,
                        bool(self.kept),
                        self.is_composited,
                        self.render,
                    )
                    with contextlib.closing(rendering):
                        for _ in rendering:
                            yield self._step(f"Rendering frame {number}")
                self.rendered.add(number)
                self._done += 1
        finally:
            if around:
                scene.frame_set(now, subframe=part)

    # ---- blurring ------------------------------------------------------------------------------

    def _blur(self, blur: Any, saving: Saving) -> Iterator[Step]:
        saving.numbers = self.shown
        is_film = saving.is_film and not self.is_shown
        folder = self._folder(is_film)
        blurring_ = Blurring(self._recipe(folder), blur)
        compositing = None
        if self.has_compositor and not self.is_composited:
            compositing = Compositing(self.scene, self.picture, self.views)
        film: list[list[Path]] = []
        moves = False
        try:
            for number in self.shown:
                text = f"Blurring frame {number}"
                yield self._step(text)
                future = None
                for future in blurring_.blurred(number):
                    yield self._step(text)
                    if not future.done() and self.render is at_once:
                        future.exception()  # nothing else is to be done meanwhile
                assert future is not None
                if (error := future.exception()) is not None:
                    self._failed(number, error)
                else:
                    found = future.result()
                    moves |= found.moves
                    self.report.notes += found.notes
                    files = found.files
                    if compositing is not None:
                        yield from self._told(text, compositing(number, files))
                        files = compositing.composites(number, found.files)
                        if not self.is_multilayer:
                            _remove(found.files)
                    if self.is_shown:
                        self._show(number, files[0])
                    elif is_film:
                        film.append(list(files))
                    elif self.is_multilayer:
                        self._save_layers(number, found.files, files, saving)
                    else:
                        yield from self._told(text, saving.picture(number, files))
                    if not is_film:
                        _remove([*found.files, *files])
                    self.report.done.append(number)
                self._done += 1
            if film:
                yield from self._film(saving, film)
            if self.report.done and not moves:
                self.report.notes.append(
                    "All vectors are 0: nothing moves in these frames, or motion blur was on while "
                    "they were rendered"
                )
        finally:
            blurring_.close()
            saving.close()
            if compositing is not None:
                compositing.close()
            self.report.files += saving.files
            if not is_film or saving.files:
                shutil.rmtree(folder, ignore_errors=True)
            elif film:
                self.report.notes.append(f"The blurred frames without the film are in {folder}")

    def _told(self, text: str, work: Iterator[None]) -> Iterator[Step]:
        """The steps of something that has no text of its own."""
        with contextlib.closing(work) as all_steps:
            for _ in all_steps:
                yield self._step(text)

    def _film(self, saving: Saving, film: list[list[Path]]) -> Iterator[Step]:
        if self.report.failed:
            raise ProblemError(f"The film was not made: {next(iter(self.report.failed.values()))}")
        film = [
            [_renamed(path, i, view) for path, view in zip(one, self.views, strict=True)]
            for i, one in enumerate(film, 1)
        ]
        yield from self._told("Writing the film", saving.film(film, self.render))

    def _failed(self, number: int, error: BaseException) -> None:
        import wgmb

        if not isinstance(error, (wgmb.Error, ProblemError, OSError, MemoryError)):
            raise error
        text = plain(error)
        named = text if f"rame {number}" in text else f"Frame {number}: {text}"
        self.report.failed[number] = named

    def _folder(self, is_film: bool) -> Path:
        """The folder of blurred files: of a film, beside the sharp frames, where it may stay."""
        if not is_film:
            return Path(tempfile.mkdtemp(prefix="wgmb_"))
        stem = Path(self.files.stem)
        folder = stem.parent / f"{stem.name.rstrip('_-. ') or 'sharp'}_blurred"
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def _recipe(self, folder: Path) -> Recipe:
        layers = [layer.name for layer in sharp.layers_of(self.scene)]
        is_whole = self.is_multilayer or (self.has_compositor and not self.is_composited)
        if self.is_composited:
            layers = [COMPOSITE]
        elif not is_whole:
            layers = layers[:1]  # the one that Blender saves without a compositor
        return Recipe(
            sharp=self.files,
            views=self.views,
            layers=layers,
            frames=self.shown,
            rendered=frozenset(self.rendered) if self.wanted.is_rendering else None,
            picture=self.picture,
            cuts=self.cuts,
            kept=self.kept,
            folder=folder,
            is_whole=is_whole,
        )

    def _save_layers(
        self, number: int, layers: Sequence[Path], composites: Sequence[Path], saving: Saving
    ) -> None:
        paths = saving.paths(number)
        added = composites if composites is not layers else [None] * len(layers)
        save_multilayer(self.scene, list(zip(self.views, layers, added, strict=True)), paths)
        saving.files += paths

    def _show(self, number: int, file: Path) -> None:
        """Put the sharp frame and the blurred one side by side into an image."""
        from wgmb.io import exr

        layer = COMPOSITE if self.is_composited else sharp.layers_of(self.scene)[0].name
        channels = exr.read(self.files.path(number, self.views[0])).channels()
        before = np.stack([channels[f"{layer}.Combined.{c}"] for c in "RGBA"], 2)
        channels = exr.read(file).channels()
        stem = "" if "R" in channels else f"{layer}.Combined."
        after = np.stack([channels[stem + c] for c in "RGBA" if stem + c in channels], 2)
        image_of(np.hstack([self.picture.laid(before), after]))


def _remove(files: Sequence[Path]) -> None:
    for path in files:
        path.unlink(missing_ok=True)


def _renamed(path: Path, number: int, view: View) -> Path:
    """Give a file of a film the number of its place: Blender finds the frames by it."""
    target = path.with_name(f"film_{number:06d}{view.suffix}.exr")
    os.replace(path, target)
    return target


def _names(collections: Sequence[str]) -> tuple[str, ...]:
    """The objects of collections, with those that they instance, by name."""
    names: dict[str, None] = {}
    ahead = [bpy.data.collections.get(name) for name in collections]
    missing = [name for name, one in zip(collections, ahead, strict=True) if one is None]
    if missing:
        raise ProblemError(f"Keep Sharp: there is no collection {missing[0]!r}")
    seen: set[str] = set()
    while ahead:
        collection = ahead.pop()
        if collection is None or collection.name_full in seen:
            continue
        seen.add(collection.name_full)
        for one in collection.all_objects:
            names[one.name] = None
            ahead.append(one.instance_collection)
    return tuple(names)


def _check_folder(folder: Path) -> None:
    """Make a folder; ProblemError unless files can be written into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(prefix=".wgmb_", dir=folder):
            pass
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise ProblemError(f"Cannot write into {folder}: {why}") from None


def image_of(rgba: np.ndarray) -> bpy.types.Image:
    """The image COMPARISON, with linear premultiplied light, the first row on top."""
    height, width, channels = rgba.shape
    image = bpy.data.images.get(COMPARISON)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(COMPARISON, width, height, alpha=True, float_buffer=True)
        image.alpha_mode = "PREMUL"
        image.use_view_as_render = True
    four = np.ones((height, width, 4), np.float32)
    four[..., :channels] = rgba
    image.pixels.foreach_set(np.ascontiguousarray(four[::-1]).ravel())
    image.update()
    return image
