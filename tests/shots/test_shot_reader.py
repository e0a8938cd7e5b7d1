"""Pictures in time: shots, repeated pictures, what is kept; and exposures summed from cells."""

import numpy as np
import pytest

import make_frames as make
from wgmb import Blur, Frame, Shutter
from wgmb.color.coding import CodedPicture, Coding
from wgmb.color.srgb import linear
from wgmb.flow import Flow
from wgmb.gpu.textures import TexturePool
from wgmb.pipeline.exposure_sum import ExposureSum
from wgmb.shots import motion
from wgmb.shots.cuts import pictures_differ
from wgmb.shots.reader import Picture, ShotReader
from wgmb.video.gpu_frames import VideoFrames
from wgmb.video.thumbnail import Thumbnail, change

LINEAR = Coding(model="rgb", bits=16, steps=(1, 1), full_range=True, matrix=0, transfer=8)


class PictureFinding:
    """A source of motion that knows the frames of make_frames, and who was asked for."""

    def __init__(self):
        self.shots = 0
        self.seen: dict[int, list[int]] = {}

    def reach(self, size):
        return 4

    def shot(self, load, depth=True):
        self.shots += 1

        def found(number):
            near = [n for n in range(number - 4, number + 5) if load(n) is not None]
            self.seen[number] = near
            to_prev, to_next = make.motion(0)
            flat = np.ones((make.HEIGHT, make.WIDTH), "f4")
            if len(near) == 1:
                return None
            return np.concatenate([to_prev, to_next], axis=2), flat

        return found


def coded(picture):
    """A picture in linear light as planes of 16 bits."""
    planes = np.rint(np.clip(picture, 0, 1) * 65535).astype(np.uint16)
    return Thumbnail(
        CodedPicture(tuple(np.ascontiguousarray(planes[..., i]) for i in range(3)), LINEAR)
    )


def pictures(count, fps=240.0, times=None):
    for n in range(count):
        yield Picture(n / fps if times is None else times[n], coded(make.picture(n % 12)), n)


class VideoExposure:
    """Exposures of a shots as arrays."""

    def __init__(self, shots, blur, motion=None):
        self.shots, self.views, self._blur = shots, VideoFrames(shots, blur, motion), blur
        self._exposer = ExposureSum(blur.device)
        self._images = TexturePool(blur.device)

    def __call__(self, at, interval, shutter):
        cells = self.shots.cells(at, interval, shutter)
        size = self.shots[cells[0].index].content.coded.size
        parts = ((cell, self.views.in_shot(cell.index), self._blur) for cell in cells)
        texture = self._exposer.texture(size, parts)
        return self.array(texture)[..., :3]

    def array(self, texture):
        encoder = self._images.device.create_command_encoder()
        return self._images.download(encoder, texture)

    def motion(self, index):
        return self.array(self.views.in_shot(index).frame.motion.texture)


def linear_average(at, interval, degrees, fps=240.0, count=40):
    """The exposure of frames that are shown as they are, by their cells."""
    edges = (np.arange(count) + 0.5) / fps
    opens, closes = at - interval * degrees / 720, at + interval * degrees / 720
    begins = np.concatenate([[-0.5 / fps], edges[:-1]])
    part = np.clip(np.minimum(edges, closes) - np.maximum(begins, opens), 0, None)
    total = sum(
        w * np.clip(make.picture(n % 12)[..., :3], 0, 1) for n, w in enumerate(part) if w > 0
    )
    return total / part.sum()


@pytest.mark.parametrize("degrees", [90, 180, 360, 720])
def test_without_motion_an_exposure_is_the_average_of_its_cells(degrees):
    exposed = VideoExposure(ShotReader(pictures(40)), Blur("tap"))
    for k in range(6):
        got = exposed(k / 60, 1 / 60, Shutter(degrees))
        np.testing.assert_allclose(got, linear_average(k / 60, 1 / 60, degrees), atol=6e-4)


