"""Videos that are damaged, cut off or none, and streams that are not the pictures."""

import re
import struct
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from av.video.frame import PictureType
from PIL import Image

import make_clips as clips
from wgmb import InputError
from wgmb.video.read.container import picture_stream
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.stream_reader import StreamReader

pytestmark = pytest.mark.fast


def long(tmp_path, kind, count=48, **more):
    """A clip that nothing can be left out of unseen: pictures of noise."""
    rng = np.random.default_rng(3)
    frames = []
    for n in range(count):
        luma, *chroma = clips.planes(n)
        noise = rng.integers(0, 30, luma.shape, np.uint8)
        frames.append(clips.frame([luma + noise, *chroma], "yuv420p"))
    options = {"crf": "20", "g": "12"}
    return clips.write(tmp_path / f"c.{kind}", frames, options=options, tone=2, **more)


def test_an_mp4_without_its_end_says_what_is_missing(tmp_path):
    path = long(tmp_path, "mp4")
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(InputError, match=r"c\.mp4: is cut off: its index \(moov\)") as error:
        VideoReader(path)
    assert str(error.value).count("\n") == 0


@pytest.mark.parametrize(
    ("kind", "muxing"), [("mkv", {}), ("mp4", {"movflags": "faststart"}), ("avi", {})]
)
def test_a_file_that_was_cut_off_says_where(tmp_path, kind, muxing):
    tick = Fraction(1, 24)
    path = long(tmp_path, kind, muxing=muxing, tick=tick)
    whole = path.read_bytes()
    assert not any("cut off" in note for note in VideoReader(path).notes)
    path.write_bytes(whole[: len(whole) // 2])
    reader = VideoReader(path)
    got = [n for n, _ in reader]
    assert 10 < len(got) < 40
    (note,) = [note for note in reader.notes if "is cut off: it ends at" in note]
    assert note.endswith(("of 2.00 s", "of 2.02 s", "of 2.05 s"))


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
def test_damaged_bytes_are_counted_in_pictures(tmp_path, kind):
    path = long(tmp_path, kind)
    data = bytearray(path.read_bytes())
    at = len(data) // 3  # of several pictures: what threads see of one may be hidden by luck
    data[at : at + 4000] = np.random.default_rng(4).bytes(4000)
    path.write_bytes(data)
    reader = VideoReader(path)
    got = [n for n, _ in reader]
    assert len(got) + len(reader.missing) == len(reader)
    said = " ".join((reader.loss(), *reader.notes))
    assert any(word in said for word in ("could not be decoded", "are damaged", "pause once"))


def test_a_wrong_checksum_is_damage(tmp_path):
    """One byte of an animated PNG: its last rows were black, without a word."""
    made = [clips.frame(clips.planes(n, (64, 48)), "yuv420p") for n in range(3)]
    made = [one.reformat(format="rgb24") for one in made]
    path = tmp_path / "a.apng"
    clips.write(path, made, codec="apng", pixels="rgb24", tick=Fraction(1, 24))
    data = bytearray(path.read_bytes())
    data[data.index(b"fdAT") + 40] ^= 255
    path.write_bytes(data)
    reader = VideoReader(path)
    assert [n for n, _ in reader] == [0, 2]
    assert "1 of 3 pictures could not be decoded" in reader.loss()


@pytest.mark.parametrize("kind", ["mkv", "avi"])
@pytest.mark.parametrize("checksums", ["1", "0"])
def test_a_wrong_checksum_of_ffv1_is_damage(tmp_path, kind, checksums):
    """Its decoder shows a picture with wrong slices all the same, and those that build on it."""
    options = {"level": "3", "slicecrc": checksums}
    path = clips.write(
        tmp_path / f"a.{kind}",
        codec="ffv1",
        options=options,
        setup=lambda s: setattr(s, "gop_size", 6),
    )
    whole = dict(VideoReader(path).pictures())
    assert not VideoReader(path).loss()
    with av.open(str(path)) as container:
        packets = [bytes(p) for p in container.demux(video=0) if p.size]
    data = bytearray(path.read_bytes())
    data[data.index(packets[3]) + len(packets[3]) // 2] ^= 4
    path.write_bytes(data)
    with path.open("rb") as stream:
        piped = StreamReader(stream, "a")
        assert len(list(piped.pictures())) == 12
    reader = VideoReader(path)
    got = dict(reader.pictures())
    wrong = [
        n for n, one in got.items() if not all(map(np.array_equal, one.planes, whole[n].planes))
    ]
    assert wrong == [3, 4, 5]
    if checksums == "1":
        assert "3 damaged pictures, the first at" in reader.loss()
        assert piped.loss == "a: 3 damaged pictures"
    else:
        assert not reader.loss()  # nothing in the file tells


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"", "is empty"), (b"hello " * 100, "is not a video"), (None, "no such file")],
)
def test_what_is_no_video_is_one_line(tmp_path, content, said):
    path = tmp_path / "c.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=rf"c\.mp4: {said}") as error:
        VideoReader(path)
    assert "\n" not in str(error.value)


