"""Errors speak the user's words: the library names arguments, the command line its options."""

import ast
import re
from pathlib import Path

import pytest

import make_frames as make
import wgmb
from wgmb import InputError, errors
from wgmb.cli import app
from wgmb.cli.spelling import as_options, options
from wgmb.errors import check_choice

PACKAGE = Path(wgmb.__file__).parent
OPTION = re.compile(r"(?:^|[\s`'\"])--[a-z][a-z-]*(?=[\s,;.`'\"]|$)")
ARGUMENT = re.compile(r"`(\w+)(?:=[^`]*)?`")
# They speak to people who see options, a window, Python alone, or pytest; of pip's options.
OTHERS = {"cli", "viewer", "hosts", "testing", "extras.py"}
LIBRARY = [
    f for f in sorted(PACKAGE.rglob("*.py")) if f.relative_to(PACKAGE).parts[0] not in OTHERS
]


def texts(file: Path):
    """Every text of a module but docstrings and the help under fields: what messages are of.

    What is put into a formatted text is written as {}.
    """
    tree = ast.parse(file.read_text())
    parts = {id(n) for joined in ast.walk(tree) if isinstance(joined, ast.JoinedStr)
             for n in ast.walk(joined) if isinstance(n, ast.Constant)}  # fmt: skip
    told = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(
                str(n.value) if isinstance(n, ast.Constant) else "{}" for n in node.values
            )
        elif isinstance(node, ast.Constant) and id(node) not in parts | told:
            yield from [node.value] if isinstance(node.value, str) else ()


@pytest.mark.fast
@pytest.mark.parametrize("file", LIBRARY, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_the_library_speaks_of_no_options(file):
    for text in texts(file):
        assert not OPTION.search(text), text


@pytest.mark.fast
@pytest.mark.parametrize("file", LIBRARY, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_every_argument_that_the_library_names_has_an_option(file):
    for text in texts(file):
        for name in ARGUMENT.findall(text):
            assert name in options(), text


@pytest.mark.fast
def test_the_walk_finds_what_it_looks_for(tmp_path):
    """The two tests above would fail."""
    file = tmp_path / "a.py"
    file.write_text(
        '"""Docstring with --frames."""\nclass A:\n    a = 1\n    "Help with --frames."\n'
        'def f(x):\n    raise E(f"{x} needs --frames", "use --skip-missing"\n        "; `nope`")\n'
    )
    found = list(texts(file))
    assert found == ["{} needs --frames", "use --skip-missing; `nope`"]
    assert all(OPTION.search(text) for text in found)
    assert ARGUMENT.findall(found[1]) == ["nope"]


@pytest.mark.fast
@pytest.mark.parametrize(
    ("message", "spelled"),
    [
        ("missing; `skip_missing=True` leaves them out", "missing; --skip-missing leaves them out"),
        ("`max_mb=900` allows it", "--max-mb 900 allows it"),
        ("`space='Utility - Raw'` makes it", "--from 'Utility - Raw' makes it"),
        ("(`device='opengl'`)", "(--adapter opengl)"),
        ("`facing`, `depth_test` and `splat`", "--facing, --depth-test and --splat"),
        ("`from_`, `set`: `color`.", "--from, --set: --layer."),
        ("`to_next` has no option", "`to_next` has no option"),
        ("/a/`frames`.exr: no such file", "/a/`frames`.exr: no such file"),
        ("x`frames` `frames`x", "x`frames` `frames`x"),
        ("`frames", "`frames"),
    ],
)
def test_arguments_are_spelled_as_options_and_names_of_files_are_not(message, spelled):
    assert as_options(message) == spelled


@pytest.mark.fast
def test_every_option_there_is_exists():
    known = {
        name
        for command in app.COMMANDS
        for argument in app.make_app(command)[command].assemble_argument_collection()
        for name in argument.names
    }
    assert set(options().values()) <= known


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--frames 1-9", r"; --skip-missing leaves them out$"),
        ("--max-mb 0.01", r"; --max-mb 1 allows it$"),
        ("--max-blur -1", r"^wgmb: --max-blur must be 0 or more"),
        ("--rolling up --rolling-duration nan", r"^wgmb: --rolling-duration must be"),
        ("--layer nope", "no colour layer 'nope'"),
    ],
)
def test_a_command_speaks_of_options(tmp_path, capsys, monkeypatch, options, says):
    monkeypatch.chdir(tmp_path)
    make.write_sequence(tmp_path, [1, 2])
    words = options.split()
    words += [] if "-o" in words else ["-o", "o.####.png"]
    code, _, err = make.inside(capsys, "blur", "shot.####.exr", *words)
    assert code in (1, 2)
    assert re.search(says, err.splitlines()[0])
    assert "`" not in err


