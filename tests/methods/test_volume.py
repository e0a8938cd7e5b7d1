"""Turning volumes: densities against time itself, the march against its twin, laws, bad values."""

import math
import re

import numpy as np
import pytest
import wgpu

import make_frames as make
import wgmb
from twins import volume as twin
from wgmb import (
    InputError,
    Scene,
    Shutter,
    gpu,
)
from wgmb.color.srgb import srgb
from wgmb.gpu import wgsl
from wgmb.methods import volume as method_file
from wgmb.scene import builtin
from wgmb.scene.density import overrides, tables
from wgmb.scene.volumes import Backdrop, OrbitingSphere, Torus

CURVES = ["box", "trapezoid", "triangle", "cosine", "gaussian"]
SPEEDS = [0.0, 1.0, 30.0, 160.0, 400.0, 1e4]
FPS = 60.0
ALLOWED = {"box": 1e-4, "cosine": 1e-4}  # the others go through tables: 1e-3


def shots():
    return builtin.make("torusphere").camera


def volumes(speed, rng):
    """A sphere and a torus, forwards or backwards, each turned anyhow."""
    a, b = rng.uniform(0, 6, 2)
    return (
        OrbitingSphere(radius=0.2, orbit=0.5, speed=speed, phase=a),
        Torus(minor_radius=0.15, major_radius=0.4, speed=-speed, phase=b, centre=(0.1, 0.2, 0.0)),
    )


def points(volume, rng, count=200):
    """In the box around all that it sweeps."""
    low, high = np.array(volume.centre) - volume.reach, np.array(volume.centre) + volume.reach
    if isinstance(volume, OrbitingSphere):
        low[1], high[1] = (volume.centre[1] + s * volume.radius for s in (-1, 1))
    return rng.uniform(low, high, (count, 3))


def inside(volume, p, t):
    """True for points p (n, 3) in the solid at the time t [s], 0 the frame's instant."""
    angle = volume.phase + volume.speed * t
    return within(volume, p, np.cos(angle), np.sin(angle))


def within(volume, p, c, s):
    """True for points p in the solid turned by angles of cosine `c` and sine `s`."""
    q = p - np.array(volume.centre)
    x, y, z = q[..., 0], q[..., 1], q[..., 2]
    if isinstance(volume, OrbitingSphere):
        apart = (x - volume.orbit * c) ** 2 + y**2 + (z + volume.orbit * s) ** 2
        return apart < volume.radius**2
    u, v = x * c + y * s, y * c - x * s
    return (np.hypot(u, z) - volume.major_radius) ** 2 + v**2 < volume.minor_radius**2


def brute_force(volume, p, shutter, fps):
    """The exposure in equal shares, one instant each."""
    steps = 20_000 if abs(volume.speed) < 1e3 else 60_000
    shares = (np.arange(steps) + 0.5) / steps
    angle = volume.phase + volume.speed * shutter.time(shares) / fps
    c, s = np.cos(angle), np.sin(angle)
    return np.array([within(volume, point[None, :], c, s).mean() for point in p])


@pytest.fixture(scope="module")
def densities(device):
    """densities(volume, p, shutter, fps, density): what the shader finds at the points."""
    source = wgsl.load("methods/volume.wgsl")
    start = source.text.index("@compute")
    end = source.text.index("\n}\n", start) + 3
    probe = (
        "@group(1) @binding(2) var<storage, read_write> points: array<vec4f>;\n"
        "@compute @workgroup_size(WG_X, WG_Y)\n"
        "fn main(@builtin(global_invocation_id) id: vec3u) {\n"
        "    if id.y > 0u || id.x >= arrayLength(&points) { return; }\n"
        "    volumes[0] = scene.volumes[0];\n"
        "    points[id.x].w = density(points[id.x].xyz).a;\n"
        "}\n"
    )
    text = source.text[:start] + probe + source.text[end:]
    text = re.sub(r"@group\(1\) .* (tiles|output): .*", "", text)
    source = wgsl.WgslSource(text, source.files)

    def found(volume, p, shutter, fps, density="exact"):
        rotation = method_file.rotation_of(volume, shutter, fps, density == "exact")
        kernel = gpu.Kernel(
            device,
            source,
            {
                **overrides(shutter, [rotation]),
                "EXACT": density == "exact",
                "ORBITS": isinstance(volume, OrbitingSphere),
                "TORI": isinstance(volume, Torus),
            },
        )
        uniforms = np.zeros((), source.dtype("Volumes"))
        row = uniforms["volumes"][0]
        method_file.volume_row(row, volume, rotation, sum(shutter.span) / 2 / fps, (0, 0))
        rotation.fill(row["turning"], 0)
        at = np.zeros((len(p), 4), "f4")
        at[:, :3] = p
        create = device.create_buffer_with_data
        usage = wgpu.BufferUsage
        buffer = create(data=at, usage=usage.STORAGE | usage.COPY_SRC)
        given = wgmb.Blur("volume", device=device, shutter=shutter).frame_bindings((len(p), 1))
        encoder = device.create_command_encoder()
        kernel.run(
            encoder,
            "main",
            given,
            points=buffer,
            scene=create(data=uniforms, usage=usage.UNIFORM),
            tables=create(data=tables(shutter, [rotation]), usage=usage.STORAGE),
        )
        gpu.submit(device, encoder)
        return np.asarray(device.queue.read_buffer(buffer)).view("<f4").reshape(-1, 4)[:, 3]

    return found


