"""Every kernel against its slow, obvious twin; the largest differences measured are 5e-5."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import wgmb
from images import body, camera
from twins import fusion as fusion_twin
from twins import holdout as holdout_twin
from twins import reproject as reproject_twin
from twins import tap as tap_twin
from twins import tiles as tiles_twin
from twins import velocity as velocity_twin
from wgmb import InputError, Reprojections, Shutter
from wgmb.color.srgb import motion_colors

SIZES = [(48, 64), (37, 53), (1, 1), (3, 130)]
TOLERANCE = 1e-4
SHUTTERS = [
    Shutter(180),
    Shutter(400, "start", "triangle"),
    Shutter(90, -0.3, "cosine"),
    Shutter(180, rolling="down", rolling_duration=0.7),
    Shutter(300, rolling="left"),
]


def pictures(size, speed=9.0, seed=0):
    rng = np.random.default_rng(seed)
    color = rng.random((*size, 4)).astype("f4")
    motion = (rng.normal(size=(*size, 4)) * speed).astype("f4")
    return color, motion


@pytest.mark.covers(2)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shutter", SHUTTERS)
def test_tap_is_its_twin(close, size, shutter, mixing):
    color, motion = pictures(size)
    got = wgmb.blur(color, motion=motion, shutter=shutter, samples=5, method="tap")
    times = shutter.sample_times(5).astype(float)
    close(got, tap_twin.tap(color, motion, times, shutter.delay), TOLERANCE + mixing)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("samples", [1, 2, 17])
def test_straight_taps_are_their_twin(close, size, samples, mixing):
    color, motion = pictures(size, speed=200.0)  # most of it leaves the picture
    got = wgmb.blur(color, motion=motion, samples=samples, path="straight", method="tap")
    times = Shutter(180).sample_times(samples).astype(float)
    close(got, tap_twin.tap(color, motion, times, curved=False), TOLERANCE + mixing)


@pytest.mark.parametrize("curve", ["box", "triangle"])
def test_auto_taps_are_their_twin(close, curve, mixing):
    """One a pixel of streak from opening to closing, two at least."""
    color, motion = pictures((17, 23), speed=15.0)
    motion[..., 2:] = -motion[..., :2]
    shutter = Shutter(360, curve=curve)
    want = np.zeros(color.shape)
    for y, x in np.ndindex(color.shape[:2]):
        count = int(np.clip(np.ceil(np.hypot(*motion[y, x, 2:])), 2, 64))
        times = shutter.time((np.arange(count) + 0.5) / count)
        want[y, x] = tap_twin.pixel(color, motion, x, y, times)
    close(
        wgmb.blur(color, motion=motion, shutter=shutter, samples="auto", method="tap"),
        want,
        1e-3 + mixing,
    )


@pytest.mark.parametrize("size", SIZES)
def test_the_published_form_is_its_twin(close, size, mixing):
    color, motion = pictures(size)
    got = wgmb.blur(color, motion=motion, samples=7, variant="published", method="tap")
    close(got, tap_twin.published(color, motion[..., :2].astype(float), 7), TOLERANCE + mixing)


@pytest.mark.parametrize("size", SIZES)
def test_kept_and_bad_pixels_are_their_twin(close, size, mixing):
    color, motion = pictures(size)
    rng = np.random.default_rng(2)
    holdout = np.round(rng.random(size) * 4).clip(0, 2).astype("f4") / 2
    color[rng.random(size) < 0.05] = np.nan
    got = wgmb.blur(color, motion=motion, holdout=holdout, samples=5, method="tap")
    lifted, weight = holdout_twin.before(color, holdout)
    times = Shutter(180).sample_times(5).astype(float)
    blurred = tap_twin.tap(lifted, motion, times, weight=weight)
    close(
        got, holdout_twin.after(color, holdout, blurred), 5e-4 + 8 * mixing
    )  # a quotient of two sums


@pytest.mark.parametrize("curve", ["box", "triangle", lambda x: np.exp(-5 * x)])
def test_jittered_taps_are_their_twin(close, curve, mixing):
    """Interleaved gradient noise says where in its share of time a pixel's taps are."""
    color, motion = pictures((17, 23))
    shutter, number = Shutter(360, "start", curve), 5
    got = wgmb.blur(
        color, motion=motion, shutter=shutter, samples=3, jitter=0.8, number=number, method="tap"
    )
    want, noise = np.zeros(color.shape), noise_of((17, 23), number)
    for y, x in np.ndindex(color.shape[:2]):
        shift = 0.8 * (noise[y, x] - 0.5)
        times = shutter.sample_times(3, shift).astype(float)
        want[y, x] = tap_twin.pixel(color, motion, x, y, times)
    close(got, want, 2e-4 + mixing)


