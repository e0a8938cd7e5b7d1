"""Terminal output, exit codes with closed streams, and Ctrl-C while modules load."""

import ast
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import make_frames as make
import wgmb
from wgmb.cli.console import Console
from wgmb.cli.terminal import printable
from wgmb.io import frame_numbers

ROOT = Path(__file__).parents[2]
ESCAPES = "\x1b[31mred\x1b]0;title\x07\x9b2J\x7f\u202eabc\u2066\u200b\u2028"
LONG = 300 * "a"  # no file can have this name


def harmless(said: str) -> bool:
    return all(line.isprintable() for line in said.split("\n"))


def one_line(err: str) -> bool:
    return err.startswith("wgmb: ") and err.count("\n") == 1 and err.endswith("\n")


# ---- what is printed ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("shot.0001.exr", "shot.0001.exr"),
        ("Büro 東京 😀", "Büro 東京 😀"),
        ("\x1b[31m", "\\x1b[31m"),
        ("a\x07\x7f\x9b", "a\\x07\\x7f\\x9b"),
        ("a\nb\r\tc", "a\\nb\\r\\tc"),
        ("\u202eabc\u2066", "\\u202eabc\\u2066"),
        ("\u200b\u2028\ufeff", "\\u200b\\u2028\\ufeff"),
        ("\udcff", "\\udcff"),
        ("C:\\x", "C:\\x"),
    ],
)
def test_what_is_no_visible_character_is_escaped(text, shown):
    assert printable(text) == shown
    assert shown.isprintable()


@pytest.mark.parametrize("quiet", [False, True])
@pytest.mark.parametrize("verbose", [False, True])
def test_a_console_prints_what_was_asked_for_in_the_words_of_the_command_line(
    capsys, quiet, verbose
):
    console = Console(quiet, verbose)
    console.say("set `flow=search`", "", None, "said")
    console.detail("detail of `max_mb`")
    console.complain("lost by\n`resume=True`")
    said = [] if quiet else ["set --flow search", "said"]
    said += ["detail of --max-mb"] if verbose else []
    assert capsys.readouterr().err.splitlines() == [*said, "wgmb: lost by --resume"]


@pytest.mark.parametrize("name", [p.name for p in (ROOT / "wgmb/cli/commands").glob("*.py")])
def test_a_command_prints_messages_through_its_console(name):
    """There they are spelled as options, and --quiet and --verbose hold for them."""
    tree = ast.parse((ROOT / "wgmb/cli/commands" / name).read_text())
    taken = [one.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
             and (node.module or "") == "terminal" for one in node.names]  # fmt: skip
    assert not {"note", "complain", "progress"} & set(taken)
    names = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name)]
    assert "print" not in names


@pytest.fixture
def hostile(tmp_path):
    """A frame whose name and one of whose layers would steer a terminal."""
    channels = make.frame(1) | {f"{ESCAPES}.{c}": np.ones((48, 64), "f4") for c in "RGB"}
    return make.write_exr(tmp_path / f"{ESCAPES}.0001.exr", channels)


@pytest.mark.parametrize(
    "command",
    [
        "info HOSTILE",
        "info HOSTILE --layer nope",
        "blur HOSTILE -o OUT --layer nope",
        "blur HOSTILE -o OUT --method tap",
        "blur HOSTILE -o OUT --config HOSTILE",
        "blur HOSTILE -o HOSTILE",
        "render NAME -o OUT",
        "render crossing -o NAME",
        "render crossing -o OUT --set NAME=1",
        "view --config NAME",
        "view --config HOSTILE",
        "NAME",
        "blur HOSTILE -o OUT --NAME",
        "blur HOSTILE -o OUT --frames NAME",
    ],
)
def test_no_file_steers_the_terminal(tmp_path, capsys, hostile, command):
    names = {"HOSTILE": hostile, "NAME": ESCAPES, "OUT": tmp_path / f"{ESCAPES}.png"}
    words = []
    for word in command.split(" "):
        for name, value in names.items():
            word = word.replace(name, str(value))
        words.append(word)
    code, out, err = make.inside(capsys, *words)
    assert code in (0, 1, 2)
    assert harmless(out)
    assert harmless(err)
    assert "Traceback" not in err
    assert "\\x1b" in out + err


# ---- exit codes -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        f"info {LONG}.exr",
        f"blur {LONG}.exr -o OUT",
        f"blur FRAME -o OUT --holdout {LONG}.png",
        f"blur FRAME -o OUT --also {LONG}.exr",
        f"blur FRAME -o OUT --curve {LONG}.csv",
        f"blur FRAME -o OUT --config {LONG}.toml",
        f"view --config {LONG}.toml",
        f"view {LONG}.exr",
    ],
    ids=lambda command: command.replace(LONG, "LONG"),
)
def test_a_name_that_the_system_refuses_is_wrong_input(tmp_path, capsys, command):
    frame = make.write_exr(tmp_path / "a.exr", make.frame(1))
    command = command.replace("FRAME", str(frame)).replace("OUT", str(tmp_path / "o.exr"))
    code, out, err = make.inside(capsys, *command.split(" "))
    assert (code, out) == (2, "")
    assert one_line(err)
    assert f"{LONG[:250]}" in err
    assert "too long" in err
    assert "Errno" not in err


