"""Help of a command in two depths: the options that most runs need, and all of them.

`--help` shows the panel MAIN, `--help-all` the others too. A field of the settings is in MAIN if
options.py says so; a command's own option is, unless it names another group.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import Any

import cyclopts
from cyclopts import Group
from cyclopts.help import DefaultFormatter, HelpEntry, HelpPanel

IN_FULL = "--help-all"
MAIN = Group("Main options", sort_key=0)
INPUT = Group("Input", sort_key=1)
BLUR = Group("Blur", sort_key=2)
SHUTTER = Group("Shutter", sort_key=3)
COLOR = Group("Colour", sort_key=4)
VIDEO = Group("Video", sort_key=5)
OUTPUT = Group("Output", sort_key=6)
RUN = Group("Run", sort_key=7)
METHOD = Group("Options of single methods", sort_key=8)
GROUPS = (MAIN, INPUT, BLUR, SHUTTER, COLOR, VIDEO, OUTPUT, RUN, METHOD)

FIRST = (
    "--output",
    "--job",
    "--shutter",
    "--fps",
    "--method",
    "--samples",
    "--frames",
    "--begin",
    "--end",
    "--vectors",
    "--holdout",
    "--resume",
    "--overwrite",
)
"""The order in MAIN, after positional arguments; a command's other options follow."""
FEW = 18
"""A command with so many options at most shows all of them."""
FEW_EXAMPLES = 3


def place(names: Iterable[str]) -> int:
    """The place in MAIN of an option of these names."""
    named = [name for name in names if name.startswith("--")]
    found = [FIRST.index(name) for name in named if name in FIRST]
    return min(found, default=len(FIRST))


def about(command: cyclopts.App) -> tuple[list[str], list[str]]:
    """Paragraphs that describe a command, and its examples: lines of a shell."""
    text = inspect.getdoc(command.default_command) or ""
    paragraphs = text.partition("\n\nParameters\n")[0].split("\n\n")
    lines = [line for p in paragraphs for line in p.splitlines()]
    mark = "Example: "
    examples = [line.removeprefix(mark) for line in lines if line.startswith(mark)]
    return [" ".join(p.split()) for p in paragraphs if not p.startswith(mark)], examples


class CommandHelp(DefaultFormatter):
    """Help of one command of a program: of MAIN, or of all panels."""

    def __init__(self, program: cyclopts.App, name: str, in_full: bool):
        super().__init__()
        self.program, self.name, self.asked_in_full = program, name, in_full

    def __call__(self, console: Any, options: Any, panel: HelpPanel) -> None:
        """Print one panel, if it is to be shown."""
        entries = [_with_words(entry) for entry in panel.entries]
        hidden = 0 if self.asked_in_full else self._hidden()
        if panel.title == MAIN.name:
            entries.sort(key=lambda entry: (not entry.positional_label, place(entry.names)))
        elif hidden:
            return
        super().__call__(console, options, panel.copy(entries=entries))
        if hidden:
            console.print(f"wgmb {self.name} {IN_FULL} shows {hidden} more options.")

    def _hidden(self) -> int:
        """Number of options that the short help leaves out."""
        found = self.program[self.name].assemble_argument_collection(parse_docstring=False)
        shown = [argument for argument in found if argument.show]
        if len(shown) <= FEW:
            return 0
        groups: list[Any] = [argument.parameter.group for argument in shown]
        return sum(group[0].name != MAIN.name for group in groups)

    def render_description(self, console: Any, options: Any, description: Any) -> None:
        """Print the command's description and examples."""
        paragraphs, examples = about(self.program[self.name])
        for paragraph in paragraphs:
            console.print(f"{paragraph}\n", markup=False, highlight=False)
        shown = examples if self.asked_in_full else examples[:FEW_EXAMPLES]
        if shown:
            console.print(f"Example{'s' if len(shown) > 1 else ''}:")
        for line in shown:
            console.print(f"  {line}", markup=False, highlight=False, soft_wrap=True)
        console.print()


def _with_words(entry: HelpEntry) -> HelpEntry:
    """The entry with the kind of its value: N, X, TEXT, PATH, or its choices if they are short."""
    value, choices = entry.metavar or "", entry.choices or ()
    words = [_KINDS.get(word, word) for word in value.removesuffix("...").split("|")]
    listed = "|".join([*(word for word in words if word != "CHOICE"), *choices])
    if choices and len(listed) <= _LONGEST:
        return entry.copy(metavar=listed, choices=None)
    words = ["|".join("WORD" if word == "CHOICE" else word for word in words)]
    return (
        entry.copy(metavar=words[0] + ("..." if value.endswith("...") else "")) if value else entry
    )


_KINDS = {"STR": "TEXT", "INT": "N", "FLOAT": "X", "FLOAT FLOAT": "X X"}
_LONGEST = 18