def depths(size, seed=0):
    depth = np.random.default_rng(seed).uniform(1, 9, size).astype("f4")
    depth[::5, ::7] = np.inf
    return depth


@pytest.mark.covers(1)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shutter", SHUTTERS)
def test_fusion_is_its_twin(close, size, shutter, mixing):
    color, motion = pictures(size, speed=4.0)
    motion[::3] *= 0.05
    depth = depths(size)
    got = wgmb.blur(color, motion=motion, depth=depth, shutter=shutter, samples=5, method="fusion")
    times, middle = shutter.sample_times(5).astype(float), float(shutter.time(np.array(0.5)))
    want = fusion_twin.fusion(color, motion, depth, times, middle, (0.08, 0.04),
                              span=shutter.span, delay=shutter.delay)  # fmt: skip
    close(got, want, TOLERANCE + 2 * mixing)


@pytest.mark.parametrize("variant", ["shutter", "published"])
@pytest.mark.parametrize("weights, tau", [("published", 0.5), ("normalised", 1.0),
                                          ("published", 0.9), ("normalised", 0.7)])  # fmt: skip
def test_every_form_of_fusion_is_its_twin(close, variant, weights, tau, mixing):
    color, motion = pictures((24, 33))
    motion[::4, ::3] = 0
    depth = depths((24, 33))
    options = {"variant": variant, "weights": weights, "tau": tau}
    options |= {"alpha_front": 0.1, "alpha_back": 0.02}
    got = wgmb.blur(color, motion=motion, depth=depth, method="fusion", **options)
    times, span = Shutter(180).sample_times(8).astype(float), (-0.25, 0.25)
    if variant == "published":
        times, span = (np.arange(8) - 7) / 16, None
    want = fusion_twin.fusion(color, motion, depth, times, 0.0, (0.1, 0.02), span=span,
                              printed=weights == "published", tau=tau)  # fmt: skip
    close(got, want, TOLERANCE + 2 * mixing)


def test_fusion_of_kept_pixels_by_normals_is_its_twin(close):
    size = (24, 33)
    color, motion = pictures(size)
    rng = np.random.default_rng(4)
    normal = rng.normal(size=(*size, 3)).astype("f4")
    normal[::6] = 0
    holdout = (rng.random(size) < 0.2).astype("f4")
    around = Reprojections(camera((0, 0, 0), 0.7, 0.3), camera((0, 0, 0)))
    depth = np.minimum(depths(size), 9)
    got = wgmb.blur(color, motion=motion, depth=depth, normal=normal, camera=around,
                    holdout=holdout, method="fusion")  # fmt: skip
    view = around.here.view_from_world[:3, :3]
    seen = (normal @ view.T) * (1, -1, 1)
    lifted, weight = holdout_twin.before(color, holdout)
    times = Shutter(180).sample_times(8).astype(float)
    blurred = fusion_twin.fusion(lifted, motion, depth, times, 0.0, (0.08, 0.04),
                                 span=(-0.25, 0.25), normal=seen, weight=weight)  # fmt: skip
    close(got, holdout_twin.after(color, holdout, blurred), 5e-4)


@pytest.mark.parametrize("orthographic", [False, True])
def test_fusion_by_depth_after_projection_is_that_by_planar_depth(close, orthographic):
    size = (24, 33)
    color, motion = pictures(size)
    planar = np.random.default_rng(8).uniform(1, 9, size).astype("f4")
    here = camera((1, 2, 3), 0.7, 0.3, orthographic=orthographic)
    clip = (0.02 * planar - 1) if orthographic else (1.02 - 0.2 / planar)
    a, b = (
        wgmb.blur(color, motion=motion, depth=depth.astype("f4"), method="fusion",
                  camera=Reprojections(here, here, depth_kind=kind))
        for kind, depth in (("planar", planar), ("clip", clip))
    )  # fmt: skip
    close(a, b, 0)