@pytest.mark.covers(1)
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("curve", CURVES)
def test_density_is_the_share_of_the_exposure_in_which_the_body_is_there(densities, curve, speed):
    """Against the twin, which sums revolutions one by one, and against time itself."""
    rng = np.random.default_rng(int(speed))
    shutter = Shutter(720, curve=curve)
    for volume in volumes(speed, rng):
        p = points(volume, rng)
        got = densities(volume, p, shutter, FPS)
        sums = twin.density(volume, p, shutter, FPS)
        assert np.abs(got - sums).max() < ALLOWED.get(curve, 1e-3)
        assert np.abs(got - brute_force(volume, p, shutter, FPS)).max() < 1e-3
        assert got.max() > 0.05


@pytest.mark.parametrize("phase", ["start", "end", 0.3])
def test_a_late_or_early_exposure_sees_the_body_further_on_or_back(densities, phase):
    rng = np.random.default_rng(5)
    shutter = Shutter(500, phase, "triangle")
    for volume in volumes(40.0, rng):
        p = points(volume, rng)
        got = densities(volume, p, shutter, FPS)
        assert np.abs(got - brute_force(volume, p, shutter, FPS)).max() < 1e-3


def test_a_lopsided_curve_keeps_its_direction_in_time(densities):
    rng = np.random.default_rng(6)
    shutter = Shutter(720, curve=lambda x: x * x)
    for speed in (60.0, 900.0):
        for volume in volumes(speed, rng):
            p = points(volume, rng)
            got = densities(volume, p, shutter, FPS)
            assert np.abs(got - brute_force(volume, p, shutter, FPS)).max() < 1e-3


@pytest.mark.parametrize("curve", ["box", "cosine", "trapezoid"])
def test_any_speed_is_safe_and_the_fastest_tends_to_the_share_of_the_circle(densities, curve):
    rng = np.random.default_rng(7)
    for volume in volumes(1e5, rng):
        p = points(volume, rng)
        shutter = Shutter(720, curve=curve)
        r, _, third = twin.polar(volume, p)
        if isinstance(volume, OrbitingSphere):
            a = np.sqrt(np.maximum(volume.radius**2 - third**2, 0))
            share = twin.disk_half_angle(r, a, volume.orbit) / np.pi
        else:
            h = twin.spiric_half_angle(r, third, volume.minor_radius, volume.major_radius)
            share = 2 * h / np.pi
        assert np.abs(densities(volume, p, shutter, FPS) - share).max() < 1e-3


def test_a_closed_shutter_shows_the_solid(densities):
    rng = np.random.default_rng(8)
    for volume in volumes(1e5, rng):
        p = points(volume, rng)
        got = densities(volume, p, Shutter(0), FPS)
        near = np.abs(got - inside(volume, p, 0.0)) > 1e-3
        assert near.mean() <= 0.01  # an edge to f32


def test_the_published_form_counts_each_crossing_once(densities):
    rng = np.random.default_rng(9)
    shutter = Shutter(720, curve="cosine")
    for speed in (40.0, 900.0):
        for volume in volumes(speed, rng):
            p = points(volume, rng)
            got = densities(volume, p, shutter, FPS, "published")
            want = twin.density(volume, p, shutter, FPS, published=True)
            assert np.abs(got - want).max() < 1e-4
            exact = np.abs(got - densities(volume, p, shutter, FPS)).max()
            assert exact < 1e-4 if speed < 100 else exact > 0.03


