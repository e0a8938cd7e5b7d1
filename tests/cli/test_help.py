"""Help in two depths, and helps that offer only what can work."""

import re

import pytest

import make_frames as make
from wgmb.cli import app
from wgmb.methods import METHODS, frame_methods

pytestmark = pytest.mark.fast


def options(text: str) -> list[str]:
    """The options that begin a line of a panel, in their order."""
    return re.findall(r"^│[ *]{1,4}(?:[A-Z]+ )?(--[a-z-]+)", text, re.MULTILINE)


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


@pytest.fixture
def said(capsys):
    return lambda *words: make.inside(capsys, *words)[1]


def test_the_short_help_of_blur_fits_a_window_and_begins_with_what_everybody_needs(said):
    text = said("blur", "--help")
    assert len(text.splitlines()) <= 44
    assert options(text)[:3] == ["--pattern", "--output", "--shutter"]
    assert 12 <= len(options(text)) <= 14
    more = re.search(r"^wgmb blur --help-all shows (\d+) more options\.$", text, re.MULTILINE)
    assert more and int(more[1]) + len(options(text)) == len(options(said("blur", "--help-all")))


@pytest.mark.parametrize("command", app.COMMANDS)
def test_the_full_help_has_every_option_once_and_those_of_single_methods_last(said, command):
    found = app.make_app(command)[command].assemble_argument_collection()
    known = {one.names[0] for one in found if one.show and one.names[0].startswith("--")}
    text = said(command, "--help-all")
    short = options(said(command, "--help"))
    assert sorted(options(text)) == sorted(known)
    assert options(text)[: len(short)] == short
    assert "more options" not in text
    if "Options of single methods" in text:
        assert "--variant" in options(text.partition("Options of single methods")[2])
        assert text.count("╭") == text.partition("Options of single methods")[0].count("╭")


def test_a_command_with_few_options_shows_all(said):
    assert said("shutter", "--help") == said("shutter", "--help-all")
    assert "--rolling-duration" in said("shutter", "--help")


@pytest.mark.parametrize("depth", ["--help", "--help-all", "-h"])
def test_the_program_has_one_depth(said, depth):
    assert said(depth) == said("--help")


@pytest.mark.parametrize(
    "command, offered, others",
    [("blur", {}, {"--seed"}), ("job", {}, {"--seed"}), ("view", {"--seed"}, {}),
     ("render", {"--seed"}, {"--holdout", "--scale"}), ("perceive", {"--overwrite"}, {"--resume"})],
)  # fmt: skip
def test_a_help_offers_only_options_that_the_command_takes(said, command, offered, others):
    shown = set(options(said(command, "--help-all")))
    assert set(offered) <= shown
    assert not set(others) & shown


@pytest.mark.parametrize("command", ["blur", "job", "render"])
def test_a_help_offers_only_methods_that_can_work(said, command):
    text = " ".join(re.sub(r"[│\n]", " ", said(command, "--help")).split())
    listed = re.search(r"--method TEXT ([a-z, ]+)", text)
    assert listed
    wanted = METHODS if command == "render" else frame_methods()
    assert set(re.findall(r"[a-z]+", listed[1])) >= set(wanted)
    for name in METHODS.keys() - set(wanted):
        assert name not in text


@pytest.mark.parametrize(
    "text, said",
    [("[blur]\nmax_blurr = 3", "unknown option max_blurr; did you mean 'max_blur'?"),
     ("[blur]\njitter = 'much'", "jitter: 'much' is not a number"),
     ("[blur\n", "not TOML: Expected ']' at the end of a table declaration (at line 1, column 6)"),
     ("[blurr]\nshutter = 90", "unknown table [blurr]; did you mean 'blur'?"),
     ("shutter = 90", "shutter is in no table; write it below [blur]"),
     ("[render]\nshutter = 90", "no table [blur], which wgmb blur reads")],
)  # fmt: skip
def test_a_settings_file_is_corrected_in_its_own_words(tmp_path, capsys, monkeypatch, text, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(text)
    line = ("blur", "shot.####.exr", "-o", "o.####.exr", "--config", "s.toml")
    assert make.inside(capsys, *line) == (2, "", f"wgmb: s.toml: {said}\n")
