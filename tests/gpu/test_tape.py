"""Frames whose commands are played again: the same bits, nothing made, nothing kept too long."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

import wgmb
from wgmb import Blur, DeviceError, Shutter, gpu
from wgmb.gpu.textures import TexturePool
from wgmb.lab.calls import counted

SIZE = (50, 34)  # width, height
METHODS = {
    "tap": {}, "tiles": {}, "fusion": {}, "reproject": {}, "gather": {},
    "still": {"shading": "off"},
    "far": {"reach": 2}, "jittered": {"jitter": 1.0}, "edges": {"where": "edges"},
    "published": {"variant": "published"},
}  # fmt: skip
NAMES = {"still": "gather", "far": "gather", "jittered": "gather", "edges": "gather",
         "published": "reproject"}  # fmt: skip


def frame(number=0, size=SIZE, seed=0):
    """Noise; a part of it moves."""
    rng = np.random.default_rng((seed, number + 8))
    motion = np.zeros((size[1], size[0], 4), "f4")
    motion[:, : size[0] // 2] = (-5, 1, 5, -1)
    depth = np.where(motion[..., 0] < 0, 3, 7).astype("f4")
    color = rng.random((size[1], size[0], 4), np.float32)
    return wgmb.Frame(color, motion=motion, depth=depth, number=number)


def between(**how):
    """A frame between two neighbours."""
    return frame(**how).between(frame(-1, **how), frame(1, **how)).locked()


class Encoded:
    """A Blur, textures of a frame, and their picture by `encode`."""

    def __init__(self, kind, **settings):
        options = METHODS[kind] | settings
        self.blur = Blur(NAMES.get(kind, kind), samples=5, **options)
        self.images = TexturePool(self.blur.device)
        self.output = self.images.view("output", SIZE, self.blur.output)
        self.views = self.blur.upload(between())

    def __call__(self, *, taped=True, **changed):
        blank = np.full((SIZE[1], SIZE[0], 4), 9, "f4")
        self.images.upload("output", blank, self.blur.output)
        encoder = self.blur.device.create_command_encoder()
        with pytest.MonkeyPatch.context() as patch:
            if not taped:
                patch.setattr(self.blur.method, "repeats", lambda inputs: False)
            self.blur.encode(encoder, output=self.output, **self.views | changed)
        return self.images.download(encoder, self.output.texture).copy()


@pytest.mark.parametrize("kind", METHODS)
def test_played_commands_give_the_same_bits(kind):
    encoded = Encoded(kind)
    want = [encoded(taped=False, number=n) for n in (3, 4)]
    for number in (3, 4, 3):
        np.testing.assert_array_equal(encoded(number=number), want[number - 3])
    assert len(encoded.blur._tapes) == (kind != "published")
    assert (kind != "jittered") == np.array_equal(*want)


def test_masks_are_put_back_by_played_commands():
    mask = np.zeros(SIZE[::-1], "f4")
    mask[:, 20:30] = 1
    blur, fresh = Blur("gather", samples=4), Blur("gather", samples=4)
    one = replace(between(), holdout=mask)
    want = fresh(one)
    for _ in range(3):
        np.testing.assert_array_equal(blur(one), want)


def test_a_tape_ends_with_what_it_depends_on():
    """Other textures, another shutter, size or set of inputs: each gives what a new Blur gives."""
    blur = Blur("gather", samples=4)
    cases = [
        (180, between()), (90, between()), (180, between(seed=1)), (180, frame()),
        (Shutter(180, curve="triangle"), between()), (180, between(size=(40, 30))),
        (Shutter(180, "start"), between()), (180, between(size=(64, 48))), (180, between()),
    ]  # fmt: skip
    wants = [Blur("gather", shutter=shutter, samples=4)(one) for shutter, one in cases]
    for (shutter, one), want in 2 * list(zip(cases, wants, strict=True)):
        blur.shutter = shutter
        np.testing.assert_array_equal(blur(one), want)
    assert len(blur._tapes) <= 8


@pytest.mark.parametrize(("kind", "most"), [("tap", 1), ("tiles", 1), ("reproject", 3),
                                            ("still", 15), ("gather", 50)])  # fmt: skip
def test_an_encoded_frame_makes_nothing_and_few_passes(kind, most):
    encoded = Encoded(kind)
    for n in range(3):
        encoded(number=n)
    encoder = encoded.blur.device.create_command_encoder()
    with counted() as counts:
        encoded.blur.encode(encoder, output=encoded.output, **encoded.views)
    made = {name: counts[name] for name in ("groups", "buffers", "textures", "views", "submits")}
    assert not any(made.values()), made
    assert 0 < counts["passes"] <= most


def test_a_sequence_of_calls_makes_nothing():
    """Frames of a sequence take the same textures in turns."""
    blur = Blur("gather", samples=4)
    every = [replace(frame(n), number=n % 3).locked() for n in range(12)]
    for n in range(1, 11):
        one = every[n].between(every[n - 1], every[n + 1])
        with counted() as counts:
            blur(one)
        if n > 7:
            made = {name: counts[name] for name in ("groups", "buffers", "textures", "views")}
            assert not any(made.values()), made
            assert counts["waits"] == 1


def test_noise_repeats_after_64_frames():
    """So that the bindings of every number are known after them."""
    blur = Blur("tap", samples=2, jitter=1)
    a, b, other = (blur(replace(between(), number=n)) for n in (3, 67, 4))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, other)


def test_played_commands_know_the_frames_of_now():
    """Textures keep their names and get other pixels."""
    blur = Blur("tiles", samples=4)
    for n in range(4):
        np.testing.assert_array_equal(blur(frame(n)), Blur("tiles", samples=4)(frame(n)))


def test_tapes_keep_no_texture_of_a_caller():
    encoded = Encoded("gather")
    encoded()
    texture = weakref.ref(encoded.views["frame"].color.texture)
    assert len(encoded.blur._tapes) == 1
    encoded.views.clear()
    blur, encoded = encoded.blur, None
    blur._residency._images._textures.clear()
    blur._residency._images._views.clear()
    gc.collect()
    assert texture() is None
    assert len(blur._tapes) == 0


def test_tapes_of_many_textures_are_bounded():
    encoded = Encoded("tap")
    outputs = [encoded.images.view(f"output {n}", SIZE, encoded.blur.output) for n in range(80)]
    for output in outputs:
        encoder = encoded.blur.device.create_command_encoder()
        encoded.blur.encode(encoder, output=output, **encoded.views)
    assert 1 < len(encoded.blur._tapes) < 40


def test_passes_that_are_timed_are_recorded_each_by_itself():
    from wgmb.gpu import timing

    encoded = Encoded("tiles")
    encoded()
    clock = timing.clock(encoded.blur.device)
    encoder = encoded.blur.device.create_command_encoder()
    encoded.blur.encode(encoder, output=encoded.output, timing=clock, **encoded.views)
    gpu.submit(encoded.blur.device, encoder)
    assert len(clock.read()) == 5


def test_a_lost_device_is_named():
    device = gpu.second_device(gpu.open_device())
    blur = Blur("gather", samples=4, device=device)
    one = between()
    blur(one)
    blur(one)
    device.destroy()
    with pytest.raises(DeviceError):
        blur(one)
