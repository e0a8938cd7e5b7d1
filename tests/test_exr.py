"""EXR files among threads, forks and limits: each compression, fewer layers, no bombs."""

import os
import subprocess
import sys
import textwrap
import threading

import numpy as np
import OpenEXR
import pytest

import make_frames as make
from wgmb import Clip, InputError, Output
from wgmb.io import exr, limits, native, record, stills

LOSSLESS = ("none", "rle", "zips", "zip", "piz")
LOSSY = ("pxr24", "b44", "b44a", "dwaa", "dwab")
CRYPTO = {"cryptomatte/1a2b3c4/name": "Crypto"}


def script(text: str, *arguments, timeout=60) -> subprocess.CompletedProcess:
    """A Python program as a process of its own."""
    line = [sys.executable, "-c", textwrap.dedent(text), *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=timeout)


def together(*works) -> None:
    """Run all at the same time; an error of any is raised."""
    errors: list[BaseException] = []

    def guarded(work):
        try:
            work()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=guarded, args=(work,), daemon=True) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()
    if errors:
        raise errors[0]


# ---- threads --------------------------------------------------------------------------------


def test_reading_and_writing_overlap(tmp_path, monkeypatch):
    """Two threads that read pixels and one that writes are in the library at the same time."""
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    file, barrier, plain = exr.read(path), threading.Barrier(3), OpenEXR.File

    def meet(*arguments, **options):
        if not options.get("header_only"):
            barrier.wait(30)
        return plain(*arguments, **options)

    monkeypatch.setattr(OpenEXR, "File", meet)
    together(lambda: exr.read(path), lambda: exr.read(path), lambda: exr.encode(file))


THREADS = """
    import os, sys, threading
    import OpenEXR
    from wgmb import InputError
    from wgmb.cli import terminal
    from wgmb.io import exr
    terminal.own_streams()
    sound, bad = sys.argv[1:]
    stdout, whole = sys.stdout, exr.read(sound)
    before = [(os.fstat(fd).st_dev, os.fstat(fd).st_ino) for fd in (1, 2)]
    start, faults, reading = threading.Barrier(4), [], [1, 1]

    def read(which):
        start.wait(30)
        for _ in range(25):
            exr.read(sound)
            try:
                exr.read(bad)
                faults.append("the damaged file was read")
            except InputError as error:
                assert bad in str(error)
        reading.pop()

    def write():
        start.wait(30)
        while reading:
            if exr.encode(whole) != once:
                faults.append("other bytes")

    def talk():
        start.wait(30)
        while reading:
            said.append(len(said))
            print(said[-1])

    once, said = exr.encode(whole), []
    threads = [threading.Thread(target=t) for t in (lambda: read(0), lambda: read(1), write, talk)]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
    assert sys.stdout is stdout, sys.stdout
    assert [(os.fstat(fd).st_dev, os.fstat(fd).st_ino) for fd in (1, 2)] == before
    assert not faults, faults
    assert OpenEXR.global_thread_count() == min(8, len(os.sched_getaffinity(0)))
    print("last", len(said))
    os.write(1, b"one\\n")
    os.write(2, b"two\\n")
"""


def test_threads_lose_nothing_that_is_printed_and_let_no_chatter_through(tmp_path):
    sound = make.write_exr(tmp_path / "a.exr", make.frame(1))
    data = bytearray(sound.read_bytes())
    data[-2000:-1900] = bytes(100)
    bad = tmp_path / "bad.exr"
    bad.write_bytes(bytes(data))
    done = script(THREADS, sound, bad)
    assert (done.returncode, done.stderr) == (0, "two\n")
    *numbers, last, one = done.stdout.splitlines()
    assert numbers == [str(n) for n in range(len(numbers))]
    assert (last, one) == (f"last {len(numbers)}", "one")


