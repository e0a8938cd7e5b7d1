"""A method of another package: the page's own package, installed, and packages that are wrong."""

import inspect
import json
import os
import re
import subprocess
import sys
import zipfile
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb.cli.app import COMMANDS, make_app
from wgmb.frame import PASSES
from wgmb.methods import METHODS
from wgmb.methods.contract_check import RESERVED, check_contract
from wgmb.methods.options import MethodOptions
from wgmb.methods.registry import Methods
from wgmb.settings import METHOD_OPTIONS, OutputSettings, SceneSettings
from wgmb.settings.groups import GROUPS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/development/add-a-method.md"


def files_of(page: str) -> dict[str, str]:
    """The files on a page: blocks with a caption."""
    pattern = r"^```\{code-block\} \w+\n:caption: (\S+)\n(.*?)^```"
    return dict(re.findall(pattern, page, re.M | re.S))


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The page's package, as its reader writes it."""
    folder = tmp_path_factory.mktemp("package")
    for name, text in files_of(PAGE.read_text("utf-8")).items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return folder


@pytest.fixture(scope="module")
def site(package, tmp_path_factory):
    """A folder in which its wheel is installed."""
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
    subprocess.run(words, cwd=package, check=True, capture_output=True)
    site = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(next((package / "dist").glob("*.whl"))) as wheel:
        wheel.extractall(site)
    return site


@pytest.fixture
def inside(tmp_path):
    """Run a Python with folders on its path, in an empty folder; returns the process."""

    def run(*words, path=(), **more):
        folders = os.pathsep.join(map(str, (*path, ROOT)))
        env = os.environ | {"PYTHONPATH": folders, "COLUMNS": "200"}
        return subprocess.run(
            [sys.executable, *map(str, words)], cwd=more.get("cwd", tmp_path), env=env,
            capture_output=True, text=True, timeout=300,
        )  # fmt: skip

    return run


def announced(site: Path, entry: str, name="wgmb-other", version="1.0", code="", module="other"):
    """Install a package that has one module and announces one method."""
    site.mkdir(exist_ok=True)
    info = site / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(f"[wgmb.methods]\n{entry}\n")
    (site / f"{module}.py").write_text(code)
    return site


@pytest.mark.parametrize(
    "laws",
    ["no_motion or same_bits or alpha or out_of_its", pytest.param("", marks=pytest.mark.full)],
)
def test_the_package_of_the_page_keeps_the_laws(laws, site, package, inside):
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", package / "test_veil.py", "-k", laws)
    done = inside(*words, path=[site])
    assert done.returncode == 0, done.stdout
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed and int(passed[1]) >= (4 if laws else 100)


@pytest.mark.full
def test_a_law_that_is_broken_is_found_by_the_plugin(site, inside, tmp_path):
    shader = site / "wgmb_veil/veil.wgsl"
    right = shader.read_text()
    try:
        shader.write_text(right.replace("let source = backwards", "let source_ = backwards")
                          .replace("displacement(source, t)", "displacement(path, t)"))  # fmt: skip
        laws = ("--pyargs", "wgmb.testing.laws", "--wgmb-method", "veil", "-k", "late_shutter")
        done = inside("-m", "pytest", "-q", "-p", "wgmb.testing", *laws, path=[site])
    finally:
        shader.write_text(right)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "test_late_shutter_moves_things_forward" in done.stdout
    done = inside("-m", "pytest", "-q", "-p", "wgmb.testing", *laws, path=[site])
    assert done.returncode == 0, done.stdout


