"""`resume` of videos: done is only what is whole and was made of the same things."""

import os
import shutil

import av
import pytest
from test_strangers_videos import write

from wgmb import InputError, blur_video
from wgmb.io import record
from wgmb.video.read.reader import VideoReader

TIMES = [42 * n for n in range(8)]
VIDEOS = [".mp4", ".mov", ".mkv", ".webm", ".gif"]
PLAIN = {"flow": "none", "resume": True}


@pytest.fixture
def clip(tmp_path):
    return write(tmp_path / "in.mkv", TIMES)


def mask(path, value):
    with av.open(str(path), "w", format="image2") as file:
        stream = file.add_stream("png", rate=1)
        stream.width, stream.height, stream.pix_fmt = 32, 32, "gray"
        frame = av.VideoFrame(32, 32, "gray")
        frame.planes[0].update(bytes([value]) * frame.planes[0].buffer_size)
        file.mux(stream.encode(frame))
        file.mux(stream.encode(None))


@pytest.mark.parametrize("suffix", VIDEOS)
def test_a_whole_video_is_done_in_every_container(clip, tmp_path, suffix):
    to = tmp_path / f"o{suffix}"
    assert blur_video(clip, to, fps=20, **PLAIN).is_new
    before = to.read_bytes(), os.stat(to).st_mtime_ns
    assert not blur_video(clip, to, fps=20, **PLAIN).is_new
    assert (to.read_bytes(), os.stat(to).st_mtime_ns) == before
    assert len(VideoReader(to)) > 1
    with av.open(str(to)) as file:
        assert sum(1 for _ in file.decode(video=0)) > 1


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("suffix", VIDEOS)
def test_two_runs_make_the_same_bytes(clip, tmp_path, suffix, resume):
    made = [tmp_path / f"{n}{suffix}" for n in range(2)]
    for to in made:
        blur_video(clip, to, flow="none", resume=resume, fps=20)
    assert made[0].read_bytes() == made[1].read_bytes()


@pytest.mark.parametrize("resume", [False, True])
def test_every_container_tells_a_changed_bit(clip, tmp_path, resume):
    for suffix in VIDEOS:
        to = tmp_path / f"o{suffix}"
        blur_video(clip, to, flow="none", resume=resume, fps=20)
        content, whole = record.read_file(to)
        assert whole
        assert content["flow"] == "none"
        data = bytearray(to.read_bytes())
        for at in range(0, len(data), max(len(data) // 40, 1)):
            data[at] ^= 4
            to.write_bytes(data)
            assert not record.read_file(to)[1]
            data[at] ^= 4
        to.write_bytes(data[:-7])
        assert not record.read_file(to)[1]


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".gif"])
def test_a_damaged_video_is_made_again(clip, tmp_path, suffix):
    to = tmp_path / f"o{suffix}"
    blur_video(clip, to, fps=20, **PLAIN)
    whole = to.read_bytes()
    begin = whole.find(b'{"seal": "')
    at = begin - 100 if begin > 600 else len(whole) - 100
    to.write_bytes(whole[:at] + bytes(b ^ 255 for b in whole[at : at + 9]) + whole[at + 9 :])
    assert blur_video(clip, to, fps=20, **PLAIN).is_new
    assert record.read_file(to)[1]


