"""The process that blurs: what Blender never loads, how it ends, and what is told then."""

import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from test_put_back import difference, everything, small
from wgmb_blender import job, process, settings
from wgmb_blender.process import Process
from wgmb_blender.rendering import beside
from wgmb_blender.settings import wanted_of
from wgmb_blender.wanted import Report
from wgmb_blender.wgmb_worker.problem import ProblemError

RUN = f"""
import sys
sys.path[:0] = [{str(Path(__file__).parent)!r}]
import conftest, scenes, bpy, wgmb_blender
from pathlib import Path
wgmb_blender.register()
scene = scenes.crossing(size=(32, 18))
scenes.output(scene, Path(sys.argv[1]), sys.argv[2], "32", media=sys.argv[3])
scene.frame_end = 4
assert bpy.ops.wgmb.render_and_blur() == {{"FINISHED"}}
assert bpy.ops.wgmb.compare() == {{"FINISHED"}}
assert wgmb_blender.settings.adapters()
wgmb_blender.unregister()
print([name for name in ("wgmb", "wgpu", "OpenEXR", "cffi") if name in sys.modules])
"""


@pytest.mark.parametrize(
    "kind",
    [("OPEN_EXR", "IMAGE"), ("OPEN_EXR_MULTILAYER", "MULTI_LAYER_IMAGE")],
    ids=lambda k: k[0],
)
def test_blender_itself_loads_none_of_what_blurs(tmp_path, kind):
    """A second OpenEXR, or wgpu looking for OpenGL, ends a Blender that has a window."""
    words = [sys.executable, "-c", RUN, tmp_path, *kind]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "[]"


def test_its_errors_are_empty_where_no_runtime_folder_is_named(monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    one = Process()
    assert one.ask("adapters").result()
    one._errors.seek(0)
    assert one._errors.read() == b""
    one.close()


class Dying(Process):
    """Ended from outside where it should blur frame 5, as a driver would end it."""

    def _answer(self, request):
        if request["do"] == "blur" and request["number"] == 5:
            self._popen.kill()
            self._popen.wait()
        return super()._answer(request)


def test_a_process_that_dies_fails_its_frame_and_the_others_are_done(tmp_path, monkeypatch):
    scene = small(tmp_path)
    scene.frame_end = 6
    before = everything(scene)
    process.end_kept()
    monkeypatch.setattr(process, "Process", Dying)
    report = Report()
    for _ in job.steps(scene, wanted_of(scene), report):
        pass
    process.end_kept()
    assert report.done == [4, 6]
    assert report.failed[5].startswith("Frame 5: The process that blurs ended (code ")
    assert difference(before, everything(scene)) == []
    assert sorted(p.name for p in tmp_path.glob("*.png")) == [
        "blurred_0004.png",
        "blurred_0006.png",
    ]


def test_its_last_words_are_told():
    one = Process()
    one.ask("frames", text="1").result()
    one._errors.write(b"a warning\nvkCreateDevice: no more memory\n")
    one._errors.flush()
    one._popen.kill()
    with pytest.raises(ProblemError, match=r"ended \(code .*\): vkCreateDevice: no more memory$"):
        one.ask("frames", text="1").result()
    assert one.ask("frames", text="1-3").result() == [1, 2, 3]
    one.close()


def test_what_a_library_prints_is_no_answer(tmp_path, monkeypatch):
    (tmp_path / "wgmb.py").write_text("import os\nprint('hello')\nos.write(1, b'{}\\n')\nwgpu\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    one = Process()
    try:
        with pytest.raises(RuntimeError, match="NameError: name 'wgpu' is not defined"):
            one.ask("frames", text="1").result()
    finally:
        one.close()


def test_stopping_ends_a_blur_at_once(tmp_path):
    scene = small(tmp_path)
    steps = job.steps(scene, wanted_of(scene), Report(), beside)
    while not next(steps)[1].startswith("Blurring"):
        pass
    steps.close()
    assert not process._kept
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sharp"]


def test_a_python_that_is_not_there_is_a_sentence(tmp_path, monkeypatch):
    small(tmp_path)
    process.end_kept()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(RuntimeError, match="Cannot start Blender's Python"):
        bpy.ops.wgmb.render_and_blur()


def test_a_bundle_that_is_damaged_is_a_sentence(tmp_path, monkeypatch):
    scene = small(tmp_path)
    process.end_kept()
    (tmp_path / "wgmb.py").write_text("import no_such_module\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    before = everything(scene)
    with pytest.raises(RuntimeError, match=r"wgmb cannot be loaded .*install the add-on's bundle"):
        bpy.ops.wgmb.render_and_blur()
    process.end_kept()
    assert difference(before, everything(scene)) == []


def test_a_fault_of_ours_comes_with_its_traceback():
    with process.lent() as one, pytest.raises(RuntimeError, match=r"TypeError.*unexpected") as told:
        one.ask("frames", words="1").result()
    assert "Traceback" in str(told.value)


def test_gpus_are_listed_and_none_is_no_fault(monkeypatch, capsys):
    settings.adapters.cache_clear()
    assert settings.adapters()
    settings.adapters.cache_clear()
    process.end_kept()
    monkeypatch.setattr(sys, "executable", "none")
    assert settings.adapters() == ()
    assert "Cannot start" in capsys.readouterr().out
    settings.adapters.cache_clear()


def test_one_that_is_at_rest_may_be_closed_twice():
    one = Process()
    one.ask("frames", text="1").result()
    one.close()
    one.close()
