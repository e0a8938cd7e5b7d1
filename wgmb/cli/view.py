"""`wgmb view`: the interactive viewer."""

from __future__ import annotations

from pathlib import Path

from ..color_settings import ColorSettings
from ..errors import DeviceError
from ..extras import needed_by
from ..settings import size_of
from .exit_codes import DONE
from .options import BlurOptions, Colors, Given, InputOptions, Look, ShutterOptions, When
from .terminal import note


def view(
    what: str | None = None,
    given: Given = InputOptions(),
    look: Look = BlurOptions(),
    when: When = ShutterOptions(),
    color: Colors = ColorSettings(),
    *,
    config: Path | None = None,
    window: str = "1280x720",
    adapter: str | None = None,
) -> int:
    """View a scene or frames interactively.

    Example: wgmb view wheel
    Example: wgmb view 'shot.####.exr' --method reproject

    Parameters
    ----------
    what
        Scene, file or pattern; by default the one in --config, else the scene crossing.
    config
        TOML file saved by the viewer: start with its settings.
    window
        Window size, WIDTHxHEIGHT.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    """
    try:
        with needed_by("view"):
            from .. import viewer
    except ImportError as error:  # of a system library
        raise DeviceError(
            f"the viewer cannot be loaded: {error}; on Debian, Ubuntu: "
            "apt-get install libx11-6 libxext6"
        ) from None
    state = viewer.State(playing=True)  # what moves is the point
    if config is not None:
        state = viewer.State.read(config)
    if what is not None:
        state = state.opened(what)
    state = state.told(vars(given) | vars(look) | vars(when) | vars(color))
    if color.remark:
        note(color.remark)
    viewer.view(state, adapter=adapter, size=size_of(window))
    return DONE
