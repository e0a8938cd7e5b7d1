"""The examples of the README work."""

import re
import shlex
from pathlib import Path

import pytest

import make_clips
import make_frames as make
from wgmb.cli import app
from wgmb.viewer import State

HERE = Path(__file__).parents[2]
TEXT = (HERE / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)


def test_python_blocks_run_in_their_order(tmp_path, monkeypatch):
    monkeypatch.chdir(HERE)
    names: dict = {}
    assert len(BLOCKS) == 1
    for block in BLOCKS:
        exec(compile(block.replace('"out/', f'"{tmp_path}/'), "README.md", "exec"), names)
    assert names["out"].shape == (270, 480, 3)
    assert [image.shape for image in names["images"]] == [(240, 400, 4)] * 3


def test_the_list_of_the_documentation_is_short():
    section = TEXT.partition("## Documentation\n")[2].partition("\n## ")[0]
    assert 0 < len(re.findall(r"\]\(", section)) <= 8


SCORED = {
    "a camera moving past thin objects": "a_parallax 180°",
    "fast objects crossing": "c_crossing 180°",
}


@pytest.mark.parametrize("page", ["README.md", "docs/engineers/performance.md"])
def test_the_scores_are_those_of_the_page_of_scores(page):
    rows = re.findall(r"^\| (.*) \|$", (HERE / page).read_text(encoding="utf-8"), re.M)
    told = {row.split(" | ")[0]: row.split(" | ")[1:] for row in rows}
    scores = (HERE / "docs/laboratory/scores.md").read_text(encoding="utf-8")
    table = [line.strip("| ").split(" | ") for line in scores.splitlines() if line[:1] == "|"]
    columns = [table[0].index(name) for name in ("sharp", "tap 16", "reproject 16", "gather 16")]
    for name, scene in SCORED.items():
        row = next(row for row in table if row[0] == scene)
        pairs = [map(float, row[i].split(" / ")) for i in columns]
        assert told[name] == [f"{psnr:.1f} / {flip:.3f}" for flip, psnr in pairs]


def test_every_option_that_is_named_exists():
    known = {"--version", "--help"}
    program = app.make_app()
    for name in program:
        if not name.startswith("-"):
            for argument in program[name].assemble_argument_collection():
                known.update(argument.names)
    named = set(re.findall(r"--[a-z][a-z-]+", TEXT))
    assert named
    assert named - known == set()


MAKING = re.findall(r"(?:^|`)(wgmb [a-z]+ [^`\n]*-o [^`\n]*)", TEXT, re.M)
SMALL = "64x36"
SHORTER = {"--samples": "2", "--size": SMALL}
OPTIONS = {  # what makes a command short, whatever the README says of it
    "render": f"--size {SMALL} --antialias 1",
    "perceive": f"--size {SMALL} --cone-rate 400 --cone-peak 0.005",
    "compare": f"--size {SMALL} --reference distributed:8 --samples 2 --ladder 2 --rounds 1",
    "bench": "--rounds 1",
}


def shortened(line: str) -> list[str]:
    """The words of a command line, with values that take less time."""
    words, short = shlex.split(re.sub(r"--frames \d+-\d+", "--frames 2-3", line))[1:], []
    while words:
        short.append(words.pop(0))
        if short[-1] in SHORTER:
            while words and not words[0].startswith("-"):
                words.pop(0)
            short.append(SHORTER[short[-1]])
    more = OPTIONS.get(short[0], "").split()
    for option, value in zip(more[::2], more[1::2], strict=True):
        short += [] if option in short else [option, value]
    return short


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with all files that the README speaks of."""
    monkeypatch.chdir(tmp_path)
    pattern = Path(make.write_sequence(tmp_path, (1, 2, 3)))
    for n in (1, 2, 3):
        name = pattern.name.replace("####", f"{n:04d}")
        (tmp_path / name.replace("shot", "blurred")).hardlink_to(name)
    (tmp_path / "renders").mkdir()
    make.write_sequence(tmp_path / "renders", (1, 2, 3))
    for name in ("truth", "vecblur"):
        make.write_exr(tmp_path / f"{name}.exr", make.frame(2))
    make_clips.write(tmp_path / "in.mp4", tone=0.1)
    Path("wgmb.toml").write_text(State().with_settings(samples=2, size=SMALL).toml())
    return tmp_path


@pytest.mark.parametrize("line", MAKING)
def test_command_lines_make_what_they_say(line, desk):
    words = shortened(line)
    made = words[words.index("-o") + 1].replace("####", "*")
    for path in desk.glob(made):
        path.unlink()
    assert app.main(words) == 0
    frames = 1 if "*" not in made else 2 if "--frames" in words else 3
    assert len(list(desk.glob(made))) == frames