def test_an_installed_method_is_like_one_of_ours(site, inside, tmp_path):
    make.write_sequence(tmp_path, range(1, 4))
    blur = ("-m", "wgmb", "blur", "shot.####.exr", "--frames", "2", "-q")
    for name, words in {"tap": ["--method", "tap"], "veil": ["--method", "veil", "--veil", "0.5"]
                        }.items():  # fmt: skip
        done = inside(*blur, "-o", f"{name}.####.exr", *words, path=[site])
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    sharp, tap, veil = (
        make.plain_read(tmp_path / f"{name}.0002.exr") for name in ("shot", "tap", "veil")
    )
    (red,) = (name for name in sharp if name.endswith("R"))
    np.testing.assert_allclose(veil[red], (tap[red] + sharp[red]) / 2, atol=2e-3)
    done = inside(*blur, "-o", "x.####.exr", "--method", "veil", "--veil", "2", path=[site])
    assert (done.returncode, done.stderr) == (2, "wgmb: veil must be 0 to 1, got 2.0\n")
    done = inside("-m", "wgmb", "blur", "--help-all", path=[site])
    assert re.search(r"--method TEXT .*tap.*veil", " ".join(done.stdout.split()))
    assert re.search(r"--veil X\s+veil: share of the blurred frame", done.stdout)


@pytest.mark.full
def test_an_installed_method_is_compared(site, inside, tmp_path):
    done = inside("-m", "wgmb", "compare", "crossing", "--methods", "tap,veil:veil=0.8",
                  "--size", "48x27", "--reference", "distributed:4", "--ladder", "2", "--rounds",
                  "1", "-o", "report.html", "-q", path=[site])  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "veil, veil 0.8" in (tmp_path / "report.json").read_text()


LISTS = """
import json, sys, wgmb
made = wgmb.Blur("tap")
early = "wgmb_veil" in sys.modules
from wgmb.viewer.capabilities import Choices
from wgmb.viewer import State
from wgmb.viewer.state.groups import GROUP_OF, HELP
state = State()
choices = Choices(made.device)
lab = __import__("wgmb.cli.commands.compare", fromlist=["x"]).CompareSettings().candidates()
print(json.dumps([early, choices.methods(state), list(choices.options("veil")), HELP["veil"],
                  GROUP_OF["veil"], [c.method for c in lab], wgmb.METHODS.packages]))
"""


def test_the_viewer_and_the_laboratory_list_it_and_nothing_is_imported_before(site, inside):
    done = inside("-c", LISTS, path=[site])
    assert done.returncode == 0, done.stderr
    early, methods, options, text, group, compared, packages = json.loads(done.stdout)
    assert (early, options, group) == (False, ["veil"], "blur")
    assert "veil" in methods and "veil" in compared
    assert text == "veil: share of the blurred frame"
    assert packages == {"veil": "wgmb-veil 0.1"}


def test_a_record_names_the_package_and_no_option_of_a_method_that_is_not_used(site, inside):
    code = (
        "import json; from wgmb.settings import BlurSettings as B; "
        "print(json.dumps([B(method='tap').looks, B(method='veil').looks, "
        "B(method='veil', veil=.5).looks]))"
    )
    tap, veil, half = json.loads(inside("-c", code, path=[site]).stdout)
    assert tap == json.loads(inside("-c", code.replace("veil", "tap").replace("tap=.5", "samples=2")
                                    ).stdout)[0]  # fmt: skip
    assert (veil["package"], half["veil"]) == ("wgmb-veil 0.1", 0.5)
    assert "veil" not in veil


@pytest.mark.full
def test_a_job_file_of_a_machine_without_the_package_is_read(site, inside, tmp_path):
    make.write_sequence(tmp_path, range(1, 4))
    words = ("-m", "wgmb", "job", "shot.####.exr", "-o", "out.####.exr", "--job", "a.json")
    assert inside(*words).returncode == 0
    done = inside("-m", "wgmb", "blur", "--job", "a.json", "-q", path=[site])
    assert (done.returncode, done.stderr) == (0, "")


