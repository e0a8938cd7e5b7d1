"""Motion blur in a pygfx scene, offscreen: near the truth, still pictures unchanged, no growth."""

import gc
from pathlib import Path

import numpy as np
import pygfx
import pylinalg
import pytest
from rendercanvas.offscreen import RenderCanvas

import wgmb
from wgmb.color.srgb import linear, srgb
from wgmb.gpu import bind_groups
from wgmb.hosts.pygfx import Bodies, MotionBlurPass
from wgmb.methods import METHODS

pytestmark = pytest.mark.filterwarnings("ignore")  # pygfx's own

ROOT = Path(__file__).parents[2]
INSTANT, TIMES = 5.0, 64  # of the truth: pictures over half a frame


class Stage:
    """A canvas, a renderer and boxes; `pose(time)` moves them."""

    def __init__(self, boxes: int, moving: bool, size=(480, 270)):
        self.canvas = RenderCanvas(size=size, pixel_ratio=1)
        self.renderer = pygfx.WgpuRenderer(self.canvas)
        self.renderer.pixel_scale, self.renderer.ppaa = 1, "none"
        self.scene, self.moving = pygfx.Scene(), moving
        self.scene.add(pygfx.Background.from_color((0.3, 0.45, 0.7)))
        self.camera = pygfx.PerspectiveCamera(50, 480 / 270, depth_range=(0.1, 100))
        self.boxes, rng, box = [], np.random.default_rng(1), pygfx.box_geometry(1, 1, 1)
        for _ in range(boxes):
            color = (*rng.random(3), 1)
            mesh = pygfx.Mesh(box, pygfx.MeshBasicMaterial(color=color, pick_write=moving))
            place = rng.uniform(-8, 8), rng.uniform(-4, 4), rng.uniform(-12, -3)
            mesh.local.position = place
            speed = rng.uniform(-0.5, 0.5, 3) if moving else np.zeros(3)
            if not moving:
                mesh.local.rotation = pylinalg.quat_from_euler(rng.random(3) * 3)
            self.boxes.append((mesh, np.array(place), speed))
            self.scene.add(mesh)

    def pose(self, time: float) -> None:
        if not self.moving:
            self.camera.local.position = (0.35 * time, 0, 2)
            self.camera.local.rotation = pylinalg.quat_from_euler((0, 0.02 * time, 0))
            return
        self.camera.local.position = (0.1 * time, 0, 2)
        for mesh, place, speed in self.boxes:
            mesh.local.position = place + speed * (time - INSTANT)
            mesh.local.rotation = pylinalg.quat_from_euler((0, 0.2 * time, 0))

    def shot(self, time: float) -> np.ndarray:
        """The picture: (height, width, 3) bytes."""
        self.pose(time)
        self.canvas.request_draw(lambda: self.renderer.render(self.scene, self.camera))
        return np.asarray(self.canvas.draw())[..., :3].copy()

    def truth(self) -> np.ndarray:
        """Display values of the mean over a shutter of 180 degrees."""
        moments = INSTANT + ((np.arange(TIMES) + 0.5) / TIMES - 0.5) / 2
        return srgb(np.mean([linear(self.shot(t) / 255) for t in moments], axis=0))

    def use(self, *passes) -> None:
        self.renderer.effect_passes = passes

    def objects(self) -> dict:
        return {"renderer": self.renderer, "scene": self.scene}


def psnr(a, b) -> float:
    return float(-10 * np.log10(np.mean((a - b) ** 2)))


# PSNR [dB] of display values, 480 x 270, of the sharp picture and by method.
CAMERA = {"tap": 36.9, "tiles": 37.3, "reproject": 35.5, "gather": 35.6}
OBJECTS = {"tap": 32.9, "tiles": 33.4, "reproject": 35.4, "gather": 37.2}
CAMERA_ALONE = {"tap": 30.3, "tiles": 30.6, "reproject": 30.8, "gather": 30.1}


