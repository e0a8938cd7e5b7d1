"""A sound file of every kind that is read, and what reads it.

What a reader returns says what the file holds: the same again means the same picture. It
raises InputError that names the file, or something that it must not raise.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import opentimelineio as otio
import tifffile
from PIL import Image

import make_clips as clips
import make_frames as make
from make_config import film_config
from wgmb import (
    CameraFile,
    Clip,
    ColorConfig,
    InputError,
    Passes,
    viewer,
)
from wgmb.cli import app
from wgmb.color.srgb import to_display
from wgmb.io import exr, stills
from wgmb.run import job_file
from wgmb.sequence.frame_file import about
from wgmb.shots.cut_list import CutList
from wgmb.video.read.reader import VideoReader
from wgmb.viewer import State

_NAMES = {"hero": "3f000001", "floor": "3f000002"}  # of a Cryptomatte
_TEXTS = ".csv", ".edl", ".json", ".otio", ".ocio", ".toml"
_VIDEOS = ".mov", ".ts", ".mkv"  # one that is cut off is read as far as it goes


@dataclass(frozen=True)
class Kind:
    """One kind of file."""

    suffix: str
    write: Callable[[Path], object]
    read: Callable[[Path], str]
    sealed: bool = False
    """Its checksums find every wrong byte among the pixels."""

    @property
    def is_text(self) -> bool:
        """True if it is made of words and numbers."""
        return self.suffix in _TEXTS

    @property
    def may_end_early(self) -> bool:
        """True if a truncated file may be sound, with another meaning."""
        return self.suffix in (".csv", ".edl", ".toml", ".ocio", *_VIDEOS)


def read(kind: str, path: Path) -> str:
    """A digest of the file's contents; raises the errors of its reader."""
    return KINDS[kind].read(path)


def write_all(folder: Path) -> None:
    """A sound file of every kind, under its name."""
    for name, kind in KINDS.items():
        kind.write(folder / f"{name}{kind.suffix}")


def kind_of(path: Path) -> str:
    """The kind of a file that is called KIND.WHAT.SUFFIX, as those in tests/crashers are."""
    return path.name.partition(".")[0]


# ---- readers --------------------------------------------------------------------------------


def _digest(planes: Iterable[np.ndarray]) -> str:
    """Of the pixels alone, whatever their channels are called."""
    each = sorted(hashlib.sha256(np.ascontiguousarray(p).tobytes()).hexdigest() for p in planes)
    return hashlib.sha256("".join(each).encode()).hexdigest()


def _read_exr(path: Path) -> str:
    return _digest(exr.read(path).channels().values())


def _read_still(path: Path) -> str:
    return _digest([stills.read(path)])


def _read_masked(path: Path) -> str:
    """A picture with a Cryptomatte, one of whose objects is to stay sharp."""
    clip = Clip(path, passes=Passes(holdout="CryptoObject=hero"))
    frame = clip.frame(clip.source(clip.numbers[0]))
    return _digest(frame.arrays.values())


def _read_manifest(path: Path) -> str:
    """A picture with a Cryptomatte whose names are in this file, beside it."""
    picture = path.with_suffix(".exr")
    _cryptomatte(picture, manif_file=path.name)
    return _read_masked(picture)


def _read_job(path: Path) -> str:
    """A job whose seal is right, as its author makes it; then its frames are looked for."""
    try:
        content = json.loads(path.read_text("utf-8"))
        kind = content.pop("wgmb_job")
        content.pop("seal")
        whole = {"wgmb_job": kind, "seal": job_file._seal(content)} | content
        path.write_text(json.dumps(whole), "utf-8")
    except (ValueError, RecursionError, KeyError, TypeError, AttributeError):
        pass  # read as it is
    stored = job_file.read_job(path)
    with about(path):
        stored.check(stored.job.numbers, str(path))
    return hashlib.sha256(stored.text().encode()).hexdigest()


def _read_options(path: Path) -> str:
    """Options of the command line, as far as they go without a GPU: into a job."""
    job = path.with_name("options-job.json")
    make.write_exr(path.with_name("options.0001.exr"), make.frame(1))
    files = (path.with_name(f"options{what}.####.exr") for what in ("", "-out"))
    words = "job", next(files), "-o", next(files), "-j", job, "-q"
    with about(path):
        _command(path, *words, "--method", "tap", "--config", path)
    return json.dumps(job_file.read_job(job).job.settings, sort_keys=True)


def _read_camera(path: Path) -> str:
    found = CameraFile(path).around(2)
    return _digest([found.matrices(), found.world_from_pixel()])