def test_with_motion_it_is_the_sum_of_blurs_over_the_cells():
    motion, blur = PictureFinding(), Blur("gather", samples=8)
    got = VideoExposure(ShotReader(pictures(20)), blur, motion)(8 / 240, 1 / 60, Shutter(180))
    to_prev, to_next = make.motion(0)
    want, flat = 0.0, np.ones((make.HEIGHT, make.WIDTH), "f4")
    for n, opens, closes in ((7, 0.0, 0.5), (8, -0.5, 0.5), (9, -0.5, 0.0)):
        near = [
            Frame(
                np.clip(make.picture(m)[..., :3], 0, 1).astype("f2"),
                to_next,
                to_prev=to_prev,
                depth=flat,
                number=m,
            )
            for m in (n - 1, n, n + 1)
        ]
        shutter = Shutter(360 * (closes - opens), (opens + closes) / 2)
        part = Blur("gather", samples=8, shutter=shutter)(near[1].between(near[0], near[2]))
        want = want + (closes - opens) / 2 * part
    np.testing.assert_allclose(got, want, atol=2e-3)


def test_exposures_that_overlap_and_reach_back_are_the_same_as_alone():
    """Pictures kept on the GPU for the frame before do no harm."""
    blur, shutter = Blur("gather", samples=4), Shutter(720)
    after = VideoExposure(ShotReader(pictures(24)), blur, PictureFinding())
    for k in range(3):
        got = after(k / 60, 1 / 60, shutter)
    alone = VideoExposure(ShotReader(pictures(24)), blur, PictureFinding())(2 / 60, 1 / 60, shutter)
    np.testing.assert_array_equal(got, alone)


def test_motion_that_stays_on_the_gpu_is_that_of_arrays():
    blur = Blur("tap")
    flow = Flow(quality="fast", device=blur.device)
    times = [0.0, 0.1, 0.2, 0.5, 0.6, 0.7, 0.8, 0.9]
    exposed = VideoExposure(ShotReader(pictures(8, times=times)), blur, flow)
    exposed.shots.cells(0.2, 0.1, Shutter(180))
    light = [np.clip(make.picture(n)[..., :3], 0, 1).astype("f2").astype("f4") for n in range(8)]
    want, _ = flow.shot(lambda n: light[n] if 0 <= n < 8 else None)(2)
    even = np.array([2, 2, 2 / 3, 2 / 3], "f4")  # its own interval is 0.2 s, those around 0.1, 0.3
    off = np.abs(exposed.motion(2) - want * even)
    assert np.median(off) < 0.05 and (off < 0.5).mean() > 0.9


def test_the_motion_of_neighbours_has_all_pictures_that_it_depends_on(monkeypatch):
    """Else it took a picture for the last of its shot, and another time not."""
    count, width, missing, made = 24, 320, set(), Flow.shot

    def watched(flow, load, depth=True):
        def loaded(number):
            picture = load(number)
            if picture is None and 0 <= number < count:
                missing.add(number)
            return picture

        return made(flow, loaded, depth)

    monkeypatch.setattr(Flow, "shot", watched)
    monkeypatch.setattr(motion, "REACH", 1)
    blur = Blur("gather")
    flow = Flow(device=blur.device)
    noise = np.random.default_rng(1).random((16, width + 2 * count, 3))
    read = (Picture(float(n), coded(noise[:, 2 * n : 2 * n + width]), n) for n in range(count))
    shots = ShotReader(read, reach=motion.window((width, 16), flow))
    frames = VideoFrames(shots, blur, flow)
    for number in (11, 12):
        shots.cells(number, 1.0, Shutter(180))
        frames.in_shot(number)
    assert not missing


