"""Whatever is wrong with files, disks, devices or patience: an error that names it, and order."""

import contextlib
import errno
import io
import itertools
import json
import os
import resource
import signal
import subprocess
import time

import numpy as np
import OpenEXR
import pytest
import tifffile

import make_frames as make
from wgmb import Blur, CameraFile, Clip, InputError
from wgmb.cli import app, terminal
from wgmb.io import exr, stills

READ = {".exr": exr.read, ".png": stills.read, ".jpg": stills.read, ".tif": stills.read}


def exr_bytes(folder, kind="ZIP") -> bytes:
    compression = getattr(OpenEXR, f"{kind}_COMPRESSION")
    return make.write_exr(folder / "whole.exr", make.frame(1), compression=compression).read_bytes()


def tiff_bytes(**more) -> bytes:
    stream = io.BytesIO()
    tifffile.imwrite(stream, make.picture(1), photometric="rgb", **more)
    return stream.getvalue()


def files(folder) -> dict[str, bytes]:
    """Sound files, by a name whose end tells the kind."""
    rgba = make.picture(1)
    return {
        "zip.exr": exr_bytes(folder),
        "piz.exr": exr_bytes(folder, "PIZ"),
        "none.exr": exr_bytes(folder, "NO"),
        "8.png": stills.encode(rgba, ".png", 8, "{}"),
        "16.png": stills.encode(rgba, ".png", 16, "{}"),
        "a.jpg": stills.encode(rgba, ".jpg", 8, "{}"),
        "8.tif": stills.encode(rgba, ".tif", 8, "{}"),
        "float.tif": tiff_bytes(),
        "zip.tif": tiff_bytes(compression="zlib"),
    }


KINDS = (
    "zip.exr",
    "piz.exr",
    "none.exr",
    "8.png",
    "16.png",
    "a.jpg",
    "8.tif",
    "float.tif",
    "zip.tif",
)


def lines(err: str) -> list[str]:
    assert "Traceback" not in err
    return err.splitlines()


