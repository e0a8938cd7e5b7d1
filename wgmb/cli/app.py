"""The command line: commands, and errors as one line and an exit code.

The module of a command is loaded on first use.
"""

from __future__ import annotations

import atexit
import logging
import os
import re
import signal
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import cyclopts
from cyclopts import Parameter
from cyclopts.config import Dict

from .._version import __version__
from ..allocator import bound_free_memory
from ..errors import DeviceError, Error, InputError, did_you_mean, meant_setting
from ..extras import EXTRAS, reason
from ..interpreter import handle_signals
from ..io.pipes import STDIN, STDOUT
from . import interruption, run_log, terminal
from .exit_codes import DONE, INTERRUPTED, NO_DEVICE, SOME_FAILED, USAGE
from .help import IN_FULL, MAIN, CommandHelp
from .spelling import as_options

_OUTPUTS = "-o", "--output", "--log-json"


def named(words: Sequence[str]) -> list[str]:
    """The words of a command line with the names of the streams in place of `-`."""
    found = []
    for before, word in zip(["", *words], words, strict=False):
        if word == "-":
            word = STDOUT if before in _OUTPUTS else STDIN
        option, _, value = word.partition("=")
        found.append(f"{option}={STDOUT}" if option in _OUTPUTS and value == "-" else word)
    return found


COMMANDS = {
    "blur": "Blur rendered frames or videos.",
    "job": "Write a job file, from which any machine can blur any part of a sequence.",
    "render": "Render a built-in scene with motion blur.",
    "view": "View a scene, frames or a video interactively.",
    "info": "Describe a frame or a video: layers, sizes, motion vector convention, speeds.",
    "vectors": "Write the motion of frames in the form of another program.",
    "doctor": "Describe this installation and test one blur, as text to paste into a report.",
    "devices": "List the GPUs for --adapter (or WGMB_ADAPTER); * is the default.",
    "compare": "Score and time methods against a ground truth; write an HTML, JSON and CSV report.",
    "bench": "Time methods and videos here: median milliseconds per frame, transfers apart.",
    "perceive": "Simulate a viewer's perception: each frame is held, and earlier ones fade.",
    "shutter": "Draw a shutter: its curve, its integral, and the sum of neighbouring windows.",
}
"""Every command, wgmb/cli/commands/NAME.py, and the first line of its help."""


def make_app(*whole: str) -> cyclopts.App:
    """Return the program; commands in `whole` have a help, the others their line of COMMANDS.

    A help lies in a command's module, which `wgmb --help` must not load; help.py has its two
    depths, of which "--help-all" in `whole` is the second.
    """
    app = cyclopts.App(
        name="wgmb",
        version=__version__,
        help="Motion blur on the GPU, for rendered frames and videos.\n\n"
        "Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180\n\n"
        "Example: wgmb blur in.mp4 -o out.mp4 --shutter 180 --fps 60",
        result_action="return_value",
        suppress_keyboard_interrupt=False,
        default_parameter=Parameter(negative=(), show_default=_default),
        group_arguments=MAIN,
        group_parameters=MAIN,
        help_flags=("--help", "-h", IN_FULL),
    )
    app.command(
        "wgmb.cli.commands.completion:install_completion",
        name="--install-completion",
        help="Let the shell (bash, zsh or fish) complete commands and options.",
    )
    for name, line in COMMANDS.items():
        app.command(
            f"wgmb.cli.commands.{name}:{name}",
            name=name,
            help=None if name in whole else line,
            help_formatter=CommandHelp(app, name, IN_FULL in whole),
        )
    return app


