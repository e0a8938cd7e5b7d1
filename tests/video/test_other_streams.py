"""Sound, subtitles, chapters and texts come along: byte for byte, and in time with the pictures."""

from fractions import Fraction

import av
import numpy as np
import pytest
from av.stream import Disposition

import make_clips as clips
from wgmb.video.clock import Clock, tick
from wgmb.video.read.reader import VideoReader
from wgmb.video.write.encoders import chosen
from wgmb.video.write.format import VideoFormat
from wgmb.video.write.other_streams import OtherStreams
from wgmb.video.write.time_stretch import TimeStretch
from wgmb.video.write.writer import VideoWriter

pytestmark = pytest.mark.fast

FLASH = 12  # the picture that is white
DATE = "2024-05-06T07:08:09.000000Z"


def flashing(path, times=None, late=0.0, rate=48000, codec="aac", count=36, **more):
    """A clip with a white picture, and a click 1 ms after it."""
    times = times or [Fraction(n, clips.RATE) for n in range(count)]
    wave = np.zeros(round((float(times[-1]) + late + 0.2) * rate))
    at = round((float(times[FLASH]) + late + 0.001) * rate)
    pulse = np.arange(96)
    wave[at : at + 96] = 0.9 * np.sin(2 * np.pi * 2000 * pulse / rate) * np.hanning(96)
    frames = []
    for n in range(len(times)):
        luma = np.full((48, 64), 220 if n == FLASH else 20, np.uint8)
        chroma = np.full((24, 32), 128, np.uint8)
        frames.append(clips.frame([luma, chroma, chroma], "yuv420p"))
    return clips.write(path, frames, times, late=late, sound=(codec, rate, wave), **more)


def copied(source, path, clock=None, keeps_pitch=True, others=True) -> list[str]:
    """The clip with its pictures encoded anew; what was left out."""
    clock = clock or Clock()
    reader = VideoReader(source)
    encoding = chosen(path, "h264" if path.suffix == ".mov" else None)
    coding, _ = encoding.coding(reader.coding)
    beside = OtherStreams(source, reader.index, clock, keeps_pitch) if others else None
    base = tick(reader.times.base / clock.speed, clock.out(reader.times[0]))
    form = VideoFormat(encoding, coding, reader.size, reader.rate, base)
    video = VideoWriter(path, path.with_name("part"), form, others=beside)
    for number, picture in reader:
        time = reader.times[number]
        if (clock.first or time) <= time < (clock.end or time + 1):
            video.add(picture, clock.out(time))
    video.close()
    return video.left_out


def flash_and_click(path) -> tuple[float, float]:
    """Times of the white picture and of the click [s]."""
    with av.open(str(path)) as container:
        shown = [f.time for f in container.decode(video=0) if np.mean(f.to_ndarray()[:48]) > 120]
    with av.open(str(path)) as container:
        loud, heard = 0.0, 0.0
        for frame in container.decode(audio=0):
            wave = np.abs(frame.to_ndarray().reshape(-1).astype(np.float64))
            if frame.format.name != "fltp":
                wave /= 32768
            if wave.max() > loud:
                loud, heard = wave.max(), frame.time + int(wave.argmax()) / frame.sample_rate
    (white,) = shown
    assert loud > 0.2
    return white, heard


def packets(path) -> dict[int, list[bytes]]:
    """The bytes of all packets, by stream."""
    found: dict[int, list[bytes]] = {}
    with av.open(str(path)) as container:
        for packet in container.demux():
            if packet.size:
                found.setdefault(packet.stream_index, []).append(bytes(packet))
    return found


VARIABLE = [Fraction(n, 60) for n in (0, 1, 3, 4, 7, 8, 9, 10, 13, 14, 15, 16, 18, 22, 23, 24)]