@pytest.mark.full
@pytest.mark.parametrize(
    ("boxes", "moving", "sharp", "tables"),
    [
        pytest.param(60, False, 32.4, {False: CAMERA}, id="camera"),
        pytest.param(40, True, 29.2, {False: CAMERA_ALONE, True: OBJECTS}, id="objects"),
    ],
)
def test_it_comes_as_near_to_the_truth_as_was_measured(boxes, moving, sharp, tables):
    stage = Stage(boxes, moving)
    truth, still = stage.truth(), stage.shot(INSTANT)
    assert psnr(still / 255, truth) == pytest.approx(sharp, abs=0.5)
    for with_objects, table in tables.items():
        for method, want in table.items():
            more = stage.objects() if with_objects else {}
            stage.use(MotionBlurPass(stage.camera, method, **more))
            stage.shot(INSTANT - 1)
            got = psnr(stage.shot(INSTANT) / 255, truth)
            assert got > want - 0.5, f"{method}, objects {with_objects}: {got:.1f} dB"
            assert np.array_equal(stage.shot(INSTANT), still)  # nothing moved since


@pytest.fixture
def small():
    return Stage(8, True, (64, 36))


def test_the_first_frame_and_the_one_after_a_cut_are_not_blurred(small):
    plain = small.shot(3), small.shot(9)
    blur = MotionBlurPass(small.camera, **small.objects())
    small.use(blur)
    assert np.array_equal(small.shot(3), plain[0])
    assert not np.array_equal(small.shot(9), plain[1])
    small.shot(3)
    blur.reset()
    assert np.array_equal(small.shot(9), plain[1])


def test_sizes_may_change_and_pixels_be_smaller(small):
    blur = MotionBlurPass(small.camera, "gather", **small.objects())
    small.use(blur)
    for size, scale in (((64, 36), 1), ((50, 30), 1), ((64, 36), 2), ((64, 36), 1)):
        small.canvas.set_logical_size(*size)
        small.renderer.pixel_scale = scale
        small.shot(4)
        assert small.shot(5).shape[:2] == size[::-1]
        inside = blur._images._textures["output"].size[:2]
        assert inside == tuple(scale * n for n in size)


def test_two_renderers_have_a_pass_each():
    alone = Stage(8, True, (64, 36))
    alone.use(MotionBlurPass(alone.camera, **alone.objects()))
    want = [alone.shot(t) for t in (4, 5)]
    both = [Stage(8, True, (64, 36)) for _ in range(2)]
    for stage in both:
        stage.use(MotionBlurPass(stage.camera, **stage.objects()))
    for t, picture in zip((4, 5), want, strict=True):
        for stage in both:
            assert np.array_equal(stage.shot(t), picture)


def test_objects_come_and_go(small):
    blur = MotionBlurPass(small.camera, **small.objects())
    small.use(blur)
    small.shot(4)
    (mesh, _, _), other = small.boxes[0], small.boxes[1][0]
    index = blur._bodies._index[other.id]
    small.scene.remove(mesh)
    small.shot(5)
    assert mesh.id not in blur._bodies._index
    assert blur._bodies._index[other.id] == index
    small.scene.add(mesh)
    small.shot(6)
    ids = blur._bodies._index
    assert len({*ids.values()} - {0}) == len(ids)
    mesh.local.scale = 0  # a matrix that cannot be inverted
    small.shot(7)
    assert len(blur._bodies.matrices()) == len(ids) - 1


def test_more_objects_than_bodies_move_with_the_camera(device, monkeypatch):
    monkeypatch.setattr("wgmb.hosts.pygfx.MOST_BODIES", 2)
    stage = Stage(5, True, (64, 36))
    bodies = Bodies(device, stage.renderer, stage.scene)
    assert sorted(bodies.matrices()) == [1, 2]
    assert sorted(bodies._index.values()) == [0, 0, 0, 1, 2]


