"""Steps of the buttons and the command line: no window, no event.

Each `next` of `steps` does a little and tells how far it is; closing the generator stops the work
and leaves Blender as it was.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import sharp
from .blurring import Blurring, both_halves, save_layers
from .comparison import show
from .exposure import cuts_of, exposure_of
from .folders import check_folder, put_in_place, remove
from .picture import picture_of
from .process import Process, lent
from .rendering import Render, at_once
from .saving import Compositing, Saving, paths_of
from .wanted import ERRORS, Report, Step, Wanted, frames_of, objects_of
from .wgmb_worker.problem import ProblemError, plain
from .wgmb_worker.recipe import COMPOSITE, Picture, Recipe, Setup, SharpFrames, View, told


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


def described(
    scene: bpy.types.Scene, wanted: Wanted, number: int, folder: Path
) -> tuple[Setup, Recipe]:
    """The blur of the picture of one frame by the sharp files that are there."""
    wanted = replace(wanted, frames=(number,), is_rendering=False)
    work = _Work(scene, wanted, Report(), at_once, is_shown=True)
    recipe = work.recipe(folder)
    return work.setup, replace(recipe, layers=recipe.layers[:1], is_whole=False)


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
        self.kept = objects_of(wanted.kept)
        self.shown = frames_of(scene, wanted)
        if not self.shown:
            raise ProblemError("There are no frames: the end is before the start")
        self.setup = Setup(
            wanted.method,
            exposure_of(scene),
            wanted.samples,
            wanted.device,
            "off" if wanted.light == "OFF" else "auto",
        )
        self.has_light = self._can_follow_light()
        self.cuts = cuts_of(scene)
        self.rendered: set[int] = set()
        self._done = 0
        self._all = 1

    def _can_follow_light(self) -> bool:
        """Return True if passes of light are to be rendered; without a GPU only if asked for."""
        wanted = self.wanted
        if wanted.method != "gather" or wanted.light == "OFF" or self.is_composited:
            return False
        return wanted.light == "ON" or self.scene.render.engine == "CYCLES"

    # ---- all of it -----------------------------------------------------------------------------

    def steps(self) -> Iterator[Step]:
        """See `steps` of this file."""
        wanted = self.wanted
        saving = Saving(self.scene, self.picture, self.views, self.shown)
        if wanted.is_blurring and not self.is_shown:
            self._check_output(saving)
        if wanted.is_rendering:
            check_folder(Path(self.files.stem).parent)
        around = self._around() if wanted.is_rendering else []
        self._all = len(around) + (len(self.shown) if wanted.is_blurring else 0) or 1
        if wanted.is_blurring:
            with lent() as process:
                yield from self._open(process)
                yield from self._render(around)
                yield from self._blur(process, saving)
        else:
            yield from self._render(around)
        yield 1.0, "Done"

    def _open(self, process: Process) -> Iterator[Step]:
        """A machine that cannot blur is found out before hours of rendering."""
        opening = process.ask("open", setup=told(self.setup))
        yield from self._until(opening, "Opening the GPU")
        if opening.result()["is_cpu"]:
            self.report.notes.append("No GPU found: blurred on the CPU")
            self.has_light &= self.wanted.light == "ON"

    def _around(self) -> list[int]:
        near = (-1, 0, 1) if self.wanted.handles else (0,)
        return sorted({n + o for n in self.shown for o in near})

    def _step(self, text: str) -> Step:
        return self._done / self._all, text

    def _told(self, text: str, work: Iterator[None]) -> Iterator[Step]:
        """The steps of something that has no text of its own."""
        with contextlib.closing(work) as all_steps:
            for _ in all_steps:
                yield self._step(text)

    def _until(self, future: Future[Any], text: str) -> Iterator[Step]:
        """Wait for the other process."""
        yield self._step(text)
        while not future.done():
            if self.render is at_once:
                future.exception()  # nothing else is to be done meanwhile
            yield self._step(text)

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
            check_folder(folder)

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
                        self.has_light,
                        self.is_composited,
                        self.render,
                    )
                    yield from self._told(f"Rendering frame {number}", rendering)
                self.rendered.add(number)
                self._done += 1
        finally:
            if around:
                scene.frame_set(now, subframe=part)

    # ---- blurring ------------------------------------------------------------------------------

    def _blur(self, process: Process, saving: Saving) -> Iterator[Step]:
        saving.numbers = self.shown
        is_film = saving.is_film and not self.is_shown
        folder = self._folder(is_film)
        blurring = Blurring(process, self.setup, self.recipe(folder))
        compositing = None
        if self.has_compositor and not self.is_composited:
            compositing = Compositing(self.scene, self.picture, self.views)
        film: list[list[Path]] = []
        moves = False
        try:
            for number in self.shown:
                future = blurring.ask(number)
                yield from self._until(future, f"Blurring frame {number}")
                if (error := future.exception()) is not None:
                    self._failed(number, error)
                else:
                    found = future.result()
                    moves |= found["moves"]
                    self.report.notes += found["notes"]
                    layers = [Path(file) for file in found["files"]]
                    yield from self._finish(number, layers, compositing, saving, film, blurring)
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
            if not process.is_idle:
                process.close()  # before its folder goes
            saving.close()
            if compositing is not None:
                compositing.close()
            self.report.files += saving.files
            if not is_film or saving.files:
                shutil.rmtree(folder, ignore_errors=True)
            elif film:
                self.report.notes.append(f"The blurred frames without the film are in {folder}")

    def _finish(
        self,
        number: int,
        layers: list[Path],
        compositing: Compositing | None,
        saving: Saving,
        film: list[list[Path]],
        blurring: Blurring,
    ) -> Iterator[Step]:
        """A blurred frame to where it belongs, through the compositor if there is one."""
        text = f"Blurring frame {number}"
        files, composites = layers, None
        if compositing is not None:
            yield from self._told(text, compositing(number, layers))
            files = composites = compositing.composites(number, layers)
            if not self.is_multilayer:
                remove(layers)
        if self.is_shown:
            yield from self._show(number, files[0], blurring)
        elif saving.is_film:
            film.append(list(files))
            return
        elif self.is_multilayer:
            yield from self._save_layers(number, layers, composites, saving, blurring)
        else:
            yield from self._told(text, saving.picture(number, files))
        remove([*layers, *files])

    def _film(self, saving: Saving, film: list[list[Path]]) -> Iterator[Step]:
        if self.report.failed:
            raise ProblemError(f"The film was not made: {next(iter(self.report.failed.values()))}")
        film = [
            [_renamed(path, i, view) for path, view in zip(one, self.views, strict=True)]
            for i, one in enumerate(film, 1)
        ]
        yield from self._told("Writing the film", saving.film(film, self.render))

    def _failed(self, number: int, error: BaseException) -> None:
        if not isinstance(error, ERRORS):
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

    def recipe(self, folder: Path) -> Recipe:
        """The subject of the blur, whose files go into `folder`."""
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
            rendered=sorted(self.rendered) if self.wanted.is_rendering else None,
            picture=self.picture,
            cuts=self.cuts,
            kept=self.kept,
            folder=str(folder),
            is_whole=is_whole,
        )

    def _save_layers(
        self,
        number: int,
        layers: Sequence[Path],
        composites: Sequence[Path] | None,
        saving: Saving,
        blurring: Blurring,
    ) -> Iterator[Step]:
        paths = saving.paths(number)
        made = [path.with_name(f"layers_{path.name}") for path in layers]
        for future in save_layers(blurring.process, self.scene, layers, composites, made):
            yield from self._until(future, f"Blurring frame {number}")
            future.result()
        for file, path in zip(made, paths, strict=True):
            put_in_place(file, path)
        saving.files += paths

    def _show(self, number: int, file: Path, blurring: Blurring) -> Iterator[Step]:
        """Put the sharp frame and the blurred one side by side into an image."""
        layer, path = sharp.layers_of(self.scene)[0].name, file.with_name("both.npy")
        future = both_halves(
            blurring.process, blurring.recipe, number, file, self.views[0], layer, path
        )
        yield from self._until(future, f"Blurring frame {number}")
        future.result()
        show(np.load(path))


def _renamed(path: Path, number: int, view: View) -> Path:
    """Give a file of a film the number of its place: Blender finds the frames by it."""
    target = path.with_name(f"film_{number:06d}{view.suffix}.exr")
    os.replace(path, target)
    return target
