"""docs/notebook.ipynb runs in a kernel of its own, and the panel draws what its sliders say."""

import base64
import io
import re
import subprocess
import sys

import imageio.v3 as iio
import nbformat
import numpy as np
import pytest

import make_notebook
import wgmb
from wgmb import extras
from wgmb.hosts import explorer

# Jupyter's own remarks, in this process.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def book():
    return make_notebook.run()


def shown(book, kind: str) -> list[str]:
    outputs = [o for cell in book.cells for o in cell.get("outputs", ())]
    return [o.data[kind] for o in outputs if kind in o.get("data", {})]


@pytest.mark.full
def test_it_runs_without_a_word_on_stderr(book):
    outputs = [o for cell in book.cells for o in cell.get("outputs", ())]
    assert not [o for o in outputs if o.get("name") == "stderr" or o.output_type == "error"]
    assert all(len(text) < 500 for text in shown(book, "text/plain"))
    for kind, count in {"image/png": 2, "image/svg+xml": 1, "text/html": 1}.items():
        assert len(shown(book, kind)) == count
    assert len(shown(book, "application/vnd.jupyter.widget-view+json")) == 1
    assert shown(book, "text/plain")[-1] == "True"


@pytest.mark.full
def test_the_page_shows_what_the_run_shows(book):
    """The stored outputs are of these cells; `tools/make_notebook.py` makes them."""
    stored = nbformat.read(make_notebook.PATH, as_version=4)
    assert [c.source for c in stored.cells] == [c.source for c in book.cells]
    for kind in ("image/svg+xml", "text/html"):
        assert shown(stored, kind) == shown(book, kind)
    both = zip(shown(stored, "image/png"), shown(book, "image/png"), strict=True)
    for a, b in both:
        a, b = (iio.imread(io.BytesIO(base64.b64decode(png))).astype(float) for png in (a, b))
        assert np.abs(a - b).mean() < 0.5


@pytest.mark.full
def test_downloaded_alone_it_renders_its_own_frames(tmp_path):
    first = nbformat.read(make_notebook.PATH, as_version=4).cells[1].source
    (tmp_path / "alone").mkdir()
    script = f"{first}\nprint(clip.numbers, sorted(clip[10].has))"
    words = [sys.executable, "-c", script]
    done = subprocess.run(
        words, cwd=tmp_path / "alone", capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.strip() == "[9, 10, 11] ['color', 'depth', 'motion']"


@pytest.fixture(scope="module")
def panel(noise):
    frame = wgmb.Frame(noise, np.full((48, 64, 2), (9.0, 3.0), np.float32))
    made = wgmb.explore(frame)
    made.wait()
    return made


def test_every_value_of_the_slider_gives_its_own_picture(panel, noise):
    pictures = {}
    for degrees in (0, 90, 360, 720):
        panel.shutter.value = degrees
        panel.wait()
        pictures[degrees] = panel.picture.value
    assert len(set(pictures.values())) == 4
    to_next = np.full((48, 64, 2), (9.0, 3.0), np.float32)
    want = wgmb.blur(noise, to_next, method="tap", shutter=360, samples=16)
    assert pictures[360] == wgmb.show(want).png
    panel.samples.value = 3
    panel.wait()
    assert panel.picture.value != pictures[720]
    panel.compare.value = True
    panel.wait()
    assert panel.picture.value == wgmb.show(noise).png
    panel.compare.value = False


def test_only_methods_that_fit_are_offered_and_only_the_last_value_is_drawn(panel, monkeypatch):
    assert set(panel.method.options) == {"tap", "tiles", "fusion"} & set(panel.method.options)
    assert "tap" in panel.method.options
    assert "gather" not in panel.method.options
    drawn = []
    blurred = explorer.Explorer._blurred

    def slow(self, method, degrees, samples):
        drawn.append(degrees)
        return blurred(self, method, degrees, samples)

    monkeypatch.setattr(explorer.Explorer, "_blurred", slow)
    with panel._turn:  # as if the GPU were busy
        for degrees in range(5, 500, 5):
            panel.shutter.value = degrees
    panel.wait()
    assert drawn[-1] == 495
    assert len(drawn) < 5


def test_an_error_is_told_in_the_panel(panel, monkeypatch):
    def failing(*_):
        raise wgmb.GpuMemoryError("too little GPU memory")

    monkeypatch.setattr(explorer.Explorer, "_blurred", failing)
    panel.shutter.value = 1 if panel.shutter.value != 1 else 2
    panel.wait()
    assert panel.status.value == "too little GPU memory"


def test_a_frame_without_motion_is_refused():
    with pytest.raises(wgmb.InputError, match="no motion"):
        wgmb.explore(wgmb.Frame(np.zeros((4, 4, 3), np.float32)))


def test_without_ipywidgets_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    monkeypatch.delitem(sys.modules, "wgmb.hosts.explorer")
    why = f"wgmb.explore: ipywidgets is not installed: {extras.install_command('notebook')}"
    told = f"^{re.escape(why)}$"
    with pytest.raises(wgmb.InputError, match=told):
        wgmb.explore(wgmb.Frame(np.zeros((4, 4, 3), np.float32)))
