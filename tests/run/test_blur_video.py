"""`wgmb blur` of videos, and of pictures without vectors: times, shares, motion, files."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from fractions import Fraction

import av
import numpy as np
import pytest
from PIL import Image

import make_clips as clips
import make_frames as make
from wgmb import InputError, gpu
from wgmb.cli import app
from wgmb.cli.commands.blur_video import tell_how
from wgmb.cli.console import Console
from wgmb.color.srgb import linear, srgb, to_display
from wgmb.extras import install_command
from wgmb.run import video_output
from wgmb.run.video import VideoKeywords, VideoRequest, blur_video
from wgmb.settings import BlurSettings, InputSettings, OutputSettings, ShutterSettings
from wgmb.settings.video import FlowSettings, VideoSettings
from wgmb.video.read.reader import VideoReader

SIZE = 96, 64  # width, height


def run(capsys, *words, code=0):
    got = app.main([str(w) for w in words])
    text = capsys.readouterr().err
    assert got == code, text
    return text


def grey_frames(values, pixels="yuv420p"):
    """Frames of one grey each."""
    width, height = SIZE
    for value in values:
        planes = [np.full((height, width), value, np.uint8)]
        planes += [np.full((height // 2, width // 2), 128, np.uint8)] * 2
        yield clips.frame(planes, pixels)


def moving(count, speed=2.0, hud=False, turned=False):
    """A textured square that passes over a textured background, and perhaps a fixed sign.

    `turned`: the picture is upside down.
    """
    width, height = SIZE
    y, x = np.mgrid[:height, :width].astype(np.float32)
    for n in range(count):
        at = 12 + speed * n
        inside = (abs(x - at) < 12) & (abs(y - 32) < 14)
        tone = np.where(inside, make.texture(x - at, y, 5.0)[..., 1], make.texture(x, y)[..., 0])
        if hud:
            tone = np.where((x > 40) & (x < 56) & (y < 10), (x + y) % 2, tone + 0.2 * np.sin(n))
        luma = np.clip(16 + 219 * tone, 16, 235).round().astype(np.uint8)
        luma = luma[::-1] if turned else luma
        chroma = np.full((height // 2, width // 2), 128, np.uint8)
        yield clips.frame([luma, chroma, chroma], "yuv420p")


def write(path, frames, fps=240, **more):
    frames = list(frames)
    times = [Fraction(n, fps) for n in range(len(frames))]
    return clips.write(path, frames, more.pop("times", times), **more)


def lumas(path):
    return [picture.planes[0] for _, picture in VideoReader(path)]


def test_the_first_picture_of_a_shot_is_shown_where_the_file_rounds_its_time(tmp_path):
    """Matroska counts milliseconds: 1/24 s is 42, a third of one late."""
    source = clips.write(tmp_path / "a.mkv", codec="ffv1")
    blur_video(source, tmp_path / "b.mkv", codec="ffv1", flow="none", cuts="only:1,2,3,4,5,6")
    assert [p.tolist() for p in lumas(tmp_path / "b.mkv")] == [p.tolist() for p in lumas(source)]


@pytest.mark.parametrize(("pixels", "bits"), [("yuv420p", 8), ("yuv422p10le", 10)])
def test_a_still_video_comes_back_to_the_sample(tmp_path, capsys, pixels, bits):
    steps = (2, 2) if bits == 8 else (2, 1)
    planes = clips.planes(1, SIZE, steps, bits)
    source = write(tmp_path / "a.mkv", [clips.frame(planes, pixels)] * 8, 48, codec="ffv1",
                   pixels=pixels)  # fmt: skip
    for flow in ("none", "dis"):
        out = tmp_path / f"{flow}.mkv"
        run(capsys, "blur", source, "-o", out, "--codec", "ffv1", "--fps", 24, "--flow", flow, "-q")
        got = VideoReader(out)
        assert len(got) == 4 and got.coding.bits == bits
        for _, picture in got:
            for want, plane in zip(planes, picture.planes, strict=True):
                assert np.abs(plane.astype(int) - want).max() <= (0 if bits == 8 else 1)


@pytest.mark.parametrize("degrees", [180, 360])
def test_averages_are_of_light_by_exact_shares(tmp_path, capsys, degrees):
    values = [20, 200, 90, 235, 16, 120, 60, 180, 40, 220, 100, 30]
    source = write(tmp_path / "a.mp4", grey_frames(values))
    out = tmp_path / "b.mkv"
    run(capsys, "blur", source, "-o", out, "--fps", 60, "--shutter", degrees, "--flow", "none",
        "--cuts", "only:0", "--codec", "ffv1", "-q")  # fmt: skip
    light = linear((np.array(values) - 16) / np.float32(219))
    for k, got in enumerate(lumas(out)):
        middle, half = 4 * k, degrees / 180  # in input frames
        begins, ends = np.arange(12) - 0.5, np.arange(12) + 0.5
        share = np.clip(
            np.minimum(ends, middle + half) - np.maximum(begins, middle - half), 0, None
        )
        want = 16 + 219 * srgb((share * light).sum() / share.sum())
        assert abs(got.astype(float) - want).max() <= 0.51


@pytest.mark.parametrize(
    ("words", "times"),
    [
        (["--fps", "60"], [Fraction(k, 60) for k in range(6)]),
        (["--fps", "144"], [Fraction(k, 144) for k in range(15)]),
        ([], [Fraction(k, 240) for k in range(24)]),
        (["--fps", "60", "--speed", "0.5"], [Fraction(k, 60) for k in range(12)]),
        (["--fps", "60", "--begin", "0.05"], [Fraction(k, 60) for k in range(3)]),
        (["--fps", "60", "--frames", "4-11"], [Fraction(k, 60) for k in range(2)]),
        (["--fps", "60", "--end", "0:0:0.05"], [Fraction(k, 60) for k in range(3)]),
    ],
)
def test_output_frames_are_at_their_times(tmp_path, capsys, words, times):
    source = write(tmp_path / "a.mp4", grey_frames(range(20, 44)))
    out = tmp_path / "b.mp4"
    run(capsys, "blur", source, "-o", out, "--flow", "none", "-q", *words)
    got = VideoReader(out).times
    assert [t - got[0] for t in got] == times


def test_variable_rates_keep_their_times_or_become_even(tmp_path, capsys):
    times = [Fraction(n, 100) for n in (0, 1, 2, 7, 8, 12, 20, 21)]
    source = write(tmp_path / "a.mp4", grey_frames(range(30, 110, 10)), times=times)
    for fps, want in (("source", times), ("50", [Fraction(k, 50) for k in range(11)])):
        out = tmp_path / f"{fps}.mkv"
        run(capsys, "blur", source, "-o", out, "--fps", fps, "--flow", "none", "-q")
        got = [round(float(t) * 1000) for t in VideoReader(out).times]
        assert got == [round(float(t) * 1000) for t in want][: len(got)]
        assert abs(len(got) - len(want)) <= 1


def test_without_a_rate_pictures_of_a_variable_one_keep_their_times_and_a_line_says_so(
    tmp_path, capsys
):
    times = [Fraction(n, 100) for n in (0, 1, 2, 7, 8, 12, 20, 21)]
    source = write(tmp_path / "a.mp4", grey_frames(range(30, 110, 10)), times=times)
    text = run(capsys, "blur", source, "-o", tmp_path / "b.mp4", "--flow", "none")
    said = "variable rate (10.0 to 80.0 ms)"
    assert f"a.mp4: {said}: each picture keeps its own time; --fps 60 sets a steady rate\n" in text
    assert list(VideoReader(tmp_path / "b.mp4").times) == times
    both = [source, source.rename(tmp_path / "c.mp4")][1:]
    text = run(capsys, "blur", *both, "-o", f"{tmp_path}/{{name}}.out.mkv", "--flow", "none")
    assert said in text
    text = run(capsys, "blur", *both, "-o", tmp_path / "d.##.png", "--flow", "none")
    assert f"{said}: {float(VideoReader(both[0]).rate):g} frames a second, as on average" in text
    run(capsys, "blur", *both, "-o", tmp_path / "e.##.png", "--flow", "none", "--fps", "source")
    assert len(list(tmp_path.glob("e.*.png"))) == 8


def test_a_pause_of_a_steady_rate_is_filled(tmp_path, capsys):
    times = [Fraction(n, 50) for n in (*range(40), *range(45, 85))]
    source = write(tmp_path / "a.mp4", grey_frames([*range(30, 110)]), times=times)
    text = run(capsys, "blur", source, "-o", tmp_path / "b.mp4", "--flow", "none")
    assert "variable" not in text and "pause once" in text
    assert list(VideoReader(tmp_path / "b.mp4").times) == [Fraction(n, 50) for n in range(85)]


def test_jitter_and_pulldown_are_made_even(tmp_path, capsys):
    times = [Fraction(n, 240) for n in (0, 8, 20, 28, 40, 48, 60, 68, 80)]  # 24 a second for 60
    source = write(tmp_path / "a.mp4", grey_frames(range(30, 120, 10)), times=times)
    text = run(capsys, "blur", source, "-o", tmp_path / "b.mp4", "--flow", "none")
    assert "variable rate (33.3 to 50.0 ms): 24 frames a second, as on average" in text
    assert list(VideoReader(tmp_path / "b.mp4").times) == [Fraction(n, 24) for n in range(9)]


def test_motion_smears_what_moves_and_leaves_the_rest_to_the_sample(tmp_path, capsys):
    source = write(tmp_path / "a.mp4", moving(9), 24)
    out = tmp_path / "b.mkv"
    text = run(capsys, "blur", source, "-o", out, "--flow", "dis", "--codec", "ffv1")
    assert "motion: dense inverse search" in text and "9 frames" in text
    sharp, soft = lumas(source), lumas(out)
    for n in range(2, 7):
        at = int(12 + 2 * n)
        assert np.abs(soft[n].astype(int) - sharp[n])[20:44, at - 8 : at + 8].mean() > 2
        assert np.abs(soft[n].astype(int) - sharp[n])[:, 64:].max() <= 1


def test_what_never_changes_while_all_around_does_stays_sharp(tmp_path, capsys):
    source = write(tmp_path / "a.mp4", moving(24, hud=True), 96)
    out = tmp_path / "b.mkv"
    run(capsys, "blur", source, "-o", out, "--flow", "dis", "--fps", 24, "--holdout", "static",
        "--shutter", 360, "--codec", "ffv1", "-q")  # fmt: skip
    sign = np.s_[1:9, 42:55]
    for got in lumas(out):
        assert np.abs(got.astype(int) - lumas(source)[0])[sign].max() <= 1


def test_repeated_pictures_may_be_filled(tmp_path, capsys):
    doubled = [f for f in moving(8, 4.0) for _ in (0, 1)]
    source = write(tmp_path / "a.mp4", doubled, 48)
    texts = {}
    for way in ("keep", "fill"):
        words = ["-o", tmp_path / f"{way}.mkv", "--flow", "dis", "--duplicates", way]
        texts[way] = run(capsys, "blur", source, *words)
    assert "repeated pictures left out" in texts["fill"] and "left out" not in texts["keep"]
    assert "8 repeated" in texts["fill"] or "7 repeated" in texts["fill"]
    moved = write(tmp_path / "b.mp4", moving(8, 4.0), 48)
    words = ["-o", tmp_path / "none.mkv", "--flow", "none", "--duplicates", "fill"]
    assert "no repeated picture found" in run(capsys, "blur", moved, *words)


def test_a_video_becomes_pictures(tmp_path, capsys):
    source = write(tmp_path / "a.mp4", grey_frames(range(40, 52)))
    run(capsys, "blur", source, "-o", tmp_path / "b.####.png", "--fps", 60, "--flow", "none", "-q")
    assert make.names_in(tmp_path) == ["a.mp4", *(f"b.{k:04d}.png" for k in range(1, 4))]
    with Image.open(tmp_path / "b.0002.png") as image:
        assert image.size == SIZE


def test_info_describes_a_video(tmp_path, capsys):
    times = [Fraction(n, 100) for n in (0, 1, 2, 7, 8, 12, 20, 21)]
    source = write(tmp_path / "a.mp4", grey_frames(range(30, 110, 10)), times=times, tone=0.2)
    assert app.main(["info", str(source)]) == 0
    text = capsys.readouterr().out
    for said in ("h264 in mov", "96 x 64", "8 in 0.", "variable: 10.0 to 80.0 ms",
                 "BT.601, transfer BT.709; Y'CbCr 4:2:0, 8 bits, limited range",
                 "stream    audio: aac", "does not state its colours"):  # fmt: skip
        assert said in text, text
    assert "cuts      not looked for; --scan decodes" in text and "mastered" not in text
    text = run(capsys, "info", source, "-o", tmp_path / "m.png", code=2)
    assert "rendered frames" in text


def test_info_scans_a_video_for_cuts_flashes_and_repeated_pictures(tmp_path, capsys):
    shot, other = list(moving(9, 4.0)), list(moving(8, -1.0, turned=True))
    frames = [*shot[:4], *grey_frames([235]), *shot[4:], *other, other[-1]]
    source = write(tmp_path / "a.mp4", frames, 96)
    assert app.main(["info", str(source), "--scan"]) == 0
    text = capsys.readouterr().out
    assert text.endswith(
        "cuts      before picture 10 (0.10 s)\nflashes   at picture 4\nrepeated  1: picture 18\n"
    ), text
    cut = clips.write(tmp_path / "b.mkv", moving(24), tone=1)
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size * 2 // 3])
    text = run(capsys, "info", cut, "--scan", code=1)
    assert "cut off after" in text


def test_pictures_without_vectors_move_by_flow(tmp_path, capsys):
    for n in range(1, 6):
        picture = to_display(make.picture(n)[..., :3], 8)
        Image.fromarray(np.kron(picture, np.ones((2, 2, 1), np.uint8))).save(
            tmp_path / f"a.{n}.png"
        )
    words = ["blur", tmp_path / "a.#.png", "-o", tmp_path / "b.#.png", "--frames", "2-4"]
    text = run(capsys, *words, "--flow", "dis", "-v")
    assert "the frames have no vectors; motion: dense inverse search" in text
    assert '"samples": "auto"' in text
    with Image.open(tmp_path / "a.3.png") as a, Image.open(tmp_path / "b.3.png") as b:
        off = np.abs(np.asarray(a).astype(int) - np.asarray(b))
    assert off[30:50, 40:70].mean() > 1.5 and off[:, :16].mean() < 0.5
    again = run(capsys, *words, "--flow", "dis", "--resume")
    assert "3 already done" in again
    assert '"samples": 16' in run(
        capsys, *words, "--flow", "dis", "--samples", 16, "-v", "--overwrite"
    )
    assert "have no vectors" in run(capsys, *words, "--flow", "none", "--overwrite", code=2)


@pytest.mark.parametrize(
    ("flow", "asked", "method"),
    [
        ("search", None, "gather"),
        ("auto", None, None),
        ("dis", None, "tap"),
        ("dis", "gather", "gather"),
        ("search", "tap", "tap"),
    ],
)
def test_the_method_suits_where_motion_comes_from(tmp_path, capsys, flow, asked, method):
    """Pictures without vectors and a video take the same one; auto that of what it becomes."""
    if flow == "auto":
        method = FlowSettings().chosen(gpu.open_device())[0].method
    for n in (1, 2):
        picture = to_display(make.picture(n)[..., :3], 8)
        Image.fromarray(picture).save(tmp_path / f"a.{n}.png")
    words = ["--flow", flow, *(["--method", asked] if asked else [])]
    job = tmp_path / "a.json"
    run(capsys, "job", tmp_path / "a.#.png", "-o", tmp_path / "b.#.png", "-j", job, *words)
    assert f'"method": "{method}"' in job.read_text()
    request = VideoRequest(blur=BlurSettings(method=asked), video=VideoSettings(flow=flow))
    assert request.open().blur.method.name == method


@pytest.mark.parametrize("settings, method, said", [
    ({"flow": "search"}, None, "`flow_quality=fast` takes less"),
    ({"flow": "search", "flow_quality": "fast"}, None, "`flow_quality=draft` takes less"),
    ({"flow": "search", "flow_quality": "draft"}, None, "`flow=dis` takes less"),
    ({"flow": "dis"}, None, "`flow_quality=fast` takes less"),
    ({"flow": "dis", "flow_quality": "fast"}, "gather", "`method=tap` takes less"),
    ({"flow": "dis", "flow_quality": "fast"}, None, "`flow=none`"),
    ({"flow": "none"}, None, "`end` ends earlier"),
])  # fmt: skip
def test_the_next_quicker_choice_is_named(settings, method, said):
    request = VideoRequest(blur=BlurSettings(method=method), video=VideoSettings(**settings))
    assert request.open().quicker.startswith(said)


def test_without_a_gpu_and_opencv_a_line_says_what_would_be_quicker(capsys, monkeypatch):
    for module in ("wgmb.settings.recipes", "wgmb.run.video"):
        monkeypatch.setattr(f"{module}.is_installed", lambda package: False)
    for flow in ("auto", "search"):
        run = VideoRequest(video=VideoSettings(flow=flow)).open()
        tell_how(run, Console())
        slow = run.blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE
        said = install_command("flow") in capsys.readouterr().err
        assert said == (slow and flow == "auto")


def test_a_cut_between_pictures_is_not_crossed(tmp_path, capsys):
    y, x = np.mgrid[:64, :96].astype(np.float32)
    for n in range(1, 7):
        seed, way = (0.0, 2.0) if n < 4 else (9.0, -2.0)
        shot = make.texture((x - way * n) / 6, y / 6, seed) ** (1 if n < 4 else 3)
        Image.fromarray(to_display(shot[:: 1 if n < 4 else -1], 8)).save(tmp_path / f"a.{n}.png")
    text = run(capsys, "blur", tmp_path / "a.#.png", "-o", tmp_path / "b.#.png", "--flow", "dis")
    assert "frames in" in text
    with Image.open(tmp_path / "a.3.png") as a, Image.open(tmp_path / "b.3.png") as b:
        assert np.abs(np.asarray(a).astype(int) - np.asarray(b)).mean() < 12


@pytest.mark.parametrize("method", ["tap", "tiles", "fusion", "reproject", "gather"])
def test_a_picture_alone_in_its_shot_is_copied_and_named(tmp_path, capsys, method):
    path, out = write(tmp_path / "a.mkv", moving(6), fps=24, codec="ffv1"), tmp_path / "b.mkv"
    words = ("--codec", "ffv1", "--flow", "dis", "--method", method, "--cuts", "only:2,3")
    text = run(capsys, "blur", path, "-o", out, *words)
    assert "picture 2: alone in a shot" in text
    before, after = lumas(path), lumas(out)
    differ = [np.abs(a.astype(int) - b).max() for a, b in zip(before, after, strict=True)]
    assert differ[2] <= 1 and differ[1] > 8


def test_pictures_alone_are_named_in_a_pipe_and_of_many_videos(tmp_path, capsys):
    for name in ("a.mkv", "c.mkv"):
        write(tmp_path / name, moving(4), fps=24, codec="ffv1")
    os.mkfifo(tmp_path / "b.y4m")
    with ThreadPoolExecutor() as pool:
        pool.submit((tmp_path / "b.y4m").read_bytes)
        cuts = ("--flow", "dis", "--cuts", "only:1,2")
        text = run(capsys, "blur", tmp_path / "a.mkv", "-o", tmp_path / "b.y4m", *cuts)
    assert "pictures 0-1: alone in a shot" in text
    words = (tmp_path / "a.mkv", tmp_path / "c.mkv", "-o", f"{tmp_path / 'out'}/")
    assert run(capsys, "blur", *words, *cuts).count("pictures 0-1: alone in a shot") == 2


def packets(path, kind):
    with av.open(str(path)) as container:
        stream = next(s for s in container.streams if s.type == kind)
        return [bytes(p) for p in container.demux(stream) if p.size]


def test_sound_is_copied_byte_for_byte_and_may_be_left_out(tmp_path, capsys):
    source = write(tmp_path / "a.mp4", moving(24), 24, tone=1.0)
    out, alone = tmp_path / "b.mp4", tmp_path / "c.mp4"
    run(capsys, "blur", source, "-o", out, "--flow", "none", "-q")
    assert packets(out, "audio") == packets(source, "audio")
    run(capsys, "blur", source, "-o", alone, "--flow", "none", "--streams", "video", "-q")
    with av.open(str(alone)) as container:
        assert [s.type for s in container.streams] == ["video"]


def test_a_run_that_was_killed_goes_on_and_gives_the_same_video(tmp_path, capsys, monkeypatch):
    source = write(tmp_path / "a.mp4", grey_frames([20 + n % 180 for n in range(50)]), 2, tone=20)
    whole, out = tmp_path / "whole.mp4", tmp_path / "out.mp4"
    words = ["--flow", "none", "-q"]
    run(capsys, "blur", source, "-o", whole, *words)
    add, count = video_output.VideoSink.put, [0]

    def killed(self, taken):
        count[0] += 1
        if count[0] == 33:
            raise KeyboardInterrupt
        add(self, taken)

    monkeypatch.setattr(video_output.VideoSink, "put", killed)
    run(capsys, "blur", source, "-o", out, *words, "--resume", code=130)
    assert make.names_in(tmp_path) == ["a.mp4", "out.mp4.segments", "whole.mp4"]
    run(capsys, "blur", source, "-o", out, *words, "--resume")
    assert 60 <= count[0] <= 64  # 33, of which 20 were kept, and the 30 others
    assert make.names_in(tmp_path) == ["a.mp4", "out.mp4", "whole.mp4"]
    one, other = VideoReader(whole), VideoReader(out)
    assert list(one.times) == list(other.times)
    assert packets(whole, "audio") == packets(out, "audio")
    for (_, a), (_, b) in zip(one, other, strict=True):
        assert np.abs(a.planes[0].astype(int) - b.planes[0]).max() <= 2
    before = out.stat().st_mtime_ns
    assert "already done" in run(capsys, "blur", source, "-o", out, "--flow", "none", "--resume")
    assert out.stat().st_mtime_ns == before
    text = run(capsys, "blur", source, "-o", out, *words, "--resume", "--shutter", 90, code=2)
    assert "made otherwise" in text


@pytest.mark.parametrize("words", [["--overwrite"], []])
def test_segments_of_a_killed_run_go_when_the_video_is_made_again(tmp_path, capsys, words):
    source = write(tmp_path / "a.mp4", grey_frames(range(40, 46)))
    out, other = tmp_path / "b.mp4", tmp_path / "c.mp4.segments"
    for folder in (tmp_path / "b.mp4.segments", other):
        folder.mkdir()
        (folder / "00000.mp4").write_bytes(b"half")
    if words:
        out.write_bytes(b"older")
    run(capsys, "blur", source, "-o", out, "--flow", "none", "-q", *words)
    assert make.names_in(tmp_path) == ["a.mp4", "b.mp4", "c.mp4.segments"]
    assert (other / "00000.mp4").is_file() and len(VideoReader(out)) == 6


def test_slow_motion_has_slow_sound(tmp_path, capsys):
    source = write(tmp_path / "a.mp4", moving(24), 24, tone=1.0)
    for pitch in ("keep", "follow"):
        out = tmp_path / f"{pitch}.mp4"
        words = ["--flow", "none", "--speed", "0.5", "--pitch", pitch, "-q"]
        run(capsys, "blur", source, "-o", out, *words)
        with av.open(str(out)) as container:
            sound = sum(f.samples for f in container.decode(audio=0)) / 48000
        assert abs(sound - 2) < 0.1 and abs(float(VideoReader(out).duration) - 2) < 0.1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.mp4"], "is the input"),
        (["-o", "there.mp4"], "exists; --overwrite"),
        (["-o", "b.mp4", "--codec", "prorez"], "did you mean 'prores'"),
        (["-o", "b.mp4", "--layer", "beauty"], "--layer is for rendered frames"),
        (["-o", "b.mp4", "--speed", "0"], "--speed must be 0.01 to 100"),
        (["-o", "b.mp4", "--begin", "1:xx"], "--begin must be seconds"),
        (["-o", "b.mp4", "--begin", "9"], "no pictures in this range"),
        (["-o", "b.mp4", "--frames", "2-99"], "pictures 0 to 5"),
        (["-o", "b.mp4", "--rolling", "down"], "rolling"),
        (["-o", "b.mp4", "--holdout", "Layer", "--flow", "dis"], "static"),
        (["-o", "b.mp4", "--holdout", "static"], "--holdout needs motion"),
        (["-o", "b.mp4", "--confidence"], "--confidence is for rendered frames"),
    ],
)
def test_what_does_not_fit_is_one_line_and_leaves_nothing(
    tmp_path, capsys, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.mp4", grey_frames(range(40, 46)))
    (tmp_path / "there.mp4").write_bytes(b"mine")
    words += [] if "--flow" in words else ["--flow", "none"]
    text = run(capsys, "blur", "a.mp4", *words, "-q", code=2)
    assert said in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == ["a.mp4", "there.mp4"]
    assert (tmp_path / "there.mp4").read_bytes() == b"mine"


# ---- from Python ----------------------------------------------------------------------------


def test_python_makes_what_the_command_line_makes(tmp_path, capsys, device):
    is_slow = device.adapter_info["adapter_type"] == gpu.SOFTWARE
    source = clips.write(tmp_path / "in.mp4")
    run(capsys, "blur", source, "-o", tmp_path / "a.mp4", "--fps", "12", "--shutter", "270")
    told = []
    report = blur_video(
        source, tmp_path / "b.mp4", fps=12, shutter=270, progress=lambda *one: told.append(one)
    )
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    assert told == [(n, "done") for n in range(6)]
    method = "tap" if is_slow else "gather"
    assert (report.frames, report.method, report.loss, report.is_new) == (6, method, "", True)
    assert blur_video(source, tmp_path / "c.mkv", resume=True, fps=12).is_new
    frames = blur_video(source, tmp_path / "f.#.png", end=0.2, holdout="static", flow="dis")
    assert len(list(tmp_path.glob("f.*.png"))) == frames.frames


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"ftps": 12}, "unknown setting 'ftps'; did you mean 'fps'"),
        ({"vectors": "nuke"}, "unknown setting 'vectors'"),
        ({"fps": "fast"}, "`fps` must be a number"),
        ({"speed": 0}, "`speed` must be 0.01 to 100, got 0"),
        ({"flow": "none", "holdout": "static"}, "`holdout` needs motion"),
        ({}, "exists; `overwrite=True` replaces it"),
    ],
)
def test_python_is_told_what_does_not_fit_and_nothing_is_written(tmp_path, settings, said):
    source, out = clips.write(tmp_path / "in.mp4"), tmp_path / "out.mp4"
    out.write_text("mine")
    with pytest.raises(InputError, match=said):
        blur_video(source, out, **settings)
    assert out.read_text() == "mine"


def test_a_progress_that_raises_ends_the_run_and_leaves_nothing(tmp_path):
    def stop(number, state):
        if number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        blur_video(clips.write(tmp_path / "in.mp4"), tmp_path / "out.mp4", progress=stop)
    assert [path.name for path in tmp_path.iterdir()] == ["in.mp4"]


def test_every_setting_of_a_video_is_a_keyword():
    groups = BlurSettings, ShutterSettings, OutputSettings, VideoSettings
    names = {field.name for group in groups for field in fields(group)}
    only_frames = {"scale", "output", "layers", "window"}
    assert VideoKeywords.__annotations__.keys() == names - only_frames | {
        "frames",
        "cuts",
        "max_mb",
    }


def test_a_run_holds_no_more_than_a_small_video_justifies(tmp_path, device):
    """Without a GPU, the textures of gather are in memory too."""
    frames = [Image.new("L", (1920, 1280))] * 2
    frames[0].save(path := tmp_path / "s.gif", save_all=True, append_images=frames[1:])
    request = VideoRequest(blur=BlurSettings(method="gather"))
    averages = VideoRequest(video=VideoSettings(flow="none"))
    more = replace(request, input=InputSettings(max_mb=4800))
    output = OutputSettings(output="x.mkv", fps="24")
    for one in (averages, more):
        assert one.open(device).plan(path, output).reader.size == (1920, 1280)
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return
    run = request.open(device)
    with pytest.raises(InputError, match=r"s\.gif: a file of .* 1200 MB; `max_mb=4800` allows it"):
        run.plan(path, output)
    path.write_bytes(path.read_bytes() + bytes(80_000))  # which might hold as many pixels
    assert run.plan(path, output).reader.size == (1920, 1280)


def test_frames_whose_motion_is_found_hold_no_more_than_their_files_justify(tmp_path, capsys):
    for n in range(3):
        Image.new("RGB", (640, 480)).save(tmp_path / f"a.{n}.png")
    words = ["blur", tmp_path / "a.#.png", "-o", tmp_path / "o.#.png", "-q"]
    text = run(capsys, *words, "--max-mb", "100", code=1)
    assert text.count("pictures of 640 x 480 takes 30 MB; --max-mb 118 allows it") == 3
    run(capsys, *words, "--max-mb", "118")
