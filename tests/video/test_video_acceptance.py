"""Videos through the command line as people have them: sound, colours, damage, games."""

import os
import tempfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from test_other_streams import FLASH, flash_and_click, flashing, packets

import make_clips as clips
import make_frames as make
from small_disk import small_disk
from wgmb.cli import app
from wgmb.color.coding import CodedPicture, Coding
from wgmb.color.srgb import linear
from wgmb.video.clock import tick
from wgmb.video.hdr10 import LightLevel, Mastering
from wgmb.video.read.reader import VideoReader
from wgmb.video.write.encoders import Facts, chosen
from wgmb.video.write.format import VideoFormat
from wgmb.video.write.writer import VideoWriter

P3 = ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06), (0.3127, 0.329))
PQ = Coding(bits=10, matrix=9, transfer=16, primaries=9)
HLG = replace(PQ, transfer=18)


def blur(capsys, *words, code=0):
    got = app.main(["blur", *(str(w) for w in words), "--flow", "none"])
    text = capsys.readouterr().err
    assert got == code, text
    return text


VARIED = [Fraction(n, 100) for n in np.cumsum([0] + [4, 3, 5, 4, 8, 4, 2, 4, 4] * 4).tolist()]


@pytest.mark.covers(1)
@pytest.mark.parametrize(
    ("name", "late", "times", "more"),
    [("a.mp4", 0, None, {}), ("a.mkv", 0.123, None, {}), ("a.mp4", 0, VARIED, {}),
     ("a.mp4", 0, [Fraction(n - 3, 24) for n in range(36)],
      {"options": {"bf": "0", "qp": "0"}, "muxing": {"avoid_negative_ts": "disabled"}})],
    ids=["mp4", "mkv that begins late", "variable rate", "edit list"],
)  # fmt: skip
@pytest.mark.parametrize("fps", [24, 60])
def test_sound_is_the_same_and_at_the_same_time(tmp_path, capsys, name, late, times, more, fps):
    """The flash within half an output frame of the click, which is not touched."""
    source, out = flashing(tmp_path / name, times, late, **more), tmp_path / f"b{name[1:]}"
    times = times or [Fraction(n, 24) for n in range(36)]
    _, click = flash_and_click(source)
    blur(capsys, source, "-o", out, "--fps", fps, "--shutter", 360, "-q")
    assert packets(out)[1] == packets(source)[1]
    shown, heard = brightest(out), sounded(out)
    first = float(VideoReader(source).times[0] - VideoReader(out).times[0])
    assert heard == pytest.approx(click - first, abs=0.002)
    lasts = float(times[FLASH + 1] - times[FLASH])
    assert abs(shown - heard) <= 0.5 / fps + max(lasts - 1 / fps, 0) + 0.002


def brightest(path):
    """Time of the brightest picture [s]."""
    reader = VideoReader(path)
    means = [float(picture.planes[0].mean()) for _, picture in reader]
    return float(reader.times[int(np.argmax(means))])


def sounded(path):
    """Time of the click [s]."""
    loud, heard = 0.0, 0.0
    with av.open(str(path)) as container:
        for frame in container.decode(audio=0):
            wave = np.abs(frame.to_ndarray().reshape(-1).astype(np.float64))
            if wave.max() > loud:
                loud, heard = wave.max(), frame.time + int(wave.argmax()) / frame.sample_rate
    return heard


def still(path, coding, facts, codec, size=(64, 48)):
    """A video of one picture, six times."""
    encoding = chosen(path, codec)
    stored, _ = encoding.coding(coding)
    times = [Fraction(n, 48) for n in range(6)]
    base = tick(*times, Fraction(1, 48))
    form = VideoFormat(encoding, stored, size, Fraction(48), base, facts)
    video = VideoWriter(path, path.with_name("part"), form)
    planes = clips.planes(2, size, stored.steps, stored.bits)
    for time in times:
        video.add(CodedPicture(planes, stored), time)
    video.close()
    return path


