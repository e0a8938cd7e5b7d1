"""Parts of a release: links and description of the package, notes, the tag, bundles."""

import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import locked
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


VERSIONED = {
    "wgmb/_version.py": r'^__version__ = "(.+)"$',
    "pyproject.toml": r'^version = "(.+)"$',
    "CITATION.cff": r"^version: (.+)$",
    "blender/wgmb_blender/blender_manifest.toml": r'^version = "(.+)"$',
    "comfyui/pyproject.toml": r'^version = "(.+)"$|\[video\] == (.+)"\]$',
}


@pytest.mark.parametrize("path", VERSIONED)
def test_the_version_is_the_same_in_every_file_that_the_page_names(path):
    found = re.findall(VERSIONED[path], (ROOT / path).read_text("utf-8"), re.M)
    assert found and {"".join(one) for one in found} == {__version__}
    page = (ROOT / "docs/development/contributing.md").read_text("utf-8")
    step = page.partition("1. Set the version in ")[2].partition("\n2. ")[0]
    assert f"`{path}`" in step


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no clone: an unpacked archive")
def test_the_source_archive_holds_every_file_of_the_repository():
    """`run` was missing from it, so that no command of README worked in an unpacked archive."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True)
    tracked = {name for name in listed.stdout.decode().split("\0") if (ROOT / name).is_file()}
    packed = {file.relative_path for file in SdistBuilder(str(ROOT)).recurse_included_files()}
    assert "run" in tracked and tracked - packed == set()


WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned_by_commit(path):
    """A tag can be moved; the tag that is meant stands in a comment."""
    text = path.read_text("utf-8")
    used = re.findall(r"uses: *(.*)", text)
    assert used
    for line in used:
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}  # v\d+\.\d+\.\d+", line), line
    assert len(set(used)) == len({line.partition("@")[0] for line in used})


def test_the_container_is_made_of_what_hashes_name():
    text = (ROOT / "Dockerfile").read_text("utf-8")
    bases = re.findall(r"^FROM (\S+)", text, re.M)
    assert len(bases) == 2 and len(set(bases)) == 1
    assert re.fullmatch(r"python:3\.13-slim-trixie@sha256:[0-9a-f]{64}", bases[0])
    joined = text.replace("\\\n", " ")
    for words in re.findall(r"pip install ([^&\n]*)", joined):
        assert "--require-hashes" in words or "--no-index" in words, words


def test_pip_installs_by_hash_wherever_a_release_is_made():
    """But in the job that tries the wheel as users install it, from which nothing is published."""
    script = (ROOT / "tools/set_up.sh").read_text("utf-8").replace("\\\n", " ")
    said = [line for line in script.splitlines() if re.search(r"\binstall --", line)]
    said += [line for line in script.splitlines() if re.match(r" +install_into ", line)]
    assert len(said) >= 4
    for line in said:
        assert re.search('--require-hashes|--no-index|pip --python .*"\\$@"', line), line
    for path in WORKFLOWS:
        for line in re.findall(r"^.*\b(?:pip|pipx) (?:install|run)\b.*$", path.read_text(), re.M):
            assert "ls dist/*.whl" in line, line


LOCKS = [locked.LOCK, ROOT / "tests/blender/needs.txt"]


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.name)
def test_a_lock_has_the_hashes_of_all_its_packages(path):
    entries = locked.entries(path)
    assert len(entries) > 10
    for entry in entries:
        head, *rest = entry.text.replace("\\\n", " ").split("--hash=")
        assert re.match(r"\S+==\S+ ", head), entry.name
        assert rest and all(re.match(r"sha256:[0-9a-f]{64}\b", one) for one in rest), entry.name


EXTRAS = {"core", *PROJECT["project"]["optional-dependencies"]}


@pytest.mark.parametrize("extra", sorted(EXTRAS))
def test_the_lock_fits_every_extra(extra):
    """And has what its packages need, as far as they are installed here."""
    listed = PROJECT["project"]["optional-dependencies"] | {
        "core": PROJECT["project"]["dependencies"]
    }
    found = locked.needed([extra], locked.entries())
    versions = {e.name: re.findall(r"==(\S+)", e.text)[0] for e in found}
    needs = [Requirement(line) for line in listed[extra] if not line.startswith("wgmb[")]
    for need in needs:
        assert need.specifier.contains(versions[canonicalize_name(need.name)]), need
    for name in versions:
        try:
            requires = metadata.distribution(name).requires or []
        except metadata.PackageNotFoundError:
            continue
        for need in map(Requirement, requires):
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                assert canonicalize_name(need.name) in versions, (name, str(need))


@pytest.mark.skipif(
    Path(sys.prefix) != ROOT / ".venv" or not (ROOT / ".venv/place").exists(),
    reason="this environment was not made by ./run",
)
def test_every_package_of_the_environment_is_in_the_lock():
    pinned = {(e.name, v) for e in locked.entries() for v in re.findall(r"^\S+==(\S+)", e.text)}
    there = {(canonicalize_name(d.name), d.version) for d in metadata.distributions()}
    assert {one for one in there if one[0] not in ("wgmb", "pip", "setuptools")} <= pinned


def test_the_lock_says_which_packages_are_needed_and_names_what_it_does_not_know():
    small = {e.name for e in locked.needed(["core", "cli"], locked.entries())}
    assert {"wgpu", "cffi", "cyclopts", "rich", "markdown-it-py"} <= small
    assert not small & {"pytest", "av", "pillow"}
    assert {"pillow", "av", "glfw", "cyclopts"} <= {
        e.name for e in locked.needed(["view"], locked.entries())
    }
    with pytest.raises(SystemExit, match="neither an extra nor a package of the lock: nonsense"):
        locked.needed(["cli", "nonsense"], locked.entries())


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


def test_an_entry_of_the_changelog_is_one_short_line():
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert [line for line in text.splitlines() if len(line) > 160] == []
    assert not re.search(r"\bdB\b|FLIP", text), "scores stand on the pages of the laboratory"


def test_pinned_versions_are_compared_with_advisories_every_night():
    """All files that pin versions, so that SECURITY.md is true."""
    nightly = (ROOT / ".github/workflows/nightly.yml").read_text("utf-8")
    assert re.search(r"schedule:\n    - cron: \"\d+ \d+ \* \* \*\"", nightly)
    compared = re.findall(r"pip-audit --requirement (\S+)", nightly)
    assert compared == ["constraints.txt", "tests/blender/needs.txt"]
    wheels = re.findall(r"^([\w.-]+==\S+)", (ROOT / "blender/wheels.txt").read_text("utf-8"), re.M)
    pinned = (ROOT / "constraints.txt").read_text("utf-8")
    assert wheels and all(f"\n{wheel} " in f"\n{pinned}" for wheel in wheels)