def _read_curve(path: Path) -> str:
    """Through the command that draws it, which needs no GPU."""
    drawn = path.with_suffix(".svg")
    _command(path, "shutter", "--curve", path, "-o", drawn, "--overwrite")
    return _digest([np.frombuffer(drawn.read_bytes(), np.uint8)])


def _read_cuts(path: Path) -> str:
    return str(sorted(CutList(str(path)).frames(1)))


def _read_settings(path: Path) -> str:
    """Through the command that opens the viewer, without a window."""
    states: list[State] = []
    shown = viewer.view
    viewer.view = lambda state, **_: states.append(state)
    try:
        _command(path, "view", "--config", path)
    finally:
        viewer.view = shown
    return hashlib.sha256(states[0].toml().encode()).hexdigest()


def _read_video(path: Path) -> str:
    return _digest(plane for _, picture in VideoReader(path) for plane in picture.planes)


def _read_ocio(path: Path) -> str:
    """The config, and colours through two of its spaces and a display with a table."""
    config, color = ColorConfig(path), make.picture(1)[..., :3]
    space = config.space("lin_rec709")
    linear = [space.linear(color), config.space("log").linear(color)]
    return _digest([*linear, config.display(view="Film").shown(color, space)])


def _command(path: Path, *words: object) -> None:
    """The command line in this process; what it refuses is an InputError with its words."""
    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        code = app.main([str(word) for word in words])
    if code != app.DONE:
        if code != app.USAGE:
            raise AssertionError(f"exit {code}: {said.getvalue()}")
        raise InputError(said.getvalue().removesuffix("\n"))


# ---- sound files ----------------------------------------------------------------------------


def _exr(compression: str) -> Callable[[Path], object]:
    chosen = getattr(OpenEXR, f"{compression}_COMPRESSION")
    return lambda path: make.write_exr(path, make.frame(1), compression=chosen)


def _tiled(path: Path) -> None:
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    header = {"type": OpenEXR.tiledimage, "tiles": tiles, "compression": OpenEXR.ZIP_COMPRESSION}
    channels = {k: np.ascontiguousarray(v) for k, v in make.frame(1).items()}
    OpenEXR.File(header, channels).write(str(path))


def _multipart(path: Path) -> None:
    picture, motion = make.colors(make.picture(1)), make.written("nuke", *make.motion(1))
    make.write_parts(path, [make.part(picture, name="rgba"), make.part(motion, name="motion")])


def _cryptomatte(path: Path, **other: str) -> None:
    """`other`: where the names are, if not in the file."""
    ids, coverage = np.full((48, 64), 0x3F000001, np.uint32).view(np.float32), np.ones((48, 64))
    lead = "cryptomatte/0000000/"
    facts = {"name": "CryptoObject", "hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
    facts |= other or {"manifest": json.dumps(_NAMES)}
    make.write_exr(
        path,
        make.frame(1) | {"CryptoObject00.R": ids, "CryptoObject00.G": coverage.astype(np.float32)},
        {lead + name: value for name, value in facts.items()},
    )


def _manifest(path: Path) -> None:
    path.write_text(json.dumps(_NAMES))


def _job(path: Path) -> None:
    source = path.with_name("job-in.####.exr")
    for number in (1, 2):
        make.write_exr(path.with_name(f"job-in.{number:04}.exr"), make.frame(number))
    out = path.with_name("job-out.####.exr")
    _command(path, "job", source, "-o", out, "-j", path, "--method", "tap", "-q")


def _options(path: Path) -> None:
    path.write_text(
        '[blur]\nshutter = 180.0\nphase = "centre"\ncurve = "box"\nsamples = 16\njitter = 0.5\n'
        'max-blur = 40.0\nvectors = "blender"\nwindow = "grow"\ncompression = "zip"\n'
        'layers = "all"\nframes = "1"\n'
    )


def _still(bits: int, channels: int = 4) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        picture = make.picture(1)[..., :channels]
        path.write_bytes(stills.encode(picture, path.suffix, bits, '{"samples": 16}'))

    return write


def _pillow(mode: str, **options: Any) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        shown = to_display(make.picture(1)[..., :3], 8)
        Image.fromarray(shown).convert(mode).save(path, **options)

    return write


def _tiff(**options: Any) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        picture = np.ascontiguousarray(make.picture(1)[..., :3])
        tifffile.imwrite(path, picture, photometric="rgb", **options)

    return write


def _curve(path: Path) -> None:
    rows = [f"{x / 16:.4f},{1 - abs(x / 8 - 1):.4f}" for x in range(17)]
    path.write_text("\n".join(["time,weight", *rows]) + "\n")


def _settings(path: Path) -> None:
    path.write_text(State(playing=True).with_settings(path="straight").toml(), "utf-8")


def _edl(path: Path) -> None:
    at = [f"01:00:0{second}:00" for second in range(9)]
    events = [f"{i:03}  REEL V     C        {at[0]} {at[1]} {at[i]} {at[i + 1]}" for i in range(8)]
    path.write_text("\n".join(["TITLE: edit", "FCM: NON-DROP FRAME", *events]) + "\n")


def _otio(path: Path) -> None:
    span = otio.opentime.TimeRange(duration=otio.opentime.RationalTime(24, 24))
    clips = [otio.schema.Clip(f"shot {i}", source_range=span) for i in range(4)]
    timeline = otio.schema.Timeline("edit")
    timeline.tracks.append(otio.schema.Track("V1", clips))
    path.write_text(otio.adapters.write_to_string(timeline))


def _camera(path: Path) -> None:
    body = {"index": 1, "matrix_world": np.eye(4).tolist()}
    make.write_cameras(path, range(1, 4), objects=lambda n: {"car": body})


def _video(**options: Any) -> Callable[[Path], object]:
    return lambda path: clips.write(path, **options)


def _interlaced(path: Path) -> None:
    times = [Fraction(n, 25) for n in range(8)]
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(8)]
    clips.write(path, frames, times, codec="mpeg2video", tick=Fraction(1, 25),
                options={"flags": "+ilme+ildct", "qmin": "1", "qmax": "2"})  # fmt: skip