@pytest.mark.parametrize(
    ("coding", "codec", "allowed"),
    [(Coding(), "ffv1", 1), (PQ, "ffv1", 2), (HLG, "ffv1", 2),
     (Coding(matrix=6, transfer=6, primaries=6, full_range=True), "ffv1", 1)],
    ids=["709", "PQ", "HLG", "601, full range"],
)  # fmt: skip
def test_colours_come_back_with_their_tags(tmp_path, capsys, coding, codec, allowed):
    source, out = still(tmp_path / "a.mkv", coding, Facts(), codec), tmp_path / "b.mkv"
    blur(capsys, source, "-o", out, "--codec", codec, "--fps", 24, "-q")
    one, other = VideoReader(source), VideoReader(out)
    assert other.coding == one.coding == coding
    (_, want), (_, got) = next(iter(one)), next(iter(other))
    for a, b in zip(want.planes, got.planes, strict=True):
        assert np.abs(a.astype(int) - b).max() <= allowed


def test_untagged_hd_comes_back(tmp_path, capsys):
    planes = clips.planes(2, (1280, 720))
    source = clips.write(tmp_path / "a.mkv", [clips.frame(planes, "yuv420p")] * 2, codec="ffv1")
    assert "does not state" in blur(capsys, source, "-o", tmp_path / "b.mkv", "--codec", "ffv1")
    _, got = next(iter(VideoReader(tmp_path / "b.mkv")))
    for a, b in zip(planes, got.planes, strict=True):
        assert np.abs(a.astype(int) - b).max() <= 1


def test_hdr10_data_are_the_same_after_a_blur(tmp_path, capsys):
    facts = Facts(mastering=Mastering(P3, (0.0005, 1000.0)), light_level=LightLevel(993, 412))
    source, out = still(tmp_path / "a.mp4", PQ, facts, "h265"), tmp_path / "b.mp4"
    blur(capsys, source, "-o", out, "--codec", "h265", "-q")
    one, other = VideoReader(source), VideoReader(out)
    assert other.coding == one.coding == PQ
    assert other.light_level == one.light_level and other.mastering == one.mastering


def game(path):
    """A recording at 144 a second: hitches, pictures that repeat, a display that never changes."""
    width, height = 96, 64
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:height, :width].astype("f4")
    frames, times, at, shown = [], [], Fraction(0), 0
    for n in range(48):
        if n % 6 != 5:  # every sixth repeats the one before
            shown = n
        tone = make.texture(x + 2.0 * shown, y, 2.0)[..., 1]
        tone = np.where((x > 40) & (x < 56) & (y < 10), (x + y) % 2, tone)
        luma = np.clip(16 + 219 * tone, 16, 235).round().astype("u1")
        frames.append(clips.frame([luma, *[np.full((32, 48), 128, "u1")] * 2], "yuv420p"))
        times.append(at)
        at += Fraction(1, 144) * (3 if rng.random() < 0.06 else 1)
    return clips.write(path, frames, times, tone=0.5)


def test_a_recording_of_a_game(tmp_path, capsys):
    """Its head-up display stays, repeats are left out, what moves is blurred, times are even."""
    source, out = game(tmp_path / "a.mkv"), tmp_path / "b.mkv"
    words = ["--fps", 60, "--duplicates", "fill", "--holdout", "static", "--codec", "ffv1"]
    got = app.main([*map(str, ["blur", source, "-o", out, *words]), "--flow", "dis"])
    text = capsys.readouterr().err
    assert got == 0 and "8 repeated pictures left out" in text, text
    before, after = VideoReader(source), VideoReader(out)
    assert before.is_variable and not after.is_variable and after.rate == 60
    assert abs(float(after.duration - before.duration)) < 1 / 30
    lumas = [picture.planes[0].astype(int) for _, picture in before]
    for _, picture in after:
        off = np.abs(picture.planes[0].astype(int) - lumas[0])
        assert off[1:9, 42:55].max() <= 1
    detail = [np.abs(np.diff(p.astype(float), axis=1))[16:].mean()
              for p in (lumas[20], [p for _, p in after][8].planes[0])]  # fmt: skip
    assert detail[1] < 0.9 * detail[0]


