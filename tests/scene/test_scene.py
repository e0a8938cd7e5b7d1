"""Scenes: every pixel is what a slow, obvious ray caster sees, at every instant."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import make_frames as make
import wgmb
from twins import gbuffer as twin
from wgmb import (
    Body,
    CameraPath,
    InputError,
    Scene,
    gpu,
)
from wgmb.gpu.textures import TexturePool
from wgmb.gpu.timing import WallClock
from wgmb.scene import builtin, gbuffer
from wgmb.scene.bodies import (
    SHAPES,
    at,
    rotation,
    translation,
)
from wgmb.scene.gbuffer import SceneOnGpu, _bounds, _halves

SIZE = (96, 54)
STILL = CameraPath(lambda t: (0 * t, 0 * t, 0 * t))


def plain(scene):
    return replace(scene, bodies=tuple(replace(b, pattern="PLAIN") for b in scene.bodies))


def frame(scene, seconds=0.0, size=SIZE, antialias=1):
    render = wgmb.Render(scene, wgmb.Blur("tap"), size=size, antialias=antialias)
    seen = render.frame(seconds)
    return seen, render.blur.motion(seen)


OF_BODIES = [n for n in builtin.SCENES if not builtin.make(n).has_volumes]


def turned(axis, angle, turn, x=0.0, y=0.0, z=-2.4):
    return lambda t: translation(x, y, z, t) @ rotation(axis, angle, t) @ rotation("x", turn, t)


@pytest.mark.parametrize("seconds", [0.0, 0.13])
@pytest.mark.parametrize("name", OF_BODIES)
def test_built_in_scenes_are_their_twin(name, seconds):
    """Rays that graze a silhouette may miss in f32 what they hit in f64: 0 pixels measured."""
    scene = plain(builtin.make(name))
    seen, motion = frame(scene, seconds)
    want = twin.see(scene, SIZE, seconds)
    same = seen.object_id == want["object_id"]
    assert (~same).sum() <= 2
    assert len(np.unique(seen.object_id)) > 4

    far = want["depth"] >= twin.FAR
    assert np.array_equal((seen.depth >= twin.FAR)[same], far[same])
    np.testing.assert_allclose(seen.depth[same], want["depth"][same], rtol=2e-4)
    assert np.abs(seen.normal - want["normal"])[same].max() < 5e-3
    assert np.abs(motion - want["motion"])[same].max() < 1e-3
    assert np.abs(want["motion"]).max() > (0.05 if name == "hdr" else 0.5)
    # A shadow's edge, and the gloss of a grazed ball, fall on one side or the other.
    wrong = np.abs(seen.color[..., :3] - want["color"])[same].max(axis=1) > 2e-3
    assert wrong.mean() < 0.002


@pytest.mark.parametrize("pattern", ["CHECKER", "STRIPES", "DOTS"])
@pytest.mark.parametrize("shape", SHAPES[:3])
def test_patterns_are_their_twin_but_for_the_filter_at_their_edges(shape, pattern):
    size = (0.9, 0.6, 0.8) if shape == "box" else (0.8, 0.8, 0.8)
    body = Body(shape, size, turned("y", 0.5, 0.6), (0.9, 0.1, 0.2), (0.1, 0.6, 0.9), pattern,
                (9, 7) if shape == "sphere" else (2, 3))  # fmt: skip
    scene = Scene("one", (body,), STILL)
    size = (320, 240)
    seen, _ = frame(scene, size=size)
    want = twin.see(scene, size, 0.0)
    there = want["object_id"] == 1
    assert there.mean() > 0.1
    apart = np.abs(seen.color[..., :3] - want["color"]).max(axis=2)[there]
    assert (apart > 0.1).mean() < 0.25
    assert np.median(apart) < (0.02 if pattern == "DOTS" else 1e-5)  # dots fade a little everywhere
    # The filter keeps the mean, it moves nothing to one side.
    assert abs((seen.color[..., :3] - want["color"])[there].mean(axis=0)).max() < 0.005


def test_bricks_are_their_colour_with_mortar_between():
    body = Body(
        "box", (1, 1, 0.1), at(0, 0, -2), (1, 0, 0), (0, 0, 1), "BRICKS", (2, 2), emission=1
    )
    dark = {"sun": (0, 0, 1, 0), "sky": (0, 0, 0, 0)}
    seen, _ = frame(Scene("wall", (body,), STILL, **dark), size=(200, 200), antialias=2)
    inside = seen.color[30:170, 30:170]
    mortar = inside[..., 2].mean()
    assert mortar == pytest.approx(1 - 0.92 * 0.96, abs=0.02)
    assert (inside[..., 0] > 0).mean() > 0.8
    assert inside[..., 0].mean() == pytest.approx(1 - mortar, abs=0.05)  # tones 0.75 to 1.25
    assert inside[..., 1].max() == 0


def at_instant(scene, seconds, moment, span):
    """The picture of SceneOnGpu at `moment` [frame intervals] from the frame at `seconds`."""
    blur = wgmb.Blur("tap")
    images = TexturePool(blur.device)
    on_gpu = SceneOnGpu(blur.device, scene, size=SIZE, time=seconds, fps=24, span=span, antialias=1)
    encoder = blur.device.create_command_encoder()
    textures = on_gpu.encode(encoder, blur.frame_bindings(SIZE), images, "instant", moment)
    gpu.submit(blur.device, encoder)
    encoder = blur.device.create_command_encoder
    return {name: images.download(encoder(), texture) for name, texture in textures.items()}


@pytest.mark.parametrize("moment", [-0.45, 0.213])
@pytest.mark.parametrize("name", ["wheel", "bounce", "rotation", "crossing"])
def test_other_instants_are_their_twin(name, moment):
    """Poses between two rows are interpolated, as good as exactly at these speeds."""
    scene = plain(builtin.make(name))
    got = at_instant(scene, 0.1, moment, (-0.5, 0.5))
    want = twin.see(scene, SIZE, 0.1 + moment / 24)
    same = got["object"][..., 0] == want["object_id"]
    assert (~same).sum() <= 2
    np.testing.assert_allclose(got["depth"][..., 0][same], want["depth"][same], rtol=2e-3)
    still = twin.see(scene, SIZE, 0.1)["depth"]  # what would be there if time stood still
    assert (np.abs(still / want["depth"] - 1) > 4e-3).mean() > 0.01


def tumbling(seed, bodies=24):
    """Glowing bodies of all shapes, spinning up to ten turns a frame, moving a metre in it."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(bodies):
        size = rng.uniform(0.05, 0.7, 3)
        shape = SHAPES[k % 3]
        start, way = rng.uniform(-1.5, 1.5, 3) - (0, 0, 6), rng.normal(size=3)
        spin, tilt = rng.uniform(-60, 60), rng.uniform(0, 3)
        axis = "xyz"[rng.integers(3)]

        def path(t, start=start, way=way, spin=spin, tilt=tilt, axis=axis):
            moved = translation(*(start[:, None] + way[:, None] * t * 24), t)
            return moved @ rotation("x", tilt, t) @ rotation(axis, spin * t * 24, t)

        made.append(Body(shape, tuple(size), path, tuple(rng.random(3)), emission=1.0))
    return Scene("tumbling", tuple(made), STILL, sun=(0, 0, 1, 0), sky=(0, 0, 0, 0))