def test_sound_alone_has_no_pictures(tmp_path):
    path = tmp_path / "c.m4a"
    with av.open(str(path), "w", format="mp4") as out:
        sound = out.add_stream("aac", rate=48000)
        sound.layout = "mono"
        for block in clips.samples(0.2):
            out.mux(sound.encode(block))
        out.mux(sound.encode(None))
    with pytest.raises(InputError, match="no pictures that move; it holds audio"):
        VideoReader(path)


def test_absurd_sizes_are_refused(tmp_path):
    path = clips.write(tmp_path / "c.mp4", [clips.grey((1280, 720))])
    with pytest.raises(InputError, match="max_mb"):
        VideoReader(path, max_mb=2)


def test_names_that_look_like_addresses_are_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "http:").mkdir()
    path = clips.write(tmp_path / "x.mp4")
    path.rename(tmp_path / "http:" / "a%02d.mp4")
    assert len(VideoReader("http:/a%02d.mp4")) == 12


def test_a_playlist_leads_nowhere(tmp_path):
    (tmp_path / "c.m3u8").write_text("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n"
                                     "http://127.0.0.1:9/a.ts\n#EXT-X-ENDLIST\n")  # fmt: skip
    with pytest.raises(InputError, match=r"c\.m3u8: "):
        VideoReader(tmp_path / "c.m3u8")


def test_pictures_of_another_size_are_scaled_to_that_of_the_first(tmp_path):
    """Recordings of calls change their size; a raw stream is joined of two."""
    parts = []
    for size in ((64, 48), (128, 96)):
        frames = [clips.frame(clips.planes(n, size), "yuv420p") for n in range(4)]
        parts.append(clips.write(tmp_path / f"{size[0]}.h264", frames, kind="h264").read_bytes())
    (tmp_path / "both.h264").write_bytes(b"".join(parts))
    reader = VideoReader(tmp_path / "both.h264")
    assert not reader.scaling()
    pictures = dict(reader)
    assert reader.scaled == {4, 5, 6, 7} and len(pictures) == 8 and not reader.loss()
    assert "4 pictures of another size scaled to 64 x 48, from 0." in reader.scaling()
    for n, picture in pictures.items():
        assert picture.size == (64, 48)
        luma, want = picture.planes[0].astype(int), clips.planes(n % 4)[0]
        assert np.abs(luma - want).max() <= 2


def joined(tmp_path, begins, sizes=((64, 48), (128, 96))):
    """An MPEG-TS of parts that were written one by one, 12 pictures each, with B-frames."""
    data = b""
    for late, size in zip(begins, sizes, strict=True):
        frames = [clips.frame(clips.planes(n, size), "yuv420p") for n in range(12)]
        part = clips.write(tmp_path / "part.ts", frames, late=late, options={"bf": "2"})
        data += part.read_bytes()
    (tmp_path / "joined.ts").write_bytes(data)
    return tmp_path / "joined.ts"


def test_parts_that_follow_each_other_are_read_whole(tmp_path):
    reader = VideoReader(joined(tmp_path, (0, 1)))
    assert len(list(reader)) == 24 and reader.scaled == set(range(12, 24))
    assert not reader.loss() and not any("of another" in note for note in reader.notes)


def test_a_clock_that_goes_back_is_refused_with_what_helps(tmp_path):
    """Files that are simply joined begin anew: half of their pictures had no place of their own."""
    with pytest.raises(InputError) as error:
        VideoReader(joined(tmp_path, (0, 0)))
    said = str(error.value)
    assert re.search(
        r"joined\.ts: its clock goes back before picture 12, from 0.46 to 0.00 s", said
    )
    assert "`ffmpeg -i IN -c copy OUT.mkv` puts its parts one after the other" in said


def test_pictures_with_the_time_of_another_are_counted(tmp_path):
    """Parts that overlap: the first picture of a time is shown."""
    reader = VideoReader(joined(tmp_path, (0, 12 / 24)))
    (note,) = [note for note in reader.notes if "the time of another" in note]
    assert re.match(r"2 pictures have the time of another, the first at 0.50 s: left out", note)
    assert len(list(reader)) == len(reader) == 22 and not reader.loss()


