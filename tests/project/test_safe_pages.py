"""Promise of SECURITY.md: text in pages and drawings is escaped, and they load nothing."""

import re

import numpy as np
import pytest
from read_page import Page

from wgmb import Frame, Shutter, charts
from wgmb.lab import report
from wgmb.lab.cases import Case
from wgmb.lab.results import Bars, Entry, Plot, Report, Table
from wgmb.metrics import METRICS
from wgmb.run.report import BatchReport

pytestmark = pytest.mark.fast
PLAIN = "plain"
HOSTILE = "</title></script></style><script src=//x.org/a.js></script><b onclick='a()'>\"'&{{body}}"
LOADS = re.compile(r"url\(|@import|\bfetch\(|XMLHttpRequest|WebSocket|EventSource|\bimport\b")


def compared(text: str) -> str:
    """The page of `wgmb compare` and `wgmb bench` with everything that it can show."""
    picture = np.zeros((16, 24, 3), np.float32)
    case = Case(text, Frame(picture), Shutter(180), picture, text, floor={"flip": 0.01, "psnr": 60})
    scores = dict.fromkeys(METRICS, 0.5)
    entry = [
        Entry(text, f"{text} {kind}", kind, scores, 4, 0.1, on_page=True, picture=picture)
        for kind in ("sharp", "peer", "samples")
    ]
    timed = Entry(text, text, "time", scores, 4, 0.1, budget=0.2, on_page=True, picture=picture)
    return report.page(
        Report(
            text, text, {text: text}, 4, [case], [*entry, timed],
            [Table(text, [text], [[text], [1.5]], text)],
            [Plot(text, text, text, {text: [(1.0, 2.0), (2.0, 3.0)]})],
            [Bars(text, text, {text: {text: 1.0}})], [text],
        )
    )  # fmt: skip


def drawn(text: str) -> str:
    """The drawing of `wgmb shutter`."""
    return charts.svg(*charts.shutter_charts(Shutter(180), text))


def of_a_run(text: str) -> str:
    """The output of a run in a notebook."""
    return BatchReport(done=[1], failed={2: text}, stopped=text)._repr_html_()


@pytest.mark.parametrize("made", [compared, drawn, of_a_run])
def test_text_of_strangers_changes_no_element_of_a_page_and_loads_nothing(made):
    plain, hostile = Page(made(PLAIN)), Page(made(HOSTILE))
    assert hostile.elements == plain.elements and len(plain.elements) > 3
    assert hostile.code == plain.code
    assert sum(HOSTILE in text for text in hostile.texts) > 0
    assert all(address.startswith(("#", "data:image/")) for address in hostile.addresses)
    assert not any(name.startswith("on") for element in plain.elements for name in element[1:])
    assert not LOADS.findall("".join(plain.code))


def test_what_was_not_escaped_would_be_seen():
    """The test itself."""
    assert Page(f"<p>{HOSTILE}</p>").elements != Page(f"<p>{PLAIN}</p>").elements
    assert Page(f'<p title="{HOSTILE}">').elements != Page(f'<p title="{PLAIN}">').elements
