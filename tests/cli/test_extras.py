"""A package of an extra that is missing is named with the command that installs it here."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from wgmb import extras, requirements
from wgmb.errors import InputError
from wgmb.extras import install_command, is_installed, needed_by

pytestmark = pytest.mark.fast

ROOT = Path(__file__).parents[2]
LINES = [
    "numpy>=1.24",
    "wgmb[b]; extra == 'a'",
    "One.Pkg >=2,<3 ; extra == 'a'",
    "two (>=1.5); (sys_platform != 'none') and extra == \"b\"",
    "wgmb[a]; extra == 'b'",
    "one.pkg>=2.1; extra == 'c'",
    "wgmb[a,c]; extra == 'both'",
]


@pytest.fixture
def elsewhere(monkeypatch):
    """An environment that is not the clone's."""
    monkeypatch.setattr(sys, "prefix", "/usr")


@pytest.fixture
def installed(monkeypatch):
    """Set the versions of packages, and the requirements of wgmb; None: wgmb is not installed."""

    def put(lines, **versions):
        def version(name):
            if name not in versions:
                raise requirements.metadata.PackageNotFoundError(name)
            return versions[name]

        def requires(name):
            if lines is None:
                raise requirements.metadata.PackageNotFoundError(name)
            return lines

        monkeypatch.setattr(requirements.metadata, "requires", requires)
        monkeypatch.setattr(requirements.metadata, "version", version)

    return put


# ---- messages -------------------------------------------------------------------------------


def test_a_missing_package_is_named_with_the_command_of_its_extra_or_the_given_one(monkeypatch):
    monkeypatch.setattr(extras, "install_command", lambda extra: f"get {extra}")
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert not is_installed("PIL")
    told = r"^this: Pillow is not installed: get images$"
    with pytest.raises(InputError, match=told), needed_by("this"):
        import PIL.Image
    with pytest.raises(InputError, match=r": get other$"), needed_by("this", "other"):
        import PIL  # noqa: F401


def test_a_package_that_is_too_old_is_told_too():
    with pytest.raises(InputError, match=r"^this: PyAV is too old for this: "), needed_by("this"):
        from av.stream import Nothing  # noqa: F401  # pyright: ignore


@pytest.mark.parametrize(
    "error", [ModuleNotFoundError(name="wgmb.nothing"), ImportError("libX11.so", name="glfw")]
)
def test_other_errors_pass(error):
    with pytest.raises(type(error)) as caught, needed_by("this"):
        raise error
    assert caught.value is error


