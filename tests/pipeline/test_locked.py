"""Frames that cannot be written to: what is made of them is made once, and of the right one."""

import numpy as np
import pytest

import wgmb
from images import crossing
from wgmb import gpu
from wgmb.errors import InputError
from wgmb.gpu.textures import TexturePool

SIZE = (40, 60)


def shot(numbers, size=SIZE, **more):
    """Frames of a shape before a wall, none with neighbours."""
    made = {}
    for n in numbers:
        color, motion, depth = crossing(size, 0.2 * n)
        made[n] = wgmb.Frame(color, motion=motion, depth=depth, number=n, **more)
    return made


def with_neighbours(frames, n):
    return frames[n].between(frames.get(n - 1), frames.get(n + 1))


def locked(frames):
    return {n: frame.locked() for n, frame in frames.items()}


@pytest.mark.parametrize("method", ["gather", "reproject"])
@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (4, 3, 2, 1, 0), (0, 3, 1, 1, 4, 2)])
def test_a_sequence_is_what_every_frame_alone_would_be(method, order):
    frames = locked(shot(range(5)))
    blur = wgmb.Blur(method, samples=4)
    for n in order:
        alone = wgmb.Blur(method, samples=4)(with_neighbours(frames, n))
        np.testing.assert_array_equal(blur(with_neighbours(frames, n)), alone)


def test_nothing_is_left_of_another_size_mask_or_shutter():
    frames, small = locked(shot(range(3))), locked(shot(range(3), (24, 32)))
    masked = dict(frames)
    holdout = np.zeros(SIZE, "f4")
    holdout[10:20, 10:30] = 1
    masked[2] = shot([2], holdout=holdout)[2].locked()
    blur = wgmb.Blur("gather", samples=4)
    for clip, degrees in ((frames, 180), (small, 180), (frames, 360), (masked, 360), (frames, 90)):
        blur.shutter = degrees
        alone = wgmb.Blur("gather", samples=4, shutter=degrees)(with_neighbours(clip, 1))
        np.testing.assert_array_equal(blur(with_neighbours(clip, 1)), alone)


def test_a_frame_may_be_its_own_neighbour():
    frame = shot([0])[0].locked()
    blur = wgmb.Blur("gather", samples=4)
    first = blur(frame.between(frame, frame))
    np.testing.assert_array_equal(blur(frame.between(frame, frame)), first)
    alone = shot([0])[0]
    np.testing.assert_array_equal(blur(alone.between(alone, alone)), first)


def test_confidence_comes_with_it():
    frames = locked(shot(range(4)))
    blur = wgmb.Blur("gather", samples=4)
    for n in (1, 2):
        got, told = blur.with_confidence(with_neighbours(frames, n))
        want, tells = wgmb.Blur("gather", samples=4).with_confidence(with_neighbours(frames, n))
        np.testing.assert_array_equal(got, want)
        for name, plane in tells.items():
            np.testing.assert_array_equal(told[name], plane)


def work(blur, frames, monkeypatch):
    """Uploaded arrays and passes of every frame in turn."""
    counts = []
    upload, run = TexturePool.upload, gpu.Kernel.run

    def uploaded(self, name, image, format):
        counts[-1]["uploads"] += 1
        return upload(self, name, image, format)

    def ran(self, encoder, entry, *given, **own):
        counts[-1]["splits"] += entry == "write_single_layer"
        return run(self, encoder, entry, *given, **own)

    monkeypatch.setattr(TexturePool, "upload", uploaded)
    monkeypatch.setattr(gpu.Kernel, "run", ran)
    monkeypatch.setattr(blur.method, "repeats", lambda inputs: False)  # passes are not played
    for n in range(1, 5):
        counts.append({"uploads": 0, "splits": 0})
        blur(with_neighbours(frames, n))
    monkeypatch.undo()
    return counts


def test_what_cannot_change_is_uploaded_once(monkeypatch):
    frames = shot(range(6))
    blur = wgmb.Blur("gather", samples=4, shading="off")
    thrice = work(blur, frames, monkeypatch)
    assert all(count == {"uploads": 9, "splits": 3} for count in thrice)
    first, *others = work(blur, locked(frames), monkeypatch)
    assert first == {"uploads": 9, "splits": 3}
    assert all(count == {"uploads": 3, "splits": 3} for count in others)


def test_uploaded_views_are_worked_on_every_time(monkeypatch):
    """Whoever times a method encodes the same views again and again."""
    frames, splits = locked(shot(range(3))), []
    blur = wgmb.Blur("gather", samples=4)
    views = blur.upload(with_neighbours(frames, 1))
    output = TexturePool(blur.device).view("out", SIZE[::-1], "rgba32float")
    run = gpu.Kernel.run

    def ran(self, encoder, entry, *given, **own):
        splits.append(entry == "write_single_layer")
        return run(self, encoder, entry, *given, **own)

    monkeypatch.setattr(gpu.Kernel, "run", ran)
    monkeypatch.setattr(blur.method, "repeats", lambda inputs: False)  # passes are not played
    for _ in range(2):
        encoder = blur.device.create_command_encoder()
        blur.encode(encoder, output=output, **views)
        gpu.submit(blur.device, encoder)
    assert sum(splits) == 6


def test_what_can_change_is_looked_at_again():
    frames = shot(range(3))
    blur = wgmb.Blur("gather", samples=4)
    blur(with_neighbours(frames, 1))
    frames[1].color[:] *= 0.5
    alone = wgmb.Blur("gather", samples=4)(with_neighbours(frames, 1))
    np.testing.assert_array_equal(blur(with_neighbours(frames, 1)), alone)


def test_an_interrupted_frame_leaves_nothing_behind(monkeypatch):
    """Its passes were recorded, but never done."""
    frames = locked(shot(range(3)))
    blur = wgmb.Blur("gather", samples=4)

    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(TexturePool, "download_with", interrupted)
    with pytest.raises(KeyboardInterrupt):
        blur(with_neighbours(frames, 1))
    monkeypatch.undo()
    alone = wgmb.Blur("gather", samples=4)(with_neighbours(frames, 1))
    np.testing.assert_array_equal(blur(with_neighbours(frames, 1)), alone)


def test_motion_and_uploads_in_between_do_not_disturb():
    frames = locked(shot(range(3)))
    other = shot([7])[7]
    blur = wgmb.Blur("gather", samples=4)
    want = blur(with_neighbours(frames, 1))
    for disturb in (blur.motion, blur.upload):
        disturb(other)
        np.testing.assert_array_equal(blur(with_neighbours(frames, 1)), want)


def test_locked_arrays_are_the_same_ones_and_refuse():
    frame = shot([0])[0]
    kept = frame.locked()
    assert kept.is_locked and not frame.is_locked
    assert kept.color.base is frame.color
    with pytest.raises(ValueError):
        kept.color[:] = 0
    frame.color[:] = 0


def test_neighbours_of_another_size_are_refused():
    with pytest.raises(InputError, match="next must be"):
        shot([0])[0].between(None, shot([1], (24, 32))[1])