@pytest.mark.covers(1)
@pytest.mark.parametrize("density", ["exact", "published"])
@pytest.mark.parametrize("time, cam_y", [(4, 0.0), (13, 0.75), (17, -1.0), (19.5, 0.3), (23, 0.0),
                                         (27, -0.6), (40, 0.0), (48, 0.0)])  # fmt: skip
def test_the_torusphere_is_its_twin(time, cam_y, density):
    """Eight times of the cycle; rays that graze a body may differ, all others agree."""
    scene, shutter = (
        builtin.make("torusphere", cam_y=cam_y, density=density),
        Shutter(720, curve="cosine"),
    )
    size = (96, 54)
    got = wgmb.Render(scene, wgmb.Blur("volume", shutter=shutter), fps=FPS, size=size)(time)
    want = twin.picture(scene, time, shutter, FPS, size)
    apart = np.abs(srgb(got[..., :3]) - want).max(axis=-1)
    assert (apart > 0.01).mean() < 0.005
    assert apart.mean() < 5e-4


@pytest.mark.parametrize("curve, closed", [(lambda x: 1 - np.cos(2 * np.pi * x), "cosine"),
                                           (np.ones_like, "box")])  # fmt: skip
@pytest.mark.parametrize("speed", [1.0, 160.0, 400.0, 1e4])
def test_tables_are_the_closed_forms(densities, curve, closed, speed):
    rng = np.random.default_rng(11)
    for volume in volumes(speed, rng):
        p = points(volume, rng)
        got = densities(volume, p, Shutter(720, curve=curve), FPS)
        want = densities(volume, p, Shutter(720, curve=closed), FPS)
        assert np.abs(got - want).max() < 1e-4


@pytest.mark.parametrize("way", ["down", "left"])
def test_a_rolling_shutter_exposes_every_line_in_its_time(way):
    """A line is that of a picture exposed at once, as much later."""

    def shown(**when):
        blur = wgmb.Blur("volume", shutter=Shutter(120, curve="triangle", **when))
        return wgmb.Render(several(), blur, fps=24, size=(64, 36))(0.3)

    rolled = shown(rolling=way, rolling_duration=0.8)
    for at in (0, 20, 35 if way == "down" else 63):
        height = 36 if way == "down" else 64
        late = 0.8 * ((at + 0.5) / height - 0.5) * (1 if way == "down" else -1)
        whole = shown(phase=late)
        line = np.index_exp[at] if way == "down" else np.index_exp[:, at]
        apart = np.abs(rolled[line] - whole[line])
        assert (apart > 0.01).mean() < 0.02
    assert np.abs(rolled - shown()).max() > 0.1


@pytest.mark.parametrize("time, cam_y", [(2, -1.0), (13, 0.75), (19.5, -0.4), (31, 0.3)])
def test_no_tile_that_shows_a_volume_is_left_out(monkeypatch, time, cam_y):
    render = wgmb.Render(
        builtin.make("torusphere", cam_y=cam_y),
        wgmb.Blur("volume", shutter=Shutter(720, curve="cosine")), fps=FPS, size=(320, 180),
    )  # fmt: skip
    chosen = render(time)
    monkeypatch.setattr(
        method_file, "tile_kinds", lambda data, count, size, edges: np.full((90, 10), 3)
    )
    np.testing.assert_allclose(chosen, render(time), atol=1e-6)


def several():
    return Scene(
        "several",
        (),
        shots(),
        volumes=(
            OrbitingSphere(radius=0.2, orbit=0.6, speed=30, color=(0.9, 0.2, 0.1)),
            OrbitingSphere(
                radius=0.1, orbit=0.3, speed=-400, color=(0.1, 0.8, 0.2), centre=(0, 0.4, 0)
            ),
            Torus(minor_radius=0.1, major_radius=0.4, speed=20, color=(0.2, 0.3, 0.9)),
        ),
    )


@pytest.mark.parametrize("curve", [pytest.param("box", marks=pytest.mark.full), "triangle"])
def test_several_volumes_are_their_twin(curve):
    shutter = Shutter(360, curve=curve)
    got = wgmb.Render(several(), wgmb.Blur("volume", shutter=shutter), fps=24, size=(40, 22))(0.3)
    want = twin.picture(several(), 0.3, shutter, 24, (40, 22))
    apart = np.abs(srgb(got[..., :3]) - want).max(axis=-1)
    assert (apart > 0.01).mean() < 0.005