# ---- damaged files --------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_cut_off_anywhere_is_refused_by_name(tmp_path, kind):
    whole = files(tmp_path)[kind]
    path = tmp_path / f"cut.{kind}"
    # The end of a PNG after its pixels is empty, and so is what follows a TIFF's last strip.
    for length in np.linspace(0, len(whole) - 13, 60).astype(int):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError) as error:
            READ[path.suffix](path)
        assert str(path) in str(error.value), length
        assert "\n" not in str(error.value)


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes changed, dropped, put in or copied, most of them near the beginning."""
    changed, how = bytearray(data), rng.integers(5)
    near = min(len(data), 600)
    places = rng.integers(0, np.where(rng.random(8) < 0.6, near, len(data)))
    count = int(rng.integers(1, 120))
    at, other = int(places[0]), int(places[1])
    if how == 0:
        for place in places:
            changed[place] = int(rng.integers(256))
    elif how == 1:
        extreme = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)[rng.integers(5)]
        changed[at : at + 4] = extreme.to_bytes(4, "little")
    elif how == 2:
        del changed[at : at + count]
    elif how == 3:
        changed[at:at] = rng.bytes(count)
    else:
        changed[at : at + count] = changed[other : other + count]
    return bytes(changed)


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_read_or_refused_by_name_and_nothing_else(tmp_path, kind):
    whole = files(tmp_path)[kind]
    path = tmp_path / f"bad.{kind}"
    rng = np.random.default_rng(3)
    for _ in range(150):
        path.write_bytes(mutated(whole, rng))
        try:
            READ[path.suffix](path)
        except InputError as error:
            assert str(path) in str(error)


@pytest.mark.parametrize("kind", ["zip.exr", "8.png", "16.png"])
def test_damaged_pixels_are_refused_and_not_passed_on(tmp_path, kind):
    """ZIP and PNG carry checksums: one wrong bit among the pixels is found."""
    whole = files(tmp_path)[kind]
    path = tmp_path / f"bad.{kind}"
    rng = np.random.default_rng(4)
    for at in rng.integers(len(whole) // 3, len(whole) - 100, 40):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        with pytest.raises(InputError):
            READ[path.suffix](path)


@pytest.mark.parametrize(
    "box",
    [(0, 0, 32767, 32767), (0, 0, 63, 32767), (0, 0, 2**31 - 1, 2**31 - 1),
     (-(2**31), -(2**31), 2**31 - 1, 2**31 - 1), (5, 5, 0, 0)],
)  # fmt: skip
def test_absurd_exr_sizes_are_refused_at_once(tmp_path, box):
    data = exr_bytes(tmp_path)
    start = b"dataWindow\0box2i\0\x10\0\0\0"
    at = data.index(start) + len(start)
    path = tmp_path / "a.exr"
    path.write_bytes(data[:at] + np.array(box, "<i4").tobytes() + data[at + 16 :])
    with pytest.raises(InputError, match=r"a\.exr"):
        exr.read(path)


@pytest.mark.parametrize(
    ("suffix", "size"),
    [(".png", (65500, 65500)), (".png", (20000, 20000)), (".png", (0, 0)),
     (".jpg", (65500, 65500)), (".jpg", (20000, 20000)), (".jpg", (0, 0)),
     (".tif", (30000, 30000)), (".tif", (0, 0))],
)  # fmt: skip
def test_absurd_still_sizes_are_refused_by_name(tmp_path, suffix, size):
    path = tmp_path / f"a{suffix}"
    width, height = size
    data = stills.encode(make.picture(1)[..., :3], suffix, 8, "{}")
    if suffix == ".png":
        data = data[:16] + width.to_bytes(4, "big") + height.to_bytes(4, "big") + data[24:]
    elif suffix == ".jpg":
        at = data.index(b"\xff\xc0") + 5
        data = data[:at] + height.to_bytes(2, "big") + width.to_bytes(2, "big") + data[at + 4 :]
    else:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            tags = [file.pages.first.tags[t].offset for t in ("ImageWidth", "ImageLength")]
        changed = bytearray(data)
        for at, value in zip(tags, size, strict=True):
            changed[at + 2 : at + 12] = np.array([4, 1, 0, value, 0], "<u2")[:5].tobytes()
            changed[at + 8 : at + 12] = value.to_bytes(4, "little")
        data = bytes(changed)
    path.write_bytes(data)
    with pytest.raises(InputError, match=path.name):
        stills.read(path)


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg", "a.tif"])
@pytest.mark.parametrize("what", ["nothing", "empty", "folder", "text", "fifo"])
def test_what_is_no_picture_is_refused_by_name(tmp_path, name, what):
    path = tmp_path / name
    if what == "empty":
        path.write_bytes(b"")
    elif what == "folder":
        path.mkdir()
    elif what == "text":
        path.write_text("not a picture\n" * 50)
    elif what == "fifo":
        os.mkfifo(path)
    with pytest.raises(InputError, match=name):
        READ[path.suffix](path)


@pytest.mark.parametrize("kind", ["zip.exr", "8.png", "8.tif", "zip.tif", "a.jpg"])
def test_a_damaged_frame_is_one_line_without_native_chatter(tmp_path, capfd, kind):
    path = tmp_path / f"bad.{kind}"
    path.write_bytes(files(tmp_path)[kind][:-400])
    code, out, err = make.inside(capfd, "info", path)
    assert (code, out) == (2, "")
    (line,) = lines(err)
    assert line.startswith(f"wgmb: {path}: ")


def test_one_bad_frame_is_reported_and_the_rest_is_done(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, range(1, 6))
    bad = tmp_path / "shot.0003.exr"
    bad.write_bytes(bad.read_bytes()[:3000])
    out = tmp_path / "out"
    code, said, err = make.inside(capsys, "blur", pattern, "-o", out / "o.####.exr")
    assert (code, said) == (1, "")
    assert make.names_in(out) == [f"o.{n:04d}.exr" for n in (1, 2, 4, 5)]
    failed = [line for line in lines(err) if "failed: " in line]
    assert len(failed) == 1
    assert failed[0].startswith("wgmb: frame 3 failed: ")
    assert str(bad) in failed[0]
    assert "1 of 5 frames failed" in err


@pytest.mark.parametrize("kind", ["a.tif", "b.png", "c.jpg"])
def test_one_bad_still_is_reported_and_the_rest_is_done(tmp_path, capsys, kind):
    suffix = kind[1:]
    for n in (1, 2, 3):
        data = stills.encode(make.picture(n), suffix, 8, "{}")
        (tmp_path / f"s.{n:04d}{suffix}").write_bytes(data[: len(data) // (2 if n == 2 else 1)])
        make.write_exr(tmp_path / f"mv.{n:04d}.exr", make.written("nuke", *make.motion(n)))
    code, _, err = make.inside(capsys, "blur", tmp_path / f"s.####{suffix}", "--also",
                               tmp_path / "mv.####.exr", "-o", tmp_path / "o.####.exr")  # fmt: skip
    assert code == 1
    assert f"wgmb: frame 2 failed: {tmp_path}/s.0002{suffix}" in err
    assert [n for n in make.names_in(tmp_path) if n.startswith("o")] == ["o.0001.exr", "o.0003.exr"]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("convention", ["nuke", "blender"])
def test_bad_pixels_are_reported_and_do_not_spread(tmp_path, capsys, bad, convention):
    channels = make.frame(1, convention)
    for i, plane in enumerate(channels.values()):
        plane[3 + 2 * i, 5:7] = bad
    path = make.write_exr(tmp_path / "a.exr", channels)
    code, _, err = make.inside(capsys, "blur", path, "-o", tmp_path / "o.exr")
    assert code == 0
    assert "not finite" in err
    assert "in color" in err
    assert "in motion" in err or "in to_next" in err
    got = make.plain_read(tmp_path / "o.exr")
    lead = "ViewLayer.Combined." if convention == "blender" else ""
    assert all(np.isfinite(got[lead + c].astype("f4")).all() for c in "RGBA")


# ---- cameras --------------------------------------------------------------------------------


def camera_json(tmp_path, **change) -> dict:
    path = make.write_cameras(tmp_path / "whole.json", range(1, 4))
    content = json.loads(path.read_text())
    for frame in content["frames"].values():
        frame |= change
    return content


EYE = np.eye(4).tolist()
ZERO = np.zeros((4, 4)).tolist()
TURNED = [[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]]  # x, y, w alone: singular


def matrix(value) -> list:
    return [[1, 0, 0, value], *EYE[1:]]


BAD_CAMERAS = {
    "3 x 3": {"projection": np.eye(3).tolist()},
    "ragged": {"projection": [[1], [2, 3]]},
    "text": {"projection": "none"},
    "null": {"projection": None},
    "words": {"projection": [["a"] * 4] * 4},
    "nan": {"projection": matrix(float("nan"))},
    "infinite": {"projection": matrix(float("inf"))},
    "huge integer": {"projection": matrix(10**400)},
    "singular projection": {"projection": ZERO},
    "singular camera": {"camera_matrix_world": ZERO},
    "singular clip": {"clip_from_world": ZERO},
    "singular in the pixels": {"clip_from_world": TURNED},
    "tiny": {"camera_matrix_world": (np.eye(4) * 1e-310).tolist()},
    "objects a list": {"objects": []},
    "object null": {"objects": {"a": None}},
    "object without index": {"objects": {"a": {"matrix_world": EYE}}},
    "object without matrix": {"objects": {"a": {"index": 1}}},
    "index 1e10": {"objects": {"a": {"index": 10**10, "matrix_world": EYE}}},
    "index -1": {"objects": {"a": {"index": -1, "matrix_world": EYE}}},
    "index text": {"objects": {"a": {"index": "1", "matrix_world": EYE}}},
    "index fraction": {"objects": {"a": {"index": 1.5, "matrix_world": EYE}}},
    "singular object": {"objects": {"a": {"index": 1, "matrix_world": ZERO}}},
}


@pytest.mark.parametrize("name", BAD_CAMERAS)
def test_a_senseless_camera_fails_the_frame_with_the_files_name(tmp_path, capsys, name):
    path = tmp_path / "cam.json"
    path.write_text(json.dumps(camera_json(tmp_path, **BAD_CAMERAS[name])))
    index = np.ones((48, 64), "f4")
    make.write_exr(tmp_path / "c.0002.exr", make.frame(2, None) | {"IndexOB.X": index})
    code, out, err = make.inside(capsys, "blur", tmp_path / "c.####.exr", "--camera", path, "-o",
                                 tmp_path / "o.####.exr")  # fmt: skip
    assert code in (1, 2)
    assert out == ""
    assert lines(err)[0].startswith("wgmb: ")
    assert "cam.json" in err
    assert not (tmp_path / "o.0002.exr").exists()


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", "null", "{}", '{"frames": []}', '{"frames": {"x": {}}}', "[" * 100_000,
     '{"frames": {"1e999": {}}}', '{"frames": {"nan": {}}}', "\0\0", '{"frames": {"1": NaN}'],
    ids=range(13),
)  # fmt: skip
def test_what_is_no_camera_file_is_refused_by_name(tmp_path, text):
    (tmp_path / "cam.json").write_text(text)
    with pytest.raises(InputError, match=r"cam\.json"):
        CameraFile(tmp_path / "cam.json")


@pytest.mark.parametrize("frame", [None, 5, [], "x", {}])
def test_a_frame_without_a_camera_is_refused_by_name(tmp_path, frame):
    (tmp_path / "cam.json").write_text(json.dumps({"frames": {"1": frame, "2": frame}}))
    with pytest.raises(InputError, match=r"cam\.json"):
        CameraFile(tmp_path / "cam.json").around(1)


def test_a_camera_file_that_is_missing_a_folder_or_a_device_is_refused(tmp_path):
    for path in (tmp_path / "no.json", tmp_path, "/dev/zero"):
        with pytest.raises(InputError):
            CameraFile(path)


# ---- disks ----------------------------------------------------------------------------------


def test_an_output_folder_that_cannot_be_is_one_line_and_2(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    (tmp_path / "file").write_text("")
    for folder in ("/proc/nowhere", tmp_path / "file", tmp_path / "file" / "deeper"):
        code, out, err = make.inside(capsys, "blur", pattern, "-o", f"{folder}/o.####.exr")
        assert (code, out) == (2, "")
        assert len(lines(err)) == 1
        assert str(folder) in err


@pytest.mark.parametrize("suffix", ["exr", "mp4", "gif"])
def test_an_output_that_is_a_folder_fails_and_leaves_nothing(tmp_path, capsys, suffix):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    name = "o.0002.exr" if suffix == "exr" else f"o.{suffix}"
    out = tmp_path / "out"
    (out / name).mkdir(parents=True)
    target = out / ("o.####.exr" if suffix == "exr" else name)
    code, _, err = make.inside(capsys, "blur", pattern, "-o", target, "--overwrite")
    assert code in (1, 2)
    assert name in err
    assert not [n for n in make.names_in(out) if n.endswith(".part")]
    assert list((out / name).iterdir()) == []


@contextlib.contextmanager
def small_disk(limit: int):
    """Files may not grow beyond `limit` bytes; writing more is an error, not a signal."""
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
        signal.signal(signal.SIGXFSZ, before)


@pytest.mark.parametrize("suffix", ["exr", "png", "mp4", "gif"])
def test_a_full_disk_fails_and_leaves_neither_a_bad_file_nor_a_rest(tmp_path, capsys, suffix):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    out = tmp_path / "out"
    target = out / ("o.####." + suffix if suffix in ("exr", "png") else f"o.{suffix}")
    with small_disk(1500):
        code, said, err = make.inside(capsys, "blur", pattern, "-o", target)
    assert (code, said) == (1, "")
    assert lines(err)[0].startswith("wgmb: ")
    assert str(out) in lines(err)[0]
    assert make.names_in(out) == []


def test_a_disk_that_fills_up_keeps_what_was_there(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    (tmp_path / "o.0001.exr").write_bytes(b"what was there")
    with small_disk(1500):
        code, _, _ = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr",
                                 "--overwrite")  # fmt: skip
    assert code == 1
    assert (tmp_path / "o.0001.exr").read_bytes() == b"what was there"


# ---- devices --------------------------------------------------------------------------------


@pytest.mark.parametrize("opengl", [True, False], ids=["only OpenGL", "nothing"])
def test_without_a_vulkan_driver_it_is_one_line_and_3(tmp_path, opengl):
    pattern = make.write_sequence(tmp_path, (1,))
    env = {"VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"}
    if not opengl:
        env["__EGL_VENDOR_LIBRARY_FILENAMES"] = env["LIBGL_DRIVERS_PATH"] = "/nonexistent"
    done = make.command("blur", pattern, "-o", tmp_path / "out" / "o.####.exr", env=env)
    assert (done.returncode, done.stdout) == (3, "")
    (line,) = lines(done.stderr)
    assert line.startswith("wgmb: ")
    assert "Vulkan" in line
    assert not (tmp_path / "out").exists()


# ---- interruptions --------------------------------------------------------------------------


LONG = 96  # frames: many more than a run makes before it is interrupted


@pytest.fixture(scope="module")
def long_shot(tmp_path_factory):
    """Frames (of three pictures) by the dozen, and what an unbroken run makes of them."""
    folder = tmp_path_factory.mktemp("long")
    for n in range(1, 4):
        make.write_exr(folder / f"of.{n}.exr", make.frame(n))
    for n in range(1, LONG + 1):
        (folder / f"shot.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    pattern = str(folder / "shot.####.exr")
    assert app.main(list(map(str, arguments(pattern, folder / "whole", "-q")))) == 0
    whole = {p.name: p.read_bytes() for p in (folder / "whole").iterdir()}
    assert len(whole) == LONG
    return pattern, whole


def arguments(pattern, out, *more):
    # A constant convention: the frames do not follow each other.
    return ("blur", pattern, "-o", out / "o.####.exr", "--vectors", "blender", *more)


def made(out) -> int:
    return len(list(out.glob("o.*.exr")))


def begun(line, has_begun, **options) -> subprocess.Popen:
    """A run of which `has_begun()` is true, and which has more to do."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    process = subprocess.Popen([*make.COMMAND, *map(str, line)], text=True, **pipes)
    ends = time.monotonic() + 60
    while not has_begun():
        assert time.monotonic() < ends
        assert process.poll() is None, process.communicate()
        time.sleep(0.002)
    return process


