"""Videos without a GPU: quick motion, made better by place, and a blur that is steady."""

import numpy as np
import pytest

import wgmb
from wgmb import Flow, gpu
from wgmb.run.video import VideoRequest
from wgmb.settings import BlurSettings
from wgmb.settings.video import VideoSettings

pytest.importorskip("cv2")

import cv2

from wgmb.flow.dis import Dis
from wgmb.flow.dis.blocks import MOST_OTHER, OTHER, SMALL, Reduced, searched
from wgmb.flow.dis.by_place import ByPlace
from wgmb.methods.gather.tiles.active_tiles import ActiveTiles
from wgmb.video import gpu_frames
from wgmb.video.edges import MotionEdges

WIDTH, HEIGHT, COUNT = 320, 180, 5


def texture(width, height, cell, seed):
    """(height, width, 3) display values of soft cells."""
    rng = np.random.default_rng(seed)
    cells = rng.uniform(0.15, 0.9, (-(-height // cell) + 1, -(-width // cell) + 1, 3))
    return cv2.resize(cells.astype("f4"), (width, height), interpolation=cv2.INTER_CUBIC)


def grounds(kind):
    """The ground of each picture."""
    if kind == "flat":
        return [np.full((HEIGHT, WIDTH, 3), 0.3, "f4")] * COUNT
    wide = 0.5 * texture(WIDTH + 40, HEIGHT, 9, 1)
    step = 3 if kind == "moving" else 0
    return [wide[:, step * n : step * n + WIDTH] for n in range(COUNT)]


def shot(speed, side, kind):
    """(count, height, width, 3) uint8: a body that moves to the right by `speed` px a picture."""
    body, pictures = texture(side, side, max(4, side // 5), 2), []
    for n, ground in enumerate(grounds(kind)):
        shown = ground.copy()
        left = round(WIDTH / 2 + speed * (n - COUNT // 2) - side / 2)
        top = (HEIGHT - side) // 2
        cut = slice(max(left, 0), max(min(left + side, WIDTH), 0))
        shown[top : top + side, cut] = body[:, cut.start - left : cut.stop - left]
        pictures.append(np.rint(255 * shown.clip(0, 1)).astype("u1"))
    return np.array(pictures)


def streak(blurred, ground, side):
    """Columns in which a picture differs from its ground, in the rows of the body."""
    rows = slice((HEIGHT - side) // 2 + side // 4, (HEIGHT + side) // 2 - side // 4)
    apart = np.abs(blurred.astype(float) - 255 * ground)[rows].mean(axis=(0, 2))
    return int((apart > 8).sum())


def law(*args):
    return pytest.param(*args)


def all_law(*args):
    return pytest.param(*args, marks=pytest.mark.full)


SPEEDS = 2, 6, 12, 16, 20, 24, 32, 36, 40, 48, 56, 64  # px; the last a fifth of the width
SHORTER = {(12, 12, "textured")}  # see docs/engineers/flow.md, Artefacts
CASES = [
    law(12, 40, "textured"), law(48, 40, "textured"), law(40, 24, "flat"), law(48, 60, "moving"),
    law(56, 12, "moving"), law(32, 120, "textured"),
    *(all_law(speed, side, kind)
      for speed in SPEEDS for side in (12, 40, 120) for kind in ("textured", "moving")
      if (speed, side, kind) not in SHORTER),
    *(all_law(speed, side, "flat") for speed in (2, 24, 64) for side in (12, 40, 120)),
    *(all_law(speed, 40, "flat") for speed in (20, 36, 40)),
]  # fmt: skip


@pytest.mark.parametrize(("speed", "side", "kind"), CASES)
def test_a_body_at_a_constant_speed_has_the_same_streak_in_every_picture(device, speed, side, kind):
    """As long as the body and half of its way, within a tenth and a pixel of the soft ends."""
    pictures, want = shot(speed, side, kind), side + speed / 2
    results = list(wgmb.blur_pictures(list(pictures), shutter=180, device=device))
    lengths = [
        streak(results[n], ground, side)
        for n, ground in enumerate(grounds(kind))
        if 0 < n < COUNT - 1 and abs(n - COUNT // 2) * speed + want / 2 < WIDTH / 2
    ]
    assert lengths and max(abs(length - want) for length in lengths) <= 0.1 * want + 2, lengths


def test_the_motion_of_a_picture_depends_on_its_neighbours_alone():
    """Whatever was asked for before, and in whatever order, it is the same to the bit."""
    pictures = [p[..., 1].copy() for p in shot(48, 40, "textured")]

    def load(number):
        return pictures[number] if 0 <= number < COUNT else None

    whole = ByPlace().shot(load)
    forwards = [whole(n) for n in range(COUNT)]
    other = ByPlace().shot(load)
    for n in (3, 0, 4, 1, 2):
        for one, two in zip(other(n), forwards[n], strict=True):
            np.testing.assert_array_equal(one, two)
    part = ByPlace().shot(lambda n: load(n) if 1 <= n <= 3 else None)
    np.testing.assert_array_equal(part(2)[0], forwards[2][0])


def test_blocks_find_a_body_that_dense_inverse_search_loses():
    pictures = [p[..., 1].copy() for p in shot(48, 40, "textured")]
    row, middle = HEIGHT // 2, slice(WIDTH // 2 - 10, WIDTH // 2 + 10)
    quick = Dis("fast").motion(pictures[1:4])[row, middle]
    assert np.abs(quick[:, 2] - 48).min() > 20
    found = ByPlace().motion(pictures[1:4])[row, middle]
    assert np.abs(found - [-48, 0, 48, 0]).max() < 2
    first = ByPlace().motion([None, *pictures[1:3]])[row, 106:122]
    assert np.abs(first - [-48, 0, 48, 0]).max() < 2


def dissolve(moment, speeds):
    """A picture between two textures that move to the left, each by its own speed [px]."""
    shown = []
    for cell, speed in zip((9, 12), speeds, strict=True):
        shift = np.float32([[1, 0, -40 - speed * moment], [0, 1, 0]])
        shown.append(
            cv2.warpAffine(texture(WIDTH + 80, HEIGHT, cell, cell), shift, (WIDTH, HEIGHT))
        )
    share = moment / 6
    return ((1 - share) * shown[0] + share * shown[1]).clip(0, 1)


@pytest.mark.parametrize("speeds", [(0, 0), (3, 8), (9, 2)])
def test_no_body_is_found_in_a_dissolve(speeds):
    """It has the motion of dense inverse search, as its light changes evenly."""
    pictures = [np.rint(255 * dissolve(n, speeds)[..., 1]).astype("u1") for n in range(6)]
    for n in range(1, 5):
        near = pictures[n - 1 : n + 2]
        found = searched(near, Dis("fast").motion(near))
        assert found is None or found.other.mean() < 0.03


def test_a_way_along_which_a_place_is_the_mean_of_both_neighbours_costs_little():
    """Its cost has the differences to the neighbours no longer; lost places have them still."""
    prev, next = (np.rint(255 * texture(160, 90, 9, n)[..., 1].clip(0, 1)) for n in (1, 2))
    pictures = [p.astype("u1") for p in (prev, np.rint((prev + next) / 2), next)]
    none = np.zeros((90, 160, 4), np.float32)
    level = Reduced(pictures, SMALL)
    better, worse = level.differences(none)
    assert better.mean() > 15
    share = cv2.blur(OTHER * np.minimum(worse, MOST_OTHER), (3, 3))
    assert np.abs(level.cost(none) - share).max() <= 0.5
    for alone in ([None, *pictures[1:]], [*pictures[:2], None]):
        level = Reduced(alone, SMALL)
        np.testing.assert_allclose(level.cost(none), cv2.blur(level.differences(none)[0], (3, 3)))


@pytest.mark.parametrize("kind", ["textured", "moving"])
@pytest.mark.parametrize("is_last", [False, True])
def test_ground_that_the_only_neighbour_hides_moves_like_all_else(kind, is_last):
    """A body of 40 px hides it there, and nothing in that picture is like it."""
    pictures = [p[..., 1].copy() for p in shot(48, 40, kind)]
    near = [pictures[3], pictures[4], None] if is_last else [None, pictures[0], pictures[1]]
    motion = ByPlace().motion(near)
    pan, middle = 3 if kind == "moving" else 0, 208 if is_last else 112
    hidden = motion[HEIGHT // 2 - 14 : HEIGHT // 2 + 14, middle - 14 : middle + 10, 2]
    body = motion[HEIGHT // 2 - 10 : HEIGHT // 2 + 10, middle + (38 if is_last else -58) :][:, :20]
    assert (np.abs(hidden + pan) < 1).mean() > 0.8
    assert np.abs(body[..., 2] - 48).max() < 2


def test_motion_is_as_dense_inverse_search_finds_it_where_all_moves_alike():
    """At the border, where that sees half of it, it goes on like all else."""
    wide = texture(WIDTH + 60, HEIGHT, 9, 3)
    pictures = [np.rint(200 * wide[:, 3 * n : 3 * n + WIDTH, 1]).astype("u1") for n in range(3)]
    found, quick = ByPlace().motion(pictures), Dis("fast").motion(pictures)
    np.testing.assert_array_equal(found[16:-16, 16:-16], quick[16:-16, 16:-16])
    error = [np.abs(motion - np.float32([3, 0, -3, 0])).max() for motion in (found, quick)]
    assert error[0] < 0.5 < error[1]


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 2), (5, 640), (40, 64)])
def test_pictures_of_any_shape_have_a_motion(shape):
    rng = np.random.default_rng(0)
    motion = ByPlace().motion([rng.integers(0, 255, shape).astype("u1") for _ in range(3)])
    assert motion.shape == (*shape, 4) and np.isfinite(motion).all()


@pytest.mark.parametrize(("period", "step"), [(7, (6, 3)), (10, (2, 1))])
def test_bars_before_a_moving_camera_move_like_all_else(period, step):
    """Each bar is like the next one, so that a search takes one for another."""
    wide = np.rint(200 * texture(WIDTH + 60, HEIGHT + 60, 9, 3)[..., 1]).astype("u1")
    wide[90:180, 20:220] = np.where(np.arange(90) % period < period / 2, 60, 110)[:, None]
    grain = np.random.default_rng(0).integers(0, 3, (3, HEIGHT, WIDTH)).astype("u1")
    pictures = [
        wide[step[1] * n : step[1] * n + HEIGHT, step[0] * n : step[0] * n + WIDTH] + grain[n]
        for n in range(3)
    ]
    want = np.float32([*step, -step[0], -step[1]])
    assert np.abs(Dis("fast").motion(pictures) - want).max() > 5
    assert np.abs(ByPlace().motion(pictures) - want).max() < 1.5


def test_gather_at_edges_taps_the_rest(device):
    """Far from a body that crosses a ground, the blur is tap's to the bit; near it, gather's.

    The body reaches the tiles beside its own, and cells have two tiles each.
    """
    y, x = np.mgrid[:96, :192]
    color = texture(192, 96, 7, 4)
    body = (np.abs(x - 96) < 12) & (np.abs(y - 48) < 12)
    motion = np.where(body[..., None], np.float32([-40, 0, 40, 0]), np.float32([-2, 0, 2, 0]))
    frame = wgmb.Frame(color, motion=motion, depth=np.where(body, 1, 2).astype("f4"))
    blurs = {
        name: wgmb.Blur(method, device=device, **options)(frame)
        for name, method, options in (
            ("tap", "tap", {}),
            ("gather", "gather", {"shading": "off"}),
            ("edges", "gather", {"shading": "off", "where": "edges"}),
        )
    }
    far = (x < 64) | (x >= 128) | (y < 16) | (y >= 80)
    near = (np.abs(x - 96) < 20) & (np.abs(y - 48) < 16)
    np.testing.assert_array_equal(blurs["edges"][far], blurs["tap"][far])
    np.testing.assert_array_equal(blurs["edges"][near], blurs["gather"][near])
    assert np.abs(blurs["gather"] - blurs["tap"])[near].max() > 0.1
    # Across the border of the tiles nothing jumps: both follow the same motion.
    assert np.abs(blurs["edges"] - blurs["gather"]).max() < 0.02


def test_pictures_without_edges_of_motion_are_tapped(device):
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        pytest.skip("a GPU searches every picture")
    wide = texture(WIDTH + 60, HEIGHT, 9, 3)
    pictures = [np.rint(200 * wide[:, 3 * n : 3 * n + WIDTH]).astype("u1") for n in range(4)]
    auto = wgmb.blur_pictures(pictures, device=device)
    tapped = wgmb.blur_pictures(pictures, device=device, method="tap")
    for one, two in zip(auto, tapped, strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.fixture
def lists(device, monkeypatch):
    """`lists(motion, blur)`: True if gather lists a tile of a picture that moves like that."""
    active, original = [], ActiveTiles.encode

    def encode(self, encoder, inputs):
        found = original(self, encoder, inputs)
        active[:] = [found["active"]]
        return found

    def of(motion, blur):
        color, depth = np.ones((*motion.shape[:2], 3), "f4"), np.ones(motion.shape[:2], "f4")
        blur(wgmb.Frame(color, motion=motion, depth=depth))
        words = device.queue.read_buffer(*active[0].values())
        return bool(np.frombuffer(words, "u4")[3])

    monkeypatch.setattr(ActiveTiles, "encode", encode)
    return of


@pytest.mark.parametrize(
    ("shutter", "factors"),
    [
        (wgmb.Shutter(180), (1, 1)),
        (wgmb.Shutter(300, phase="start"), (0.5, 2)),
        (wgmb.Shutter(90, rolling="down"), (1, 1)),
    ],
)
def test_gather_runs_only_where_it_lists_a_tile(device, lists, shutter, factors):
    """One pixel, or a border, moves otherwise by a vector back, ahead or both, near the limit."""
    options = {"shading": "off", "where": "edges", "samples": 2}
    blur, answers = wgmb.Blur("gather", device=device, shutter=shutter, **options), set()
    for where in (np.s_[18:19, 34:35], np.s_[:, 15:], np.s_[41:, :]):
        for sides in (np.s_[:2], np.s_[2:], np.s_[:]):
            for step in (6, 15, 17, 30):
                motion = np.zeros((50, 70, 4), "f4")
                motion[where][..., sides] += step
                runs = MotionEdges(motion).within(shutter, factors)
                assert runs == lists(motion * np.repeat(np.float32(factors), 2), blur)
                answers.add(runs)
    assert answers == {True, False}


def test_pictures_that_stand_are_copied_and_not_searched(device, monkeypatch):
    """A picture is copied if its neighbours have the same samples; one other sample suffices."""
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        pytest.skip("a GPU searches in its own memory")
    searched = []
    original = ByPlace.motion
    monkeypatch.setattr(ByPlace, "motion", lambda *args: searched.append(1) or original(*args))
    still = np.rint(200 * texture(WIDTH, HEIGHT, 9, 3)).astype("u1")
    for one in wgmb.blur_pictures([still] * 5, device=device):
        np.testing.assert_array_equal(one, still)
    assert not searched
    other = still.copy()
    other[-1, -1, 2] += 1
    list(wgmb.blur_pictures([still, still, still, other, other, other], device=device))
    assert len(searched) == 2  # of the two pictures that differ from one beside them


def test_standing_beside_what_moves_changes_no_bit(device, monkeypatch):
    """A picture that moves is blurred as if those that stand beside it were searched."""
    moving = list(shot(24, 40, "textured"))
    pictures = [moving[0]] * 3 + moving[1:3] + [moving[3]] * 3
    got = list(wgmb.blur_pictures(pictures, device=device))
    monkeypatch.setattr(gpu_frames, "is_same", lambda *_: False)
    want = list(wgmb.blur_pictures(pictures, device=device))
    for n in (2, 3, 4, 5):
        np.testing.assert_array_equal(got[n], want[n])
    np.testing.assert_array_equal(got[1], pictures[1])


def test_auto_alone_is_made_better_by_place(device):
    run = VideoRequest().open(device)
    assert run.at_edges is not None and "in blocks" in run.how
    for flow in ("dis", "search", "none"):
        assert VideoRequest(video=VideoSettings(flow=flow)).open(device).at_edges is None
    if run.blur.device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return
    assert run.blur.method.name == "tap" and run.at_edges.method.name == "gather"
    assert run.quicker.startswith("`flow=dis`") and "`flow=search` is better" in run.advice
    assert VideoRequest(video=VideoSettings(flow="search")).open(device).advice == ""


@pytest.mark.parametrize("settings", [{"method": "tap"}, {"method": "gather"}, {"samples": 1000}])
def test_a_method_that_is_asked_for_blurs_all_pictures(device, settings):
    run = VideoRequest(blur=BlurSettings(**settings)).open(device)
    assert run.at_edges is None
    if run.blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE:
        assert isinstance(run.motion, ByPlace)


@pytest.mark.parametrize("quality", ["best", "fast", "draft"])
def test_a_search_is_one_in_the_quality_that_is_asked_for(device, quality):
    motion, how = VideoSettings(flow="search", flow_quality=quality).source(device)
    assert type(motion) is Flow and how == "search"
    size = 1920, 1080
    assert motion.reach(size) == Flow(quality=quality, device=device).reach(size)


def test_without_a_gpu_and_opencv_a_draft_is_searched(as_without_a_gpu, monkeypatch):
    monkeypatch.setattr("wgmb.settings.recipes.is_installed", lambda package: False)
    motion, how = VideoSettings().source(gpu.open_device())
    assert type(motion) is Flow and how == "search (draft, because there is no GPU)"
