"""A result is readable by nobody who may not read its input."""

import os
import stat
import sys
from fractions import Fraction

import numpy as np
import pytest

import make_frames as make
from wgmb import Clip, Output
from wgmb.io import atomic
from wgmb.video.write.frames import FrameVideo

pytestmark = pytest.mark.skipif(os.name == "nt", reason="permissions are the folder's there")

BLUR = ("blur", "--method", "tap")
AVERAGE = ("blur", "--flow", "none")
KINDS = {  # command, input, output
    "exr": (BLUR, "shot", "o.####.exr"),
    "png": (BLUR, "shot", "o.####.png"),
    "video of frames": (BLUR, "shot", "o.mp4"),
    "gif of frames": (BLUR, "shot", "o.gif"),
    "vectors": (("vectors", "--as", "nuke"), "shot", "o.####.exr"),
    "flo": (("vectors", "--as", "flo"), "shot", "o.####.flo"),
    "perceived frames": (("perceive",), "shot", "o.####.png"),
    "job": (("job", "--method", "tap"), "shot", "o.####.exr"),
    "motion": (("info",), "shot", "o.png"),
    "video": (AVERAGE, "clip", "o.mp4"),
    "resumed video": ((*AVERAGE, "--resume"), "clip", "o.mkv"),
    "frames of a video": (AVERAGE, "clip", "o.####.png"),
    "perceived video": (("perceive",), "clip", "o.mp4"),
}


@pytest.fixture
def umask():
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.fixture
def inputs(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    shot = make.write_sequence(folder, [1, 2])
    video = FrameVideo(folder / "clip.mkv", folder / "part", Fraction(24))
    for value in (0.1, 0.5, 0.9):
        video.add(np.full((32, 32, 3), value, "f4"))
    video.close()
    return {"shot": shot, "clip": folder / "clip.mkv"}


def allow(folder, mode):
    for path in folder.iterdir():
        path.chmod(mode)


def modes_in(folder):
    return {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()}


@pytest.mark.parametrize("kind", KINDS)
def test_a_result_is_readable_by_nobody_who_may_not_read_its_input(
    tmp_path, capsys, monkeypatch, umask, inputs, kind
):
    command, of, name = KINDS[kind]
    created = set()

    def seen(temporary, mode=atomic.PUBLIC):
        descriptor = create(temporary, mode)
        if not temporary.name.startswith(".run."):  # a lock, which is empty
            created.add(stat.S_IMODE(os.fstat(descriptor).st_mode))
        return descriptor

    create = atomic.create
    monkeypatch.setattr(atomic, "create", seen)
    for mode in (0o600, 0o640, 0o644):
        allow(tmp_path / "in", mode)
        to = tmp_path / f"{mode:o}"
        to.mkdir()
        created.clear()
        log = () if command[0] in ("info", "job") else ("--log-json", to / "run.log")
        job = ("-j", to / "j.json", "--slurm", to / "j.sh") if command[0] == "job" else ()
        code, _, err = make.inside(capsys, *command, inputs[of], "-o", to / name, *log, *job)
        assert code == 0, err
        assert modes_in(to) == created == {mode}


def test_a_log_is_its_owners_until_the_inputs_are_known(tmp_path, capsys, umask, inputs):
    log = tmp_path / "run.log"
    words = ("blur", "-o", tmp_path / "o.####.exr", "--log-json", log, "--method", "tap")
    assert make.inside(capsys, *words, "--layer", "none", inputs["shot"])[0] == 2
    assert stat.S_IMODE(log.stat().st_mode) == 0o600
    log.chmod(0o644)  # one that was there is never opened wider, but closed
    allow(tmp_path / "in", 0o640)
    assert make.inside(capsys, *words, inputs["shot"])[0] == 0
    assert stat.S_IMODE(log.stat().st_mode) == 0o640


def test_one_private_frame_makes_its_own_result_private(tmp_path, umask, inputs):
    clip = Clip(inputs["shot"])
    (tmp_path / "in" / "shot.0002.exr").chmod(0o600)
    output = Output(tmp_path / "o.####.exr", numbers=clip.numbers)
    for number in clip.numbers:
        source = clip.source(number)
        output.write(source.rgba, source)
    found = [stat.S_IMODE(output.path(n).stat().st_mode) for n in clip.numbers]
    assert found == [0o644, 0o600]


def test_the_umask_takes_away_more(tmp_path, umask):
    (tmp_path / "in").touch(0o666)
    os.umask(0o077)
    atomic.write_file(tmp_path / "o", b"", mode=atomic.mode_of(tmp_path, [tmp_path / "in"]))
    assert stat.S_IMODE((tmp_path / "o").stat().st_mode) == 0o600


@pytest.mark.parametrize(
    ("mode", "expected"), [(0o640, 0o600), (0o644, 0o666), (0o604, 0o600), (0o600, 0o600)]
)
def test_another_group_may_read_what_all_may_read(tmp_path, monkeypatch, mode, expected):
    path = tmp_path / "in"
    path.touch()
    path.chmod(mode)
    monkeypatch.setattr(atomic, "_group_in", lambda folder: path.stat().st_gid + 1)
    assert atomic.mode_of(tmp_path, [path]) == expected


@pytest.mark.skipif(sys.platform != "linux", reason="folders hand their group on there anyway")
def test_the_group_of_a_new_file_is_known_before_it_is_there(tmp_path):
    for bits in (0o700, 0o2700):
        tmp_path.chmod(bits)
        file = tmp_path / f"{bits}"
        file.touch()
        assert atomic._group_in(tmp_path) == file.stat().st_gid


def test_what_is_no_file_has_no_permissions(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    inputs = [tmp_path / "pipe", tmp_path / "is not there", tmp_path]
    assert atomic.mode_of(tmp_path / "is made later", inputs) == atomic.PUBLIC