@pytest.mark.parametrize("seed", range(2))
def test_bounds_cut_no_body_off(seed):
    """Between two rows of poses a body that turns so fast is drawn up to 0.2 % too large."""
    scene = tumbling(seed)
    for moment in np.linspace(-0.25, 0.25, 6):
        got = at_instant(scene, 0.0, moment, (-0.25, 0.25))["object"][..., 0]
        want = twin.see(scene, SIZE, moment / 24)["object_id"]
        assert (want > 0).mean() > 0.05
        assert (got != want).sum() <= 6


@pytest.mark.parametrize("seed", range(20))
def test_bounds_hold_every_corner_between_any_two_rows(seed):
    """Rows are interpolated as body_from_world, so a body grows when it turns up to 60 degrees."""
    rng = np.random.default_rng(seed)
    rows, corners = np.arange(9.0), np.array(list(itertools.product((-1, 1), repeat=3)))
    way, turn, axis = rng.normal(size=3), rng.uniform(-1, 1), "xyz"[rng.integers(3)]
    place = translation(*(way[:, None] * rows), rows) @ rotation("x", rng.uniform(0, 3), rows)
    place = place @ rotation(axis, turn * rows, rows) @ np.diag([*rng.uniform(0.02, 2, 3), 1])
    low, high = _bounds(place)
    inverse = np.linalg.inv(place)
    for row in range(8):
        for share in np.linspace(0, 1, 9):
            between = np.linalg.inv((1 - share) * inverse[row] + share * inverse[row + 1])
            at = corners @ between[:3, :3].T + between[:3, 3]
            assert (at >= low).all()
            assert (at <= high).all()


