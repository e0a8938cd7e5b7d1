"""Imports point one way, third parties stay at home, Python and WGSL have the same stems."""

import ast
import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from wgmb.extras import EXTRAS, WINGS

pytestmark = pytest.mark.fast

ROOT = Path(__file__).parents[2]
PACKAGE, SHADERS = ROOT / "wgmb", ROOT / "wgsl"

# A folder, or a module beside it, imports only from the lines above its own, and from itself.
LAYERS = [
    {"_version", "errors", "threads", "allocator", "requirements", "interpreter"},
    {"extras", "charts", "gpu", "files"},
    {"color", "shutter", "camera"},
    {"png", "exposure", "cone", "metrics"},
    {"frame"},
    {"extent"},
    {"gpu_frame", "scene", "flow", "io"},
    {"methods", "shots", "observer"},
    {"pipeline"},
    {"render", "sequence", "video"},
    {"output"},
    {"settings"},
    {"run"},
    set(WINGS),  # the rest works without each of them; never each other
    {"cli"},  # may start the viewer
    {"__init__", "__main__"},
]
PLACE = {name: number for number, layer in enumerate(LAYERS) for name in layer}
MOST_FILES = 20  # of a folder
HOMES = {
    "wgpu": set(PLACE) - {"io", "color", "sequence", "shots", "output", "cli"},
    "OpenEXR": {"io"},
    "av": {"io", "video"},
    "tifffile": {"io"},
    "imageio": {"io"},
    "PIL": {"io", "lab"},
    "fileseq": {"io"},
    "packaging": {"requirements"},
    "cv2": {"flow"},
    "PyOpenColorIO": {"color"},
    "opentimelineio": {"shots"},
    "distributed": {"farm"},
    "dask": {"farm"},
    "cyclopts": {"cli"},
    "rich": {"cli"},
    "imgui_bundle": {"viewer"},
    "glfw": {"viewer"},
    "pytest": {"testing"},
    "rendercanvas": {"viewer"},
    "ipywidgets": {"hosts"},
    "pygfx": {"hosts"},
    "vapoursynth": {"hosts"},
}
LOCKS = {  # modules that take locks, beside `threads`, where threads start
    "gpu/priority", "hosts/explorer", "hosts/vapoursynth", "io/exr_library", "observer",
    "pipeline/blur", "render", "run/conversion", "run/picture_stages", "viewer/draw/draw_thread",
    "viewer/draw/screen", "viewer/subjects/motion_thread", "video/read/stream_text"}  # fmt: skip
FILES = sorted(PACKAGE.rglob("*.py"))
KERNELS = sorted(SHADERS.rglob("*.wgsl"))
TOOLS = sorted((ROOT / "tools").rglob("*.py"))


def place_of(file: Path) -> str:
    first = file.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


def imported(file: Path, home: Path = PACKAGE):
    """Every imported module, as its parts: those of wgmb from its name on."""
    here = ("wgmb", *file.relative_to(home).with_suffix("").parts)
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name.split(".")
        elif isinstance(node, ast.ImportFrom):
            start = list(here[: len(here) - node.level]) if node.level else []
            module = start + (node.module.split(".") if node.module else [])
            for alias in node.names:
                yield [*module, alias.name]


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_imports_point_upwards_in_the_table_and_third_parties_stay_at_home(file):
    folder = place_of(file)
    assert folder in PLACE, f"{folder} is in no layer: say where it belongs"
    for module in imported(file):
        if module[0] == "wgmb":
            other = module[1] if module[1] in PLACE else "__init__"
            ok = folder == other or PLACE[other] < PLACE[folder] or folder == "__main__"
            assert ok, f"{folder} imports {'.'.join(module)}"
        elif module[0] in HOMES:
            assert folder in HOMES[module[0]], f"{folder} imports {module[0]}"


def loaded_with(file: Path) -> set[Path]:
    """The modules of wgmb that a module names at its top, those for types alone too."""
    here = ("wgmb", *file.relative_to(PACKAGE).with_suffix("").parts)
    found, nodes = set(), list(ast.parse(file.read_text()).body)
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.ImportFrom) and node.level:
            module = [*here[: -node.level], *(node.module or "").split(".")]
            for name in ("", *(alias.name for alias in node.names)):
                path = PACKAGE.joinpath(*module[1:], name).with_suffix(".py")
                found |= {path} if path.is_file() else set()
        elif not isinstance(node, ast.FunctionDef):
            nodes += [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt)]
    return found - {file}


def test_no_module_needs_itself():
    """No circle of imports, not even of types; one pair shares the class of an EXR's part."""
    needs = {file: loaded_with(file) for file in FILES}
    assert needs[PACKAGE / "run" / "job.py"] >= {PACKAGE / "run" / "report.py"}
    needs[PACKAGE / "io" / "lossy.py"].discard(PACKAGE / "io" / "exr.py")
    while free := [file for file, others in needs.items() if not others & needs.keys()]:
        needs = {file: others for file, others in needs.items() if file not in free}
    assert not needs