class Stream:
    """A text stream that lives on descriptor `fd`."""

    def __init__(self, fd: int):
        self.text, self.fileno = "", lambda: fd

    def write(self, text: str) -> int:
        self.text += text
        return len(text)


def where(fd: int) -> tuple[int, int]:
    at = os.fstat(fd)
    return at.st_dev, at.st_ino


CHATTER = ("Warning: Exception raised reading pixel data for part", " ", "0", "\n")


def test_the_last_of_several_threads_ends_the_redirection(monkeypatch):
    out, err = Stream(50), Stream(51)
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    before, nowhere = (where(1), where(2)), os.stat(os.devnull)
    entered, left = threading.Event(), threading.Event()

    def other():
        with native.hushed() as heard:
            entered.set()
            assert left.wait(30)
            sys.stdout.write(CHATTER[0])
            sys.stdout.write("\n")
            sys.stdout.write("mine\n")
            assert heard == [CHATTER[0], "\n"]

    thread = threading.Thread(target=other)
    with native.hushed() as heard:
        thread.start()
        assert entered.wait(30)
        for text in CHATTER[:2]:
            sys.stdout.write(text)
    assert heard == list(CHATTER[:2])
    sys.stdout.write("between\n")  # the other thread is still within
    assert where(1) == where(2) == (nowhere.st_dev, nowhere.st_ino)
    left.set()
    thread.join(30)
    assert (where(1), where(2)) == before
    assert sys.stdout is out
    assert out.text == "between\nmine\n"


def test_a_stream_that_somebody_else_put_there_meanwhile_stays(monkeypatch):
    mine, theirs = Stream(1), Stream(1)
    monkeypatch.setattr(sys, "stdout", mine)
    with native.hushed():
        sieve = sys.stdout
        sys.stdout = theirs
    assert sys.stdout is theirs
    sys.stdout = sieve  # theirs is taken away: what was there before comes back
    sys.stdout.write("to me")
    with native.hushed():
        pass
    assert sys.stdout is mine
    assert mine.text == "to me"


def test_without_a_stdout_files_are_read_and_damaged_ones_refused(tmp_path, monkeypatch):
    sound = make.write_exr(tmp_path / "a.exr", make.frame(1))
    (tmp_path / "bad.exr").write_bytes(sound.read_bytes()[:-2000])
    monkeypatch.setattr(sys, "stdout", None)
    exr.read(sound)
    with pytest.raises(InputError, match="damaged"):
        exr.read(tmp_path / "bad.exr")
    assert sys.stdout is None


BUSY = """
    import os, sys, threading, time
    import numpy as np
    from wgmb.io import exr
    path, made = sys.argv[1], exr.new(np.random.default_rng(0).random((600, 600, 3), "f4"))
    once = exr.encode(made)

    def work():
        while True:
            exr.read(path)
            exr.encode(made)

    threading.Thread(target=work, daemon=True).start()
    time.sleep(0.1)
"""


