"""Records are found in files that strangers made, and in files that are cut while they are read."""

import os
import time

import pytest

import make_frames as make
from wgmb.io import record, stills

pytestmark = pytest.mark.fast

TEXT = record.blank({"samples": 16})


def sealed(front: bytes = b"", behind: bytes = b"") -> bytes:
    return b"".join(record.seal(front + TEXT.encode() + behind, TEXT))


@pytest.mark.parametrize("front", [b"", b"x" * 99, b"\x89PNG\r\n\x1a\n", b"GIF8"])
@pytest.mark.parametrize("piece", [40, 64, 1 << 20])
def test_a_record_is_found_wherever_pieces_end(tmp_path, monkeypatch, front, piece):
    monkeypatch.setattr(record, "_PIECE", piece)
    path = tmp_path / "a.bin"
    for length in range(13, 90, 7):
        data = sealed(front + bytes(length), bytes(200))
        path.write_bytes(data)
        if not front.startswith(b"GIF"):  # whose record is in blocks
            assert record.read(data) == {"samples": 16}
            assert record.read_file(path) == ({"samples": 16}, True)
        assert record.read(data + b"\0") is None
        assert record.read(data[:-1]) is None


def test_a_still_with_another_record_before_its_own_is_whole(tmp_path):
    other = record.blank({"samples": 3}).replace("000000000000-00000000", "000000000099-0123abcd")
    png = stills.encode(make.picture(1), ".png", 8, TEXT)
    for data in (b"".join(record.seal(png, TEXT)), sealed(other.encode())):
        assert record.read(data) == {"samples": 16}
        assert record.read(data[:-20] + b"\1" + data[-19:]) is None


@pytest.mark.parametrize(
    "rest",
    [b"}", b'"', b', "a": ' + b"[" * 50, b', "a": 1}'],
    ids=["broken", "open", "deep", "whole"],
)
def test_false_seals_cost_no_more_than_a_few_looks(tmp_path, rest):
    size = 0
    for _ in range(2):  # the length that each states is right
        one = b'{"seal": "%012d-0123abcd"' % size + rest
        data = one * 20_000
        size = len(data)
    path = tmp_path / "a.bin"
    path.write_bytes(data)
    began = time.process_time()
    assert record.read(data) is None
    assert not record.read_file(path)[1]
    assert time.process_time() - began < 1


def test_a_file_that_is_cut_while_it_is_read_is_not_whole(tmp_path, monkeypatch):
    path, checked = tmp_path / "a.mp4", record._digits
    path.write_bytes(sealed(b"ftyp", bytes(9 << 20)))

    def cut(*arguments):
        os.truncate(path, 1 << 20)
        return checked(*arguments)

    monkeypatch.setattr(record, "_digits", cut)
    assert record.read_file(path) == ({"samples": 16}, False)
