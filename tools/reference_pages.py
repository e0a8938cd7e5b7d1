"""The command line's reference, and tables of scenes and conventions, asked of the program.

    python tools/reference_pages.py     write them into the pages, after a change of an option

A page has them between comments such as `<!-- commands -->` and `<!-- end of commands -->`.
tests/project/test_docs.py holds them to the program.
"""

import inspect
import re
from pathlib import Path
from typing import Any

from cyclopts import App

from wgmb.cli.app import COMMANDS, make_app
from wgmb.cli.help import GROUPS, MAIN, about, place
from wgmb.scene import builtin
from wgmb.sequence.layers.vectors import CONVENTIONS
from wgmb.settings.input import PROGRAMS

DOCS = Path(__file__).parents[1] / "docs"
_KINDS = {bool: "", int: "N", float: "X", str: "TEXT", Path: "PATH"}


def reference() -> str:
    """Every command with its options, as Markdown."""
    wgmb_app = make_app(*COMMANDS)
    names = [name for name in wgmb_app if not name.startswith("-")]
    return "\n".join(_command(name, wgmb_app[name]) for name in names)


def scene_table() -> str:
    """Every built-in scene with its parameters and their defaults, as Markdown."""
    rows = ["| scene | shows | parameters of `--set` |", "|---|---|---|"]
    for name, make in builtin.SCENES.items():
        about = _plain(inspect.getdoc(make) or "").partition("\n")[0]
        parameters = inspect.signature(make).parameters.values()
        settings = ", ".join(f"`{p.name}={p.default}`" for p in parameters)
        rows.append(f"| `{name}` | {about} | {settings} |")
    return "\n".join(rows) + "\n"


def convention_table() -> str:
    """Values of `--vectors`, as Markdown."""
    rows = ["| `--vectors` | meaning of the numbers |", "|---|---|"]
    rows += [f"| `{name}` | {_plain(c.about)} |" for name, c in CONVENTIONS.items()]
    return "\n".join(rows) + "\n"


def program_table() -> str:
    """Values of `--program`, as Markdown."""
    rows = ["| `--program` | frames of | it sets |", "|---|---|---|"]
    for name, program in PROGRAMS.items():
        words = (f"`--{k.replace('_', '-')} {v}`" for k, v in program.options.items())
        rows.append(f"| `{name}` | {program.name} | {', '.join(words)} |")
    return "\n".join(rows) + "\n"


def _command(name: str, command: App) -> str:
    """A section about one command."""
    # The options of the whole program are not repeated under each command.
    found = command.assemble_argument_collection(parse_docstring=True)
    shown = [argument for argument in found if argument.show]
    words = [_usage(argument) for argument in shown if argument.required]
    paragraphs, examples = about(command)
    text = "\n\n".join(map(_plain, paragraphs))
    lines = [f"## wgmb {name}", "", text, ""]
    lines += ["```text", f"wgmb {' '.join((name, *words))} [OPTIONS]", "```", ""]
    lines += ["```sh", *examples, "```", ""] if examples else []
    groups: dict[str, list[Any]] = {group.name: [] for group in GROUPS}
    for argument in shown:
        groups.setdefault(argument.parameter.group[0].name, []).append(argument)
    groups[MAIN.name].sort(key=lambda one: (not _is_position(one), place(one.names)))
    for group, found in groups.items():
        lines += [f"### {group}", ""] if found else []
        lines += [*map(_option, found), ""] if found else []
    return "\n".join(lines)


def _is_position(argument) -> bool:
    """True if an argument needs no name."""
    return argument.field_info.is_positional and not argument.field_info.is_keyword_only


def _names(argument) -> list[str]:
    """Names of an option, the long form first; a position has its name in capitals."""
    names = [n for n in argument.names if not n.startswith(("--no-", "--empty-"))]
    if _is_position(argument):
        return [names[0].lstrip("-").upper()]
    return sorted(names, key=len, reverse=True)


def _usage(argument) -> str:
    name, kind = _names(argument)[0], _kind(argument)
    return f"{name} {kind}" if kind else name


def _kind(argument) -> str:
    """The value of an option: its words, or their kind."""
    if not _names(argument)[0].startswith("-"):
        return ""
    hint, choices = argument.hint, argument.get_choices() or ()
    inner = getattr(hint, "__args__", ()) or (hint,)
    kinds = [_KINDS[kind] for kind in dict.fromkeys(inner) if kind in _KINDS]
    if str(hint).startswith("tuple[float, float]"):
        return "X X"
    if tuple[float, float] in inner:
        return "X|X,Y"
    return "|".join((*choices, *(kind for kind in kinds if kind)))


def _option(argument) -> str:
    """An entry of a list."""
    names, kind = _names(argument), _kind(argument)
    default, notes = argument.field_info.default, []
    if argument.required:
        notes.append("Required.")
    elif default not in (None, False, (), inspect.Parameter.empty):
        shown = " ".join(f"{x:g}" for x in default) if isinstance(default, tuple) else default
        shown = f"{shown:g}" if isinstance(shown, float) else shown
        notes.append(f"Default: `{shown}`.")
    written = ", ".join(f"`{name} {kind}`".replace(" `", "`") for name in names)
    about = _plain(" ".join((argument.parameter.help or "").split()))
    return f"- {written}: {' '.join((about, *notes))}"


def _plain(text: str) -> str:
    """Text whose options and file names are marked as such, and nothing else is."""
    text = text.replace("*", "\\*").replace("|", "\\|")
    return re.sub(r"(?<![\w`-])(--[a-z][a-z-]+|[A-Za-z_]+\.[#%]\S*\w|[A-Z]+=[A-Z]+)", r"`\1`", text)


PAGES = {
    "reference/cli.md": ("commands", reference),
    "python/scenes.md": ("scenes", scene_table),
    "artists/other-programs.md": ("programs", program_table),
    "artists/vectors-look-wrong.md": ("conventions", convention_table),
}
"""The mark of each page, and the function that makes what follows it."""


def filled(page: str, text: str) -> str:
    """The text of a page with what it has of the program as it is now."""
    mark, make = PAGES[page]
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    before, _, rest = text.partition(begin)
    return f"{before}{begin}\n{make().strip()}\n\n{end}{rest.partition(end)[2]}"


def main() -> None:
    """Write the pages anew."""
    for page in PAGES:
        path = DOCS / page
        path.write_text(filled(page, path.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