@pytest.mark.parametrize("to", ["mp4", "mkv", "mov"])
@pytest.mark.parametrize(
    ("kind", "late", "times"),
    [("mp4", 0, None), ("mkv", 0.523, None), ("mp4", 0.3, None), ("mkv", 0, VARIABLE),
     ("mp4", 0, VARIABLE), ("ts", 0.1, None)],
)  # fmt: skip
def test_a_flash_and_a_click_stay_together_and_sound_stays_as_it_is(
    tmp_path, kind, late, times, to
):
    source, path = tmp_path / f"a.{kind}", tmp_path / f"b.{to}"
    flashing(source, times, late)
    white, click = flash_and_click(source)
    assert click - white == pytest.approx(0.002, abs=0.0015)  # its loudest is 1 ms in
    assert copied(source, path) == []
    shown, heard = flash_and_click(path)
    assert heard - shown == pytest.approx(click - white, abs=0.0015)
    assert len(VideoReader(path)) == len(VideoReader(source))
    before, after = packets(source), packets(path)
    if kind != "ts":  # in which AAC has headers of its own
        assert before[1] == after[1]


def test_an_edit_list_holds_for_sound_too(tmp_path):
    times = [Fraction(n - 3, 24) for n in range(36)]
    source, path = tmp_path / "a.mp4", tmp_path / "b.mp4"
    flashing(source, times, 0, options={"bf": "0", "qp": "0"},
             muxing={"avoid_negative_ts": "disabled"})  # fmt: skip
    white, click = flash_and_click(source)
    assert white == pytest.approx((FLASH - 3) / 24, abs=0.001)
    copied(source, path)
    shown, heard = flash_and_click(path)
    assert shown == pytest.approx(white, abs=0.001)
    assert heard == pytest.approx(click, abs=0.001)


@pytest.mark.parametrize("keeps_pitch", [True, False])
@pytest.mark.parametrize(
    ("kind", "to", "codec", "rate", "speed"),
    [("mkv", "mp4", "aac", 48000, "2/5"), ("mp4", "mkv", "libopus", 48000, "2"),
     ("mkv", "webm", "libmp3lame", 44100, "2/5"), ("mkv", "mkv", "flac", 44100, "417/1000"),
     ("mov", "mov", "pcm_s16le", 22050, "5/4")],
)  # fmt: skip
def test_a_flash_and_a_click_stay_together_at_another_speed(
    tmp_path, kind, to, codec, rate, speed, keeps_pitch
):
    source, path = tmp_path / f"a.{kind}", tmp_path / f"b.{to}"
    flashing(source, late=0.123, codec=codec, rate=rate)
    white, click = flash_and_click(source)
    clock = Clock(Fraction(1, 10), Fraction(speed), Fraction(1, 5))
    assert copied(source, path, clock, keeps_pitch) == []
    shown, heard = flash_and_click(path)
    begins = 0.001 / (1 if keeps_pitch else float(clock.speed))  # to the loudest of the click
    want = (click - 0.001 - white) / float(clock.speed) + begins
    assert heard - shown == pytest.approx(want, abs=0.0035)  # MP3 and milliseconds blur it
    if to in ("mp4", "mov"):  # others put all later by what a decoder of sound begins with
        assert shown == pytest.approx(float(clock.out(Fraction(white))), abs=0.002)


def test_a_part_begins_at_its_beginning_with_its_sound(tmp_path):
    source, path = tmp_path / "a.mkv", tmp_path / "b.mp4"
    flashing(source)
    first, end = Fraction(33, 100), Fraction(1)
    clock = Clock(first, first=first, end=end)
    copied(source, path, clock)
    shown, heard = flash_and_click(path)
    assert shown == pytest.approx(0.5 - 0.33, abs=0.001)
    assert heard - shown == pytest.approx(0.002, abs=0.0015)
    reader = VideoReader(path)
    assert len(reader) == 16
    with av.open(str(path)) as container:
        times = [f.time for f in container.decode(audio=0)]
    assert -0.001 < times[0] < 0.022
    assert 0.63 < times[-1] < 0.68


def test_a_part_at_another_speed_is_cut_to_the_sample(tmp_path):
    source, path = tmp_path / "a.mkv", tmp_path / "b.mov"
    flashing(source, codec="pcm_s16le")
    clock = Clock(Fraction(1, 3), Fraction(1, 2), first=Fraction(1, 3), end=Fraction(1))
    copied(source, path, clock)
    shown, heard = flash_and_click(path)
    assert heard - shown == pytest.approx(0.003, abs=0.002)
    with av.open(str(path)) as container:
        assert sum(f.samples for f in container.decode(audio=0)) == round(2 * 2 / 3 * 48000)


