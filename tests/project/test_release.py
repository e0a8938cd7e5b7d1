"""Parts of a release: links and description of the package, notes, the tag, bundles."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import metadata_hook
import release
from wgmb import __version__

pytestmark = pytest.mark.fast

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
LINK = r"\]\((?![a-z]+:|#)([^)\s]+)\)"


def test_with_an_address_every_link_of_the_description_leads_into_the_repository():
    text = metadata_hook.description(README, "https://example.org/o/wgmb", "1.2")
    assert re.findall(LINK, README)
    assert re.findall(LINK, text) == []
    assert "(https://example.org/o/wgmb/blob/v1.2/LICENSE)" in text
    assert "(https://example.org/o/wgmb/raw/v1.2/sample/before_after.jpg)" in text
    for path in re.findall(r"/(?:blob|raw)/v1\.2/([^)#\s]+)", text):
        assert (ROOT / path).exists(), path


def test_without_an_address_nothing_leads_astray_and_no_address_is_made_up():
    text = metadata_hook.description(README, "", "1.2")
    assert re.findall(LINK, text) == []
    assert "![" not in text
    assert "[LICENSE]" not in text and "LICENSE" in text
    assert metadata_hook.urls("", "1.2") == {}


def test_the_address_is_set_in_one_place():
    """If it is set, CITATION.cff repeats it, as the form of that file asks."""
    address = metadata_hook.address_of(ROOT)
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    cited = re.findall(r"^repository-code: (\S+)$", text, re.M)
    assert cited == ([address] if address else [])
    if address:
        assert set(metadata_hook.urls(address, "1")) == {
            "Source", "Documentation", "Changelog", "Issues"
        }  # fmt: skip


def test_the_notes_of_a_version_are_its_section_of_the_changelog():
    text = "## Unreleased\n\n- c\n\n## 0.2.0 (2026-02-01)\n\n### Added\n\n- b\n\n## 0.1.0\n\n- a\n"
    assert release.notes(text, "0.2.0") == "### Added\n\n- b\n"
    assert release.notes(text, "0.1.0") == "- a\n"
    with pytest.raises(SystemExit, match=r"CHANGELOG\.md has no section for 0\.3\.0"):
        release.notes(text, "0.3.0")
    with pytest.raises(SystemExit, match=r"the section for 0\.4\.0 is empty"):
        release.notes("## 0.4.0\n\n## 0.1.0\n\n- a\n", "0.4.0")


@pytest.mark.parametrize(
    ("tag", "address", "repository", "says"),
    [
        ("v9.9", "https://e.org/o/w", "https://e.org/o/w", "the tag is v9.9, the version "),
        (f"v{__version__}", "", "https://e.org/o/w", "set `address` in pyproject.toml to https"),
        (f"v{__version__}", "https://e.org/x", "https://e.org/o/w", "is https://e.org/x, the rep"),
    ],
)
def test_what_does_not_fit_stops_a_release(tag, address, repository, says):
    with pytest.raises(SystemExit, match=re.escape(says)):
        release.check(tag, address, repository)


def test_what_fits_does_not():
    release.check(f"v{__version__}", "https://e.org/o/w", "https://e.org/o/w/")


def test_the_supported_pythons_are_those_of_the_workflow():
    text = (ROOT / ".github/workflows/release.yml").read_text("utf-8")
    tried = re.search(r"python: \[(.*)\]", text)[1].replace('"', "").split(", ")
    said = [c.rpartition(" ")[2] for c in PROJECT["project"]["classifiers"] if ":: 3." in c]
    assert tried == said


OLD = "import sys; sys.version_info = (3, 10, 13); sys.version = '3.10.13 (of a test)'; "


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("import wgmb", "ImportError: wgmb needs Python 3.11 or newer, got 3.10.13"),
        ("import runpy; runpy.run_path('app.py')",
         "app.py: wgmb needs Python 3.11 or newer, got 3.10.13"),
        ("import runpy; runpy.run_path('tools/metadata_hook.py')",
         "wgmb needs Python 3.11 or newer, got 3.10.13"),
    ],
)  # fmt: skip
def test_a_python_that_is_too_old_is_one_line(line, said):
    """pip listed every version of wgpu; the command named packages to install."""
    done = subprocess.run(
        [sys.executable, "-c", OLD + line], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == said
    assert len(done.stderr.splitlines()) == 1 or "ImportError" in said
