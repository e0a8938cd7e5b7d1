"""Videos that state more than they hold: indices, pictures that grow, openings that take too long.

`soaking.stated` makes every number of every kind of video too large; this has a few of them, and
what needs more than one number.
"""

import _thread
import json
import struct
import threading
import time
import zlib
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

import make_clips as clips
from soaking import stated
from soaking.processes import apart
from soaking.stated import videos
from wgmb import InputError, allocator, blur_video, threads
from wgmb.io import watch
from wgmb.video.read import container
from wgmb.video.read.boxes import check_counts
from wgmb.video.read.reader import VideoReader

MANY = 80_000_000
FRAGMENTS = {"movflags": "frag_keyframe+empty_moov"}


def box(kind: bytes, *contents: bytes) -> bytes:
    whole = b"".join(contents)
    return struct.pack(">I4s", 8 + len(whole), kind) + whole


def exchanged(data: bytes, kind: bytes, contents: bytes) -> bytes:
    """An MP4 in which every box of that kind has other contents."""
    made, at = b"", 0
    while at + 8 <= len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        if name == kind:
            made += box(kind, contents)
        elif name in (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts", b"moof", b"traf"):
            made += box(name, exchanged(data[at + 8 : at + size], kind, contents))
        else:
            made += data[at : at + size]
        at += size
    return made


def index_of(data: bytes) -> tuple[int, int]:
    """Begin and end of `moov`, which comes last."""
    return next((begin, end) for name, begin, _, end in videos.boxes(data) if name == "/moov")


def compressed(data: bytes, more: int = 0) -> bytes:
    """An MP4 whose index is compressed, and has so many bytes more."""
    begin, end = index_of(data)
    moov = data[begin:end] + bytes(more)
    packed = struct.pack(">I", len(moov)) + zlib.compress(moov, 9)
    return data[:begin] + box(b"moov", box(b"cmov", box(b"dcom", b"zlib"), box(b"cmvd", packed)))


def renamed(data: bytes, kind: bytes) -> bytes:
    begin, _ = index_of(data)
    return data[: begin + 4] + kind + data[begin + 8 :]


def edits(data: bytes, count: int) -> bytes:
    return exchanged(data, b"elst", struct.pack(">II", 0, count) + count * EDIT)


EDIT = struct.pack(">Iihh", 500, 0, 1, 0)
PLAIN = struct.pack(">II", 0, MANY)  # a run of samples that states nothing of each
HOSTILE = {
    "samples": lambda mp4, _: videos.with_tables(mp4, MANY, 1),
    "samples of no bytes": lambda mp4, _: videos.with_tables(mp4, MANY, 0),
    "what was freed": lambda mp4, _: renamed(videos.with_tables(mp4, MANY, 1), b"free"),
    "a compressed index": lambda mp4, _: compressed(videos.with_tables(mp4, MANY, 1)),
    "an index that inflates": lambda mp4, _: compressed(mp4, 100_000_000),
    "edits": lambda mp4, _: edits(mp4, 1_000_000),
    "a padded file": lambda mp4, _: videos.with_tables(mp4, 9_000_000, 1) + bytes(9_000_000),
    "runs of fragments": lambda _, fragments: exchanged(fragments, b"trun", PLAIN),
    "runs of sizes": lambda _, fragments: exchanged(
        fragments, b"trun", struct.pack(">II", 0x200, MANY) + bytes(64)
    ),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Bytes of an MP4, and of one in fragments."""
    folder = tmp_path_factory.mktemp("sound")
    return (
        clips.write(folder / "plain.mp4").read_bytes(),
        clips.write(folder / "fragments.mp4", muxing=FRAGMENTS).read_bytes(),
    )


@pytest.mark.parametrize("kind", HOSTILE)
def test_an_index_that_the_file_cannot_hold_is_refused_unread(tmp_path, sound, kind, monkeypatch):
    path = tmp_path / "hostile.mp4"
    path.write_bytes(HOSTILE[kind](*sound))
    monkeypatch.setattr(av, "open", lambda *_, **__: pytest.fail("FFmpeg was asked"))
    with pytest.raises(InputError, match=r"hostile\.mp4: .*(states|index)") as refused:
        VideoReader(path)
    assert str(refused.value).count("hostile.mp4") == 1


def test_names_of_texts_are_no_boxes(tmp_path):
    """A name may look like the head of a long box that ends before its own head does."""
    names = (1).to_bytes(4, "big") + b"hdlr" + bytes(4)
    path = tmp_path / "a.mp4"
    path.write_bytes(
        box(b"ftyp", b"isom" + bytes(4)) + box(b"moov", box(b"meta", names)) + b"1" * 16
    )
    check_counts(path, 100)


def test_indices_that_the_file_holds_are_read(tmp_path, sound):
    mp4, fragments = sound
    for data in (mp4, fragments, compressed(mp4), renamed(mp4, b"moov"), edits(mp4, 5)):
        path = tmp_path / "sound.mp4"
        path.write_bytes(data)
        assert len(VideoReader(path)) >= 12
    plain = ("pcm_s16le", 48000, np.zeros(480_000))
    assert len(VideoReader(clips.write(tmp_path / "sound.mov", codec="mjpeg", pixels="yuvj420p",
                                       sound=plain))) == 12  # fmt: skip


def test_any_index_that_takes_too_much_memory_is_refused(tmp_path, sound, monkeypatch):
    """Also where nothing here knows the form of the file."""
    monkeypatch.setattr(container, "check_counts", lambda *_: None)
    path = tmp_path / "hostile.mp4"
    path.write_bytes(videos.with_tables(sound[0], 3_000_000, 1))
    with pytest.raises(InputError, match=r"its index takes over 50 MB; `max_mb=800` allows"):
        VideoReader(path, max_mb=400)


def test_an_opening_that_takes_too_long_is_left(monkeypatch):
    monkeypatch.setattr(watch, "_PATIENCE", 0.2)
    ended = threading.Event()

    def spin():
        while not ended.is_set():
            sum(range(1000))

    with pytest.raises(InputError, match=r"x\.avi: its index takes over 0 s to read"):
        watch.watched("x.avi", spin, 0, 4096)
    ended.set()
    assert watch.watched("x.avi", lambda: 3, 0, 4096) == 3
    with pytest.raises(ZeroDivisionError):
        watch.watched("x.avi", lambda: 1 // 0, 0)


def test_an_interruption_does_not_wait_for_a_library():
    ended = threading.Event()
    threading.Timer(0.2, _thread.interrupt_main).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        threads.apart(lambda: ended.wait(30))
    ended.set()
    assert time.monotonic() - began < 10


def test_memory_that_is_held_is_measured():
    before = allocator.held()
    block = np.ones(100 << 20, np.uint8)
    assert 90 << 20 < allocator.held() - before < 300 << 20
    assert block[-1] == 1


def test_pictures_that_grow_are_not_decoded(tmp_path):
    """The header states 64 x 36; the last picture has 1280 x 720, and 7.5 MB are allowed."""
    path = tmp_path / "grows.webm"
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libvpx-vp9", rate=24)
        stream.width, stream.height, stream.pix_fmt = 64, 36, "yuv420p"
        file.start_encoding()
        for n, data in enumerate([*packets((64, 36), 3), *packets((1280, 720), 1)]):
            packet = av.Packet(data)
            packet.stream, packet.time_base = stream, Fraction(1, 24)
            packet.pts = packet.dts = n
            packet.is_keyframe = True
            file.mux(packet)
    reader = VideoReader(path, max_mb=30)
    assert [number for number, _ in reader] == [0, 1, 2]
    assert "1 of 4 pictures could not be decoded" in reader.loss()


def packets(size: tuple[int, int], count: int) -> list[bytes]:
    context = av.CodecContext.create("libvpx-vp9", "w")
    context.width, context.height, context.pix_fmt = *size, "yuv420p"
    context.time_base = Fraction(1, 24)
    context.options = {"deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}
    frame, found = clips.grey(size), []
    for n in range(count):
        frame.pts = n
        found += context.encode(frame)
    return [bytes(packet) for packet in [*found, *context.encode(None)]]


def test_too_many_packets_are_refused(tmp_path, monkeypatch):
    path = clips.write(tmp_path / "in.mkv", codec="ffv1")
    monkeypatch.setattr("wgmb.io.limits._TIMES", 0.1)
    with pytest.raises(InputError, match=r"in\.mkv: gives \d packets and [\d,]+ bytes already"):
        VideoReader(path)


def test_some_numbers_that_are_too_large_end_with_one_line_or_the_picture(tmp_path):
    """All of them: `python tools/soak.py --rows stated`."""
    kinds = ["exr", "fragments", "mp4"]
    ended = apart(stated.tried, kinds, 2, str(tmp_path), seconds=240)
    assert ended.value is not None, ended.err
    for found in ended.value.values():
        assert (found["wrong"], found["files"]) == ([], 2)


def judged(folder: str) -> list[str]:
    """Faults in three pictures: another one, a copy's, and the sound file's."""
    stated.prepare()
    kind = stated.all_kinds()["mp4"]
    path, output = (Path(folder) / name for name in ("in.mp4", "out.mkv"))
    kind.write(path)
    words = kind.commands(path, output)[1]
    measured = stated.measure(words, output, kind.digest)
    times, pictures = json.loads(measured.digest)
    other = measured._replace(digest=json.dumps([times, pictures[::-1]]))
    cases = (other, "[[], []]"), (measured, "[[], []]"), (other, other.digest)
    return [stated._wrong_picture(kind, path, output, 1, one, sound) for one, sound in cases]


@pytest.mark.full
def test_a_picture_is_right_if_a_copy_of_the_file_or_the_sound_file_gives_it(tmp_path):
    ended = apart(judged, str(tmp_path), seconds=120)
    assert ended.value is not None, ended.err
    wrong, *right = ended.value
    assert wrong.startswith("another picture; a copy gives another")
    assert right == ["", ""]


def test_a_reading_that_is_left_closes_its_file_itself(tmp_path, monkeypatch):
    """FFmpeg must not close a file while another thread reads it."""
    path, readers, ended = clips.write(tmp_path / "in.mkv", codec="ffv1"), [], threading.Event()

    def slow(container, *_):
        readers.append(container)
        ended.wait(30)
        readers.append([packet.size for packet in container.demux() if packet.size])

    monkeypatch.setattr("wgmb.video.read.reader.scanned", slow)
    threading.Timer(0.5, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        VideoReader(path)
    ended.set()
    until = time.monotonic() + 30
    while len(readers) < 2 and time.monotonic() < until:
        time.sleep(0.01)
    assert len(readers[1]) == 12


def test_sound_whose_first_packet_is_too_large_is_left_out(tmp_path):
    """FFmpeg has no memory for 2 GB: the pictures are blurred, and the damage is told."""
    path = clips.write(tmp_path / "in.mp4", tone=0.2, muxing=FRAGMENTS)
    data = bytearray(path.read_bytes())
    runs = [inside for name, _, inside, _ in videos.boxes(bytes(data)) if name.endswith("/trun")]
    for inside in runs[-1:]:  # of the sound, whose packets state their sizes
        flags = int.from_bytes(data[inside + 1 : inside + 4], "big")
        at = inside + 8 + 4 * bool(flags & 1) + 4 * bool(flags & 4) + 4 * bool(flags & 0x100)
        data[at : at + 4] = (2**31 - 1).to_bytes(4, "big")
    path.write_bytes(data)
    blur_video(path, tmp_path / "out.mkv", flow="none")
    assert len(VideoReader(tmp_path / "out.mkv")) == 12


def test_sound_that_contradicts_its_header_is_left_out(tmp_path):
    """Its header says nothing of its AAC, which Matroska then expects in another form."""
    path = clips.write(tmp_path / "in.mp4", tone=0.2)
    data = bytearray(path.read_bytes())
    at = data.index(b"esds") + 12  # behind version, flags, and the tag of the first descriptor
    data[at : at + 4] = (30_000_000).to_bytes(4, "big")
    path.write_bytes(data)
    report = blur_video(path, tmp_path / "out.mkv", flow="none")
    assert [text for text in report.left_out if "stream 1 (sound" in text]
    with av.open(str(tmp_path / "out.mkv")) as out:
        assert [stream.type for stream in out.streams] == ["video"]


def test_files_of_too_many_streams_are_refused(tmp_path, sound):
    """1000 streams of pictures took 700 MB each time that the file was opened."""
    begin, end = index_of(sound[0])
    tracks = [sound[0][b:e] for name, b, _, e in videos.boxes(sound[0]) if name == "/moov/trak"]
    for count, message in ((101, "has 102 streams, 102 of them"), (1001, "has over 1000")):
        path = tmp_path / "many.mp4"
        moov = box(b"moov", sound[0][begin + 8 : end], tracks[0] * count)
        path.write_bytes(sound[0][:begin] + moov)
        with pytest.raises(InputError, match=rf"many\.mp4: {message}"):
            VideoReader(path)