def test_files_whose_names_look_like_arguments_keep_them(tmp_path, capsys):
    folder = tmp_path / "`frames`"
    folder.mkdir()
    code, _, err = make.inside(capsys, "info", folder / "`overwrite=True`.exr")
    assert code == 2
    assert err == f"wgmb: {folder}/`overwrite=True`.exr: no such file\n"


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("blur SHOT -o o.####.png --curve cosin", "cosine"),
        ("blur SHOT -o o.####.png --phase strat", "start"),
        ("blur SHOT -o o.####.png --samples autp", "auto"),
        ("blur SHOT -o o.####.png --method gahter", "gather"),
        ("blur SHOT -o o.####.png --vectors nuk", "nuke"),
        ("blur SHOT -o o.####.exr --compression zpi", "zip"),
        ("blur SHOT -o o.####.png --rolling upp", "up"),
        ("blur SHOT -o o.####.png --depth-kind plannar", "planar"),
        ("blur SHOT -o o.####.png --outside ato", "auto"),
        ("blur SHOT -o o.####.exr --window grw", "grow"),
        ("blur SHOT -o o.####.exr --layers pictur", "picture"),
        ("blur SHOT -o o.####.png --path curvd", "curved"),
        ("blur SHOT -o o.####.png --shuter 90", "--shutter"),
        ("blurr SHOT -o o.####.png", "blur"),
        ("vectors SHOT -o o.####.exr --as rmsb", "rsmb"),
        ("render crosing -o o.png", "crossing"),
        ("render crossing -o o.png --set sped=2", "speed"),
        ("compare -o o.html --experiment taylr", "taylor"),
        ("compare crossing -o o.html --methods tpa", "tap"),
        ("compare crossing -o o.html --reference distribted:8", "distributed"),
        ("view crosing", "crossing"),
    ],
)
def test_every_choice_that_is_nearly_right_is_recognised(
    tmp_path, capsys, monkeypatch, line, meant
):
    monkeypatch.chdir(tmp_path)
    make.write_sequence(tmp_path, [1, 2])
    code, _, err = make.inside(capsys, *line.replace("SHOT", "shot.####.exr").split())
    assert code == 2
    assert err.count("\n") == 1
    assert re.search(rf"[Dd]id you mean ['\"]?{meant}['\"]?\?", err)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("--no-audio", "--streams video"), ("--mute", "--streams video"), ("--angle", "--shutter"),
        ("--shutter-angle", "--shutter"), ("--fsp", "--fps"), ("--framerate", "--fps"),
        ("--crf", "--quality"), ("--gpu", "--adapter"), ("--threads", "--workers"),
        ("--shuter", "--shutter"), ("--over-write", "--overwrite"), ("--log", ""), ("--json", ""),
        ("--bitrate", ""), ("--nonsense", ""),
    ],
)  # fmt: skip
def test_a_wrong_option_names_what_people_mean_or_nothing(capsys, name, meant):
    """`--no-audio` was told to be --ocio, `--angle` --scale, `--json` --job."""
    code, _, err = make.inside(capsys, "blur", "a.mp4", "-o", "b.mp4", name, "60")
    end = f"; did you mean {meant}?" if meant else ""
    assert (code, err) == (2, f"wgmb: unknown option {name}{end}\n")


@pytest.mark.fast
@pytest.mark.parametrize("meant", sorted(errors._MEANT))
def test_what_is_suggested_exists(capsys, meant):
    setting, _, value = meant.partition(" ")
    words = ["blur", "a.mp4", "-o", "b.mp4", f"--{setting.replace('_', '-')}", value or "1"]
    _, _, err = make.inside(capsys, *words)
    assert "unknown option" not in err or setting == "device"  # of Python's calls


@pytest.mark.fast
@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--samples", "many", "'many' is not a whole number or auto$"),
        ("--max-blur", "x", "'x' is not a number$"),
        ("--bits", "x", "'x' is not a whole number$"),
    ],
)
def test_a_value_of_another_kind_is_told_in_words(capsys, option, value, says):
    _, _, err = make.inside(capsys, "blur", "a.exr", "-o", "b.exr", option, value)
    assert re.search(says, err.strip())


@pytest.mark.fast
@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("info", "info needs PATTERN; `wgmb info --help` tells more"),
        (
            "render wheel",
            "render needs --output (-o) and its value; `wgmb render --help` tells more",
        ),
        ("doctor now", "doctor does not take the word 'now'; `wgmb doctor --help` tells more"),
        ("blur a.mp4 -o b.mp4 -vv", "-v is given more than once"),
        ("vectors a.exr -o b.exr", "--as is missing; the vectors can be nuke, rsmb,"),
    ],
)
def test_a_word_too_few_or_too_many_is_told_in_words(capsys, line, says):
    code, _, err = make.inside(capsys, *line.split())
    assert (code, err.count("\n")) == (2, 1)
    assert says in err


@pytest.mark.fast
def test_a_choice_lists_what_there_is_and_what_was_given():
    check_choice("`window`", "keep", ("grow", "keep"))
    with pytest.raises(InputError) as error:
        check_choice("phase", "midle", ("start", "middle"), " or a number")
    assert str(error.value) == (
        "phase must be one of start, middle or a number, got 'midle'; did you mean 'middle'?"
    )