GOOD = """
from dataclasses import dataclass
from typing import Annotated
from wgmb.methods.options import MethodOptions
from wgmb.methods.registry import Methods
from wgmb.settings import METHOD_OPTIONS, OutputSettings, SceneSettings
from wgmb.settings.groups import GROUPS
class Mine:
    name = "mine"
    needs = frozenset({"color"})
    uses = frozenset()
    Options = MethodOptions
    def __init__(self, device, options, *, output): ...
    def encode(self, encoder, inputs, output): ...
"""
OPTION = (
    "    @dataclass(frozen=True, kw_only=True)\n    class Options(MethodOptions):\n        {}\n"
)
WRONG = {
    "no module": ("raise RuntimeError('no licence\\nat all')",
                  "other:Mine cannot be imported: RuntimeError: no licence at all"),
    "it ends": ("raise SystemExit(3)", "other:Mine cannot be imported: SystemExit: 3"),
    "no class": ("Mine = 5", "a method must be a class, got 5"),
    "another name": (GOOD.replace('"mine"', '"other"'), "its class has the name 'other'"),
    "no name": (GOOD.replace('"mine"', "None"), "needs a name of small letters and digits"),
    "needs": (GOOD.replace('{"color"}', '{"colour"}'), "needs has colour; known are color, depth"),
    "encode": (GOOD.replace("encoder, inputs", "encoder"), "needs encode(encoder, inputs, output)"),
    "options": (GOOD.replace("Options = MethodOptions", "Options = dict"), "needs Options"),
    "an option": (GOOD.replace("    Options = MethodOptions\n", OPTION.format("far: int = 1")),
                  "option far must be Annotated with its type and its help"),
    "a reserved name": (
        GOOD.replace("    Options = MethodOptions\n",
                     OPTION.format("frames: Annotated[int, 'many'] = 1")),
        "no option can have the name frames"),
    "another type": (
        GOOD.replace("    Options = MethodOptions\n",
                     OPTION.format("reach: Annotated[float, 'px'] = 1.0")),
        "its option reach and that of gather differ: float and int"),
}  # fmt: skip


@pytest.mark.fast
@pytest.mark.parametrize("fault", WRONG)
def test_what_is_wrong_with_a_method_is_told_in_one_line(fault, tmp_path, monkeypatch):
    code, said = WRONG[fault]
    monkeypatch.syspath_prepend(announced(tmp_path / "site", "mine = other:Mine", code=code))
    methods = Methods(METHODS.values())
    try:
        assert "mine" not in methods and "tap" in methods
        with pytest.warns(RuntimeWarning, match=re.escape(said)):
            assert list(methods) == list(METHODS)
        assert list(methods) == list(METHODS)  # and it warns once
    finally:
        sys.modules.pop("other", None)
    fault = methods.faults["mine"]
    assert fault.startswith("method 'mine' of wgmb-other 1.0 cannot be used: ")
    assert said in fault and "\n" not in fault


def test_a_package_that_cannot_be_imported_leaves_the_commands_as_they_are(inside, tmp_path):
    code, said = WRONG["no module"]
    site = announced(tmp_path / "site", "mine = other:Mine", code=code)
    make.write_sequence(tmp_path, range(1, 4))
    blur = ("-m", "wgmb", "blur", "shot.####.exr", "--frames", "2", "-o")
    line = f"method 'mine' of wgmb-other 1.0 cannot be used: {said}"
    done = inside(*blur, "a.####.exr", "--method", "mine", path=[site])
    assert (done.returncode, done.stderr) == (2, f"wgmb: {line}\n")
    done = inside(*blur, "b.####.exr", "--method", "tap", path=[site])
    assert done.returncode == 0 and done.stderr.splitlines().count(line) == 1
    done = inside(*blur, "c.####.exr", "--method", "tap", "-q", path=[site])
    assert (done.returncode, done.stderr) == (0, "")
    done = inside("-m", "wgmb", "blur", "--help-all", path=[site])
    assert "mine" not in done.stdout and done.stderr == f"{line}\n"