def test_solids_are_where_distributed_rays_meet_them():
    """The density converges to the share of rays that meet the body."""
    one = Scene("one", (), shots(), volumes=(Torus(minor_radius=0.2, major_radius=0.6, speed=25),))
    size, shutter = (64, 36), Shutter(360)
    still = wgmb.Render(one, wgmb.Blur("tap", shutter=0), size=size).frame(0.2)
    angle = 25 * 0.2
    there = still.object_id == 2  # body 1 is the ground
    y, x = np.nonzero(there)
    eye = one.camera.world_from_camera(0.2)[0]
    at = np.stack([(x + 0.5 - 32) / 36, (18 - y - 0.5) / 36, -np.ones(len(x))], axis=1)
    p = eye[:3, 3] + (still.depth[there][:, None] * at) @ eye[:3, :3].T
    c, s = math.cos(angle), math.sin(angle)
    u, v = p[:, 0] * c + p[:, 1] * s, p[:, 1] * c - p[:, 0] * s
    assert there.sum() > 50
    np.testing.assert_allclose(np.hypot(np.hypot(u, p[:, 2]) - 0.6, v), 0.2, atol=2e-3)
    blur = wgmb.Blur("distributed", shutter=shutter, samples=64)
    moving = wgmb.Render(one, blur, size=size)(0.2)
    mean = wgmb.Render(one, wgmb.Blur("accumulate", shutter=shutter, samples=32), size=size)(0.2)
    assert np.abs(moving - mean)[..., :3].mean() < 0.01


@pytest.mark.parametrize(
    "make_it, word",
    [
        (lambda: OrbitingSphere(radius=-1, orbit=1), "radius"),
        (lambda: OrbitingSphere(radius=1, orbit=-1), "orbit"),
        (lambda: OrbitingSphere(radius=1, orbit=1, speed=math.nan), "speed"),
        (lambda: OrbitingSphere(radius=1, orbit=1, phase=math.inf), "phase"),
        (lambda: OrbitingSphere(radius=1, orbit=1, opacity=-1), "opacity"),
        (lambda: OrbitingSphere(radius=1, orbit=1, color=(0, 0, math.nan)), "color"),
        (lambda: Torus(minor_radius=2, major_radius=1), "minor_radius"),
        (lambda: Torus(minor_radius=0, major_radius=1), "minor_radius"),
        (lambda: Torus(minor_radius=0.1, major_radius=math.nan), "major_radius"),
        (lambda: Torus(minor_radius=0.1, major_radius=1, speed=math.nan), "speed"),
        (lambda: Backdrop(grids=((0.0, 1.0),) * 3), "grids"),
        (lambda: Scene("x", (), shots(), density="dense"), "density"),
    ],
)
def test_senseless_volumes_are_named(make_it, word):
    with pytest.raises(InputError, match=word):
        make_it()


@pytest.mark.parametrize(
    "options",
    ["--set cam_y=1", "--set cam_x=nan", "--set density=dense", "--set speed=1",
     "--time nan"],
)  # fmt: skip
def test_senseless_settings_are_one_line(capsys, tmp_path, options):
    code, out, err = make.inside(
        capsys, "render", "torusphere", "-o", tmp_path / "t.png", *options.split()
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert not (tmp_path / "t.png").exists()


def test_a_scene_without_volumes_is_refused():
    with pytest.raises(InputError, match="crossing"):
        wgmb.Render(builtin.make("crossing"), wgmb.Blur("volume"))(0.0)


def test_too_many_volumes_are_refused():
    many = Scene("many", (), shots(), volumes=(OrbitingSphere(radius=0.1, orbit=0.5),) * 17)
    with pytest.raises(InputError, match="at most 16"):
        wgmb.Render(many, wgmb.Blur("volume"), size=(32, 18))(0.0)


def test_the_torusphere_is_exposed_as_it_is_made_for_at_any_rate(tmp_path, capsys):
    """Two frames of 60 a second, whatever --fps is; and through its own method."""
    for fps in (24, 60):
        make.inside(capsys, "render", "torusphere", "--time", 13, "--size", "64x36", "--fps", fps,
                    "-o", tmp_path / f"{fps}.exr")  # fmt: skip
    one, other = (make.plain_read(tmp_path / f"{fps}.exr") for fps in (24, 60))
    np.testing.assert_allclose(one["G"], other["G"], atol=1e-4)
