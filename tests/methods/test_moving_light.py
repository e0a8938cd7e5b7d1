"""Shadows and reflections that move: the blur is nearer the truth."""

from dataclasses import replace

import numpy as np
import pytest

import wgmb
from moving_light_scenes import (
    AT_REST,
    PAN,
    SIZE,
    SPEED,
    around,
    bare,
    behind_a_body,
    between_bodies,
    centres,
    scene,
)
from wgmb import (
    Blur,
    Frame,
    InputError,
    Shutter,
    gpu,
)
from wgmb import scene as scenes
from wgmb.gpu.textures import TexturePool
from wgmb.lab.calls import counted
from wgmb.methods.gather.shading import (
    Kind,
    LightTimes,
    MovingLight,
    SurfaceLight,
)
from wgmb.render import Render


def truth(shutter, **how):
    """The mean over the shutter's time."""
    times = shutter.sample_times(64).astype(float)
    return np.mean([scene(t, **how).color for t in times], 0)


def error(got, want, border=8):
    inner = slice(border, -border)
    return np.sqrt(np.mean((got[inner, inner, :3] - want[inner, inner, :3]) ** 2))


@pytest.fixture(scope="module")
def device():
    return gpu.open_device()


class Stages:
    """All textures and flags that the passes of one kind of light wrote."""

    def __init__(self, device, pulled=False, resting=False):
        """`resting`: a pixel of light is 2 x 2, and what is on the left moves."""
        pool, light = TexturePool(device), MovingLight(device)
        whole, seen = around(glossy=pulled, **AT_REST if resting else {}), {}
        for offset, frame in ((0, whole), (-1, whole.prev), (1, whole.next)):
            given = frame.glossy_light if pulled else frame.diffuse_light
            given = frame.color[..., :3] if resting else given
            motion = np.array(frame.motion)
            motion[:, : 18 * resting] = 0.5
            rgba = np.dstack([given, np.ones_like(frame.depth)])
            seen[offset] = SurfaceLight(
                pool.upload(f"light {offset}", rgba, "rgba32float"),
                pool.upload(f"depth {offset}", frame.depth, "r32float"),
                pool.upload(f"motion {offset}", motion, "rgba32float"),
            )
        color = whole.glossy_color if pulled else whole.diffuse_color
        albedo = pool.upload("albedo", np.dstack([color, color[..., :1]]), "rgba32float")
        bindings = Blur("gather", device=device).frame_bindings(whole.depth.shape[::-1])
        encoder = device.create_command_encoder()
        kinds = [Kind(pulled, seen, None if resting else albedo, resting, resting)]
        done = light.encode(encoder, bindings, kinds, LightTimes.within(-0.5, 0.5, 4), None)
        gpu.submit(device, encoder)
        self.found = np.frombuffer(device.queue.read_buffer(done.change_flags), np.uint32)
        self._device, self._pool, self._light = device, pool, light
        self._kind = "glossy" if pulled else "diffuse"

    def __getitem__(self, name):
        name = f"{self._kind} {name}" if name.startswith("changes") else name
        texture = self._light._images._textures[f"shading {name}"]
        return self._pool.download(self._device.create_command_encoder(), texture).astype(float)


@pytest.fixture(scope="module", params=["shadows", "reflections", "resting"])
def stages(request, device):
    return Stages(device, request.param == "reflections", request.param == "resting")


def test_tiles_near_changes_are_found(stages):
    """A change marks its tile and those a pixel away; the tiles around these are near."""
    changes = np.any([stages[f"changes {side}"][..., :3] != 0 for side in (-1, 1)], axis=(0, 3))
    beside = np.pad(changes, 1)
    beside = np.any([beside[j : j + SIZE[0], i : i + SIZE[1]]
                     for j, i in ((0, 0), (0, 2), (2, 0), (2, 2))], axis=0)  # fmt: skip
    tiles = [range(0, n, 16) for n in SIZE]
    want = np.array([[beside[y : y + 16, x : x + 16].any() for x in tiles[1]] for y in tiles[0]])
    words = stages.found[1:].reshape(want.shape)
    marked = words & 2 != 0
    assert (want <= marked).all()  # changes are kept in half floats: the least become 0
    far = [[min(max(abs(y - j), abs(x - i)) for y, x in np.argwhere(marked))
            for i in range(want.shape[1])] for j in range(want.shape[0])]  # fmt: skip
    assert np.array_equal(words >> 8, far)
    assert np.array_equal(words & 4 != 0, np.array(far) <= 1)
    assert want.any() and not marked.all()


