"""The page for browsers in Chromium: pictures against Python's, controls, and life without WebGPU.

Skipped where there is no Chromium, except in CI, which installs it.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from read_page import Page

import make_page
import parts
import standard
from wgmb import Blur, Render, Shutter
from wgmb.color.srgb import linear, srgb, to_display
from wgmb.scene import make

HERE = Path(__file__).parents[1]
SIZE = 640, 360
LEAST, MOST = 55, 2  # dB, and 255ths
FEW, TIED = 2, 8  # pixels in which rounding may decide between two bodies, and 255ths there


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page, made from what is in the tree."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(make_page.page(), "utf-8")
    return path


@pytest.fixture(scope="module")
def visit(request):
    """visit(*visits): what page.mjs saw of each; none may have an error or ask a network."""
    parts.need("chromium", "dawn")
    page = request.getfixturevalue("page")

    def visited(*visits: dict) -> list[dict]:
        given = {"page": page.as_uri(), "chromium": shutil.which("chromium"), "visits": visits}
        done = subprocess.run(
            [standard.node_path(), "page.mjs"], input=json.dumps(given), cwd=standard.HERE,
            capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr[-2000:]
        seen = json.loads(done.stdout.rpartition("\nanswer: ")[2])
        for one in seen:
            assert one["errors"] == []
            assert [s for s in one["said"] if "No available adapters" not in s] == []
            assert one["requests"] == []
            assert one["wider"] <= 0, "something is wider than the window"
        return seen

    return visited


def picture(of: str, file: Path) -> list[dict]:
    return [{"do": "picture", "of": of, "file": str(file)}]


def state(**said) -> str:
    size = f"{SIZE[0]}x{SIZE[1]}"
    return "&".join(f"{k}={v}" for k, v in {"still": 1, "size": size, **said}.items())


def go(said: str) -> dict:
    """Another address in the same window."""
    return {"do": "evaluate", "script": f"location.hash = {said!r}; wgmb.settled()"}


def check(file: Path, want: np.ndarray) -> None:
    """Compare a picture with Python's."""
    got, want = iio.imread(file)[..., :3].astype(float), to_display(want[..., :3], 8).astype(float)
    assert got.shape == want.shape
    apart = np.abs(got - want)
    assert -10 * np.log10(max(np.mean((apart / 255) ** 2), 1e-12)) >= LEAST
    assert np.count_nonzero(apart.max(axis=2) > MOST) <= FEW
    assert apart.max() <= TIED


TORUSPHERE = [  # time, camera, degrees, curve, frames per second, density
    (7.5, (0.3, -0.2), 288, "cosine", 24, "exact"),
    (16.5, (0.3, -0.2), 720, "cosine", 24, "exact"),
    (18.5, (0.0, 0.0), 1080, "box", 24, "published"),
    (3.2, (-1.0, 0.5), 180, "box", 30, "exact"),
    (27.25, (2.0, -0.6), 540, "trapezoid", 60, "exact"),
    (41.0, (0.3, -0.2), 0, "box", 24, "exact"),
]


@pytest.mark.full
def test_the_torusphere_is_that_of_python(visit, tmp_path):
    files = [tmp_path / f"{i}.png" for i in range(len(TORUSPHERE))]
    steps = []
    for file, (t, (x, y), degrees, curve, fps, density) in zip(files, TORUSPHERE, strict=True):
        said = state(t=t, x=x, y=y, deg=degrees, curve=curve, fps=fps, density=density)
        steps += [go(said), *picture("#torusphere", file)]
    visit({"hash": state(), "steps": steps})
    for file, (t, (x, y), degrees, curve, fps, density) in zip(files, TORUSPHERE, strict=True):
        scene = make("torusphere", cam_x=x, cam_y=y, density=density)
        blur = Blur("volume", shutter=Shutter(degrees, curve=curve))
        check(file, Render(scene, blur, size=SIZE, fps=fps)(t))


SAMPLE = [  # method, degrees, curve, samples
    ("tap", 360, "box", 16),
    ("tap", 180, "cosine", 32),
    ("tap", 720, "trapezoid", 8),
    ("tiles", 360, "box", 32),
    ("gather", 360, "box", 16),
    ("gather", 540, "trapezoid", 8),
]