def test_killed_runs_leave_whole_files_only_and_resume_to_the_same_bytes(tmp_path, long_shot):
    pattern, whole = long_shot
    out = tmp_path / "out"
    for frames in (1, 23, 48):
        process = begun(arguments(pattern, out, "--resume"), lambda n=frames: made(out) >= n)
        process.kill()
        process.communicate()
        for path in out.glob("o.*.exr"):
            assert path.read_bytes() == whole[path.name]
    assert app.main(list(map(str, arguments(pattern, out, "--resume", "-q")))) == 0
    assert {p.name: p.read_bytes() for p in out.iterdir()} == whole


def ignore_ctrl_c():
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a shell does for what runs in the background


@pytest.mark.parametrize(
    ("number", "prepare"),
    [(signal.SIGINT, None), (signal.SIGTERM, None), (signal.SIGTERM, ignore_ctrl_c)],
    ids=["Ctrl-C", "SIGTERM", "SIGTERM in the background"],
)
def test_an_interrupted_run_ends_with_130_one_line_and_whole_files(
    tmp_path, long_shot, number, prepare
):
    pattern, whole = long_shot
    out = tmp_path / "out"
    line = arguments(pattern, out, "--resume")
    process = begun(line, lambda: made(out) >= 5, preexec_fn=prepare)
    process.send_signal(number)
    said, err = process.communicate(timeout=20)
    assert (process.returncode, said) == (130, "")
    assert lines(err) == ["wgmb: interrupted"]
    got = {p.name: p.read_bytes() for p in out.iterdir()}
    assert 5 <= len(got) < LONG
    assert got.items() <= whole.items()


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_an_interrupted_video_leaves_nothing(tmp_path, long_shot, suffix):
    pattern, _ = long_shot
    out, said = tmp_path / "out", tmp_path / "said.txt"
    line = ["blur", pattern, "-o", out / f"v.{suffix}", "--samples", "512", "--verbose"]
    with said.open("w") as file:
        process = begun(line, lambda: "settings: " in said.read_text(), stderr=file)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    assert process.returncode == 130
    assert said.read_text().endswith("\nwgmb: interrupted\n")
    assert make.names_in(out) == []