def test_far_from_moving_light_the_picture_is_that_without():
    """Nothing is left there of the frame before, whose light moved elsewhere."""
    size = (40, 200)
    blur, off = (Blur("gather", shutter=180, samples=8, shading=s) for s in ("auto", "off"))
    one = around(size=size)

    def elsewhere(frame, at):
        color, light = (np.roll(array, at, axis=1) for array in (frame.color, frame.diffuse_light))
        return replace(frame, color=color, diffuse_light=light, prev=None, next=None)

    frames = [elsewhere(frame, 150) for frame in (one, one.prev, one.next)]
    blur(frames[0].between(*frames[1:]))
    got = blur(one)
    assert np.array_equal(got[:, 120:], off(one)[:, 120:])
    assert not np.array_equal(got[:, :60], off(one)[:, :60])


def test_flow_is_that_of_the_shadow(device):
    flow = Stages(device)["flow ahead 1"]
    found = flow[22:30, 30:40]
    np.testing.assert_allclose(found[..., :2].mean((0, 1)), SPEED, atol=0.6)
    assert found[..., 2].min() > 0.9


@pytest.mark.covers(0)
@pytest.mark.parametrize("glossy", [False, True], ids=["shadow", "reflection"])
@pytest.mark.parametrize("pan", [(0.0, 0.0), PAN], ids=["still", "pan"])
def test_light_that_moves_is_nearer_the_truth(pan, glossy):
    shutter, how = Shutter(360), {"pan": pan, "glossy": glossy}
    want = truth(shutter, **how)
    plain, followed = (
        error(Blur("gather", shutter=shutter, shading=s)(around(**how)), want)
        for s in ("off", "auto")
    )
    assert followed < (0.55 if glossy else 0.3) * plain


@pytest.mark.covers(0)
@pytest.mark.parametrize("shutter", [Shutter(270, curve="triangle"), Shutter(200, "start"),
                                     Shutter(250, rolling="down", rolling_duration=0.3)],
                         ids=["curve", "after", "rolling"])  # fmt: skip
def test_every_shutter_sees_the_light_move(shutter):
    times = shutter.sample_times(32).astype(float)
    delays = [0.0]
    if shutter.rolling:
        delays = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 0.3 - 0.15
    want = np.zeros((*SIZE, 3))
    for row, delay in enumerate(delays):
        rows = slice(row, row + 1) if shutter.rolling else slice(None)
        want[rows] = np.mean([scene(t + delay, pan=(0, 0)).color[rows] for t in times], 0)
    plain, followed = (
        error(Blur("gather", shutter=shutter, shading=s)(around(pan=(0, 0))), want)
        for s in ("off", "passes")
    )
    assert followed < (0.4 if shutter.curve == "box" else 0.7) * plain


@pytest.mark.covers(0)
@pytest.mark.parametrize("samples", [3, 40, "auto"])
def test_every_number_of_samples_sees_it_move(samples):
    shutter = Shutter(360)
    want = truth(shutter, pan=(0, 0))
    off, on = (Blur("gather", shutter=shutter, samples=samples, shading=s) for s in ("off", "auto"))
    frame = around(pan=(0, 0))
    assert error(on(frame), want) < 0.4 * error(off(frame), want)


def test_a_shadow_is_followed_to_where_a_body_hides_it():
    """Its end lies on ground that the frame shows; in the next frame, on ground that it hides."""
    shutter = Shutter(180, "start")
    frame = behind_a_body(0).between(behind_a_body(-1), behind_a_body(1))
    times = shutter.sample_times(64).astype(float)
    want = np.mean([behind_a_body(t).color for t in times], 0)
    end = slice(12, 37), slice(40, 66)
    off, on = (
        np.sqrt(
            np.mean(
                (Blur("gather", shutter=shutter, shading=s)(frame)[end][..., :3] - want[end]) ** 2
            )
        )
        for s in ("off", "auto")
    )
    assert on < 0.5 * off


