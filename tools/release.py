"""The steps of a release that are no other program's; .github/workflows/release.yml calls them.

python tools/release.py check TAG REPOSITORY   the tag and the address are those of this tree
python tools/release.py notes VERSION          what CHANGELOG.md says of a version
python tools/release.py try                    the wgmb that is installed here: does it work?

`try` needs no clone beside it. It blurs where there is an adapter, and says so where there is none.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def check(tag: str, address: str, repository: str) -> None:
    """End the program with one line if the tag or the address does not fit."""
    sys.path.insert(0, str(ROOT / "wgmb"))
    from _version import __version__

    if tag != f"v{__version__}":
        sys.exit(f"the tag is {tag}, the version of wgmb/_version.py {__version__}")
    repository = repository.rstrip("/")
    if not address:
        sys.exit(f"set `address` in pyproject.toml to {repository} before the tag")
    if address != repository:
        sys.exit(f"`address` in pyproject.toml is {address}, the repository's {repository}")


def notes(changelog: str, version: str) -> str:
    """The section of a version, without its heading."""
    sections = re.split(r"^## ", changelog, flags=re.M)[1:]
    for section in sections:
        heading, _, text = section.partition("\n")
        if heading.split()[:1] == [version]:
            if not text.strip():
                sys.exit(f"CHANGELOG.md: the section for {version} is empty")
            return f"{text.strip()}\n"
    sys.exit(f"CHANGELOG.md has no section for {version}")


def try_installed() -> None:
    """Import wgmb, ask the command line, and blur; AssertionError or a failed call otherwise."""
    program = [sys.executable, "-P", "-m", "wgmb"]
    with tempfile.TemporaryDirectory() as folder:  # not the clone, whose wgmb would be imported
        said = run([*program, "--version"], folder)
        print(f"wgmb {said.strip()} with Python {sys.version.split()[0]}")
        run([*program, "blur", "--help"], folder)
        found = run([sys.executable, "-P", "-c", ADAPTERS], folder)
        adapters = json.loads(found)
        print("adapters:", *(adapters or ["none"]), sep="\n  ")
        if not [name for name in adapters if "OpenGL" not in name]:
            print("nothing was blurred, as there is no adapter")
            return
        run([*program, "render", "crossing", "-o", "a.exr", "--size", "64x36", "--sharp"], folder)
        run([*program, "render", "wheel", "-o", "b.exr", "--size", "64x36"], folder)
        print(run([*program, "doctor"], folder).splitlines()[-1])


ADAPTERS = "import json, wgmb.gpu; print(json.dumps([a.summary for a in wgmb.gpu.adapters()]))"


def run(line: list[str], folder: str) -> str:
    """The output of a program; its errors are shown and end this one."""
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=600)
    if done.returncode:
        sys.exit(f"{' '.join(line[1:])}: exit {done.returncode}: {done.stderr}{done.stdout}")
    return done.stdout


def main(command: str, *words: str) -> None:
    """Run one of the steps."""
    if command == "check":
        from metadata_hook import address_of

        check(words[0], address_of(ROOT), words[1])
        notes((ROOT / "CHANGELOG.md").read_text("utf-8"), words[0].removeprefix("v"))
    elif command == "notes":
        sys.stdout.write(notes((ROOT / "CHANGELOG.md").read_text("utf-8"), words[0]))
    elif command == "try":
        try_installed()
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(*sys.argv[1:] or [""])