def test_the_sample_frame_is_that_of_python(visit, tmp_path):
    files = [tmp_path / f"{i}.png" for i in range(len(SAMPLE))]
    steps = []
    for file, (method, degrees, curve, samples) in zip(files, SAMPLE, strict=True):
        said = state(method=method, deg2=degrees, curve2=curve, samples=samples, line=0)
        steps += [go(said), *picture("#sample", file)]
    visit({"hash": state(method="tap"), "steps": steps})
    recording = make_page.page_recording
    for file, (method, degrees, curve, samples) in zip(files, SAMPLE, strict=True):
        options = recording.OPTIONS.get(method, {})
        blur = Blur(method, shutter=Shutter(degrees, curve=curve), samples=samples, **options)
        scene = make(recording.SCENE)
        want = Render(scene, blur, size=SIZE, antialias=recording.RAYS)(recording.TIME)
        check(file, want)


STEPS = [  # what a hand does, and what of the state it changes
    ({"do": "drag", "of": "#torusphere", "from": [0.5, 0.5], "to": [0.7, 0.6]}, {"x", "y"}),
    ({"do": "wheel", "of": "#torusphere", "dx": 120}, {"x"}),
    ({"do": "wheel", "of": "#strip", "dy": 100}, {"t"}),
    ({"do": "drag", "of": "#strip", "from": [0.6, 0.5], "to": [0.3, 0.5]}, {"t"}),
    ({"do": "click", "of": "#forward"}, {"t"}),
    ({"do": "key", "name": "ArrowLeft"}, {"t"}),
    ({"do": "key", "name": "Shift+ArrowUp"}, {"y"}),
    ({"do": "key", "name": "]"}, {"deg"}),
    ({"do": "key", "name": "c"}, {"curve"}),
    ({"do": "key", "name": "f"}, {"fps"}),
    ({"do": "click", "of": "[name=density][value=published]"}, {"density"}),
    ({"do": "fill", "of": "#degrees", "value": 360}, {"deg"}),
    ({"do": "click", "of": "[name=method][value=tap]"}, {"method"}),
    ({"do": "click", "of": "[name=samples][value='32']"}, {"samples"}),
    ({"do": "click", "of": "[name=curve2][value=cosine]"}, {"curve2"}),
    ({"do": "fill", "of": "#degrees2", "value": 720}, {"deg2"}),
    ({"do": "drag", "of": "#wipe", "from": [0.5, 0.3], "to": [0.8, 0.3]}, {"line"}),
]


def test_hands_change_the_state_the_picture_and_the_address(visit, tmp_path):
    note = {"do": "evaluate", "script": "({...wgmb.state})"}
    canvas = ["#torusphere" if names & {*"xyt", "deg", "curve", "fps", "density"} else "#sample"
              for _, names in STEPS]  # fmt: skip
    files = [tmp_path / f"{i}.png" for i in range(len(STEPS))]
    begin = {of: tmp_path / f"{of[1:]}.png" for of in ("#torusphere", "#sample")}
    steps = [note, *picture("#torusphere", begin["#torusphere"])]
    for (act, names), of, file in zip(STEPS, canvas, files, strict=True):
        if names == {"method"}:
            steps += picture(of, begin[of])
        steps += [act, note, *picture(of, file)]
    wait = {"do": "evaluate", "script": "new Promise(r => setTimeout(r, 500))"}
    (seen,) = visit({"hash": "still=1&t=20&size=320x180", "steps": [*steps, wait]})
    states = [s for s in seen["results"] if isinstance(s, dict) and "curve2" in s]
    assert len(states) == len(STEPS) + 1
    for (act, names), before, after in zip(STEPS, states[:-1], states[1:], strict=True):
        assert {n for n in before if before[n] != after[n]} == names, act
    shown = {of: iio.imread(file) for of, file in begin.items()}
    for (act, _), of, file in zip(STEPS, canvas, files, strict=True):
        now = iio.imread(file)
        assert (now != shown[of]).any(), act
        shown[of] = now
    said = dict(re.findall(r"(\w+)=([^&]+)", seen["address"]))
    assert said["method"] == "tap" and said["density"] == "published" and said["deg2"] == "720"