def rich(path):
    """Two languages, subtitles, a font, a cover, chapters, a title and a date."""

    def add(container):
        for language, title in (("deu", ""), ("eng", "Comment")):
            sound = container.add_stream("aac", rate=48000)
            sound.layout = "mono"
            sound.metadata.update({"language": language, "title": title})
        text = container.add_mux_stream("subrip")
        text.metadata["language"] = "fra"
        container.add_attachment("font.ttf", "application/x-truetype-font", b"abc" * 99)
        container.metadata.update({"title": "A clip", "creation_time": DATE, "comment": "mine"})
        container.set_chapters([
            {"id": n, "start": 500 * n, "end": 500 * n + 500, "time_base": Fraction(1, 1000),
             "metadata": {"title": f"part {n}"}} for n in range(3)
        ])  # fmt: skip

    def after(container):
        for sound in container.streams.audio:
            for block in clips.samples(1.5):
                container.mux(sound.encode(block))
            container.mux(sound.encode(None))
        (text,) = (s for s in container.streams if s.metadata.get("language") == "fra")
        for n in range(3):
            packet = av.Packet(f"line {n}".encode())
            packet.stream, packet.time_base = text, Fraction(1, 1000)
            packet.pts = packet.dts = 500 * n
            packet.duration = 400
            container.mux(packet)

    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(36)]
    return clips.write(path, frames, before=add, also=after)


def test_everything_comes_along(tmp_path):
    source, path = rich(tmp_path / "a.mkv"), tmp_path / "b.mkv"
    assert copied(source, path) == []
    before, after = packets(source), packets(path)
    assert [before[n] for n in (1, 2, 3)] == [after[n] for n in (1, 2, 3)]
    with av.open(str(source)) as a, av.open(str(path)) as b:
        assert b.metadata["title"] == "A clip"
        assert b.metadata["creation_time"] == DATE
        assert {k.lower(): v for k, v in b.metadata.items()}["comment"] == "mine"
        assert a.chapters() == b.chapters()
        for one, other in zip(a.streams, b.streams, strict=True):
            assert one.type == other.type
            assert one.disposition == other.disposition
            for key in ("language", "title", "filename", "mimetype"):
                assert one.metadata.get(key) == other.metadata.get(key)
        assert b.streams.attachments[0].data == b"abc" * 99


@pytest.mark.parametrize("to", ["b.mkv", "b.mp4"])
def test_a_cover_stays_a_cover(tmp_path, to):
    """As a stream of Matroska it would be another video of one picture."""

    def add(container):
        cover = container.add_stream("mjpeg")
        cover.width, cover.height, cover.pix_fmt = 32, 32, "yuvj420p"
        cover.disposition = Disposition.attached_pic

    def after(container):
        container.mux(container.streams.video[1].encode(clips.grey((32, 32), "yuvj420p")))

    source, path = clips.write(tmp_path / "a.mp4", before=add, also=after), tmp_path / to
    assert copied(source, path) == []
    found = []
    for one in (source, path):
        with av.open(str(one)) as container:
            assert container.streams.video[1].disposition & Disposition.attached_pic
            found.append([bytes(p) for p in container.demux(video=1) if p.size])
    assert found[0] == found[1] and len(found[0]) == 1


def test_what_a_container_cannot_hold_is_left_out_and_said(tmp_path):
    source, path = rich(tmp_path / "a.mkv"), tmp_path / "b.mp4"
    left = copied(source, path)
    assert left == [
        "stream 3 (subtitles, fra) is left out: .mp4 cannot hold srt (.mkv holds it)",
        "stream 4 (attachment) is left out: .mp4 cannot hold attachment (.mkv holds it)",
    ]
    before, after = packets(source), packets(path)
    assert before[1] == after[1]
    assert before[2] == after[2]
    with av.open(str(path)) as container:
        assert [c["metadata"]["title"] for c in container.chapters()] == [
            "part 0", "part 1", "part 2"
        ]  # fmt: skip
        sound = container.streams.audio
        assert [s.metadata["language"] for s in sound] == ["deu", "eng"]
        assert container.metadata["creation_time"] == DATE
    back = tmp_path / "c.mkv"
    assert copied(path, back) == []  # MP4's track of chapters is no stream to miss
    with av.open(str(back)) as container:
        assert [s.metadata.get("title") for s in container.streams.audio] == [None, "Comment"]