def test_a_cut_ends_exposures_and_motion():
    motion = PictureFinding()
    first = {coded(make.picture(n)).sampled.tobytes() for n in range(10)}

    def is_cut(before, after):
        return before.sampled.tobytes() in first and after.sampled.tobytes() not in first

    shots = ShotReader(pictures(12), is_cut=is_cut)  # later ones would be the first again
    exposed = VideoExposure(shots, Blur("gather"), motion)
    cells = exposed.shots.cells(9 / 240, 1 / 60, Shutter(360))
    assert max(cell.index for cell in cells) <= 9 and exposed.shots.cuts == [10]
    exposed(9 / 240, 1 / 60, Shutter(360))
    exposed(11 / 240, 1 / 60, Shutter(360))
    assert motion.shots == 2
    assert all(max(near) <= 9 for n, near in motion.seen.items() if n <= 9)
    assert all(min(near) >= 10 for n, near in motion.seen.items() if n >= 10)


def with_flash(count, flashes, fps):
    for picture in pictures(count, fps):
        if picture.number in flashes:
            picture = Picture(picture.time, coded(np.ones_like(make.picture(0))), picture.number)
        yield picture


def is_bright(content):
    return content.coded.planes[0].min() > 60000


def brightens(before, after):
    """A test for cuts that sees flashes alone."""
    return is_bright(before) != is_bright(after)


@pytest.mark.parametrize(
    ("fps", "flashes", "cuts"),
    [(240, [8], []), (12, [8], []), (240, [8, 9, 10], []), (240, [8, 11], []),
     (24, [8, 9], [8, 10]), (240, range(8, 20), [8, 20]), (240, range(8, 40), [8])],
    ids=["one", "one of a slow video", "three", "two", "too long for a flash", "a short shot",
         "up to the end"],
)  # fmt: skip
def test_a_flash_is_no_shot(fps, flashes, cuts):
    shots = ShotReader(with_flash(40, flashes, fps), is_cut=brightens)
    for k in range(30):
        shots.cells(k / fps, 1 / fps, Shutter(180))
    assert shots.cuts == cuts
    assert bool(shots.flashes) == (not cuts)


def test_a_flash_is_exposed_by_its_share_and_has_no_part_in_motion():
    motion, shutter = PictureFinding(), Shutter(360)
    shots = ShotReader(with_flash(24, [8], 240), is_cut=brightens)
    exposed = VideoExposure(shots, Blur("gather", samples=8), motion)
    without = VideoExposure(ShotReader(pictures(24)), Blur("gather", samples=8), PictureFinding())
    found = [(exposed(k / 60, 1 / 60, shutter), without(k / 60, 1 / 60, shutter)) for k in range(5)]
    sharp = np.clip(make.picture(8)[..., :3], 0, 1)
    for k, (got, want) in enumerate(found):
        share = {2: 0.25}.get(k, 0)
        still = np.s_[:4, :4]  # nothing moves there
        np.testing.assert_allclose(got[still], (want + share * (1 - sharp))[still], atol=2e-3)
    assert motion.seen[8] == [8]
    assert all(max(near) <= 7 for n, near in motion.seen.items() if n <= 7)
    assert all(min(near) >= 9 for n, near in motion.seen.items() if n >= 9)


def test_motion_beside_a_flash_goes_on_as_on_the_other_side():
    times = [0.0, 0.1, 0.2, 0.5, 0.6, 0.9, 1.0, 1.1, 1.2, 1.3]
    many = [
        Picture(t, p.content, p.number) for t, p in zip(times, with_flash(10, [3], 1), strict=True)
    ]
    exposed = VideoExposure(ShotReader(iter(many), is_cut=brightens), Blur("tap"), PictureFinding())
    exposed.shots.cells(0.2, 0.1, Shutter(180))
    to_prev, to_next = make.motion(0)
    motion = exposed.motion(2)  # its own interval is 0.2 s, and it moved for 0.1 s
    np.testing.assert_allclose(motion[..., :2], 2 * to_prev)
    np.testing.assert_allclose(motion[..., 2:], 2 * to_next)


