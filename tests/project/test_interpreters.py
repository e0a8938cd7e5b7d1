"""Every Python that wgmb starts leaves alone what lies beside the frames."""

import ast
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import make_frames as make

ROOT = Path(__file__).parents[2]
PROGRAM = Path(sys.executable).with_name("wgmb")
TRAP = """
import io
with io.open({told!r}, "a") as file:
    file.write(__name__ + " ")
raise ImportError("a module of the folder of the frames was run")
"""
FROM_CODE = "-I", "-P"  # Python's options that keep the current folder off its path
STARTS = re.compile(  # of Python in a shell script, with code or a module as its first words
    r'(?:^|[\s;{(!&|])\S*python[\d.]*(?:[")}]\S*)?((?: -\w+)*?) -[cm] '
)
MODULES = {"subprocess", "multiprocessing", "pty"}
CALLS = {"fork", "forkpty", "system", "popen", "startfile", "create_subprocess_exec"}
MAY_START = {  # other programs; the test below looks at the words that they are started with
    "wgmb/viewer/actions.py", "wgmb/cli/commands/doctor.py", "blender/wgmb_blender/process.py",
    "blender/build.py",
}  # fmt: skip


WORKERS = "wgmb/farm/local.py"  # whose processes dask starts


def names_of_modules() -> set[str]:
    """All that Python or an installed package may import by a first name, but wgmb itself."""
    known = set(sys.stdlib_module_names) | set(packages_distributions())
    known |= {"sitecustomize", "usercustomize"}
    return {name for name in known if name.isidentifier()} - {"wgmb", *sys.builtin_module_names}


@pytest.fixture(scope="module")
def trapped(tmp_path_factory):
    """A folder of frames in which every module's name leads to a stranger's code."""
    folder = tmp_path_factory.mktemp("trapped")
    make.write_sequence(folder, (1, 2, 3))
    for name in names_of_modules():
        (folder / f"{name}.py").write_text(TRAP.format(told=str(folder / "told")))
    return folder


@pytest.fixture
def folder(trapped, monkeypatch):
    """The same as the current folder; in the end, nothing of it was run."""
    monkeypatch.chdir(trapped)
    yield trapped
    told = trapped / "told"
    names = told.read_text() if told.exists() else ""
    told.unlink(missing_ok=True)
    assert names == ""


def ended(*line, **env) -> subprocess.CompletedProcess:
    environ = os.environ | {name: str(value) for name, value in env.items()}
    words = list(map(str, line))
    done = subprocess.run(words, capture_output=True, text=True, timeout=240, env=environ)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_a_trap_is_sprung_by_a_python_without_the_options(trapped):
    line = [sys.executable, "-c", "import numpy"]
    done = subprocess.run(line, cwd=trapped, capture_output=True, text=True, timeout=60)
    told = trapped / "told"
    # Python 3.13 keeps the lines of its code in linecache, before it runs them.
    first = "numpy " if sys.version_info < (3, 13) else "linecache traceback "
    names = told.read_text()
    told.unlink()
    assert (done.returncode, names) == (1, first)


def copied_run(folder: Path) -> Path:
    """`./run` of a clone whose environment is this one, and in which nothing is to be set up."""
    (folder / "tools").mkdir()
    (folder / ".venv").symlink_to(sys.prefix)
    (folder / "tools" / "set_up.sh").write_text("set_up_system() { :; }\nset_up_venv() { :; }\n")
    return Path(shutil.copy(ROOT / "run", folder))


def test_the_rows_of_run_for_frames(folder, tmp_path):
    run = copied_run(tmp_path)
    assert "shot.0001.exr" in ended(run, "wgmb", "info", "shot.0001.exr").stdout
    for path in ("", os.pathsep, f"{os.pathsep}/none"):  # an empty entry is the current folder
        ended(run, "wgmb", "--version", PYTHONPATH=path)
        ended(run, "view", "--help", PYTHONPATH=path)


