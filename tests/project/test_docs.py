"""The examples of the documentation work: Python, command lines, options, links."""

import csv
import gc
import re
import shlex
import tomllib
from datetime import date
from functools import cache
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import cyclopts
import numpy as np
import pytest
import reference_pages
import scores_page

import make_clips
import wgmb
from wgmb import METHODS
from wgmb.cli import app as cli
from wgmb.scene import builtin

HERE = Path(__file__).parents[2]
PAGES = {
    str(path.relative_to(HERE)): path.read_text(encoding="utf-8")
    for path in (HERE / "README.md", HERE / "CONTRIBUTING.md", *sorted(HERE.glob("docs/**/*.md")))
}
app = cli.make_app(*cli.COMMANDS)
COMMANDS = {name: app[name] for name in cli.COMMANDS}
ADD_ON = HERE / "blender/wgmb_blender/command.py"
MOST_LINES = 125  # of the README


def blocks(text: str, language: str) -> list[str]:
    """The fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


@cache
def options() -> set[str]:
    """Every name of every option of every command."""
    commands = [*COMMANDS.values(), app["--install-completion"]]
    found = [command.assemble_argument_collection() for command in commands]
    names = {name for arguments in found for argument in arguments for name in argument.names}
    return names | {*app.help_flags, *app.version_flags}


WITH_PYTHON = [name for name, text in PAGES.items() if blocks(text, "python")]
LINES = [
    pytest.param(line, id=f"{name}: {line}")
    for name, text in PAGES.items()
    for block in blocks(text, "sh")
    for line in block.splitlines()
    if line.startswith("wgmb ")
]


BRIEF = {"docs/python/quickstart.md", "docs/python/sequences.md", "README.md"}  # in every run


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[pytest.mark.full] * (p not in BRIEF)) for p in WITH_PYTHON]
)
def test_python_blocks_run_in_their_order(page, tmp_path, monkeypatch):
    (tmp_path / "sample").symlink_to(HERE / "sample")
    make_clips.write(tmp_path / "in.mp4", tone=0.1)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for i, block in enumerate(blocks(PAGES[page], "python"), 1):
        exec(compile(block, f"{page}, block {i}", "exec"), names)


RECIPES = [block for text in PAGES.values() for block in blocks(text, "py")]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # MoviePy's pipes
@pytest.mark.parametrize("block", RECIPES, ids=lambda block: block.split()[1])
def test_recipes_with_other_packages_run_where_those_are(block, tmp_path, monkeypatch):
    package = pytest.importorskip(block.split()[1])
    if package.__name__ == "vapoursynth" and not hasattr(package.core, "bs"):
        pytest.skip("VapourSynth has no BestSource here")
    make_clips.write(tmp_path / "in.mp4", tone=0.1)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "recipe", "exec"), {"np": np, "wgmb": wgmb})
    gc.collect()


def test_the_pages_that_teach_python_have_blocks():
    taught = {name for name in PAGES if re.fullmatch(r"docs/python/[a-z-]+\.md", name)}
    others = {
        "README.md",
        "docs/artists/in-other-programs.md",
        "docs/engineers/embedding.md",
        "docs/engineers/flow.md",
    }
    assert taught - {"docs/python/api.md"} | others == set(WITH_PYTHON)


@pytest.mark.parametrize("line", LINES)
def test_command_lines_are_understood(line, monkeypatch):
    monkeypatch.setattr(app, "config", ())
    command, *words = shlex.split(line)[1:]
    assert command in COMMANDS
    try:
        app.parse_args([command, *words], exit_on_error=False, print_error=False)
    except cyclopts.MissingArgumentError:
        assert "--config" in words  # the file has it
    for option, word in pairwise(words):
        assert option != "--method" or word in METHODS
    if command == "render" and not words[0].startswith("-"):
        assert words[0] in builtin.SCENES


def test_a_wrong_option_is_not_understood():
    with pytest.raises(cyclopts.UnknownOptionError):
        app.parse_args(
            ["blur", "a.exr", "-o", "b.exr", "--no-such"], exit_on_error=False, print_error=False
        )


@pytest.mark.parametrize("page", PAGES)
def test_every_option_that_is_named_exists(page):
    named = set(re.findall(r"`(--[a-z][a-z-]+)", PAGES[page]))
    known = options()
    if page.endswith("blender-add-on.md"):  # of `blender -c wgmb`
        known = set(re.findall(r'"(--[a-z-]+)"', ADD_ON.read_text("utf-8")))
    assert named - known == set()


@pytest.mark.parametrize("page", PAGES)
def test_every_link_to_a_file_leads_to_one(page):
    text = re.sub(r"^```.*?^```", "", PAGES[page], flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, _ = unquote(target).partition("#")
        if path and not re.match(r"[a-z]+:", path):
            assert ((HERE / page).parent / path).is_file(), target


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_a_page_that_says_where_it_fails(method):
    text = PAGES[f"docs/engineers/methods/{method}.md"]
    for heading in ("Idea", "Equation", "Artefacts", "Cost"):
        assert f"\n## {heading}\n" in text
    assert f"[`{method}`]({method}.md)" in PAGES["docs/engineers/methods/index.md"]


def test_the_readme_is_short():
    assert len(PAGES["README.md"].splitlines()) <= MOST_LINES


@pytest.mark.parametrize(
    ("html", "fault"),
    [
        ('<a href="b.html#there">', None),
        ('<a href="https://example.org/">', None),
        ('<img src="data:image/png;base64,AAAA">', None),
        ('<a href="c.html">', "a.html links to c.html, which is not there"),
        ('<a href="b.html#gone">', "a.html links to b.html#gone, where there is no such place"),
        ('<a href="#gone">', "a.html links to #gone, where there is no such place"),
        ('<img src="c.png">', "a.html links to c.png, which is not there"),
        ('<script src="//example.org/x.js">', "a.html loads //example.org/x.js"),
        ('<link href="http://example.org/x.css">', "a.html loads http://example.org/x.css"),
    ],
)
def test_a_site_that_does_not_hold_together_is_told(html, fault, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(HERE / "docs" / "extensions")
    from self_contained import faults

    (tmp_path / "a.html").write_text(html)
    (tmp_path / "b.html").write_text('<p id="there">')
    assert faults(tmp_path) == ([fault] if fault else [])
    (tmp_path / "x.css").write_text("@font-face { src: url('https://example.org/x.woff2') }")
    assert "x.css loads https://example.org/x.woff2" in faults(tmp_path)


def test_the_table_of_extras_has_them_all():
    text = PAGES["docs/reference/extras.md"]
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    assert re.findall(r"^\| `(\w+)` \|", text, re.M) == [*project["optional-dependencies"]]


def test_the_list_of_the_api_has_every_exported_name():
    listed = re.findall(r"`(\w+)(?:\.\w+)?`", PAGES["docs/python/api.md"])
    assert sorted(set(wgmb.__all__) - {*listed}) == []


DECISIONS = (HERE / "docs/laboratory/decisions.csv").read_text("utf-8").splitlines()
COLUMNS = ("date", "rule", "constant", "scenes", "before", "after")


def defined(constant: str) -> bool:
    """True if `FILE:NAME` is a constant or function at the top of that file."""
    path, _, name = constant.partition(":")
    file = HERE / path
    begins = rf"^(?:(?:const|override|fn|def|class) +)?{re.escape(name)}\b *[:=(]"
    return file.is_file() and re.search(begins, file.read_text("utf-8"), re.M) is not None


@pytest.mark.fast
def test_every_decision_is_complete_and_its_constant_is_in_the_code():
    """A row goes when its rule goes; docs/laboratory/conclusions.md explains the columns."""
    rows = [*csv.DictReader(DECISIONS, strict=True)]
    assert tuple(rows[0]) == COLUMNS and len(rows) > 60
    for row in rows:
        assert all((row[name] or "").strip() for name in COLUMNS) and len(row) == len(COLUMNS), row
        assert date.fromisoformat(row["date"])
        assert row["before"] != row["after"], row
        assert all(re.search(r"\d", row[name]) for name in ("before", "after")), row
        assert defined(row["constant"]), row["constant"]


@pytest.mark.fast
@pytest.mark.parametrize("name", ["NEVER", "GOES", "is_hidden_at_all"])
def test_a_constant_that_is_gone_is_noticed(name):
    path = "wgsl/methods/gather/search/visibility.wgsl"
    assert defined(f"{path}:GOES_ON") and not defined(f"{path}:{name}")
    assert not defined(f"wgsl/none.wgsl:{name}")


@pytest.mark.fast
def test_a_tool_writes_its_part_of_the_scores_and_nothing_else(tmp_path, monkeypatch):
    text = PAGES["docs/laboratory/scores.md"]
    monkeypatch.setattr(scores_page, "PAGE", tmp_path / "scores.md")
    scores_page.PAGE.write_text(text, "utf-8")
    names = re.findall(r"<!-- end of (.+) -->", text)
    assert len(names) > 3
    for name in names:
        assert "\n| ---" in scores_page.part(name)
        scores_page.write(name, scores_page.part(name))
    assert scores_page.PAGE.read_text("utf-8") == text
    scores_page.write(names[0], scores_page.table([["a", "b"], ["1", "2"]]))
    assert scores_page.part(names[0]) == "| a | b |\n| --- | --- |\n| 1 | 2 |\n\n"
    assert scores_page.part(names[1]) in text
    with pytest.raises(ValueError, match="must have <!-- none -->"):
        scores_page.part("none")


WRITING = re.compile(r"^wgmb .* -o ('[^']*'|\S+)", re.M)


@pytest.mark.fast
@pytest.mark.parametrize("page", sorted(PAGES.keys() - {"docs/reference/cli.md"}))
def test_no_example_of_a_page_writes_over_one_before_it(page):
    """Whoever follows a page from its top is not told that the output exists.

    Examples of the reference stand alone.
    """
    lines = [line for block in blocks(PAGES[page], "sh") for line in block.splitlines()]
    found = [
        match[1]
        for line in lines
        if (match := WRITING.match(line)) and not re.search("--(resume|overwrite)", line)
    ]
    assert not {name for name in found if found.count(name) > 1}


@pytest.mark.fast
def test_every_file_that_the_page_on_the_architecture_names_is_there():
    page = PAGES["docs/development/architecture.md"].partition("## Where is it?")[2]
    named = re.findall(r"`([a-z_0-9/]+/?\.?(?:py|wgsl)?)`", page.partition("\n## ")[0])
    assert len(named) > 12
    assert [n for n in named if not any((HERE / base / n).exists() for base in ("", "wgmb"))] == []


@pytest.mark.fast
@pytest.mark.parametrize("page", reference_pages.PAGES)
def test_pages_have_what_the_program_says(page):
    """After a change: python tools/reference_pages.py."""
    text = PAGES[f"docs/{page}"]
    assert reference_pages.filled(page, text) == text