def test_a_file_that_must_not_be_read_is_wrong_input(tmp_path, capsys, monkeypatch):
    def denied(path, *_):
        raise PermissionError(13, "Permission denied", str(path))

    frame = make.write_exr(tmp_path / "a.exr", make.frame(1))
    monkeypatch.setattr(frame_numbers, "open", denied, raising=False)
    said = make.inside(capsys, "blur", frame, "-o", tmp_path / "o.exr")
    assert said == (2, "", f"wgmb: {frame}: permission denied\n")


def full(number: int):
    """Whatever is written to the descriptor finds a full disk."""
    return lambda: os.dup2(os.open("/dev/full", os.O_WRONLY), number)


def closed(number: int):
    return lambda: os.close(number)


@pytest.mark.parametrize(
    ("prepare", "command", "code", "said"),
    [
        (full(2), "info nowhere.exr", 2, ""),
        pytest.param(closed(2), "info nowhere.exr", 2, "", marks=pytest.mark.full),
        (closed(1), "info still.png", 1, "wgmb: standard output: bad file descriptor\n"),
        (closed(1), "shutter -o shutter.svg", 1, "wgmb: standard output: bad file descriptor\n"),
    ],
    ids=["full stderr", "closed stderr", "closed stdout", "closed stdout, a file"],
)
def test_a_shut_stream_does_not_change_what_is_documented(tmp_path, prepare, command, code, said):
    Image.new("RGB", (8, 8)).save(tmp_path / "still.png")
    done = make.command(*command.split(" "), cwd=tmp_path, preexec_fn=prepare)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", said)


@pytest.mark.parametrize(
    "command",
    [
        "render crossing -o OUT --set name=x",
        "compare crossing:name=x -o PAGE",
        "compare crossing -o PAGE --methods tap:shutter=3",
        "compare crossing -o PAGE --methods tap:jitter=x",
        "compare crossing -o PAGE --methods fusion:tau=x",
        "compare crossing -o PAGE --methods tap:²",
        "compare crossing -o PAGE --size ²x²",
        "render crossing -o OUT --fps 1e9_999",
    ],
)
def test_what_a_command_has_no_place_for_is_one_line(tmp_path, capsys, command):
    command = command.replace("OUT", str(tmp_path / "o.png"))
    code, out, err = make.inside(
        capsys, *command.replace("PAGE", str(tmp_path / "p.html")).split(" ")
    )
    assert (code, out) == (2, "")
    assert one_line(err)
    assert make.names_in(tmp_path) == []


# ---- while modules are loaded ---------------------------------------------------------------

INTERRUPTED_WHILE_LOADING = """
import os, runpy, sys

class Finder:
    def find_spec(self, name, *_):
        if name == "numpy":
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, Finder())
sys.argv = ["wgmb", "info", "nowhere.exr"]
{start}
"""
STARTS = {
    "python -m wgmb": "runpy.run_module('wgmb', run_name='__main__', alter_sys=True)",
    "app.py": f"runpy.run_path({str(ROOT / 'app.py')!r}, run_name='__main__')",
    "wgmb": "from wgmb.__main__ import main; main()",  # as pyproject.toml says
}


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_while_modules_are_loaded_is_one_line_and_130(start, number):
    script = INTERRUPTED_WHILE_LOADING.format(number=int(number), start=STARTS[start])
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, cwd=ROOT
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "wgmb: interrupted\n")


def test_an_interruption_within_the_execution_of_a_text_ends_with_130(tmp_path):
    """As where a dataclass is made; `python -m` itself would end by SIGINT."""
    (tmp_path / "within.py").write_text("""
import os, signal, time
from wgmb.cli import app
KILL = "os.kill(os.getpid(), signal.SIGTERM); time.sleep(9)"
app.make_app = lambda *_: exec(KILL)
app.run(["info"])
""")
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "within"]
    done = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "wgmb: interrupted\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_while_python_ends_changes_nothing(number):
    """One of 60 runs that were interrupted as they ended had died by the signal."""
    late = f"""
import os, signal
from wgmb.cli import app
class Late:
    def __del__(self, kill=os.kill, me=os.getpid()):
        kill(me, {int(number)})
signal.late = Late()
app.run(["--version"])
"""
    done = subprocess.run([sys.executable, "-c", late], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_command_of_the_package_hears_interruptions_first():
    assert '\nwgmb = "wgmb.__main__:main"\n' in (ROOT / "pyproject.toml").read_text()


@pytest.mark.parametrize(
    "imports",
    [
        "import wgmb",
        "import wgmb.pipeline.blur, wgmb",
        "import wgmb.methods.gather as gather; import wgmb; gather.Gather",
        "from wgmb.methods import METHODS; import wgmb",
    ],
)
def test_blur_is_the_function_in_whatever_order_modules_are_loaded(imports):
    script = f"import sys\n{imports}\nassert callable(wgmb.blur), wgmb.blur\n"
    script += "assert wgmb.blur.__module__ == 'wgmb.pipeline.one_frame'\n"
    script += "assert wgmb.methods.METHODS is wgmb.METHODS\n"
    if imports == "import wgmb":
        script = f"import sys, wgmb\nassert 'numpy' not in sys.modules\n{script}"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_the_package_has_all_that_it_lists():
    assert {name for name in wgmb.__all__ if getattr(wgmb, name) is not None} == set(wgmb._PLACE)
    assert set(wgmb.__all__) <= set(dir(wgmb))
    assert wgmb.scene.Scene is wgmb.Scene
    with pytest.raises(AttributeError, match="nonsense"):
        _ = wgmb.nonsense