def test_a_cut_off_video_names_overwrite(clip, tmp_path):
    to = tmp_path / "o.mp4"
    blur_video(clip, to, **PLAIN)
    to.write_bytes(to.read_bytes()[: to.stat().st_size // 2])
    with pytest.raises(
        InputError, match=r"exists and holds no record .* cut off.*; `overwrite=True`"
    ):
        blur_video(clip, to, **PLAIN)
    assert blur_video(clip, to, overwrite=True, **PLAIN).is_new


OTHER = {
    "rate": {"fps": 12},
    "range": {"end": 0.2},
    "cuts": {"cuts": "3"},
    "speed": {"speed": 0.5},
    "shutter": {"shutter": 90},
    "begin": {"begin": 0.1},
}


@pytest.mark.parametrize("other", OTHER)
def test_another_setting_is_no_finished_video(clip, tmp_path, other):
    to = tmp_path / "o.mkv"
    blur_video(clip, to, **PLAIN)
    with pytest.raises(InputError, match="was made otherwise"):
        blur_video(clip, to, **PLAIN | OTHER[other])


@pytest.mark.parametrize("to", ["o.mp4", "o.####.png"])
def test_a_changed_mask_is_seen(clip, tmp_path, to):
    mask(tmp_path / "m.png", 0)
    settings = {"flow": "dis", "holdout": str(tmp_path / "m.png"), "resume": True, "fps": 24}
    assert blur_video(clip, tmp_path / to, **settings).is_new
    assert "is already done" in blur_video(clip, tmp_path / to, **settings).left_out or (
        not blur_video(clip, tmp_path / to, **settings).is_new
    )
    mask(tmp_path / "m.png", 255)
    if to.endswith("png"):
        assert blur_video(clip, tmp_path / to, **settings).is_new
    else:
        with pytest.raises(InputError, match="was made otherwise"):
            blur_video(clip, tmp_path / to, **settings)


def stamps(folder):
    return {p.name: p.stat().st_mtime_ns for p in folder.glob("o.*.png")}


@pytest.mark.parametrize("other", ["input", "another name", *OTHER])
def test_frames_are_kept_only_where_all_is_the_same(clip, tmp_path, other):
    to, fresh = tmp_path / "a/o.####.png", tmp_path / "b/o.####.png"
    settings = PLAIN | {"fps": 24}
    assert blur_video(clip, to, **settings).is_new
    before = stamps(tmp_path / "a")
    assert "is already done" in blur_video(clip, to, **settings).left_out
    assert stamps(tmp_path / "a") == before
    more = OTHER.get(other, {})
    if other == "input":
        write(clip, [42 * n for n in range(1, 9)], (32, 32), "yuv444p")
    if other == "another name":
        clip = shutil.copy(clip, tmp_path / "other.mkv")
    assert blur_video(clip, to, **settings | more).is_new
    blur_video(clip, fresh, **settings | more)
    for path in (tmp_path / "b").iterdir():
        assert (tmp_path / "a" / path.name).read_bytes() == path.read_bytes()
    assert all(before.get(name) != now for name, now in stamps(tmp_path / "b").items())


def test_frames_that_lack_are_made_and_the_others_stay(clip, tmp_path):
    to, settings = tmp_path / "o.####.png", PLAIN | {"fps": 24}
    blur_video(clip, to, **settings)
    before, whole = stamps(tmp_path), (tmp_path / "o.0003.png").read_bytes()
    (tmp_path / "o.0003.png").unlink()
    (tmp_path / "o.0005.png").write_bytes(whole[:-9])
    found = blur_video(clip, to, **settings)
    assert found.left_out == [f"{len(before) - 2} of {len(before)} frames were done before"]
    changed = {name for name, now in stamps(tmp_path).items() if now != before[name]}
    assert changed == {"o.0003.png", "o.0005.png"}
    assert (tmp_path / "o.0003.png").read_bytes() == whole


@pytest.mark.parametrize("how", ["resume", "overwrite"])
def test_frames_of_a_longer_run_are_named_and_stay(clip, tmp_path, how):
    to, settings = tmp_path / "o.####.png", {"flow": "none", "fps": 24}
    assert blur_video(clip, to, **settings).left_out == []
    whole = set(stamps(tmp_path))
    said = blur_video(clip, to, **settings, end=0.1, **{how: True}).left_out
    assert f"frames 4-{len(whole)} of a longer run remain" in said
    assert set(stamps(tmp_path)) == whole
    again = blur_video(clip, to, **settings, end=0.1, resume=True).left_out
    assert again == ["is already done", said[-1]]
