"""`wgmb --install-completion`: a file by which the shell completes commands and options."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from pathlib import Path
from typing import Annotated, Literal, cast

import cyclopts
from cyclopts import Parameter
from cyclopts.completion import ShellDetectionError, detect_shell

from ...errors import InputError
from ..app import COMMANDS, make_app
from ..exit_codes import DONE
from ..terminal import out

Shell = Literal["bash", "zsh", "fish"]
_MARK = "# Written by `wgmb --install-completion`, which may replace this file."


def install_completion(
    *, shell: Shell | None = None, output: Annotated[Path | None, Parameter(alias="-o")] = None
) -> int:
    """Let the shell (bash, zsh or fish) complete commands and options.

    Writes one file, and says how the shell loads it. No other file is changed.

    Example: wgmb --install-completion --shell bash

    Parameters
    ----------
    shell
        The shell; by default the one that runs.
    output
        File to write; by default where the shell looks for completions.
    """
    shell = shell or _running()
    path = (output or _place(shell)).absolute()
    if path.exists() and _MARK not in path.read_text("utf-8", "replace"):
        raise InputError(f"{path} exists and was not written by wgmb; --output names another file")
    text = _whole_app().generate_completion(shell=shell)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{text.rstrip()}\n{_MARK}\n", "utf-8")
    out(f"-> {path}")
    for line in _loading(shell, path):
        out(line)
    own = Path(sys.executable).with_name("wgmb")
    if not shutil.which("wgmb") and own.exists():
        out("The shell does not find wgmb yet. This line, in the same file, makes it known:")
        out(f"    alias wgmb={shlex.quote(str(own))}")
    return DONE


def _running() -> Shell:
    try:
        found = detect_shell()
    except ShellDetectionError:
        found = "powershell"
    if found == "powershell":
        raise InputError("the shell is neither bash nor zsh nor fish; --shell names one of them")
    return cast(Shell, found)


def _place(shell: Shell) -> Path:
    """The file where a shell looks for the completions of wgmb."""
    data = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    config = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return {
        "bash": data / "bash-completion" / "completions" / "wgmb",
        "zsh": Path.home() / ".zsh" / "completions" / "_cyclopts_wgmb",  # as its function
        "fish": config / "fish" / "completions" / "wgmb.fish",
    }[shell]


def _loading(shell: Shell, path: Path) -> list[str]:
    """Lines that tell how new shells load the file."""
    if shell == "fish":
        return ["New shells load it by themselves (config.fish is for lines of your own)."]
    if shell == "zsh":
        folder = shlex.quote(str(path.parent))
        return [
            "New shells load it after these lines in ~/.zshrc (the first before any compinit):",
            f"    fpath=({folder} $fpath)",
            "    autoload -Uz compinit && compinit",
        ]
    return [
        "New shells load it if the package bash-completion is set up; if not, by ~/.bashrc with:",
        f"    . {shlex.quote(str(path))}",
    ]


def _whole_app() -> cyclopts.App:
    """The program with all options; of a command whose packages are missing, the name alone."""
    app = make_app(*COMMANDS)
    for name, line in COMMANDS.items():
        try:
            app[name]
        except ImportError:
            del app[name]
            app.command(cyclopts.App(name=name, help=line))
    return app