def test_a_name_that_collides_is_told_and_ours_stays(inside, tmp_path):
    site = announced(tmp_path / "site", "tap = other:Mine", code="raise RuntimeError")
    announced(tmp_path / "one", "mine = one:Mine", "wgmb-one", code=GOOD, module="one")
    announced(tmp_path / "two", "mine = two:Mine", "wgmb-two", code=GOOD, module="two")
    code = "import wgmb; print(list(wgmb.METHODS), wgmb.METHODS['tap'].__module__)"
    path = [site, tmp_path / "one", tmp_path / "two"]
    done = inside("-c", code, path=path)
    assert "mine" not in done.stdout and "wgmb.methods.tap" in done.stdout
    assert "method 'tap' of wgmb-other 1.0 cannot be used: wgmb has a method" in done.stderr
    assert "wgmb-two 1.0 announces one of this name, too" in done.stderr
    assert inside("-c", "import wgmb; wgmb.Blur('tap')", path=path).stderr == ""


@pytest.mark.parametrize("how", ["-m", pytest.param("-c", marks=pytest.mark.full), "PYTHONPATH"])
def test_entry_points_of_the_current_folder_do_not_count(inside, tmp_path, how):
    folder = announced(tmp_path / "frames", "mine = other:Mine",
                       code="open('imported', 'w').close()\n" + GOOD)  # fmt: skip
    words = ["-m", "wgmb", "blur", "--help-all"]
    if how == "-c":
        words = ["-c", "import wgmb; print(list(wgmb.METHODS))"]
    done = inside(*words, path=["."] if how == "PYTHONPATH" else [], cwd=folder)
    assert done.returncode == 0 and "mine" not in done.stdout
    assert not (folder / "imported").exists()


def test_importing_wgmb_imports_no_method_of_others(inside, site):
    code = "import sys, wgmb, wgmb.methods, wgmb.pipeline.blur; print('wgmb_veil' in sys.modules, "
    code += "'veil' in wgmb.METHODS, 'wgmb_veil' in sys.modules)"
    assert inside("-c", code, path=[site]).stdout == "False True True\n"


class Mine:
    """A class of a program's own."""

    name = "mine"
    needs = frozenset({"color"})
    uses = frozenset()
    Options = MethodOptions

    def __init__(self, device, options, *, output):
        self.made = output

    def encode(self, encoder, inputs, output):
        encoder.copy_texture_to_texture(
            {"texture": inputs.frame.color.texture}, {"texture": output.texture},
            (*inputs.bindings.size, 1),
        )  # fmt: skip


def test_a_blur_takes_a_class(device):
    picture = np.random.default_rng(2).random((8, 12, 4), "f4")
    blur = wgmb.Blur(Mine, device=device)
    assert np.array_equal(blur(picture), picture)
    assert np.array_equal(wgmb.blur(picture, method=Mine, device=device), picture)
    assert 'Blur("mine"' in repr(blur) and "mine" not in METHODS


@pytest.mark.fast
def test_a_class_that_is_no_method_is_refused_before_a_device_is_opened():
    with pytest.raises(wgmb.InputError, match="the method dict needs a name"):
        wgmb.Blur(dict)
    with pytest.raises(wgmb.InputError, match="'mine' has no option veil"):
        wgmb.Blur(Mine, veil=0.5)
    with pytest.raises(wgmb.InputError, match="unknown method 5"):
        wgmb.Blur(5)


@pytest.mark.fast
@pytest.mark.parametrize("name", METHODS)
def test_our_methods_keep_the_contract(name):
    check_contract(METHODS[name])


@pytest.mark.fast
def test_no_option_of_ours_is_left_for_methods():
    names = {field.name for kind in (*GROUPS.values(), OutputSettings, SceneSettings)
             for field in fields(kind)}  # fmt: skip
    program = make_app(*COMMANDS)
    for command in COMMANDS:
        for one in program[command].assemble_argument_collection():
            names |= {n.lstrip("-").replace("-", "_") for n in one.names if n.startswith("--")}
    names |= inspect.signature(wgmb.Blur).parameters.keys() | set(PASSES)
    names -= {"self", "options"}
    names = {n for n in names if not n.startswith(("no_", "empty_"))}
    assert names - METHOD_OPTIONS.keys() <= RESERVED