@pytest.mark.covers(0)
@pytest.mark.parametrize("at", ["start", "end"])
def test_a_shadow_goes_with_its_body_where_others_hide_the_ground(at):
    """The nearest body goes the other way, and one of the neighbours shows nothing there."""
    shutter = Shutter(180, at)
    frame = between_bodies(0).between(between_bodies(-1), between_bodies(1))
    times = shutter.sample_times(64).astype(float)
    want = np.mean([between_bodies(t).color for t in times], 0)
    shown = slice(22, 38), slice(8, 30)
    off, on = (
        np.sqrt(
            np.mean(
                (Blur("gather", shutter=shutter, shading=s)(frame)[shown][..., :3] - want[shown])
                ** 2
            )
        )
        for s in ("off", "auto")
    )
    assert on < 0.75 * off


def test_one_neighbour_is_followed_on_its_side():
    shutter, frame = Shutter(180, "start"), around(pan=(0, 0))
    alone = frame.between(None, frame.next)
    want = truth(shutter, pan=(0, 0))
    off, on = (Blur("gather", shutter=shutter, shading=s) for s in ("off", "auto"))
    assert error(on(alone), want) < 0.5 * error(off(alone), want)
    before = Blur("gather", shutter=Shutter(180, "end"), shading="auto")(alone)
    np.testing.assert_allclose(before, frame.color, atol=1e-3)


def test_light_that_rests_changes_no_bit():
    frame = around(still=True)
    off, on = (Blur("gather", shading=s)(frame) for s in ("off", "passes"))
    np.testing.assert_array_equal(on, off)


def still_but_for_noise():
    """Pixels of noise that differ from frame to frame; on average, light rests."""
    frames = []
    for n in range(3):
        frame, rng = scene(0, pan=(0, 0), still=True), np.random.default_rng(n)
        light = frame.diffuse_light * np.where(rng.random(SIZE) < 0.01, 1.1, 1)[..., None]
        frames.append(replace(frame, diffuse_light=light.astype("f4")))
    return frames[1].between(frames[0], frames[2])


LIGHT = {
    "rests": around(still=True, pan=(0, 0)), "moves on": around(still=True),
    "noise": still_but_for_noise(), "moves": around(),
    "fast": around(still=True, pan=(200.0, 0)), "reflections": around(glossy=True),
    "rests without passes": bare(around(still=True, **AT_REST)),
    "moves without passes": bare(around(radius=3, **AT_REST)),
}  # fmt: skip


@pytest.mark.parametrize("kind", LIGHT)
def test_steps_of_light_that_are_left_out_change_no_bit(kind):
    """`encode`, which waits for nothing, records all of them."""
    blur, frame = Blur("gather", samples=8), LIGHT[kind]
    images = TexturePool(blur.device)
    output, encoder = (
        images.texture("output", frame.size, blur.output),
        blur.device.create_command_encoder(),
    )
    blur.encode(encoder, output=output, **blur.upload(frame))
    want = images.download(encoder, output)[..., : frame.color.shape[2]]
    for _ in range(3):
        np.testing.assert_array_equal(blur(frame), want)


def test_light_that_rests_takes_few_passes():
    """All of them are recorded once where light begins to move, and then as long as it moves."""
    frames, passes = ("rests", "rests", "moves", "moves", "noise", "noise", "rests", "rests"), []
    blur, off = (Blur("gather", samples=8, shading=shading) for shading in ("passes", "off"))
    for frame in frames:
        with counted() as all_passes:
            blur(LIGHT[frame])
        with counted() as without:
            off(LIGHT[frame])
        passes.append(all_passes["dispatches"] - without["dispatches"])
    first, rests, begins, moves, ends, noise, calms, again = passes
    assert first == rests == again <= 12
    assert moves > 100
    assert begins > moves + rests
    assert ends == moves
    assert rests < noise < 40
    assert calms == noise


def test_moving_surfaces_without_passes_change_no_bit():
    frame = bare(around())
    off, auto = (Blur("gather", shading=s)(frame) for s in ("off", "auto"))
    np.testing.assert_array_equal(auto, off)
    with pytest.raises(InputError, match="needs passes of light"):
        Blur("gather", shading="passes")(frame)


