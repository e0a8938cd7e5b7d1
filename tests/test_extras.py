"""A package of an extra that is missing is named with its extra, and no other error is."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from wgmb import extras
from wgmb.errors import InputError
from wgmb.extras import install_command, is_installed, needed_by, requirements

pytestmark = pytest.mark.fast


def test_a_missing_package_names_its_extra_or_the_given_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert not is_installed("PIL")
    told = f"^this: Pillow is not installed: {re.escape(install_command('images'))}$"
    with pytest.raises(InputError, match=told), needed_by("this"):
        import PIL.Image
    with (
        pytest.raises(InputError, match=re.escape(install_command("other"))),
        needed_by("this", "other"),
    ):
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
    assert "is not installed: " in said


ROOT = Path(__file__).parents[1]
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


def normal(requirement: str) -> tuple[str, set[str]]:
    """The name and the limits of a requirement, however it is spaced."""
    name, limits = re.fullmatch(
        r"([\w.\[\]-]+)(.*)", requirement.partition(";")[0].replace(" ", "")
    ).groups()
    return name.lower(), {limit for limit in limits.split(",") if limit}


def unique(found: list) -> list:
    return [one for i, one in enumerate(found) if one not in found[:i]]


@pytest.mark.parametrize("extra", ["ocio", "compare", "view"])
def test_the_packages_of_an_extra_are_those_of_the_project(extra):
    wanted = []

    def collect(name):
        for text in DECLARED[name]:
            nested = re.fullmatch(r"wgmb\[(.*)\]", text)
            for one in nested[1].split(",") if nested else []:
                collect(one)
            if not nested:
                wanted.append(normal(text))

    collect(extra)
    got = [normal(text) for text in requirements(extra)]
    assert sorted(name for name, _ in got) == sorted(name for name, _ in unique(wanted))
    assert all(one in wanted for one in got)
    assert requirements("nothing") == []


def test_in_the_environment_of_run_it_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "prefix", str(ROOT / ".venv"))
    monkeypatch.chdir(ROOT)
    assert install_command("ocio") == "./run setup ocio"
    monkeypatch.chdir(tmp_path)
    assert install_command("ocio") == f"{ROOT / 'run'} setup ocio"


def test_elsewhere_it_is_pip_of_the_python_that_runs(monkeypatch):
    monkeypatch.setattr(sys, "prefix", "/elsewhere")
    monkeypatch.setattr(extras.shutil, "which", lambda name: sys.executable)
    assert re.fullmatch(r"python -m pip install 'opencolorio\S+'", install_command("ocio"))
    monkeypatch.setattr(extras.shutil, "which", lambda name: None)
    assert install_command("ocio").startswith(f"{sys.executable} -m pip install ")
    assert install_command("nothing") == "the extra nothing of wgmb has it"


def test_no_message_or_page_names_a_package_that_nobody_published():
    places = [*ROOT.glob("wgmb/**/*.py"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("docs/*.ipynb")]
    places += [ROOT / "README.md", *ROOT.glob("tools/*.py"), *ROOT.glob("sample/*.py")]
    wrong = re.compile(r"install `?'?wgmb\b|\bwgmb\[[a-z]")
    found = [p.name for p in places if wrong.search(p.read_text("utf-8"))]
    assert found == []
