"""EXR files among threads and forks: nothing printed is lost, nothing chatters through."""

import os
import subprocess
import sys
import textwrap
import threading

import numpy as np
import OpenEXR
import pytest

import make_frames as make
from wgmb import InputError
from wgmb.io import exr, exr_library


def script(text: str, *arguments, timeout=60) -> subprocess.CompletedProcess:
    """A Python program as a process of its own."""
    quiet = "-W", "ignore::DeprecationWarning"  # of forks beside threads, which are the test
    line = [sys.executable, *quiet, "-c", textwrap.dedent(text), *map(str, arguments)]
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
        with exr_library.hushed() as heard:
            entered.set()
            assert left.wait(30)
            sys.stdout.write(CHATTER[0])
            sys.stdout.write("\n")
            sys.stdout.write("mine\n")
            assert heard == [CHATTER[0], "\n"]

    thread = threading.Thread(target=other)
    with exr_library.hushed() as heard:
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
    with exr_library.hushed():
        sieve = sys.stdout
        sys.stdout = theirs
    assert sys.stdout is theirs
    sys.stdout = sieve  # theirs is taken away: what was there before comes back
    sys.stdout.write("to me")
    with exr_library.hushed():
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
