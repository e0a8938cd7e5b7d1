"""Check a report's page in headless Chromium: python tests/in_browser.py report.html [shot.png].

Moves the slider, changes the pictures, sorts a table, and listens for errors; also that
nothing is wider than a phone. With a second name, screenshots at desktop and phone width.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--hide-scrollbars", "--enable-logging=stderr", "--virtual-time-budget=20000",
]  # fmt: skip
ACT = """<script>
addEventListener("load", () => {
  const said = [], is = (what, ok) => said.push((ok ? "ok " : "FAILED ") + what);
  const all = selector => [...document.querySelectorAll(selector)];
  is("pictures are there", all(".card img").length > 0 === all(".viewer").length > 0
    && all("img").every(i => i.complete && i.naturalWidth > 0));
  for (const viewer of all(".viewer")) {
    const range = viewer.querySelector("[type=range]"), left = viewer.querySelector("img.left");
    const covered = () => getComputedStyle(left).clipPath;
    const before = covered();
    range.value = 20; range.dispatchEvent(new Event("input"));
    is("slider moves the edge", covered() !== before);
    const pick = viewer.querySelector("select.left"), source = left.src;
    pick.selectedIndex = (pick.selectedIndex + 1) % pick.length;
    pick.dispatchEvent(new Event("change"));
    is("another picture is shown", left.src !== source);
    const box = viewer.querySelector("[type=checkbox]"), plain = left.src;
    const has = viewer.querySelector(".name-left").textContent !== "truth";
    box.click();
    is("error maps are shown", !has || left.src !== plain);
  }
  for (const table of all("table.sort")) {
    const last = table.tHead.rows[0].cells.length - 1, body = table.tBodies[0];
    const keys = () => [...body.rows].map(r => Number(r.cells[last].dataset.value))
      .filter(v => !Number.isNaN(v));
    const button = table.tHead.rows[0].cells[last].querySelector("button");
    const up = (a) => a.every((v, i) => !i || a[i - 1] <= v);
    button.click(); is("sorts upwards", up(keys()));
    button.click(); is("sorts downwards", up(keys().reverse()));
  }
  const wide = document.documentElement;
  is("nothing is wider than the window", wide.scrollWidth <= wide.clientWidth);
  const note = document.createElement("pre");
  note.id = "checked"; note.textContent = said.join("\\n");
  document.body.append(note);
});
</script></body>"""


def chromium(page: Path, width: int, *more: str, height: int = 900) -> subprocess.CompletedProcess:
    """Open a page; what it printed, with the console on stderr."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["chromium", *FLAGS, f"--user-data-dir={folder}",
                   f"--window-size={width},{height}", *more, page.absolute().as_uri()]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, timeout=120)


def main(page: Path, shot: Path | None) -> int:
    """Print what was checked; 1 if anything failed."""
    failed = False
    for width in (1280, 500):  # headless Chromium has no narrower window
        with tempfile.TemporaryDirectory() as folder:
            acted = Path(folder) / "acted.html"
            acted.write_text(page.read_text("utf-8").replace("</body>", ACT), "utf-8")
            done = chromium(acted, width, "--dump-dom")
        found = re.search(r'<pre id="checked">(.*?)</pre>', done.stdout, re.S)
        lines = found[1].split("\n") if found else ["FAILED the page's script did not run"]
        lines += [f"FAILED {line}" for line in done.stderr.splitlines() if "CONSOLE" in line]
        counts = {line: lines.count(line) for line in lines}
        print(f"{width} px wide:", *(f"  {n} x {line}" for line, n in counts.items()), sep="\n")
        failed |= any("FAILED" in line for line in lines)
        if shot is not None:
            name = shot.with_stem(f"{shot.stem}_{width}")
            chromium(page, width, f"--screenshot={name.absolute()}", height=2600)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None))
