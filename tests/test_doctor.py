"""`wgmb doctor` and what helps at the first start: reports, completion, hints in time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import make_frames as make
from wgmb import gpu
from wgmb.cli import doctor
from wgmb.errors import DeviceError
from wgmb.extras import EXTRAS, install_command
from wgmb.lab import cases


def told(capsys, code=0) -> list[str]:
    got, out, err = make.inside(capsys, "doctor")
    assert (got, err) == (code, "")
    return out.splitlines()


def test_it_tells_versions_extras_adapters_and_a_right_blur(capsys, monkeypatch):
    monkeypatch.setenv("WGMB_ADAPTER", "")
    lines = told(capsys)
    assert lines[0].startswith("wgmb 0.")
    assert all(f"{name} " in lines[0] for name in doctor.CORE)
    for extra in {extra for extra, _ in EXTRAS.values()}:
        assert [line for line in lines if line.startswith(f"extra {extra}: ")]
    assert gpu.choose_adapter().summary in "".join(line for line in lines if line[:2] == "* ")
    assert lines[-1].startswith("test blur: right, ")
    assert len(lines) < 40


def test_names_of_people_are_not_shown(capsys, monkeypatch):
    monkeypatch.setenv("OCIO", str(Path.home() / "film" / "config.ocio"))
    assert "OCIO=~/film/config.ocio" in told(capsys)


def test_without_an_adapter_the_remedy_is_told(capsys, monkeypatch):
    def none(*_):
        raise DeviceError("no GPU adapter")

    monkeypatch.setattr(gpu, "choose_adapter", none)
    monkeypatch.setattr("wgmb.gpu.device.choose_adapter", none)
    monkeypatch.setattr(gpu.device, "_device", none)
    lines = told(capsys, code=3)
    assert lines[-2:] == ["test blur: no GPU adapter", doctor.REMEDY]


def test_a_wrong_blur_is_told(capsys, monkeypatch):
    monkeypatch.setattr(doctor.Blur, "__call__", lambda self, frame: frame.color)
    assert told(capsys, code=1)[-1].startswith("test blur: wrong by up to 0.4")


def test_what_is_missing_or_broken_is_told(capsys, monkeypatch, tmp_path):
    (tmp_path / "pygfx.py").write_text("raise OSError('libX.so: cannot open')")
    (tmp_path / "tifffile.py").write_text("import os; os.abort()")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    version = doctor._version
    monkeypatch.setattr(doctor, "_version", lambda n: "" if n == "cv2" else version(n))
    monkeypatch.setattr(doctor, "EXTRAS", {n: EXTRAS[n] for n in ("cv2", "pygfx", "tifffile")})
    lines = told(capsys)
    assert f"extra flow: OpenCV missing ({install_command('flow')})" in lines
    at = next(i for i, line in enumerate(lines) if line.startswith("extra pygfx: pygfx "))
    assert lines[at + 1] == "  pygfx cannot be imported: OSError: libX.so: cannot open"
    assert "  tifffile cannot be imported: Python ends, or hangs, while it is imported" in lines


def test_a_comparison_without_flip_ends_before_anything_is_rendered(capsys, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    monkeypatch.setattr(cases, "scene_case", lambda *_: pytest.fail("rendered"))
    for words in (("crossing",), ("--experiment", "chen")):
        code, out, err = make.inside(capsys, "compare", *words, "-o", tmp_path / "r.html")
        assert (code, out) == (2, "")
        assert err == f"wgmb: FLIP: flip-evaluator is not installed: {install_command('compare')}\n"
    assert make.names_in(tmp_path) == []


@pytest.mark.parametrize(
    ("words", "wanted"),
    [("wgmb co", {"compare"}), ("wgmb blur --sh", {"--shutter", "--shading"})],
)
def test_the_shell_completes_commands_and_options(tmp_path, words, wanted):
    env = {"HOME": str(tmp_path), "PATH": os.environ["PATH"], "LANG": "C.UTF-8"}
    line = [sys.executable, "-m", "wgmb", "--install-completion", "--shell", "bash"]
    done = subprocess.run(line, env=env, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    parts = words.split()
    script = f"""
        source "$HOME/.bashrc"
        COMP_WORDS=({words}) COMP_CWORD={len(parts) - 1}
        $(complete -p wgmb | sed 's/.*-F \\([^ ]*\\).*/\\1/') wgmb "{parts[-1]}" "{parts[-2]}"
        echo "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(["bash", "-c", script], env=env, capture_output=True, text=True)
    assert done.stderr == ""
    assert wanted <= set(done.stdout.split())