@pytest.mark.parametrize("command", ["compare", "view"])
def test_a_command_without_its_packages_is_one_line(command):
    without = "import sys; sys.modules |= dict.fromkeys(['PIL', 'glfw'])\n"
    line = f"{without}from wgmb.cli.app import main; sys.exit(main([{command!r}]))"
    done = subprocess.run(
        [sys.executable, "-c", line], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    (said,) = done.stderr.splitlines()
    assert said.startswith(f"wgmb: {command}: ")
    assert said.endswith(f"is not installed: {install_command(command)}")


def test_a_package_that_this_python_cannot_have_is_told_as_such(installed, monkeypatch):
    installed(["flip-evaluator>=1; (python_version < '3.11') and extra == 'compare'"])
    here = "{}.{}".format(*sys.version_info)
    told = f"^FLIP: flip-evaluator is not available for Python {re.escape(here)} on "
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(InputError, match=told), needed_by("FLIP"):
        import flip_evaluator  # noqa: F401


@pytest.mark.parametrize(
    ("marker", "applies"),
    [
        ("", True),
        ('python_version < "3.99" and ', True),
        ('python_version<"3.11" and ', False),
        ('(python_version < "3" or sys_platform == "nowhere") and ', False),
        (f'(python_version < "3" or sys_platform == "{sys.platform}") and ', True),
    ],
)
def test_a_marker_may_exclude_the_system_or_the_python(installed, marker, applies):
    installed([f"some; {marker}extra == 'a'", "other; extra == 'a'"])
    assert list(requirements.of_extra("a")) == ["some", "other"][not applies :]


# ---- the command in a clone -----------------------------------------------------------------


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A clone whose own environment runs; the current folder is another one."""
    root = tmp_path / "a clone"
    (root / ".venv").mkdir(parents=True)
    (root / "wgmb" / "deep").mkdir(parents=True)
    (root / "run").touch()
    (root / "pyproject.toml").write_text('[project]\nname = "wgmb"\n')
    monkeypatch.setattr(extras, "__file__", str(root / "wgmb" / "extras.py"))
    monkeypatch.setattr(sys, "prefix", str(root / ".venv"))
    monkeypatch.chdir(tmp_path)
    return root


@pytest.mark.skipif(sys.platform == "win32", reason="run is a script of sh")
@pytest.mark.parametrize(
    ("folder", "said"),
    [
        (".", "./run setup ocio"),
        ("wgmb", "../run setup ocio"),
        ("wgmb/deep", "{root}/run setup ocio"),
        ("..", "'a clone/run' setup ocio"),
    ],
)
def test_in_a_clone_the_command_is_its_run_as_it_is_called_from_here(
    clone, monkeypatch, folder, said
):
    monkeypatch.chdir(clone / folder)
    told = install_command("ocio")
    assert told == said.replace("{root}/run", shlex.quote(f"{clone}/run"))
    assert Path(shlex.split(told)[0]).samefile(clone / "run")


@pytest.mark.parametrize("lacks", ["run", "pyproject.toml", ".venv", "the environment"])
def test_elsewhere_the_command_is_of_pip(clone, monkeypatch, lacks):
    if lacks == "the environment":
        monkeypatch.setattr(sys, "prefix", sys.base_prefix)
    elif lacks == ".venv":
        (clone / ".venv").rmdir()
    else:
        (clone / lacks).unlink()
    assert " install " in install_command("ocio")


# ---- the command elsewhere ------------------------------------------------------------------


def lines_of(extra):
    return [requirements.line(one) for one in requirements.of_extra(extra).values()]


def test_requirements_of_an_extra_are_those_of_the_extras_within(installed):
    installed(LINES)
    assert lines_of("a") == ["One.Pkg<3,>=2", "two>=1.5"]
    assert lines_of("b") == ["two>=1.5", "One.Pkg<3,>=2"]
    assert lines_of("nothing") == []
    assert lines_of("both") == ["One.Pkg<3,>=2,>=2.1", "two>=1.5"]


@pytest.mark.parametrize(
    ("version", "versions", "is_met"),
    [
        (None, "", False),
        ("1", "", True),
        ("2.0", ">=2,<3", True),
        ("2", ">=2.0.0", True),
        ("2.10", ">=2.9", True),
        ("3.0", ">=2,<3", False),
        ("3.0.post1", ">2,<=3.1,!=3.1", True),
        ("1.9", ">=2", False),
        ("2.5", "~=2.4", True),
        ("2.5rc1", ">=2.4", True),
        ("dev", ">=1", False),
    ],
)
def test_a_requirement_is_met_by_versions_in_its_range(installed, version, versions, is_met):
    installed([], **({} if version is None else {"some": version}))
    assert requirements.is_met(Requirement(f"some{versions}")) == is_met


def test_pip_is_told_what_is_not_met(installed, elsewhere, monkeypatch):
    monkeypatch.setattr(extras, "_python", lambda: "python")
    installed(LINES, two="1.6")
    assert install_command("a") == "python -m pip install 'One.Pkg<3,>=2'"
    installed(LINES, **{"One.Pkg": "3.1"})
    words = shlex.split(install_command("a"))
    assert words[4:] == ["One.Pkg<3,>=2", "two>=1.5"]


def test_packages_that_are_listed_and_cannot_be_found_are_installed_again(
    installed, elsewhere, monkeypatch
):
    monkeypatch.setattr(extras, "_python", lambda: "python")
    installed(["pillow>=1; extra == 'ocio'", "opencolorio>=2; extra == 'ocio'"],
              pillow="2", opencolorio="2.4")  # fmt: skip
    words = "python -m pip install --force-reinstall --no-deps 'opencolorio>=2'"
    assert install_command("ocio") == words


@pytest.mark.parametrize("lines", [None, []])
def test_without_metadata_the_packages_are_named(installed, elsewhere, lines):
    installed(lines)
    assert install_command("images").endswith(" -m pip install imageio pillow tifffile")
    assert install_command("nothing") == "the extra nothing of wgmb has it"


def test_every_extra_of_a_package_is_in_the_metadata():
    for package in extras.EXTRAS.values():
        if package.index_name != "vapoursynth":  # not for each Python
            assert package.index_name in requirements.of_extra(package.extra)


def test_a_python_without_pip_is_given_one_or_uv(installed, elsewhere, monkeypatch):
    monkeypatch.setattr(extras, "is_installed", lambda package: False)
    monkeypatch.setattr(extras, "_python", lambda: "python")
    installed(None)
    monkeypatch.setattr(extras.shutil, "which", lambda name: None)
    assert install_command("flow") == (
        "python -m ensurepip && python -m pip install opencv-python-headless"
    )
    monkeypatch.setattr(extras.shutil, "which", lambda name: f"/bin/{name}")
    assert install_command("flow") == "uv pip install --python python opencv-python-headless"


@pytest.mark.skipif(sys.platform == "win32", reason="files that can be run, as Unix marks them")
def test_python_is_named_where_the_shell_finds_the_one_that_runs(tmp_path, elsewhere, monkeypatch):
    for folder in ("mine", "other"):
        (tmp_path / folder).mkdir()
        for name in ("python", "python3"):
            (tmp_path / folder / name).touch(0o755)
    own = tmp_path / "mine" / "python3"
    monkeypatch.setattr(sys, "executable", str(own))
    monkeypatch.setenv("PATH", str(tmp_path / "mine"))
    assert install_command("ocio").startswith("python -m ")
    (tmp_path / "mine" / "python").unlink()
    assert install_command("ocio").startswith("python3 -m ")
    monkeypatch.setenv("PATH", str(tmp_path / "other"))
    assert install_command("ocio").startswith(f"{own} -m ")


# ---- pages ----------------------------------------------------------------------------------


TEXTS = {
    str(path.relative_to(ROOT)): path.read_text("utf-8")
    for folder in ("wgmb", "docs", "sample", "tools", "blender", "")
    for path in (ROOT / folder).glob("**/*" if folder else "*")
    if path.suffix in (".py", ".md", ".ipynb", "") and path.is_file()
    if path.name != "CHANGELOG.md"  # which tells what was said then
}


@pytest.mark.parametrize("name", TEXTS)
def test_no_text_installs_wgmb_by_a_name_that_no_index_has(name):
    assert not re.search(r"install\W+wgmb\b|\bwgmb\[", TEXTS[name])