@pytest.mark.parametrize("first", [0, 9, 14])
def test_times_of_decoding_that_begin_in_the_middle_are_noticed(tmp_path, first):
    """Of 24 pictures 7 were said not to be decoded: their times are those of other pictures."""
    parts = []
    for size, kind in (((64, 48), PictureType.I), ((128, 96), PictureType.NONE)):
        coder = av.CodecContext.create("libx264", "w")
        coder.width, coder.height = size
        coder.pix_fmt, coder.time_base, coder.framerate = "yuv420p", Fraction(1, 24), Fraction(24)
        coder.options = {"bf": "2", "b-adapt": "0", "b-pyramid": "none"}
        for n in range(12):
            frame = clips.frame(clips.planes(n, size), "yuv420p")
            frame.pts, frame.pict_type = n, kind
            parts += coder.encode(frame)
        parts += coder.encode(None)
    path = tmp_path / "d.ts"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for n, packet in enumerate(parts):
            packet.pts = packet.dts = n
            packet.time_base, packet.stream = Fraction(1, 24), stream
            out.mux(packet)
    reader = VideoReader(path)
    numbers = [n for n, _ in reader.pictures(first)]
    assert numbers == list(range(first, 24)) and not reader.loss()
    for n, picture in reader.pictures(first):
        want = clips.planes(n % 12)[0]
        assert np.abs(picture.planes[0].astype(int) - want).mean() < 4


def test_a_single_picture_has_the_rate_that_its_file_states(tmp_path):
    one = [clips.frame(clips.planes(0), "yuv420p")]
    assert VideoReader(clips.write(tmp_path / "a.mp4", one, rate=Fraction(50))).rate == 50


def test_a_stream_of_alpha_is_not_taken_for_the_pictures(tmp_path):
    """As in animated AVIF, where it may come with more bits than the pictures."""
    path = tmp_path / "a.mkv"
    with av.open(str(path), "w") as out:
        kinds = ("yuv420p", "gray")
        streams = [out.add_stream("ffv1", rate=24) for _ in kinds]
        for stream, pixels in zip(streams, kinds, strict=True):
            stream.width, stream.height, stream.pix_fmt = clips.WIDTH, clips.HEIGHT, pixels
        for n in range(3):
            planes = clips.planes(n)
            for stream, pixels in zip(streams, kinds, strict=True):
                one = clips.frame(planes if pixels == "yuv420p" else planes[:1], pixels)
                one.pts, one.time_base = n, Fraction(1, 24)
                out.mux(stream.encode(one))
        for stream in streams:
            out.mux(stream.encode(None))
    with av.open(str(path)) as container:

        class Streams:
            """Those of the container; FFmpeg thinks the grey one best."""

            video = container.streams.video

            def best(self, kind):
                return self.video[1]

        class Container:
            streams = Streams()

        assert picture_stream(Container(), path).index == 0  # pyright: ignore


def test_animated_webp_is_refused_by_its_name(tmp_path):
    frames = [Image.new("RGB", (32, 20), (40 * n, 0, 0)) for n in range(4)]
    path = tmp_path / "a.webp"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=40)
    with pytest.raises(InputError, match=r"a\.webp: animated WebP is not read; GIF, APNG and AVIF"):
        VideoReader(path)


def wider_screen(path: Path, size: tuple[int, int]) -> Path:
    """A GIF whose screen is made larger; its pictures stay as they are."""
    data = bytearray(path.read_bytes())
    data[6:10] = struct.pack("<HH", *size)
    path.write_bytes(data)
    return path


def test_a_small_gif_may_ask_for_4k_but_for_no_more(tmp_path):
    """A blur holds 100 bytes a pixel of it, and a small file may take 1 GB."""
    frames, tick = [clips.grey((64, 48), "rgb8") for _ in range(2)], Fraction(1, 20)
    path = clips.write(tmp_path / "s.gif", frames, codec="gif", pixels="rgb8", tick=tick)
    assert VideoReader(wider_screen(path, (4096, 2160))).size == (4096, 2160)
    with pytest.raises(InputError, match=r"s\.gif: .* over 10,737,418 pixels, .* `max_mb=8192` al"):
        VideoReader(wider_screen(path, (5000, 4000)))
    assert VideoReader(path, max_mb=8192).size == (5000, 4000)


@pytest.mark.full
def test_a_small_video_of_enormous_pictures_is_refused(tmp_path):
    """Its blur would hold 3 GiB."""
    frames, options = [clips.grey((8192, 8192))], {"preset": "ultrafast"}
    path = clips.write(tmp_path / "c.mp4", frames, options=options)
    assert path.stat().st_size < 1 << 20
    with pytest.raises(InputError, match=r"c\.mp4: image of 8192 x 8192 .* `max_mb=\d+` allows it"):
        VideoReader(path)


def test_a_limit_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match="`max_mb` must be above 0 megabytes, got nan"):
        VideoReader(clips.write(tmp_path / "c.mp4"), max_mb=float("nan"))