@pytest.mark.full
def test_500_frames_leave_nothing_behind(small):
    blur = MotionBlurPass(small.camera, jitter=1, **small.objects())
    small.use(blur)

    def counts() -> tuple[int, ...]:
        gc.collect()
        groups = blur.blur._constants.groups
        return len(groups), len(groups._keys), len(groups._watched), len(blur._images._textures)

    for n in range(80):
        small.shot(n / 9)
    before = counts()
    for n in range(80, 500):
        small.shot(n / 9)
    assert max(a - b for a, b in zip(counts(), before, strict=True)) <= 4


@pytest.mark.parametrize("method", ["tap", "gather"])
def test_a_frame_makes_no_groups_and_no_buffers_anew(small, method, monkeypatch):
    made = []
    real = bind_groups.made_group
    monkeypatch.setattr(bind_groups, "made_group", lambda *a: made.append(a) or real(*a))
    blur = MotionBlurPass(small.camera, method, **small.objects())
    small.use(blur)
    pictures = [small.shot(n / 9) for n in range(4)]
    begun = len(made), bind_groups._constant.cache_info().misses
    pictures += [small.shot(n / 9) for n in range(4, 8)]
    assert begun[0] > 0
    assert (len(made), bind_groups._constant.cache_info().misses) == begun
    assert len({picture.tobytes() for picture in pictures}) == 8  # each with its own matrices
    # And each is what a pass makes that has seen the frame before it alone.
    fresh = MotionBlurPass(small.camera, method, **small.objects())
    small.use(fresh)
    small.shot(6 / 9)
    assert np.array_equal(small.shot(7 / 9), pictures[7])


def test_methods_and_arguments_that_do_not_fit_are_refused(small):
    for method in ("distributed", "volume", "accumulate"):
        with pytest.raises(wgmb.InputError, match=f"'{method}' needs a scene .*; use tap, "):
            MotionBlurPass(small.camera, method)
    with pytest.raises(wgmb.InputError, match="unknown method"):
        MotionBlurPass(small.camera, "tapp")
    with pytest.raises(wgmb.InputError, match="both `renderer` and `scene`"):
        MotionBlurPass(small.camera, renderer=small.renderer)
    able = [name for name, method in METHODS.items() if "scene" not in method.needs]
    for method in able:
        small.use(MotionBlurPass(small.camera, method))
        small.shot(4)
        assert small.shot(5).std() > 0


def test_the_example_runs_offscreen(monkeypatch):
    monkeypatch.setenv("RENDERCANVAS_FORCE_OFFSCREEN", "1")
    monkeypatch.syspath_prepend(ROOT / "sample")
    import pygfx_live

    picture = pygfx_live.main("tap", frames=2)
    assert picture.shape == (540, 960, 4) and len(np.unique(picture)) > 50


@pytest.fixture
def plot(monkeypatch):
    """A figure of fastplotlib with points."""
    monkeypatch.setenv("RENDERCANVAS_FORCE_OFFSCREEN", "1")
    with np.errstate(all="ignore"):  # fastplotlib's own
        import fastplotlib

        figure = fastplotlib.Figure(size=(160, 90), cameras="3d", canvas="offscreen")
        points = np.random.default_rng(0).uniform(-2, 2, (100, 3)).astype("f4")
        figure[0, 0].add_scatter(points, sizes=9, colors="w")
        figure.show()
        yield figure


def test_fastplotlib_takes_the_pass(plot):
    camera = plot[0, 0].camera

    def shot() -> np.ndarray:
        return np.asarray(plot.canvas.draw()).copy()

    shot()
    plain = shot()
    plot.renderer.effect_passes = (*plot.renderer.effect_passes, MotionBlurPass(camera))
    shot()
    assert np.array_equal(shot(), plain)
    x, y, z = camera.local.position
    camera.local.position = (x + 0.25, y, z)
    moved, after = shot(), shot()
    assert not np.array_equal(moved, after)