@pytest.mark.parametrize("file", TOOLS, ids=lambda f: str(f.relative_to(ROOT)))
def test_tools_import_modules_that_are_there(file):
    for module in imported(file, ROOT):
        if module[0] == "wgmb" and module[1:2] != ["tools"]:  # which is a folder beside it
            place = PACKAGE.joinpath(*module[1:-1])
            assert place.is_dir() or place.with_suffix(".py").is_file(), ".".join(module)


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def listed(requirements) -> set[str]:
    """Names of the packages that are listed, and of those in extras that are listed."""
    names = set()
    for line in requirements:
        name = re.match(r"[\w-]+", line)[0].lower().replace("_", "-")
        if name != "wgmb":
            names.add(name)
            continue
        for extra in re.search(r"\[(.*)\]", line)[1].split(","):
            names |= listed(PROJECT["optional-dependencies"][extra])
    return names


def name_of(package: str) -> str:
    """The package index's name of an imported module."""
    return EXTRAS[package].index_name if package in EXTRAS else package.lower()


def test_every_third_party_has_a_home():
    known = {name_of(package) for package in HOMES} | {"numpy"}
    assert listed(PROJECT["dependencies"]) | listed(["wgmb[all]"]) <= known


@pytest.mark.parametrize("package", EXTRAS)
def test_the_extra_that_a_message_names_installs_the_package(package):
    assert name_of(package) in listed([f"wgmb[{EXTRAS[package].extra}]"])


def test_what_is_not_of_the_core_has_an_extra():
    core = listed(PROJECT["dependencies"]) | {"numpy"}
    assert {package for package in HOMES if name_of(package) not in core} <= EXTRAS.keys()


@pytest.mark.parametrize(
    "folder",
    sorted({file.parent for file in [*FILES, *KERNELS, *TOOLS]}),
    ids=lambda folder: str(folder.relative_to(ROOT)),
)
def test_a_folder_can_be_looked_over(folder):
    files = [file for kind in ("*.py", "*.wgsl") for file in folder.glob(kind)]
    assert len(files) <= MOST_FILES


def test_threads_start_in_one_module():
    starters, holders = set(), set()
    for file in [*FILES, *sorted((ROOT / "comfyui").glob("*.py"))]:
        home = PACKAGE if PACKAGE in file.parents else ROOT
        name = file.relative_to(home).with_suffix("").as_posix()
        if ["threading"] in [module[:1] for module in imported(file, home)]:
            holders.add(name)
        if re.search(r"\b(Thread|Timer|ThreadPoolExecutor)\(", file.read_text()):
            starters.add(name)
    assert starters == {"threads"}
    assert holders - {"threads"} == LOCKS


def test_no_folder_stands_empty():
    assert {place_of(file) for file in FILES} == set(PLACE)


@pytest.mark.parametrize("file", KERNELS, ids=lambda f: str(f.relative_to(SHADERS)))
def test_shaders_include_what_is_common_and_their_own(file):
    own = file.relative_to(SHADERS).parts
    for name in re.findall(r"^//#include (\S+)", file.read_text(), re.M):
        parts = Path(name).parts
        assert (SHADERS / name).is_file()
        if own[0] == "common":
            assert parts[0] == "common", f"{file.name} includes {name}"
        elif own[0] == "methods":
            stem = own[1].removesuffix(".wgsl").split("_")[0]
            mine = parts[0] == "methods" and parts[1].removesuffix(".wgsl").split("_")[0] == stem
            assert mine or parts[0] in ("common", "scene"), f"{file.name} includes {name}"
        else:
            assert parts[0] in ("common", own[0]), f"{file.name} includes {name}"


@pytest.mark.parametrize("file", KERNELS, ids=lambda f: str(f.relative_to(SHADERS)))
def test_shaders_lie_where_their_python_does(file):
    """`wgsl/X/y.wgsl` is recorded by `wgmb/X/y.py`, or is a stage of `wgmb/X/` or `wgmb/X.py`."""
    own = file.relative_to(SHADERS)
    if own.parts[0] != "common":
        stem = PACKAGE / own.parent / own.stem
        begun = PACKAGE / own.parent / own.stem.split("_")[0]
        folder = PACKAGE / own.parent
        names = [stem, begun] if folder == PACKAGE else [stem, begun, folder]
        places = [folder, *(name.with_suffix(".py") for name in names)]
        assert any(p.exists() and p != PACKAGE for p in places)


def test_the_page_on_architecture_lists_every_folder():
    page = (ROOT / "docs/development/architecture.md").read_text("utf-8")
    rows = re.findall(r"^\| ([^|]*`[^|]*) \|", page.split("## Declarations")[0], re.M)
    listed = [name.rstrip("/") for row in rows for name in re.findall(r"`(\w+/?)`", row)]
    assert sorted(listed) == sorted(set(PLACE) - {"_version", "__init__", "__main__"})
    order = [PLACE[name] for name in listed]
    assert order == sorted(order)


def test_no_two_public_classes_have_one_name():
    found: dict[str, list[str]] = {}
    for file in FILES:
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(str(file.relative_to(PACKAGE)))
    assert not {name: files for name, files in found.items() if len(files) > 1}


def test_no_two_modules_of_the_tests_have_one_name():
    """pytest imports each by its name alone; of two, it refuses the second, and the whole run."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]
    places = [ROOT / place for place in settings["ini_options"]["pythonpath"]]
    files = {file for place in places for file in place.glob("*.py")}
    files |= set((ROOT / "tests").rglob("test_*.py"))
    names = Counter(file.stem for file in files if not (file.parent / "__init__.py").exists())
    assert len(names) > 200 and [name for name, count in names.items() if count > 1] == []
