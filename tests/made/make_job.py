"""A job as the command line asks for it."""

from wgmb.run.job import settle
from wgmb.run.request import BlurRequest
from wgmb.settings import (
    BlurSettings,
    OutputSettings,
)


def job_of(pattern, folder, **more):
    """Frames blurred by four taps into `folder`; `more`: further settings of the output."""
    return settle(
        BlurRequest(
            pattern=str(pattern),
            output=OutputSettings(output=str(folder / "o.####.exr"), **more),
            blur=BlurSettings(method="tap", samples=4),
        )
    )