@pytest.mark.parametrize("neighbours", [False, True])
@pytest.mark.parametrize("size", [(24, 32), (17, 23), (1, 1)])
def test_reproject_is_its_twin(size, neighbours, mixing):
    """Samples that are equally near to a hair may change places; all other pixels agree."""
    frames = []
    for seed in range(3 if neighbours else 1):
        color, motion = pictures(size, speed=3.0, seed=seed)
        depth = np.random.default_rng(seed + 9).uniform(1, 9, size).astype("f4")
        depth[::5, ::7] = np.inf
        frames.append((color, motion, depth))
    near = [wgmb.Frame(c, motion=m, depth=d) for c, m, d in frames]
    frame = wgmb.Frame(
        frames[0][0],
        motion=frames[0][1],
        depth=frames[0][2],
        prev=near[1] if neighbours else None,
        next=near[2] if neighbours else None,
    )
    got = wgmb.Blur("reproject", samples=4)(frame)
    share = wgmb.Blur("reproject", samples=4, show="count")(frame)[..., 0]
    sources = [(offset, *f) for offset, f in zip((0, -1, 1), frames, strict=False)]
    times = Shutter(180).sample_times(4).astype(float)
    want, count = reproject_twin.reproject(sources, times)
    assert np.array_equal(np.rint(4 * share), count)
    wrong = (np.abs(got - want) > TOLERANCE + mixing).any(axis=2)
    assert wrong.mean() < 0.01


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    "variant, depths, speed",
    [("even", True, 6.0), ("even", True, 60.0), ("even", False, 20.0), ("published", True, 60.0)],
)
def test_tiles_is_its_twin(variant, depths, speed, mixing):
    """Taps that land on a texel's edge may read the next one; all other pixels agree."""
    size = (44, 84)  # tiles of 40 px: two rows, three columns
    color, motion = pictures(size, speed)
    motion[:, 20:60] *= 0.02
    depth = np.random.default_rng(4).uniform(1, 9, size).astype("f4") if depths else None
    shutter = Shutter(300, "start", "triangle")
    got = wgmb.blur(color, motion=motion, depth=depth, method="tiles", shutter=shutter, samples=5,
                    number=2, variant=variant)  # fmt: skip
    times = shutter.sample_times(5).astype(float)
    want = tiles_twin.tiles(
        color, motion, depth, times, shutter.span, noise_of(size, 2), 40, variant == "published"
    )
    wrong = (np.abs(got - want) > 1e-3 + mixing).any(axis=2)
    assert wrong.mean() < 0.01


def test_tiles_shows_what_it_follows():
    size = (44, 84)
    color, motion = pictures(size, 20.0)
    shutter = Shutter(300, "start")
    got = wgmb.blur(color, motion=motion, method="tiles", shutter=shutter, show="tiles")
    ways = tiles_twin.followed(motion, shutter.span, 40)
    y, x = np.mgrid[: size[0], : size[1]] // 40
    np.testing.assert_allclose(got[..., :3], motion_colors(ways[y, x], 40), atol=1e-3)
    with pytest.raises(InputError, match="tiles"):
        wgmb.Blur("tiles", show="depth")


def noise_of(size, number):
    """Interleaved gradient noise (Jimenez 2014)."""
    y, x = np.mgrid[: size[0], : size[1]]
    at = 0.06711056 * (x + 5.588238 * number) + 0.00583715 * (y + 5.588238 * number)
    return 52.9829189 * (at % 1) % 1


def published_pair(size, speed=3.0):
    """Two frames' colours, motions and depths, and the Frame of the second one."""
    frames = [(*pictures(size, speed, seed), depths(size, seed)) for seed in (0, 1)]
    prev = wgmb.Frame(frames[1][0], motion=frames[1][1], depth=frames[1][2])
    color, motion, depth = frames[0]
    return frames, wgmb.Frame(color, motion=motion, depth=depth, prev=prev)


def agree(got, want, few=0.01):
    """Samples that lie on the border of two pixels to a hair may go to either."""
    assert np.isfinite(got).all()
    assert (np.abs(got - want) > TOLERANCE).any(axis=2).mean() <= few


@pytest.mark.covers(1)
@pytest.mark.parametrize("options", [{}, {"depth_test": True}, {"splat": "line"}])
@pytest.mark.parametrize("size", [(24, 32), (17, 23), (1, 1), (3, 130)])
def test_published_reprojection_along_vectors_is_its_twin(size, options):
    frames, frame = published_pair(size)
    movers = [
        (color, reproject_twin.along(motion, depth, sign))
        for sign, (color, motion, depth) in zip((-1, 1), frames, strict=True)
    ]
    flags = {"nearest": "depth_test" in options, "line": "splat" in options}
    want, count = reproject_twin.published(frame.color, 4, movers, **flags)
    blur = [
        wgmb.Blur("reproject", variant="published", samples=4, show=show, **options)
        for show in ("color", "count")
    ]
    agree(blur[0](frame), want)
    agree(blur[1](frame)[..., :1], count[..., None])


@pytest.mark.covers(1)
@pytest.mark.parametrize("options", [{}, {"depth_test": True}, {"splat": "line"}, {"facing": True},
                                     {"facing": True, "splat": "line"}])  # fmt: skip
