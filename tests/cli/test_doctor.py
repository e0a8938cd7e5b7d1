"""`wgmb doctor` and what helps at the first start: reports, hints in time."""

import sys
from pathlib import Path

import pytest
import wgpu

import make_frames as make
import wgmb
from wgmb import gpu
from wgmb.cli.commands import doctor
from wgmb.errors import DeviceError
from wgmb.extras import EXTRAS, install_command
from wgmb.lab import cases


@pytest.fixture
def packages_are_sound(monkeypatch):
    """Python's import of every package, which takes a second, is left to other tests."""
    monkeypatch.setattr(doctor, "_import_faults", lambda _: {})


def told(capsys, code=0) -> list[str]:
    got, out, err = make.inside(capsys, "doctor")
    assert (got, err) == (code, "")
    return out.splitlines()


def test_it_tells_versions_extras_adapters_and_a_right_blur(capsys, monkeypatch):
    monkeypatch.setenv("WGMB_ADAPTER", "")
    lines = told(capsys)
    assert lines[0].startswith("wgmb 0.")
    assert all(f"{name} " in lines[0] for name in doctor.CORE)
    for extra in {package.extra for package in EXTRAS.values()}:
        assert [line for line in lines if line.startswith(f"extra {extra}: ")]
    assert gpu.choose_adapter().summary in "".join(line for line in lines if line[:2] == "* ")
    assert lines[-1].startswith("test blur: right, ")
    assert len(lines) < 40


@pytest.mark.usefixtures("packages_are_sound")
def test_names_of_people_are_not_shown(capsys, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: Path("/home/jane"))
    monkeypatch.setenv("OCIO", "/home/jane/film/config.ocio")
    monkeypatch.setenv("VK_DRIVER_FILES", "/net/jane/icd.json:/home/jane/b.json")
    monkeypatch.setenv("DISPLAY", "workstation-of-jane:10.0")
    lines = told(capsys)
    assert "OCIO=~/film/config.ocio" in lines
    assert "VK_DRIVER_FILES=/net/USER/icd.json:~/b.json" in lines
    assert "DISPLAY=:10.0" in lines
    assert not [line for line in lines if "jane" in line]


@pytest.mark.usefixtures("packages_are_sound")
def test_without_an_adapter_the_remedy_is_told(capsys, monkeypatch):
    def none(*_):
        raise DeviceError("no GPU adapter")

    monkeypatch.setattr(gpu, "choose_adapter", none)
    monkeypatch.setattr("wgmb.gpu.device.choose_adapter", none)
    monkeypatch.setattr(gpu.device, "_device", none)
    lines = told(capsys, code=3)
    assert lines[-2:] == ["test blur: no GPU adapter", doctor.REMEDY]


@pytest.mark.usefixtures("packages_are_sound")
def test_a_wrong_blur_is_told(capsys, monkeypatch):
    monkeypatch.setattr(wgmb.Blur, "__call__", lambda self, frame: frame.color)
    assert told(capsys, code=1)[-1].startswith("test blur: wrong by up to 0.4")


def test_what_is_missing_or_broken_is_told(capsys, monkeypatch, tmp_path):
    (tmp_path / "pygfx.py").write_text("raise OSError('libX.so: cannot open')")
    (tmp_path / "tifffile.py").write_text("import os; os.abort()")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "cv2", None)
    names = ("cv2", "tifffile", "pygfx", "PIL")
    monkeypatch.setattr(doctor, "EXTRAS", {n: EXTRAS[n] for n in names})
    lines = told(capsys)
    assert f"extra flow: OpenCV missing ({install_command('flow')})" in lines
    at = next(i for i, line in enumerate(lines) if line.startswith("extra pygfx: pygfx "))
    assert lines[at + 1] == "  pygfx cannot be imported: OSError: libX.so: cannot open"
    assert "  tifffile cannot be imported: Python ends with code -6" in lines
    assert sum("cannot be imported" in line for line in lines) == 2
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH")
    assert not [line for line in told(capsys) if "cannot be imported" in line]


def test_a_package_that_hangs_is_told(capsys, monkeypatch, tmp_path):
    (tmp_path / "tifffile.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(doctor, "_PATIENCE", 2)
    monkeypatch.setattr(doctor, "EXTRAS", {n: EXTRAS[n] for n in ("tifffile", "PIL")})
    found = [line for line in told(capsys) if "cannot be imported" in line]
    assert found == ["  tifffile cannot be imported: no end after 2 s"]


@pytest.mark.usefixtures("packages_are_sound")
def test_wgpu_that_cannot_be_used_is_a_line(capsys, monkeypatch):
    def broken(*_):
        raise RuntimeError("libvulkan\nis odd")

    monkeypatch.setattr(wgpu.gpu, "enumerate_adapters_sync", broken)
    monkeypatch.setattr(gpu.device, "_device", gpu.device._device.__wrapped__)
    lines = told(capsys, code=3)
    assert lines[-2:] == ["test blur: RuntimeError: libvulkan is odd", doctor.REMEDY]


def test_a_comparison_without_flip_ends_before_anything_is_rendered(capsys, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    monkeypatch.setattr(cases, "scene_case", lambda *_: pytest.fail("rendered"))
    for words in (("crossing",), ("--experiment", "chen")):
        code, out, err = make.inside(capsys, "compare", *words, "-o", tmp_path / "r.html")
        assert (code, out) == (2, "")
        assert err == f"wgmb: FLIP: flip-evaluator is not installed: {install_command('compare')}\n"
    assert make.names_in(tmp_path) == []