def test_what_moves_is_seen_at_once_and_a_lost_device_begins_anew(visit):
    moving = (
        "new Promise(r => { const t = wgmb.state.t; setTimeout(() => r(wgmb.state.t - t), 1500); })"
    )
    lose = (
        "new Promise(r => { wgmb.view.device.destroy();"
        " setTimeout(() => r(document.documentElement.dataset.mode), 3000); })"
    )
    seen, calm = visit(
        {"hash": "size=160x90", "steps": [
            {"do": "evaluate", "script": moving}, {"do": "evaluate", "script": lose},
            {"do": "evaluate", "script": moving}, {"do": "evaluate", "script": lose},
        ]},
        {"media": {"reducedMotion": "reduce"}, "steps": [{"do": "evaluate", "script": moving}]},
    )  # fmt: skip
    first, again, after, gone = seen["results"]
    assert first > 0.2 and again == "live" and after > 0.2 and gone == "recording"
    assert calm["results"] == [0]


PICTURES = """({
  video: document.querySelector('video')?.readyState ?? 0,
  canvases: [...document.querySelectorAll('.stage canvas, .wipe canvas')]
    .filter(c => c.offsetParent).length,
  images: [...document.images].every(i => i.complete && i.naturalWidth > 0),
  note: document.getElementById('note').textContent,
})"""


def test_without_webgpu_there_is_a_recording(visit):
    gone = "Object.defineProperty(navigator, 'gpu', { value: undefined })"
    wait = {"do": "evaluate", "script": "new Promise(r => setTimeout(r, 500))"}
    look = {"do": "evaluate", "script": PICTURES}
    wipe = {"do": "drag", "of": "#wipe", "from": [0.5, 0.3], "to": [0.2, 0.3]}
    for seen in visit(
        {"webgpu": False, "steps": [wait, look, wipe]},
        {"webgpu": False, "script": gone, "steps": [wait, look, wipe]},
        {"webgpu": False, "phone": True, "width": 390, "steps": [wait, look]},
    ):
        assert seen["mode"] == "recording"
        there = seen["results"][1]
        assert there["video"] >= 2 and there["images"] and there["canvases"] == 0
        assert "WebGPU" in there["note"]


OWN = """(async () => {
  const files = new DataTransfer();
  for (let n = 0; n < COUNT; n++) {
    const canvas = new OffscreenCanvas(160, 96), context = canvas.getContext('2d');
    const box = (v, ...place) => {
      context.fillStyle = `rgb(${v} ${v} ${v})`;
      context.fillRect(...place);
    };
    box(60, 0, 0, 160, 96);
    for (let j = 0; j < 16; j++) for (let i = 0; i < 16; i++) {
      box(60 + (i * i * 31 + j * 57 + i * j * 19) % 190, 40 + 4 * i + 8 * n, 16 + 4 * j, 4, 4);
    }
    const blob = await canvas.convertToBlob();
    files.items.add(new File([blob], `shot.${n}.png`, { type: 'image/png' }));
  }
  const input = document.getElementById('own-files');
  input.files = files.files;
  input.dispatchEvent(new Event('change'));
  await wgmb.settled();
  const note = document.getElementById('own-note');
  return note.hidden ? '' : note.textContent;
})()"""


def own(number: int) -> np.ndarray:
    """The picture of that number which OWN draws, as display values."""
    found = np.full((96, 160), 60.0)
    j, i = np.mgrid[:16, :16]
    square = 60 + (i * i * 31 + j * 57 + i * j * 19) % 190
    found[16:80, 40 + 8 * number :][:, :64] = square.repeat(4, 0).repeat(4, 1)
    return found / 255


@pytest.mark.covers(0)
@pytest.mark.parametrize("count", [2, 3])
def test_pictures_of_ones_own_are_blurred_along_their_motion(visit, tmp_path, count):
    sharp, blurred = tmp_path / "sharp.png", tmp_path / "blurred.png"
    give = {"do": "evaluate", "script": OWN.replace("COUNT", str(count))}
    chosen = state(deg2=360, curve2="box", samples=32, line=0)
    steps = [give, *picture("#own", blurred), go(state(deg2=360, curve2="box", line=1)),
             *picture("#own", sharp)]  # fmt: skip
    (seen,) = visit({"hash": chosen, "steps": steps})
    assert seen["results"][0] == ""
    shown = 1 if count == 3 else 0
    got = iio.imread(sharp)[..., :3] / 255
    np.testing.assert_allclose(got, own(shown)[..., None].repeat(3, 2), atol=0.006)
    # The square moves 8 pixels a frame: the mean of its positions from 4 before to 4 after.
    light = linear(own(shown))
    moved = [np.roll(light, by, 1) for by in np.linspace(-3.875, 3.875, 32).round().astype(int)]
    want, got = srgb(np.mean(moved, axis=0)), iio.imread(blurred)[..., 0] / 255
    inner = np.s_[20:76, 40 + 8 * shown + 8 : 104 + 8 * shown - 8]
    error = -10 * np.log10(np.mean((got - want)[inner] ** 2))
    plain = -10 * np.log10(np.mean((own(shown) - want)[inner] ** 2))
    assert error > plain + 6, (error, plain)