def test_chapters_and_subtitles_go_by_the_clock(tmp_path):
    source, path = rich(tmp_path / "a.mkv"), tmp_path / "b.mkv"
    clock = Clock(Fraction(3, 4), Fraction(1, 2), first=Fraction(3, 4), end=Fraction(5, 4))
    copied(source, path, clock)
    with av.open(str(path)) as container:
        chapters = [(c["start"] * c["time_base"], c["end"] * c["time_base"])
                    for c in container.chapters()]  # fmt: skip
        assert chapters == [(0, Fraction(1, 2)), (Fraction(1, 2), 1)]
        texts = [p for p in container.demux(subtitles=0) if p.size]
    assert [bytes(p) for p in texts] == [b"line 1", b"line 2"]
    assert [p.pts for p in texts] == [0, 500]
    assert [p.duration for p in texts] == [300, 500]


def test_pictures_alone(tmp_path):
    source, path = rich(tmp_path / "a.mkv"), tmp_path / "b.mkv"
    copied(source, path, others=False)
    with av.open(str(path)) as container:
        assert [s.type for s in container.streams] == ["video"]


def test_a_gap_in_the_sound_stays_one_at_another_speed(tmp_path):
    """Half a second is missing in the middle."""
    source, path = tmp_path / "a.mkv", tmp_path / "b.mkv"
    wave = 0.3 * np.sin(2 * np.pi * 440 * np.arange(3 * 24000) / 48000)
    clips.write(source, [clips.frame(clips.planes(n), "yuv420p") for n in range(48)],
                sound=("pcm_s16le", 48000, wave), gap=(0.5, 0.5))  # fmt: skip
    copied(source, path, Clock(speed=Fraction(1, 2)))
    with av.open(str(path)) as container:
        heard = np.zeros(4 * 48000)
        for frame in container.decode(audio=0):
            at = round(frame.time * 48000)
            samples = frame.to_ndarray().reshape(-1)
            heard[at : at + len(samples)] = samples / np.iinfo(samples.dtype).max
    loud = np.abs(heard).reshape(-1, 2400).max(1) > 0.1  # blocks of 50 ms
    assert loud[:19].all()
    assert not loud[22:39].any()
    assert loud[42:78].all()


@pytest.mark.parametrize("speed", ["2/5", "1/2", "4/5", "5/4", "2", "1/10"])
def test_a_stretched_tone_keeps_its_pitch_loudness_and_length(speed):
    rate, count = 8000, 16000
    tone = np.sin(2 * np.pi * 440 * np.arange(count) / rate)[None].astype(np.float32)
    stretch = TimeStretch(rate, 1, Fraction(speed))
    made = [stretch.add(tone[:, n : n + 700]) for n in range(0, count, 700)]
    heard = np.concatenate([*made, stretch.rest()], 1)[0]
    assert len(heard) == round(count / Fraction(speed))
    inner = heard[len(heard) // 4 : -len(heard) // 4]
    power = np.abs(np.fft.rfft(inner * np.hanning(len(inner)))) ** 2
    peak = int(power.argmax())
    assert peak * rate / len(inner) == pytest.approx(440, abs=1.5)
    assert power[peak - 4 : peak + 5].sum() > 0.99 * power.sum()
    assert inner.std() == pytest.approx(0.5**0.5, abs=0.02)


def test_clicks_do_not_drift_when_stretched():
    """A minute of them: each once, where the clock has it to a millisecond."""
    rate, speed = 8000, Fraction(2, 5)
    wave = np.random.default_rng(0).normal(0, 0.01, (1, 60 * rate)).astype(np.float32)
    wave[0, rate // 2 :: rate] = 0.9
    stretch = TimeStretch(rate, 1, speed)
    heard = np.concatenate([stretch.add(wave), stretch.rest()], 1)[0]
    loud = np.flatnonzero(heard > 0.4)
    want = (np.arange(60) + 0.5) * rate / float(speed)
    assert len(loud) == 60
    assert np.abs(loud - want).max() <= 0.001 * rate
