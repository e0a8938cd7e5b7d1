"""Options that do not fit the subject: each is refused in one line, none is ignored."""

from __future__ import annotations

from collections.abc import Collection

from ...errors import InputError
from ...settings.color import option_name
from ...settings.video import OF_FRAMES
from .groups import GROUP_OF, MASKS, changed
from .shown_moment import ShownMoment

VIDEO = frozenset(name for name, group in GROUP_OF.items() if group == "video")
"""Options of videos."""
INPUTS = frozenset({*(name for name, group in GROUP_OF.items() if group == "input"), *MASKS})
"""Options that say what files hold."""
OF_VIDEOS = frozenset({"holdout", "max_mb", "cuts"})
"""Those of them that videos have."""


def check_options(state: ShownMoment, named: Collection[str]) -> None:
    """InputError for an option of the command line that the state's source has no use for."""
    for name in named:
        option = option_name(name)
        if name in VIDEO and not state.is_video:
            if name in OF_FRAMES and not state.is_scene:
                raise InputError(
                    f"{option} of frames is for `wgmb blur`: the viewer shows it of videos only"
                )
            raise InputError(f"{option} is for videos, not for {state.source}")
        if state.is_scene and (name in INPUTS or name == "from_"):
            kinds = "frames and videos" if name in OF_VIDEOS else "frames"
            raise InputError(f"{option} is for {kinds}, {state.source} is a scene")
        if state.is_video and name == "from_":
            raise InputError(f"{option} is for rendered frames, a video says what its colours are")
        if state.is_video:
            _check_layers(name)


def check_video(state: ShownMoment) -> None:
    """InputError if the state of a video has settings of rendered frames."""
    for name in (*changed("input", state.input), *changed("blur", state.blur)):
        _check_layers(name)


def _check_layers(name: str) -> None:
    if name in INPUTS - OF_VIDEOS:
        raise InputError(f"{option_name(name)} is for rendered frames, a video has no layers")
