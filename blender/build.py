"""The add-on as bundles for Blender's extensions, one for each platform, without Blender.

python blender/build.py fetch     the wheels that wheels.txt names, into build/blender/wheels
python blender/build.py bundle    dist/wgmb-VERSION-PLATFORM.zip, from them and from this wgmb
python blender/build.py lock      wheels.txt anew, from constraints.txt

A bundle holds the add-on, its licence, wgmb and what wgmb needs but for numpy, which Blender has.
Of wgpu's own requirements, rendercanvas is left out: only windows need it. The same sources and
wheels give the same bytes. `./run add-on` does the first two; without it, `bundle` needs hatchling.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
ADD_ON, LOCK = HERE / "wgmb_blender", HERE / "wheels.txt"
WHEELS = ROOT / "build" / "blender" / "wheels"
PACKAGES = ("wgpu", "openexr", "cffi", "pycparser", "fileseq", "packaging", "rubicon-objc")
PYTHONS = ("3.11", "3.13")  # of Blender 4.2 to 5.0, and of 5.1
PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_11_0_arm64",),
    "macos-x64": ("macosx_10_15_x86_64", "macosx_10_9_x86_64"),
}
ONLY_MACOS = ("rubicon_objc",)
MOST_BYTES = 9_000_000
_EPOCH = (1980, 1, 1, 0, 0, 0)


def locked() -> dict[str, str]:
    """The version of each package in wheels.txt."""
    return dict(re.findall(r"^([a-z-]+)==(\S+)", LOCK.read_text("utf-8"), re.M))


def download(requirements: list[str], folder: Path) -> None:
    """Let pip fetch the wheels of all platforms and Pythons."""
    folder.mkdir(parents=True, exist_ok=True)
    for tags in PLATFORMS.values():
        for python in PYTHONS:
            words = [sys.executable, "-P", "-m", "pip", "download", "--quiet", "--no-deps"]
            words += ["--disable-pip-version-check", "--only-binary=:all:", "--dest", str(folder)]
            words += ["--python-version", python]
            words += [word for tag in tags for word in ("--platform", tag)]
            done = subprocess.run([*words, *requirements], stderr=subprocess.PIPE, text=True)
            if done.returncode:
                last = done.stderr.strip().rpartition("\n")[2]
                why = f"pip could not download the wheels for Python {python}: {last}"
                is_alone = "Retrying" in done.stderr or "from versions: none" in done.stderr
                sys.exit(f"{why}; is the package index within reach?" if is_alone else why)


def fetch() -> None:
    """Fetch the locked wheels; those with another hash are refused."""
    download(["--require-hashes", "--requirement", str(LOCK)], WHEELS)


def lock() -> None:
    """Write wheels.txt: the versions of constraints.txt, with the hash of every wheel."""
    text = (ROOT / "constraints.txt").read_text("utf-8")
    versions = {name: re.search(rf"^{name}==(\S+)", text, re.M) for name in PACKAGES}
    lines = ["# Made by `python blender/build.py lock`."]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        download([f"{name}=={found[1]}" for name, found in versions.items() if found], folder)
        for name, found in versions.items():
            if found is None:
                sys.exit(f"constraints.txt has no {name}")
            stem = name.replace("-", "_")
            hashes = {
                hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.glob(f"{stem}-*.whl")
            }
            lines.append(f"{name}=={found[1]} \\")
            lines.append(" \\\n".join(f"    --hash=sha256:{one}" for one in sorted(hashes)))
    LOCK.write_text("\n".join(lines) + "\n", "utf-8")


def wheels_of(platform: str, folder: Path) -> list[Path]:
    """The wheels in a folder that a platform's bundle holds."""
    found = []
    for path in sorted(folder.glob("*.whl")):
        *_, abi, tags = path.stem.split("-")
        of_platform = set(tags.split(".")) & {"any", *PLATFORMS[platform]}
        is_for_all = abi == "none" and tags == "any"
        if path.name.startswith(ONLY_MACOS) and not platform.startswith("macos"):
            continue
        if is_for_all or of_platform:
            found.append(path)
    names = {path.name.partition("-")[0] for path in found}
    wanted = {name.replace("-", "_") for name in PACKAGES}
    if not platform.startswith("macos"):
        wanted -= set(ONLY_MACOS)
    if lacking := wanted - names:
        sys.exit(f"{folder} has no {', '.join(sorted(lacking))} for {platform}: fetch them first")
    return found


def own_wheel(folder: Path) -> Path:
    """The wheel of wgmb as it is here."""
    words = [sys.executable, "-P", "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"wgmb's wheel cannot be built: {done.stderr}")
    return next(folder.glob("wgmb-*.whl"))


def manifest(platform: str, wheels: list[Path]) -> str:
    """The manifest of a platform's bundle: the add-on's own, with its wheels."""
    text = (ADD_ON / "blender_manifest.toml").read_text("utf-8")
    listed = "".join(f'  "./wheels/{path.name}",\n' for path in wheels)
    head, mark, rest = text.partition("[permissions]")
    return f'{head}platforms = ["{platform}"]\nwheels = [\n{listed}]\n\n{mark}{rest}'


def files_of(platform: str, wheels: list[Path]) -> Iterator[tuple[str, bytes]]:
    """Names and contents of a bundle's files."""
    yield "blender_manifest.toml", manifest(platform, wheels).encode()
    yield "LICENSE", (HERE / "LICENSE").read_bytes()
    for path in sorted(ADD_ON.rglob("*.py")):
        yield path.relative_to(ADD_ON).as_posix(), path.read_bytes()
    for path in wheels:
        yield f"wheels/{path.name}", path.read_bytes()


def bundle(folder: Path, wheels: Path = WHEELS, platforms: tuple[str, ...] = ()) -> list[Path]:
    """Write the bundles of the platforms, by default all, into a folder."""
    version = tomllib.loads((ADD_ON / "blender_manifest.toml").read_text("utf-8"))["version"]
    if find_spec("hatchling") is None:
        sys.exit("this Python has no hatchling, which builds wgmb's wheel; ./run add-on brings it")
    brought = {platform: wheels_of(platform, wheels) for platform in platforms or PLATFORMS}
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    with tempfile.TemporaryDirectory() as place:
        own = own_wheel(Path(place))
        for platform, others in brought.items():
            path = folder / f"wgmb-{version}-{platform.replace('-', '_')}.zip"
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
                for name, content in files_of(platform, [own, *others]):
                    file.writestr(zipfile.ZipInfo(name, _EPOCH), content, zipfile.ZIP_DEFLATED)
            if path.stat().st_size > MOST_BYTES:
                sys.exit(f"{path}: {path.stat().st_size} bytes, {MOST_BYTES} are allowed")
            made.append(path)
    return made


def main() -> None:
    """Do what the first word says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("fetch", "bundle", "lock"))
    parser.add_argument("--output", type=Path, default=ROOT / "dist", metavar="FOLDER")
    parser.add_argument("--wheels", type=Path, default=WHEELS, metavar="FOLDER")
    given = parser.parse_args()
    if given.what == "bundle":
        for path in bundle(given.output, given.wheels):
            print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")
    else:
        {"fetch": fetch, "lock": lock}[given.what]()


if __name__ == "__main__":
    main()