def _default(value: object) -> str | None:
    """A default as the help shows it; None for flags, empty lists and options without one."""
    if value is None or value == () or isinstance(value, bool):
        return None
    if isinstance(value, tuple):
        return " ".join(f"{part:g}" for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    terminal.own_streams()
    terminal.interrupted.clear()
    words = named(sys.argv[1:] if arguments is None else arguments)
    code = _code(words)
    run_log.end(code)
    return code


def _code(words: list[str]) -> int:
    """Run a command; a failure is an error in one line, and an exit code."""
    try:
        handle_signals(terminal.interrupt)
        warnings.simplefilter("ignore")  # libraries' remarks on damaged files; ours are errors
        logging.getLogger().addHandler(logging.NullHandler())  # nor their logs
        return _command(words)
    except cyclopts.UnknownOptionError as error:
        why = _elsewhere(words, error) or _unknown(words, error)
        return _say_why(f"{why}{_hint(words)}", USAGE)
    except cyclopts.CycloptsError as error:
        return _say_why(f"{_plainly(str(error), words)}{_hint(words)}", USAGE)
    except DeviceError as error:
        return _say_why(str(error), NO_DEVICE)
    except Error as error:
        return _say_why(str(error), USAGE)
    except ImportError as error:
        cause = error.__cause__  # of a command's module that cannot be loaded
        own = words[0] if words[0] in {package.extra for package in EXTRAS.values()} else ""
        if not (why := reason(cause if isinstance(cause, ImportError) else error, own)):
            raise
        return _say_why(f"{words[0]}: {why}", USAGE)
    except OSError as error:
        why = error.strerror.lower() if error.strerror else str(error)
        if error.filename is not None:  # what was named cannot be opened
            return _say_why(f"{error.filename}: {why}", USAGE)
        return _say_why(why, SOME_FAILED)
    except MemoryError:
        return _say_why("not enough memory", SOME_FAILED)
    except KeyboardInterrupt:
        interruption.expect_no_message()
        return _say_why("interrupted", INTERRUPTED)
    except Exception as error:
        if (why := _device_error(error)) is None:
            raise
        return _say_why(str(why), NO_DEVICE)


def _device_error(error: Exception) -> Error | None:
    """The error of the GPU that an exception of wgpu stands for; None where it is none."""
    if "wgpu" not in sys.modules:
        return None
    from ..gpu import translated

    ours = translated(error)
    return ours if isinstance(ours, Error) else None


def _command(words: list[str]) -> int:
    """Run a command; KeyboardInterrupt once it is interrupted, whatever it makes of that."""
    try:
        _check_text(words)
        app = make_app(*words)
        app.config = _config(words)
        result = app(words, exit_on_error=False, print_error=False)
        terminal.flush()
    except Exception as error:  # of a library left half done, or of a terminal that is closed
        terminal.check()
        _tell_faults(words, str(error))
        raise
    _tell_faults(words)
    terminal.check()  # a window's loop, which handles signals itself, just ends
    return result if isinstance(result, int) else DONE


def _tell_faults(words: list[str], message: str = "") -> None:
    """Say which methods of other packages cannot be used, unless an error's message has it."""
    if "wgmb.methods" not in sys.modules or {"-q", "--quiet"} & set(words):
        return
    from ..methods import METHODS

    for fault in METHODS.faults.values():
        if fault not in message:
            terminal.note(fault)


def _check_text(words: list[str]) -> None:
    """Names go into files and libraries that take text only."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            shown = os.fsencode(word).decode("utf-8", "backslashreplace")
            raise InputError(f"{shown}: not UTF-8; please rename the file or folder") from None


def _unknown(words: list[str], error: cyclopts.UnknownOptionError) -> str:
    """The message about an option of the command line, or of a --config file, that is none."""
    if error.token is None:
        return str(error)
    name = (error.token.keyword or error.token.value).strip("[]")
    known = {one.removeprefix("--").replace("-", "_") for one in _options(words[0])}
    setting, value = meant_setting(name.lstrip("-").replace("-", "_"), known)
    if error.token.source != "cli":
        meant = f"{setting} = {value!r}" if value else repr(setting)
        return f"{error.token.source}: unknown option {name}" + (
            f"; did you mean {meant}?" if setting else ""
        )
    meant = f"--{setting.replace('_', '-')}{' ' * bool(value)}{value}"
    return f"unknown option {name}" + (f"; did you mean {meant}?" if setting else "")


def _options(command: str) -> set[str]:
    """The options of a command by their names."""
    if command not in COMMANDS:
        return set()
    found = make_app(command)[command].assemble_argument_collection()
    return {name for one in found for name in one.names if name.startswith("--")}


def _plainly(text: str, words: list[str]) -> str:
    """The message about a value of another type, in words: a number, not int|None; about a
    missing option, how to give it.
    """
    if words[:1] == ["blur"] and any(w.partition("=")[0] == "--job" for w in words):
        from .commands.blur import NOT_WITH_JOB

        if "--output" in text:  # which is missing where another option of the output is given
            return NOT_WITH_JOB
    if missing := re.fullmatch(r'Command "(.*)" parameter (\S+) requires an argument\.', text):
        option = "--output (-o)" if missing[2] in ("--output", "-o") else missing[2]
        value = " and its value" if option.startswith("-") else ""
        return f"{missing[1]} needs {option}{value}; `wgmb {missing[1]} --help` tells more"
    if unused := re.fullmatch(r"Unused Tokens: \['?(.*?)'?(?:, .*)?\]\.", text):
        return (
            f"{words[0]} does not take the word {unused[1]!r}; `wgmb {words[0]} --help` tells more"
        )
    if twice := re.fullmatch(r"Parameter (\S+) specified multiple times\.", text):
        return f"{twice[1]} is given more than once"
    text = re.sub(r"^Invalid value for \[(\w+)\] from (.+?): ", r"\2: \1: ", text)
    m = re.fullmatch(r'(.*): unable to convert "(.*)" into (.*)\.', text, re.DOTALL)
    if m is None:
        return text
    kinds = [kind for kind in m[3].split("|") if kind != "None"]
    choices = [word for kind in kinds for word in re.findall(r"(?<=Literal\[)[^\]]*", kind)]
    known = [_KINDS.get(kind, kind) for kind in kinds if not kind.startswith("Literal")] + choices
    return f"{m[1]}: {m[2]!r} is not {' or '.join(known)}{did_you_mean(m[2], choices)}"


def _elsewhere(words: list[str], error: cyclopts.UnknownOptionError) -> str:
    """The message about an option that `wgmb view` lacks and `wgmb blur` has; '' for others."""
    name = error.token.keyword or error.token.value if error.token else ""
    if words[:1] != ["view"]:
        return ""
    if name not in _options("blur"):
        return ""
    why = "the viewer shows frames at their own rate"
    why = why if name == "--fps-in" else "the viewer writes no files by options"
    return f"{name} is for `wgmb blur`: {why}"


_KINDS = {"int": "a whole number", "float": "a number", "str": "text", "Path": "a path"}


def _hint(words: list[str]) -> str:
    """Return a hint if a file name was parsed as an option."""
    for word in words:
        if re.fullmatch(r"-[^=]*\.[A-Za-z]\w*", word):
            return f" For a file whose name begins with -, write ./{word}"
    return ""


def _config(words: list[str]) -> tuple[Dict, ...]:
    """Return the values of the --config file; options on the command line take precedence."""
    for i, word in enumerate(words if words[:1] != ["view"] else []):
        name, _, given = word.partition("=")
        if name == "--config" and (given or words[i + 1 :]):
            from ..sequence.frame_file import about
            from ..settings.toml import parse, text_of

            path = Path(given or "".join(words[i + 1 : i + 2]))
            with about(path):
                tables = parse(text_of(path))
                _check_tables(tables, words[0])
                if words[0] == "job" and "blur" in tables:
                    tables["job"] = tables["blur"]
                return (Dict(tables, source=str(path)),)
    return ()


def _check_tables(tables: dict[str, object], command: str) -> None:
    """InputError for entries of a --config file that no command reads."""
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise InputError(f"{name} is in no table; write it below [{command}]")
        if name not in COMMANDS:
            known = [*COMMANDS, "view"]
            raise InputError(f"unknown table [{name}]{did_you_mean(name, known)}")
    own = ("job", "blur") if command == "job" else (command,)
    if tables and not tables.keys() & set(own):
        raise InputError(f"no table [{own[-1]}], which wgmb {command} reads")


def _say_why(text: str, code: int) -> int:
    terminal.complain(text)
    run_log.end(code, as_options(text))
    return code


def run(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    sys.unraisablehook = terminal.hush
    bound_free_memory()
    interruption.watch()
    codes: list[int] = []
    atexit.register(_insist, codes)  # before all others, so it is called after them
    code = main(arguments)
    if code == INTERRUPTED:
        interruption.finish()
    handle_signals(lambda *_: os._exit(code))  # nothing is left to be interrupted
    terminal.drop_streams()
    codes.append(code)
    sys.exit(code)


def _insist(codes: list[int]) -> None:
    """End the process with its exit code.

    Where an interruption was raised within `exec()` of a text, as dataclasses use it, `python -m`
    would end the process by SIGINT, although the exception was caught. And Python gives up its
    handlers of signals before it has ended.
    """
    handle_signals(signal.SIG_IGN)
    if codes == [INTERRUPTED]:
        os._exit(INTERRUPTED)
