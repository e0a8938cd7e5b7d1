"""Calls of wgpu for each picture of a video, as on a GPU: counts are the same on every adapter."""

import threading
from collections import Counter

import numpy as np
import pytest
import wgpu
from wgpu.backends.wgpu_native import _api

import make_clips as clips
import wgmb
from wgmb import gpu
from wgmb.flow import Flow, pyramid
from wgmb.lab.calls import KINDS, counted
from wgmb.lab.video_bench import flow_settings, synthetic_pictures
from wgmb.video.read.reader import VideoReader

SIZE = (96, 64)
TURN = 7  # pictures after which all rings of textures have had a turn
NUMBERED = {"groups": 4, "buffers": 2}  # of the frame's number, until it has had all its values
MOST = {
    "none": {"passes": 2, "submits": 2, "waits": 1, "encoders": 2},
    "auto": {"passes": 17, "submits": 2, "waits": 1, "encoders": 2} | NUMBERED,
    "search:fast": {"passes": 31, "submits": 17, "waits": 8, "encoders": 17, "groups": 60,
                    "buffers": 30, "views": 3},
}  # fmt: skip
"""At most, by flow; of kinds that are not named, none. Submits and encoders include wgpu's own of
each wait."""


def calls(device, flow, count, size=SIZE):
    """The calls of each picture."""
    run = wgmb.blur_pictures(
        synthetic_pictures(size, count), fps_in=24, shutter=180, device=device,
        holdout="none",  # displays take passes more
        **flow_settings(flow, device),
    )  # fmt: skip
    every = []
    for _ in range(count):
        with counted() as counts:
            next(run)
        every.append(dict(counts))
    return every


@pytest.mark.parametrize(
    "flow", ["none", "auto", pytest.param("search:fast", marks=pytest.mark.full)]
)
def test_a_picture_asks_for_no_more(device, as_with_a_gpu, flow):
    """Nothing is made once the rings had their turn, but for the numbers of the frames."""
    for counts in calls(device, flow, TURN + 6)[TURN:-2]:  # the last ones have no neighbours
        most = dict.fromkeys(KINDS, 0) | MOST[flow]
        over = {k: n for k, n in counts.items() if k != "dispatches" and n > most[k]}
        assert not over, counts


@pytest.mark.full
def test_nothing_is_made_once_all_numbers_of_frames_were_there(device, as_with_a_gpu):
    """There are 64 (NOISES of common/noise.wgsl), each with a buffer and groups of its own."""
    for counts in calls(device, "auto", 64 + 2 * TURN + 8, (48, 32))[64 + 2 * TURN : -2]:
        made = {kind: counts.get(kind, 0) for kind in ("groups", "buffers", "textures", "views")}
        assert not any(made.values()), counts


def test_a_picture_with_a_display_takes_one_submission_more(device, as_with_a_gpu):
    """Its mask is written after the commands of its motion."""
    shown = list(synthetic_pictures(SIZE, TURN + 8))
    for picture in shown:
        picture[4:20, 4:60], picture[8:16:2, 8:56] = 0, 255
    run = wgmb.blur_pictures(shown, fps_in=24, shutter=180, device=device)
    for number in range(TURN + 3):
        with counted() as calls:
            next(run)
        if number >= TURN:
            assert calls["submits"] <= 3, calls


def lumas(path):
    return [picture.planes[0].tobytes() for _, picture in VideoReader(path).pictures()]


def test_planes_come_down_while_the_next_picture_is_recorded(tmp_path, monkeypatch):
    """The thread that writes waits for them, in buffers that are there after a few pictures."""
    source, waits, staging = clips.write(tmp_path / "in.mkv", codec="ffv1"), Counter(), []
    settings = {"flow": "none", "codec": "ffv1", "speed": 0.5}
    wgmb.blur_video(source, tmp_path / "want.mkv", **settings)
    want = lumas(tmp_path / "want.mkv")
    wait, create = wgpu.GPUPromise.sync_wait, _api.GPUDevice.create_buffer

    def waited(promise):
        waits[threading.current_thread().name] += "buffer" in repr(promise)
        return wait(promise)

    def created(device, *args, **options):
        staging.extend([1] if options.get("label") == "planes" else [])
        return create(device, *args, **options)

    monkeypatch.setattr(gpu, "SOFTWARE", "no device")
    monkeypatch.setattr(wgpu.GPUPromise, "sync_wait", waited)
    monkeypatch.setattr(_api.GPUDevice, "create_buffer", created)
    wgmb.blur_video(source, tmp_path / "got.mkv", **settings)
    assert lumas(tmp_path / "got.mkv") == want
    assert +waits == {"write": len(want)}
    assert len(staging) <= 6 < len(want), "one for each picture that waits"


def searched(device, shown):
    """Motion and depth by search, and the calls of the last picture."""
    shot = Flow(quality="fast", device=device).shot(
        lambda n: shown[n] if 0 <= n < len(shown) else None
    )
    with counted():
        found = [shot(n) for n in range(2, 4)]
    with counted() as counts:
        shot.textures(4)
    return found, counts


def test_a_search_is_submitted_where_it_is_read(device, monkeypatch):
    """The same bits as pass by pass."""
    monkeypatch.setattr(pyramid, "COARSEST", 24)  # px: several levels in small pictures
    shown = [(p / 255.0).astype("f4") for p in synthetic_pictures((64, 40), 9)]
    want, alone = searched(device, shown)
    monkeypatch.setattr(gpu, "SOFTWARE", "no device")
    got, together = searched(device, shown)
    for pair, other in zip(got, want, strict=True):
        for one, its in zip(pair, other, strict=True):
            np.testing.assert_array_equal(one, its)
    assert together["waits"] == alone["waits"] <= 8
    assert together["submits"] <= 3 * together["waits"] + 2 < alone["submits"] / 2
    assert together["passes"] <= together["submits"] < together["dispatches"] / 4