def test_a_repeated_picture_is_left_out_and_its_neighbours_reach_over_it():
    def doubled():
        for n in range(12):
            yield Picture(n / 60, coded(make.picture(n // 2)), n)

    shots = ShotReader(doubled(), change=change)
    cell, *_ = shots.cells(2 / 60, 1 / 60, Shutter(180))
    assert shots[cell.index].number == 2 and shots.doubles[:3] == [1, 3, 5]
    assert cell.shutter.span == pytest.approx((-0.125, 0.125))  # its own interval is twice as long


def test_uneven_times_stretch_the_motion():
    times = [0.0, 0.1, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1]
    exposed = VideoExposure(ShotReader(pictures(10, times=times)), Blur("tap"), PictureFinding())
    (cell,) = exposed.shots.cells(0.1, 0.05, Shutter(180))
    motion = exposed.motion(cell.index)
    to_prev, to_next = make.motion(0)
    np.testing.assert_allclose(motion[..., :2], 2 * to_prev)
    np.testing.assert_allclose(motion[..., 2:], 2 / 3 * to_next, rtol=1e-6)


def test_however_long_the_reel_only_what_is_around_is_kept():
    content = coded(make.picture(0))
    shots = ShotReader(Picture(n / 240, content, n) for n in range(400))
    most = 0
    for k in range(90):
        shots.cells(k / 60, 1 / 60, Shutter(360))
        most = max(most, len(shots._kept))
    assert most <= 26


def test_unrelated_pictures_differ_and_moving_ones_do_not():
    y, x = np.mgrid[:270, :480].astype(np.float32)
    a, b = (make.texture(x / 20, y / 20, seed) ** 2 for seed in (0.0, 7.0))
    b = b[:, ::-1] * [0.3, 1, 0.2]
    moved = make.texture((x - 60) / 20, (y + 20) / 20, 0.0) ** 2
    assert pictures_differ(a, b) and not pictures_differ(a, moved) and not pictures_differ(a, a)
    assert pictures_differ(a, np.zeros_like(a)) and pictures_differ(a, a[:100])


def test_a_fade_is_no_cut_and_a_flash_is_one():
    """Display values of the second picture, which has moved on, fade to black and to white."""
    a, other = np.random.default_rng(0).uniform(0.2, 0.7, (2, 9, 16, 3)).repeat(30, 1).repeat(30, 2)
    moved = np.roll(a, (10, 15), (0, 1))
    for share in (0.8, 0.9, 0.95):
        for light in (0, 1):
            faded = share * moved + (1 - share) * light
            assert not pictures_differ(linear(a), linear(faded))
            assert not pictures_differ(linear(faded), linear(a))
        assert pictures_differ(linear(a), linear(share * other))
    assert pictures_differ(linear(a), linear(0.6 * moved + 0.4))


@pytest.mark.parametrize("bits", [8, 10])
def test_a_glance_at_planes_is_one_at_the_picture(bits):
    """Small copies and samples of Y'CbCr are those of the display values they came from."""
    unit = 2 ** (bits - 8)
    y, x = np.mgrid[:270, :484].astype("f4")
    tone = make.texture(x / 40, y / 40, 1.0)
    luma = np.rint((16 + 219 * tone.mean(axis=2)) * unit).astype("u1" if bits == 8 else "u2")
    flat = np.full((135, 242), 128 * unit, luma.dtype)
    seen = Thumbnail(CodedPicture((luma, flat, flat), Coding(bits=bits)))
    shown = (luma / unit - 16) / 219
    step = 484 // 96
    want = shown[: 270 // step * step, : 484 // step * step]
    want = want.reshape(270 // step, step, -1, step).mean(axis=(1, 3))
    assert seen.small.shape == (*want.shape, 3)
    assert np.abs(seen.small - want[..., None]).max() < 0.03
    np.testing.assert_allclose(seen.sampled[..., 1], shown, atol=1e-5)
    assert np.abs(seen.grey - 255 * shown).max() < 0.51
