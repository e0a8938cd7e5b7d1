"""Whatever is wrong with folders, disks and devices: an error that names it, and order."""

import errno

import pytest

import make_frames as make
from small_disk import small_disk
from wgmb import Clip


def test_an_output_folder_that_cannot_be_is_one_line_and_2(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    (tmp_path / "file").write_text("")
    for folder in ("/proc/nowhere", tmp_path / "file", tmp_path / "file" / "deeper"):
        code, out, err = make.inside(capsys, "blur", pattern, "-o", f"{folder}/o.####.exr")
        assert (code, out) == (2, "")
        assert len(make.error_lines(err)) == 1
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


@pytest.mark.parametrize("suffix", ["exr", "png", "mp4", "gif"])
def test_a_full_disk_fails_and_leaves_neither_a_bad_file_nor_a_rest(tmp_path, capsys, suffix):
    pattern = make.write_sequence(tmp_path, (1, 2, 3))
    out = tmp_path / "out"
    target = out / ("o.####." + suffix if suffix in ("exr", "png") else f"o.{suffix}")
    with small_disk(1500):
        code, said, err = make.inside(capsys, "blur", pattern, "-o", target)
    assert (code, said) == (1, "")
    assert make.error_lines(err)[0].startswith("wgmb: ")
    assert str(out) in make.error_lines(err)[0]
    assert make.names_in(out) == []


def test_a_disk_that_fills_up_keeps_what_was_there(tmp_path, capsys):
    pattern = make.write_sequence(tmp_path, (1,))
    (tmp_path / "o.0001.exr").write_bytes(b"what was there")
    with small_disk(1500):
        code, _, _ = make.inside(capsys, "blur", pattern, "-o", tmp_path / "o.####.exr",
                                 "--overwrite")  # fmt: skip
    assert code == 1
    assert (tmp_path / "o.0001.exr").read_bytes() == b"what was there"


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


@pytest.mark.parametrize("opengl", [True, False], ids=["only OpenGL", "nothing"])
def test_without_a_vulkan_driver_it_is_one_line_and_3(tmp_path, opengl):
    pattern = make.write_sequence(tmp_path, (1,))
    env = {"VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"}
    if not opengl:
        env["__EGL_VENDOR_LIBRARY_FILENAMES"] = env["LIBGL_DRIVERS_PATH"] = "/nonexistent"
    done = make.command("blur", pattern, "-o", tmp_path / "out" / "o.####.exr", env=env)
    assert (done.returncode, done.stdout) == (3, "")
    (line,) = make.error_lines(done.stderr)
    assert line.startswith("wgmb: ")
    assert "Vulkan" in line
    assert not (tmp_path / "out").exists()
