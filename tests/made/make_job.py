"""A job as the command line asks for it."""

from wgmb.run.job import settle
from wgmb.run.request import BlurRequest
from wgmb.settings import (
    BlurSettings,
    InputSettings,
    OutputSettings,
    ShutterSettings,
)
from wgmb.settings.color import ColorSettings
from wgmb.settings.video import VideoSettings


def job_of(pattern, folder, **more):
    """Frames blurred by four taps into `folder`; `more`: further settings of the output."""
    return settle(
        BlurRequest(
            pattern=str(pattern),
            output=OutputSettings(output=str(folder / "o.####.exr"), **more),
            blur=BlurSettings(method="tap", samples=4),
            shutter=ShutterSettings(),
            input=InputSettings(),
            color=ColorSettings(),
            video=VideoSettings(),
        )
    )