def test_halves_hold_what_they_were_made_of():
    rng = np.random.default_rng(1)
    low = rng.normal(size=1000) * 10 ** rng.uniform(-7, 7, 1000)
    high = low + rng.random(1000) * np.abs(low)
    halves = _halves(low, high).view(np.float16).reshape(-1, 2).astype(float)
    assert (halves[:, 0] <= low).all()
    assert (high <= halves[:, 1]).all()
    size = np.abs([low, high])
    normal = (size.min(axis=0) > 1e-4) & (size.max(axis=0) < 6e4)
    np.testing.assert_allclose(halves[normal], np.stack([low, high], 1)[normal], rtol=2e-3)


def test_a_body_beyond_the_range_of_halves_is_seen():
    def path(t):
        return translation(0, 0, -2e5, t)

    scene = Scene("far", (Body("box", (1e5, 1e5, 1.0), path, emission=1.0),), STILL)
    got = at_instant(scene, 0.0, 0.0, (-0.25, 0.25))
    want = twin.see(scene, SIZE, 0.0)
    assert (want["object_id"] > 0).mean() > 0.2
    np.testing.assert_array_equal(got["object"][..., 0], want["object_id"])


def test_every_scene_is_finite_and_something_is_to_be_seen():
    for name in OF_BODIES:
        for seconds in (-1.0, 0.0, 0.4, 3.0):
            render = wgmb.Render(builtin.make(name), wgmb.Blur("tap"), size=(64, 36), antialias=2)
            picture = render(seconds)
            assert np.isfinite(picture).all(), (name, seconds)
            assert picture.min() >= 0
            assert picture[..., :3].std() > 0.05, (name, seconds)
            assert (picture[..., 3] == 1).all()


def test_a_scene_of_nothing_is_sky():
    seen, motion = frame(Scene("nothing", (), STILL))
    assert (seen.depth >= twin.FAR).all()
    assert not seen.object_id.any()
    assert not motion.any()
    np.testing.assert_allclose(seen.color[-1, :, :3], [Scene.horizon] * SIZE[0], atol=1e-6)


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    "name, setting",
    [("translation", "speed=9"), ("scaling", "dolly=1"), ("scaling", "zoom=2"),
     ("rotation", "roll=4"), ("rotation", "yaw=2"), ("crossing", "speed=0.2"),
     ("wheel", "speed=3"), ("wheel", "roll=4"), ("fence", "posts=3"), ("fence", "speed=8"),
     ("bounce", "gravity=5"), ("bounce", "speed=1"), ("hdr", "light=2"), ("hdr", "speed=9")],
)  # fmt: skip
def test_a_parameter_reaches_the_scene(tmp_path, capsys, name, setting):
    pictures = []
    for k, settings in enumerate(([], ["--set", setting])):
        path = tmp_path / f"{k}.exr"
        said = make.inside(capsys, "render", name, "-o", path, "--size", "48x27", "--samples", 4,
                           "--time", 0.1, *settings)  # fmt: skip
        assert said[0] == 0
        pictures.append(make.plain_read(path)["R"])
    assert np.abs(pictures[0] - pictures[1]).max() > 0.02


@pytest.mark.parametrize(
    "name, setting, named",
    [("crossing", "velocity=3", ("velocity", "crossing", "speed")),
     ("crossing", "speed=fast", ("speed", "fast")), ("crossing", "speed=nan", ("speed", "nan")),
     ("fence", "posts=0", ("posts", "0")), ("fence", "posts=201", ("posts", "201")),
     ("fence", "posts=2.5", ("posts", "2.5")), ("crossing", "speed", ("NAME=VALUE", "speed")),
     ("nowhere", "speed=1", ("nowhere", "crossing", "hdr"))],
)  # fmt: skip
def test_a_wrong_parameter_is_refused_by_name(tmp_path, capsys, name, setting, named):
    code, out, err = make.inside(capsys, "render", name, "-o", tmp_path / "o.exr", "--set", setting)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    for word in named:
        assert word in err
    assert not list(tmp_path.iterdir())


def crowd(n):
    size = (0.01, 0.01, 0.01)
    path = at(0, 0, -3)
    return Scene("crowd", (Body("sphere", size, path),) * n, STILL)


def test_1024_bodies_are_drawn_and_more_are_refused():
    seen, _ = frame(crowd(1024), size=(33, 33))
    assert seen.object_id[16, 16] == 1
    assert seen.object_id[0, 0] == 0
    with pytest.raises(InputError, match="at most 1024 bodies, got 1025"):
        frame(crowd(1025), size=(33, 33))
    with pytest.raises(InputError, match="1024 bodies are too many for 3 x 3 rays"):
        frame(crowd(1024), size=(33, 33), antialias=3)
    blur = wgmb.Blur("distributed", samples=4)  # whose rays are its samples
    assert wgmb.Render(crowd(1024), blur, size=(33, 33), antialias=8)(0.0)[16, 16, 1] > 0


