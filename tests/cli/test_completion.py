"""`wgmb --install-completion`: one file, by which a real shell completes commands and options."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import make_frames as make

PLACES = {
    "bash": ".local/share/bash-completion/completions/wgmb",
    "zsh": ".zsh/completions/_cyclopts_wgmb",
    "fish": ".config/fish/completions/wgmb.fish",
}
ZSH = """
fpath=("$HOME/.zsh/completions" $fpath)
autoload -Uz compinit && compinit -u
autoload +X _cyclopts_wgmb
whence -v _cyclopts_wgmb; print -- ${_comps[wgmb]}
"""


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A home folder that is not the user's."""
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def files(folder: Path) -> list[str]:
    return [str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()]


def installed(capsys, shell: str, *more) -> list[str]:
    code, out, err = make.inside(capsys, "--install-completion", "--shell", shell, *more)
    assert (code, err) == (0, "")
    return out.splitlines()


def completed(home: Path, line: str) -> set[str]:
    """The words that bash offers at the end of a line."""
    *_, before, last = line.split(" ")
    script = f"""
        . "$HOME/{PLACES["bash"]}"
        COMP_WORDS=({line}) COMP_CWORD={line.count(" ")}
        [ -n "{last}" ] || COMP_WORDS+=("")
        $(complete -p wgmb | sed 's/.*-F \\([^ ]*\\).*/\\1/') wgmb "{last}" "{before}"
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    env = {"HOME": str(home), "PATH": os.environ["PATH"], "LANG": "C.UTF-8"}
    done = subprocess.run(["bash", "-c", script], env=env, capture_output=True, text=True)
    assert done.stderr == ""
    return set(done.stdout.split())


@pytest.mark.parametrize("shell", PLACES)
def test_one_file_is_written_where_the_shell_looks_for_it(home, capsys, shell):
    (home / ".bashrc").write_text("# mine\n")
    lines = installed(capsys, shell)
    assert lines[0] == f"-> {home / PLACES[shell]}"
    assert lines[1].startswith("New shells load it ")
    assert sorted(files(home)) == sorted([".bashrc", PLACES[shell]])
    assert (home / ".bashrc").read_text() == "# mine\n"


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("wgmb co", {"compare"}),
        ("wgmb d", {"devices", "doctor"}),
        ("wgmb blur --sh", {"--shutter", "--shading"}),
        ("wgmb compare --sh", {"--shutter", "--shutters"}),
        ("wgmb blur --flow d", {"dis"}),
    ],
)
def test_bash_completes_commands_options_and_choices(home, capsys, line, wanted):
    installed(capsys, "bash")
    assert wanted <= completed(home, line)
    assert all(word.startswith(line.split()[-1]) for word in completed(home, line))


@pytest.mark.skipif(not shutil.which("zsh"), reason="no zsh")
def test_zsh_finds_the_function_of_the_file(home, capsys):
    installed(capsys, "zsh")
    done = subprocess.run(["zsh", "-f", "-c", ZSH], capture_output=True, text=True, timeout=60)
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "_cyclopts_wgmb"
    assert "is a shell function" in done.stdout


def test_the_folders_that_a_user_has_chosen_are_used(home, capsys, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(home / "data"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(home / "config"))
    for shell in ("bash", "fish"):
        installed(capsys, shell)
    wanted = ["config/fish/completions/wgmb.fish", "data/bash-completion/completions/wgmb"]
    assert sorted(files(home)) == wanted


@pytest.mark.parametrize("more", [(), ("--output", "mine.txt")])
def test_a_file_of_somebody_else_is_left_and_an_own_one_replaced(home, capsys, monkeypatch, more):
    monkeypatch.chdir(home)
    path = home / (more[1] if more else PLACES["bash"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"mine\xff\n")
    said = make.inside(capsys, "--install-completion", "--shell", "bash", *more)
    why = f"{path} exists and was not written by wgmb; --output names another file"
    assert said == (2, "", f"wgmb: {why}\n")
    assert path.read_bytes() == b"mine\xff\n"
    path.unlink()
    installed(capsys, "bash", *more)
    first = path.read_text("utf-8")
    installed(capsys, "bash", *more)
    assert path.read_text("utf-8") == first


def test_commands_whose_packages_are_missing_are_completed_by_name(home):
    """In a process of its own, in which their modules have not been loaded."""
    script = (
        "import sys; sys.modules |= dict.fromkeys(['PIL', 'imageio', 'av'])\n"
        "from wgmb.cli.app import main\n"
        "sys.exit(main(['--install-completion', '--shell', 'bash']))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "compare" in completed(home, "wgmb co")
    assert "--shutter" in completed(home, "wgmb blur --sh")


def test_a_shell_that_is_not_known_is_one_line(home, capsys, monkeypatch):
    monkeypatch.setattr("wgmb.cli.commands.completion.detect_shell", lambda: "powershell")
    why = "the shell is neither bash nor zsh nor fish; --shell names one of them"
    assert make.inside(capsys, "--install-completion") == (2, "", f"wgmb: {why}\n")
    assert files(home) == []


def test_a_shell_that_does_not_find_wgmb_is_helped(home, capsys, monkeypatch):
    monkeypatch.setenv("PATH", "/bin")
    (home / "wgmb").touch()
    monkeypatch.setattr(sys, "executable", str(home / "python"))
    assert installed(capsys, "bash")[-1] == f"    alias wgmb={home / 'wgmb'}"
    monkeypatch.setenv("PATH", str(Path(sys.prefix) / "bin"))
    assert "alias" not in " ".join(installed(capsys, "bash"))