@pytest.mark.parametrize("normals", [True, False])
def test_published_reprojection_by_cameras_is_its_twin(options, normals):
    size = (20, 30)
    rng = np.random.default_rng(5)
    y, x = np.mgrid[: size[0], : size[1]]
    way = [camera((0.9, 0.1, -0.3), 0.25, 0.02, 0.1), camera((0, 0, 0))]
    kinds, frames, movers = [way[1], way[0]], [], []
    for here, there in (kinds, kinds[::-1]):
        color = rng.random((*size, 4)).astype("f4")
        depth = (3 + np.sin(x / 3) + np.cos(y / 2) + 0.1 * rng.random(size)).astype("f4")
        normal = rng.normal(size=(*size, 3)).astype("f4")
        normal[0] = 0
        around = Reprojections(here, there if here is way[1] else None,
                               there if here is way[0] else None)  # fmt: skip
        frames.append(wgmb.Frame(color, depth=depth, camera=around,
                                 normal=normal if normals else None))  # fmt: skip
        mover = reproject_twin.by_camera(depth, normal if normals else None, here, there,
                                         "facing" in options)  # fmt: skip
        movers.append((color, mover))
    flags = {"nearest": "depth_test" in options, "line": "splat" in options}
    want, count = reproject_twin.published(frames[0].color, 3, movers, **flags)
    frame = replace(frames[0], prev=frames[1])
    for show, twin in (("color", want), ("count", count[..., None])):
        got = wgmb.Blur("reproject", variant="published", samples=3, show=show, **options)(frame)
        agree(got if show == "color" else got[..., :1], twin, 0.02)
    if "facing" in options:
        plain = {k: v for k, v in options.items() if k != "facing"}
        free = wgmb.Blur("reproject", variant="published", samples=3, show="count", **plain)(frame)
        assert free[..., 0].mean() > count.mean() + 0.005


@cache
def seen_from_three_cameras(size, kind, orthographic):
    """Depth, object indices, cameras, and what the twin makes of them."""
    rng = np.random.default_rng(3)
    depth = rng.uniform(2, 30, size).astype("f4")
    ids = rng.integers(0, 5, size).astype("u4")
    if kind == "planar":
        depth[rng.random(size) < 0.1] = np.inf
        depth[rng.random(size) < 0.1] = 1e10
    else:
        depth = rng.uniform(0.2, 0.95, size).astype("f4")
    ways = [
        camera((0.1 * k, 0.05 * k, -0.3 * k), 0.02 * k, 0.01 * k, 0.03 * k, 1.7 + 0.05 * k,
               orthographic, {1: body(0.4 * k, 0.2 * k), 3: body(-0.2 * k, 0.0)})
        for k in (-1, 0, 1)
    ]  # fmt: skip
    window = (5, 3, size[1] + 20, size[0] + 9)
    around = Reprojections(ways[1], ways[0], ways[2], depth_kind=kind, window=window)
    want = velocity_twin.velocity(depth, ids, ways[1], ways[0], ways[2], window=window, kind=kind)
    return depth, ids, around, want


@pytest.mark.covers(2)
@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("kind", ["planar", "clip"])
@pytest.mark.parametrize("size", [(37, 53), (1, 1), (3, 130)])
@pytest.mark.parametrize("more", ["", "vectors", "added", "scale", "limit"])
def test_velocity_is_its_twin(close, size, kind, orthographic, more):
    depth, ids, around, want = seen_from_three_cameras(size, kind, orthographic)
    rng = np.random.default_rng(6)
    vectors = rng.normal(size=(*size, 4)).astype("f4") * 20
    inputs = {"vectors": {"motion": vectors}, "added": {"motion": vectors, "object_motion": True},
              "scale": {"scale": rng.uniform(-1, 2, size).astype("f4")}}.get(more, {})  # fmt: skip
    nothing = (depth >= 1e9) if kind == "planar" else np.zeros(size, bool)
    want = velocity_twin.combined(
        want,
        vectors if "motion" in inputs else want,
        nothing,
        added=more == "added",
        scale=inputs.get("scale"),
        max_blur=3.0 if more == "limit" else None,
        span=(0, 0.6),
    )
    frame = wgmb.Frame(
        np.zeros((*size, 3), "f4"), depth=depth, camera=around, object_id=ids, **inputs
    )
    blur = wgmb.Blur(
        "tap", shutter=Shutter(216, "start"), max_blur=3.0 if more == "limit" else None
    )
    got = blur.motion(frame)
    close(got / (1 + np.abs(want)), want / (1 + np.abs(want)), TOLERANCE)