@pytest.mark.parametrize("flow", ["none", "dis"])
def test_a_flash_counts_by_its_share(tmp_path, capsys, flow):
    """A white picture among 240 a second: a quarter of the light of one of 60, and no cut."""
    y, x = np.mgrid[:64, :96].astype("f4")
    frames = []
    for n in range(24):
        tone = make.texture(x + 2 * n, y, 2.0)[..., 1] if n != 9 else np.ones_like(x)
        luma = np.clip(16 + 219 * tone, 16, 235).round().astype("u1")
        frames.append(clips.frame([luma, *[np.full((32, 48), 128, "u1")] * 2], "yuv420p"))
    times = [Fraction(n, 240) for n in range(24)]
    source = clips.write(tmp_path / "a.mkv", frames, times, codec="ffv1")
    out = tmp_path / "b.mkv"
    words = ["--fps", 60, "--shutter", 360, "--codec", "ffv1", "--flow", flow]
    assert app.main([*map(str, ["blur", source, "-o", out, *words])]) == 0
    text = capsys.readouterr().err
    assert "flash at picture 9" in text and "cut" not in text
    light = [float(linear((p.planes[0] - 16.0) / 219).mean()) for _, p in VideoReader(out)]
    added = np.array(light) - np.median(light)
    white = 1 - np.median(light)
    assert added[2] == pytest.approx(white / 4, abs=0.02)
    assert np.abs(np.delete(added, 2)).max() < 0.02


def damaged(data):
    middle = len(data) // 2
    return data[:middle] + np.random.default_rng(1).bytes(300) + data[middle + 300 :]


ODD = {
    "cut off, no index": ("c.mp4", lambda d: d[:-3000], "is cut off: its index"),
    "no bytes": ("c.mp4", lambda d: b"", "is empty"),
    "noise": ("c.mp4", lambda d: np.random.default_rng(2).bytes(5000), "is not a video"),
    "text as video": ("c.mov", lambda d: b"not a video\n" * 50, "is not a video"),
}


@pytest.mark.parametrize("name", ODD)
def test_what_cannot_be_read_is_one_line(tmp_path, capsys, name):
    file, spoil, said = ODD[name]
    source = clips.write(tmp_path / "a.mp4", tone=1)
    data = source.read_bytes()
    source.unlink()
    (tmp_path / file).write_bytes(spoil(data))
    text = blur(capsys, tmp_path / file, "-o", tmp_path / "o.mp4", "-q", code=2)
    assert said in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == [file]


def test_a_wrong_suffix_does_not_matter(tmp_path, capsys):
    source = clips.write(tmp_path / "a.mkv").rename(tmp_path / "a.mp4")
    blur(capsys, source, "-o", tmp_path / "b.mp4", "-q")
    assert len(VideoReader(tmp_path / "b.mp4")) == 12


def test_sound_without_pictures_is_one_line(tmp_path, capsys):
    with av.open(str(tmp_path / "a.mp4"), "w") as out:
        heard = out.add_stream("aac", rate=48000)
        heard.layout = "mono"
        for block in clips.samples(0.5):
            out.mux(heard.encode(block))
        out.mux(heard.encode(None))
    text = blur(capsys, tmp_path / "a.mp4", "-o", tmp_path / "b.mp4", "-q", code=2)
    assert "has no pictures that move" in text and text.count("\n") == 1


def test_lost_pictures_are_counted_and_nothing_else_is_lost(tmp_path, capsys):
    rng = np.random.default_rng(0)
    frames = []
    for n in range(48):
        luma, *chroma = clips.planes(n)
        noise = luma + rng.integers(0, 30, luma.shape, np.uint8)
        frames.append(clips.frame([noise, *chroma], "yuv420p"))
    source = clips.write(tmp_path / "a.mkv", frames, options={"crf": "20", "g": "12"})
    source.write_bytes(damaged(source.read_bytes()))
    text = blur(capsys, source, "-o", tmp_path / "b.mkv", "-q", code=1)
    assert text.count("\n") == 1
    assert "could not be decoded" in text or "damaged picture" in text
    assert len(VideoReader(tmp_path / "b.mkv")) > 36


def encrypted(source, path):
    """The same video with its samples encrypted (ISO/IEC 23001-7, cenc)."""
    how = {
        "encryption_scheme": "cenc-aes-ctr",
        "encryption_key": "00112233445566778899aabbccddeeff",
        "encryption_kid": "ffeeddccbbaa99887766554433221100",
    }
    with av.open(str(source)) as there, av.open(str(path), "w", container_options=how) as here:
        into = {s.index: here.add_stream_from_template(s, opaque=True) for s in there.streams}
        for packet in there.demux():
            if packet.dts is not None:
                packet.stream = into[packet.stream.index]
                here.mux(packet)
    return path


