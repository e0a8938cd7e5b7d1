"""Two writers of one frame: nothing is lost, whoever reads a finished name reads a whole file."""

import os
import subprocess
import sys

import pytest

from wgmb.io import atomic

pytestmark = pytest.mark.fast

SIZE = 2_000_000
WRITER = """
import sys
from pathlib import Path
from wgmb.io.atomic import write_file
path, letter = Path(sys.argv[1]), sys.argv[2].encode()
print("begun", flush=True)
sys.stdin.readline()
for _ in range(60):
    write_file(path, letter * 1_000_000, letter * 1_000_000)
"""


def writer(path, letter: str) -> subprocess.Popen:
    line = [sys.executable, "-c", WRITER, path, letter]
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(list(map(str, line)), text=True, **pipes)


def test_120_racing_writes_fail_not_once_and_every_reader_sees_a_whole_file(tmp_path):
    path = tmp_path / "o.0001.exr"
    writers = [writer(path, letter) for letter in "ab"]
    for one in writers:
        assert one.stdout.readline() == "begun\n"
    for one in writers:
        one.stdin.write("\n")
        one.stdin.flush()
    seen = set()
    while any(one.poll() is None for one in writers):
        if path.exists():
            data = path.read_bytes()
            assert len(data) == SIZE
            assert len(set(data)) == 1
            seen.add(data[:1])
    assert [(one.communicate(), one.returncode) for one in writers] == [(("", ""), 0)] * 2
    assert seen
    assert list(tmp_path.iterdir()) == [path]


def test_a_writer_between_the_steps_of_another_leaves_both_files_whole(tmp_path):
    """By hand: the second one has created its file when the first one renames its own."""
    path = tmp_path / "o.0001.exr"
    first, second = (atomic.temporary_name(path) for _ in range(2))
    descriptors = [os.open(first, os.O_WRONLY | os.O_CREAT), atomic.create(second)]
    os.write(descriptors[0], b"first")
    atomic.rename(first, path)
    assert path.read_bytes() == b"first"
    os.write(descriptors[1], b"second")
    atomic.rename(second, path)
    assert path.read_bytes() == b"second"
    for descriptor in descriptors:
        os.close(descriptor)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="tells of a zombie by /proc")
def test_what_a_killed_process_left_goes_though_nobody_has_asked_for_its_exit_status(tmp_path):
    code = f"""import sys
from pathlib import Path
from wgmb.io import atomic
atomic.create(atomic.temporary_name(Path({str(tmp_path / "a.exr")!r})))
print(flush=True)
sys.stdin.read()"""
    writer = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert writer.stdout.readline()
    (left,) = tmp_path.iterdir()
    atomic.sweep(tmp_path, ["a.exr"])
    assert left.exists()
    writer.kill()
    os.waitid(os.P_PID, writer.pid, os.WEXITED | os.WNOWAIT)
    atomic.sweep(tmp_path, ["a.exr"])
    assert not left.exists()
    writer.communicate()
