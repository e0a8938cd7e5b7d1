"""A package of an extra that is missing is named with its extra, and no other error is."""

import subprocess
import sys

import pytest

from wgmb.errors import InputError
from wgmb.extras import is_installed, needed_by

pytestmark = pytest.mark.fast


def test_a_missing_package_names_its_extra_or_the_given_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert not is_installed("PIL")
    told = r"^this: Pillow is not installed: .*'wgmb\[images\]'$"
    with pytest.raises(InputError, match=told), needed_by("this"):
        import PIL.Image
    with pytest.raises(InputError, match=r"'wgmb\[other\]'$"), needed_by("this", "other"):
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
    assert "is not installed: pip install 'wgmb[" in said