def _ocio(path: Path) -> None:
    film_config(path.parent).rename(path)


KINDS = {
    "exr-none": Kind(".exr", _exr("NO"), _read_exr),
    "exr-rle": Kind(".exr", _exr("RLE"), _read_exr),
    "exr-zips": Kind(".exr", _exr("ZIPS"), _read_exr, sealed=True),
    "exr-zip": Kind(".exr", _exr("ZIP"), _read_exr, sealed=True),
    "exr-piz": Kind(".exr", _exr("PIZ"), _read_exr),
    "exr-pxr24": Kind(".exr", _exr("PXR24"), _read_exr),
    "exr-b44": Kind(".exr", _exr("B44"), _read_exr),
    "exr-dwaa": Kind(".exr", _exr("DWAA"), _read_exr),
    "exr-dwab": Kind(".exr", _exr("DWAB"), _read_exr),
    "exr-tiled": Kind(".exr", _tiled, _read_exr, sealed=True),
    "exr-multipart": Kind(".exr", _multipart, _read_exr, sealed=True),
    "cryptomatte": Kind(".exr", _cryptomatte, _read_masked),
    "png-8": Kind(".png", _still(8), _read_still, sealed=True),
    "png-16": Kind(".png", _still(16), _read_still, sealed=True),
    "png-palette": Kind(".png", _pillow("P"), _read_still),
    "tiff-8": Kind(".tif", _still(8), _read_still),
    "tiff-16": Kind(".tif", _still(16, 3), _read_still),
    "tiff-float": Kind(".tif", _tiff(), _read_still),
    "tiff-tiled": Kind(".tif", _tiff(tile=(16, 16), compression="zlib"), _read_still),
    "tiff-grey": Kind(".tif", _pillow("L"), _read_still),
    "jpeg": Kind(".jpg", _still(8, 3), _read_still),
    "jpeg-progressive": Kind(".jpg", _pillow("RGB", progressive=True, quality=90), _read_still),
    "jpeg-grey": Kind(".jpg", _pillow("L", quality=90), _read_still),
    "camera": Kind(".json", _camera, _read_camera),
    "manifest": Kind(".json", _manifest, _read_manifest),
    "job": Kind(".json", _job, _read_job),
    "options": Kind(".toml", _options, _read_options),
    "curve": Kind(".csv", _curve, _read_curve),
    "edl": Kind(".edl", _edl, _read_cuts),
    "otio": Kind(".otio", _otio, _read_cuts),
    "video-rotated": Kind(".mov", _video(setup=lambda s: s.set_display_rotation(90)), _read_video),
    "video-interlaced": Kind(".ts", _interlaced, _read_video),
    "video-ffv1": Kind(".mkv", _video(codec="ffv1"), _read_video),
    "ocio": Kind(".ocio", _ocio, _read_ocio),
    "viewer": Kind(".toml", _settings, _read_settings),
}
