"""Leading faces stay sharper in fusion, by depth or by normals."""

import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb import Camera, Clip, Reprojections
from wgmb.cli import app
from wgmb.sequence.layers import names as layers

HERE = Camera(
    np.array([[1, 0, 0, 0], [0, 1.3, 0, 0], [0, 0, -1.02, -0.2], [0, 0, -1, 0]]), np.eye(4)
)


def ball(size=64):
    """A sphere's depth and normals, x right, y up, z towards the camera."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size * 2 - 1
    z = np.sqrt(np.clip(1 - x * x - y * y, 0.01, None))
    return (5 - z).astype("f4"), np.stack([x, -y, z], axis=2).astype("f4")


def right(noise, speed=12.0):
    return np.zeros((*noise.shape[:2], 2), "f4") + np.array([speed, 0], "f4")


@pytest.fixture
def square():
    return np.random.default_rng(3).random((64, 64, 3), "f4")


def change(square, **more):
    """Change of the trailing left and the leading right half of a ball."""
    out = wgmb.blur(square, right(square), method="fusion", **more)
    apart = np.abs(out - square).mean(axis=2)
    return apart[20:44, 8:28].mean(), apart[20:44, 36:56].mean()


@pytest.mark.parametrize("front, back", [(0.08, 0.04), (0.10, 0.02)])
def test_leading_faces_take_the_quotient_of_the_factors(square, front, back):
    depth, _ = ball()
    trailing, leading = change(square, depth=depth, alpha_front=front, alpha_back=back)
    assert leading == pytest.approx(trailing * back / front, rel=0.1)


def test_normals_say_what_depth_does(square):
    depth, normal = ball()
    around = Reprojections(HERE, HERE)
    flat = np.full_like(depth, 5)
    by_depth = change(square, depth=depth)
    by_normal = change(square, depth=flat, normal=normal, camera=around)
    assert by_normal == pytest.approx(by_depth, rel=0.05)


def test_normals_turn_with_the_camera(square):
    """A camera on its head sees the other half lead."""
    depth, normal = ball()
    turned = np.diag([-1.0, -1, 1, 1])
    there = Camera(HERE.clip_from_world @ turned, turned)
    around = Reprojections(there, there)
    trailing, leading = change(square, depth=0 * depth + 5, normal=normal, camera=around)
    assert leading > 1.5 * trailing


@pytest.mark.parametrize("tau", [0.5, 0.9])
def test_printed_weights_brighten_as_they_sum(tau):
    grey = np.full((48, 64, 3), 0.5, "f4")
    depth = np.full((48, 64), 5, "f4")
    out = wgmb.blur(grey, right(grey), depth=depth, method="fusion", weights="published", tau=tau)
    np.testing.assert_allclose(out, 0.5 * (1 + 0.04 * (1 - tau**8)), atol=1e-5)


@pytest.mark.parametrize("options", [{"weights": "old"}, {"variant": "slices"}, {"alpha_front": 0},
                                     {"alpha_back": 1.5}, {"tau": float("nan")}])  # fmt: skip
def test_senseless_options_are_named(options):
    with pytest.raises(wgmb.InputError, match=next(iter(options))):
        wgmb.Blur("fusion", **options)


def test_missing_depth_is_named(square):
    with pytest.raises(wgmb.InputError, match="'fusion' needs depth"):
        wgmb.blur(square, right(square), method="fusion")


@pytest.mark.parametrize("names, found", [
    (["ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z", "ViewLayer.Z"], "XYZ"),
    (["N.z", "N.y", "N.x", "R"], "xyz"),
    (["normal.B", "normal.G", "normal.R"], "RGB"),
    (["normal.X", "normal.Y"], ""),
    (["Image.N"], ""),
])  # fmt: skip
def test_normals_are_found_by_name(names, found):
    assert "".join(n[-1] for n in layers.find_triple(names, layers.TRIPLES["normal"])) == found


def test_normals_of_a_file_reach_the_frame(tmp_path):
    channels = make.frame(1)
    for i, c in enumerate("XYZ"):
        channels[f"ViewLayer.Normal.{c}"] = np.full((48, 64), i - 1, "f2")
    path = make.write_exr(tmp_path / "a.exr", channels)
    (frame,) = Clip(path)
    assert frame.normal is not None
    assert np.array_equal(frame.normal[3, 5], [-1, 0, 1])


def test_options_reach_the_command_line(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    results = []
    for more in ([], ["--weights", "published"], ["--alpha-back", "0.01"], ["--tau", "0.5"]):
        out = tmp_path / f"out{len(results)}.exr"
        assert app.main(["blur", str(path), "-o", str(out), "--method", "fusion", "-q", *more]) == 0
        results.append(next(iter(Clip(out))).color)
    apart = [np.abs(results[0].astype("f4") - r.astype("f4")).max() for r in results[1:]]
    assert apart[0] > 0.01  # brighter
    assert apart[1] == 0  # one flat depth: nothing leads
    assert apart[2] > 1e-3
