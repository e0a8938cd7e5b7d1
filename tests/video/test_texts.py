"""Texts of a video (title, comment, ...): kept or named, and the record beside them."""

import av
import pytest

import make_clips as clips
from wgmb import blur_video
from wgmb.io import record
from wgmb.io.suffixes import VIDEOS
from wgmb.video.read.reader import VideoReader
from wgmb.video.write.texts import fitting

TEXTS = {
    "title": "A clip", "artist": "somebody", "album_artist": "others", "composer": "one",
    "album": "all", "date": "2024", "genre": "film", "copyright": "(c)", "description": "long",
    "synopsis": "short", "grouping": "a", "lyrics": "b", "keywords": "c", "show": "d",
    "network": "e", "make": "f", "model": "g", "wgmb": "h", "odd": "i",
    "creation_time": "2024-02-03T04:05:06.000000Z", "location": "+48.2000+016.3000/",
}  # fmt: skip
TEXTS["comment"] = "ü " * 40_000  # longer than the 16 bits of MOV's older form


def source(folder, suffix=".mkv", texts=TEXTS):
    """A clip whose file has these texts."""
    path = folder / f"in{suffix}"
    codec, pixels = {".webm": ("libvpx-vp9", "yuv420p"), ".gif": ("gif", "rgb8")}.get(
        suffix, ("libx264", "yuv420p")
    )
    size = [clips.grey((64, 48), pixels) for _ in range(6)]
    return clips.write(
        path, size, codec=codec, pixels=pixels, before=lambda out: out.metadata.update(texts)
    )


def blurred(path, to, **more):
    """The output, made of the clip."""
    blur_video(path, to, flow="none", fps=10, **more)
    return to


def texts_of(path):
    with av.open(str(path)) as container:
        assert sum(1 for _ in container.decode(video=0)) > 1
        return {key.lower(): text for key, text in container.metadata.items()}


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("suffix", VIDEOS)
def test_every_text_is_kept_or_named_and_the_video_is_known_again(tmp_path, suffix, resume):
    path, to = source(tmp_path), tmp_path / f"o{suffix}"
    made = blur_video(path, to, flow="none", fps=12, resume=resume)
    assert record.read_file(to)[1]
    assert not blur_video(path, to, flow="none", fps=12, resume=True).is_new
    held, said = texts_of(to), " ".join(made.left_out).lower()
    lost = {name for name, text in TEXTS.items() if held.get(name) != text}
    assert "comment" not in lost
    assert all(f" {name}" in said for name in lost), said
    expected = {
        ".mov": set(), ".mkv": set(), ".webm": set(), ".gif": set(TEXTS) - {"comment"},
        ".mp4": {"make", "model", "odd", "wgmb"},
    }  # fmt: skip
    assert lost == expected[suffix]


@pytest.mark.parametrize("suffix", VIDEOS)
@pytest.mark.parametrize("name", ["comment", "description", "title", "wgmb"])
def test_one_text_breaks_no_video(tmp_path, suffix, name):
    path, to = source(tmp_path, ".mkv", {name: '{"seal": "000000000000-00000000"}'}), tmp_path / "o"
    blur_video(path, to := to.with_suffix(suffix), flow="none", fps=12)
    assert not blur_video(path, to, flow="none", fps=12, resume=True).is_new


@pytest.mark.parametrize("suffix", VIDEOS)
def test_a_result_has_its_own_record_alone(tmp_path, suffix):
    """And none in what players show as its comment."""
    one = blurred(source(tmp_path, texts={}), tmp_path / f"a{suffix}")
    two = blurred(one, tmp_path / f"b{suffix}")
    data = two.read_bytes()
    assert data.count(b'{"seal": "') == 1
    assert "comment" not in texts_of(two)
    assert record.read(data)["input"][0] == f"a{suffix}"


def old_result(folder):
    """A result of earlier versions, whose comment was the record."""
    return source(folder, texts={"comment": record.blank({"flow": "none"}), "title": "mine"})


def test_the_record_of_an_input_is_no_text_of_the_output(tmp_path):
    to = blurred(old_result(tmp_path), tmp_path / "o.mp4")
    assert texts_of(to)["title"] == "mine"
    assert "comment" not in texts_of(to)


@pytest.mark.parametrize("comment", ["", "mine", "long " * 200])
def test_a_gif_ends_with_its_trailer(tmp_path, comment):
    """The record stood behind it: other programs called that trailing garbage."""
    path = source(tmp_path, texts={"comment": comment} if comment else {})
    to = blurred(path, tmp_path / "o.gif")
    data = to.read_bytes()
    colors = data[10]
    at = 13 + (3 << (colors & 7) + 1 if colors & 128 else 0)
    kinds = []
    while data[at] != 0x3B:
        kinds.append(data[at : at + 2] if data[at] == 0x21 else data[at : at + 1])
        if data[at] == 0x2C:
            at += 10 + (3 << (data[at + 9] & 7) + 1 if data[at + 9] & 128 else 0) + 1
        else:
            assert data[at] == 0x21
            at += 2
        while data[at]:
            at += 1 + data[at]
        at += 1
    assert at == len(data) - 1
    assert kinds.count(b"\x21\xfe") == bool(comment)
    assert texts_of(to).get("comment", "") == comment


@pytest.mark.parametrize("behind", [b"\x21\xfe\x04mine\0\x3b", b"\x3b", b"\x3b{more}" * 99])
def test_what_follows_the_last_picture_of_a_gif_is_no_picture(tmp_path, behind):
    """A comment there was one picture more, which could not be decoded."""
    path = source(tmp_path, ".gif", {})
    path.write_bytes(path.read_bytes()[:-1] + behind)
    made = blur_video(path, tmp_path / "o.mkv", flow="none")
    assert (made.loss, len(VideoReader(path))) == ("", 6)


@pytest.mark.parametrize("suffix", [".mp4", ".mov"])
def test_the_boxes_fill_the_file(tmp_path, suffix):
    to = blurred(source(tmp_path), tmp_path / f"o{suffix}")
    data, at, kinds = to.read_bytes(), 0, []
    while at < len(data):
        kinds.append(data[at + 4 : at + 8])
        at += int.from_bytes(data[at : at + 4])
    assert at == len(data)
    assert kinds.count(b"uuid") == 1


@pytest.mark.parametrize("suffix", [".mkv", ".webm"])
def test_the_segment_fills_the_file(tmp_path, suffix):
    to = blurred(source(tmp_path), tmp_path / f"o{suffix}")
    data = to.read_bytes()
    at = data.index(b"\x18\x53\x80\x67") + 4
    assert data[at] == 1
    assert at + 8 + int.from_bytes(data[at + 1 : at + 8]) == len(data)


def test_names_that_cannot_be_shown_are_quoted_and_cut():
    _, _, said = fitting(".gif", {"a\nb": "x", "y" * 999: "z"})
    assert said == [
        f"texts 'a\\nb', '{'y' * 40}' are left out: .gif cannot hold them (.mkv holds them)"
    ]


def test_a_text_with_a_language_has_two_names_in_ffmpeg_and_is_one():
    assert fitting(".mp4", {"comment": "a", "comment-eng": "a"})[2] == []
    _, _, said = fitting(".mp4", {"comment": "a", "comment-deu": "b"})
    assert said == ["text comment-deu is left out: .mp4 cannot hold it (.mkv holds it)"]