def test_the_program_and_what_it_starts(folder, tmp_path):
    blur = "blur", "shot.####.exr", "--method", "tap", "-o"
    ended(PROGRAM, *blur, tmp_path / "a.####.exr")
    ended(PROGRAM, *blur, tmp_path / "b.####.exr", "--workers", 2)
    assert len(list(tmp_path.glob("b.*.exr"))) == 3
    assert "test blur: right" in ended(PROGRAM, "doctor").stdout
    ended(PROGRAM, "job", *blur[1:], tmp_path / "c.####.exr", "-j", tmp_path / "c.json",
          "--slurm", tmp_path / "c.sh")  # fmt: skip
    path = f"{PROGRAM.parent}{os.pathsep}{os.environ['PATH']}"
    ended("bash", tmp_path / "c.sh", SLURM_ARRAY_TASK_ID=0, PATH=path)
    assert len(list(tmp_path.glob("c.*.exr"))) == 3


def test_python_with_the_module_named_loads_none_of_its_packages_from_the_folder(folder, tmp_path):
    """Modules that Python itself loads to find it are out of reach, as SECURITY.md says."""
    few = tmp_path / "few"
    few.mkdir()
    for path in folder.iterdir():
        name = path.stem
        if name not in sys.stdlib_module_names and "customize" not in name and name[0] != "_":
            shutil.copy(path, few)
    for path in ("", os.pathsep):
        ended("env", "-C", few, sys.executable, "-m", "wgmb", "blur", "shot.####.exr", "-o",
              tmp_path / "o.####.exr", "--method", "tap", "--workers", 1, "--overwrite",
              PYTHONPATH=path)  # fmt: skip


FARM = """
import sys
from pathlib import Path
sys.path.extend({paths!r})
from make_job import job_of
from wgmb.farm.farm import Farm, as_farm_job
if __name__ == "__main__":
    report = Farm(workers=1).blur(as_farm_job(job_of("shot.####.exr", Path(sys.argv[1]))))
    assert len(report.done) == 3, report
"""


def test_workers_of_a_program_of_somebody_else(folder, tmp_path):
    program = tmp_path / "farm.py"
    program.write_text(FARM.format(paths=[str(Path(make.__file__).parent)]))
    ended(sys.executable, program, tmp_path / "out")


EXPORT = """
import os, sys
from wgmb import interpreter
os.environ["PYTHONPATH"] = sys.argv[2]
interpreter.leave_current_folder()  # as the program does: glfw starts a Python, too
from wgmb.viewer.actions import Actions
from wgmb.viewer.state import state
actions = Actions(None, None, None, None, None)
opened = state.State().opened("shot.####.exr").with_settings(method="tap")
actions.do("export", sys.argv[1], opened)
actions.export[0].wait()
actions.poll_export()
assert "exported" in actions.export_message, actions.export_message
"""


@pytest.mark.parametrize("path", [os.pathsep, pytest.param("", marks=pytest.mark.full)])
def test_the_viewers_export(folder, tmp_path, path):
    out = tmp_path / "o.####.exr"
    ended(sys.executable, "-P", "-c", EXPORT, out, path)
    assert len(list(tmp_path.glob("o.*.exr"))) == 3


ADD_ON = """
import os, sys, types
pack = sys.modules["wgmb_blender"] = types.ModuleType("wgmb_blender")
pack.__path__ = [sys.argv[1]]  # its buttons need Blender, the process does not
from wgmb_blender.process import Process
sys.path.insert(0, os.getcwd())  # as a Blender that takes over an environment may have it
process = Process()
assert process.ask("adapters").result(60)
process.close()
"""


def test_the_process_of_the_blender_add_on(folder):
    ended(sys.executable, "-P", "-c", ADD_ON, ROOT / "blender" / "wgmb_blender")


# ---- no other way is added unseen --------------------------------------------------------------


