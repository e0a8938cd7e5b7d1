"""Settings of the blur that depend on where motion comes from."""

import pytest

from wgmb.settings.blur import BlurSettings


@pytest.mark.parametrize(
    ("given", "samples", "shading"),
    [
        ({"method": "gather"}, "auto", "off"),
        ({"method": "gather", "shading": "frames", "samples": 8}, 8, "frames"),
        ({"method": "tap"}, "auto", None),
        ({}, None, None),
    ],
)
def test_what_seems_to_rest_in_a_video_may_move_so_its_light_is_not_followed(
    given, samples, shading
):
    settings = BlurSettings(**given).for_pictures()
    assert (settings.samples, settings.shading) == (samples, shading)