@pytest.mark.covers(0)
@pytest.mark.parametrize(("scale", "width"), [(2, 71), (4, 250)], ids=["2 px", "4 px"])
def test_shadows_on_what_rests_need_no_passes(scale, width):
    """A pixel of light is 2 x 2 or 4 x 4. Where pixels have weights, nothing is followed."""
    how = {"pan": (0, 0), "size": (SIZE[0], width), "radius": 3, "scale": scale}
    frame, want = bare(around(**how)), truth(Shutter(360), **how)
    off, auto = (Blur("gather", shutter=360, shading=s) for s in ("off", "auto"))
    assert error(auto(frame), want) < 0.6 * error(off(frame), want)
    masked = [
        replace(f, holdout=np.eye(*frame.depth.shape, dtype="f4"))
        for f in (frame, frame.prev, frame.next)
    ]
    masked = masked[0].between(masked[1], masked[2])
    np.testing.assert_array_equal(auto(masked), off(masked))


def test_a_bright_reflection_is_no_shadow():
    """Unasked, nothing is followed where the frame alone is bright."""
    x, _ = centres((90, 140))

    def lit(t):
        bar = np.exp(-0.5 * ((x - 70 - 14 * t) / 5) ** 2)[..., None]
        color = 0.3 + 0.2 * np.sin(x)[..., None] * np.ones(3) + 0.4 * bar
        return Frame(color=color.astype("f4"), motion=np.zeros((90, 140, 4), "f4"),
                     depth=np.full((90, 140), 7, "f4"))  # fmt: skip

    frame = lit(0).between(lit(-1), lit(1))
    off, auto, frames = (Blur("gather", shading=s)(frame) for s in ("off", "auto", "frames"))
    assert error(auto, off) < 0.05 * error(frames, off)


def test_colours_alone_tell_of_shadows():
    shutter, frame = Shutter(360), around(radius=3)  # a shadow that leaves no place in the dark
    want = truth(shutter, radius=3)
    off, on = (Blur("gather", shutter=shutter, shading=s) for s in ("off", "frames"))
    assert error(on(frame), want) < 0.5 * error(off(frame), want)


def test_what_is_held_out_stays_out():
    holdout = np.zeros(SIZE, "f4")
    holdout[:, 44:] = 1
    frames = [replace(f, holdout=holdout) for f in (scene(0), scene(-1), scene(1))]
    frame = frames[0].between(frames[1], frames[2])
    got = Blur("gather", shutter=360)(frame)
    np.testing.assert_allclose(got[:, 45:], frame.color[:, 45:], atol=2e-3)
    want = truth(Shutter(360))
    off = Blur("gather", shutter=360, shading="off")(frame)
    assert error(got[:, :50], want[:, :50], 8) < 0.7 * error(off[:, :50], want[:, :50], 8)


def test_wrong_light_is_no_light():
    frame = around(pan=(0, 0))
    light = np.array(frame.diffuse_light)
    light[5:9, 5:9], light[30, 40], light[31, 41] = np.nan, np.inf, -4
    broken = replace(frame, diffuse_light=light).between(frame.prev, frame.next)
    got = Blur("gather", shutter=360)(broken)
    assert np.isfinite(got).all() and got.min() >= 0 and got.max() < 3


def accepted(frame, shading="auto", **how):
    return Blur("gather", shading=shading, **how).with_confidence(frame)[1]["accepted"]


def flash(pan=(0.0, 0.0), glossy=False):
    """A spot of shadow in the middle one of three frames alone, where light rests otherwise."""
    lit = around(pan=pan, glossy=glossy, still=True)
    x, y = centres(SIZE)
    spot = 1 - 0.8 / (1 + np.exp(2 * (np.hypot(x - 52, y - 30) - 5)))[..., None]
    name = "glossy_light" if glossy else "diffuse_light"
    light = (getattr(lit, name) * spot).astype("f4")
    dark = replace(lit, color=(lit.color * spot).astype("f4"), **{name: light})
    return dark.between(lit.prev, lit.next), spot[..., 0] < 0.6