def test_an_interruption_that_python_lost_is_heard_at_the_next_frame(
    tmp_path, long_shot, monkeypatch
):
    """Exceptions that a signal raises within a destructor are dropped."""
    calls = itertools.count()
    blur = Blur.__call__

    def blurred(*given):
        if next(calls) == 3:
            with contextlib.suppress(KeyboardInterrupt):
                terminal.interrupt()
        return blur(*given)

    monkeypatch.setattr(Blur, "__call__", blurred)
    code = app.main(list(map(str, arguments(long_shot[0], tmp_path / "out", "-q"))))
    assert code == 130
    assert 0 < len(list((tmp_path / "out").glob("o.*.exr"))) < 10


def test_a_file_that_the_system_refuses_is_named_before_the_reason(tmp_path, capsys, monkeypatch):
    pattern = make.write_sequence(tmp_path, range(1, 4))
    read = Clip.sources

    def refused(self, number):
        if number == 2:
            raise PermissionError(errno.EACCES, "Permission denied", "masks/m.0002.png")
        return read(self, number)

    monkeypatch.setattr(Clip, "sources", refused)
    out = tmp_path / "out" / "o.####.exr"
    code, _, err = make.inside(capsys, "blur", pattern, "-o", out, "--method", "tap")
    assert code == 1
    assert "frame 2 failed: masks/m.0002.png: permission denied\n" in err