def faults_of_python(text: str) -> Iterator[str]:
    """Lists of words that start a Python with code or a module, and the current folder."""
    for node in ast.walk(ast.parse(text)):
        parts = node.elts if isinstance(node, ast.List | ast.Tuple) else ()
        words = [part.value if isinstance(part, ast.Constant) else "" for part in parts]
        for option in {"-c", "-m"} & {word for word in words if isinstance(word, str)}:
            at = words.index(option)
            first = ast.unparse(parts[0]).lower()
            is_python = not at or "python" in first or "sys.executable" in first
            if is_python and not set(words[:at]) & set(FROM_CODE):
                yield f"{node.lineno}: {ast.unparse(node)[:80]}"


def faults_of_shell(text: str) -> Iterator[str]:
    """Lines of a shell script that start a Python so."""
    for number, line in enumerate(text.splitlines(), 1):
        code = line.partition(" # ")[0] if not line.startswith("#") else ""
        for options in STARTS.findall(code):
            if not set(options.split()) & set(FROM_CODE):
                yield f"{number}: {line.strip()[:80]}"


def starters(text: str) -> set[str]:
    """Modules and functions in use that start other programs."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names} & MODULES
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= {(node.module or "").partition(".")[0]} & MODULES
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("os", "asyncio"):
            is_start = node.attr in CALLS or node.attr.startswith(("exec", "spawn", "posix_spawn"))
            found |= {node.attr} if is_start else set()
    return found


def sources(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


@pytest.mark.fast
def test_no_source_starts_a_python_that_looks_into_the_current_folder():
    for path in (*sources("wgmb", "blender", "comfyui", "tools", "sample"), ROOT / "app.py"):
        assert not list(faults_of_python(path.read_text("utf-8"))), path
    for path in (ROOT / "run", *(ROOT / "tools").glob("*.sh")):
        assert not list(faults_of_shell(path.read_text("utf-8"))), path
    cells = (ROOT / "docs" / "notebook.ipynb").read_text("utf-8")
    assert '\\"-P\\", \\"-m\\", \\"wgmb\\"' in cells


@pytest.mark.fast
def test_other_programs_start_in_known_places_and_by_interpreter_in_wgmb():
    for path in sources("wgmb", "blender", "comfyui"):
        text, name = path.read_text("utf-8"), path.relative_to(ROOT).as_posix()
        assert not starters(text) or name in MAY_START | {WORKERS}, name
        if name == WORKERS:
            assert "interpreter.environment()" in text
        elif starters(text) and name.startswith("wgmb/"):
            assert "sys.executable" not in text and "interpreter.command(" in text, name
            assert text.count("interpreter.command(") == text.count("interpreter.environment()")


@pytest.mark.fast
@pytest.mark.parametrize(
    "text",
    ["run([sys.executable, '-m', 'wgmb'])", "x = ['python3', '-u', '-c', code]",
     "line = [*PYTHON, '-m', 'pip']", "words = ['-m', 'wgmb']"],
)  # fmt: skip
def test_a_start_in_python_is_found(text):
    assert len(list(faults_of_python(text))) == 1


@pytest.mark.fast
@pytest.mark.parametrize(
    ("line", "count"),
    [("exec .venv/bin/python -m wgmb", 1), ('"$here/.venv/bin/python" -m wgmb "$@" ;;', 1),
     ('if "$python" -c ""; then', 1), ("{ python3.11 -m venv x; }", 1), ("python -u -c 1", 1),
     ("exec .venv/bin/python -P -m wgmb", 0), ('"$python" -I -c 1', 0), ("python a.py -c 1", 0),
     ("  # python -m wgmb", 0)],
)  # fmt: skip
def test_a_start_in_a_shell_script_is_found(line, count):
    assert len(list(faults_of_shell(line))) == count


@pytest.mark.fast
@pytest.mark.parametrize(
    "text", ["import subprocess", "from multiprocessing import Pool", "os.execv(a, b)"]
)
def test_a_start_of_another_program_is_found(text):
    assert len(starters(text)) == 1