def test_a_child_forked_while_others_read_and_write_does_so_too(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    more = """
    for _ in range(4):
        if (pid := os.fork()) == 0:
            exr.read(path)
            os._exit(0 if exr.encode(made) == once else 1)
        while os.waitpid(pid, os.WNOHANG) == (0, 0):
            time.sleep(0.01)
    """
    done = script(BUSY + more, path)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_process_may_end_while_a_thread_writes(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    done = script(BUSY + "    sys.exit(7)", path)
    assert (done.returncode, done.stderr) == (7, "")


def test_a_program_that_chose_how_many_threads_the_library_has_keeps_them():
    done = script("""
        import OpenEXR
        import numpy as np
        from wgmb.io import exr
        OpenEXR.set_global_thread_count(3)
        exr.encode(exr.new(np.zeros((4, 4, 3), "f4")))
        print(OpenEXR.global_thread_count())
    """)
    assert done.stdout == "3\n"


def test_the_same_parts_give_the_same_bytes_among_threads(tmp_path):
    rng = np.random.default_rng(1)
    channels = {c: rng.random((300, 200), "f4") for c in "RGBZ"}
    file = exr.read(make.write_exr(tmp_path / "a.exr", channels))
    got: list[bytes] = []
    together(*[lambda: got.append(exr.encode(file))] * 4)
    assert len(got) == 4
    assert len(set(got)) == 1


# ---- compression ----------------------------------------------------------------------------


def channels(rows=40, columns=70) -> dict[str, np.ndarray]:
    """Half, float and uint, smooth where lossy kinds are good."""
    y, x = np.mgrid[:rows, :columns].astype("f4")
    smooth = {c: (0.5 + 0.3 * np.sin(x / 9 + i) * np.cos(y / 7)) for i, c in enumerate("RGB")}
    made = {name: plane.astype("f2") for name, plane in smooth.items()}
    made["Z"] = (5 + x / 11 + y / 13).astype("f4")
    made["id"] = (x * 1e7).astype("u4")
    return made


@pytest.mark.parametrize("name", exr.COMPRESSIONS)
def test_each_compression_round_trips(tmp_path, name):
    given = channels()
    file = exr.read(make.write_exr(tmp_path / "a.exr", given, compression=OpenEXR.RLE_COMPRESSION))
    out = tmp_path / "o.exr"
    out.write_bytes(exr.encode(file, name))
    assert make.plain_header(out)["compression"] == exr.COMPRESSIONS[name]
    got = make.plain_read(out)
    for channel, plane in given.items():
        assert got[channel].dtype == plane.dtype
        if name in LOSSLESS or channel == "id":
            np.testing.assert_array_equal(got[channel], plane)
        else:
            np.testing.assert_allclose(got[channel], plane, atol=0.02)
    assert set(exr.COMPRESSIONS) == {*LOSSLESS, *LOSSY}


def test_same_is_the_compression_of_each_part(tmp_path):
    kinds = (OpenEXR.PIZ_COMPRESSION, OpenEXR.DWAA_COMPRESSION, OpenEXR.ZIPS_COMPRESSION)
    parts = [make.part(channels(), name=f"p{i}", compression=k) for i, k in enumerate(kinds)]
    out = tmp_path / "o.exr"
    out.write_bytes(exr.encode(exr.read(make.write_parts(tmp_path / "a.exr", parts)), "same"))
    got = [make.plain_header(out, i)["compression"] for i in range(3)]
    assert got == list(kinds)


def test_an_unknown_compression_is_refused_with_those_there_are():
    with pytest.raises(InputError, match=r"none.*dwab.*same.*'zipp'"):
        exr.encode(exr.new(np.zeros((4, 4, 3), "f4")), "zipp")


@pytest.mark.parametrize("name", [*LOSSY, "same"])
def test_no_lossy_compression_touches_the_ids_of_a_cryptomatte(tmp_path, name):
    given = channels() | {f"Crypto00.{c}": np.ones((40, 70), "f4") for c in "RGBA"}
    path = make.write_exr(tmp_path / "a.exr", given, CRYPTO, compression=OpenEXR.DWAA_COMPRESSION)
    with pytest.raises(InputError, match=r"a\.exr.*lossy.*Cryptomatte Crypto"):
        exr.encode(exr.read(path), name)
    exr.encode(exr.read(path), "piz")


def test_a_cryptomatte_whose_part_bears_its_name_is_known(tmp_path):
    ids = dict.fromkeys("RGBA", np.ones((40, 70), "f4"))
    parts = [make.part(channels(), name="rgb"), make.part(ids, CRYPTO, name="Crypto00")]
    file = exr.read(make.write_parts(tmp_path / "a.exr", parts))
    with pytest.raises(InputError, match="Cryptomatte Crypto"):
        exr.encode(file, "dwaa")


def blur(capsys, pattern, out, *options):
    return make.inside(capsys, "blur", pattern, "-o", out, *options)


def test_the_command_line_takes_a_compression(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    plain, out = tmp_path / "p.0001.exr", tmp_path / "o.0001.exr"
    assert blur(capsys, pattern, tmp_path / "p.####.exr")[0] == 0
    assert blur(capsys, pattern, tmp_path / "o.####.exr", "--compression", "piz")[0] == 0
    assert make.plain_header(plain)["compression"] == OpenEXR.ZIP_COMPRESSION
    assert make.plain_header(out)["compression"] == OpenEXR.PIZ_COMPRESSION
    got = make.plain_read(out)
    for name, plane in make.plain_read(plain).items():
        assert got[name].tobytes() == plane.tobytes()


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [("o.####.exr", ("--compression", "zipp"), "zipp"),
     ("o.####.exr", ("--layers", "some"), "some"),
     ("o.####.png", ("--compression", "piz"), "piz"), ("o.mp4", ("--compression", "same"), "same")],
)  # fmt: skip
def test_what_cannot_be_written_so_is_one_line_and_2(tmp_path, capsys, name, options, says):
    pattern = make.write_sequence(tmp_path, (1,))
    code, out, err = blur(capsys, pattern, tmp_path / "out" / name, *options)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert not (tmp_path / "out").exists()


# ---- layers ---------------------------------------------------------------------------------


def test_the_picture_alone_is_written_where_no_layers_are_wanted(tmp_path, capsys):
    crypto = {f"Crypto00.{c}": np.ones((48, 64), "f4") for c in "RGBA"}
    attributes = CRYPTO | {"owner": "me"}
    path = make.write_exr(tmp_path / "a.exr", make.frame(1) | crypto, attributes,
                          data=(-9, 5, 54, 52), display=(0, 0, 79, 59))  # fmt: skip
    assert blur(capsys, path, tmp_path / "all.exr")[0] == 0
    assert blur(capsys, path, tmp_path / "o.exr", "--layers", "picture")[0] == 0
    got, want = make.plain_read(tmp_path / "o.exr"), make.plain_read(tmp_path / "all.exr")
    assert sorted(got) == [f"ViewLayer.Combined.{c}" for c in "ABGR"]
    assert all(got[name].tobytes() == want[name].tobytes() for name in got)
    header = make.plain_header(tmp_path / "o.exr")
    assert header["owner"] == "me"
    assert '"layers": "picture"' in header["wgmb"]
    assert not [name for name in header if name.startswith("cryptomatte")]
    assert tuple(np.concatenate(header["dataWindow"]).tolist()) == (-9, 5, 54, 52)


def test_a_lossy_picture_without_its_cryptomatte_can_be_had(tmp_path, capsys):
    crypto = {f"Crypto00.{c}": np.ones((48, 64), "f4") for c in "RGBA"}
    path = make.write_exr(tmp_path / "a.exr", make.frame(1) | crypto, CRYPTO)
    lossy = ("--compression", "dwaa")
    code, _, err = blur(capsys, path, tmp_path / "o.exr", *lossy)
    assert code == 1
    assert "Cryptomatte" in err
    assert not (tmp_path / "o.exr").exists()
    assert blur(capsys, path, tmp_path / "o.exr", *lossy, "--layers", "picture")[0] == 0


def test_of_many_parts_the_pictures_stays(tmp_path):
    parts = [make.part({"Z": np.ones((48, 64), "f4")}, {"owner": "b"}, name="depth"),
             make.part(make.colors(make.picture(1)), {"owner": "a"}, name="rgba")]  # fmt: skip
    (source,) = map(Clip(make.write_parts(tmp_path / "a.exr", parts)).source, [0])
    out = Output(tmp_path / "o.exr", numbers=[0], settings={"a": 1}, layers="picture")
    told = {"accepted": np.ones((48, 64), "f4")}
    out.write(make.picture(2), source, told)
    (part,) = exr.read(tmp_path / "o.exr").parts
    assert part.name == "rgba"
    assert sorted(part.channels) == ["A", "B", "G", "R", "confidence.accepted"]
    np.testing.assert_array_equal(part.channels["R"], make.picture(2)[..., 0].astype("f2"))
    assert part.attributes["owner"] == "a"
    assert record.read((tmp_path / "o.exr").read_bytes()) == {"a": 1}


@pytest.mark.parametrize("options", [("--layers", "picture"), ("--compression", "zips")])
def test_resume_redoes_frames_that_were_written_otherwise(tmp_path, capsys, options):
    pattern, out = make.write_sequence(tmp_path, (1, 2)), tmp_path / "o.####.exr"
    assert blur(capsys, pattern, out)[0] == 0
    assert blur(capsys, pattern, out, *options, "--resume")[2].startswith("2 frames")
    assert blur(capsys, pattern, out, *options, "--resume")[2].startswith("0 frames")


def test_passes_without_layers_are_refused(tmp_path, capsys):
    code, _, err = make.inside(capsys, "render", "crossing", "--passes", "--layers", "picture",
                               "-o", tmp_path / "o.exr")  # fmt: skip
    assert code == 2
    assert "--passes" in err


# ---- limits ---------------------------------------------------------------------------------


def promising(folder, width: int, height: int) -> tuple:
    """A small EXR whose header promises a picture of this size."""
    data = make.write_exr(folder / "whole.exr", make.frame(1)).read_bytes()
    start = b"dataWindow\0box2i\0\x10\0\0\0"
    at = data.index(start) + len(start)
    box = np.array([0, 0, width - 1, height - 1], "<i4").tobytes()
    path = folder / "bomb.exr"
    path.write_bytes(data[:at] + box + data[at + 16 :])
    return path


@pytest.mark.parametrize("size", [(16384, 16384), (8000, 8000), (6000, 6000)])
def test_what_would_unpack_to_gigabytes_is_refused_by_its_header(tmp_path, monkeypatch, size):
    path = promising(tmp_path, *size)
    plain = OpenEXR.File

    def header_alone(*arguments, **options):
        assert options.get("header_only")
        return plain(*arguments, **options)

    monkeypatch.setattr(OpenEXR, "File", header_alone)
    with pytest.raises(InputError, match=r"bomb\.exr.* MB.*`max_mb=\d+` allows it") as error:
        exr.read(path)
    assert f"{size[0]} x {size[1]}" in str(error.value)
    assert exr.read(path, header_only=True).parts[0].size == size


def test_the_limit_that_the_error_names_lets_the_file_in(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    with pytest.raises(InputError, match="`max_mb=1` "):
        exr.read(path, max_mb=0.05)
    exr.read(path, max_mb=1)
    (tmp_path / "a.png").write_bytes(stills.encode(make.picture(1), ".png", 8, "{}"))
    with pytest.raises(InputError, match=r"a\.png: image of 64 x 48.*`max_mb=1` "):
        stills.read(tmp_path / "a.png", max_mb=0.04)
    stills.read(tmp_path / "a.png", max_mb=1)


@pytest.mark.parametrize(
    ("size", "count", "stored", "fits"),
    [((7680, 4320), 4, 600_000, True),  # black
     ((3840, 2160), 16, 600_000, True),
     ((3840, 2160), 100, 500 << 20, True),
     ((16384, 16384), 3, 3_200_000, False),
     ((16384, 16384), 3, 500 << 20, True),
     ((32767, 32767), 4, 1 << 40, False)],
)  # fmt: skip
def test_black_frames_fit_into_the_limit_and_bombs_do_not(tmp_path, size, count, stored, fits):
    promised = limits.unpacked(size, count)
    if fits:
        limits.check(tmp_path, str(size), promised, stored, limits.MAX_MB)
        return
    with pytest.raises(InputError, match="max_mb") as error:
        limits.check(tmp_path, str(size), promised, stored, limits.MAX_MB)
    named = float(str(error.value).split("max_mb=")[1].split("`")[0])
    limits.check(tmp_path, str(size), promised, stored, named)


def test_the_command_line_raises_the_limit(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1, 2))
    for command in (("info", pattern), ("blur", pattern, "-o", tmp_path / "o.####.exr")):
        code, out, err = make.inside(capsys, *command, "--max-mb", 0.1)
        assert (code, out) != (0, "")
        assert f"{tmp_path}/shot.0001.exr: image of 64 x 48" in err
        assert make.inside(capsys, *command, "--max-mb", 1)[0] == 0


def test_too_many_channels_are_refused(tmp_path):
    dot = np.zeros((1, 1), "f2")
    path = make.write_exr(tmp_path / "a.exr", {f"c{i}.x": dot for i in range(4097)})
    with pytest.raises(InputError, match=r"a\.exr: 4097 channels; at most 4096"):
        exr.read(path)


SHORT = """
    import resource, sys
    import av  # before the limit, so that it is the pixels that lack memory
    from wgmb import InputError
    from wgmb.io import exr, stills
    small, damaged, large, png = sys.argv[1:]
    exr.read(small)
    used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    for more, path in ((20, large), (20, png), (200, damaged), (200, large)):
        resource.setrlimit(resource.RLIMIT_AS, (used + (more << 20), resource.RLIM_INFINITY))
        try:
            (exr if path.endswith(".exr") else stills).read(path)
            print("read")
        except InputError as error:
            print(error)
"""


def test_want_of_memory_is_told_apart_from_damage(tmp_path):
    black = np.zeros((2000, 2500), "f4")
    large = make.write_exr(tmp_path / "large.exr", dict.fromkeys("RGB", black))
    small = make.write_exr(tmp_path / "small.exr", make.frame(1))
    damaged, png = tmp_path / "damaged.exr", tmp_path / "large.png"
    damaged.write_bytes(small.read_bytes()[:-2000])
    png.write_bytes(stills.encode(np.stack([black] * 3, 2), ".png", 8, "{}"))
    done = script(SHORT, small, damaged, large, png)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    first, second, third, fourth = done.stdout.splitlines()
    assert first == f"{large}: not enough memory for 57 MB of pixels"
    assert second == f"{png}: not enough memory for its pixels"
    assert third.startswith(f"{damaged}: damaged or cut off: ")
    assert fourth == "read"


# ---- sizes ----------------------------------------------------------------------------------


def test_frames_of_another_size_are_named_at_the_end(tmp_path, capsys):
    for n, rows in ((1, 48), (2, 24), (3, 48), (4, 24), (5, 48)):
        make.write_exr(tmp_path / f"s.{n:04d}.exr", {k: v[:rows] for k, v in make.frame(n).items()})
    out = tmp_path / "o.####.exr"
    code, _, err = blur(capsys, tmp_path / "s.####.exr", out, "--method", "tap")
    assert code == 0
    assert "frames of another size than most, 64 x 48: 2,4: 64 x 24\n" in err
    code, _, err = blur(capsys, tmp_path / "s.####.exr", out, "--frames", "1,3", "--overwrite")
    assert (code, "another size" in err) == (0, False)


def test_windows_that_differ_within_one_display_are_no_other_size(tmp_path, capsys):
    for n, left in ((1, 0), (2, 10)):
        cut = {k: v[:, left:] for k, v in make.frame(n).items()}
        make.write_exr(tmp_path / f"s.{n:04d}.exr", cut, data=(left, 0, 63, 47),
                       display=(0, 0, 63, 47))  # fmt: skip
    code, _, err = blur(capsys, tmp_path / "s.####.exr", tmp_path / "o.####.exr")
    assert (code, "another size" in err) == (0, False)