def test_an_encrypted_file_says_so(tmp_path, capsys):
    source = encrypted(clips.write(tmp_path / "a.mp4", tone=1), tmp_path / "e.mp4")
    text = blur(capsys, source, "-o", tmp_path / "b.mp4", "-q", code=2)
    assert "e.mp4: is encrypted" in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == ["a.mp4", "e.mp4"]


@pytest.mark.parametrize("name", ["b.mp4", "b.mkv", "b.webm", "b.mov", "b.gif"])
@pytest.mark.parametrize("resume", [False, True], ids=["", "resume"])
def test_a_full_disk_is_one_line_and_nothing_is_left_or_lost(tmp_path, capsys, name, resume):
    if resume and name in ("b.gif", "b.webm", "b.mov"):
        pytest.skip("segments are the same in each container, and a GIF has none")
    source, out = clips.write(tmp_path / "a.mp4", tone=1), tmp_path / "out"
    out.mkdir()
    words = ["--resume"] if resume else ["--overwrite"]
    if not resume:
        (out / name).write_bytes(b"mine")
    with small_disk(1500):
        text = blur(capsys, source, "-o", out / name, *words, "-q", code=1)
    assert text.count("\n") == 1 and f"{out / name}" in text
    assert make.names_in(out) == ([] if resume else [name])
    assert resume or (out / name).read_bytes() == b"mine"


@pytest.fixture
def nobody(tmp_path_factory):
    """A folder for a user who may not do everything, whom root becomes as long as the test runs."""
    if os.geteuid():
        yield tmp_path_factory.mktemp("nobody")
        return
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        try:
            yield Path(folder)
        finally:
            os.seteuid(0)


def test_files_and_folders_without_permission_are_one_line(nobody, capsys):
    source, locked = clips.write(nobody / "a.mp4"), nobody / "locked"
    hidden = clips.write(nobody / "hidden.mp4")
    blur(capsys, source, "-o", nobody / "b.mp4", "-q")  # modules are loaded while they may be
    hidden.chmod(0)
    locked.mkdir()
    locked.chmod(0o555)
    before = make.names_in(nobody)
    if not os.geteuid():
        os.seteuid(65534)
    cases = [
        (hidden, nobody / "c.mp4", ()),
        (source, locked / "c.mp4", ()),
        (source, locked / "c.mp4", ("--resume",)),
        (source, locked / "d" / "c.mp4", ()),
    ]
    for given, out, more in cases:
        code = app.main([str(w) for w in ("blur", given, "-o", out, "--flow", "none", "-q", *more)])
        text = capsys.readouterr().err
        assert code in (1, 2) and "permission denied" in text.lower(), text
        assert text.count("\n") == 1
    assert make.names_in(nobody) == before and make.names_in(locked) == []


def test_a_video_becomes_a_gif(tmp_path, capsys):
    source, out = clips.write(tmp_path / "a.mp4", tone=1), tmp_path / "b.gif"
    text = blur(capsys, source, "-o", out, "--fps", 12)
    assert "b.gif: stream 1 (sound) is left out" in text
    found = VideoReader(out)
    assert (len(found), found.rate) == (6, 12)
    for n, (_, picture) in enumerate(found):
        grey = (clips.level(2 * n) - 16) / 219
        shown = picture.planes[1][:40:2, :40:2].mean() / 255
        assert abs(shown - grey) < 0.2
    text = blur(capsys, source, "-o", tmp_path / "c.gif", "--fps", 60, "-q", code=2)
    assert ".gif takes 1/600 to 50 frames per second, got 60" in text


def test_an_output_that_cannot_be_written_is_one_line(tmp_path, capsys, monkeypatch):
    source = clips.write(tmp_path / "a.mp4")
    (tmp_path / "file").write_bytes(b"mine")
    text = blur(capsys, source, "-o", tmp_path / "file" / "b.mp4", "-q", code=2)
    assert text.count("\n") == 1 and (tmp_path / "file").read_bytes() == b"mine"
    words = ["-o", tmp_path / "b.mp4", "--encoder", "amf", "-q"]
    text = blur(capsys, source, *words, code=2)
    assert "encoder" in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == ["a.mp4", "file"]