@pytest.mark.covers(0)
@pytest.mark.parametrize("glossy", [False, True], ids=["shadow", "reflection"])
@pytest.mark.parametrize("pan", [(0.0, 0.0), PAN], ids=["still", "pan"])
def test_confidence_tells_where_light_could_not_be_followed(pan, glossy):
    moving = around(pan=pan, glossy=glossy)
    lost, changes = flash(pan, glossy)
    for frame in (moving, lost):
        assert accepted(frame, "off")[8:-8, 8:-8].min() > 0.999
    sure = accepted(lost)
    assert sure[changes].mean() < 0.3
    assert sure[8:-8, 8:35].min() > 0.99  # nothing changes there
    assert accepted(moving)[17:33, 26:42].mean() > (0.5 if glossy else 0.8)  # followed


def test_confidence_tells_of_a_side_without_a_neighbour():
    frame = around(pan=(0, 0))
    alone = frame.between(None, frame.next)
    after, before = (accepted(alone, shutter=Shutter(180, at)) for at in ("start", "end"))
    changes = np.abs(scene(1, (0, 0)).diffuse_light - frame.diffuse_light).max(2)
    assert after[changes > 0.3].mean() > 0.8
    assert before[changes > 0.3].max() < 0.2
    assert before[changes == 0].min() > 0.99


def test_confidence_of_light_that_rests_changes_no_bit():
    frame = around(still=True)
    with_, without = (Blur("gather", shading=s).with_confidence(frame)[1] for s in ("auto", "off"))
    for name in with_:
        np.testing.assert_array_equal(with_[name], without[name])


def test_sizes_that_fit_no_patch():
    for size in ((1, 1), (3, 40), (13, 9)):
        frame = around(size=size)
        assert np.isfinite(wgmb.Blur("gather")(frame)).all()


@pytest.mark.parametrize("shading", ["auto", pytest.param("passes", marks=pytest.mark.full)])
def test_scenes_are_drawn_with_their_light_and_nearer_the_truth(shading):
    scene = scenes.make("crossing", speed=3)

    def drawn(method, **options):
        blur = Blur(method, shutter=360, **options)
        return Render(scene, blur, size=(240, 136))(0.5)[..., :3].astype(float)

    truth = drawn("distributed", samples=64)
    off, followed = (
        np.square(drawn("gather", shading=how) - truth).mean() for how in ("off", shading)
    )
    assert followed < 0.85 * off


def test_light_is_that_of_the_moment_and_of_its_frames():
    """A Render that is used for another time does not keep the light of the last one."""
    scene, blur = scenes.make("crossing", speed=3), Blur("gather", shading="passes")
    one = Render(scene, blur, size=(64, 36))
    one(0.2)
    fresh = Render(scene, blur, size=(64, 36))
    np.testing.assert_array_equal(one(0.7), fresh(0.7))
    frame = one.frame(0.7, light=True)
    np.testing.assert_array_equal(frame.diffuse_light, fresh.frame(0.7, light=True).diffuse_light)


def test_a_scene_with_a_backdrop_has_no_light():
    flat = Render(scenes.make("torusphere"), Blur("gather", shading="passes"), size=(64, 36))
    with pytest.raises(InputError, match="needs passes of light"):
        flat(0.0)


def test_own_scenes_know_their_light():
    render = Render(scenes.make("crossing"), Blur("tap", samples=2), size=(48, 27), fps=24)
    frame = render.frame(0.5, light=True)
    assert frame.diffuse_light is not None and frame.diffuse_color is not None
    plain = render.frame(0.5)
    assert plain.diffuse_light is None
    np.testing.assert_array_equal(frame.color, plain.color)
    seen = np.abs(frame.color[..., :3] - frame.diffuse_light * frame.diffuse_color).max(axis=2)
    assert np.median(seen) < 0.02  # the rest is sky, gloss and edges
    assert np.ptp(frame.diffuse_light) > 0.5


@pytest.mark.parametrize(
    ("degrees", "samples", "count"),
    [(45, 16, 4), (180, 16, 6), (360, 64, 8), (720, 64, 8), (360, 3, 3)],
)
def test_light_is_known_at_times_all_over_the_exposure(degrees, samples, count):
    half = degrees / 720
    times = list(LightTimes.within(-half, half, samples))
    assert len(times) == count
    np.testing.assert_allclose(
        times, (np.arange(count) + 0.5) / count * 2 * half - half, atol=1e-12
    )
