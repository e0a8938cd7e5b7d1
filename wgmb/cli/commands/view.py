"""`wgmb view`: the interactive viewer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...errors import DeviceError
from ...extras import needed_by
from ...settings import size_of
from ...settings.color import ColorSettings
from ..console import Console
from ..exit_codes import DONE
from ..names import frames_at
from ..options import (
    Adapter,
    BlurOptions,
    Blurs,
    Colors,
    ConfigFile,
    InputOptions,
    Inputs,
    ShutterOptions,
    Shutters,
    VideoOptions,
    Videos,
)


def view(
    what: str | None = None,
    input: Inputs = InputOptions(),
    blur: Blurs = BlurOptions(),
    shutter: Shutters = ShutterOptions(),
    color: Colors = ColorSettings(),
    video: Videos = VideoOptions(),
    *,
    config: ConfigFile = None,
    fps: str | None = None,
    window: str = "1280x720",
    interface: float = 1.0,
    adapter: Adapter = None,
) -> int:
    """View a scene, frames or a video interactively.

    Example: wgmb view wheel

    Example: wgmb view 'shot.####.exr' --method reproject

    Example: wgmb view clip.mp4 --flow dis --fps 60

    Example: wgmb view game.mp4 --speed 0.5 --holdout static

    Parameters
    ----------
    what
        Scene, file, pattern or video; by default the one in --config, else the scene crossing.
    config
        TOML file saved by the viewer: start with its settings.
    fps
        Frames per second; of videos those of the output, whose interval the shutter is in, or
        source: a frame for each picture of the video, at its time.
    window
        Window size, WIDTHxHEIGHT.
    interface
        Size of the panel and its text, 0.5 to 4, times that of the system.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    """
    try:
        with needed_by("view", "view"):
            import wgmb.viewer as viewer  # its absence has a name, which that of `from` lacks
    except ImportError as error:  # of a system library
        raise DeviceError(
            f"the viewer cannot be loaded: {error}; on Debian, Ubuntu: "
            "apt-get install libx11-6 libxext6"
        ) from None
    state = viewer.State(playing=True)  # what moves is the point
    if config is not None:
        state = viewer.State.read(config)
    if what is not None:
        if Path(what).is_dir():
            source = frames_at(what, input)
            what, input = source.pattern, replace(input, also=source.input.also)
            Console().say(source.text)
        state = state.opened(what, input.max_mb)
    state = state.with_options(vars(input) | vars(blur) | vars(shutter) | vars(color) | vars(video))
    if fps is not None:
        state = viewer.at_rate(state, fps)
    state = replace(state, shutter=state.shutter.resolved(fps=state.fps))
    Console().say(color.remark)
    viewer.view(state, adapter=adapter, size=size_of(window), interface=interface)
    return DONE