def test_files_that_do_not_fit_are_told(visit):
    one = {"do": "evaluate", "script": OWN.replace("COUNT", "1")}
    (seen,) = visit({"hash": state(), "steps": [one]})
    assert seen["results"] == ["Motion needs two pictures that follow one another, or a video."]


@pytest.mark.full
def test_phones_and_desks(visit):
    tap = {"do": "tap", "of": "#wipe", "at": [0.25, 0.3]}
    line = {"do": "evaluate", "script": "wgmb.state.line"}
    tall = {"do": "evaluate", "script": OWN.replace("COUNT", "2").replace("160, 96", "96, 192")}
    box = "document.getElementById('own-wipe').getBoundingClientRect()"
    look = {"do": "evaluate", "script": f"[{box}.width / {box}.height, {box}.height, innerHeight]"}
    phone, desk = visit(
        {"phone": True, "width": 390, "height": 844, "steps": [tap, line]},
        {"width": 1280, "hash": "still=1", "steps": [tall, look]},
    )
    assert phone["mode"] == desk["mode"] == "live"
    assert phone["results"][1] == pytest.approx(0.25, abs=0.02)
    told, (aspect, high, window) = desk["results"]
    assert told == "" and aspect == pytest.approx(1 / 2, rel=0.01)
    assert high <= window, "a tall picture is seen as a whole"


@pytest.mark.full
def test_the_page_is_made_the_same_every_time(page):
    text = page.read_text("utf-8")
    assert make_page.page() == text
    assert len(text.encode()) <= make_page.MOST
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//|@import|url\(""", text)


def test_the_page_loads_nothing(page):
    page = Page(page.read_text("utf-8"))
    loaded = [a for a in page.addresses if not a.startswith(("#", "data:", "https://"))]
    assert not loaded  # https: where a reader may click
    assert ("link", "rel", "href") not in page.elements or all(
        "stylesheet" not in text for text in page.texts
    )
    scripts = [element for element in page.elements if element[0] in ("script", "iframe")]
    assert scripts and not any("src" in element for element in scripts)
    assert not re.findall(r"@import|XMLHttpRequest|WebSocket|EventSource", "".join(page.code))


def test_the_page_is_written_where_the_documentation_and_the_release_take_it(tmp_path, monkeypatch):
    monkeypatch.setattr(make_page, "page", lambda: "<html>")
    monkeypatch.setattr(make_page, "OUTPUT", tmp_path / "page" / make_page.OUTPUT.name)
    monkeypatch.setattr("sys.argv", ["make_page.py"])
    assert make_page.main() == 0
    assert make_page.OUTPUT.read_text("utf-8") == "<html>"
    monkeypatch.undo()
    config = (HERE.parent / "docs" / "conf.py").read_text("utf-8")
    (name,) = re.findall(r'^html_extra_path = \["(.*?)"\]', config, re.M)
    assert (HERE.parent / "docs" / name).resolve() == make_page.OUTPUT
    recipe = (HERE.parent / "run").read_text("utf-8")
    made, built = recipe.index("tools/page/make_page.py"), recipe.index("-m sphinx")
    assert made < built
    release = (HERE.parent / ".github" / "workflows" / "release.yml").read_text("utf-8")
    assert release.index("run: ./run docs") < release.index("path: build/docs/page.html")


def test_places_and_modules_are_checked():
    with pytest.raises(ValueError, match="places"):
        make_page.filled("/*ONE*/", {"TWO": ""})
    with pytest.raises(ValueError, match="cannot join"):
        make_page.joined(
            "a.js", {"a.js": "import { b } from './b.js';\n", "b.js": "export default 1;\n"}
        )
    joined = make_page.joined(
        "a.js",
        {"a.js": "import { b } from './b.js';\nb();\n", "b.js": "export function b() {}\n"},
    )
    assert "const module_b = (() => {" in joined and "const { b } = module_b;" in joined
