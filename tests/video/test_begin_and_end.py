"""Outputs begin at 0, however late the clock of the input is, and nothing outlasts their end."""

from fractions import Fraction

import av
import pytest

import make_clips as clips
from wgmb import blur_video


def begins(path) -> dict[str, float]:
    """The time at which each kind of stream begins [s], without what edit lists leave out."""
    first: dict[str, float] = {}
    with av.open(str(path)) as container:
        for packet in container.demux():
            if packet.size and packet.pts is not None and not packet.is_discard:
                kind, time = packet.stream.type, float(packet.pts * packet.time_base)
                first[kind] = min(time, first.get(kind, time))
    return first


def late_clip(path, late, sound):
    """A clip whose clock begins at `late` [s], and its sound at `sound`."""

    def add(container):
        if sound is None:
            return
        (stream,) = container.streams.audio
        for block in clips.samples(1.0):
            block.pts += round(sound * 48000)
            container.mux(stream.encode(block))
        container.mux(stream.encode(None))

    def before(container):
        if sound is not None:
            container.add_stream("ac3", rate=48000).layout = "mono"

    muxing = {"avoid_negative_ts": "disabled"}
    return clips.write(path, late=late, before=before, also=add, muxing=muxing)


@pytest.mark.parametrize("to", ["mp4", "mkv", "mov", "webm"])
@pytest.mark.parametrize(
    ("late", "sound"), [(7200, 7199.5), (7200, 7200.25), (10, None), (-0.25, -0.75)]
)
@pytest.mark.parametrize("kind", ["ts", "mkv", "mp4", "nut"])
def test_a_late_clock_is_not_kept(tmp_path, kind, late, sound, to):
    """Of broadcasts, HLS and camcorders; in an MP4, of an edit list. Distances are kept."""
    if late < 0 and kind in ("ts", "mp4", "nut"):
        late, sound = 5.5, 6.25
    source, path = tmp_path / f"a.{kind}", tmp_path / f"b.{to}"
    late_clip(source, late, sound)
    before = begins(source)
    assert before["video"] == pytest.approx(late, abs=1.5)
    report = blur_video(source, path, flow="none")
    after = begins(path)
    is_heard = "audio" in after
    assert is_heard == (sound is not None and to != "webm")
    assert min(after.values()) == pytest.approx(0, abs=0.002)
    if is_heard:
        first = late if late < 0 else before["video"]  # FFmpeg gives no times below zero of those
        distance = before["audio"] - first
        assert after["audio"] - after["video"] == pytest.approx(distance, abs=0.003)
    with av.open(str(path)) as container:
        assert container.duration / 1e6 < 2.3
    assert report.loss == ""


@pytest.mark.parametrize("resume", [False, True])
def test_an_end_cuts_subtitles(tmp_path, resume):
    """One that lasts longer made the file last as long."""

    def add(container):
        container.add_mux_stream("mov_text")

    def after(container):
        packet = av.Packet(b"\0\5Hello")
        packet.stream, packet.time_base = container.streams[1], Fraction(1, 1000)
        packet.pts, packet.dts, packet.duration = 200, 200, 4000
        container.mux(packet)

    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(48)]
    source = clips.write(tmp_path / "a.mp4", frames, before=add, also=after)
    blur_video(source, tmp_path / "b.mp4", flow="none", end=0.5, resume=resume)
    with av.open(str(tmp_path / "b.mp4")) as container:
        assert container.duration == 500_000
        assert b"Hello" in b"".join(bytes(p) for p in container.demux(subtitles=0))
