"""The page of scores, docs/laboratory/scores.md, whose parts are written by one tool each.

A part lies between `<!-- NAME -->` and `<!-- end of NAME -->`: blender_scores.py, fine_figures.py,
gallery.py and real_clips.py make them. What is outside is written by hand.
"""

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "laboratory" / "scores.md"


def part(name: str) -> str:
    """The text of a part as it is now."""
    return _split(name)[1]


def write(name: str, text: str) -> None:
    """Put another text in its place."""
    before, _, after = _split(name)
    PAGE.write_text(f"{before}{text.strip()}\n\n{after}", encoding="utf-8")


def table(rows: list[list[str]]) -> str:
    """Rows of cells as Markdown, the first as the heading."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _split(name: str) -> tuple[str, str, str]:
    begin, end = f"<!-- {name} -->\n\n", f"<!-- end of {name} -->"
    text = PAGE.read_text("utf-8")
    if not re.search(f"{re.escape(begin)}.*{re.escape(end)}", text, re.S):
        raise ValueError(f"{PAGE.name} must have {begin.strip()} and {end}")
    before, _, rest = text.partition(begin)
    now, _, after = rest.partition(end)
    return before + begin, now, end + after