def test_what_is_no_body_is_refused():
    with pytest.raises(InputError, match="cone"):
        Scene("x", (Body("cone", (1, 1, 1), at(0, 0, 0)),), STILL)
    for bad in (0.0, -1.0, float("nan"), float("inf"), 1e-300):
        with pytest.raises(InputError, match="positive sizes"):
            Scene("x", (Body("box", (1, bad, 1), at(0, 0, 0)),), STILL)
    with pytest.raises(InputError, match=r"PLAIN, CHECKER.*'MORTAR'"):
        Scene("x", (Body("box", (1, 1, 1), at(0, 0, 0), pattern="MORTAR"),), STILL)
    for look in (
        {"emission": 1e300},
        {"color": (float("nan"), 0, 0)},
        {"repeats": (1, float("inf"))},
    ):
        with pytest.raises(InputError, match="f32"):
            Scene("x", (Body("box", (1, 1, 1), at(0, 0, 0), **look),), STILL)
    for light in ({"sun": (0, 0, 0, 1)}, {"sky": (0, float("nan"), 0, 1)}):
        with pytest.raises(InputError, match="sun and sky"):
            Scene("x", (), STILL, **light)


@pytest.mark.parametrize(
    "name, settings, who",
    [("scaling", {"zoom": -1e5}, "camera"), ("scaling", {"zoom": 1e4}, "camera"),
     ("translation", {"speed": 1e300}, "camera"), ("crossing", {"speed": 1e300}, "body 1"),
     ("bounce", {"gravity": 1e30}, "body 1"), ("hdr", {"light": 1e300}, "sphere")],
)  # fmt: skip
@pytest.mark.parametrize("method", ["tap", "distributed"])
def test_what_leaves_the_numbers_is_refused(name, settings, who, method):
    with pytest.raises(InputError, match=who):
        wgmb.Render(builtin.make(name, **settings), wgmb.Blur(method), size=(32, 18))(0.1)


@pytest.mark.parametrize(
    "options", [{"fps": 0}, {"fps": float("nan")}, {"antialias": 0}, {"antialias": 9}]
)
def test_what_is_no_rendering_is_refused(options):
    name, value = next(iter(options.items()))
    with pytest.raises(InputError, match=f"`{name}` must be .*{value}"):
        wgmb.Render(crowd(1), wgmb.Blur("tap"), **options)
    with pytest.raises(InputError, match="`time` must be finite"):
        wgmb.Render(crowd(1), wgmb.Blur("tap"))(float("inf"))


def test_antialiasing_is_the_mean_of_rays():
    """n x n rays of a picture are the middles of the pixels of one n times as large."""
    scene = builtin.make("crossing")
    size = (48, 27)
    got = frame(plain(scene), 0.0, size, antialias=3)[0].color
    fine = frame(plain(scene), 0.0, (144, 81), antialias=1)[0].color
    want = fine.reshape(27, 3, 48, 3, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(got, want, atol=2e-3)


@pytest.mark.parametrize("antialias", [1, 2])
def test_bands_give_the_same_bits_as_the_whole(antialias, monkeypatch):
    size, scene = (97, 51), builtin.make("crossing")

    def seen():
        clock = WallClock(gpu.open_device())
        blur = wgmb.Blur("tap", device=clock.device)
        on_gpu = SceneOnGpu(
            blur.device, scene, size=size, time=0.3, fps=24, span=(-0.5, 0.5), antialias=antialias
        )
        images, textures = TexturePool(blur.device), {}
        for encode in (on_gpu.encode, on_gpu.encode_light):
            watched = clock.watch(None)
            textures |= encode(watched, blur.frame_bindings(size), images, "band", 0.1)
        encoder = blur.device.create_command_encoder
        return clock, {name: images.download(encoder(), t) for name, t in textures.items()}

    clock, whole = seen()
    assert len(clock.labels) == 2
    monkeypatch.setattr(gbuffer, "_BAND", 5 * 97 * 44 * antialias**2)
    clock, parts = seen()
    assert len(clock.labels) == 2 * 13  # of 4 rows each, as workgroups have 2
    assert parts.keys() == whole.keys() and len(whole) == 6
    for name, image in whole.items():
        np.testing.assert_array_equal(parts[name], image)
